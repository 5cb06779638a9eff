//! A base fit, beside the same one in scipy: the same data, noise, priors and start.

use super::clock::cpu_seconds;
use super::python::Python;
use super::Spread;
use anyhow::{bail, ensure, Context, Result};
use estimate::prepare::Prepared;
use estimate::problem::{Data, Fit, Nuisance, Options, Problem};
use estimate::structure::{Base, Law};
use mechanisms::physics::GRAVITY;
use plant::noise::{Noise, ORDER};
use plant::simulate::TOLERANCE;
use record::{Campaign, Channel, Kind};
use serde_json::{json, Value};
use std::path::Path;

const SCRIPT: &str = include_str!("../../../../tests/bench/fit_side.py");
/// Share by which chi^2 may lie above ours for a fit to count as arrived.
pub const SHARE: f64 = 0.01;
/// Share by which the sides' chi^2 may differ at the same parameters: their integrators' errors.
const AGREEMENT: f64 = 2e-3;

/// k, p, mu_d of a fit, and its chi^2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Squared whitened residuals and priors.
    pub chi2: f64,
    /// N/m^p.
    pub k: f64,
    /// 1.
    pub p: f64,
    /// N s/m^(p+1).
    pub mu_d: f64,
}

/// A fit in scipy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Theirs {
    /// CPU s of one thread.
    pub seconds: f64,
    /// Whether chi^2 came within [`SHARE`] of ours.
    pub arrived: bool,
    /// Where it ended.
    pub found: Found,
}

/// What the base fit came to.
#[derive(Clone, Debug)]
pub struct BaseFit {
    /// Recordings and samples compared.
    pub size: (usize, usize),
    /// Parameters in all.
    pub parameters: usize,
    /// chi^2 at the start.
    pub start: f64,
    /// Ours, CPU s of one thread.
    pub seconds: Spread,
    /// Where ours ended.
    pub found: Found,
    /// scipy's versions.
    pub versions: String,
    /// solve_ivp and Nelder-Mead.
    pub simplex: Theirs,
    /// least_squares over the numba model, as it comes.
    pub plain: Theirs,
    /// The same, with the Jacobian's blocks given.
    pub structured: Theirs,
}

fn nuisance_name(n: Nuisance) -> String {
    match n {
        Nuisance::Start => "start".into(),
        Nuisance::Speed => "speed".into(),
        Nuisance::Stiffness => "stiffness".into(),
        Nuisance::Offset => "offset".into(),
        Nuisance::Tilt => "tilt".into(),
        Nuisance::Zero(c) => format!("zero {}", c.name()),
    }
}

/// The matrix of a noise's whitening: rows of its first [`ORDER`] samples, and what every later one takes of itself
/// and those before it. Had from its answers to unit impulses.
fn whitening(noise: &Noise) -> (Vec<Vec<f64>>, Vec<f64>) {
    let n = 2 * ORDER + 1;
    let column = |j: usize| {
        let (mut e, mut w) = (vec![0.0; n], vec![0.0; n]);
        e[j] = 1.0;
        noise.whiten(&e, &mut w);
        w
    };
    let columns: Vec<Vec<f64>> = (0..ORDER).map(column).collect();
    let head = (0..ORDER).map(|i| columns.iter().map(|c| c[i]).collect()).collect();
    (head, column(ORDER)[ORDER..].to_vec())
}

/// The problem as the Python side takes it.
fn described(c: &Campaign, base: &Base, problem: &Problem<'_>, start: &[f64], best: &Fit) -> Value {
    let data = problem.data;
    let nuisances = data.nuisances();
    let s = data.scales;
    let local_steps: Vec<f64> = nuisances.iter().map(|n| data.local_step(*n)).collect();
    let noise: Vec<_> = data.noise.iter().map(whitening).collect();
    let records: Vec<Value> = data
        .records
        .iter()
        .enumerate()
        .map(|(r, rec)| {
            let priors: Vec<_> = nuisances.iter().map(|n| data.prior(r, *n)).collect();
            json!({
                "time": rec.setup.time, "y": rec.y, "weight": rec.weight, "start": data.local_start(r),
                "priors": priors, "first_speed": if rec.at_first { rec.speed } else { None },
                "depth": rec.setup.depth, "speed": rec.setup.speed, "duration": rec.setup.duration,
            })
        })
        .collect();
    let parameters: Vec<Value> = problem
        .model
        .parameters
        .iter()
        .zip(start)
        .map(|(p, start)| {
            json!({"name": p.name, "start": start, "lower": p.lower, "upper": p.upper, "step": p.step, "prior": p.prior})
        })
        .collect();
    json!({
        "campaign": c.folder, "mass": data.mass, "gravity": if base.gravity { GRAVITY } else { 0.0 },
        "hysteresis": base.hysteresis, "x_ref": s.x_ref, "v_ref": s.v_ref, "tolerance": TOLERANCE,
        "parameters": parameters, "local_steps": local_steps,
        "nuisances": nuisances.iter().map(|n| nuisance_name(*n)).collect::<Vec<_>>(),
        "noise": {
            "head": noise.iter().map(|n| &n.0).collect::<Vec<_>>(),
            "taps": noise.iter().map(|n| &n.1).collect::<Vec<_>>(),
        },
        "records": records,
        "goal": best.point.chi2, "share": SHARE,
        "optimum": {"theta": best.point.theta, "locals": best.point.locals},
    })
}

