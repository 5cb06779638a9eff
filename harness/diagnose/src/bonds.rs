//! How likely each bond of a system of FMUs is the place of what was found: the same mechanisms fitted at every other bond.

use crate::candidate::Candidate;
use crate::decide::Decision;
use crate::evidence::weighed;
use crate::expand::SLOW;
use estimate::fitted::Fitted;
use estimate::structure::Term;
use rayon::prelude::*;

/// Starts that each form is fitted from at another bond.
const STARTS: usize = 2;

/// A bond, by its index in the campaign, and the probability that it is the place, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Likely {
    pub bond: usize,
    pub probability: f64,
}

/// Probabilities of all bonds where what `d` has chosen may act, the most probable first; empty where nothing that acts on
/// what moves is chosen, and where there is one bond alone.
pub fn likely(d: &Decision) -> Vec<Likely> {
    let here = d.chosen.structure.bond();
    if !d.detected || !d.chosen.structure.terms().iter().any(Term::acts) {
        return Vec::new();
    }
    let candidates = d.base.structure.base().candidates();
    let mut others: Vec<usize> =
        candidates.iter().filter(|t| t.acts()).map(|t| t.bond).filter(|b| *b != here).collect();
    others.sort_unstable();
    others.dedup();
    if others.is_empty() {
        return Vec::new();
    }
    let weight = |f: &Fitted| weighed(f).map_or(f64::NEG_INFINITY, |w| d.table.mass(&w));
    let mut all = vec![(here, weight(&d.chosen))];
    all.extend(others.into_iter().map(|b| (b, moved_to(d, &candidates, b).map_or(f64::NEG_INFINITY, |f| weight(&f)))));
    let ln: Vec<f64> = all.iter().map(|a| a.1).collect();
    let shares = d.posterior.shares(&ln);
    let bonds = all.iter().map(|a| a.0);
    let mut found: Vec<Likely> = bonds.zip(shares).map(|(bond, probability)| Likely { bond, probability }).collect();
    found.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    found
}

/// What is chosen, fitted with all that acts on what moves at bond `b`, each mechanism in its best form there. None where a
/// mechanism cannot act there, or its fit fails.
fn moved_to(d: &Decision, candidates: &[Term], b: usize) -> Option<Fitted> {
    let mut f = d.base.clone();
    for term in d.chosen.structure.terms() {
        let there = |t: &&Term| t.name() == term.name() && (!term.acts() || t.bond == b);
        let forms: Vec<&Term> = candidates.iter().filter(there).collect();
        let fits: Vec<Fitted> = forms.par_iter().filter_map(|t| f.add(t, STARTS, &SLOW)).collect();
        f = fits.into_iter().min_by(|x, y| x.cost().total_cmp(&y.cost()))?;
    }
    Some(if f.fit.converged { f } else { f.carried_on() })
}
