//! Levenberg-Marquardt that does not rest where sampling makes a false minimum.
//!
//! Where the force rises steeply at touch, the objective is rough in the instant of touch: a sample more or less
//! before it makes a valley of its own. So the instants are moved by parts of a sample between descents, runs start
//! warm from each other's nuisances, and the end is probed for anything lower close by, which needs no derivative.

use crate::problem::{Data, Nuisance, Options, Point, Problem};
use crate::Watch;
use nalgebra::DMatrix;
use rayon::prelude::*;

/// Shifts of the instant of touch tried, in samples.
const SHIFTS: [f64; 10] = [-3.0, -2.0, -1.0, -0.5, -0.25, 0.25, 0.5, 1.0, 2.0, 3.0];
/// Rounds of descent and polish at most.
const ROUNDS: usize = 10;
/// Gain of the objective, in mean squared residuals, below which it counts as none.
const NOTHING: f64 = 0.02;

/// Whether going from the objective `before` to `after` is worth another round.
pub fn gained(data: &Data, before: f64, after: f64) -> bool {
    before - after > NOTHING * (before / data.samples().max(1) as f64).max(1.0)
}

/// Replaces the nuisances of each recording by the best of what `candidates` (recording -> starts) lead to.
fn best_locals(problem: &Problem<'_>, point: &Point, candidates: &(dyn Fn(usize) -> Vec<Vec<f64>> + Sync)) -> Point {
    let locals = (0..point.locals.len())
        .into_par_iter()
        .map(|r| {
            let here = &point.locals[r];
            let mut best = (problem.chi2_of(&point.theta, r, here), here.clone());
            for v in candidates(r) {
                let v = problem.fit_local(&point.theta, r, &v, &|_| true);
                let c = problem.chi2_of(&point.theta, r, &v);
                if c < best.0 {
                    best = (c, v);
                }
            }
            best.1
        })
        .collect();
    let next = problem.evaluate(point.theta.clone(), locals);
    if next.chi2 < point.chi2 {
        next
    } else {
        point.clone()
    }
}

/// Moves every recording's instant of touch by up to three samples, fits its nuisances again from there, and keeps
/// what is better. The globals stay.
pub fn polish(problem: &Problem<'_>, point: &Point) -> Point {
    let at = problem.nuisances().iter().position(|n| *n == Nuisance::Start);
    let dt = problem.data.scales.dt;
    best_locals(problem, point, &|r| match at {
        Some(at) => SHIFTS
            .iter()
            .map(|s| {
                let mut v = point.locals[r].clone();
                v[at] += s * dt;
                v
            })
            .collect(),
        None => Vec::new(),
    })
}

/// Starts warm from the nuisances that `others` found, recording by recording, and keeps what is better.
pub fn warm_start(problem: &Problem<'_>, point: &Point, others: &[&Point]) -> Point {
    best_locals(problem, point, &|r| others.iter().map(|o| o.locals[r].clone()).collect())
}

/// What [`probe`] finds.
pub struct Probe {
    /// The lowest point met; the one probed where nothing is lower.
    pub lowest: Point,
    /// Least rise of the objective over all probes; negative where something is lower.
    pub rise: f64,
}

/// Steps of `size` standard errors both ways along every principal axis of the globals' covariance, the nuisances
/// fitted again at each. `covariance` is that of the globals, as it shall count.
///
/// None where the covariance has no axes.
pub fn probe(problem: &Problem<'_>, point: &Point, covariance: &DMatrix<f64>, size: f64) -> Option<Probe> {
    let every: Vec<usize> = (0..problem.model.parameters.len()).collect();
    let mut found = Probe { lowest: point.clone(), rise: f64::INFINITY };
    for theta in around(problem, point, covariance, size, &every) {
        let locals: Vec<Vec<f64>> = (0..point.locals.len())
            .into_par_iter()
            .map(|r| problem.fit_local(&theta, r, &point.locals[r], &|_| true))
            .collect();
        let p = problem.evaluate(theta, locals);
        found.rise = found.rise.min(p.chi2 - point.chi2);
        if p.chi2 < found.lowest.chi2 {
            found.lowest = p;
        }
    }
    found.rise.is_finite().then_some(found)
}

