//! What is missing where the motion is imposed, whatever its shape: classes of forces learned as functions, the names that they
//! stand for, and predictions by laws that were learned without each level.

use crate::candidate::excess_scatter;
use crate::decide::Decision;
use crate::heldout::{groups, HeldOut};
use crate::phases::over_their_sum;
use crate::posterior::{limits_reading, Cause, Posterior, UNKNOWN};
use crate::predictions::Predictions;
use estimate::fitted::Fitted;
use estimate::flat::{flat_top, FlatTop};
use estimate::problem::Data;
use learn::{highest, Class, Law, Recording, ALL};
use mechanisms::mechanism::Mechanism;
use rayon::prelude::*;
use record::{Campaign, Channel};
use std::convert::Infallible;

/// The word for a form that no equation holds.
pub const OF_ITS_OWN: &str = "of a shape of its own";
/// What to do about it.
pub const CURE: &str =
    "HysteresisContact.fmu does not hold the shape that was learned: take the force over depth, on the way \
                        in and back, from learned/law.csv into a table of your simulator.";
/// The cure of a mechanism whose learned shape the FMU holds.
pub const HELD_SHAPE: &str = "HysteresisContact.fmu holds the shape that was learned: import it.";

/// A number by which a mechanism without a form is told.
#[derive(Clone, Copy, Debug)]
pub struct Size {
    pub name: &'static str,
    pub value: f64,
    pub unit: &'static str,
    /// 95 % interval; None where there is none.
    pub ci95: Option<[f64; 2]>,
    /// Method by which the interval was found.
    pub by: &'static str,
}

impl Size {
    /// The largest force by the law learned, N; 0 where that does without the mechanism.
    pub const fn largest_force(largest: f64) -> Size {
        Size {
            name: "largest_force",
            value: largest,
            unit: "N",
            ci95: None,
            by: "none: a shape that was learned has no interval",
        }
    }
}

/// A mechanism that is named for the class that was learned.
#[derive(Clone)]
pub struct Named {
    pub mechanism: &'static Mechanism,
    pub probability: f64,
    /// Names that these recordings cannot part from it.
    pub also_possible: Vec<&'static str>,
    pub size: Size,
    /// Cure, a sentence for the user.
    pub cure: &'static str,
    /// Share of its action in approach, loading, unloading and after.
    pub shares: [f64; 4],
}

/// One recording as the law learned has it.
#[derive(Clone)]
pub struct Course {
    pub file: String,
    pub level: usize,
    /// s, m and N, sample by sample: clock, depth and force as read, force of the law, and of each class of it.
    pub time: Vec<f64>,
    pub depth: Vec<f64>,
    pub read: Vec<f64>,
    /// Whether each sample's force counts.
    pub counts: Vec<bool>,
    pub force: Vec<f64>,
    pub parts: Vec<Vec<f64>>,
}

