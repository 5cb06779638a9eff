//! Estimation of a campaign's law by simplex or by Levenberg-Marquardt, from several starts, with a certificate.
//!
//! Both minimise the same objective: squared whitened residuals of all channels plus the priors of tolerances and
//! nuisances. The law moves in (ln F_ref, p, mu_d v_ref/k), which are far better conditioned than (k, p, mu_d).

use super::prepare::{Guess, Invalid};
use super::scan::scan;
use super::simplex::{self, minimise};
use super::Watch;
use crate::model::estimate::{Data, Model, Options, Parameter, Point, Problem};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// How to minimise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Nelder and Mead 1965 over law and terms; tolerances and nuisances eliminated at every vertex.
    Simplex,
    /// Levenberg 1944, Marquardt 1963 over everything at once.
    LevenbergMarquardt,
}

/// (name, value, unit).
pub type Quantity = (String, f64, &'static str);

/// Makes the model of a campaign from start values k, p and mu_d.
pub type MakeModel<'a> = dyn Fn(f64, f64, f64) -> Model<'a> + Sync + 'a;

/// What is to be estimated.
pub struct Case<'a> {
    pub data: &'a Data,
    pub guess: Guess,
    /// The campaign's own k, p and mu_d, where it is calibrated.
    pub given: Option<(f64, f64, f64)>,
    /// Whether the law holds mu_d.
    pub hysteresis: bool,
    /// Parameters: ln F_ref, p, the damping ratio where there is one, tolerances (those with priors), terms.
    pub model: Box<MakeModel<'a>>,
    /// SI quantities of the terms beyond the law at a point of the model.
    #[allow(clippy::type_complexity)]
    pub describe: Box<dyn Fn(&[f64]) -> Vec<Quantity> + Sync + 'a>,
}

/// One start and where it led.
#[derive(Clone, Debug)]
pub struct Run {
    pub origin: &'static str,
    /// Objective at the start and where it ended.
    pub first: f64,
    pub last: f64,
    pub iterations: usize,
    /// Distance of law and terms from the best run's, in standard errors; NaN where it was not followed to its end.
    pub distance: f64,
}

/// The outcome.
pub struct Estimate {
    pub method: Method,
    /// Where the best start began, and where it ended.
    pub start: Point,
    pub point: Point,
    pub iterations: usize,
    /// Objective at the start and after every iteration.
    pub objective: Vec<f64>,
    /// Covariance of the model's parameters, not widened; None where it is singular.
    pub covariance: Option<DMatrix<f64>>,
    /// Factor on variances for a misfit that wanders more than noise, >= 1.
    pub widening: f64,
    /// Length of the gradient in standard errors: how far the optimum is, as Gauss and Newton's step tells it.
    pub gradient: f64,
    pub runs: Vec<Run>,
    /// Gradient gone and restarts agree.
    pub converged: bool,
    /// Why it ended before its time.
    pub stopped: Option<&'static str>,
}

/// Distances up to which gradient and restarts count as gone, in standard errors.
pub const CLOSE: f64 = 0.3;
/// Normal quantile of a 95 % interval.
const QUANTILE: f64 = 1.959_963_984_540_054;

struct Start {
    origin: &'static str,
    point: Point,
}

/// Value and 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub value: f64,
    pub low: f64,
    pub high: f64,
}

