//! Robust figures of a row of numbers.

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
