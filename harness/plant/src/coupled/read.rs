//! What the channels of a recording read of FMUs.

use crate::machine::Reads;
use crate::simulate::Trace;

/// Puts a bond's row of force N, acceleration m/s^2, position m and speed m/s where they are read.
pub(super) fn put(
    out: &mut Trace,
    other: &mut [Option<Vec<f64>>; 3],
    reads: [Option<Reads>; 3],
    (bond, watched): (usize, usize),
    i: usize,
    row: [f64; 4],
) {
    if bond == watched {
        out.put(i, row);
    }
    for c in 0..3 {
        if let (Some(Reads::Bond(b)), Some(y)) = (reads[c], &mut other[c]) {
            if b == bond {
                y[i] = row[c];
            }
        }
    }
}

/// Value at `t` on the cubic through the four points about it (Lagrange), of those between the two `breaks` about it: where a
/// contact begins or ends no smooth curve leads across. On the line or the parabola through fewer; on the nearest ones at the ends.
pub(super) fn between(points: &[(f64, f64)], breaks: &[f64], t: f64) -> f64 {
    let after = breaks.partition_point(|b| *b <= t);
    let from = after.checked_sub(1).map_or(0, |b| points.partition_point(|p| p.0 < breaks[b]));
    let until = breaks.get(after).map_or(points.len(), |b| points.partition_point(|p| p.0 <= *b));
    let points = &points[from..until.max(from)];
    let n = points.len();
    let order = n.min(4);
    if n < 2 || t <= points[0].0 {
        return points.first().map_or(f64::NAN, |p| p.1);
    }
    let next = points.partition_point(|p| p.0 <= t).min(n - 1);
    let from = next.saturating_sub(2).min(n - order);
    let near = &points[from..from + order];
    let mut sum = 0.0;
    for (j, (tj, yj)) in near.iter().enumerate() {
        let mut w = 1.0;
        for (k, (tk, _)) in near.iter().enumerate() {
            if k != j && tj != tk {
                w *= (t - tk) / (tj - tk);
            }
        }
        sum += w * yj;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_read_exactly_between_uneven_points() {
        let cubic = |t: f64| 1.0 - 2.0 * t + 0.5 * t * t - 0.1 * t * t * t;
        let points: Vec<(f64, f64)> = [0.0, 0.3, 0.4, 1.1, 1.15, 2.0].map(|t| (t, cubic(t))).to_vec();
        for t in [0.0, 0.1, 0.35, 0.9, 1.12, 1.9, 2.0] {
            assert!((between(&points, &[], t) - cubic(t)).abs() < 1e-12, "{t}");
        }
        assert_eq!((between(&points, &[], -1.0), between(&[], &[], 0.0).is_nan()), (1.0, true));
    }

    #[test]
    fn no_curve_leads_across_a_touch() {
        // at rest until 0.4, rising from there
        let course = |t: f64| (t - 0.4f64).max(0.0) * 3.0;
        let points: Vec<(f64, f64)> = [0.0, 0.3, 0.4, 0.5, 0.9, 2.0].map(|t| (t, course(t))).to_vec();
        for t in [0.1, 0.35, 0.4, 0.45, 0.7, 1.5] {
            assert!((between(&points, &[0.4], t) - course(t)).abs() < 1e-12, "{t}");
        }
        // the flight between two touches has its ends alone
        assert!((between(&points, &[0.3, 0.4], 0.35)).abs() < 1e-12);
    }
}