/// Estimates.
///
/// # Errors
/// When no start comes near the recordings.
pub fn estimate(case: &Case<'_>, method: Method, watch: &Watch<'_>) -> Result<Estimate, Invalid> {
    let data = case.data;
    let model = (case.model)(1.0, 1.0, 0.0);
    let problem = Problem::new(data, &model);
    let mut starts: Vec<Start> = laws(case)
        .into_par_iter()
        .map(|(origin, k, p, mu)| {
            let m = (case.model)(k, p, mu);
            Start { origin, point: Problem::new(data, &m).start() }
        })
        .collect();
    starts.retain(|s| s.point.chi2.is_finite());
    if starts.is_empty() {
        return Err(Invalid(
            "the simulation could not be brought near the recordings; check mass, units and speeds".into(),
        ));
    }
    (watch.say)(&format!("{} starts over {} recordings", starts.len(), data.records.len()));
    // a few steps of each tell which are worth following
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
    let followed = if method == Method::Simplex { 2 } else { 5 };
    let mut ends: Vec<(usize, Point, Vec<f64>, bool)> = Vec::new();
    for (i, (s, near, begun)) in begun.iter().enumerate().take(followed) {
        if i > 0 && watch.over().is_some() {
            break;
        }
        let end = match method {
            Method::LevenbergMarquardt => {
                let (p, o, c) = descend(&problem, near.clone(), watch);
                (i, p, begun.iter().chain(&o[1..]).cloned().collect(), c)
            }
            Method::Simplex => {
                let (p, o, c) = search(data, &model, &s.point, watch);
                (i, p, o, c)
            }
        };
        ends.push(end);
    }
    let best = (0..ends.len()).min_by(|a, b| ends[*a].1.chi2.total_cmp(&ends[*b].1.chi2)).unwrap_or(0);
    let point = ends[best].1.clone();
    let free = free(&model);
    let linear = problem.linearise(&inside(&model, &point));
    let widening = linear.as_ref().map_or(1.0, |l| {
        let residuals: Vec<Vec<&[f64]>> = l
            .blocks
            .iter()
            .enumerate()
            .map(|(r, b)| b.residual.chunks(data.records[r].setup.time.len()).collect())
            .collect();
        wander(&residuals)
    });
    let covariance = problem.covariance(&inside(&model, &point));
    let runs = begun
        .iter()
        .enumerate()
        .map(|(i, (s, near, o))| {
            let end = ends.iter().find(|e| e.0 == i);
            Run {
                origin: s.origin,
                first: s.point.chi2,
                last: end.map_or(near.chi2, |e| e.1.chi2),
                iterations: end.map_or(o.len(), |e| e.2.len()) - 1,
                distance: match (end, &covariance) {
                    (Some(e), Some(c)) => distance(&e.1.theta, &point.theta, c, &free) / widening.sqrt(),
                    _ => f64::NAN,
                },
            }
        })
        .collect::<Vec<_>>();
    let gradient = problem.decrement(&point).map_or(f64::NAN, |d| (d / widening).sqrt());
    let agree = runs.iter().enumerate().any(|(i, r)| i != ends[best].0 && r.distance <= CLOSE);
    let stopped = watch.over();
    Ok(Estimate {
        method,
        start: begun[ends[best].0].0.point.clone(),
        iterations: ends[best].2.len() - 1,
        objective: ends[best].2.clone(),
        converged: stopped.is_none() && ends[best].3 && gradient <= CLOSE && agree,
        point,
        covariance,
        widening,
        gradient,
        runs,
        stopped,
    })
}

/// Starts: (origin, k, p, mu_d).
fn laws(case: &Case<'_>) -> Vec<(&'static str, f64, f64, f64)> {
    let s = case.data.scales;
    let mut out = Vec::new();
    if let Some((k, p, mu)) = case.given {
        out.push(("the campaign's own law", k, p, mu));
    }
    if let Some((k, p, mu)) = scan(case.data, case.hysteresis) {
        out.push(("scan over p with two columns", k, p, mu));
    }
    let g = case.guess;
    out.push(("pulse duration and peak", g.k, g.p, 0.15 * g.k / s.v_ref));
    for p in [1.0, 1.5, 2.2, 3.0] {
        let k = g.k * s.x_ref.powf(g.p - p);
        out.push(("the same force with another p", k, p, 0.3 * k / s.v_ref));
    }
    if case.hysteresis {
        // most of the force from damping: valleys of little and of much damping need not be one
        for p in [0.8, 1.5] {
            let k = g.k * s.x_ref.powf(g.p - p) / 4.0;
            out.push(("the same force, much damping", k, p, 4.0 * k / s.v_ref));
        }
    }
    out
}

