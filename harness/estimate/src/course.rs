//! The course of an estimation: several starts, the best followed to their end, what they found shared, the end
//! probed, and a verdict on whether it is to be believed.
//!
//! Where runs end apart, the best is perturbed and descended from again (basin hopping: Wales and Doye 1997).

use crate::case::{Case, Estimate, Method, Run, CLOSE};
use crate::condition::Invalid;
use crate::descent::{around, descend, gained, polish, probe, warm_start, Probe};
use crate::problem::{Data, Model, Options, Point, Problem};
use crate::scan::scan;
use crate::structure::Law;
use crate::vertices::{self, free};
use crate::Watch;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Rounds in which runs start warm from each other's nuisances, at most.
const ROUNDS: usize = 4;
/// Perturbation of a restart, in standard errors.
const PERTURBATION: f64 = 2.0;

struct Start {
    origin: &'static str,
    point: Point,
}

/// Where a run has come to.
struct End {
    /// Index of its start.
    start: usize,
    origin: &'static str,
    first: f64,
    point: Point,
    objective: Vec<f64>,
    rested: bool,
}

impl End {
    /// Goes on to `next`, which began where this one ended or beside it.
    fn go_on(&mut self, next: Leg) {
        if next.point.chi2 < self.point.chi2 {
            let from = self.point.chi2;
            self.objective.extend(next.objective.into_iter().filter(|v| *v < from));
            self.point = next.point;
        }
        self.rested = next.rested;
    }
}

/// A part of a run: where it ended, the objective by iteration, whether it came to rest.
struct Leg {
    point: Point,
    objective: Vec<f64>,
    rested: bool,
}

/// What every phase needs.
struct Course<'a> {
    data: &'a Data,
    model: &'a Model<'a>,
    problem: Problem<'a>,
    method: Method,
    free: Vec<usize>,
    watch: &'a Watch<'a>,
}

/// Estimates.
///
/// # Errors
/// When no start comes near the recordings.
pub fn estimate(case: &Case, method: Method, watch: &Watch<'_>) -> Result<Estimate, Invalid> {
    let data = &*case.data;
    let model = &case.model;
    let problem = case.problem();
    let mut starts: Vec<Start> = laws(case)
        .into_par_iter()
        .map(|(origin, law)| Start { origin, point: problem.start(case.structure.start(law)) })
        .collect();
    starts.retain(|s| s.point.chi2.is_finite());
    if starts.is_empty() {
        return Err(Invalid(
            "the simulation could not be brought near the recordings; check mass, units and speeds".into(),
        ));
    }
    (watch.say)(&format!("{} starts over {} recordings", starts.len(), data.records.len()));
    // a few steps of each show which are worth following
    let few = Options { iterations: 6, ..Options::default() };
    let mut begun: Vec<(Start, Point, Vec<f64>)> = starts
        .into_par_iter()
        .map(|s| {
            if watch.over().is_some() {
                let (p, c) = (s.point.clone(), s.point.chi2);
                return (s, p, vec![c]);
            }
            let f = problem.fit(s.point.clone(), &few);
            (s, f.point, f.objective)
        })
        .collect();
    begun.sort_by(|a, b| a.1.chi2.total_cmp(&b.1.chi2));
    (watch.say)(&format!("best start ({}): objective {:.6e}", begun[0].0.origin, begun[0].1.chi2));
    let course = Course { data, model, problem: case.problem(), method, free: free(model), watch };
    let mut ends = course.follow(&begun);
    let mut best = lowest(&ends);
    let mut proof = None;
    let mut restarts = if method == Method::Simplex { 1 } else { 3 };
    for _ in 0..ROUNDS {
        if watch.over().is_some() {
            break;
        }
        let mut moved = course.share(&mut ends);
        best = lowest(&ends);
        proof = course.prove(&ends[best].point);
        let Some(p) = &proof else { break };
        if gained(data, ends[best].point.chi2, p.probe.lowest.chi2) {
            let leg = course.go(&p.probe.lowest, vertices::SMALLER);
            ends[best].go_on(leg);
            moved = true;
        } else if !moved && restarts > 0 && !course.agree(&ends, best, p) {
            restarts -= 1;
            moved = course.restart(&mut ends, best, p);
            best = lowest(&ends);
        }
        if !moved {
            break;
        }
        proof = None;
    }
    let point = ends[best].point.clone();
    let proof = proof.or_else(|| course.prove(&point));
    let agree = proof.as_ref().is_some_and(|p| course.agree(&ends, best, p));
    let runs = course.runs(&begun, &ends, best, proof.as_ref());
    let (covariance, widening, rise) = match proof {
        Some(p) => (Some(p.covariance), p.widening, p.probe.rise / p.widening),
        None => (None, 1.0, f64::NAN),
    };
    let stopped = watch.over();
    Ok(Estimate {
        method,
        start: begun[ends[best].start].0.point.clone(),
        iterations: ends[best].objective.len() - 1,
        objective: ends[best].objective.clone(),
        converged: stopped.is_none() && ends[best].rested && rise > 0.0 && agree,
        gradient: course.problem.decrement(&point).map_or(f64::NAN, |d| (d / widening).sqrt()),
        bounds: bounds(model, &point),
        point,
        covariance,
        widening,
        rise,
        runs,
        stopped,
    })
}

