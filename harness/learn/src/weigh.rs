//! Sets of classes, weighed by their evidence.

use crate::classes::{elastic, follows_order, is_of_seen_levels, ALL};
use crate::fit::{Fit, Normal, Scale};
use crate::gains;
use crate::law::Law;
use crate::order;
use crate::press::{Path, Press, Recording};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};

/// What the evidence is worked out with, and what turns it into probabilities: calibrated, not derived.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Numbers {
    /// Share of the range of force by which laws of contact are off where nothing is missing.
    pub discrepancy: f64,
    /// Independent samples of a level: a discrepancy is a function of depth and direction, and the same in every repeat.
    pub independent: f64,
    /// What differences of ln evidence are divided by.
    pub temperature: f64,
    /// ln prior of every class.
    pub class: f64,
}

/// A set of classes.
#[derive(Clone, Debug, PartialEq)]
pub struct Set {
    pub probability: f64,
    /// Misfit, rms over the range of force.
    pub misfit: f64,
    /// The law that was learned with it, which holds its classes.
    pub law: Law,
}

/// What was learned of a campaign.
#[derive(Clone, Debug, PartialEq)]
pub struct Learned {
    /// The likeliest first; at least one.
    pub sets: Vec<Set>,
    /// ln weight of all sets together, as [`Learned::ln_weight_of`] has that of a law found otherwise.
    pub ln_weight: f64,
    /// Samples, independent samples and discrepancy that the evidence of every set was worked out with.
    pub scale: Scale,
    /// Misfit of the elastic law alone, with what is given, rms over the range of force.
    pub elastic: f64,
    /// Whether rates or a hold part what depends on the rate from what depends on its direction alone.
    pub rates_differ: bool,
    /// By what factor the force of each recording differs from the law; all 1 where they are alike.
    pub gains: Vec<f64>,
}

impl Numbers {
    /// ln weight of a law with so many classes beyond what is given.
    fn ln_weight(&self, classes: usize, ln_evidence: f64) -> f64 {
        self.class * classes as f64 + ln_evidence / self.temperature
    }
}

impl Learned {
    /// ln weight of a law that was found otherwise, by the measure of the sets: `classes` causes beyond what is given, `parameters`
    /// found, a misfit, rms over the range of force.
    pub fn ln_weight_of(&self, classes: usize, parameters: usize, misfit: f64, numbers: &Numbers) -> f64 {
        numbers.ln_weight(classes, self.scale.ln_evidence(misfit * misfit * self.scale.samples, parameters))
    }

    /// Probability that a class is among what is missing.
    pub fn of(&self, class: usize) -> f64 {
        self.sets.iter().filter(|s| s.law.classes.contains(&class)).map(|s| s.probability).sum()
    }
}

/// Samples of all recordings together, and of one at most and at least.
const SAMPLES: usize = 1600;
const MOST: usize = 300;
const LEAST: usize = 60;
/// Classes of a set at most, and sets that are built on at each size.
const CLASSES: usize = 4;
const BUILT_ON: usize = 6;

/// Rounds in which the samples are found where a contact would have to pull.
const ROUNDS: usize = 3;
/// The same of a contact whose law would pull where nothing is read: each round lets go of more of a slow return.
const ROUNDS_ONE_SIDED: usize = 8;

/// One place of the surface: shapes of all classes, and their normal equations with and without what a contact that does not
/// stick cannot explain.
struct Placed {
    rule: usize,
    surfaces: Vec<f64>,
    press: Press,
    /// Shapes of the elastic law, then of each class.
    shapes: Vec<Vec<usize>>,
    sticks: Normal,
    slips: Normal,
    /// The shapes' columns with nothing where a sample does not count, whether each acts between the faces, and the readings.
    columns: DMatrix<f64>,
    between: Vec<bool>,
    y: DVector<f64>,
    /// Samples in which less than nothing was read.
    pulls: Vec<usize>,
    scale: Scale,
    /// [`Numbers::temperature`].
    temperature: f64,
    /// Whether rates or a hold part relaxation that has let go from a permanent set.
    rates_differ: bool,
}

