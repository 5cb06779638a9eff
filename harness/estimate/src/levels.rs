//! How far the fitted law is from the recordings: recording by recording, and level by level.

use crate::case::{Case, Estimate};
use crate::descent::descend;
use crate::problem::{Point, Problem};
use crate::Watch;
use rayon::prelude::*;
use record::{range, Campaign, Channel};

/// Readings of every recording by channel at a point; empty where the simulation fails.
pub type Readings = Vec<[Vec<f64>; 3]>;

/// What a level comes to.
#[derive(Clone, Debug)]
pub struct Level {
    /// As the campaign writes it.
    pub text: String,
    pub recordings: usize,
    /// By channel: rms of the difference over the recording's range, mean over recordings.
    pub nrmse: [Option<f64>; 3],
    /// By channel: the same in standard deviations of the noise.
    pub noises: [Option<f64>; 3],
    /// By channel: largest reading simulated over largest measured, less 1.
    pub peak: [Option<f64>; 3],
    /// The law fitted to this level alone: force at the reference depth N, p, mean nrmse.
    pub alone: Option<(f64, f64, f64)>,
}

/// Simulated readings at a point.
pub fn readings(case: &Case, point: &Point) -> Readings {
    let problem = case.problem();
    (0..case.data.records.len())
        .into_par_iter()
        .map(|r| {
            let (t, y) = problem.predict(&point.theta, r, &point.locals[r]);
            if t.ok {
                y
            } else {
                Default::default()
            }
        })
        .collect()
}

/// rms of the difference over the range of the measured, where both are there.
pub fn nrmse(measured: &[f64], simulated: &[f64]) -> Option<f64> {
    let range = range(measured);
    (simulated.len() == measured.len() && range > 0.0).then(|| rms(measured, simulated) / range)
}

/// A level as the campaign writes it; small numbers with an exponent.
pub fn name(campaign: &Campaign, level: usize) -> String {
    match campaign.levels.get(level) {
        Some((_, text)) => match text.parse::<f64>() {
            Ok(v) if v != 0.0 && v.abs() < 1e-3 => format!("{v:e}"),
            _ => text.clone(),
        },
        None => "-".into(),
    }
}

fn rms(a: &[f64], b: &[f64]) -> f64 {
    (a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum::<f64>() / a.len() as f64).sqrt()
}

fn mean(v: &[f64]) -> Option<f64> {
    (!v.is_empty()).then(|| v.iter().sum::<f64>() / v.len() as f64)
}

/// Largest departure from where the reading starts.
fn top(y: &[f64]) -> f64 {
    y.iter().map(|v| (v - y[0]).abs()).fold(0.0, f64::max)
}

/// The misfit level by level; each level also fitted alone, unless the watch is over.
pub fn levels(campaign: &Campaign, case: &Case, e: &Estimate, y: &Readings, watch: &Watch<'_>) -> Vec<Level> {
    let data = &case.data;
    let quiet = Watch { budget: watch.budget, say: &|_| {} };
    let mut present: Vec<usize> = data.records.iter().map(|r| r.level).collect();
    present.sort_unstable();
    present.dedup();
    present
        .par_iter()
        .map(|level| {
            let of: Vec<usize> = (0..data.records.len()).filter(|r| data.records[*r].level == *level).collect();
            let mut l = Level {
                text: name(campaign, *level),
                recordings: of.len(),
                nrmse: [None; 3],
                noises: [None; 3],
                peak: [None; 3],
                alone: None,
            };
            for c in Channel::ALL {
                let i = c.index();
                let pairs: Vec<(&[f64], &[f64])> = of
                    .iter()
                    .filter(|r| data.compared(**r).any(|d| d == c) && !y[**r][i].is_empty())
                    .filter_map(|r| data.records[*r].y[i].as_ref().map(|m| (m.as_slice(), y[*r][i].as_slice())))
                    .collect();
                let by =
                    |f: &dyn Fn(&[f64], &[f64]) -> f64| mean(&pairs.iter().map(|(m, s)| f(m, s)).collect::<Vec<_>>());
                l.nrmse[i] = by(&|m, s| nrmse(m, s).unwrap_or(0.0));
                l.noises[i] = by(&|m, s| rms(m, s) / data.noise[i].marginal());
                l.peak[i] = by(&|m, s| top(s) / top(m) - 1.0);
            }
            if present.len() > 1 && watch.over().is_none() {
                let sub = data.subset(|r| of.contains(&r));
                let problem = Problem::new(&sub, &case.model);
                let locals = of.iter().map(|r| e.point.locals[*r].clone()).collect();
                let f = descend(&problem, problem.evaluate(e.point.theta.clone(), locals), &quiet);
                let mut shares = Vec::new();
                for (i, rec) in sub.records.iter().enumerate() {
                    let (_, s) = problem.predict(&f.point.theta, i, &f.point.locals[i]);
                    shares.extend(
                        sub.compared(i).filter_map(|c| rec.y[c.index()].as_ref().and_then(|m| nrmse(m, &s[c.index()]))),
                    );
                }
                l.alone = mean(&shares).map(|m| (f.point.theta[0].exp(), f.point.theta[1], m));
            }
            l
        })
        .collect()
}
