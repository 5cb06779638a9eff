//! Noise of a channel: standard deviation and autoregression, pooled over recordings.

use super::kernels::innovations;
use nalgebra::{DMatrix, DVector};

/// Highest order of the autoregression; shorter where there are few samples to learn it from.
pub const ORDER: usize = 16;

/// Autoregressive noise e_t = sum a_k e_(t-k) + w_t, with the shorter predictors that start it up
/// (Levinson 1946, Durbin 1960).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Noise {
    /// Standard deviation of w for the predictor of order 0 (the noise itself) to `ORDER`.
    sigma: [f64; ORDER + 1],
    /// `a[m][k]`: coefficient of lag k + 1 in the predictor of order m.
    a: [[f64; ORDER]; ORDER + 1],
}

/// Residuals one after another, and what was taken out of them before.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretch {
    pub left: Vec<f64>,
    /// By lag k: sum over i of P_(i,i+k), P being the projection on what was taken out; at lag 0 the degrees of freedom lost.
    taken: [f64; ORDER + 1],
}

impl Stretch {
    /// Residuals out of which nothing was taken.
    pub fn whole(left: Vec<f64>) -> Stretch {
        Stretch { left, taken: [0.0; ORDER + 1] }
    }

    /// Residuals out of which one level was taken, that of `samples` samples, these among them.
    pub fn less_level(left: Vec<f64>, samples: usize) -> Stretch {
        let n = left.len();
        let taken = std::array::from_fn(|k| n.saturating_sub(k) as f64 / samples as f64);
        Stretch { left, taken }
    }

    /// Readings `y`, less the polynomial of that degree that fits them best.
    pub fn less_polynomial(y: &[f64], degree: usize) -> Stretch {
        let n = y.len();
        let at = |i: usize| if n > 1 { 2.0 * i as f64 / (n - 1) as f64 - 1.0 } else { 0.0 };
        let q = DMatrix::from_fn(n, degree + 1, |i, j| at(i).powi(j as i32)).qr().q();
        let y = DVector::from_column_slice(y);
        let left = &y - &q * q.tr_mul(&y);
        let lagged =
            |k: usize| q.column_iter().map(|q| q.iter().skip(k).zip(&q).map(|(a, b)| a * b).sum::<f64>()).sum();
        Stretch { left: left.iter().copied().collect(), taken: std::array::from_fn(lagged) }
    }
}

impl Noise {
    /// White noise of standard deviation `sigma`.
    pub fn white(sigma: f64) -> Noise {
        Noise { sigma: [sigma; ORDER + 1], a: [[0.0; ORDER]; ORDER + 1] }
    }

    /// Standard deviation of the noise itself.
    pub fn marginal(&self) -> f64 {
        self.sigma[0]
    }

    /// Standard deviation of what the autoregression leaves.
    pub fn innovation(&self) -> f64 {
        self.sigma[ORDER]
    }

    /// The white standard deviation that has the same power at low frequency.
    pub fn low_frequency(&self) -> f64 {
        self.sigma[ORDER] / (1.0 - self.a[ORDER].iter().sum::<f64>()).max(0.05)
    }

    /// The same colour with `ratio` times the variance.
    pub fn widened(mut self, ratio: f64) -> Noise {
        self.sigma.iter_mut().for_each(|s| *s *= ratio.sqrt());
        self
    }

    /// Whitens `e` (divided by the innovation's standard deviation) into `out`.
    pub fn whiten(&self, e: &[f64], out: &mut [f64]) {
        let n = e.len();
        for i in 0..ORDER.min(n) {
            let mut v = e[i];
            for k in 0..i {
                v -= self.a[i][k] * e[i - 1 - k];
            }
            out[i] = v / self.sigma[i];
        }
        let a = &self.a[ORDER];
        let last = (0..ORDER).rev().find(|k| a[*k] != 0.0).map_or(0, |k| k + 1);
        if n > ORDER {
            let from = ORDER - last;
            innovations(&e[from..], &a[..last], 1.0 / self.sigma[ORDER], &mut out[from..]);
        }
    }

    /// Draws noise of this kind from unit normal `w`, in place.
    pub fn colour(&self, w: &mut [f64]) {
        for i in 0..w.len() {
            let m = i.min(ORDER);
            let mut v = w[i] * self.sigma[m];
            for k in 0..m {
                v += self.a[m][k] * w[i - 1 - k];
            }
            w[i] = v;
        }
    }