/// What was learned of a campaign.
#[derive(Clone)]
pub struct Learned {
    pub of: learn::Learned,
    /// Index, among its sets, of the one whose law is given: the likeliest that stands for all that is named.
    pub set: usize,
    /// Names that are more likely than not and that no form stands for.
    pub names: Vec<Named>,
    /// Every recording predicted by a law learned without its level.
    pub heldout: HeldOut,
    pub courses: Vec<Course>,
    /// Whether it takes the place of every form: the cause was likelier outside of them than in them, or by the measure of what was
    /// learned another form is likelier than the one chosen.
    pub leads: bool,
    /// Misfit of its law on what it has seen, rms over the range of force.
    pub misfit: f64,
    /// Indices of the recordings that each fold left out, and the names that it stands for without them.
    pub folds: Vec<(Vec<usize>, Vec<&'static str>)>,
}

/// The recordings of an imposed motion as classes see them. Samples that do not count are taken from their neighbours.
fn recordings(c: &Campaign, data: &Data, limit: Option<FlatTop>) -> Option<Vec<Recording>> {
    let force = Channel::Force.index();
    let at_limit = |v: f64| limit.is_some_and(|l| l.is_reached(v));
    let values = c.values_of_levels();
    let orders = c.recordings.iter().map(|r| r.order);
    let of = |(rec, order): (&estimate::problem::Record, f64)| {
        let mut read = rec.y[force].clone()?;
        let counts = |i: usize| rec.weight[force][i] > 0.0;
        for i in (0..read.len()).filter(|i| !counts(*i)) {
            let before = (0..i).rev().find(|j| counts(*j));
            let after = (i + 1..read.len()).find(|j| counts(*j));
            read[i] = match (before, after) {
                (Some(a), Some(b)) => read[a] + (read[b] - read[a]) * (i - a) as f64 / (b - a) as f64,
                (Some(a), None) | (None, Some(a)) => read[a],
                (None, None) => read[i],
            };
        }
        Some(Recording {
            time: rec.setup.time.clone(),
            depth: rec.setup.imposed.clone(),
            rate: rec.setup.imposed_rate.clone(),
            counts: (0..read.len()).map(|i| counts(i) && !at_limit(read[i])).collect(),
            force: read,
            order,
            level: rec.level,
            value: values.as_ref().and_then(|v| v.get(rec.level).copied()),
        })
    };
    data.records.iter().zip(orders).map(of).collect()
}

/// The flat top that the force ends in.
fn limit(data: &Data) -> Option<FlatTop> {
    flat_top(data).filter(|f| f.channel == Channel::Force)
}

/// Forces as a channel reads them that ends at `limit`.
fn read(force: Vec<f64>, limit: Option<FlatTop>) -> Vec<f64> {
    match limit {
        Some(l) => force.into_iter().map(|f| l.read(f)).collect(),
        None => force,
    }
}

/// A recording up to its deepest point.
fn first_half(r: &Recording) -> Recording {
    let n = 1 + highest(&r.depth);
    let cut = |v: &[f64]| v[..n].to_vec();
    Recording {
        time: cut(&r.time),
        depth: cut(&r.depth),
        rate: cut(&r.rate),
        force: cut(&r.force),
        counts: r.counts[..n].to_vec(),
        ..*r
    }
}

/// Classes that the simulation as given holds: their shapes are its own.
fn given(terms: &[String]) -> Vec<usize> {
    let holds = |c: &Class| terms.iter().any(|t| c.mechanism == Some(t) || c.also.contains(&t.as_str()));
    (0..ALL.len()).filter(|i| holds(&ALL[*i])).collect()
}

/// Names that a set of classes stands for beyond those `given`, sorted; an unknown cause where it stands for none.
fn names(classes: &[usize], given: &[usize], rates_differ: bool) -> Vec<&'static str> {
    let of =
        |c: &usize| if ALL[*c].needs_rates && !rates_differ { learn::PARTED_BY_RATES.0 } else { ALL[*c].mechanism };
    let mut v: Vec<&'static str> = classes.iter().filter(|c| !given.contains(c)).filter_map(of).collect();
    v.sort_unstable();
    v.dedup();
    if v.is_empty() {
        v.push(UNKNOWN);
    }
    v
}