/// Refuses what the Python side has no model of.
fn comparable(c: &Campaign, data: &Data) -> Result<()> {
    ensure!(
        c.kind == Kind::DropTest,
        "{}: the base fit is compared on drop tests; give a campaign of that kind, or none",
        c.dir.display()
    );
    if let Some(t) = c.simulation.terms.iter().find(|t| *t != "gravity" && *t != "hysteresis_damping") {
        bail!(
            "{}: its simulation holds {t}, which the scipy side has no model of; give a campaign whose terms are \
             gravity and hysteresis_damping, or none",
            c.dir.join("campaign.toml").display()
        );
    }
    ensure!(
        Channel::ALL.iter().any(|ch| data.has(*ch)),
        "{}: no channel to compare; give a campaign with force, acceleration or penetration",
        c.dir.display()
    );
    Ok(())
}

fn theirs(a: &[f64]) -> Result<Theirs> {
    let [seconds, chi2, _, arrived, k, p, mu_d] = *a else {
        bail!("Python answered {} numbers to a fit, not 7", a.len());
    };
    Ok(Theirs { seconds, arrived: arrived != 0.0, found: Found { chi2, k, p, mu_d } })
}

/// Fits the base of `c` here, `rounds` times, and in scipy, in turn; both on one thread. Nelder-Mead is given up
/// after `patience` CPU s. The JSON file that describes it to Python goes to `folder`; `at` hears what is done next.
///
/// # Errors
/// A campaign that cannot be fitted or compared; a Python that refuses; sides that do not compute the same chi^2.
pub fn base_fit(
    c: &Campaign,
    python: &Path,
    folder: &Path,
    rounds: usize,
    patience: f64,
    at: &dyn Fn(&str),
) -> Result<BaseFit> {
    at("preparing the base fit");
    let Prepared { data, guess, structure } = Prepared::new(c)?;
    comparable(c, &data)?;
    let guessed = Law { k: guess.k, p: guess.p, mu_d: 0.15 * guess.k / data.scales.v_ref };
    let law = structure.base().law().unwrap_or(guessed);
    let problem = Problem::new(&data, structure.model());
    let start = problem.start(structure.start(law));
    ensure!(start.chi2.is_finite(), "{}: its law cannot be simulated at the start", c.dir.display());
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().context("a thread cannot be started")?;
    let fit = || {
        one.install(|| {
            let began = cpu_seconds();
            let f = problem.fit(start.clone(), &Options { iterations: 40, ..Options::default() });
            (cpu_seconds() - began, f)
        })
    };
    let (_, best) = fit();
    let file = folder.join("fit.json");
    std::fs::write(&file, serde_json::to_vec(&described(c, structure.base(), &problem, &start.theta, &best))?)?;
    let mut python = Python::start(python, SCRIPT, &[&file])?;
    let agree = python.ask("agree")?;
    for (i, ours) in [start.chi2, start.chi2, best.point.chi2, best.point.chi2].into_iter().enumerate() {
        let other = agree.get(i).copied().unwrap_or(f64::NAN);
        ensure!(
            (other - ours).abs() <= AGREEMENT * ours,
            "the sides do not compare the same: at the {} chi^2 is {ours} here and {other} in scipy",
            if i < 2 { "start" } else { "optimum" }
        );
    }
    let mut seconds = Vec::new();
    let mut ours = |n: usize| (0..n).for_each(|_| seconds.push(fit().0));
    at("least_squares over numba");
    ours(rounds.div_ceil(3));
    let plain = theirs(&python.ask("plain")?)?;
    let structured = theirs(&python.ask("structured")?)?;
    ours(rounds.div_ceil(3));
    at("solve_ivp and Nelder-Mead, which takes its time");
    let simplex = theirs(&python.ask(&format!("simplex {patience}"))?)?;
    ours(rounds.div_ceil(3));
    let law = problem.physics(&best.point.theta).law;
    Ok(BaseFit {
        size: (data.records.len(), data.samples()),
        parameters: problem.model.parameters.len() + data.records.len() * data.nuisances().len(),
        start: start.chi2,
        seconds: Spread::of(seconds),
        found: Found {
            chi2: best.point.chi2,
            k: law.elastic.stiffness,
            p: law.elastic.exponent,
            mu_d: law.hysteresis_damping.coefficient,
        },
        versions: python.versions.clone(),
        simplex,
        plain,
        structured,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant::noise::Stretch;

    #[test]
    fn whitening_told_is_whitening_done() {
        let e: Vec<f64> = (0..400).map(|i| (f64::from(i) * 0.7).sin() + (f64::from(i * i) * 0.3).cos()).collect();
        let noise = Noise::estimate(&[Stretch::whole(e.clone())], 0.0).unwrap();
        let (head, taps) = whitening(&noise);
        let mut w = vec![0.0; e.len()];
        noise.whiten(&e, &mut w);
        for i in 0..e.len() {
            let predicted: f64 = if i < ORDER {
                head[i].iter().zip(&e).map(|(a, b)| a * b).sum()
            } else {
                taps.iter().enumerate().map(|(k, a)| a * e[i - k]).sum()
            };
            assert!((predicted - w[i]).abs() < 1e-9 * w[i].abs().max(1.0), "sample {i}: {predicted} and {}", w[i]);
        }
    }

    #[test]
    fn an_answer_that_is_no_fit_is_refused() {
        assert!(theirs(&[1.0, 2.0]).is_err());
        let t = theirs(&[1.0, 2.0, 3.0, 0.0, 4.0, 5.0, 6.0]).unwrap();
        assert!(!t.arrived && t.found.mu_d == 6.0);
    }
}