type Begun = (Start, Point, Vec<f64>);

impl Course<'_> {
    /// One run from a point; a simplex of `scale` times the usual size.
    fn go(&self, from: &Point, scale: f64) -> Leg {
        match self.method {
            Method::LevenbergMarquardt => {
                let d = descend(&self.problem, from.clone(), self.watch);
                Leg { point: d.point, objective: d.objective, rested: d.rested }
            }
            Method::Simplex => {
                let s = vertices::search(self.data, self.model, from, scale, self.watch);
                Leg { point: s.point, objective: s.objective, rested: s.rested }
            }
        }
    }

    /// The most promising starts, each to its end.
    fn follow(&self, begun: &[Begun]) -> Vec<End> {
        let most = if self.method == Method::Simplex { 2 } else { 5 };
        let mut ends = Vec::new();
        for (i, (s, near, few)) in begun.iter().enumerate().take(most) {
            if i > 0 && self.watch.over().is_some() {
                break;
            }
            let (leg, before) = match self.method {
                Method::LevenbergMarquardt => (self.go(near, 1.0), few.as_slice()),
                Method::Simplex => (self.go(&s.point, 1.0), &few[..1]),
            };
            ends.push(End {
                start: i,
                origin: s.origin,
                first: s.point.chi2,
                point: leg.point,
                objective: before.iter().chain(&leg.objective[1..]).cloned().collect(),
                rested: leg.rested,
            });
        }
        ends
    }

    /// Runs start warm from the nuisances the others found, where that helps. True where any moved.
    fn share(&self, ends: &mut [End]) -> bool {
        let mut moved = false;
        for i in 0..ends.len() {
            let others: Vec<&Point> = (0..ends.len()).filter(|j| *j != i).map(|j| &ends[j].point).collect();
            let p = warm_start(&self.problem, &ends[i].point, &others);
            if self.watch.over().is_none() && gained(self.data, ends[i].point.chi2, p.chi2) {
                let leg = self.go(&p, vertices::SMALLER);
                ends[i].go_on(leg);
                moved = true;
            }
        }
        moved
    }

    /// Leaves the best by [`PERTURBATION`] along every principal axis of law and terms, both ways, and as far again as the
    /// best lies from other runs (pattern moves: Hooke and Jeeves 1961); descends from there.
    /// The runs join `ends`; true where one is lower.
    fn restart(&self, ends: &mut Vec<End>, best: usize, proof: &Proof) -> bool {
        let before = ends[best].point.chi2;
        let wide = &proof.covariance * proof.widening;
        let mut moved = false;
        let mut thetas = around(&self.problem, &ends[best].point, &wide, PERTURBATION, &self.free);
        thetas.extend(self.onwards(ends, best));
        for theta in thetas {
            if self.watch.over().is_some() {
                break;
            }
            let p = self.problem.evaluate(theta, ends[best].point.locals.clone());
            let leg = self.go(&polish(&self.problem, &p), vertices::SMALLER);
            moved |= gained(self.data, before, leg.point.chi2);
            let mut end = End {
                start: ends[best].start,
                origin: "a perturbed restart of the best run",
                first: p.chi2,
                point: leg.point,
                objective: ends[best].objective.clone(),
                rested: leg.rested,
            };
            end.objective.extend(leg.objective.into_iter().filter(|v| *v < before));
            ends.push(end);
        }
        moved
    }

    /// The best moved on from the next best run and from the furthest, by as much as it lies apart from them.
    fn onwards(&self, ends: &[End], best: usize) -> Vec<Vec<f64>> {
        let to = &ends[best].point;
        let mut others: Vec<&Point> = (0..ends.len()).filter(|i| *i != best).map(|i| &ends[i].point).collect();
        others.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
        let bound = |j: usize, x: f64| x.clamp(self.model.parameters[j].lower, self.model.parameters[j].upper);
        let from = [others.first(), others.last()];
        let mut out: Vec<Vec<f64>> = from
            .into_iter()
            .flatten()
            .map(|p| (0..to.theta.len()).map(|j| bound(j, 2.0 * to.theta[j] - p.theta[j])).collect())
            .collect();
        out.dedup();
        out
    }

    /// Whether another run ended where the best did.
    fn agree(&self, ends: &[End], best: usize, proof: &Proof) -> bool {
        (0..ends.len()).any(|i| i != best && self.apart(&ends[i].point, &ends[best].point, proof) <= CLOSE)
    }

    /// Distance of law and terms in standard errors.
    fn apart(&self, a: &Point, b: &Point, proof: &Proof) -> f64 {
        distance(&a.theta, &b.theta, &proof.covariance, &self.free) / proof.widening.sqrt()
    }

    fn runs(&self, begun: &[Begun], ends: &[End], best: usize, proof: Option<&Proof>) -> Vec<Run> {
        let of = |e: &End| Run {
            origin: e.origin,
            first: e.first,
            last: e.point.chi2,
            iterations: e.objective.len() - 1,
            distance: proof.map_or(f64::NAN, |p| self.apart(&e.point, &ends[best].point, p)),
        };
        let left = begun.iter().skip(ends.iter().map(|e| e.start + 1).max().unwrap_or(0));
        ends.iter()
            .map(of)
            .chain(left.map(|(s, near, o)| Run {
                origin: s.origin,
                first: s.point.chi2,
                last: near.chi2,
                iterations: o.len() - 1,
                distance: f64::NAN,
            }))
            .collect()
    }

    fn prove(&self, point: &Point) -> Option<Proof> {
        let inside = inside(self.model, point);
        let linear = self.problem.linearise(&inside)?;
        let residuals: Vec<Vec<&[f64]>> = linear
            .blocks
            .iter()
            .enumerate()
            .map(|(r, b)| b.residual.chunks(self.data.records[r].setup.time.len()).collect())
            .collect();
        let widening = overdispersion(&residuals);
        let covariance = self.problem.covariance(&inside)?;
        let probe = probe(&self.problem, point, &(&covariance * widening), CLOSE)?;
        Some(Proof { covariance, widening, probe })
    }
}

