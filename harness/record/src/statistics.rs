//! Robust figures of a row of numbers, noise on a smooth course, and means of its samples.

/// The middle of the values sorted; the upper one of two. At least one.
pub fn median(mut v: Vec<f64>) -> f64 {
    let middle = v.len() / 2;
    *v.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Standard deviation of normal deviates of these magnitudes, by their median, which outliers do not move. At least one.
pub fn spread(magnitudes: Vec<f64>) -> f64 {
    // the median of a normal magnitude is 0.6745 standard deviations
    median(magnitudes) / 0.6745
}

/// Standard deviation of the white noise on a smooth course. At least four samples.
pub fn spread_of_course(y: &[f64]) -> f64 {
    spread(thirds(y)) / 20f64.sqrt()
}

/// Magnitudes of the differences of third order, which see noise alone where the signal is smooth; their variance is
/// 20 times that of white noise. At least four samples.
pub fn thirds(y: &[f64]) -> Vec<f64> {
    y.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs()).collect()
}

/// Means of `m` samples each; what is left at the end belongs to none.
pub fn means(y: &[f64], m: usize) -> Vec<f64> {
    y.chunks_exact(m).map(|b| b.iter().sum::<f64>() / m as f64).collect()
}
