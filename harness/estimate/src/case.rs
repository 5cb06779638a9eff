//! An estimate of a campaign's law: what it is made of, its values and their intervals.
//!
//! Both minimise the same objective: squared whitened residuals of all channels plus the priors of tolerances and
//! nuisances. The law moves in (ln F_ref, p, mu_d v_ref/k), which are far better conditioned than (k, p, mu_d).

use crate::budget::Ended;
use crate::condition::Guess;
use crate::prepare::Prepared;
use crate::problem::{Data, Model, Point, Problem};
use crate::structure::{Law, Structure};
use nalgebra::DMatrix;
use std::sync::Arc;

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

/// Lowest exponent an estimation may reach: a law alone may want a flatter curve than any contact has.
const FLATTEST: f64 = 0.2;

/// What is to be estimated: the simulation as its user has it, with the terms he lists.
pub struct Case {
    pub data: Arc<Data>,
    pub guess: Guess,
    pub structure: Structure,
    /// The structure's model, with room for a flatter law.
    pub model: Model<'static>,
}

impl Case {
    /// The simulation of a prepared campaign.
    pub fn new(prepared: Prepared) -> Case {
        let Prepared { data, guess, structure } = prepared;
        let mut model = structure.model().clone();
        model.parameters[1].lower = FLATTEST;
        Case { data, guess, structure, model }
    }

    /// The problem to solve.
    pub fn problem(&self) -> Problem<'_> {
        Problem::new(&self.data, &self.model)
    }

    /// The campaign's own law, where it is calibrated.
    pub fn law(&self) -> Option<Law> {
        self.structure.base().law()
    }

    /// Whether the law holds mu_d.
    pub fn hysteresis(&self) -> bool {
        self.structure.base().hysteresis
    }

    /// SI quantities of the terms beyond the law at a point of the model.
    pub fn describe(&self, theta: &[f64]) -> Vec<Quantity> {
        let base = self.structure.base();
        let mut at = theta.len() - base.given.iter().map(|t| t.form.parameters.len()).sum::<usize>();
        let mut out = Vec::new();
        for t in &base.given {
            let n = t.form.parameters.len();
            let of = t.form.describe(&theta[at..at + n], &base.context);
            out.extend(of.into_iter().map(|(q, v, u)| (format!("{}: {q}", t.mechanism.name), v, u)));
            at += n;
        }
        out
    }
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
    /// Factor on variances for the overdispersion of the misfit, >= 1.
    pub widening: f64,
    /// Length of the gradient in standard errors: the distance of the optimum by Gauss and Newton's step.
    pub gradient: f64,
    /// Least rise of the objective, in units of `widening`, over steps of [`CLOSE`] standard errors both ways along
    /// every principal axis; 0.09 for a parabola, negative where something is lower, NaN where it cannot be probed.
    pub rise: f64,
    pub runs: Vec<Run>,
    /// Nothing lower close by, and another start ends at the same values.
    pub converged: bool,
    /// Names of the parameters that rest at a bound.
    pub bounds: Vec<String>,
    /// Why it ended before its time.
    pub stopped: Option<Ended>,
}

/// Distance at which the end is probed, and up to which restarts count as the same, in standard errors.
pub const CLOSE: f64 = 0.3;
/// Normal quantile of a 95 % interval.
const QUANTILE: f64 = 1.959_963_984_540_054;

/// Value and 95 % interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    pub value: f64,
    pub low: f64,
    pub high: f64,
}

impl Estimate {
    /// k N/m^p, p and mu_d N s/m^(p+1) at a point.
    pub fn law_at(case: &Case, theta: &[f64]) -> [f64; 3] {
        let s = case.data.scales;
        let k = (theta[0] - theta[1] * s.x_ref.ln()).exp();
        [k, theta[1], if case.hysteresis() { theta[2] * k / s.v_ref } else { 0.0 }]
    }

    /// k, p and mu_d with their 95 % intervals; k, and mu_d where it is well away from zero, on a logarithmic scale.
    pub fn law(&self, case: &Case) -> [Interval; 3] {
        let s = case.data.scales;
        let th = &self.point.theta;
        let [k, p, mu] = Estimate::law_at(case, th);
        let l = s.x_ref.ln();
        let sd_k = self.deviation(&[1.0, -l]);
        let sd_p = self.deviation(&[0.0, 1.0]);
        let mut out = [log_interval(k, sd_k), interval(p, sd_p), Interval { value: mu, low: mu, high: mu }];
        if case.hysteresis() {
            let sd = if th[2] > 0.0 { self.deviation(&[1.0, -l, 1.0 / th[2]]) } else { f64::INFINITY };
            // nothing but damping: k may as well be none
            if self.bounds.iter().any(|b| b == "damping ratio") && th[2] > 0.0 {
                out[0].low = 0.0;
            }
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
    pub fn terms(&self, case: &Case) -> Vec<(String, &'static str, Interval)> {
        let at = case.describe(&self.point.theta);
        let n = self.point.theta.len();
        let mut var = vec![0.0; at.len()];
        for j in 0..n {
            let mut unit = vec![0.0; n];
            unit[j] = 1.0;
            let sd = self.deviation(&unit);
            let mut th = self.point.theta.clone();
            th[j] += sd;
            for (v, (b, a)) in var.iter_mut().zip(case.describe(&th).iter().zip(&at)) {
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