/// Names of the parameters that rest at a bound.
fn bounds(model: &Model<'_>, point: &Point) -> Vec<String> {
    let near = |x: f64, b: f64, step: f64| (x - b).abs() < 0.5 * step;
    let at = model.parameters.iter().zip(&point.theta);
    at.filter(|(p, x)| near(**x, p.lower, p.step) || near(**x, p.upper, p.step)).map(|(p, _)| p.name.clone()).collect()
}

/// What an end is judged by.
struct Proof {
    covariance: DMatrix<f64>,
    widening: f64,
    probe: Probe,
}

fn lowest(ends: &[End]) -> usize {
    (0..ends.len()).min_by(|a, b| ends[*a].point.chi2.total_cmp(&ends[*b].point.chi2)).unwrap_or(0)
}

/// Starts: where each comes from, and its law.
fn laws(case: &Case) -> Vec<(&'static str, Law)> {
    let s = case.data.scales;
    let mut out = Vec::new();
    if let Some(law) = case.law() {
        out.push(("the campaign's own law", law));
    }
    if let Some((k, p, mu_d)) = scan(&case.data, case.hysteresis()) {
        out.push(("scan over p with two columns", Law { k, p, mu_d }));
    }
    let g = case.guess;
    out.push(("pulse duration and peak", Law { k: g.k, p: g.p, mu_d: 0.15 * g.k / s.v_ref }));
    for p in [1.0, 1.5, 2.2, 3.0] {
        let k = g.k * s.x_ref.powf(g.p - p);
        out.push(("the same force with another p", Law { k, p, mu_d: 0.3 * k / s.v_ref }));
    }
    if case.hysteresis() {
        // most of the force from damping: valleys of little and of much damping need not be one
        for ratio in [4.0, 16.0] {
            for p in [0.8, 1.5] {
                let k = g.k * s.x_ref.powf(g.p - p) / ratio;
                out.push(("the same force, much damping", Law { k, p, mu_d: ratio * k / s.v_ref }));
            }
        }
    }
    out
}