    /// Yule-Walker estimate from several stretches of residuals. `floor` is the least sigma believed. None with too few
    /// samples.
    ///
    /// What was fitted to a stretch of white noise and taken out of it leaves -sigma^2 sum_i P_(i,i+k) in the sum of its
    /// products at lag k, P being the projection on what was fitted (Neudecker 1977 has lag 1); that is given back. Without it
    /// a stretch of 100 samples less a cubic would show a third of the slow noise it has. Coloured noise is given back what
    /// white noise of its standard deviation loses.
    pub fn estimate(stretches: &[Stretch], floor: f64) -> Option<Noise> {
        let (mut c, mut taken) = ([0.0; ORDER + 1], [0.0; ORDER + 1]);
        let mut n = 0;
        for Stretch { left: e, taken: of_it } in stretches {
            n += e.len();
            for k in 0..=ORDER.min(e.len().saturating_sub(1)) {
                // biased by length, so that the sequence stays positive definite
                c[k] += e[k..].iter().zip(e).map(|(a, b)| a * b).sum::<f64>();
                taken[k] += of_it[k];
            }
        }
        if n < 4 * ORDER || c[0] <= 0.0 {
            return None;
        }
        let n_free = (n as f64 - taken[0]).max(n as f64 / 3.0);
        let variance = c[0] / n_free;
        for (c, taken) in c.iter_mut().zip(&taken).skip(1) {
            *c += variance * taken;
        }
        c[0] = variance * n as f64;
        let r: Vec<f64> = c.iter().map(|v| v / c[0]).collect();
        let mut out = Noise::white(variance.sqrt().max(floor));
        let mut var = 1.0;
        let order = (n / 100).clamp(2, ORDER);
        for m in 1..=ORDER {
            if m > order {
                out.a[m] = out.a[order];
                out.sigma[m] = out.sigma[order];
                continue;
            }
            let prev = out.a[m - 1];
            let mut acc = r[m];
            for k in 0..m - 1 {
                acc -= prev[k] * r[m - 1 - k];
            }
            let reflect = (acc / var).clamp(-0.97, 0.97);
            let mut next = prev;
            next[m - 1] = reflect;
            for k in 0..m - 1 {
                next[k] = prev[k] - reflect * prev[m - 2 - k];
            }
            var *= 1.0 - reflect * reflect;
            out.a[m] = next;
            out.sigma[m] = out.sigma[0] * f64::sqrt(var);
        }
        Some(out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn estimate_recovers_an_autoregression_and_whitening_undoes_colouring() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut e = vec![0.0; 20_000];
        for i in 2..e.len() {
            let w: f64 = (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0;
            e[i] = 0.5 * e[i - 1] - 0.2 * e[i - 2] + 0.3 * w;
        }
        let n = Noise::estimate(&[Stretch::whole(e.clone())], 0.0).unwrap();
        assert!((n.a[ORDER][0] - 0.5).abs() < 0.03 && (n.a[ORDER][1] + 0.2).abs() < 0.04, "{n:?}");
        assert!((n.innovation() - 0.3).abs() < 0.01);
        let mut w = vec![0.0; e.len()];
        n.whiten(&e, &mut w);
        let var = w.iter().map(|x| x * x).sum::<f64>() / w.len() as f64;
        assert!((var - 1.0).abs() < 0.03);
        n.colour(&mut w);
        assert!(w.iter().zip(&e).all(|(a, b)| (a - b).abs() < 1e-9));
    }

    #[test]
    fn white_noise_less_a_polynomial_or_a_level_is_white_again() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let mut drawn = |n: usize| -> Vec<f64> {
            (0..n).map(|_| (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0).collect()
        };
        for degree in [0, 1, 3] {
            let stretches: Vec<Stretch> = (0..300).map(|_| Stretch::less_polynomial(&drawn(100), degree)).collect();
            let n = Noise::estimate(&stretches, 0.0).unwrap();
            assert!((n.marginal() - 1.0).abs() < 0.02 && (n.low_frequency() - 1.0).abs() < 0.1, "{degree}: {n:?}");
            // the degrees of freedom alone would not do
            let whole: Vec<Stretch> = stretches.iter().map(|s| Stretch::whole(s.left.clone())).collect();
            assert!(degree < 3 || Noise::estimate(&whole, 0.0).unwrap().low_frequency() < 0.7);
        }
        let level = |y: Vec<f64>| {
            let mean = y.iter().sum::<f64>() / y.len() as f64;
            let left: Vec<f64> = y.iter().map(|v| v - mean).collect();
            [&left[..60], &left[60..]].map(|s| Stretch::less_level(s.to_vec(), left.len()))
        };
        let stretches: Vec<Stretch> = (0..300).flat_map(|_| level(drawn(100))).collect();
        let n = Noise::estimate(&stretches, 0.0).unwrap();
        assert!((n.marginal() - 1.0).abs() < 0.02 && (n.low_frequency() - 1.0).abs() < 0.1, "{n:?}");
    }
}
