//! The simplex over law and terms of a campaign; tolerances and nuisances at their best for each vertex.

use crate::descent::{gained, polish};
use crate::problem::{Data, Model, Options, Parameter, Point, Problem};
use crate::simplex::{self, minimise};
use crate::Watch;

/// Rounds at most, each from where the last ended.
const ROUNDS: usize = 5;
/// Size of the later rounds' simplex over that of the first.
pub const SMALLER: f64 = 0.1;

/// Mirrors at the bounds.
fn fold(x: f64, p: &Parameter) -> f64 {
    let y = if x < p.lower { 2.0 * p.lower - x } else { x };
    let y = if y > p.upper { 2.0 * p.upper - y } else { y };
    y.clamp(p.lower, p.upper)
}

/// Indices of what a simplex moves in: all but tolerances.
pub fn free(model: &Model<'_>) -> Vec<usize> {
    (0..model.parameters.len()).filter(|j| model.parameters[*j].prior.is_none()).collect()
}

/// A search: where it ended, the objective by iteration, whether it came to rest.
pub struct Search {
    pub point: Point,
    pub objective: Vec<f64>,
    pub rested: bool,
}

/// Searches from `start` with a simplex of `scale` times the usual size, again on a smaller one from where it ended
/// until it stays there.
pub fn search(data: &Data, model: &Model<'_>, start: &Point, scale: f64, watch: &Watch<'_>) -> Search {
    let ps = &model.parameters;
    let free = free(model);
    let tolerances: Vec<usize> = (0..ps.len()).filter(|j| ps[*j].prior.is_some()).collect();
    let whole = Problem::new(data, model);
    let profile = |z: &[f64], from: &Point| -> Point {
        let mut theta = from.theta.clone();
        for (j, x) in free.iter().zip(z) {
            theta[*j] = fold(*x, &ps[*j]);
        }
        let outer = theta.clone();
        let inner = Model::new(tolerances.iter().map(|j| ps[*j].clone()).collect(), |t, p| {
            let mut th = outer.clone();
            for (j, x) in tolerances.iter().zip(t) {
                th[*j] = *x;
            }
            model.apply(&th, p);
        });
        let problem = Problem::new(data, &inner);
        let p = problem.evaluate(tolerances.iter().map(|j| theta[*j]).collect(), from.locals.clone());
        let f = problem.fit(p, &Options { iterations: 12, tolerance: 1e-7, ..Options::default() });
        for (j, x) in tolerances.iter().zip(&f.point.theta) {
            theta[*j] = *x;
        }
        Point { theta, locals: f.point.locals, chi2: f.point.chi2 }
    };
    let z0: Vec<f64> = free.iter().map(|j| start.theta[*j]).collect();
    let step: Vec<f64> = free
        .iter()
        .enumerate()
        .map(|(i, j)| match i {
            0 => 0.2,
            1 => 0.2,
            _ => (0.3 * start.theta[*j].abs()).max(30.0 * ps[*j].step),
        })
        .collect();
    let mut s = Search { objective: vec![start.chi2], point: start.clone(), rested: false };
    if watch.over().is_some() {
        return s;
    }
    let profiled = polish(&whole, &profile(&z0, start));
    if profiled.chi2 < start.chi2 {
        s.point = profiled;
    }
    let samples = data.samples().max(1) as f64;
    let mut scale = scale;
    let mut stop = false;
    for round in 0..ROUNDS {
        let before = s.point.chi2;
        let spread = 5e-3 * (before / samples).max(1.0);
        let options = simplex::Options { iterations: 250, spread, size: f64::INFINITY };
        let z: Vec<f64> = free.iter().map(|j| s.point.theta[*j]).collect();
        let steps: Vec<f64> = step.iter().map(|s| s * scale).collect();
        let mut state = s.point.clone();
        let mut f = |z: &[f64]| {
            if watch.over().is_some() {
                return f64::INFINITY;
            }
            let p = profile(z, &state);
            let value = p.chi2;
            if value < state.chi2 {
                state = p;
            }
            value
        };
        let done = s.objective.len() - 1;
        let m = minimise(&mut f, &z, &steps, &options, &mut |i, v| {
            if i % 10 == 0 {
                (watch.say)(&format!("iteration {}: objective {v:.6e}", done + i));
            }
            stop = watch.over().is_some();
            stop
        });
        s.point = state;
        s.objective.extend(m.path[1..].iter().map(|p| p.1));
        if stop {
            break;
        }
        let p = polish(&whole, &s.point);
        let better = gained(data, s.point.chi2, p.chi2);
        if p.chi2 < s.point.chi2 {
            s.objective.push(p.chi2);
            s.point = p;
        }
        s.rested = m.converged && !better && before - s.point.chi2 < 10.0 * spread;
        if s.rested && (round > 0 || scale <= SMALLER) {
            break;
        }
        scale = SMALLER;
    }
    s.rested &= !stop;
    // the simplex's path holds its vertices as first met; the point may have been polished since
    let mut least = f64::INFINITY;
    for o in &mut s.objective {
        least = least.min(*o);
        *o = least;
    }
    s
}
