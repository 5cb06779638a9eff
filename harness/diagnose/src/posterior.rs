//! The posterior over sets of names, over nothing and over unknown, from the evidence of what was weighed.
//!
//! Evidence counts fully while differences are small and by its logarithm where they are large: no likelihood is right to
//! hundreds of nats. How small, how large, and how much more a name needs than nothing is what `calibration.json` holds;
//! `tests/calibrate` writes it from campaigns of the laboratory whose cause is known.

pub use crate::causes::UNKNOWN;
use crate::causes::{Causes, Gathered};
use crate::evidence::{ln_sum, Evidences};
use crate::table::Table;
use estimate::flat::probability;
use mechanisms::named;

/// Probability below which a cause is not worked on: it stands outside of every credible set.
pub const POSSIBLE: f64 = 0.05;

/// How differences of evidence count: fully while they are small, by their logarithm where they are large.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Counted {
    tail: f64,
    temperature: f64,
}

impl Default for Counted {
    fn default() -> Counted {
        Counted { tail: 1.0, temperature: 1.0 }
    }
}

impl Counted {
    /// As `table` has it for what was weighed.
    fn of(causes: &Causes, table: &Table) -> Counted {
        let noise_alone = f64::from(u8::from(causes.noise_alone));
        Counted {
            tail: (table.tail + noise_alone * table.noise_tail).exp(),
            temperature: (table.temperature + noise_alone * table.noise_temperature).exp()
                * causes.left.powf(table.overdispersion),
        }
    }

    /// What `nats` less evidence take from the score.
    fn less(self, nats: f64) -> f64 {
        self.tail * (nats / (self.tail * self.temperature)).ln_1p()
    }
}

/// A set of names with its probability; no names: nothing is missing.
#[derive(Clone, Debug, PartialEq)]
pub struct Cause {
    pub names: Vec<&'static str>,
    pub probability: f64,
    /// Index of the structure of these names that is likeliest, among those weighed; None of an unknown cause.
    pub structure: Option<usize>,
    /// Share of it, 0 to 1, with a discrepancy beside the names that is no small print: 3 % of force or more.
    pub large: f64,
}

impl Cause {
    /// Whether it is a cause that no vocabulary holds.
    pub fn is_unknown(&self) -> bool {
        self.names == [UNKNOWN]
    }
}

/// Probabilities of every cause weighed, the most probable first.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Posterior {
    pub causes: Vec<Cause>,
    /// How many of them, from the first on, hold the cause with 95 %.
    pub credible: usize,
    /// Probability that a reading is limited, whatever else is missing, by the flat top that it ends in.
    pub limited: f64,
    counted: Counted,
}

/// What speaks for a set of names before anything is weighed.
fn ln_prior(names: &[&str], table: &Table) -> f64 {
    match names {
        [] => 0.0,
        [UNKNOWN] => table.unknown,
        [_] => table.single,
        _ => table.pair,
    }
}

/// What limits a reading and leaves a flat top.
const LIMITS: [&str; 1] = [mechanisms::clipping::MECHANISM.name];