impl Placed {
    /// With the surface of each recording where `rule` has it, of `surfaces` recording by recording.
    fn new(
        recordings: &[Recording],
        surfaces: &[Vec<f64>],
        rule: usize,
        numbers: &Numbers,
        rates_differ: bool,
    ) -> Option<Placed> {
        let small = numbers.discrepancy;
        let surfaces: Vec<f64> = surfaces.iter().map(|s| s[rule]).collect();
        let press = Press::of(recordings, &surfaces, small)?;
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let mut shapes: Vec<Vec<usize>> = vec![Vec::new(); 1 + ALL.len()];
        let mut between = Vec::new();
        let (mut y, mut known) = (Vec::new(), Vec::new());
        let paths: Vec<Path> = recordings.iter().zip(&surfaces).map(|(r, s)| Path::of(r, *s, &press)).collect();
        for r in recordings {
            let rest = r.rest(small * press.force);
            y.extend(r.force.iter().map(|f| (f - rest) / press.force));
            known.extend((0..r.force.len()).map(|i| r.counts(i)));
        }
        for (at, of) in shapes.iter_mut().enumerate() {
            let each = |p: &Path| if at == 0 { elastic(p, &press) } else { (ALL[at - 1].shapes)(p, &press) };
            let per: Vec<Vec<Vec<f64>>> = paths.iter().map(each).collect();
            for k in 0..per[0].len() {
                of.push(columns.len());
                between.push(at == 0 || !ALL[at - 1].on_body);
                columns.push(per.iter().flat_map(|p| p[k].iter().copied()).collect());
            }
        }
        // what does not count leaves nothing
        let counts = |i: usize| if known[i] { 1.0 } else { 0.0 };
        let columns = DMatrix::from_fn(y.len(), columns.len(), |i, j| counts(i) * columns[j][i]);
        let y = DVector::from_fn(y.len(), |i, _| counts(i) * y[i]);
        let sticks = Normal { b: columns.tr_mul(&y), yy: y.dot(&y), a: columns.tr_mul(&columns) };
        let n = known.iter().filter(|k| **k).count().max(1);
        let independent = numbers.independent * press.levels.len() as f64;
        let scale = Scale { samples: n as f64, independent, discrepancy: small };
        let temperature = numbers.temperature;
        let pulls = (0..y.len()).filter(|i| y[*i] < -small).collect();
        let slips = sticks.clone();
        let mut placed = Placed {
            rule,
            surfaces,
            press,
            shapes,
            sticks,
            slips,
            columns,
            between,
            y,
            pulls,
            scale,
            temperature,
            rates_differ,
        };
        let all: Vec<usize> = (0..placed.between.len()).collect();
        placed.slips = placed.without_contact(&placed.sticks, &all, &placed.pulls);
        Some(placed)
    }

    /// Indices of the shapes of the elastic law, then of each class, all of them.
    fn indices(&self, classes: &[usize]) -> Vec<usize> {
        std::iter::once(0).chain(classes.iter().map(|c| c + 1)).flat_map(|c| self.shapes[c].iter().copied()).collect()
    }

    /// The same, of classes whose shapes may not all be there together those that may: one list for each choice.
    fn choices(&self, classes: &[usize]) -> Vec<Vec<usize>> {
        let mut all = vec![self.shapes[0].clone()];
        for class in classes {
            let shapes = &self.shapes[class + 1];
            let spans: Vec<&[usize]> = match ALL[*class].together {
                Some(t) if shapes.len() > t.shapes * t.groups => {
                    shapes.windows(t.shapes * t.groups).step_by(t.shapes).collect()
                }
                _ => vec![shapes],
            };
            all = all.iter().flat_map(|before| spans.iter().map(|s| [before, *s].concat())).collect();
        }
        all
    }

    /// Misfit of a fit, rms over the range of force.
    fn misfit(&self, fit: &Fit) -> f64 {
        (fit.left / self.scale.samples).sqrt()
    }

    /// The fit of these shapes where the contact does not pull: what acts between the faces explains nothing where less is left for it
    /// than nothing. Where that is depends on what acts on the body, and is found in rounds; of these the one with the most evidence.
    fn fit_that_lets_go(&self, shapes: &[usize]) -> Fit {
        let mut best = self.slips.of(shapes).fit(&self.scale);
        if self.pulls.is_empty() || shapes.iter().all(|j| self.between[*j]) {
            return best;
        }
        let normal = self.sticks.of(shapes);
        let (mut last, mut pulls) = (best.clone(), self.pulls.clone());
        for _ in 0..ROUNDS {
            let now = self.pulls_beside(shapes, &last.coefficients);
            if now == pulls {
                break;
            }
            pulls = now;
            last = self.without_contact(&normal, shapes, &pulls).fit(&self.scale);
            if last.ln_evidence > best.ln_evidence {
                best = last.clone();
            }
        }
        best
    }

