//! One step of Dormand and Prince 1980, 5(4), over a small state vector, with rates that may fail.

use anyhow::Result;
use plant::tableau::{A, C, E};

/// Most state variables a rig here has.
pub const MOST: usize = 10;
/// State vector; only the first `n` entries are used.
pub type State = [f64; MOST];

/// A step of `h` from (`t`, `y`) whose rates there are `k0`: the state after it, and its error.
///
/// # Errors
/// As the rates give them.
pub fn step(
    n: usize,
    t: f64,
    y: &State,
    h: f64,
    k0: &State,
    rates: &mut dyn FnMut(f64, &State) -> Result<State>,
) -> Result<(State, State)> {
    let mut k = [[0.0; MOST]; 7];
    k[0] = *k0;
    let mut z = *y;
    for i in 1..7 {
        for j in 0..n {
            let mut sum = 0.0;
            for l in 0..i {
                sum += A[i][l] * k[l][j];
            }
            z[j] = y[j] + h * sum;
        }
        k[i] = rates(t + C[i] * h, &z)?;
    }
    let mut e = [0.0; MOST];
    for j in 0..n {
        let mut sum = 0.0;
        for i in 0..7 {
            sum += E[i] * k[i][j];
        }
        e[j] = h * sum;
    }
    Ok((z, e))
}

/// The place in (0, `h`] where `g` changes sign, from its values at both ends: false position after Illinois
/// (Dowell and Jarratt 1971), its far side. `switch`: `g` knows only two values, so halve.
///
/// # Errors
/// As `g` gives them.
pub fn root(h: f64, ends: (f64, f64), switch: bool, g: &mut dyn FnMut(f64) -> Result<f64>) -> Result<f64> {
    let (mut lo, mut hi) = (0.0, h);
    let (mut glo, mut ghi) = ends;
    let mut side = 0;
    for _ in 0..80 {
        if hi - lo <= 1e-15 * h {
            break;
        }
        let mut mid = 0.5 * (lo + hi);
        if !switch {
            let guess = (lo * ghi - hi * glo) / (ghi - glo);
            if guess > lo && guess < hi {
                mid = guess;
            }
        }
        let v = g(mid)?;
        if v == 0.0 {
            return Ok(mid);
        }
        if v * ends.0 > 0.0 {
            // close enough that only rounding is left
            if !switch && mid - lo <= 1e-15 * h && side == -1 {
                return Ok(hi.min(mid + 2e-15 * h));
            }
            (lo, glo) = (mid, v);
            if side == -1 {
                ghi *= 0.5;
            }
            side = -1;
        } else {
            if !switch && hi - mid <= 1e-15 * h && side == 1 {
                return Ok(mid);
            }
            (hi, ghi) = (mid, v);
            if side == 1 {
                glo *= 0.5;
            }
            side = 1;
        }
    }
    Ok(hi)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_has_its_order_and_its_error_tells() {
        let mut rates = |t: f64, y: &State| {
            let mut d = [0.0; MOST];
            d[0] = y[0] * t.cos();
            Ok(d)
        };
        let mut worst = Vec::new();
        for h in [0.1, 0.05] {
            let mut y = [0.0; MOST];
            y[0] = 1.0;
            let k0 = rates(0.0, &y).unwrap();
            let (z, e) = step(1, 0.0, &y, h, &k0, &mut rates).unwrap();
            worst.push((z[0] - h.sin().exp()).abs());
            assert!(e[0].abs() > worst[worst.len() - 1]);
        }
        // a step of order five is wrong by h^6
        let order = (worst[0] / worst[1]).log2();
        assert!((5.4..6.8).contains(&order), "{order}");
    }

    #[test]
    fn roots_are_found_to_rounding_whatever_the_shape() {
        for (power, at) in [(1.0, 0.3), (3.0, 0.7), (9.0, 0.123)] {
            let f = |x: f64| x.powf(power) - f64::powf(at, power);
            let r = root(1.0, (f(0.0), f(1.0)), false, &mut |x| Ok(f(x))).unwrap();
            assert!((r - at).abs() < 1e-14, "{r} {at}");
        }
        let f = |x: f64| if x < 0.625_001 { 1.0 } else { -1.0 };
        let r = root(1.0, (1.0, -1.0), true, &mut |x| Ok(f(x))).unwrap();
        assert!((r - 0.625_001).abs() < 1e-14 && f(r) < 0.0);
    }
}
