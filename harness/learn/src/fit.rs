//! Sums of shapes whose coefficients are not negative, fitted shape by shape for as long as the evidence grows.

use nalgebra::{DMatrix, DVector};

/// What the evidence of a fit is worked out with.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Samples, and how many of them count as independent.
    pub samples: f64,
    pub independent: f64,
    /// Share of the range of force by which laws of contact are off where nothing is missing.
    pub discrepancy: f64,
}

impl Scale {
    /// ln evidence of `shapes` shapes that leave a sum of squares of `left` (share of the range of force, squared): noise and
    /// discrepancy in one variance (Schwarz 1978). Minus infinity where what is left is no number.
    pub fn ln_evidence(&self, left: f64, shapes: usize) -> f64 {
        if !left.is_finite() {
            return f64::NEG_INFINITY;
        }
        let variance = left.max(0.0) / self.samples + self.discrepancy * self.discrepancy;
        -0.5 * self.independent * variance.ln() - 0.5 * shapes as f64 * self.independent.ln()
    }
}

/// A fit.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    pub ln_evidence: f64,
    /// Sum of squares left.
    pub left: f64,
    /// Not negative, in the order of the shapes; most are 0.
    pub coefficients: Vec<f64>,
}

/// Shapes tried beyond the most evidence, and shapes at most.
const FURTHER: usize = 6;
const MOST: usize = 80;
/// Exchanges of shapes after one was added.
const EXCHANGES: usize = 50;

/// The normal equations of shapes A and readings y: A'A, A'y and y'y.
#[derive(Clone)]
pub struct Normal {
    pub a: DMatrix<f64>,
    pub b: DVector<f64>,
    pub yy: f64,
}

impl Normal {
    /// Of the shapes of these indices alone.
    pub fn of(&self, shapes: &[usize]) -> Normal {
        Normal {
            a: DMatrix::from_fn(shapes.len(), shapes.len(), |i, j| self.a[(shapes[i], shapes[j])]),
            b: DVector::from_fn(shapes.len(), |i, _| self.b[shapes[i]]),
            yy: self.yy,
        }
    }

    /// Least squares with coefficients that are not negative (Lawson and Hanson 1974; Bro and de Jong 1997), the shape that
    /// gains most added at each step; of all steps the one with the most evidence.
    pub fn fit(&self, scale: &Scale) -> Fit {
        let m = self.b.len();
        let mut taken = vec![false; m];
        let mut x = DVector::<f64>::zeros(m);
        let mut best = Fit { ln_evidence: scale.ln_evidence(self.yy, 0), left: self.yy, coefficients: vec![0.0; m] };
        let top = self.b.amax().max(f64::MIN_POSITIVE);
        let mut without_gain = 0;
        for _ in 0..MOST {
            let gradient = &self.b - &self.a * &x;
            let gains = |j: &usize| gradient[*j] / (self.a[(*j, *j)].sqrt() + 1e-12);
            let free = (0..m).filter(|j| !taken[*j]);
            let Some(next) = free.max_by(|a, b| gains(a).total_cmp(&gains(b))) else { break };
            if gradient[next] <= 1e-10 * top {
                break;
            }
            taken[next] = true;
            x = match self.exchanged(&mut taken, x) {
                Some(solved) => solved,
                None => break,
            };
            let left = self.yy - 2.0 * self.b.dot(&x) + x.dot(&(&self.a * &x));
            let ln_evidence = scale.ln_evidence(left, taken.iter().filter(|t| **t).count());
            if ln_evidence > best.ln_evidence {
                best = Fit { ln_evidence, left, coefficients: x.iter().copied().collect() };
                without_gain = 0;
            } else {
                without_gain += 1;
                if without_gain > FURTHER {
                    break;
                }
            }
        }
        best
    }

    /// The best coefficients of the shapes taken, after leaving out those that would be negative; None where the shapes are not
    /// independent.
    fn exchanged(&self, taken: &mut [bool], mut x: DVector<f64>) -> Option<DVector<f64>> {
        let m = x.len();
        for _ in 0..EXCHANGES {
            let of: Vec<usize> = (0..m).filter(|j| taken[*j]).collect();
            let mut few = self.of(&of);
            for i in 0..of.len() {
                few.a[(i, i)] += 1e-9 * few.a[(i, i)] + 1e-14;
            }
            let solved = few.a.cholesky()?.solve(&few.b);
            if solved.iter().all(|v| *v > 0.0) {
                x.fill(0.0);
                of.iter().zip(solved.iter()).for_each(|(j, v)| x[*j] = *v);
                return Some(x);
            }
            // as far as the first of them comes to zero
            let mut way = 1.0f64;
            for (j, v) in of.iter().zip(solved.iter()).filter(|(_, v)| **v <= 0.0) {
                if x[*j] > *v {
                    way = way.min(x[*j] / (x[*j] - v));
                }
            }
            for (j, v) in of.iter().zip(solved.iter()) {
                x[*j] += way * (v - x[*j]);
                if x[*j] <= 1e-12 {
                    x[*j] = 0.0;
                    taken[*j] = false;
                }
            }
        }
        Some(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn normal(shapes: &[Vec<f64>], y: &[f64]) -> Normal {
        let a = DMatrix::from_fn(y.len(), shapes.len(), |i, j| shapes[j][i]);
        let y = DVector::from_column_slice(y);
        Normal { b: a.tr_mul(&y), yy: y.dot(&y), a: a.tr_mul(&a) }
    }

    #[test]
    fn what_is_a_sum_of_few_shapes_is_found_again_and_nothing_is_negative() {
        let n = 200;
        let u = |i: usize| i as f64 / (n - 1) as f64;
        let shapes: Vec<Vec<f64>> = [1.0, 1.5, 2.0, 3.0].map(|e: f64| (0..n).map(|i| u(i).powf(e)).collect()).to_vec();
        let y: Vec<f64> = (0..n).map(|i| 0.4 * u(i).powf(1.5) + 0.6 * u(i).powf(3.0)).collect();
        let scale = Scale { samples: n as f64, independent: 80.0, discrepancy: 1e-4 };
        let f = normal(&shapes, &y).fit(&scale);
        let want = [0.0, 0.4, 0.0, 0.6];
        assert!(f.coefficients.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-4), "{f:?}");
        // what only a negative coefficient could explain is left
        let y: Vec<f64> = (0..n).map(|i| -u(i)).collect();
        let f = normal(&shapes, &y).fit(&scale);
        assert!(f.coefficients.iter().all(|c| *c == 0.0), "{f:?}");
    }

    #[test]
    fn a_shape_that_explains_less_than_laws_are_off_is_not_taken() {
        let n = 200;
        let u = |i: usize| i as f64 / (n - 1) as f64;
        let shapes: Vec<Vec<f64>> =
            vec![(0..n).map(u).collect(), (0..n).map(|i| (9.0 * u(i)).sin().max(0.0)).collect()];
        let y: Vec<f64> = (0..n).map(|i| u(i) + 0.004 * (9.0 * u(i)).sin().max(0.0)).collect();
        let of = |discrepancy: f64| {
            normal(&shapes, &y).fit(&Scale { samples: n as f64, independent: 80.0, discrepancy }).coefficients[1]
        };
        assert!(of(1e-4) > 0.0 && of(0.01) == 0.0, "{} {}", of(1e-4), of(0.01));
    }
}