/// The globals moved by `size` standard errors both ways along every principal axis of the correlations of the
/// parameters `of`, kept within bounds; empty where the covariance has no axes.
pub fn around(
    problem: &Problem<'_>,
    point: &Point,
    covariance: &DMatrix<f64>,
    size: f64,
    of: &[usize],
) -> Vec<Vec<f64>> {
    let ps = &problem.model.parameters;
    let n = of.len();
    let sd: Vec<f64> = of.iter().map(|j| covariance[(*j, *j)].max(0.0).sqrt()).collect();
    if sd.iter().any(|s| !(*s > 0.0 && s.is_finite())) {
        return Vec::new();
    }
    let eigen = DMatrix::from_fn(n, n, |i, j| covariance[(of[i], of[j])] / (sd[i] * sd[j])).symmetric_eigen();
    let mut out = Vec::new();
    for (a, axis) in eigen.eigenvectors.column_iter().enumerate() {
        let length = size * eigen.eigenvalues[a].max(0.0).sqrt();
        for sign in [-1.0, 1.0] {
            let mut theta = point.theta.clone();
            for (i, j) in of.iter().enumerate() {
                theta[*j] = (theta[*j] + sign * length * axis[i] * sd[i]).clamp(ps[*j].lower, ps[*j].upper);
            }
            if theta != point.theta {
                out.push(theta);
            }
        }
    }
    out
}

/// A descent: where it ended, the objective by iteration from `point` on, whether it came to rest.
pub struct Descent {
    pub point: Point,
    pub objective: Vec<f64>,
    pub rested: bool,
}

/// Levenberg-Marquardt and [`polish`] in turns until neither gains. Ends early, not rested, when the watch is over.
pub fn descend(problem: &Problem<'_>, point: Point, watch: &Watch<'_>) -> Descent {
    let mut d = Descent { objective: vec![point.chi2], point, rested: false };
    for _ in 0..ROUNDS {
        let before = d.point.chi2;
        let mut still = false;
        // in slices, so that it can be stopped
        while !still && d.objective.len() < 400 {
            if watch.over().is_some() {
                return d;
            }
            let f = problem.fit(d.point, &Options { iterations: 5, tolerance: 1e-7, ..Options::default() });
            still = f.converged || f.objective.len() == 1;
            d.objective.extend(&f.objective[1..]);
            d.point = f.point;
            (watch.say)(&format!("iteration {}: objective {:.6e}", d.objective.len() - 1, d.point.chi2));
        }
        if watch.over().is_some() {
            return d;
        }
        let p = polish(problem, &d.point);
        let better = gained(problem.data, d.point.chi2, p.chi2);
        if p.chi2 < d.point.chi2 {
            d.objective.push(p.chi2);
            d.point = p;
        }
        if !better || !gained(problem.data, before, d.point.chi2) {
            d.rested = still;
            break;
        }
    }
    d
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::budget::Budget;
    use crate::case::Case;
    use crate::condition::Guess;
    use crate::prepare::Prepared;
    use crate::structure::Law;
    use plant::recipe::{write_campaign, Recipe};

    #[test]
    fn a_touch_moved_by_samples_comes_back_and_the_rest_is_probed_uphill() {
        let dir = tempfile::tempdir().unwrap();
        write_campaign(dir.path(), &Recipe::default()).unwrap();
        let campaign = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let case = Case::new(Prepared::new(&campaign).unwrap());
        let data = &case.data;
        let problem = case.problem();
        let Guess { k, p } = case.guess;
        let start = || problem.start(case.structure.start(Law { k, p, mu_d: 0.2 * k }));
        let watch = Watch { budget: Budget::default(), say: &|_| {} };
        let d = descend(&problem, start(), &watch);
        assert!(d.rested && d.objective.windows(2).all(|w| w[1] <= w[0]));
        let covariance = problem.covariance(&d.point).unwrap();
        let p = probe(&problem, &d.point, &covariance, 0.3).unwrap();
        // a parabola rises by 0.09
        assert!(p.rise > 0.0 && p.rise < 0.2, "{}", p.rise);
        let at = problem.nuisances().iter().position(|n| *n == Nuisance::Start).unwrap();
        let mut locals = d.point.locals.clone();
        locals[3][at] += 2.4 * data.scales.dt;
        let moved = problem.evaluate(d.point.theta.clone(), locals);
        assert!(moved.chi2 > d.point.chi2 + 10.0);
        let back = polish(&problem, &moved);
        assert!(!gained(data, back.chi2, d.point.chi2), "{} against {}", back.chi2, d.point.chi2);
        // a point beside the minimum is not taken for one
        let mut theta = d.point.theta.clone();
        theta[1] += 2.0 * covariance[(1, 1)].sqrt();
        let beside = problem.evaluate(theta, d.point.locals.clone());
        assert!(probe(&problem, &beside, &covariance, 0.3).unwrap().rise < 0.0);
        let ended = Budget { deadline: Some(std::time::Instant::now()), ..Budget::default() };
        assert!(!descend(&problem, start(), &Watch { budget: ended, say: &|_| {} }).rested);
    }
}
