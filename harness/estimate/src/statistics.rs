//! Noise on a smooth course, and means of its samples.

use record::statistics::spread;

/// Standard deviation of the white noise on a smooth course. At least four samples.
pub(crate) fn spread_of_course(y: &[f64]) -> f64 {
    spread(thirds(y)) / 20f64.sqrt()
}

/// Magnitudes of the differences of third order, which see noise alone where the signal is smooth; their variance is
/// 20 times that of white noise. At least four samples.
pub(crate) fn thirds(y: &[f64]) -> Vec<f64> {
    y.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs()).collect()
}

/// Means of `m` samples each; what is left at the end belongs to none.
pub(crate) fn means(y: &[f64], m: usize) -> Vec<f64> {
    y.chunks_exact(m).map(|b| b.iter().sum::<f64>() / m as f64).collect()
}