/// Learns what is missing in the recordings of a decision on `c`, whose motion is imposed; with it the decision's posterior, its
/// unknown cause taken apart into what was learned. None where no force or no depth was read.
pub fn learned(c: &Campaign, d: &Decision) -> Option<(Learned, Posterior)> {
    let data = &d.base.data;
    let numbers = &d.table.learned;
    let given = given(&c.simulation.terms);
    let limit = limit(data);
    let all = recordings(c, data, limit)?;
    let of = learn::learn(&all, &given, numbers)?;
    let names_of_classes = |c: &[usize]| names(c, &given, of.rates_differ);
    let names_of = |s: &learn::Set| names_of_classes(&s.law.classes);
    let groups = groups(data);
    let without = learned_without(&all, &groups, &given, numbers);
    let law_without = |r: usize| {
        let fold = groups.iter().position(|out| out.contains(&r))?;
        Some(&without[fold].as_ref()?.sets.first()?.law)
    };
    let laws: Vec<Option<&Law>> = (0..all.len()).map(law_without).collect();
    let heldout = predicted(d, &all, &laws, limit);
    let forms = Forms::new(d, &of, &heldout, groups.len());
    let judged = forms.weighed();
    let stands_for = |s: &learn::Set| {
        let slow = s.law.instead().map(|(classes, share)| (names_of_classes(&classes), share));
        let stiffens = || Some((vec![learn::GROWS], forms.grows(s, &given)?));
        let instead = slow.or_else(stiffens);
        let share = instead.as_ref().map_or(0.0, |i| i.1);
        [(names_of(s), s.probability * (1.0 - share))]
            .into_iter()
            .chain(instead.map(|(names, share)| (names, s.probability * share)))
    };
    let posterior = judged.refined(of.sets.iter().flat_map(stands_for), d.table.level);
    let chosen = d.chosen.names();
    let is_overtaken = chosen.iter().any(|n| judged.of(n) <= 0.5);
    let leads = judged.unknown() > judged.of_set(&chosen) || is_overtaken;
    let by_form: Vec<&'static str> = if leads { Vec::new() } else { chosen };
    let likely: Vec<&'static str> = posterior.likely_names().into_iter().filter(|n| !by_form.contains(n)).collect();
    // of the sets that stand for what is named the likeliest that stands for nothing else
    let of_force: Vec<&'static str> = likely.iter().copied().filter(|n| !limits_reading(&[n])).collect();
    let exact = of.sets.iter().position(|s| names_of(s) == of_force);
    let holds_all = |s: &learn::Set| of_force.iter().all(|n| names_of(s).contains(n));
    let set = exact.or_else(|| of.sets.iter().position(holds_all)).unwrap_or(0);
    let law = &of.sets[set].law;
    let course = |(((r, rec), surface), gain): (((&Recording, &estimate::problem::Record), &f64), &f64)| {
        let mut f = law.force(r, *surface);
        f.parts.iter_mut().chain([&mut f.all]).flatten().for_each(|v| *v *= gain);
        let rest = r.rest(numbers.discrepancy * law.press.force);
        f.all.iter_mut().for_each(|v| *v += rest);
        Course {
            file: rec.file.clone(),
            level: rec.level,
            time: r.time.clone(),
            depth: r.depth.clone(),
            read: r.force.clone(),
            counts: r.counts.clone(),
            force: f.all,
            parts: f.parts,
        }
    };
    let courses = all.iter().zip(&data.records).zip(&law.surfaces).zip(&of.gains);
    let courses: Vec<Course> = courses.map(course).collect();
    let misfit = of_courses(&courses, law.press.force);
    let named = |l: &learn::Learned| likely_by(l, &names_of_classes);
    let folds = groups.iter().zip(&without).filter_map(|(out, l)| Some((out.clone(), named(l.as_ref()?)))).collect();
    let mut learned = Learned { of, set, names: Vec::new(), heldout, courses, leads, misfit, folds };
    learned.names = likely.into_iter().filter_map(|n| learned.named(n, &posterior)).collect();
    Some((learned, posterior))
}

/// Forms by the measure of the laws learned.
struct Forms<'a> {
    d: &'a Decision,
    of: &'a learn::Learned,
    /// Variance of a sample's noise over the range of force squared, and samples.
    noise: f64,
    samples: f64,
    /// Misfit of the laws learned on what they have not seen, share of the range of force; None of one recording alone.
    law_not_seen: Option<f64>,
    /// Levels that were predicted, or recordings of one level.
    predicted: f64,
}

