//! One more effect: every mechanism sifted, the promising ones fitted.

use super::candidate::{least_beside, Candidate, DETECT_TOLERANCE, PENALTY};
use super::search::Search;
use estimate::fitted::Fitted;
use estimate::problem::{Options, Point};
use estimate::structure::Term;
use rayon::prelude::*;

/// Share of the best gain from which a candidate is fitted out, and from which one is that is strongly nonlinear.
const REFINED_SHARE: f64 = 0.25;
const NONLINEAR_SHARE: f64 = 0.1;
/// The same for a fit that has converged already, and for every one where the best explains what there is: what is to
/// stand beside that has to come near it.
const RIVAL_SHARE: f64 = 0.75;

/// How every mechanism is fitted at first.
pub(super) const QUICK: Options = Options { iterations: 12, tolerance: 1e-5, hopeless: 2.0, ceiling: f64::INFINITY };
/// How a fit goes on that is worth it.
pub(super) const SLOW: Options = Options { iterations: 60, tolerance: 1e-5, hopeless: 0.0, ceiling: f64::INFINITY };

/// The term that a candidate of this search has been given.
fn added(f: &Fitted) -> &Term {
    f.structure.last().expect("one has been added")
}

impl Search {
    /// Best form of each mechanism, refined where it stands a chance.
    pub fn expand(&self, from: &Fitted, quick: &Options, starts: usize, keep: usize) -> Vec<Fitted> {
        let list = self.candidates();
        let sifted = self.screen(from, &list, starts, quick);
        let mut best: Vec<Fitted> = Vec::new();
        for f in sifted.iter().cloned() {
            let cost = |f: &Fitted| f.chi2() + PENALTY * added(f).form.parameters.len() as f64;
            match best.iter_mut().find(|b| b.added() == f.added()) {
                Some(b) if cost(b) <= cost(&f) => {}
                Some(b) => *b = f,
                None => best.push(f),
            }
        }
        best.sort_by(|a, b| a.chi2().total_cmp(&b.chi2()));
        let top = best.first().map_or(0.0, |b| from.chi2() - b.chi2());
        if top < DETECT_TOLERANCE {
            return best;
        }
        // refine: what is among the best, and what is strongly nonlinear and so may have been missed
        let is_explained = best.first().is_some_and(|b| b.explains(from));
        let least = |share: f64| if is_explained { least_beside(top, RIVAL_SHARE) } else { share * top };
        let mut rank = 0;
        let refine: Vec<(usize, usize)> = best
            .iter()
            .enumerate()
            .filter_map(|(i, f)| {
                let gain = from.chi2() - f.chi2();
                let is_nonlinear = added(f).mechanism.hints.strongly_nonlinear;
                if (rank < keep
                    && (rank < 2 || gain > least(REFINED_SHARE) && (!f.fit.converged || gain > RIVAL_SHARE * top)))
                    || (is_nonlinear && gain > least(NONLINEAR_SHARE) && keep > 3)
                {
                    rank += 1;
                    Some((i, if is_nonlinear { 2 } else { 1 }))
                } else {
                    None
                }
            })
            .collect();
        let refined: Vec<(usize, Fitted)> = refine
            .into_par_iter()
            .map(|(i, starts)| {
                let term = added(&best[i]);
                // go on from where the quick fit stopped
                let slowly = |start: &Point| from.with(term.clone(), start.clone(), &SLOW);
                let mut out = slowly(best[i].point());
                if starts > 1 {
                    let other = from.add(term, starts + 1, &Options { iterations: 18, ..Options::default() });
                    if let Some(g) = other.filter(|g| g.chi2() < out.chi2()) {
                        out = slowly(g.point());
                    }
                }
                (i, out)
            })
            .collect();
        for (i, f) in refined {
            if f.chi2() <= best[i].chi2() {
                best[i] = f;
            }
        }
        let mut v = best;
        v.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
        if keep > 3 {
            self.families(from, &mut v, &sifted, &SLOW, &|_| true);
        }
        v
    }

    /// `v`, one more effect beside `from`, best first, once more from where the best has led, and carried on.
    pub fn expand_further(&self, from: &Fitted, v: &mut Vec<Fitted>) {
        let (improved, sifted) = self.warm_started(from, v, &QUICK, &SLOW, 2);
        self.families(from, v, &sifted, &SLOW, &|name| improved.contains(&name));
        self.carry_on(v);
    }

    /// Named candidates with one more effect than `from`, best first.
    pub fn beside(&self, from: &Fitted, iterations: usize, starts: usize, keep: usize) -> Vec<Fitted> {
        let quick = Options { iterations, hopeless: 3.0, ..Options::default() };
        let mut v = self.expand(from, &quick, starts, keep);
        v.retain(Fitted::is_named);
        v
    }
}
