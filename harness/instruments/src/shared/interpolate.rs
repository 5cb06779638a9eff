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

#[cfg(test)]
mod tests {
    use super::*;

    const FROM: [f64; 3] = [0.0, 1.0, 3.0];
    const TO: [f64; 3] = [5.0, 7.0, 1.0];

    #[test]
    fn linear_between_points_and_constant_beyond() {
        let values = [-1.0, 0.0, 0.5, 1.0, 2.0, 3.0, 9.0].map(|x| linear(&FROM, &TO, x));
        assert_eq!(values, [5.0, 5.0, 6.0, 7.0, 4.0, 1.0, 1.0]);
        assert!(linear(&FROM, &TO, f64::NAN).is_nan());
    }

    #[test]
    fn the_nearest_point_and_the_lower_of_two() {
        let values = [-1.0, 0.4, 0.5, 0.6, 2.0, 2.1, 9.0].map(|x| nearest(&FROM, &TO, x));
        assert_eq!(values, [5.0, 5.0, 5.0, 7.0, 7.0, 1.0, 1.0]);
        assert!(nearest(&FROM, &TO, f64::NAN).is_nan());
    }
}
