//! The power law that a contact nearly follows, from its force along a motion.

use plant::squares::TwoTerms;

/// Range of exponents, and share of it to which the best is found.
const EXPONENTS: (f64, f64) = (0.4, 5.0);
const NARROW: f64 = 1e-7;
/// Share of the force below which damping is none: what the steps of a simulation leave.
const DAMPED: f64 = 1e-9;
/// Least samples of a contact.
const LEAST: usize = 8;

/// One instant of a contact: penetration m, its rate m/s, force N.
pub(super) type Sample = (f64, f64, f64);

/// F = k x^p (1 + r v): ln k, p and r.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Law {
    pub ln_k: f64,
    pub p: f64,
    pub r: f64,
}

/// The law nearest to `samples` by least squares; None of fewer than eight in contact, or where none pushes.
pub(super) fn law(samples: &[Sample]) -> Option<Law> {
    let inside: Vec<Sample> = samples.iter().copied().filter(|s| s.0 > 0.0 && s.2 > 0.0).collect();
    let deepest = inside.iter().map(|s| s.0).fold(0.0, f64::max);
    if inside.len() < LEAST || deepest <= 0.0 {
        return None;
    }
    // golden section: the misfit has one valley over the exponent
    let shrink = 0.5 * (5f64.sqrt() - 1.0);
    let (mut low, mut high) = EXPONENTS;
    let misfit = |p: f64| at(&inside, deepest, p).2;
    let (mut a, mut b) = (high - shrink * (high - low), low + shrink * (high - low));
    let (mut fa, mut fb) = (misfit(a), misfit(b));
    while high - low > NARROW {
        if fa < fb {
            (high, b, fb) = (b, a, fa);
            a = high - shrink * (high - low);
            fa = misfit(a);
        } else {
            (low, a, fa) = (a, b, fb);
            b = low + shrink * (high - low);
            fb = misfit(b);
        }
    }
    let p = 0.5 * (low + high);
    let (k, kr, _) = at(&inside, deepest, p);
    let fastest = inside.iter().map(|s| s.1.abs()).fold(0.0, f64::max);
    let r = Some(kr / k).filter(|r| r * fastest > DAMPED).unwrap_or(0.0);
    (k > 0.0).then(|| Law { ln_k: k.ln() - p * deepest.ln(), p, r })
}

/// Coefficients of (x/deepest)^p and of that times v, neither negative, and the sum of squares that they leave.
fn at(samples: &[Sample], deepest: f64, p: f64) -> (f64, f64, f64) {
    let row = |(x, v, f): &Sample| {
        let a = (x / deepest).powf(p);
        (a, a * v, *f)
    };
    let sums: TwoTerms = samples.iter().map(row).collect();
    let of = sums.both(1e-12).filter(|c| c.0 >= 0.0 && c.1 >= 0.0).unwrap_or(sums.first());
    (of.0, of.1, sums.rest(of))
}

/// Share of the scatter that has to be left at most for a force to be taken for one of position and speed.
const STEADY: f64 = 0.1;

/// Rows without their means.
fn centred(rows: &[Sample]) -> Vec<Sample> {
    let n = rows.len() as f64;
    let mean = |of: fn(&Sample) -> f64| rows.iter().map(of).sum::<f64>() / n;
    let (mx, mv, mf) = (mean(|r| r.0), mean(|r| r.1), mean(|r| r.2));
    rows.iter().map(|(x, v, f)| (x - mx, v - mv, f - mf)).collect()
}

/// How a force falls with position and speed: rates (k, c) of F = f - k x - c v by least squares over rows (x, v, F); zero where
/// a tenth of the scatter stays.
pub(super) fn steady(rows: &[Sample]) -> (f64, f64) {
    if rows.len() < LEAST {
        return (0.0, 0.0);
    }
    let sums: TwoTerms = centred(rows).into_iter().collect();
    let both = sums.both(1e-9).unwrap_or_default();
    let place = Some(sums.first()).filter(|k| k.0.is_finite()).unwrap_or_default();
    // the plainer one where it does as well
    let (k, c) = if sums.rest(place) <= 2.0 * sums.rest(both) { place } else { both };
    if sums.rest((k, c)) < STEADY * sums.square() {
        (-k, -c)
    } else {
        (0.0, 0.0)
    }
}

