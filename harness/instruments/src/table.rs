//! Tables of points.

/// The value at `x` of a table whose `from` rises: linear between the points, constant beyond them; NaN at NaN.
pub(crate) fn linear(from: &[f64], to: &[f64], x: f64) -> f64 {
    if x.is_nan() {
        return f64::NAN;
    }
    let after = from.partition_point(|p| *p <= x);
    if after == 0 {
        return to[0];
    }
    if after == from.len() {
        return to[after - 1];
    }
    let part = (x - from[after - 1]) / (from[after] - from[after - 1]);
    to[after - 1] + part * (to[after] - to[after - 1])
}

/// The value of the point nearest to `x`, of a table whose `from` rises; of two as near, the lower; NaN at NaN.
pub(crate) fn nearest(from: &[f64], to: &[f64], x: f64) -> f64 {
    if x.is_nan() {
        return f64::NAN;
    }
    let after = from.partition_point(|p| *p < x);
    if after == 0 {
        return to[0];
    }
    let upper = after < from.len() && x - from[after - 1] > from[after] - x;
    to[if upper { after } else { after - 1 }]
}