/// The point with what sits at a bound moved a little inside, so that it has a standard error.
fn inside(model: &Model<'_>, point: &Point) -> Point {
    let mut p = point.clone();
    for (x, q) in p.theta.iter_mut().zip(&model.parameters) {
        *x = x.max(q.lower + 1e-3 * q.step).min(q.upper - 1e-3 * q.step);
    }
    p
}

/// sqrt(d' C^-1 d) over the parameters `of`.
fn distance(a: &[f64], b: &[f64], c: &DMatrix<f64>, of: &[usize]) -> f64 {
    let n = of.len();
    let d = DVector::from_fn(n, |i, _| a[of[i]] - b[of[i]]);
    let sub = DMatrix::from_fn(n, n, |i, j| c[(of[i], of[j])]);
    sub.cholesky().map_or(f64::NAN, |ch| d.dot(&ch.solve(&d)).max(0.0).sqrt())
}

/// Samples of a batch.
const BATCH: usize = 24;

/// Variance of batch means of whitened residuals over that of white noise, at least 1 (batch means: Conway 1963;
/// widening by the misfit: Birge 1932).
fn overdispersion(residuals: &[Vec<&[f64]>]) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for r in residuals.iter().flatten() {
        for b in r.chunks_exact(BATCH) {
            let m: f64 = b.iter().sum();
            sum += m * m / BATCH as f64;
            n += 1.0;
        }
    }
    // believed only beyond its own scatter
    let ratio = sum / f64::max(n, 1.0);
    if ratio > 1.0 + 2.5 * (2.0 / f64::max(n, 1.0)).sqrt() {
        ratio
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slow_misfit_widens_the_intervals_and_a_quick_one_does_not() {
        // signs that alternate have no mean in a batch; a slow wave has
        let quick: Vec<f64> = (0..2400).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        let slow: Vec<f64> = (0..2400).map(|i| 2f64.sqrt() * (f64::from(i) / 200.0).sin()).collect();
        assert_eq!(overdispersion(&[vec![&quick[..]]]), 1.0);
        let w = overdispersion(&[vec![&slow[..]]]);
        assert!((w / BATCH as f64 - 1.0).abs() < 0.1, "{w}");
    }

    #[test]
    fn distance_counts_in_standard_errors_of_what_is_asked() {
        let c = DMatrix::from_row_slice(2, 2, &[4.0, 0.0, 0.0, 9.0]);
        assert!((distance(&[2.0, 30.0], &[0.0, 0.0], &c, &[0]) - 1.0).abs() < 1e-12);
        assert!((distance(&[2.0, 3.0], &[0.0, 0.0], &c, &[0, 1]) - 2f64.sqrt()).abs() < 1e-12);
    }
}