    /// The fit of these shapes as a contact that ends where its law would pull (F = max(0, sum)), as a viscoelastic one does on a
    /// fast return: what it leaves there is what was read. Where the law would pull is found in rounds, at first where nothing is read;
    /// of these the one with the most evidence. None where the law by the fit `before` pulls nowhere, or none has more evidence.
    fn one_sided_fit(&self, shapes: &[usize], before: &Fit) -> Option<Fit> {
        let pulls =
            |contact: &DVector<f64>| -> Vec<usize> { (0..contact.len()).filter(|i| contact[*i] < 0.0).collect() };
        let small = self.scale.discrepancy;
        if self.contact_and_body(shapes, &before.coefficients).0.iter().all(|f| *f > -small) {
            return None;
        }
        let normal = self.sticks.of(shapes);
        let mut go: Vec<usize> = (0..self.y.len()).filter(|i| self.y[*i] < small).collect();
        let mut best: Option<Fit> = None;
        for _ in 0..ROUNDS_ONE_SIDED {
            let mut fit = self.without_contact(&normal, shapes, &go).fit(&self.scale);
            let (contact, body) = self.contact_and_body(shapes, &fit.coefficients);
            fit.left = (0..self.y.len()).map(|i| (self.y[i] - contact[i].max(0.0) - body[i]).powi(2)).sum();
            fit.ln_evidence = self.scale.ln_evidence(fit.left, fit.coefficients.iter().filter(|c| **c > 0.0).count());
            if fit.ln_evidence > best.as_ref().unwrap_or(before).ln_evidence {
                best = Some(fit);
            }
            let now = pulls(&contact);
            if now == go {
                break;
            }
            go = now;
        }
        best
    }

    /// The force of these shapes between the faces, and on the body, sample by sample, share of the range of force.
    fn contact_and_body(&self, shapes: &[usize], coefficients: &[f64]) -> (DVector<f64>, DVector<f64>) {
        let (mut contact, mut body) = (DVector::zeros(self.y.len()), DVector::zeros(self.y.len()));
        for (j, c) in shapes.iter().zip(coefficients).filter(|(_, c)| **c != 0.0) {
            let part = if self.between[*j] { &mut contact } else { &mut body };
            part.axpy(*c, &self.columns.column(*j), 1.0);
        }
        (contact, body)
    }

    /// The samples in which what acts on the body leaves less than nothing for the contact.
    fn pulls_beside(&self, shapes: &[usize], coefficients: &[f64]) -> Vec<usize> {
        let rest = &self.y - self.contact_and_body(shapes, coefficients).1;
        (0..rest.len()).filter(|i| rest[*i] < -self.scale.discrepancy).collect()
    }

    /// The normal equations of these shapes, `normal`, with nothing between the faces in the samples `go`.
    fn without_contact(&self, normal: &Normal, shapes: &[usize], go: &[usize]) -> Normal {
        let rows = DMatrix::from_fn(go.len(), shapes.len(), |i, j| self.columns[(go[i], shapes[j])]);
        let y = DVector::from_fn(go.len(), |i, _| self.y[go[i]]);
        let (a, b) = (rows.tr_mul(&rows), rows.tr_mul(&y));
        let is_between = |i: usize| self.between[shapes[i]];
        let n = shapes.len();
        Normal {
            a: DMatrix::from_fn(n, n, |i, j| {
                normal.a[(i, j)] - if is_between(i) || is_between(j) { a[(i, j)] } else { 0.0 }
            }),
            b: DVector::from_fn(n, |i, _| normal.b[i] - if is_between(i) { b[i] } else { 0.0 }),
            yy: normal.yy,
        }
    }

    /// The fit of a set; None where one of its classes takes no part in it.
    fn fit(&self, classes: &[usize], given: &[usize]) -> Option<Fit> {
        let every = self.indices(classes);
        let sticks = Law::sticks(classes);
        let choices = self.choices(classes);
        let of_choice = |choice: &Vec<usize>| match sticks {
            true => self.sticks.of(choice).fit(&self.scale),
            false => self.fit_that_lets_go(choice),
        };
        let mut fits: Vec<Fit> = choices.iter().map(of_choice).collect();
        let best = (0..fits.len()).max_by(|a, b| fits[*a].ln_evidence.total_cmp(&fits[*b].ln_evidence))?;
        let choice = &choices[best];
        let may_end = !sticks && self.rates_differ && Law::relaxes(classes);
        if let Some(one_sided) = may_end.then(|| self.one_sided_fit(choice, &fits[best])).flatten() {
            fits[best] = one_sided;
        }
        let mut fit = fits[best].clone();
        let by: BTreeMap<usize, f64> = choice.iter().copied().zip(fit.coefficients).collect();
        fit.coefficients = every.iter().map(|i| by.get(i).copied().unwrap_or(0.0)).collect();
        // every choice is as likely beforehand
        let weight = |f: &Fit| ((f.ln_evidence - fit.ln_evidence) / self.temperature).exp();
        let mean = fits.iter().map(weight).sum::<f64>() / fits.len() as f64;
        fit.ln_evidence += self.temperature * mean.ln();
        let parts = self.parts(classes, &fit);
        let takes_part = |(c, p): (&usize, &Vec<f64>)| given.contains(c) || p.iter().any(|x| *x > 0.0);
        classes.iter().zip(&parts[1..]).all(takes_part).then_some(fit)
    }