/// Indices of what a simplex moves in: all but tolerances.
fn free(model: &Model<'_>) -> Vec<usize> {
    (0..model.parameters.len()).filter(|j| model.parameters[*j].prior.is_none()).collect()
}

/// The point with what sits at a bound moved a little inside, so that it has a standard error.
fn inside(model: &Model<'_>, point: &Point) -> Point {
    let mut p = point.clone();
    for (x, q) in p.theta.iter_mut().zip(&model.parameters) {
        *x = x.max(q.lower + 1e-3 * q.step).min(q.upper - 1e-3 * q.step);
    }
    p
}

/// Levenberg-Marquardt to its end, in slices so that it can be stopped.
fn descend(problem: &Problem<'_>, mut point: Point, watch: &Watch<'_>) -> (Point, Vec<f64>, bool) {
    let mut objective = vec![point.chi2];
    for _ in 0..12 {
        if watch.over().is_some() {
            return (point, objective, false);
        }
        let f = problem.fit(point, &Options { iterations: 5, tolerance: 1e-7, hopeless: 0.0 });
        objective.extend(&f.objective[1..]);
        point = f.point;
        (watch.say)(&format!("iteration {}: objective {:.6e}", objective.len() - 1, point.chi2));
        if f.converged {
            return (point, objective, true);
        }
    }
    (point, objective, false)
}

/// Mirrors at the bounds.
fn fold(x: f64, p: &Parameter) -> f64 {
    let y = if x < p.lower { 2.0 * p.lower - x } else { x };
    let y = if y > p.upper { 2.0 * p.upper - y } else { y };
    y.clamp(p.lower, p.upper)
}