impl<'a> Forms<'a> {
    /// `predicted`: levels, or recordings of one level, that `heldout` predicts by laws that have not seen them.
    fn new(d: &'a Decision, of: &'a learn::Learned, heldout: &HeldOut, predicted: usize) -> Forms<'a> {
        let (base, samples) = (misfit_of(&d.base), d.base.fit.samples as f64);
        let noise = base * base * samples / d.evidence.structures[0].chi2;
        // of one recording alone what was not seen is its way back: no law is told by that
        let several = d.base.data.records.len() > 1;
        let law_not_seen = several.then(|| heldout.predictions.misfit_of_compared(&d.base.data));
        Forms { d, of, noise, samples, law_not_seen, predicted: predicted as f64 }
    }

    /// ln weight lost by what is missed of levels not seen, `not_seen`, over what is left of those seen, `left`, share of the range of
    /// force: every level predicted counts as one sample, for what is missed of it is one error of the law.
    fn ln_lost(&self, left: f64, not_seen: f64) -> f64 {
        let variance = |m: f64| m * m + self.of.scale.discrepancy.powi(2);
        0.5 * self.predicted * (variance(not_seen.max(left)) / variance(left)).ln()
    }

    /// Misfit of the structure of this index on levels not seen, share of the range of force. Of a structure whose predictions were not
    /// worked out it grows over what the structure leaves, `left`, as that of the likeliest does; None where neither is known.
    fn not_seen(&self, i: usize, left: f64) -> Option<f64> {
        self.law_not_seen?;
        // of an imposed motion the misfit of all channels counts the motion, which is met
        let before = &self.d.before;
        let of_force = before.predictions.misfit_of_compared(&self.d.base.data) / before.nrmse;
        let known = |i: usize| Some(self.d.evidence.structures.get(i)?.heldout? * of_force);
        let as_likeliest = || Some(left * known(self.likeliest()?)? / self.left(self.likeliest()?)?);
        known(i).or_else(as_likeliest)
    }

    /// Index of the likeliest structure that names a cause, or nothing.
    fn likeliest(&self) -> Option<usize> {
        self.d.posterior.causes.iter().find(|c| !c.is_unknown()).and_then(|c| c.structure)
    }

    /// Misfit of the structure of this index on what it has seen, by the measure of the laws learned.
    fn left(&self, i: usize) -> Option<f64> {
        let w = self.d.evidence.structures.get(i)?;
        // laws are learned on means of samples, which hold less noise
        let of_means = (self.of.scale.samples / self.samples).min(1.0);
        Some((self.noise * ((w.chi2 / self.samples - 1.0).max(0.0) + of_means)).sqrt())
    }

    /// ln weight of the laws learned, less what they miss of levels not seen.
    fn ln_weight_of_laws(&self) -> f64 {
        let seen = self.of.sets[0].misfit;
        self.of.ln_weight - self.law_not_seen.map_or(0.0, |not_seen| self.ln_lost(seen, not_seen))
    }

    /// Variance that the likeliest form leaves, over that of the noise.
    fn inflation(&self) -> f64 {
        let of = self.likeliest().and_then(|i| self.d.evidence.structures.get(i));
        of.map_or(1.0, |w| w.chi2 / self.samples)
    }

    /// ln weight of the structure of this index; 0 is the simulation as given. None where there is none, or nothing is left to weigh.
    fn ln_weight(&self, i: usize) -> Option<f64> {
        let w = self.d.evidence.structures.get(i)?;
        let left = self.left(i)?;
        let lost = self.not_seen(i, left).map_or(0.0, |not_seen| self.ln_lost(left, not_seen));
        // a limit of a reading is no law beside others: what it hides does not count where laws are learned
        let causes = w.names.iter().filter(|n| !limits_reading(&[n])).count();
        let parameters = ELASTIC + w.parameters;
        // recordings without any noise leave nothing to compare
        Some(self.of.ln_weight_of(causes, parameters, left, &self.d.table.learned) - lost).filter(|ln| ln.is_finite())
    }

    /// The decision's posterior with every cause weighed by the measure of the laws learned: forms by what they leave, the unknown cause
    /// by those laws, for until something was learned it had no evidence of its own, and what forms that leave more than noise say
    /// against it counts the less. An equation that leaves much of what a law of free shapes explains, or another equation, is not what
    /// is missing. As it is where no form can be weighed so.
    fn weighed(&self) -> Posterior {
        let of_form = |c: &Cause| c.structure.and_then(|i| self.ln_weight(i));
        let ln = |c: &Cause| match c.is_unknown() {
            true => self.ln_weight_of_laws(),
            false => of_form(c).unwrap_or(f64::NEG_INFINITY),
        };
        match self.d.posterior.causes.iter().any(|c| of_form(c).is_some()) {
            true => self.d.posterior.doubted(self.inflation(), self.d.table.level).weighed(ln, self.d.table.level),
            false => self.d.posterior.clone(),
        }
    }

    /// Probability that what a set adds to the simulation as given is a stiffness that grows: it holds no class, but its elastic law
    /// is a sum of several powers of the depth, where the simulation has one. It counts as a class against the simulation as
    /// given. None where it is no such set.
    fn grows(&self, s: &learn::Set, given: &[usize]) -> Option<f64> {
        let powers = s.law.coefficients.first()?.iter().filter(|c| **c > 0.0).count();
        let holds_it = given.iter().any(|c| ALL[*c].mechanism == Some(learn::GROWS));
        if powers < 2 || holds_it || s.law.classes.iter().any(|c| !given.contains(c)) {
            return None;
        }
        let ln_set = self.d.table.learned.class + self.ln_weight_of_laws() + s.probability.ln();
        Some(1.0 / (1.0 + (self.ln_weight(0)? - ln_set).exp()))
    }
}