/// Whether one of these mechanisms limits a reading.
pub fn limits_reading(names: &[&'static str]) -> bool {
    names.iter().filter_map(|n| named(n)).any(|m| m.hints.limits_reading)
}

/// ln weight of what speaks for and against the structure of this index beside its evidence: a parameter at a bound, what
/// it predicts of levels not seen, and what the recordings are.
fn ln_reliance(e: &Evidences, i: usize, table: &Table) -> f64 {
    let structure = &e.structures[i];
    let better = e.better(i).unwrap_or(0.0);
    let of = |is: bool, weight: f64| if is && !structure.names.is_empty() { weight } else { 0.0 };
    of(structure.at_bound, table.bound)
        + table.of_heldout(better)
        + of(e.levels < 2, table.one_level)
        + of(e.flat > 0.0 && limits_reading(&structure.names), table.flat)
}

/// Names in their order.
pub(crate) fn sorted(names: &[&'static str]) -> Vec<&'static str> {
    let mut v = names.to_vec();
    v.sort_unstable();
    v
}

/// Adds to the probability of the cause of these `names`, sorted.
fn add(causes: &mut Vec<Cause>, names: Vec<&'static str>, probability: f64) {
    match causes.iter_mut().find(|c| sorted(&c.names) == names) {
        Some(c) => c.probability += probability,
        None => causes.push(Cause { names, probability, structure: None, large: 0.0 }),
    }
}

impl Posterior {
    /// Of what was weighed, by `table`.
    pub fn new(e: &Evidences, table: &Table) -> Posterior {
        let causes = Causes::gather(e, table);
        let counted = Counted::of(&causes, table);
        let mass: Vec<f64> = causes.all.iter().map(|c| ln_sum(&c.ln)).collect();
        let top = mass.iter().cloned().fold(f64::NEG_INFINITY, f64::max);
        let score = |(c, mass): (&Gathered, &f64)| {
            let reliance = c.best.map_or(0.0, |(_, i)| ln_reliance(e, i, table));
            let need = table.needed * causes.needed(c) + table.completed * causes.completed(c);
            let disturbed = if c.is_unknown() { 0.0 } else { table.disturbed * c.disturbed() };
            ln_prior(&c.names, table) + reliance + need + disturbed - counted.less(top - mass)
        };
        let score: Vec<f64> = causes.all.iter().zip(&mass).map(score).collect();
        let whole = ln_sum(&score);
        let cause = |((c, mass), score): ((Gathered, &f64), &f64)| {
            let structure = c.best.map(|b| b.1);
            // names as the structure has them: of collinear ones the one that was fitted
            let names = structure.map_or(c.names, |i| e.structures[i].names.clone());
            let large = (ln_sum(&c.large) - mass).exp();
            Cause { names, probability: (score - whole).exp(), structure, large }
        };
        let causes: Vec<Cause> = causes.all.into_iter().zip(&mass).zip(&score).map(cause).collect();
        Posterior { limited: probability(e.flat), ..Posterior::of_causes(causes, table.level, counted) }
    }

    /// Of causes with their probabilities; `level`: what those have to add up to that hold the cause with 95 %.
    fn of_causes(mut causes: Vec<Cause>, level: f64, counted: Counted) -> Posterior {
        causes.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        let mut sum = 0.0;
        let holds = |c: &Cause| {
            sum += c.probability;
            sum >= level
        };
        let credible = causes.iter().position(holds).map_or(causes.len(), |i| i + 1);
        Posterior { causes, credible, limited: 0.0, counted }
    }

    /// The same with the unknown cause taken apart into `sets` of names, sorted, with the probability of each given that no
    /// form of the vocabulary explains what was read.
    pub fn refined(&self, sets: impl Iterator<Item = (Vec<&'static str>, f64)>, level: f64) -> Posterior {
        let unknown = self.unknown();
        let mut causes: Vec<Cause> = self.causes.iter().filter(|c| !c.is_unknown()).cloned().collect();
        for (names, share) in sets {
            add(&mut causes, names, unknown * share);
        }
        Posterior { limited: self.limited, ..Posterior::of_causes(causes, level, self.counted) }
    }

    /// The same with every cause weighed once more, by the ln weight that `ln` has of it; the same where none has any.
    pub fn weighed(&self, ln: impl Fn(&Cause) -> f64, level: f64) -> Posterior {
        let of: Vec<f64> = self.causes.iter().map(|c| c.probability.ln() + ln(c)).collect();
        let whole = ln_sum(&of);
        if !whole.is_finite() {
            return self.clone();
        }
        let again = |(c, of): (&Cause, f64)| Cause { probability: (of - whole).exp(), ..c.clone() };
        let causes = self.causes.iter().zip(of).map(again).collect();
        Posterior { limited: self.limited, ..Posterior::of_causes(causes, level, self.counted) }
    }

    /// The same where the likeliest of all that is no unknown cause leaves `inflation` times the variance of the noise: what speaks
    /// against an unknown cause counts for so many times less (quasi-likelihood: Wedderburn 1974). As it is where nothing speaks
    /// against it, or no more is left than noise.
    pub fn doubted(&self, inflation: f64, level: f64) -> Posterior {
        let unknown = self.unknown();
        if unknown > 0.5 || inflation.is_nan() || inflation <= 1.0 {
            return self.clone();
        }
        let ln_odds = (unknown.max(f64::MIN_POSITIVE) / (1.0 - unknown)).ln() / inflation;
        let share = 1.0 / (1.0 + (-ln_odds).exp());
        let mut causes: Vec<Cause> = self.causes.iter().filter(|c| !c.is_unknown()).cloned().collect();
        causes.iter_mut().for_each(|c| c.probability *= (1.0 - share) / (1.0 - unknown));
        add(&mut causes, vec![UNKNOWN], share);
        Posterior { limited: self.limited, ..Posterior::of_causes(causes, level, self.counted) }
    }

    /// Probability of exactly these names.
    pub fn of_set(&self, names: &[&'static str]) -> f64 {
        let names = sorted(names);
        self.causes.iter().filter(|c| sorted(&c.names) == names).map(|c| c.probability).sum()
    }

    /// The same with the cause `names` parted: with a probability of `share`, given that cause, `beside` is missing too.
    pub fn with_beside(&self, names: &[&'static str], beside: &'static str, share: f64, level: f64) -> Posterior {
        let names = sorted(names);
        self.parted(beside, share, level, |c| sorted(&c.names) == names)
    }

    /// The same with `name` missing besides, with a probability of `share`, whatever else is: of an unknown cause it is what is known.
    /// Nothing missing stays as it is.
    pub fn with_another(&self, name: &'static str, share: f64, level: f64) -> Posterior {
        self.parted(name, share, level, |c| !c.names.is_empty() && !c.names.contains(&name))
    }

    /// The same with every cause that `is_parted` says parted: with a probability of `share`, given that cause, `name` is missing too.
    fn parted(&self, name: &'static str, share: f64, level: f64, is_parted: impl Fn(&Cause) -> bool) -> Posterior {
        let (mut causes, mut both) = (self.causes.clone(), Vec::new());
        for c in causes.iter_mut().filter(|c| is_parted(c)) {
            let known: &[&'static str] = if c.is_unknown() { &[] } else { &c.names };
            both.push((sorted(&[known, &[name]].concat()), share * c.probability));
            c.probability *= 1.0 - share;
        }
        both.into_iter().for_each(|(names, probability)| add(&mut causes, names, probability));
        Posterior { limited: self.limited, ..Posterior::of_causes(causes, level, self.counted) }
    }

    /// Probabilities of alternatives that are as likely beforehand, by their ln evidence, as differences of it count here; all
    /// zero where none is finite.
    pub fn shares(&self, ln: &[f64]) -> Vec<f64> {
        let top = ln.iter().cloned().fold(f64::NEG_INFINITY, f64::max);
        let of = |m: f64| if m.is_finite() { (-self.counted.less(top - m)).exp() } else { 0.0 };
        let all: Vec<f64> = ln.iter().map(|m| of(*m)).collect();
        let sum: f64 = all.iter().sum();
        all.iter().map(|w| if sum > 0.0 { w / sum } else { 0.0 }).collect()
    }

    /// Probability that nothing is missing.
    pub fn nothing(&self) -> f64 {
        self.causes.iter().filter(|c| c.names.is_empty()).map(|c| c.probability).sum()
    }

    /// Probability that the cause is in no vocabulary.
    pub fn unknown(&self) -> f64 {
        self.causes.iter().filter(|c| c.is_unknown()).map(|c| c.probability).sum()
    }

    /// Probability that several mechanisms of the vocabulary are missing.
    pub fn of_several(&self) -> f64 {
        self.causes.iter().filter(|c| c.names.len() > 1).map(|c| c.probability).sum()
    }

    /// Probability that `name` is among what is missing.
    pub fn of(&self, name: &'static str) -> f64 {
        let of: f64 = self.causes.iter().filter(|c| c.names.contains(&name)).map(|c| c.probability).sum();
        match limits_reading(&[name]) {
            true => self.limited + (1.0 - self.limited) * of,
            false => of,
        }
    }

    /// Whether a flat top makes it more likely than not that a reading is limited.
    pub fn is_limited(&self) -> bool {
        self.limited > 0.5
    }

    /// The most probable set of names that is neither empty nor unknown.
    pub fn best_named(&self) -> Option<&Cause> {
        self.causes.iter().find(|c| !c.names.is_empty() && !c.is_unknown())
    }

    /// The names that are more likely than not among what is missing: naming these and no other makes the fewest expected
    /// mistakes, a name too many and a name too few counted alike.
    pub fn likely_names(&self) -> Vec<&'static str> {
        let mut names: Vec<&'static str> =
            self.causes.iter().filter(|c| !c.is_unknown()).flat_map(|c| c.names.iter().copied()).collect();
        names.extend(LIMITS.iter().filter(|_| self.is_limited()));
        names.sort_unstable();
        names.dedup();
        names.retain(|n| self.of(n) > 0.5);
        names
    }

    /// The most probable cause that holds all of `names`, itself and no other where it was weighed.
    pub fn with_names(&self, names: &[&str]) -> Option<&Cause> {
        let holds = |c: &&Cause| !c.is_unknown() && names.iter().all(|n| c.names.contains(n));
        let alone = self.causes.iter().filter(holds).find(|c| c.names.len() == names.len());
        let found = alone.or_else(|| self.causes.iter().find(holds));
        // a limit that shows in the readings may stand beside what was weighed without it
        let rest: Vec<&str> = names.iter().copied().filter(|n| !LIMITS.contains(n)).collect();
        match found {
            None if self.is_limited() && !rest.is_empty() && rest.len() < names.len() => self.with_names(&rest),
            found => found,
        }
    }

    /// Whether nothing is the most probable of all causes.
    pub fn is_nothing(&self) -> bool {
        !self.is_limited() && self.causes.first().is_none_or(|c| c.names.is_empty())
    }

    /// The causes that hold the true one with 95 %.
    pub fn credible_set(&self) -> &[Cause] {
        &self.causes[..self.credible]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evidence::{Unknown, Weighed, LARGE, SIZES};

    fn weighed(names: &[&'static str], named: bool, ln: f64) -> Weighed {
        Weighed {
            names: names.to_vec(),
            forms: names.iter().map(|_| "").collect(),
            named,
            parameters: names.len(),
            chi2: 0.0,
            ln: [vec![ln; SIZES.len()], Vec::new()],
            overdispersion: 1.0,
            left: 1.0,
            pending: 0.0,
            at_bound: false,
            heldout: None,
        }
    }

    fn plain() -> Table {
        Table {
            temperature: 0.0,
            overdispersion: 1.0,
            tail: 20.0,
            noise_temperature: 0.0,
            noise_tail: 0.0,
            single: 0.0,
            pair: 0.0,
            unknown: 0.0,
            stand_in: 0.0,
            own: 0.0,
            large: f64::NEG_INFINITY,
            large_known: 0.0,
            large_left: 0.0,
            large_known_left: 0.0,
            own_known: f64::NEG_INFINITY,
            drift: 0.0,
            disturbed: 0.0,
            size: 0.0,
            none: 0.0,
            parameter: 0.0,
            bound: -1.0,
            worse: -1.0,
            one_level: -0.5,
            heldout: 0.0,
            flat: 0.0,
            needed: 0.0,
            completed: 0.0,
            level: 0.95,
            learned: Table::calibrated().learned,
        }
    }

    #[test]
    fn alternatives_that_are_as_likely_beforehand_share_by_their_evidence() {
        let structures = vec![weighed(&[], true, 0.0), weighed(&["adhesion"], true, 9.0)];
        let p = Posterior::new(&Evidences { structures, ..Evidences::default() }, &plain());
        let shares = p.shares(&[2.0, 0.0, f64::NEG_INFINITY]);
        assert!((shares[0] / shares[1] / 2f64.exp() - 1.0).abs() < 1e-6, "{shares:?}");
        assert_eq!(shares[2], 0.0);
        assert!((shares.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert_eq!(p.shares(&[f64::NAN, f64::NEG_INFINITY]), [0.0, 0.0]);
        // of a structure every discrepancy counts that is small print
        let small = SIZES.iter().filter(|s| **s < LARGE).count() as f64;
        assert!((plain().mass(&weighed(&["adhesion"], true, 1.0)) - 1.0 - small.ln()).abs() < 1e-12);
    }

    #[test]
    fn with_a_long_tail_and_a_temperature_of_one_it_is_bayes_rule() {
        let structures = vec![weighed(&[], true, 0.0), weighed(&["gravity"], true, 3.0)];
        let p = Posterior::new(&Evidences { structures, unknown: Vec::new(), levels: 3, flat: 0.0 }, &plain());
        let want = 3f64.exp() / (1.0 + 3f64.exp());
        assert!((p.of("gravity") - want).abs() < 1e-6, "{p:?}");
        assert!((p.nothing() + p.of("gravity") - 1.0).abs() < 1e-12);
        assert_eq!(p.credible_set().len(), 1);
    }

    #[test]
    fn where_the_laws_are_right_to_the_noise_evidence_counts_for_more() {
        let table = Table { tail: 0.0, noise_tail: 2.0, ..plain() };
        let of = |discrepancy: f64| {
            let mut best = weighed(&["gravity"], true, 30.0);
            best.ln[0][1] += discrepancy;
            let structures = vec![weighed(&[], true, 0.0), best];
            Posterior::new(&Evidences { structures, unknown: Vec::new(), levels: 3, flat: 0.0 }, &table).nothing()
        };
        assert!(of(-1.0) < 0.1 * of(1.0), "{} {}", of(-1.0), of(1.0));
    }

    #[test]
    fn instruments_that_explain_very_much_are_likelier_something_that_nobody_has_named() {
        let odds = |disturbed: f64, explained: f64| {
            let of = |named| {
                let mut w = weighed(&[], named, -explained);
                w.ln[1] = vec![0.0; SIZES.len()];
                w
            };
            let structures = vec![of(true), of(false)];
            let table = Table { disturbed, ..plain() };
            let p = Posterior::new(&Evidences { structures, ..Evidences::default() }, &table);
            p.unknown() / p.nothing()
        };
        for explained in [1.0, 100.0, 1e5] {
            assert!((odds(-1.0, explained) / odds(0.0, explained) / (1.0 + explained) - 1.0).abs() < 1e-9);
        }
        // what steady instruments explain as well is no reason for doubt
        assert!((odds(-1.0, -5.0) / odds(0.0, -5.0) - 1.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_named_is_more_likely_than_not() {
        let cause = |names: &[&'static str], probability: f64| Cause {
            names: names.to_vec(),
            probability,
            structure: Some(0),
            large: 0.0,
        };
        let of =
            |causes: &[Cause]| Posterior { causes: causes.to_vec(), credible: causes.len(), ..Posterior::default() };
        let pair = of(&[
            cause(&["adhesion", "gravity"], 0.40),
            cause(&["gravity"], 0.35),
            cause(&[UNKNOWN], 0.15),
            cause(&[], 0.10),
        ]);
        assert_eq!(pair.likely_names(), ["gravity"]);
        assert_eq!(pair.with_names(&["gravity"]).unwrap().names, ["gravity"]);
        assert_eq!(pair.with_names(&["adhesion"]).unwrap().names, ["adhesion", "gravity"]);
        // together more likely than nothing, and no one of them more likely than not
        let many = [cause(&[], 0.4), cause(&["gravity"], 0.3), cause(&["adhesion"], 0.2), cause(&[UNKNOWN], 0.1)];
        assert!(of(&many).likely_names().is_empty() && of(&many).is_nothing());
        assert!(of(&[]).is_nothing() && !of(&[cause(&[UNKNOWN], 0.6), cause(&[], 0.4)]).is_nothing());
    }

    #[test]
    fn every_parameter_more_has_its_weight() {
        let of = |parameters: usize| {
            let name = Weighed { parameters, ..weighed(&["gravity"], true, 5.0) };
            let structures = vec![weighed(&[], true, 0.0), name];
            let table = Table { parameter: -2.0, ..plain() };
            Posterior::new(&Evidences { structures, unknown: Vec::new(), levels: 3, flat: 0.0 }, &table).of("gravity")
        };
        assert!(of(3) < of(1), "{} {}", of(3), of(1));
    }

    #[test]
    fn what_every_good_structure_needs_is_likelier() {
        let structures = || {
            vec![
                weighed(&[], true, 0.0),
                weighed(&["gravity"], true, 40.0),
                weighed(&["adhesion"], true, 10.0),
                weighed(&["adhesion", "gravity"], true, 60.0),
            ]
        };
        let of = |needed: f64| {
            let table = Table { tail: 0.0, needed, ..plain() };
            Posterior::new(&Evidences { structures: structures(), unknown: Vec::new(), levels: 3, flat: 0.0 }, &table)
        };
        let odds = |p: &Posterior| {
            let single = |n: &str| p.causes.iter().find(|c| c.names == [n]).unwrap().probability;
            single("gravity") / single("adhesion")
        };
        // with gravity 60, without 10; with adhesion 60, without 40
        let want = (51f64 / 21.0).sqrt();
        assert!((odds(&of(0.5)) / odds(&of(0.0)) - want).abs() < 1e-9, "{} {}", odds(&of(0.5)), odds(&of(0.0)));
    }

    #[test]
    fn what_a_better_explanation_completes_is_likelier() {
        let of = |completed: f64| {
            let structures = vec![
                weighed(&[], true, 0.0),
                weighed(&["gravity"], true, 10.0),
                weighed(&["adhesion"], true, 10.0),
                weighed(&["gravity", "viscous_damping"], true, 29.0),
            ];
            let e = Evidences { structures, unknown: Vec::new(), levels: 3, flat: 0.0 };
            Posterior::new(&e, &Table { tail: 0.0, completed, ..plain() })
        };
        let odds = |p: &Posterior| {
            let single = |n: &str| p.causes.iter().find(|c| c.names == [n]).unwrap().probability;
            single("gravity") / single("adhesion")
        };
        // gravity and more has 19 nats over gravity alone; nothing completes adhesion
        assert!((odds(&of(0.0)) - 1.0).abs() < 1e-9 && (odds(&of(0.5)) - 20f64.sqrt()).abs() < 1e-9);
    }

    #[test]
    fn a_large_discrepancy_beside_names_that_leave_little_is_of_the_names() {
        let of = |overdispersion: f64| {
            let mut large = Weighed { overdispersion, ..weighed(&["gravity"], true, 0.0) };
            large.ln[0] = SIZES.map(|size| if size < LARGE { f64::NEG_INFINITY } else { 30.0 }).to_vec();
            let structures = vec![weighed(&[], true, 0.0), large];
            let e = Evidences { structures, unknown: Vec::new(), levels: 3, flat: 0.0 };
            let table = Table { large: 0.0, large_known: 0.0, large_left: 1.0, large_known_left: -0.5, ..plain() };
            let p = Posterior::new(&e, &table);
            p.unknown() / p.of("gravity")
        };
        assert!((of(1.0) - 1.0).abs() < 1e-9 && (of(4.0) - 8.0).abs() < 1e-6, "{} {}", of(1.0), of(4.0));
    }

    #[test]
    fn a_short_tail_lets_no_difference_settle_everything() {
        let structures = vec![weighed(&[], true, 0.0), weighed(&["gravity"], true, 3000.0)];
        let p = Posterior::new(
            &Evidences { structures, unknown: Vec::new(), levels: 3, flat: 0.0 },
            &Table { tail: 0.0, ..plain() },
        );
        assert!((p.nothing() - 1.0 / 3002.0).abs() < 1e-6, "{p:?}");
    }

    #[test]
    fn collinear_names_are_one_cause_and_stand_ins_are_unknown() {
        let structures = vec![
            weighed(&["lowpass_lag"], true, 2.0),
            weighed(&["channel_skew"], true, 1.0),
            weighed(&["latent_force"], false, 1.0),
        ];
        let p = Posterior::new(&Evidences { structures, unknown: Vec::new(), levels: 3, flat: 0.0 }, &plain());
        assert_eq!(p.causes.len(), 2, "{p:?}");
        assert_eq!(p.best_named().unwrap().names, ["lowpass_lag"]);
        assert!(p.unknown() > 0.0 && p.causes.iter().any(Cause::is_unknown));
    }

    #[test]
    fn a_little_of_each_recordings_own_beside_a_name_counts_for_the_name_too() {
        let of = |own_known: f64| {
            let structures = vec![weighed(&[], true, 0.0), weighed(&["gravity"], true, 20.0)];
            let place = estimate::response::Place::Contact;
            let ln = [0.01, 0.03].map(|_| 30.0).to_vec();
            let unknown = vec![Unknown { beside: vec!["gravity"], place, ln }];
            Posterior::new(&Evidences { structures, unknown, levels: 3, flat: 0.0 }, &Table { own_known, ..plain() })
        };
        assert!(of(f64::NEG_INFINITY).of("gravity") < 1e-3);
        // of the two sizes the smaller one counts for it
        assert!((of(0.0).of("gravity") - 1.0 / 3.0).abs() < 1e-3, "{:?}", of(0.0));
    }

    #[test]
    fn a_flat_top_names_a_limit_whatever_else_is_missing() {
        let structures = || vec![weighed(&[], true, 0.0), weighed(&["gravity"], true, 9.0)];
        let of =
            |flat: f64| Posterior::new(&Evidences { structures: structures(), flat, ..Evidences::default() }, &plain());
        assert_eq!(of(0.0).likely_names(), ["gravity"]);
        let limited = of(100.0);
        assert_eq!(limited.likely_names(), ["clipping", "gravity"]);
        assert!(limited.of("clipping") > 0.999);
        // what was weighed without the limit stands for both
        assert_eq!(limited.with_names(&["clipping", "gravity"]).unwrap().names, ["gravity"]);
        let nothing = || Evidences { structures: vec![weighed(&[], true, 0.0)], ..Evidences::default() };
        assert!(Posterior::new(&nothing(), &plain()).is_nothing());
        let flat = Posterior::new(&Evidences { flat: 100.0, ..nothing() }, &plain());
        assert!(!flat.is_nothing() && flat.likely_names() == ["clipping"]);
        // as few repeats as chance has are no limit
        assert!(of(1.0).likely_names() == ["gravity"]);
    }

    #[test]
    fn a_flat_top_speaks_for_a_limited_reading() {
        let of = |flat: f64| {
            let structures =
                vec![weighed(&[], true, 0.0), weighed(&["clipping"], true, 0.0), weighed(&["gravity"], true, 0.0)];
            Posterior::new(
                &Evidences { structures, unknown: Vec::new(), levels: 3, flat },
                &Table { flat: 2.0, ..plain() },
            )
        };
        let of_cause = |p: &Posterior, name: &str| p.causes.iter().find(|c| c.names == [name]).unwrap().probability;
        let odds = |p: &Posterior| of_cause(p, "clipping") / of_cause(p, "gravity");
        assert!((odds(&of(0.0)) - 1.0).abs() < 1e-9 && (odds(&of(9.0)) - 2f64.exp()).abs() < 1e-9);
    }

    #[test]
    fn an_unknown_cause_is_taken_apart_into_what_was_learned() {
        let cause = |names: &[&'static str], probability: f64| Cause {
            names: names.to_vec(),
            probability,
            structure: Some(0),
            large: 0.0,
        };
        let causes = vec![cause(&[UNKNOWN], 0.8), cause(&["gravity", "adhesion"], 0.1), cause(&[], 0.1)];
        let p = Posterior { causes, credible: 3, ..Posterior::default() };
        let sets = [(vec!["adhesion", "gravity"], 0.5), (vec!["clipping"], 0.25), (vec![UNKNOWN], 0.25)];
        let r = p.refined(sets.into_iter(), 0.95);
        assert!((r.of("gravity") - 0.5).abs() < 1e-12 && (r.of("clipping") - 0.2).abs() < 1e-12, "{r:?}");
        assert!((r.unknown() - 0.2).abs() < 1e-12 && (r.nothing() - 0.1).abs() < 1e-12, "{r:?}");
        assert!((r.causes.iter().map(|c| c.probability).sum::<f64>() - 1.0).abs() < 1e-12);
        assert_eq!(r.causes[0].names, ["gravity", "adhesion"]);
    }

    #[test]
    fn causes_that_are_weighed_once_more_have_the_odds_of_both() {
        let cause = |names: &[&'static str], probability: f64, structure: usize| Cause {
            names: names.to_vec(),
            probability,
            structure: Some(structure),
            large: 0.0,
        };
        let causes = vec![cause(&["gravity"], 0.6, 1), cause(&["adhesion"], 0.3, 2), cause(&[UNKNOWN], 0.1, 3)];
        let p = Posterior { causes, credible: 3, ..Posterior::default() };
        let more = p.weighed(|c| if c.is_unknown() { 9f64.ln() } else { 0.0 }, 0.95);
        assert!((more.unknown() - 0.5).abs() < 1e-12 && (more.of("gravity") - 1.0 / 3.0).abs() < 1e-12, "{more:?}");
        assert!(more.causes[0].is_unknown() && (more.of_set(&["adhesion"]) - 1.0 / 6.0).abs() < 1e-12);
        let other = p.weighed(|c| if c.structure == Some(2) { 5f64.ln() } else { f64::NEG_INFINITY }, 0.95);
        assert!((other.of("adhesion") - 1.0).abs() < 1e-12 && other.unknown() == 0.0, "{other:?}");
        assert_eq!(p.weighed(|_| f64::NEG_INFINITY, 0.95), p);
    }

    #[test]
    fn what_is_missing_beside_a_cause_parts_it_alone() {
        let cause = |names: &[&'static str], probability: f64| Cause {
            names: names.to_vec(),
            probability,
            structure: Some(0),
            large: 0.0,
        };
        let causes = vec![cause(&["gravity", "adhesion"], 0.6), cause(&["gravity"], 0.3), cause(&[UNKNOWN], 0.1)];
        let p = Posterior { causes, credible: 3, ..Posterior::default() };
        let parted = p.with_beside(&["adhesion", "gravity"], "fluid_drag", 0.75, 0.95);
        assert!((parted.of("fluid_drag") - 0.45).abs() < 1e-12 && (parted.of("gravity") - 0.9).abs() < 1e-12);
        assert!((parted.of("adhesion") - 0.6).abs() < 1e-12 && (parted.unknown() - 0.1).abs() < 1e-12, "{parted:?}");
    }

    #[test]
    fn names_that_leave_much_more_than_noise_speak_less_against_an_unknown_cause() {
        let cause = |names: &[&'static str], probability: f64| Cause {
            names: names.to_vec(),
            probability,
            structure: None,
            large: 0.0,
        };
        let counted = Counted::default();
        let of = |causes: Vec<Cause>| Posterior::of_causes(causes, 0.95, counted);
        let p = of(vec![cause(&["gravity"], 1.0 - 1e-8), cause(&[UNKNOWN], 1e-8)]);
        assert_eq!(p.doubted(1.0, 0.95), p);
        // odds of 1e-8 that count for a fourth are 1e-2
        let less = p.doubted(4.0, 0.95);
        assert!((less.unknown() - 0.01 / 1.01).abs() < 1e-6 && (less.of("gravity") - 1.0 / 1.01).abs() < 1e-6);
        // as of one of which nothing was weighed at all; what speaks for an unknown cause stays
        assert!(of(vec![cause(&["gravity"], 1.0)]).doubted(1000.0, 0.95).unknown() > 0.3);
        let likely = of(vec![cause(&[UNKNOWN], 0.9), cause(&["gravity"], 0.1)]);
        assert_eq!(likely.doubted(100.0, 0.95), likely);
    }

    #[test]
    fn what_is_missing_besides_parts_every_cause_but_nothing_and_is_what_is_known_of_the_unknown() {
        let cause = |names: &[&'static str], probability: f64| Cause {
            names: names.to_vec(),
            probability,
            structure: Some(0),
            large: 0.0,
        };
        let causes = vec![cause(&[UNKNOWN], 0.6), cause(&["gravity"], 0.3), cause(&[], 0.1)];
        let p = Posterior { causes, credible: 3, ..Posterior::default() };
        let parted = p.with_another("fluid_drag", 0.75, 0.95);
        assert!((parted.of("fluid_drag") - 0.675).abs() < 1e-12 && (parted.of("gravity") - 0.3).abs() < 1e-12);
        assert!((parted.unknown() - 0.15).abs() < 1e-12 && (parted.nothing() - 0.1).abs() < 1e-12, "{parted:?}");
        assert!((parted.of_set(&["fluid_drag"]) - 0.45).abs() < 1e-12);
    }

    #[test]
    fn the_calibration_can_be_read() {
        let t = Table::calibrated();
        assert!((0.5..1.0).contains(&t.level) && t.temperature.is_finite());
    }
}
