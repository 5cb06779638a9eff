//! The posterior over sets of names, over nothing and over unknown, from the evidence of what was weighed.
//!
//! Evidence counts fully while differences are small and by its logarithm where they are large: no likelihood is right to
//! hundreds of nats. How small, how large, and how much more a name needs than nothing is what `calibration.json` holds;
//! `tests/calibrate` writes it from campaigns of the laboratory whose cause is known.

use crate::evidence::{Evidences, Weighed, OWN_SIZES, SIZES};
use mechanisms::named;
use serde::Deserialize;

/// The word for a cause that no vocabulary holds.
pub const UNKNOWN: &str = "unknown";
/// Probability below which a cause is not worked on: it stands outside of every credible set.
pub const POSSIBLE: f64 = 0.05;
/// Size of a discrepancy from which on it is no small print, share of force.
pub const LARGE: f64 = 0.03;

/// What turns evidence into probabilities.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// ln of what differences of ln evidence are divided by.
    pub temperature: f64,
    /// Power of the least overdispersion left, on that.
    pub overdispersion: f64,
    /// ln of the difference from which on evidence counts by its logarithm.
    pub tail: f64,
    /// What is added to `temperature` and to `tail` where the most evidence of all is without a discrepancy: the laws
    /// are right to the noise.
    pub noise_temperature: f64,
    pub noise_tail: f64,
    /// ln prior of one mechanism, of several, and of an unknown cause, over that of nothing.
    pub single: f64,
    pub pair: f64,
    pub unknown: f64,
    /// ln weight of a stand-in, of what each recording has of its own, of a large discrepancy, among the unknown; and of a
    /// large discrepancy and a small one of each recording's own beside what is known.
    pub stand_in: f64,
    pub own: f64,
    pub large: f64,
    pub large_known: f64,
    pub own_known: f64,
    /// Powers of the overdispersion that a structure leaves, on the weight of its large discrepancy among the unknown and
    /// beside what is known: where next to nothing is left, the discrepancy is no reason to doubt the names.
    pub large_left: f64,
    pub large_known_left: f64,
    /// ln weight of instruments that are disturbed: that drift, hum or walk.
    pub drift: f64,
    /// Weight of ln(1 + nats that such instruments explain) on every cause that has them, but the unknown: instruments
    /// that explain very much are more likely something that nobody has named.
    pub disturbed: f64,
    /// ln weight of the discrepancy's sizes, a step, and of none at all.
    pub size: f64,
    pub none: f64,
    /// ln weight of each parameter of the mechanisms added: forms were chosen among many.
    pub parameter: f64,
    /// ln weight of a structure with a parameter at a bound, and of any name where there is one level only.
    pub bound: f64,
    pub one_level: f64,
    /// Weights of the ln of how many times better a structure predicts levels not seen than the simulation as given, and of
    /// how many times worse.
    pub heldout: f64,
    pub worse: f64,
    /// ln weight of names that limit a reading where readings end in a flat top: no impact makes one.
    pub flat: f64,
    /// Weight of ln(1 + nats that the best structure with these names has over the best without them): what is needed by
    /// all that explain much is likely there, whatever else is.
    pub needed: f64,
    /// Weight of ln(1 + nats that the best structure with these names and more has over the best with these alone): what
    /// is part of an explanation that works may be right and not all.
    pub completed: f64,
    /// Probability that a set has to add up to, to hold the cause with 95 %.
    pub level: f64,
}

impl Table {
    /// The table that `tests/calibrate` wrote.
    ///
    /// # Panics
    /// Never: the file is part of the build, and a test reads it.
    pub fn calibrated() -> Table {
        serde_json::from_str(include_str!("../calibration.json")).expect("the calibration is a table")
    }

    /// ln weight of the discrepancy's size of this index.
    fn of_size(&self, i: usize) -> f64 {
        if i == 0 {
            self.none
        } else {
            self.size * (i - 1) as f64
        }
    }

    /// ln evidence of a structure over all discrepancies that are small print, weighted.
    pub fn mass(&self, w: &Weighed) -> f64 {
        let of_parameters = self.parameter * w.parameters as f64;
        let each = w.ln.iter().enumerate().flat_map(|(drifts, of)| {
            let small = of.iter().enumerate().filter(|(i, ln)| SIZES[*i] < LARGE && ln.is_finite());
            small.map(move |(i, ln)| ln + self.of_size(i) + drifts as f64 * self.drift + of_parameters)
        });
        ln_sum(&each.collect::<Vec<_>>())
    }
}

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
    counted: Counted,
}

