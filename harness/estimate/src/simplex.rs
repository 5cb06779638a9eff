//! The simplex search of Nelder and Mead 1965, with the oriented restart of Kelley 1999 where it stagnates.

use nalgebra::{DMatrix, DVector};

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Iterations at most, >= 1.
    pub iterations: usize,
    /// Converged once worst and best vertex differ by less than this, in the function's unit, > 0 ...
    pub spread: f64,
    /// ... and no edge from the best vertex is longer than this, in units of the start's step, > 0.
    pub size: f64,
}

/// Where the search ended.
#[derive(Clone, Debug)]
pub struct Minimum {
    /// The best vertex.
    pub x: Vec<f64>,
    /// The function there.
    pub value: f64,
    /// Iterations taken.
    pub iterations: usize,
    /// Evaluations of the function.
    pub evaluations: usize,
    /// Whether spread and size were reached.
    pub converged: bool,
    /// Oriented restarts taken.
    pub restarts: usize,
    /// The best vertex and its value, at the start and after every iteration.
    pub path: Vec<(Vec<f64>, f64)>,
}

/// Restarts allowed; Kelley reports that few are ever needed.
const MOST_RESTARTS: usize = 5;
/// Share of the first simplex gradient's descent that an iteration has to bring (Kelley 1999, eq. 2.9).
const SUFFICIENT: f64 = 1e-4;

/// A simplex in variables scaled by the start's steps; vertices sorted, best first.
struct Simplex {
    v: Vec<(DVector<f64>, f64)>,
}

impl Simplex {
    fn sort(&mut self) {
        self.v.sort_by(|a, b| a.1.total_cmp(&b.1));
    }

    fn mean(&self) -> f64 {
        self.v.iter().map(|p| p.1).sum::<f64>() / self.v.len() as f64
    }

    fn longest(&self) -> f64 {
        self.v[1..].iter().map(|p| (&p.0 - &self.v[0].0).norm()).fold(0.0, f64::max)
    }

    fn shortest(&self) -> f64 {
        self.v[1..].iter().map(|p| (&p.0 - &self.v[0].0).norm()).fold(f64::INFINITY, f64::min)
    }

    /// The simplex gradient: V^-T of the differences to the best vertex.
    fn gradient(&self) -> Option<DVector<f64>> {
        let n = self.v.len() - 1;
        let edges = DMatrix::from_fn(n, n, |i, j| self.v[i + 1].0[j] - self.v[0].0[j]);
        let rise = DVector::from_fn(n, |i, _| self.v[i + 1].1 - self.v[0].1);
        edges.lu().solve(&rise).filter(|g| g.iter().all(|x| x.is_finite()))
    }
}

