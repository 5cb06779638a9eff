//! Where a function of one variable changes sign: false position after Illinois (Dowell and Jarratt 1971, BIT 11,
//! 168), with halving where that is cheaper or where there is no slope.

/// How a bracket is narrowed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Narrowing {
    /// To 1e-12 of the bracket, halved once it is below 1e-3 of it: for a function that costs next to nothing.
    Cheap,
    /// To 1e-15 of the bracket, by false position throughout: for a function that costs a step of an integration.
    Costly,
    /// To 1e-15 of the bracket by halving: the function knows only two values.
    Halving,
}

/// Values asked at most.
const MOST: [usize; 2] = [60, 80];

/// The place in (0, `width`] where `g` changes sign, from its values at both ends: the far side of the last bracket.
/// `width` > 0; `ends` of opposite sign.
///
/// # Errors
/// As `g` gives them.
pub fn crossing<E>(
    width: f64,
    ends: (f64, f64),
    how: Narrowing,
    mut g: impl FnMut(f64) -> Result<f64, E>,
) -> Result<f64, E> {
    let (fine, halved, most) = match how {
        Narrowing::Cheap => (1e-12 * width, 1e-3 * width, MOST[0]),
        Narrowing::Costly => (1e-15 * width, 0.0, MOST[1]),
        Narrowing::Halving => (1e-15 * width, f64::INFINITY, MOST[1]),
    };
    let (mut lo, mut hi) = (0.0, width);
    let (mut glo, mut ghi) = ends;
    let mut side = 0;
    for _ in 0..most {
        let bracket = hi - lo;
        if bracket <= fine {
            break;
        }
        let mut mid = if bracket < halved { 0.5 * (lo + hi) } else { (lo * ghi - hi * glo) / (ghi - glo) };
        if how == Narrowing::Costly && !(mid > lo && mid < hi) {
            mid = 0.5 * (lo + hi);
        }
        let v = g(mid)?;
        if v == 0.0 {
            return Ok(mid);
        }
        if v * ends.0 > 0.0 {
            // close enough that only rounding is left
            if how == Narrowing::Costly && mid - lo <= fine && side == -1 {
                return Ok(hi.min(mid + 2.0 * fine));
            }
            (lo, glo) = (mid, v);
            if side == -1 {
                ghi *= 0.5;
            }
            side = -1;
        } else {
            if how == Narrowing::Costly && hi - mid <= fine && side == 1 {
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
    use std::convert::Infallible;

    fn found(width: f64, how: Narrowing, f: impl Fn(f64) -> f64) -> (f64, usize) {
        let mut asked = 0;
        let r = crossing(width, (f(0.0), f(width)), how, |x| {
            asked += 1;
            Ok::<f64, Infallible>(f(x))
        });
        (r.unwrap_or_else(|e| match e {}), asked)
    }

    #[test]
    fn roots_are_found_to_rounding_whatever_the_shape() {
        for (power, at) in [(1.0, 0.3), (3.0, 0.7), (9.0, 0.123)] {
            for width in [1.0, 2.5e-6] {
                let f = |x: f64| (x / width).powf(power) - f64::powf(at, power);
                let (r, asked) = found(width, Narrowing::Costly, f);
                assert!((r / width - at).abs() < 1e-14 && asked < 40, "{r} {at} {asked}");
                let (r, asked) = found(width, Narrowing::Cheap, f);
                assert!((r / width - at).abs() < 2e-12 && asked <= 60, "{r} {at} {asked}");
            }
        }
    }

    #[test]
    fn a_switch_is_found_on_its_far_side() {
        let f = |x: f64| if x < 0.625_001 { 1.0 } else { -1.0 };
        let (r, _) = found(1.0, Narrowing::Halving, f);
        assert!((r - 0.625_001).abs() < 1e-14 && f(r) < 0.0);
    }

    #[test]
    fn a_smooth_root_costs_few_values() {
        let (r, asked) = found(1.0, Narrowing::Costly, |x| x.cos() - 0.8);
        assert!((r - 0.8f64.acos()).abs() < 1e-14 && asked < 12, "{asked}");
    }

    #[test]
    fn a_function_that_fails_ends_the_search() {
        let r = crossing(1.0, (-1.0, 1.0), Narrowing::Costly, |x| if x < 0.4 { Ok(-1.0) } else { Err("refused") });
        assert_eq!(r, Err("refused"));
    }
}
