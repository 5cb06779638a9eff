//! Recordings predicted by parameters fitted without any recording of their own level; and by names chosen without it.

use crate::evidence::{weighed, Evidences};
use crate::posterior::{sorted, Posterior};
use crate::predictions::Predictions;
use crate::table::Table;
use estimate::fitted::Fitted;
use estimate::problem::{Data, Nuisance, Options, Problem};
use rayon::prelude::*;
use record::{Channel, Kind};
use std::convert::Infallible;
use std::sync::Arc;

/// A fit that has not seen some of the recordings.
#[derive(Clone)]
pub struct Fold {
    /// Indices of the recordings left out.
    pub out: Vec<usize>,
    pub fitted: Fitted,
}

/// Predictions of every recording by fits that did not see it.
#[derive(Clone, Default)]
pub struct HeldOut {
    pub predictions: Predictions,
    /// Their misfit, as [`Predictions::misfit`].
    pub nrmse: f64,
    /// What each recording was predicted with: the model's parameters and the recording's own.
    pub points: Vec<(Vec<f64>, Vec<f64>)>,
    /// The fits that predicted them.
    pub folds: Vec<Fold>,
}

/// Predictions in which every fold chose its own names.
#[derive(Clone, Default)]
pub struct Folds {
    /// Indices of the recordings that each fold left out, and the names it chose.
    pub names: Vec<(Vec<usize>, Vec<&'static str>)>,
    /// Predictions by those.
    pub predictions: Predictions,
}

impl Folds {
    /// Puts the predictions of folds that chose other names than `chosen` in the place of those that `after` has by it.
    pub fn put_in(&self, after: &mut HeldOut, chosen: &Fitted) {
        for (out, names) in &self.names {
            if *names != chosen.names() {
                out.iter().for_each(|r| after.predictions.put(*r, &self.predictions));
            }
        }
        after.nrmse = after.predictions.misfit(&chosen.data);
    }

