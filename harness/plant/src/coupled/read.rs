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

/// Value at `t` on the cubic through the four points about it (Lagrange); on the nearest ones at the ends.
pub(super) fn between(points: &[(f64, f64)], t: f64) -> f64 {
    let n = points.len();
    if n < 4 || t <= points[0].0 {
        return points.first().map_or(f64::NAN, |p| p.1);
    }
    let next = points.partition_point(|p| p.0 <= t).min(n - 1);
    let from = next.saturating_sub(2).min(n - 4);
    let near = &points[from..from + 4];
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
            assert!((between(&points, t) - cubic(t)).abs() < 1e-12, "{t}");
        }
        assert_eq!((between(&points, -1.0), between(&[], 0.0).is_nan()), (1.0, true));
    }
}