    /// The law of a set by its fit.
    fn law(&self, classes: &[usize], fit: &Fit) -> Law {
        Law {
            classes: classes.to_vec(),
            coefficients: self.parts(classes, fit),
            press: self.press.clone(),
            surface: self.rule,
            surfaces: self.surfaces.clone(),
        }
    }

    /// The coefficients class by class, the elastic law's first.
    fn parts(&self, classes: &[usize], fit: &Fit) -> Vec<Vec<f64>> {
        let mut at = 0;
        let lengths = std::iter::once(0).chain(classes.iter().map(|c| c + 1)).map(|c| self.shapes[c].len());
        lengths
            .map(|n| {
                at += n;
                fit.coefficients[at - n..at].to_vec()
            })
            .collect()
    }
}

/// Shares of a recording that are spent at rest in contact, and e-folds of the rate, from which what depends on the rate can be
/// parted from what depends on its direction.
const HELD: f64 = 0.1;
const RATES: f64 = 1.0;

/// Whether recordings hold their depth, or were taken at rates that differ.
fn rates_differ(recordings: &[Recording], small: f64) -> bool {
    let mut rates: Vec<f64> = Vec::new();
    let mut held = 0.0f64;
    for r in recordings {
        let top = r.force.iter().copied().fold(f64::MIN, f64::max);
        let rest = r.rest(small * record::range(&r.force));
        let mut sorted: Vec<f64> = r.rate.iter().map(|v| v.abs()).collect();
        sorted.sort_by(f64::total_cmp);
        let fast = sorted[(sorted.len() - 1) * 95 / 100];
        let length = r.time[r.time.len() - 1] - r.time[0];
        let touching = (1..r.time.len()).filter(|i| r.force[*i] - rest > 0.1 * (top - rest));
        let mut at_rest = 0.0;
        for i in touching {
            let v = r.rate[i].abs();
            if v < 0.05 * fast {
                at_rest += r.time[i] - r.time[i - 1];
            } else {
                rates.push(v.ln());
            }
        }
        held = held.max(at_rest / length);
    }
    rates.sort_by(f64::total_cmp);
    let at = |share: f64| rates.get(((rates.len().max(1) - 1) as f64 * share) as usize).copied().unwrap_or(0.0);
    held > HELD || at(0.9) - at(0.1) > RATES
}

/// Learns what recordings of an imposed motion hold beyond an elastic law: sets of classes with their probabilities, and a law of
/// each. The classes `given` are in every set. None where no force or no depth was read.
pub fn learn(recordings: &[Recording], given: &[usize], numbers: &Numbers) -> Option<Learned> {
    learn_of(recordings, given, numbers, &|_| true)
}

/// The same to predict levels that are not among the recordings: no class is learned that says nothing of them.
pub fn learn_to_predict(recordings: &[Recording], given: &[usize], numbers: &Numbers) -> Option<Learned> {
    learn_of(recordings, given, numbers, &|class| !is_of_seen_levels(class))
}

/// Of the classes that `may_be` there, with a factor on the force of each recording where that has the evidence.
fn learn_of(
    recordings: &[Recording],
    given: &[usize],
    numbers: &Numbers,
    may_be: &(dyn Fn(usize) -> bool + Sync),
) -> Option<Learned> {
    let most = (SAMPLES / recordings.len().max(1)).clamp(LEAST, MOST);
    let means: Vec<Recording> = recordings.iter().map(|r| r.in_means(most)).collect();
    if means.iter().any(|r| r.time.len() < 8) || means.is_empty() {
        return None;
    }
    let learn = |means: &[Recording], gains: &[f64]| learn_alike(means, gains, given, numbers, may_be);
    let alike = learn(&means, &vec![1.0; means.len()])?;
    Some(gains::weighed(&means, alike, numbers, learn))
}