    /// Share of the folds that chose these names, 0 to 1.
    pub fn agreement(&self, names: &[&'static str]) -> f64 {
        let same = self.names.iter().filter(|(_, n)| sorted(n) == sorted(names)).count();
        same as f64 / self.names.len().max(1) as f64
    }
}

/// Folds at most: with many levels several are left out together, so that time grows with the recordings and not with
/// their square.
const FOLDS: usize = 10;

/// Recordings left out together: a level, or where there is one only, each recording by itself; of more than [`FOLDS`]
/// every tenth with the first, with the second, and so on.
pub(crate) fn groups(data: &Data) -> Vec<Vec<usize>> {
    let n = data.records.len();
    let levels = data.levels();
    let place = |r: usize| levels.partition_point(|l| *l < data.records[r].level);
    let group = |r: usize| if levels.len() > 1 { place(r) % FOLDS } else { r % FOLDS };
    let count = if levels.len() > 1 { levels.len() } else { n }.min(FOLDS);
    (0..count).map(|k| (0..n).filter(|r| group(*r) == k).collect()).collect()
}

/// `candidate` fitted without the recordings `out`; of a single recording, to its first half cycle.
fn without(candidate: &Fitted, out: &[usize]) -> Fitted {
    let data = &*candidate.data;
    let n = data.records.len();
    let train: Data = if n > 1 {
        data.subset(|r| !out.contains(&r))
    } else {
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
    let kept = (0..n).filter(|r| n == 1 || !out.contains(r));
    let locals = kept.map(|r| candidate.fit.point.locals[r].clone()).collect();
    let start = Problem::new(&train, candidate.structure.model()).evaluate(candidate.fit.point.theta.clone(), locals);
    let options = Options { iterations: 20, ..Options::default() };
    Fitted::from(&Arc::new(train), candidate.structure.clone(), start, &options)
}

/// (recording, readings, its parameters) of the recordings `out`, predicted with `fitted`, which did not see them; `full`
/// is the same structure with all recordings.
type Predicted = (usize, [Vec<f64>; 3], (Vec<f64>, Vec<f64>));

fn predicted(full: &Fitted, fitted: &Fitted, out: &[usize]) -> Vec<Predicted> {
    let problem = full.problem();
    let theta = &fitted.fit.point.theta;
    out.iter()
        .map(|r| {
            let mut local = full.data.local_start(*r);
            // where the full fit put the touch is a start, not knowledge carried over
            for (i, k) in problem.nuisances().iter().enumerate() {
                if matches!(k, Nuisance::Start) {
                    local[i] = full.fit.point.locals[*r][i];
                }
            }
            let local = problem.fit_local(theta, *r, &local, &|k| {
                matches!(k, Nuisance::Start | Nuisance::Speed | Nuisance::Offset)
                    || k == Nuisance::Zero(Channel::Penetration)
            });
            let (_, y) = problem.predict(theta, *r, &local);
            (*r, y, (theta.clone(), local))
        })
        .collect()
}

/// Predicts every recording with `candidate` refitted without its level.
pub fn held_out(candidate: &Fitted) -> HeldOut {
    let data = &*candidate.data;
    let (folds, parts): (Vec<Fold>, Vec<Vec<Predicted>>) = groups(data)
        .into_par_iter()
        .map(|out| {
            let fitted = without(candidate, &out);
            let of = predicted(candidate, &fitted, &out);
            (Fold { out, fitted }, of)
        })
        .unzip();
    let mut readings: Vec<[Vec<f64>; 3]> = vec![Default::default(); data.records.len()];
    let mut points = vec![Default::default(); data.records.len()];
    for (r, y, p) in parts.into_iter().flatten() {
        readings[r] = y;
        points[r] = p;
    }
    let of = |data: &Data, r: usize| {
        let (theta, local): &(Vec<f64>, Vec<f64>) = &points[r];
        Ok::<_, Infallible>(Problem::new(data, candidate.structure.model()).predict(theta, r, local).1)
    };
    let predictions = Predictions::new(readings, data, of).unwrap_or_else(|e| match e {});
    HeldOut { nrmse: predictions.misfit(data), predictions, points, folds }
}

/// Every recording predicted without its level by the likeliest of `choices` (the simulation as given first), each fold
/// weighing them on the recordings it has.
pub fn folds(choices: &[(&Fitted, &HeldOut)], table: &Table) -> Folds {
    let Some((_, by_given)) = choices.first() else { return Folds::default() };
    let names: Vec<(Vec<usize>, usize)> = (0..by_given.folds.len())
        .into_par_iter()
        .map(|k| {
            let fits: Vec<&Fitted> = choices.iter().map(|(_, h)| &h.folds[k].fitted).collect();
            (by_given.folds[k].out.clone(), likeliest(&fits, table))
        })
        .collect();
    let mut predictions = by_given.predictions.clone();
    for (out, chosen) in &names {
        out.iter().for_each(|r| predictions.put(*r, &choices[*chosen].1.predictions));
    }
    Folds { names: names.into_iter().map(|(out, i)| (out, choices[i].0.names())).collect(), predictions }
}

/// Index of the likeliest of `fits`, the simulation as given first, by their evidence.
fn likeliest(fits: &[&Fitted], table: &Table) -> usize {
    let evidence = fits.first().map_or(Evidences::default(), |base| Evidences::of(base));
    let (at, structures): (Vec<usize>, Vec<_>) =
        fits.iter().enumerate().filter_map(|(i, f)| Some((i, weighed(f)?))).unzip();
    let posterior = Posterior::new(&Evidences { structures, levels: 2, ..evidence }, table);
    posterior.causes.iter().find_map(|c| c.structure).map_or(0, |i| at[i])
}

/// Ends of a window after the touch, in contact times.
const ENDS: [f64; 3] = [1.0, 2.0, 4.0];

/// Names that recordings cut so many contact times after the touch give, by the likeliest of `candidates` (the
/// simulation as given first); only ends that cut some recording.
pub fn windows(candidates: &[&Fitted], table: &Table) -> Vec<(f64, Vec<&'static str>)> {
    let Some(given) = candidates.first() else { return Vec::new() };
    let data = &given.data;
    if data.kind == Kind::Indentation {
        return Vec::new();
    }
    let spans: Vec<(f64, f64)> =
        (0..data.records.len()).map(|r| given.predict(r).0).map(|t| (t.touch, t.leave)).collect();
    ENDS.into_par_iter()
        .filter_map(|end| {
            let mut cut = (**data).clone();
            let mut any = false;
            for (rec, (touch, leave)) in cut.records.iter_mut().zip(&spans) {
                let last = touch + end * (leave - touch);
                for (i, _) in rec.setup.time.iter().enumerate().filter(|(_, t)| **t > last) {
                    rec.weight.iter_mut().for_each(|w| w[i] = 0.0);
                    any = true;
                }
            }
            if !any {
                return None;
            }
            let cut = Arc::new(cut);
            let options = Options { iterations: 20, ..Options::default() };
            let fits: Vec<Fitted> = candidates
                .iter()
                .map(|c| {
                    let problem = Problem::new(&cut, c.structure.model());
                    let start = problem.evaluate(c.fit.point.theta.clone(), c.fit.point.locals.clone());
                    Fitted::from(&cut, c.structure.clone(), start, &options)
                })
                .collect();
            Some((end, candidates[likeliest(&fits.iter().collect::<Vec<_>>(), table)].names()))
        })
        .collect()
}
