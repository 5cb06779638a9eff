//! Least squares by a few columns.

use plant::kernels::dot;

/// Share of a column's squares below which nothing of it is left beside the columns before: rounding alone.
const DEPENDENT: f64 = 1e-12;

/// The residual of `y` after a least-squares fit by `columns` (Gram and Schmidt's orthogonalisation); a column that depends on those
/// before it counts for nothing.
pub fn residual(y: &[f64], columns: &[Vec<f64>]) -> Vec<f64> {
    let mut left = y.to_vec();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for c in columns {
        let mut c = c.clone();
        let size = dot(&c, &c);
        basis.iter().for_each(|q| project_out(&mut c, q));
        let norm = dot(&c, &c);
        if norm <= DEPENDENT * size {
            continue;
        }
        c.iter_mut().for_each(|v| *v /= norm.sqrt());
        project_out(&mut left, &c);
        basis.push(c);
    }
    left
}

/// Takes the part along the unit vector `q` out of `v`.
pub fn project_out(v: &mut [f64], q: &[f64]) {
    let share = dot(v, q);
    v.iter_mut().zip(q).for_each(|(v, q)| *v -= share * q);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_least_squares_leave_is_orthogonal_to_the_columns() {
        let y = [1.0, 2.0, 0.5, -1.0];
        let columns = [vec![1.0, 1.0, 1.0, 1.0], vec![0.0, 1.0, 2.0, 3.0], vec![2.0, 2.0, 2.0, 2.0]];
        let left = residual(&y, &columns);
        assert!(columns.iter().all(|c| dot(c, &left).abs() < 1e-12));
    }
}