/// The simplex over law and terms, everything else at its best for each vertex.
fn search(data: &Data, model: &Model<'_>, start: &Point, watch: &Watch<'_>) -> (Point, Vec<f64>, bool) {
    let ps = &model.parameters;
    let free = free(model);
    let tolerances: Vec<usize> = (0..ps.len()).filter(|j| ps[*j].prior.is_some()).collect();
    let mut best = start.clone();
    let mut stop = false;
    let profile = |z: &[f64], from: &Point| -> Point {
        let mut theta = from.theta.clone();
        for (j, x) in free.iter().zip(z) {
            theta[*j] = fold(*x, &ps[*j]);
        }
        let outer = theta.clone();
        let inner = Model {
            parameters: tolerances.iter().map(|j| ps[*j].clone()).collect(),
            apply: Box::new(|t, p| {
                let mut th = outer.clone();
                for (j, x) in tolerances.iter().zip(t) {
                    th[*j] = *x;
                }
                (model.apply)(&th, p);
            }),
        };
        let problem = Problem::new(data, &inner);
        let p = problem.evaluate(tolerances.iter().map(|j| theta[*j]).collect(), from.locals.clone());
        let f = problem.fit(p, &Options { iterations: 12, tolerance: 1e-7, hopeless: 0.0 });
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
    best = profile(&z0, &best);
    let samples = data.samples().max(1) as f64;
    let mut objective = vec![start.chi2];
    let mut converged = false;
    // again from where it ended, on a smaller simplex, until it stays there
    let mut scale = 1.0;
    for round in 0..3 {
        let before = best.chi2;
        let spread = 5e-3 * (before / samples).max(1.0);
        let options = simplex::Options { iterations: 250, spread, size: f64::INFINITY };
        let z: Vec<f64> = free.iter().map(|j| best.theta[*j]).collect();
        let steps: Vec<f64> = step.iter().map(|s| s * scale).collect();
        let mut state = best.clone();
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
        let done = objective.len() - 1;
        let m = minimise(&mut f, &z, &steps, &options, &mut |i, v| {
            if i % 10 == 0 {
                (watch.say)(&format!("iteration {}: objective {v:.6e}", done + i));
            }
            stop = watch.over().is_some();
            stop
        });
        best = state;
        objective.extend(m.path[1..].iter().map(|p| p.1));
        if stop || !m.converged {
            break;
        }
        converged = before - best.chi2 < 10.0 * spread;
        if round > 0 && converged {
            break;
        }
        scale = 0.1;
    }
    (best, objective, converged && !stop)
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
fn wander(residuals: &[Vec<&[f64]>]) -> f64 {
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

impl Estimate {
    /// k N/m^p, p and mu_d N s/m^(p+1) at a point.
    pub fn law_at(case: &Case<'_>, theta: &[f64]) -> [f64; 3] {
        let s = case.data.scales;
        let k = (theta[0] - theta[1] * s.x_ref.ln()).exp();
        [k, theta[1], if case.hysteresis { theta[2] * k / s.v_ref } else { 0.0 }]
    }

    /// k, p and mu_d with their 95 % intervals; k, and mu_d where it is well away from zero, on a logarithmic scale.
    pub fn law(&self, case: &Case<'_>) -> [Interval; 3] {
        let s = case.data.scales;
        let th = &self.point.theta;
        let [k, p, mu] = Estimate::law_at(case, th);
        let l = s.x_ref.ln();
        let sd_k = self.deviation(&[1.0, -l]);
        let sd_p = self.deviation(&[0.0, 1.0]);
        let mut out = [log_interval(k, sd_k), interval(p, sd_p), Interval { value: mu, low: mu, high: mu }];
        if case.hysteresis {
            let sd = if th[2] > 0.0 { self.deviation(&[1.0, -l, 1.0 / th[2]]) } else { f64::INFINITY };
            out[2] = if sd < 0.5 {
                log_interval(mu, sd)
            } else {
                let unit = k / s.v_ref;
                let i = interval(th[2], self.deviation(&[0.0, 0.0, 1.0]));
                Interval { value: mu, low: (unit * i.low).max(0.0), high: unit * i.high }
            };
        }
        out
    }

    /// Force at the reference depth at rest, N.
    pub fn reference_force(&self) -> Interval {
        log_interval(self.point.theta[0].exp(), self.deviation(&[1.0]))
    }

    /// The terms beyond the law, in SI, each with its interval.
    pub fn terms(&self, case: &Case<'_>) -> Vec<(String, &'static str, Interval)> {
        let at = (case.describe)(&self.point.theta);
        let n = self.point.theta.len();
        let mut var = vec![0.0; at.len()];
        for j in 0..n {
            let mut unit = vec![0.0; n];
            unit[j] = 1.0;
            let sd = self.deviation(&unit);
            let mut th = self.point.theta.clone();
            th[j] += sd;
            for (v, (b, a)) in var.iter_mut().zip((case.describe)(&th).iter().zip(&at)) {
                *v += (b.1 - a.1).powi(2);
            }
        }
        at.into_iter().zip(var).map(|((name, value, unit), v)| (name, unit, interval(value, v.sqrt()))).collect()
    }

    /// Standard error of a combination of the first parameters, widened.
    fn deviation(&self, weights: &[f64]) -> f64 {
        let Some(c) = &self.covariance else { return f64::INFINITY };
        let mut v = 0.0;
        for (i, a) in weights.iter().enumerate() {
            for (j, b) in weights.iter().enumerate() {
                v += a * b * c[(i, j)];
            }
        }
        (v.max(0.0) * self.widening).sqrt()
    }
}

fn interval(value: f64, sd: f64) -> Interval {
    Interval { value, low: value - QUANTILE * sd, high: value + QUANTILE * sd }
}

fn log_interval(value: f64, sd: f64) -> Interval {
    Interval { value, low: value * (-QUANTILE * sd).exp(), high: value * (QUANTILE * sd).exp() }
}
