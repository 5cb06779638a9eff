//! Recordings whose forces are one law but for a factor of each: taken at other places of a sample, or of other samples.

use crate::law::Law;
use crate::press::Recording;
use crate::weigh::{Learned, Numbers, Set};

/// Rounds in which the law and the factors are found in turns.
const ROUNDS: usize = 3;
/// Share of what factors cost that they have to be worth on the law of recordings that are alike, for another law to be learned with
/// them: on their own they are worth more.
const WORTH: f64 = 0.3;
/// Change of a factor that no round follows any more.
const SETTLED: f64 = 1e-3;

/// The force read over its rest, and that of a law there, N, of the samples that count.
type Pairs = Vec<(f64, f64)>;

/// Of each recording, by a law that was learned of them.
fn pairs(recordings: &[Recording], law: &Law, numbers: &Numbers) -> Vec<Pairs> {
    let of_one = |(r, surface): (&Recording, &f64)| {
        let (f, rest) = (law.force(r, *surface).all, r.rest(numbers.discrepancy * law.press.force));
        (0..f.len()).filter(|i| r.counts(*i)).map(|i| (r.force[i] - rest, f[i])).collect()
    };
    recordings.iter().zip(&law.surfaces).map(of_one).collect()
}

/// ln of the factor of each recording on a law that was learned of them; 0 where the law has no force.
pub(crate) fn ln_factors(recordings: &[Recording], law: &Law, numbers: &Numbers) -> Vec<f64> {
    ln_factors_of(&pairs(recordings, law, numbers))
}

fn ln_factors_of(all: &[Pairs]) -> Vec<f64> {
    let of_one = |pairs: &Pairs| Some(factor(pairs.iter().copied())).filter(|f| *f > 0.0).unwrap_or(1.0).ln();
    all.iter().map(of_one).collect()
}

/// The factor by which a law is the nearest to what was read, by least squares of pairs (read, law); no number where the law is zero.
pub fn factor(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (by, squares) = pairs.fold((0.0, 0.0), |(by, s), (read, f)| (by + read * f, s + f * f));
    by / squares
}

/// The factor of each recording about the geometric mean of its level, for what the recordings of a level have in common is the law's
/// own; 1 where the law has no force.
fn factors(recordings: &[Recording], of: &[Pairs]) -> Vec<f64> {
    let ln = ln_factors_of(of);
    let of_level = |level: usize| {
        let own: Vec<f64> = recordings.iter().zip(&ln).filter(|(r, _)| r.level == level).map(|(_, ln)| *ln).collect();
        own.iter().sum::<f64>() / own.len() as f64
    };
    recordings.iter().zip(&ln).map(|(r, ln)| (ln - of_level(r.level)).exp()).collect()
}

/// The sum of squares that a law leaves, each recording with its gain, share of the range of force `range`, N.
fn left(of: &[Pairs], gains: &[f64], range: f64) -> f64 {
    let of_one =
        |(pairs, gain): (&Pairs, &f64)| pairs.iter().map(|(read, f)| ((read - gain * f) / range).powi(2)).sum::<f64>();
    of.iter().zip(gains).map(of_one).sum()
}

/// ln weight that a factor of each recording costs: as a class, with a parameter of each but one of every level.
fn ln_cost(recordings: usize, of: &Learned, numbers: &Numbers) -> f64 {
    let parameters = (recordings - of.sets[0].law.press.levels.len()) as f64;
    numbers.class - 0.5 * parameters * of.scale.independent.ln() / numbers.temperature
}

/// One law of all recordings, `alike`, weighed against one law with a factor of each recording; `learn` learns a law of recordings
/// whose forces were divided by such factors.
/// Where factors are worth little on the law of recordings that are alike no other law is learned.
pub(crate) fn weighed(
    recordings: &[Recording],
    alike: Learned,
    numbers: &Numbers,
    learn: impl Fn(&[Recording], &[f64]) -> Option<Learned>,
) -> Learned {
    if recordings.len() <= alike.sets[0].law.press.levels.len() {
        return alike;
    }
    let read = pairs(recordings, &alike.sets[0].law, numbers);
    let mut gains = factors(recordings, &read);
    let range = alike.sets[0].law.press.force;
    let ln = |gains: &[f64]| alike.scale.ln_evidence(left(&read, gains, range), 0) / numbers.temperature;
    let cost = ln_cost(recordings.len(), &alike, numbers);
    if ln(&gains) + WORTH * cost <= ln(&alike.gains) {
        return alike;
    }
    let mut best: Option<Learned> = None;
    for _ in 0..ROUNDS {
        let scaled: Vec<Recording> =
            recordings.iter().zip(&gains).map(|(r, g)| r.over(*g, numbers.discrepancy)).collect();
        let Some(of) = learn(&scaled, &gains) else { break };
        let more = factors(&scaled, &pairs(&scaled, &of.sets[0].law, numbers));
        let of = Learned { gains: gains.clone(), ..of };
        if best.as_ref().is_none_or(|b| of.ln_weight > b.ln_weight) {
            best = Some(of);
        }
        gains.iter_mut().zip(&more).for_each(|(g, m)| *g *= m);
        if more.iter().all(|m| m.ln().abs() < SETTLED) {
            break;
        }
    }
    let Some(mut of) = best else { return alike };
    of.ln_weight += cost;
    mixed(of, alike)
}

/// The likelier of two as it is, its sets as likely as both have them, each by its weight.
fn mixed(a: Learned, b: Learned) -> Learned {
    let (mut first, second) = if a.ln_weight >= b.ln_weight { (a, b) } else { (b, a) };
    let share = 1.0 / (1.0 + (second.ln_weight - first.ln_weight).exp());
    let of_second = |s: &Set| {
        let same = second.sets.iter().find(|o| o.law.classes == s.law.classes);
        same.map_or(0.0, |o| o.probability)
    };
    let both = |s: &Set| share * s.probability + (1.0 - share) * of_second(s);
    let mixed: Vec<f64> = first.sets.iter().map(both).collect();
    let whole: f64 = mixed.iter().sum();
    first.sets.iter_mut().zip(mixed).for_each(|(s, p)| s.probability = p / whole);
    first.sets.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    first.ln_weight -= share.ln();
    first
}
