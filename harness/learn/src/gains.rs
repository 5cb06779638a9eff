//! Recordings whose forces are one law but for a factor of each: taken at other places of a sample, or of other samples.

use crate::press::Recording;
use crate::weigh::{Learned, Numbers, Set};

/// Rounds in which the law and the factors are found in turns.
const ROUNDS: usize = 3;
/// Change of a factor that no round follows any more.
const SETTLED: f64 = 1e-3;

/// The factor of each recording by the law that was learned of them, by least squares; 1 where that has no force.
fn factors(recordings: &[Recording], of: &Learned, numbers: &Numbers) -> Vec<f64> {
    let law = &of.sets[0].law;
    let factor = |(r, surface): (&Recording, &f64)| {
        let (f, rest) = (law.force(r, *surface).all, r.rest(numbers.discrepancy * law.press.force));
        let counts = (0..f.len()).filter(|i| r.counts(*i));
        let (by, squares) = counts.fold((0.0, 0.0), |(by, s), i| (by + (r.force[i] - rest) * f[i], s + f[i] * f[i]));
        if by > 0.0 && squares > 0.0 {
            by / squares
        } else {
            1.0
        }
    };
    let all: Vec<f64> = recordings.iter().zip(&law.surfaces).map(factor).collect();
    // one law for all: what they have in common is its own
    let mean = (all.iter().map(|f| f.ln()).sum::<f64>() / all.len().max(1) as f64).exp();
    all.iter().map(|f| f / mean).collect()
}

/// The sum of squares that a law leaves in the recordings, each with its factor, share of the range of force.
fn left(recordings: &[Recording], of: &Learned, gains: &[f64], numbers: &Numbers) -> f64 {
    let law = &of.sets[0].law;
    let of_one = |((r, surface), gain): ((&Recording, &f64), &f64)| {
        let (f, rest) = (law.force(r, *surface).all, r.rest(numbers.discrepancy * law.press.force));
        let counts = (0..f.len()).filter(|i| r.counts(*i));
        counts.map(|i| ((r.force[i] - rest - gain * f[i]) / law.press.force).powi(2)).sum::<f64>()
    };
    recordings.iter().zip(&law.surfaces).zip(gains).map(of_one).sum()
}

/// ln weight that a factor of each recording costs: as a class, with a parameter of each but one.
fn ln_cost(recordings: usize, of: &Learned, numbers: &Numbers) -> f64 {
    let parameters = recordings.saturating_sub(1) as f64;
    numbers.class - 0.5 * parameters * of.scale.independent.ln() / numbers.temperature
}

/// What was learned of recordings as one law, `alike`, weighed against one law with a factor of each recording; `learn` learns it of
/// recordings. Where no factor can be worth its parameter nothing is learned anew.
pub(crate) fn weighed(
    recordings: &[Recording],
    alike: Learned,
    numbers: &Numbers,
    learn: impl Fn(&[Recording]) -> Option<Learned>,
) -> Learned {
    let mut gains = factors(recordings, &alike, numbers);
    let ones = vec![1.0; recordings.len()];
    let ln = |gains: &[f64]| alike.scale.ln_evidence(left(recordings, &alike, gains, numbers), 0) / numbers.temperature;
    if recordings.len() < 2 || ln(&gains) + ln_cost(recordings.len(), &alike, numbers) <= ln(&ones) {
        return alike;
    }
    let mut best: Option<Learned> = None;
    for _ in 0..ROUNDS {
        let scaled: Vec<Recording> =
            recordings.iter().zip(&gains).map(|(r, g)| r.over(*g, numbers.discrepancy)).collect();
        let Some(of) = learn(&scaled) else { break };
        let more = factors(&scaled, &of, numbers);
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
    of.ln_weight += ln_cost(recordings.len(), &alike, numbers);
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
    let mixed = first.sets.iter().map(|s| share * s.probability + (1.0 - share) * of_second(s));
    let mixed: Vec<f64> = mixed.collect();
    let whole: f64 = mixed.iter().sum();
    first.sets.iter_mut().zip(mixed).for_each(|(s, p)| s.probability = p / whole);
    first.sets.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    first.ln_weight -= share.ln();
    first
}