/// Minimises `f` from `start`, the first simplex spanned by `step` (nonzero) along each axis. What is not a number
/// counts as infinite. `over` is asked once an iteration with the best so far; true ends the search.
pub fn minimise(
    f: &mut dyn FnMut(&[f64]) -> f64,
    start: &[f64],
    step: &[f64],
    options: &Options,
    over: &mut dyn FnMut(usize, f64) -> bool,
) -> Minimum {
    let n = start.len();
    let mut evaluations = 0;
    let real = |z: &DVector<f64>| -> Vec<f64> { (0..n).map(|i| start[i] + step[i] * z[i]).collect() };
    let mut at = |z: &DVector<f64>| -> f64 {
        evaluations += 1;
        let y = f(&real(z));
        if y.is_nan() {
            f64::INFINITY
        } else {
            y
        }
    };
    let corner = |i: usize, h: f64| DVector::from_fn(n, |j, _| if i == j { h } else { 0.0 });
    let mut s = Simplex { v: Vec::with_capacity(n + 1) };
    let origin = DVector::zeros(n);
    let y = at(&origin);
    s.v.push((origin, y));
    for i in 0..n {
        let z = corner(i, 1.0);
        let y = at(&z);
        s.v.push((z, y));
    }
    s.sort();
    let mut path = vec![(real(&s.v[0].0), s.v[0].1)];
    // Kelley's alpha, scaled by the first simplex
    let alpha = s.gradient().map_or(0.0, |g| SUFFICIENT * s.longest() / g.norm().max(1e-300));
    let (mut iterations, mut restarts, mut converged) = (0, 0, false);
    while iterations < options.iterations && !over(iterations, s.v[0].1) {
        iterations += 1;
        let before = s.mean();
        let worst = s.v[n].clone();
        let centre = s.v[..n].iter().fold(DVector::zeros(n), |a, p| a + &p.0) / n as f64;
        let along = |t: f64| &centre + (&centre - &worst.0) * t;
        let mirrored = along(1.0);
        let fm = at(&mirrored);
        let mut shrink = false;
        if fm < s.v[0].1 {
            let far = along(2.0);
            let ff = at(&far);
            s.v[n] = if ff < fm { (far, ff) } else { (mirrored, fm) };
        } else if fm < s.v[n - 1].1 {
            s.v[n] = (mirrored, fm);
        } else {
            let near = along(if fm < worst.1 { 0.5 } else { -0.5 });
            let fn_ = at(&near);
            if fn_ < fm.min(worst.1) {
                s.v[n] = (near, fn_);
            } else {
                shrink = true;
            }
        }
        if shrink {
            let best = s.v[0].0.clone();
            for p in &mut s.v[1..] {
                p.0 = &best + (&p.0 - &best) * 0.5;
                p.1 = at(&p.0);
            }
        }
        s.sort();
        let spread = s.v[n].1 - s.v[0].1;
        if spread <= options.spread && s.longest() <= options.size {
            converged = true;
        } else if !shrink && restarts < MOST_RESTARTS && before.is_finite() {
            // too little descent for this gradient: the simplex has turned away from it
            if let Some(g) = s.gradient() {
                if s.mean() - before > -alpha * g.norm_squared() {
                    restarts += 1;
                    let h = 0.5 * s.shortest();
                    let best = s.v[0].0.clone();
                    for i in 0..n {
                        let z = &best + corner(i, if g[i] > 0.0 { -h } else { h });
                        let y = at(&z);
                        s.v[i + 1] = (z, y);
                    }
                    s.sort();
                }
            }
        }
        path.push((real(&s.v[0].0), s.v[0].1));
        if converged {
            break;
        }
    }
    let (x, value) = (real(&s.v[0].0), s.v[0].1);
    Minimum { x, value, iterations, evaluations, converged, restarts, path }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OPTIONS: Options = Options { iterations: 2000, spread: 1e-16, size: 1e-7 };

    #[test]
    fn the_valley_of_rosenbrock_is_followed_to_its_end() {
        let mut f = |x: &[f64]| 100.0 * (x[1] - x[0] * x[0]).powi(2) + (1.0 - x[0]).powi(2);
        let m = minimise(&mut f, &[-1.2, 1.0], &[0.5, 0.5], &OPTIONS, &mut |_, _| false);
        assert!(m.converged && (m.x[0] - 1.0).abs() < 1e-6 && (m.x[1] - 1.0).abs() < 1e-6, "{m:?}");
        assert!(m.path.windows(2).all(|w| w[1].1 <= w[0].1), "the best never gets worse");
        assert_eq!(m.path.len(), m.iterations + 1);
    }

    #[test]
    fn the_function_of_mckinnon_that_stalls_the_plain_simplex_does_not_stall_this_one() {
        // McKinnon 1998: from these vertices Nelder and Mead's rules contract for ever on the origin; minimum -1/4 at (0, -1/2)
        let f = |x: &[f64]| x[1] + x[1] * x[1] + if x[0] <= 0.0 { 360.0 * x[0] * x[0] } else { 6.0 * x[0] * x[0] };
        let (a, b) = ((1.0 + 33f64.sqrt()) / 8.0, (1.0 - 33f64.sqrt()) / 8.0);
        // vertices (1,1), (a,b), (0,0) reached by a linear change of variables from the unit corners
        let mut g = |z: &[f64]| f(&[z[0] + a * z[1], z[0] + b * z[1]]);
        let m = minimise(&mut g, &[0.0, 0.0], &[1.0, 1.0], &OPTIONS, &mut |_, _| false);
        assert!(m.restarts > 0 && m.value < -0.249_999, "{} restarts, {}", m.restarts, m.value);
    }

    #[test]
    fn what_is_no_number_is_avoided_and_an_end_is_obeyed() {
        let mut f = |x: &[f64]| if x[0] < 0.0 { f64::NAN } else { (x[0] - 1e-3).abs() };
        let m = minimise(&mut f, &[2.0], &[-1.5], &OPTIONS, &mut |_, _| false);
        assert!((m.x[0] - 1e-3).abs() < 1e-6, "{m:?}");
        let m = minimise(&mut |x: &[f64]| x[0] * x[0], &[2.0], &[1.0], &OPTIONS, &mut |i, _| i == 3);
        assert!(m.iterations == 3 && !m.converged);
    }
}