/// Sum of squares of the force that one pair of rates leaves on two sides, over that of a pair for each side, up to which both sides
/// share one.
const ONE: f64 = 1.5;

/// Whether a force depends on position and speed alike on two sides: F = f - k x - c v with one k and c leaves no more of it than with
/// two. Rows (x, v, F) of each; false of fewer than eight.
pub(super) fn is_one(sides: [&[Sample]; 2]) -> bool {
    if sides.iter().any(|s| s.len() < LEAST) {
        return false;
    }
    let left = |rows: &[Sample]| {
        let sums: TwoTerms = rows.iter().copied().collect();
        sums.rest(sums.both(1e-9).unwrap_or_default())
    };
    let [a, b] = sides.map(centred);
    left(&[&a[..], &b[..]].concat()) <= ONE * (left(&a) + left(&b))
}

/// Correlation of two courses; 0 where one of them does not move.
pub(super) fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len()) as f64;
    let (ma, mb) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let (mut aa, mut ab, mut bb) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        aa += (x - ma) * (x - ma);
        ab += (x - ma) * (y - mb);
        bb += (y - mb) * (y - mb);
    }
    if aa > 0.0 && bb > 0.0 {
        ab / (aa * bb).sqrt()
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spring_that_goes_on_beyond_the_surface_is_one_and_a_stop_is_not() {
        // an oscillator that is driven, and the same with a stop ten times as stiff
        let rows = |stop: f64| {
            let at = |i: usize| {
                let t = 0.05 * i as f64;
                let (x, v) = ((3.0 * t).sin() + 0.2 * (7.1 * t).sin(), 3.0 * (3.0 * t).cos() + 1.42 * (7.1 * t).cos());
                (x, v, -9.0 * x - 0.1 * v + 2.0 * (1.3 * t).sin() - stop * x.max(0.0))
            };
            (0..400).map(at).partition::<Vec<Sample>, _>(|s| s.0 < 0.0)
        };
        let (before, beyond) = rows(0.0);
        assert!(is_one([&before, &beyond]));
        let (before, beyond) = rows(90.0);
        assert!(!is_one([&before, &beyond]) && !is_one([&before[..4], &beyond]));
    }

    #[test]
    fn a_power_law_is_found_again_from_its_own_force() {
        for (k, p, r) in [(2.3e6f64, 1.0, 0.0), (4e7, 1.5, 0.12), (8e5, 0.82, 0.3)] {
            let samples: Vec<Sample> = (1..200)
                .map(|i| {
                    let u = std::f64::consts::PI * f64::from(i) / 200.0;
                    let (x, v) = (3e-4 * u.sin(), 0.7 * u.cos());
                    (x, v, k * x.powf(p) * (1.0 + r * v))
                })
                .collect();
            let l = law(&samples).unwrap();
            assert!((l.ln_k - k.ln()).abs() < 1e-5 && (l.p - p).abs() < 1e-6 && (l.r - r).abs() < 1e-6, "{l:?}");
        }
        // rounding is no damping
        let elastic = |x: f64, v: f64| (x, v, 2e6 * x * (1.0 + 1e-14 * v));
        let samples: Vec<Sample> =
            (1..50).map(|i| elastic(1e-5 * f64::from(i.min(50 - i)), 25.0 - f64::from(i))).collect();
        assert_eq!(law(&samples).unwrap().r, 0.0);
        assert_eq!(law(&[(1e-3, 0.0, 1.0); 3]), None);
        assert_eq!(law(&[(-1e-3, 0.0, 1.0); 30]), None);
    }
}