/// ln(sum of exp).
pub(crate) fn ln_sum(v: &[f64]) -> f64 {
    let top = v.iter().cloned().fold(f64::NEG_INFINITY, f64::max);
    if top.is_finite() {
        top + v.iter().map(|x| (x - top).exp()).sum::<f64>().ln()
    } else {
        top
    }
}

/// What stands for all names that no recordings part from these: sorted, of collinear names the first.
fn canonical(names: &[&'static str]) -> Vec<&'static str> {
    let first = |name: &&'static str| {
        let twins = named(name).map_or(&[][..], |m| m.hints.collinear_with);
        twins.iter().copied().chain([*name]).min().unwrap_or(name)
    };
    let mut v: Vec<&'static str> = names.iter().map(first).collect();
    v.sort_unstable();
    v.dedup();
    v
}

/// Whether one of these mechanisms limits a reading.
fn limits_reading(names: &[&'static str]) -> bool {
    names.iter().filter_map(|n| named(n)).any(|m| m.hints.limits_reading)
}

/// The structure of these names with the most evidence, of discrepancies that are small print; None where none was weighed.
fn best_of(e: &Evidences, names: &[&'static str]) -> Option<usize> {
    let names = canonical(names);
    let small = |w: &Weighed| {
        let of = w.ln.iter().flat_map(|of| of.iter().zip(SIZES)).filter(|(ln, size)| *size < LARGE && ln.is_finite());
        of.map(|(ln, _)| *ln).reduce(f64::max)
    };
    let of = e.structures.iter().enumerate().filter(|(_, w)| w.named && canonical(&w.names) == names);
    of.filter_map(|(i, w)| Some((i, small(w)?))).max_by(|a, b| a.1.total_cmp(&b.1)).map(|b| b.0)
}

/// What a cause gathers: of every structure (index) its weighted ln evidence.
#[derive(Default)]
struct Gathered {
    ln: Vec<f64>,
    /// Of those, the ones with a large discrepancy.
    large: Vec<f64>,
    best: Option<(f64, usize)>,
    /// The most ln evidence, without weights: with steady instruments, and with disturbed ones.
    most: [Option<f64>; 2],
}

/// One ln evidence of a cause.
struct Entry {
    /// Without weights.
    bare: f64,
    /// ln weight.
    weight: f64,
    /// Index of its structure; None of an unknown cause.
    structure: Option<usize>,
    /// Whether it is with a large discrepancy.
    is_large: bool,
    /// Whether it is with instruments that drift, hum or walk.
    drifts: bool,
}

impl Gathered {
    /// Adds one ln evidence.
    fn add(&mut self, e: Entry) {
        let most = &mut self.most[usize::from(e.drifts)];
        *most = Some(most.map_or(e.bare, |m| m.max(e.bare)));
        let ln = e.bare + e.weight;
        self.ln.push(ln);
        if e.is_large {
            self.large.push(ln);
        }
        if let Some(i) = e.structure {
            if self.best.is_none_or(|b| ln > b.0) {
                self.best = Some((ln, i));
            }
        }
    }

    /// The most ln evidence of all, without weights.
    fn most(&self) -> Option<f64> {
        self.most.into_iter().flatten().reduce(f64::max)
    }

    /// ln(1 + nats that disturbed instruments explain beyond steady ones); 0 where either was not weighed.
    fn disturbed(&self) -> f64 {
        let [steady, disturbed] = self.most;
        ahead(disturbed, steady)
    }
}

/// ln(1 + nats that one ln evidence is ahead of another); 0 where it is behind, or either was not weighed.
fn ahead(of: Option<f64>, other: Option<f64>) -> f64 {
    of.zip(other).map_or(0.0, |(of, other)| (of - other).max(0.0).ln_1p())
}

/// ln(1 + nats that the best of `causes` with all of `names` has over the best without them); 0 for nothing and for an
/// unknown cause.
fn needed(causes: &[(Vec<&'static str>, Gathered)], names: &[&'static str]) -> f64 {
    if names.is_empty() || names == [UNKNOWN] {
        return 0.0;
    }
    let (with, without): (Vec<_>, Vec<_>) =
        causes.iter().filter(|c| c.0 != [UNKNOWN]).partition(|c| names.iter().all(|n| c.0.contains(n)));
    let most = |of: &[&(Vec<&'static str>, Gathered)]| of.iter().filter_map(|c| c.1.most()).reduce(f64::max);
    ahead(most(&with), most(&without))
}

/// ln(1 + nats that the best of `causes` with all of `names` and more has over the best with `names` alone); 0 for nothing
/// and for an unknown cause.
fn completed(causes: &[(Vec<&'static str>, Gathered)], names: &[&'static str], alone: &Gathered) -> f64 {
    if names.is_empty() || names == [UNKNOWN] {
        return 0.0;
    }
    let with = causes.iter().filter(|c| c.0 != [UNKNOWN] && names.iter().all(|n| c.0.contains(n)));
    ahead(with.filter_map(|c| c.1.most()).reduce(f64::max), alone.most())
}

impl Posterior {
    /// Of what was weighed, by `table`.
    pub fn new(e: &Evidences, table: &Table) -> Posterior {
        let mut causes: Vec<(Vec<&'static str>, Gathered)> = Vec::new();
        let mut add = |names: Vec<&'static str>, entry: Entry| {
            let i = causes.iter().position(|c| c.0 == names).unwrap_or_else(|| {
                causes.push((names, Gathered::default()));
                causes.len() - 1
            });
            causes[i].1.add(entry);
        };
        let mut left = f64::INFINITY;
        // the most evidence of all, and whether it is without a discrepancy
        let mut most = (f64::NEG_INFINITY, false);
        for (at, w) in e.structures.iter().enumerate() {
            if w.left.is_finite() {
                left = left.min(w.left);
            }
            // a stand-in that follows what it has seen and predicts the rest worse stands for nothing
            if !w.named && e.is_worse(at) {
                continue;
            }
            let of_parameters = table.parameter * w.parameters as f64;
            let ln_left = w.overdispersion.max(1.0).ln();
            for (drifts, of) in w.ln.iter().enumerate() {
                for (i, ln) in of.iter().enumerate().filter(|(_, ln)| ln.is_finite()) {
                    if *ln > most.0 {
                        most = (*ln, i == 0);
                    }
                    let weight = table.of_size(i) + drifts as f64 * table.drift + of_parameters;
                    let of = |structure, more: f64, is_large| Entry {
                        bare: *ln,
                        weight: weight + more,
                        structure,
                        is_large,
                        drifts: drifts > 0,
                    };
                    if !w.named {
                        add(vec![UNKNOWN], of(None, table.stand_in, false));
                    } else if SIZES[i] >= LARGE {
                        add(vec![UNKNOWN], of(None, table.large + table.large_left * ln_left, true));
                        let known = table.large_known + table.large_known_left * ln_left;
                        add(canonical(&w.names), of(Some(at), known, true));
                    } else {
                        add(canonical(&w.names), of(Some(at), 0.0, false));
                    }
                }
            }
        }
        for u in &e.unknown {
            let beside = best_of(e, &u.beside).filter(|_| !u.beside.is_empty());
            for (size, ln) in OWN_SIZES.iter().cycle().zip(&u.ln).filter(|(_, ln)| ln.is_finite()) {
                let of = |structure, weight| Entry { bare: *ln, weight, structure, is_large: false, drifts: false };
                add(vec![UNKNOWN], of(None, table.own));
                // beside names, as with a discrepancy that all share: what is small does not make the cause another one
                if let Some(at) = beside.filter(|_| *size < LARGE) {
                    let of_parameters = table.parameter * e.structures[at].parameters as f64;
                    add(canonical(&u.beside), of(Some(at), table.own_known + of_parameters));
                }
                if *ln > most.0 {
                    most = (*ln, false);
                }
            }
        }
        let left = if left.is_finite() { left.max(1.0) } else { 1.0 };
        let mass: Vec<f64> = causes.iter().map(|c| ln_sum(&c.1.ln)).collect();
        let top = mass.iter().cloned().fold(f64::NEG_INFINITY, f64::max);
        let noise_alone = f64::from(u8::from(most.1));
        let tail = (table.tail + noise_alone * table.noise_tail).exp();
        let temperature =
            (table.temperature + noise_alone * table.noise_temperature).exp() * left.powf(table.overdispersion);
        let counted = Counted { tail, temperature };
        let prior = |names: &[&str]| match names {
            [] => 0.0,
            [UNKNOWN] => table.unknown,
            [_] => table.single,
            _ => table.pair,
        };
        let doubt = |gathered: &Gathered| {
            gathered.best.map_or(0.0, |(_, i)| {
                let given = e.structures[i].names.is_empty();
                let better = e.better(i).unwrap_or(0.0);
                let of = |is: bool, weight: f64| if is && !given { weight } else { 0.0 };
                of(e.structures[i].at_bound, table.bound)
                    + table.heldout * better.max(0.0)
                    + table.worse * (-better).max(0.0)
                    + of(e.levels < 2, table.one_level)
                    + of(e.flat && limits_reading(&e.structures[i].names), table.flat)
            })
        };
        let score: Vec<f64> = causes
            .iter()
            .zip(&mass)
            .map(|(c, m)| {
                let need = table.needed * needed(&causes, &c.0) + table.completed * completed(&causes, &c.0, &c.1);
                let disturbed = if c.0 == [UNKNOWN] { 0.0 } else { table.disturbed * c.1.disturbed() };
                prior(&c.0) + doubt(&c.1) + need + disturbed - counted.less(top - m)
            })
            .collect();
        let whole = ln_sum(&score);
        let mut causes: Vec<Cause> = causes
            .into_iter()
            .zip(&score)
            .map(|((names, gathered), s)| {
                let structure = gathered.best.map(|b| b.1);
                // names as the structure has them: of collinear ones the one that was fitted
                let names = structure.map_or(names, |i| e.structures[i].names.clone());
                let large = (ln_sum(&gathered.large) - ln_sum(&gathered.ln)).exp();
                Cause { names, probability: (s - whole).exp(), structure, large }
            })
            .collect();
        causes.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        let mut sum = 0.0;
        let credible = causes
            .iter()
            .position(|c| {
                sum += c.probability;
                sum >= table.level
            })
            .map_or(causes.len(), |i| i + 1);
        Posterior { causes, credible, counted }
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
    pub fn of(&self, name: &str) -> f64 {
        self.causes.iter().filter(|c| c.names.contains(&name)).map(|c| c.probability).sum()
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
        names.sort_unstable();
        names.dedup();
        names.retain(|n| self.of(n) > 0.5);
        names
    }

    /// The most probable cause that holds all of `names`, itself and no other where it was weighed.
    pub fn with_names(&self, names: &[&str]) -> Option<&Cause> {
        let holds = |c: &&Cause| !c.is_unknown() && names.iter().all(|n| c.names.contains(n));
        let alone = self.causes.iter().filter(holds).find(|c| c.names.len() == names.len());
        alone.or_else(|| self.causes.iter().find(holds))
    }

    /// Whether nothing is the most probable of all causes.
    pub fn is_nothing(&self) -> bool {
        self.causes.first().is_none_or(|c| c.names.is_empty())
    }

    /// The causes that hold the true one with 95 %.
    pub fn credible_set(&self) -> &[Cause] {
        &self.causes[..self.credible]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evidence::{Unknown, Weighed};

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
        let p = Posterior::new(&Evidences { structures, unknown: Vec::new(), levels: 3, flat: false }, &plain());
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
            Posterior::new(&Evidences { structures, unknown: Vec::new(), levels: 3, flat: false }, &table).nothing()
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
            Posterior::new(&Evidences { structures, unknown: Vec::new(), levels: 3, flat: false }, &table).of("gravity")
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
            Posterior::new(&Evidences { structures: structures(), unknown: Vec::new(), levels: 3, flat: false }, &table)
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
            let e = Evidences { structures, unknown: Vec::new(), levels: 3, flat: false };
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
            let e = Evidences { structures, unknown: Vec::new(), levels: 3, flat: false };
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
            &Evidences { structures, unknown: Vec::new(), levels: 3, flat: false },
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
        let p = Posterior::new(&Evidences { structures, unknown: Vec::new(), levels: 3, flat: false }, &plain());
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
            Posterior::new(&Evidences { structures, unknown, levels: 3, flat: false }, &Table { own_known, ..plain() })
        };
        assert!(of(f64::NEG_INFINITY).of("gravity") < 1e-3);
        // of the two sizes the smaller one counts for it
        assert!((of(0.0).of("gravity") - 1.0 / 3.0).abs() < 1e-3, "{:?}", of(0.0));
    }

    #[test]
    fn a_flat_top_speaks_for_a_limited_reading() {
        let of = |flat: bool| {
            let structures =
                vec![weighed(&[], true, 0.0), weighed(&["clipping"], true, 0.0), weighed(&["gravity"], true, 0.0)];
            Posterior::new(
                &Evidences { structures, unknown: Vec::new(), levels: 3, flat },
                &Table { flat: 2.0, ..plain() },
            )
        };
        let odds = |p: &Posterior| p.of("clipping") / p.of("gravity");
        assert!((odds(&of(false)) - 1.0).abs() < 1e-9 && (odds(&of(true)) - 2f64.exp()).abs() < 1e-9);
    }

    #[test]
    fn the_calibration_can_be_read() {
        let t = Table::calibrated();
        assert!((0.5..1.0).contains(&t.level) && t.temperature.is_finite());
    }
}