/// Parameters of the law k x^p that every form of a contact begins with: stiffness k and power p (Hertz 1882).
const ELASTIC: usize = 2;

/// Misfit of a fit in force, rms over the range of force read.
fn misfit_of(f: &Fitted) -> f64 {
    let force = Channel::Force.index();
    let (mut squares, mut n, mut range) = (0.0, 0.0, 0.0f64);
    for (r, rec) in f.data.records.iter().enumerate() {
        let Some(left) = rec.left_of(Channel::Force, &f.predict(r).1[force]) else { continue };
        range = range.max(record::range(rec.y[force].as_deref().unwrap_or_default()));
        for (v, _) in left.iter().zip(&rec.weight[force]).filter(|(_, w)| **w > 0.0) {
            squares += v * v;
            n += 1.0;
        }
    }
    (squares / f64::max(n, 1.0)).sqrt() / range
}

/// Names that are likelier than not by what was learned, sorted; `names_of` a set of classes.
fn likely_by(of: &learn::Learned, names_of: &impl Fn(&[usize]) -> Vec<&'static str>) -> Vec<&'static str> {
    let mut all: Vec<(&'static str, f64)> = Vec::new();
    let mut add = |names: Vec<&'static str>, probability: f64| {
        for name in names {
            match all.iter_mut().find(|(known, _)| *known == name) {
                Some((_, whole)) => *whole += probability,
                None => all.push((name, probability)),
            }
        }
    };
    for s in &of.sets {
        let instead = s.law.instead();
        let share = instead.as_ref().map_or(0.0, |i| i.1);
        add(names_of(&s.law.classes), (1.0 - share) * s.probability);
        instead.into_iter().for_each(|(classes, share)| add(names_of(&classes), share * s.probability));
    }
    let mut names: Vec<&'static str> = all.into_iter().filter(|(_, p)| *p > 0.5).map(|(name, _)| name).collect();
    names.retain(|name| *name != UNKNOWN);
    names.sort_unstable();
    names
}

/// Laws learned without each group of recordings; of a single recording, from its first half.
fn learned_without(
    all: &[Recording],
    groups: &[Vec<usize>],
    given: &[usize],
    numbers: &learn::Numbers,
) -> Vec<Option<learn::Learned>> {
    let without = |out: &Vec<usize>| {
        let seen: Vec<Recording> = match all {
            [one] => vec![first_half(one)],
            _ => (0..all.len()).filter(|r| !out.contains(r)).map(|r| all[r].clone()).collect(),
        };
        learn::learn_to_predict(&seen, given, numbers)
    };
    groups.par_iter().map(without).collect()
}

/// Misfit of a law over all samples, rms over the range of force.
fn of_courses(courses: &[Course], range: f64) -> f64 {
    let known = |c: &Course| (0..c.read.len()).filter(|i| c.counts[*i]).collect::<Vec<_>>();
    let squares = courses.iter().flat_map(|c| known(c).into_iter().map(|i| ((c.read[i] - c.force[i]) / range).powi(2)));
    let squares: Vec<f64> = squares.collect();
    (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt()
}

/// Every recording as a law that has not seen it has it, its other channels as the simulation as given has them.
fn predicted(d: &Decision, all: &[Recording], laws: &[Option<&Law>], limit: Option<FlatTop>) -> HeldOut {
    let data = &*d.base.data;
    let force = Channel::Force.index();
    let found: Vec<_> = laws.iter().zip(all).map(|(law, r)| law.map(|l| (l, l.predict(r)))).collect();
    let mut judged = d.before.predictions.judged.clone();
    for (y, f) in judged.iter_mut().zip(&found) {
        if let Some((_, (f, _))) = f {
            y[force] = read(f.all.clone(), limit);
        }
    }
    let whole = d.before.predictions.of_the_whole();
    let of = |data: &Data, r: usize| {
        let mut y = whole[r].clone();
        if let Some((law, (_, surface))) = &found[r] {
            let s = &data.records[r].setup;
            let longer = Recording {
                time: s.time.clone(),
                depth: s.imposed.clone(),
                rate: s.imposed_rate.clone(),
                force: Vec::new(),
                counts: Vec::new(),
                ..all[r]
            };
            y[force] = read(law.force(&longer, *surface).all, limit);
        }
        Ok::<_, Infallible>(y)
    };
    let predictions = Predictions::new(judged, data, of).unwrap_or_else(|e| match e {});
    HeldOut { nrmse: predictions.misfit(data), predictions, ..d.before.clone() }
}

impl Learned {
    /// Root mean square by which the ln of the force differs between recordings of one level, beyond what the law learned has; None
    /// where it is as likely as not that repeats scatter so, by `scatter`, or that the law is off by as much.
    pub fn excess_scatter(&self, scatter: f64) -> Option<f64> {
        let share = |(c, gain): (&Course, &f64)| {
            let known = (0..c.read.len()).filter(|i| c.counts[*i]).map(|i| (c.read[i], c.force[i]));
            (c.level, (gain * learn::factor(known)).max(f64::MIN_POSITIVE).ln())
        };
        excess_scatter(self.courses.iter().zip(&self.of.gains).map(share), scatter.hypot(self.misfit), 1.0)
    }

    /// The law that is given.
    pub fn law(&self) -> &Law {
        &self.of.sets[self.set].law
    }

    /// A mechanism as it is named for the classes learned, with its probability by `posterior`; None where none of them stands
    /// for it.
    fn named(&self, name: &'static str, posterior: &Posterior) -> Option<Named> {
        let mechanism = mechanisms::named(name)?;
        if limits_reading(&[name]) {
            let (largest, shares) = self.limited();
            return Some(Named {
                mechanism,
                probability: posterior.of(name),
                also_possible: Vec::new(),
                size: Size::largest_force(largest),
                cure: CURE,
                shares,
            });
        }
        let is_tied = !self.of.rates_differ && learn::PARTED_BY_RATES.0 == Some(name);
        let is_it = |c: &Class| c.mechanism == Some(name) || is_tied && c.needs_rates;
        // it has to be of what was learned, not of a form alone
        (0..ALL.len()).find(|c| is_it(&ALL[*c]) && self.of.of(*c) > 0.0)?;
        let law = self.law();
        let of: Vec<usize> = (0..law.classes.len()).filter(|i| is_it(&ALL[law.classes[*i]])).collect();
        let also = ALL.iter().filter(|c| c.mechanism == Some(name)).flat_map(|c| c.also).copied();
        // a place that was touched once may come back later: a branch that relaxes slower than the recordings last
        let comes_back = self.of.gains.iter().any(|g| *g != 1.0).then(|| learn::comes_back_instead(name)).flatten();
        let also_possible = if is_tied { learn::PARTED_BY_RATES.1.to_vec() } else { also.chain(comes_back).collect() };
        let (largest, shares) = self.action(&of);
        let size = Size::largest_force(largest);
        Some(Named { mechanism, probability: posterior.of(name), also_possible, size, cure: CURE, shares })
    }

    /// The force that a limit hides: the most, N, and the share of its squares by phase.
    fn limited(&self) -> (f64, [f64; 4]) {
        let (mut largest, mut shares) = (0.0f64, [0.0; 4]);
        for c in &self.courses {
            let top = highest(&c.depth);
            for i in (0..c.time.len()).filter(|i| !c.counts[*i]) {
                let taken = c.force[i] - c.read[i];
                largest = largest.max(taken.abs());
                shares[if i <= top { 1 } else { 2 }] += taken * taken;
            }
        }
        (largest, over_their_sum(shares))
    }

    /// Mean relative difference of the largest force read and of the law.
    pub fn peaks(&self) -> f64 {
        let off = |c: &Course| {
            let (read, law) = (record::largest(&c.read), record::largest(&c.force));
            if read > 0.0 {
                (law / read - 1.0).abs()
            } else {
                0.0
            }
        };
        self.courses.iter().map(off).sum::<f64>() / self.courses.len().max(1) as f64
    }

    /// The law as a table: depth below the surface, m, and the force on the way in and back of the recording that goes deepest,
    /// N, at so many depths; None where nothing was recorded.
    pub fn table(&self, rows: usize) -> Option<Vec<[f64; 3]>> {
        let depth = |c: &Course| c.depth[highest(&c.depth)];
        let c = self.courses.iter().max_by(|a, b| depth(a).total_cmp(&depth(b)))?;
        let top = highest(&c.depth);
        let (low, high) = (c.depth.iter().copied().fold(f64::MAX, f64::min), c.depth[top]);
        let nearest = |of: std::ops::RangeInclusive<usize>, x: f64| {
            of.min_by(|a, b| (c.depth[*a] - x).abs().total_cmp(&(c.depth[*b] - x).abs()))
                .map_or(f64::NAN, |i| c.force[i])
        };
        let row = |k: usize| {
            let x = low + (high - low) * k as f64 / (rows.max(2) - 1) as f64;
            [x, nearest(0..=top, x), nearest(top..=c.depth.len() - 1, x)]
        };
        Some((0..rows).map(row).collect())
    }

    /// The largest force of these parts of the law, N, and the share of their squares by phase.
    fn action(&self, parts: &[usize]) -> (f64, [f64; 4]) {
        let (mut largest, mut shares) = (0.0f64, [0.0; 4]);
        for c in &self.courses {
            let top = highest(&c.depth);
            for i in 0..c.time.len() {
                let f: f64 = parts.iter().map(|p| c.parts[*p][i]).sum();
                largest = largest.max(f.abs());
                shares[if i <= top { 1 } else { 2 }] += f * f;
            }
        }
        (largest, over_their_sum(shares))
    }
}
