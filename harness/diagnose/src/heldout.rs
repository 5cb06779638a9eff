//! Recordings predicted by parameters fitted without any recording of their own level.

use estimate::fitted::Fitted;
use estimate::levels::nrmse;
use estimate::problem::{Data, Nuisance, Options, Point, Problem};
use rayon::prelude::*;

/// Predictions of every recording, by channel, and their misfit (mean of rms over range).
pub struct HeldOut {
    pub readings: Vec<[Vec<f64>; 3]>,
    pub nrmse: f64,
    /// What each recording was predicted with: the model's parameters and the recording's own.
    pub points: Vec<(Vec<f64>, Vec<f64>)>,
}

/// Predicts every recording with `candidate` refitted without its level.
pub fn held_out(candidate: &Fitted) -> HeldOut {
    let data = &*candidate.data;
    let n = data.records.len();
    let mut levels: Vec<usize> = data.records.iter().map(|r| r.level).collect();
    levels.sort_unstable();
    levels.dedup();
    // groups left out together
    let groups: Vec<Vec<usize>> = if levels.len() > 1 {
        levels.iter().map(|l| (0..n).filter(|r| data.records[*r].level == *l).collect()).collect()
    } else {
        (0..n).map(|r| vec![r]).collect()
    };
    type Part = (usize, [Vec<f64>; 3], (Vec<f64>, Vec<f64>));
    let parts: Vec<Vec<Part>> = groups
        .par_iter()
        .map(|out| {
            let train: Data = if n > 1 {
                data.subset(|r| !out.contains(&r))
            } else {
                // one recording: its first half cycle
                let mut d = data.clone();
                let (t, _) = candidate.predict(0);
                for w in &mut d.records[0].weight {
                    for (w, time) in w.iter_mut().zip(&data.records[0].setup.time) {
                        if *time > t.deepest {
                            *w = 0.0;
                        }
                    }
                }
                d
            };
            let problem = Problem::new(&train, candidate.structure.model());
            let kept: Vec<usize> = if n > 1 { (0..n).filter(|r| !out.contains(r)).collect() } else { vec![0] };
            let start = Point {
                theta: candidate.fit.point.theta.clone(),
                locals: kept.iter().map(|r| candidate.fit.point.locals[*r].clone()).collect(),
                chi2: f64::INFINITY,
            };
            let start = problem.evaluate(start.theta, start.locals);
            let fit = problem.fit(start, &Options { iterations: 20, ..Options::default() });
            let full = candidate.problem();
            out.iter()
                .map(|r| {
                    let mut local = data.local_start(*r);
                    // where the full fit put the touch is a start, not knowledge carried over
                    for (i, k) in full.nuisances().iter().enumerate() {
                        if matches!(k, Nuisance::Start) {
                            local[i] = candidate.fit.point.locals[*r][i];
                        }
                    }
                    let local = full.fit_local(&fit.point.theta, *r, &local, &|k| {
                        matches!(k, Nuisance::Start | Nuisance::Speed | Nuisance::Offset)
                            || k == Nuisance::Zero(record::Channel::Penetration)
                    });
                    let (_, y) = full.predict(&fit.point.theta, *r, &local);
                    (*r, y, (fit.point.theta.clone(), local))
                })
                .collect()
        })
        .collect();
    let mut readings: Vec<[Vec<f64>; 3]> = vec![Default::default(); n];
    let mut points = vec![Default::default(); n];
    for (r, y, p) in parts.into_iter().flatten() {
        readings[r] = y;
        points[r] = p;
    }
    let nrmse = misfit(data, &readings);
    HeldOut { readings, nrmse, points }
}

/// Mean over recordings and channels of rms(recording - prediction) / range(recording).
pub fn misfit(data: &Data, readings: &[[Vec<f64>; 3]]) -> f64 {
    let (mut sum, mut n) = (0.0, 0.0);
    for (rec, p) in data.records.iter().zip(readings) {
        for (y, p) in rec.y.iter().zip(p) {
            let Some(y) = y else { continue };
            if let Some(e) = nrmse(y, p) {
                sum += e;
                n += 1.0;
            }
        }
    }
    if n > 0.0 {
        sum / n
    } else {
        f64::NAN
    }
}
