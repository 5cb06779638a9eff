//! The evidence of all that was weighed, gathered by cause: a set of names, nothing, or what no vocabulary holds.

use crate::evidence::{Evidences, Unknown, Weighed, LARGE, OWN_SIZES, SIZES};
use crate::table::Table;
use mechanisms::named;

/// The word for a cause that no vocabulary holds.
pub const UNKNOWN: &str = "unknown";

/// What counts for a cause.
#[derive(Default)]
pub struct Gathered {
    /// Sorted, of names that no recordings part the first; none: nothing is missing.
    pub names: Vec<&'static str>,
    /// Every ln evidence, weighted.
    pub ln: Vec<f64>,
    /// Of those, the ones with a large discrepancy.
    pub large: Vec<f64>,
    /// The most ln evidence, weighted, of a structure, and the structure's index; None of an unknown cause.
    pub best: Option<(f64, usize)>,
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
    /// Whether it is the cause that no vocabulary holds.
    pub fn is_unknown(&self) -> bool {
        self.names == [UNKNOWN]
    }

    /// Whether it is a set of names, and not nothing.
    fn is_named(&self) -> bool {
        !self.names.is_empty() && !self.is_unknown()
    }

    /// Whether it is a set of names with all of these.
    fn has(&self, names: &[&str]) -> bool {
        !self.is_unknown() && names.iter().all(|n| self.names.contains(n))
    }

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
    pub fn disturbed(&self) -> f64 {
        let [steady, disturbed] = self.most;
        ahead(disturbed, steady)
    }
}

/// Every cause weighed, in the order of the structures.
pub struct Causes {
    pub all: Vec<Gathered>,
    /// The least overdispersion that a structure's likeliest discrepancy leaves, 1 or more.
    pub left: f64,
    /// Whether the most evidence of all is without a discrepancy: the laws are right to the noise.
    pub noise_alone: bool,
    /// The most ln evidence of all, without weights.
    most: f64,
}

impl Causes {
    /// What counts for each cause, by the weights of `table`.
    pub fn gather(e: &Evidences, table: &Table) -> Causes {
        let mut causes = Causes { all: Vec::new(), left: f64::INFINITY, noise_alone: false, most: f64::NEG_INFINITY };
        for (at, w) in e.structures.iter().enumerate() {
            if w.left.is_finite() {
                causes.left = causes.left.min(w.left);
            }
            // a stand-in that follows what it has seen and predicts the rest worse stands for nothing
            if w.named || !e.is_worse(at) {
                causes.add_structure(at, w, table);
            }
        }
        for u in &e.unknown {
            causes.add_unknown(u, e, table);
        }
        causes.left = if causes.left.is_finite() { causes.left.max(1.0) } else { 1.0 };
        causes
    }

    fn add(&mut self, names: Vec<&'static str>, entry: Entry) {
        let i = self.all.iter().position(|c| c.names == names).unwrap_or_else(|| {
            self.all.push(Gathered { names, ..Gathered::default() });
            self.all.len() - 1
        });
        self.all[i].add(entry);
    }

    /// Keeps the most ln evidence of all.
    fn keep_most(&mut self, ln: f64, without_discrepancy: bool) {
        if ln > self.most {
            self.most = ln;
            self.noise_alone = without_discrepancy;
        }
    }

    /// The evidence of the structure of this index: of names, or of a stand-in for what no vocabulary holds.
    fn add_structure(&mut self, at: usize, w: &Weighed, table: &Table) {
        let of_parameters = table.parameter * w.parameters as f64;
        let ln_left = w.overdispersion.max(1.0).ln();
        for (drifts, of) in w.ln.iter().enumerate() {
            for (i, ln) in of.iter().enumerate().filter(|(_, ln)| ln.is_finite()) {
                self.keep_most(*ln, i == 0);
                let weight = table.of_size(i) + drifts as f64 * table.drift + of_parameters;
                let of = |structure, more: f64, is_large| Entry {
                    bare: *ln,
                    weight: weight + more,
                    structure,
                    is_large,
                    drifts: drifts > 0,
                };
                if !w.named {
                    self.add(vec![UNKNOWN], of(None, table.stand_in, false));
                } else if SIZES[i] >= LARGE {
                    self.add(vec![UNKNOWN], of(None, table.large + table.large_left * ln_left, true));
                    let known = table.large_known + table.large_known_left * ln_left;
                    self.add(canonical(&w.names), of(Some(at), known, true));
                } else {
                    self.add(canonical(&w.names), of(Some(at), 0.0, false));
                }
            }
        }
    }

    /// The evidence of something of each recording's own beside a structure.
    fn add_unknown(&mut self, u: &Unknown, e: &Evidences, table: &Table) {
        let beside = best_of(e, &u.beside).filter(|_| !u.beside.is_empty());
        for (size, ln) in OWN_SIZES.iter().cycle().zip(&u.ln).filter(|(_, ln)| ln.is_finite()) {
            let of = |structure, weight| Entry { bare: *ln, weight, structure, is_large: false, drifts: false };
            self.add(vec![UNKNOWN], of(None, table.own));
            // beside names, as with a discrepancy that all share: what is small does not make the cause another one
            if let Some(at) = beside.filter(|_| *size < LARGE) {
                let of_parameters = table.parameter * e.structures[at].parameters as f64;
                self.add(canonical(&u.beside), of(Some(at), table.own_known + of_parameters));
            }
            self.keep_most(*ln, false);
        }
    }

    /// ln(1 + nats that the best cause with all of these names has over the best without them); 0 for nothing and for an
    /// unknown cause.
    pub fn needed(&self, of: &Gathered) -> f64 {
        if !of.is_named() {
            return 0.0;
        }
        let (with, without): (Vec<_>, Vec<_>) =
            self.all.iter().filter(|c| !c.is_unknown()).partition(|c| c.has(&of.names));
        let most = |of: &[&Gathered]| of.iter().filter_map(|c| c.most()).reduce(f64::max);
        ahead(most(&with), most(&without))
    }

    /// ln(1 + nats that the best cause with all of these names and more has over the best with these alone); 0 for nothing
    /// and for an unknown cause.
    pub fn completed(&self, of: &Gathered) -> f64 {
        if !of.is_named() {
            return 0.0;
        }
        let with = self.all.iter().filter(|c| c.has(&of.names));
        ahead(with.filter_map(Gathered::most).reduce(f64::max), of.most())
    }
}

/// ln(1 + nats that one ln evidence is ahead of another); 0 where it is behind, or either was not weighed.
fn ahead(of: Option<f64>, other: Option<f64>) -> f64 {
    of.zip(other).map_or(0.0, |(of, other)| (of - other).max(0.0).ln_1p())
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