/// Of recordings, in means, that are one law, their forces divided by `gains`.
fn learn_alike(
    means: &[Recording],
    gains: &[f64],
    given: &[usize],
    numbers: &Numbers,
    may_be: &(dyn Fn(usize) -> bool + Sync),
) -> Option<Learned> {
    let surfaces: Vec<Vec<f64>> = means.iter().map(Recording::surfaces).collect();
    let every: Vec<usize> = (0..ALL.len()).filter(|c| may_be(*c)).collect();
    let rates_differ = rates_differ(means, numbers.discrepancy);
    let rules = (0..surfaces[0].len()).into_par_iter();
    let every_place: Vec<Placed> =
        rules.filter_map(|rule| Placed::new(means, &surfaces, rule, numbers, rates_differ)).collect();
    // several rules may find one place
    let mut placed: Vec<Placed> = Vec::new();
    for p in every_place {
        if !placed.iter().any(|q| q.press == p.press && q.sticks.b == p.sticks.b) {
            placed.push(p);
        }
    }
    // of each set the place that has the most evidence, and the fit there
    type Weighed = BTreeMap<Vec<usize>, (usize, Fit)>;
    let weigh = |set: &Vec<usize>| {
        let each = placed.iter().enumerate().filter_map(|(i, p)| Some((i, p.fit(set, given)?)));
        let best = each.max_by(|a, b| a.1.ln_evidence.total_cmp(&b.1.ln_evidence))?;
        Some((set.clone(), best))
    };
    let score = |set: &[usize], fit: &Fit| numbers.ln_weight(set.len() - given.len(), fit.ln_evidence);
    let mut least = given.to_vec();
    least.sort_unstable();
    let mut all: Weighed = weigh(&least).into_iter().collect();
    let mut built_on = vec![least.clone()];
    for _ in 0..CLASSES {
        let with_one_more = |set: &Vec<usize>| {
            let others = every.iter().copied().filter(|c| !set.contains(c));
            let with = |c: usize| {
                let mut with = set.clone();
                with.push(c);
                with.sort_unstable();
                with
            };
            others.map(with).collect::<Vec<_>>()
        };
        let next: BTreeSet<Vec<usize>> = built_on.iter().flat_map(with_one_more).collect();
        let next: Vec<Vec<usize>> = next.into_iter().collect();
        let new: Vec<_> = next.par_iter().filter_map(weigh).collect();
        let mut ranked: Vec<(f64, &Vec<usize>)> = new.iter().map(|(s, (_, fit))| (score(s, fit), s)).collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
        built_on = ranked.into_iter().take(BUILT_ON).map(|r| r.1.clone()).collect();
        all.extend(new);
    }
    let elastic = all.get(&least).map(|(at, fit)| placed[*at].misfit(fit))?;
    let without = |set: &[usize]| set.iter().copied().filter(|c| !follows_order(*c) || given.contains(c)).collect();
    let plain: BTreeSet<Vec<usize>> = all.keys().map(|s| without(s)).collect();
    let missing: Vec<Vec<usize>> = plain.into_iter().filter(|s| !all.contains_key(s)).collect();
    all.extend(missing.par_iter().filter_map(weigh).collect::<Vec<_>>());
    // a course by the order is worth no more than the factors of the recordings are
    let orders: Vec<f64> = means.iter().map(|r| placed[0].press.place_in_order(r.order)).collect();
    let scored = |set: &Vec<usize>, fit: &Fit| {
        let plain: Vec<usize> = without(set);
        let by = |name: &str| set.iter().any(|c| !plain.contains(c) && ALL[*c].mechanism == Some(name));
        let ways = ["cyclic_hardening", "cyclic_softening"].map(by);
        let score = score(set, fit);
        match all.get(&plain) {
            Some((at, of)) if plain.len() < set.len() => {
                // what the recordings were divided by is theirs as well
                let own = gains::ln_factors(means, &placed[*at].law(&plain, of), numbers);
                let ln: Vec<f64> = own.iter().zip(gains).map(|(own, gain)| own + gain.ln()).collect();
                let course = order::ln_evidence(&orders, &ln, ways, numbers.discrepancy);
                let classes = (set.len() - plain.len()) as f64;
                score.min(
                    numbers.ln_weight(plain.len() - given.len(), of.ln_evidence) + numbers.class * classes + course,
                )
            }
            _ => score,
        }
    };
    let scores: Vec<f64> = all.par_iter().map(|(s, (_, fit))| scored(s, fit)).collect();
    let top = scores.iter().copied().fold(f64::MIN, f64::max);
    let whole: f64 = scores.iter().map(|s| (s - top).exp()).sum();
    let set = |((classes, (at, fit)), score): ((&Vec<usize>, &(usize, Fit)), &f64)| {
        let p = &placed[*at];
        Set { probability: (score - top).exp() / whole, misfit: p.misfit(fit), law: p.law(classes, fit) }
    };
    let mut sets: Vec<Set> = all.iter().zip(&scores).map(set).collect();
    sets.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    Some(Learned {
        sets,
        ln_weight: top + whole.ln(),
        scale: placed.first()?.scale,
        elastic,
        rates_differ,
        gains: vec![1.0; means.len()],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const NUMBERS: Numbers = Numbers { discrepancy: 0.01, independent: 80.0, temperature: 3.0, class: -2.0 };

    /// A press to 1 mm and back with a hold of so many samples, the force of depth, rate and time in contact.
    fn press(hold: usize, force: impl Fn(f64, f64, usize) -> f64) -> Recording {
        let way = |i: usize| 1.2e-3 * i as f64 / 200.0 - 2e-4;
        let depth: Vec<f64> =
            (0..=200).map(way).chain((0..hold).map(|_| 1e-3)).chain((0..=200).rev().map(way)).collect();
        let n = depth.len();
        let rate: Vec<f64> = (0..n)
            .map(|i| match i {
                0..=200 => 6e-6,
                i if i <= 200 + hold => 0.0,
                _ => -6e-6,
            })
            .collect();
        Recording {
            force: (0..n).map(|i| force(depth[i], rate[i], i)).collect(),
            time: (0..n).map(|i| i as f64).collect(),
            depth,
            rate,
            counts: Vec::new(),
            order: 1.0,
            level: 0,
            value: None,
        }
    }

    #[test]
    fn a_threshold_that_the_level_sets_is_learned_with_the_level_and_predicts_one_not_seen() {
        let of = |level: usize, top: f64| Recording {
            level,
            value: Some(top),
            ..press(0, |x, _, _| (2e4 * x.max(0.0)).min(top))
        };
        let all: Vec<Recording> = [4.0, 8.0, 12.0, 16.0].iter().enumerate().map(|(i, t)| of(i, *t)).collect();
        for out in 0..all.len() {
            let seen: Vec<Recording> = (0..all.len()).filter(|r| *r != out).map(|r| all[r].clone()).collect();
            let l = learn_to_predict(&seen, &[], &NUMBERS).unwrap();
            let law = &l.sets[0].law;
            let named: Vec<_> = l
                .sets
                .iter()
                .take(3)
                .map(|s| (s.probability, s.misfit, s.law.classes().map(|c| c.name).collect::<Vec<_>>()))
                .collect();
            assert!(law.classes().any(|c| c.name == "with the level"), "{out}: {named:?}");
            assert!(law.classes.iter().all(|c| !is_of_seen_levels(*c)));
            let off = |law: &Law| {
                let (f, y) = (law.predict(&all[out]).0.all, &all[out].force);
                f.iter().zip(y).map(|(a, b)| (a - b).powi(2)).sum::<f64>()
            };
            let without = l.sets.iter().find(|s| s.law.classes.is_empty()).unwrap();
            assert!(off(law) < 0.5 * off(&without.law), "{out}: {} {}", off(law), off(&without.law));
        }
    }

    fn named(l: &Learned) -> Vec<&'static str> {
        (0..ALL.len()).filter(|c| l.of(*c) > 0.5).map(|c| ALL[c].name).collect()
    }

    fn hertz(x: f64) -> f64 {
        3e5 * x.max(0.0).powf(1.5)
    }

    #[test]
    fn where_nothing_is_missing_nothing_is_learned() {
        let l = learn(&[press(0, |x, _, _| hertz(x))], &[], &NUMBERS).unwrap();
        assert!(named(&l).is_empty(), "{:?}", l.sets[0]);
        assert!(l.elastic < 0.005 && !l.rates_differ);
        // a law found otherwise that leaves as much, of as many parameters, weighs as much
        let none = l.sets.iter().find(|s| s.law.classes.is_empty()).unwrap();
        let shapes = none.law.coefficients[0].iter().filter(|c| **c > 0.0).count();
        let ln = l.ln_weight_of(0, shapes, none.misfit, &NUMBERS);
        assert!((ln - l.ln_weight - none.probability.ln()).abs() < 1e-9, "{ln}");
        assert!(
            l.ln_weight_of(0, shapes, 0.05, &NUMBERS) < ln - 10.0
                && l.ln_weight_of(1, shapes, none.misfit, &NUMBERS) < ln
        );
    }

    #[test]
    fn preload_stop_and_friction_are_found_together() {
        let r = press(0, |x, v, _| {
            let touches = if x > 0.0 { 1.0 } else { 0.0 };
            touches * (3.0 + 8e3 * x + 0.4 * v.signum()) + 4e5 * (x - 9.5e-4).max(0.0)
        });
        let l = learn(std::slice::from_ref(&r), &[], &NUMBERS).unwrap();
        // one rate and no hold: friction, damping and relaxation share what is lost along the way
        assert_eq!(named(&l), ["preload", "stiffening"], "{:?}", &l.sets[..3]);
        assert!(!l.rates_differ);
        let lost: f64 = [3, 4, 5].map(|c| l.of(c)).iter().sum();
        assert!(lost > 0.95, "{lost}");
        let f = l.sets[0].law.predict(&r).0;
        let left = f.all.iter().zip(&r.force).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / r.force.len() as f64;
        assert!(left.sqrt() < 0.02 * 33.0, "{}", left.sqrt());
        assert_eq!(f.parts.len(), 3);
    }

    #[test]
    fn a_dome_that_snaps_through_is_a_force_of_depth_alone_and_no_plasticity() {
        // rises, falls to a third, and rises to a stop; friction turns with the direction
        let r = press(0, |x, v, _| {
            let u = x.max(0.0) / 1e-3;
            let dome = 2.0 * (3.0 * u).sin().max(0.0) + 0.6 * u;
            dome + 0.1 * v.signum() * f64::from(u8::from(x > 0.0)) + 4e5 * (x - 9.5e-4).max(0.0)
        });
        let l = learn(std::slice::from_ref(&r), &[], &NUMBERS).unwrap();
        let of = |name: &str| l.of(ALL.iter().position(|c| c.name == name).unwrap());
        assert!(of("plasticity") < 0.1, "{:?}", l.sets[0]);
        assert!(of("softening") > 0.9 && of("stiffening") > 0.9, "{:?}", l.sets[0]);
        let f = l.sets[0].law.predict(&r).0.all;
        let left: f64 = f.iter().zip(&r.force).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / f.len() as f64;
        assert!(left.sqrt() < 0.03 * 21.0, "{}", left.sqrt());
    }

    #[test]
    fn places_of_other_stiffness_are_one_law_with_a_factor_of_each() {
        // a map: six places, in no order; every one pulls while it is left
        let factors = [1.0, 0.6, 1.5, 0.8, 2.1, 0.9];
        let of = |k: usize| Recording {
            order: k as f64,
            ..press(0, |x, v, _| {
                let pull = if v < 0.0 && x < 1.5e-4 && x > -1e-4 { 2.0 } else { 0.0 };
                factors[k] * (hertz(x) - pull)
            })
        };
        let l = learn(&(0..6).map(of).collect::<Vec<_>>(), &[], &NUMBERS).unwrap();
        assert_eq!(named(&l), ["adhesion"], "{:?}", l.sets[0]);
        let ratio: Vec<f64> = l.gains.iter().zip(factors).map(|(g, f)| g / f * factors[0] / l.gains[0]).collect();
        assert!(ratio.iter().all(|r| (r - 1.0).abs() < 0.05), "{ratio:?}");
        // the same place again and again needs none
        let again = |k: usize| Recording { order: k as f64, ..press(0, |x, _, _| hertz(x)) };
        let l = learn(&(0..6).map(again).collect::<Vec<_>>(), &[], &NUMBERS).unwrap();
        assert!(named(&l).is_empty() && l.gains == [1.0; 6], "{:?}", l.gains);
    }

    #[test]
    fn a_force_that_fades_in_a_hold_is_relaxation_and_no_friction() {
        let mut q = 0.0;
        let mut last = 0.0;
        let forces: Vec<f64> = {
            let of = press(200, |x, _, _| x);
            of.depth
                .iter()
                .map(|x| {
                    let e = hertz(*x);
                    q = q * (-1.0f64 / 60.0).exp() + (e - last);
                    last = e;
                    (e + 1.5 * q).max(0.0)
                })
                .collect()
        };
        let l = learn(&[press(200, |_, _, i| forces[i])], &[], &NUMBERS).unwrap();
        // the contact lets go before its depth is zero, where branches alone would pull: another shape may stand in for that
        let names = named(&l);
        assert!(names.contains(&"relaxation") && !names.contains(&"friction"), "{:?}", &l.sets[..3]);
        assert!(l.rates_differ);
    }

    #[test]
    fn a_soft_layer_that_lags_behind_a_fast_return_is_relaxation_at_every_rate_and_amplitude() {
        // one time constant of the material, whatever a recording lasts; concave as rubber is, and no pull where it has lagged behind
        let tau = 60.0;
        let of = |level: usize, share: f64, faster: f64| {
            let mut r = Recording { level, ..press(0, |_, _, _| 0.0) };
            let scale = |v: &mut Vec<f64>, by: f64| v.iter_mut().for_each(|v| *v *= by);
            scale(&mut r.time, share / faster);
            scale(&mut r.depth, share);
            scale(&mut r.rate, faster);
            let (mut q, mut last) = (0.0, 0.0);
            for i in 0..r.time.len() {
                let e = 30.0 * (r.depth[i].max(0.0) / 1e-3).powf(0.6);
                let h = if i > 0 { r.time[i] - r.time[i - 1] } else { 0.0 };
                q = q * f64::exp(-h / tau) + (e - last);
                last = e;
                r.force[i] = if r.depth[i] > 0.0 { (0.7 * e + q).max(0.0) } else { 0.0 };
            }
            r
        };
        let all = [of(0, 1.0, 1.0), of(1, 1.0, 5.0), of(2, 0.4, 1.0), of(3, 0.4, 5.0)];
        let l = learn(&all, &[], &NUMBERS).unwrap();
        assert_eq!(named(&l), ["relaxation"], "{:?}", &l.sets[..3]);
        assert!(l.sets[0].misfit < 0.01, "{}", l.sets[0].misfit);
    }

    #[test]
    fn a_pull_that_lets_go_in_steps_is_adhesion() {
        let r = press(0, |x, v, _| {
            let pull = if v < 0.0 && x < 1e-4 && x > -1e-4 { 2.0 } else { 0.0 };
            let neck = if v < 0.0 && x < 1e-4 && x > 0.0 { 1.0 } else { 0.0 };
            hertz(x) - pull - neck
        });
        let l = learn(&[r], &[], &NUMBERS).unwrap();
        assert_eq!(named(&l), ["adhesion"], "{:?}", &l.sets[..3]);
    }

    #[test]
    fn friction_that_is_larger_than_what_the_contact_still_has_is_no_adhesion() {
        let r = press(0, |x, v, _| hertz(x) + if x > 0.0 { 2.0 * v.signum() } else { 0.0 });
        assert!(r.force.iter().any(|f| *f < -1.0));
        let l = learn(std::slice::from_ref(&r), &[], &NUMBERS).unwrap();
        assert_eq!(named(&l), ["friction"], "{:?}", &l.sets[..3]);
        // and the law pulls by it where the contact has let go
        let law = &l.sets[0].law;
        let f = law.force(&r, law.surfaces[0]).all;
        let off = f.iter().zip(&r.force).map(|(f, y)| (f - y).abs()).fold(0.0, f64::max);
        assert!(off < 0.5, "{off}");
    }

    #[test]
    fn friction_that_gives_before_it_slides_is_friction_alone() {
        let mut strain = 0.0f64;
        let mut before = 0.0;
        let mut r = press(0, |_, _, _| 0.0);
        for i in 0..r.force.len() {
            let x = r.depth[i].max(0.0);
            strain = (strain + (x - before) / 1e-4).clamp(-1.0, 1.0);
            before = x;
            r.force[i] = if r.depth[i] > 0.0 { 5.0 * strain + 1e3 * x } else { 0.0 };
        }
        let l = learn(&[r], &[], &NUMBERS).unwrap();
        assert_eq!(named(&l), ["friction"], "{:?}", &l.sets[..3]);
    }

    #[test]
    fn what_a_channel_at_its_end_did_not_read_is_learned_from_the_rest() {
        let whole = press(0, |x, _, _| hertz(x) + if x > 0.0 { 2.0 } else { 0.0 });
        let top = 0.7 * record::largest(&whole.force);
        let cut = Recording {
            force: whole.force.iter().map(|f| f.min(top)).collect(),
            counts: whole.force.iter().map(|f| *f < top).collect(),
            ..whole.clone()
        };
        let l = learn(&[cut], &[], &NUMBERS).unwrap();
        assert_eq!(named(&l), ["preload"], "{:?}", &l.sets[..3]);
        let f = l.sets[0].law.force(&whole, l.sets[0].law.surfaces[0]).all;
        let peak = record::largest(&f) / record::largest(&whole.force);
        assert!((peak - 1.0).abs() < 0.05, "{peak}");
    }

    #[test]
    fn a_curve_that_is_back_at_zero_before_its_depth_is_plasticity() {
        let r = press(0, |x, v, _| {
            let back = ((x - 6e-4) / 4e-4).max(0.0).powf(1.5) * hertz(1e-3);
            if v < 0.0 {
                back
            } else {
                hertz(x)
            }
        });
        let l = learn(&[r], &[], &NUMBERS).unwrap();
        assert_eq!(named(&l), ["plasticity"], "{:?}", &l.sets[..3]);
    }
}
