//! Smooth courses out of noisy readings: value and slope of every sample, and the corners where a slope jumps.

use nalgebra::{Matrix3, Vector3};

/// Half widths tried by the adaptive smoother.
const WIDTHS: [usize; 7] = [3, 5, 8, 13, 21, 34, 55];

/// Smooths by local quadratics whose width grows at each sample as long as the estimates agree within their
/// confidence (intersection of confidence intervals: Goldenshluger and Nemirovski 1997). `sigma` is the noise's
/// standard deviation at low frequency. Returns value and slope per sample.
pub fn smooth(y: &[f64], sigma: f64) -> (Vec<f64>, Vec<f64>) {
    let n = y.len();
    let (mut s, mut d) = (vec![0.0; n], vec![0.0; n]);
    for i in 0..n {
        let (mut lo, mut hi) = (f64::MIN, f64::MAX);
        for h in WIDTHS {
            if 2 * h + 1 > n {
                break;
            }
            let (a, b) = (i.saturating_sub(h), (i + h).min(n - 1));
            let (mut m, mut q) = ([0.0; 5], [0.0; 3]);
            for (j, yj) in y.iter().enumerate().take(b + 1).skip(a) {
                let t = (j as f64 - i as f64) / h as f64;
                let mut w = 1.0;
                for k in 0..5 {
                    m[k] += w;
                    if k < 3 {
                        q[k] += w * yj;
                    }
                    w *= t;
                }
            }
            let mat = Matrix3::new(m[0], m[1], m[2], m[1], m[2], m[3], m[2], m[3], m[4]);
            let Some(inv) = mat.try_inverse() else { break };
            let sol = inv * Vector3::new(q[0], q[1], q[2]);
            let sd = sigma * inv[(0, 0)].max(0.0).sqrt();
            let (l, u) = (sol[0] - 2.2 * sd, sol[0] + 2.2 * sd);
            if h > WIDTHS[0] && (l > hi || u < lo) {
                break;
            }
            lo = lo.max(l);
            hi = hi.min(u);
            s[i] = sol[0];
            d[i] = sol[1] / h as f64;
        }
    }
    (s, d)
}

/// Half widths over which a corner is sought.
const CORNER_WIDTHS: [usize; 3] = [8, 13, 21];
/// Standard deviations of chi^2 up to which a hinge leaves noise alone.
const NOISE_ALONE: f64 = 3.0;

/// chi^2 of the best sum of `columns` over a window of readings in units of their noise; None where the columns are not
/// independent.
fn left_by(columns: [&dyn Fn(f64) -> f64; 3], window: &[f64]) -> Option<f64> {
    let h = (window.len() / 2) as f64;
    let (mut m, mut q, mut yy) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
    for (j, y) in window.iter().enumerate() {
        let t = j as f64 / h - 1.0;
        let row = Vector3::from(columns.map(|c| c(t)));
        m += row * row.transpose();
        q += row * *y;
        yy += y * y;
    }
    Some(yy - q.dot(&(m.try_inverse()? * q)))
}

/// Samples of `y` at which its slope jumps, as where a ramp ends in a hold: a hinge there is likelier than a parabola, of as
/// many parameters, by more than one in as many places as there are samples, and leaves noise alone. `sigma`: standard
/// deviation of the noise at low frequency. Increasing, and far enough from each other to smooth what lies between.
pub fn corners(y: &[f64], sigma: f64) -> Vec<usize> {
    let n = y.len();
    let prior = (n as f64).ln();
    let gain = |i: usize| -> Option<f64> {
        let of = |h: usize| {
            (i >= h && i + h < n).then_some(())?;
            let window: Vec<f64> = y[i - h..=i + h].iter().map(|v| (v - y[i]) / sigma).collect();
            let hinge = left_by([&|_| 1.0, &|t| t, &f64::abs], &window)?;
            let parabola = left_by([&|_| 1.0, &|t| t, &|t| t * t], &window)?;
            let freedom = (2 * h - 2) as f64;
            (hinge < freedom + NOISE_ALONE * (2.0 * freedom).sqrt()).then_some(0.5 * (parabola - hinge) - prior)
        };
        CORNER_WIDTHS.into_iter().filter_map(of).reduce(f64::max).filter(|g| *g > 0.0)
    };
    let mut found: Vec<(usize, f64)> = (0..n).filter_map(|i| Some((i, gain(i)?))).collect();
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut kept: Vec<usize> = Vec::new();
    for (i, _) in found {
        if kept.iter().all(|k| k.abs_diff(i) > CORNER_WIDTHS[0]) {
            kept.push(i);
        }
    }
    kept.sort_unstable();
    kept
}

/// As [`smooth`], no window reaching over one of `corners`.
pub fn smooth_between(y: &[f64], corners: &[usize], sigma: f64) -> (Vec<f64>, Vec<f64>) {
    let ends: Vec<usize> = [0].into_iter().chain(corners.iter().copied()).chain([y.len()]).collect();
    let pieces = ends.windows(2).map(|e| smooth(&y[e[0]..e[1]], sigma));
    let (values, slopes): (Vec<_>, Vec<_>) = pieces.unzip();
    (values.concat(), slopes.concat())
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    fn noise(seed: u64, n: usize) -> Vec<f64> {
        let mut rng = rand::rngs::StdRng::seed_from_u64(seed);
        (0..n).map(|_| (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0).collect()
    }

    /// A ramp, a hold and a ramp back, over 400 samples.
    fn protocol(i: usize) -> f64 {
        let t = i as f64;
        (2.0 * t).min(300.0).min(2.0 * (400.0 - t))
    }

    #[test]
    fn the_corners_of_a_ramp_and_a_hold_are_found_and_the_rate_beside_them_is_right() {
        for seed in 0..20 {
            let y: Vec<f64> = noise(seed, 400).iter().enumerate().map(|(i, e)| protocol(i) + e).collect();
            let found = corners(&y, 1.0);
            assert_eq!(found.len(), 2, "{seed}: {found:?}");
            assert!(found[0].abs_diff(150) <= 2 && found[1].abs_diff(250) <= 2, "{seed}: {found:?}");
            let (_, slope) = smooth_between(&y, &found, 1.0);
            let off = |i: usize| (slope[i] - (protocol(i + 1) - protocol(i))).abs();
            let beside = |c: usize| (c - 12..c - 2).chain(c + 3..c + 12).map(off).sum::<f64>() / 19.0;
            assert!(beside(150) < 0.35 && beside(250) < 0.35, "{seed}: {} {}", beside(150), beside(250));
        }
    }

    #[test]
    fn a_smooth_path_has_no_corner() {
        for seed in 0..20 {
            let path = |i: usize| 300.0 * (std::f64::consts::PI * i as f64 / 400.0).sin();
            let y: Vec<f64> = noise(100 + seed, 400).iter().enumerate().map(|(i, e)| path(i) + e).collect();
            assert!(corners(&y, 1.0).is_empty(), "{seed}: {:?}", corners(&y, 1.0));
        }
    }

    #[test]
    fn what_is_short_has_no_corner() {
        assert!(corners(&[], 1.0).is_empty() && corners(&[1.0; 10], 1.0).is_empty());
        assert_eq!(smooth_between(&[2.0; 9], &[], 1.0).0.len(), 9);
    }
}
