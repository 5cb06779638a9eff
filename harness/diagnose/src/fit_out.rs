//! Candidates fitted out: from the law that others have led to (warm starts), in every form of their mechanism, with
//! further parameters, and from perturbed restarts out of local minima.

use super::candidate::{Candidate, DETECT, WHITE_ALONE};
use super::search::Search;
use estimate::fitted::Fitted;
use estimate::problem::{Options, Problem};
use estimate::structure::Term;
use rayon::prelude::*;

/// Mechanisms fitted in every form, and the share of the best gain within which they have to lie.
const FAMILIES: usize = 4;
const FAMILY_SHARE: f64 = 0.25;
/// The same where the best leaves noise alone: forms of one mechanism differ by less.
const FAMILY_SHARE_WHITE: f64 = 0.1;
/// Share of the best gain by which a form may lie above its mechanism's best after the first steps, to be fitted on.
const BEHIND: f64 = 0.1;
/// The best few, which are fitted on where they leave more than noise.
const BEST: usize = 2;
/// Mechanisms that are fitted warm, from the base parameters of the best one.
const WARM: usize = 4;
/// Changes of the exponent from which the best candidates are fitted again.
const PERTURBATIONS: [f64; 3] = [-0.3, 0.0, 0.3];

/// Puts each candidate found in the place it was found for, where it is the better one.
fn keep_better(v: &mut [Fitted], found: Vec<(usize, Fitted)>) {
    for (i, c) in found {
        if c.cost() < v[i].cost() {
            v[i] = c;
        }
    }
}

impl Search {
    /// Warm starts: every mechanism sifted once more from the base parameters of the best, for a base that has absorbed
    /// part of what is missing hides the rest of it. Only where the best leaves more than noise. Names of what came out
    /// better, and all that was sifted.
    pub(super) fn warm_started(
        &self,
        from: &Fitted,
        v: &mut Vec<Fitted>,
        quick: &Options,
        slow: &Options,
        starts: usize,
    ) -> (Vec<&'static str>, Vec<Fitted>) {
        let Some(best) = v.first().filter(|c| !c.explains(from)) else { return (Vec::new(), Vec::new()) };
        let gain = (from.chi2() - best.chi2()).max(0.0);
        let reach = best.chi2() + BEHIND * gain;
        let problem = from.problem();
        let mut warm = from.clone();
        let theta = best.fit.point.theta[..problem.model.parameters.len()].to_vec();
        warm.fit.point = problem.evaluate(theta, best.fit.point.locals.clone());
        if !warm.chi2().is_finite() {
            return (Vec::new(), Vec::new());
        }
        let sifted = self.screen(&warm, &self.candidates(), starts, quick);
        let mut promising: Vec<&Fitted> = Vec::new();
        for f in sifted.iter().filter(|s| s.chi2() <= reach) {
            if promising.iter().all(|p| p.added() != f.added()) {
                promising.push(f);
            }
        }
        let fitted: Vec<Fitted> = promising
            .into_par_iter()
            .take(WARM)
            .map(|f| Fitted::from(&self.data, f.structure.clone(), f.fit.point.clone(), slow))
            .collect();
        let mut improved = Vec::new();
        for c in fitted {
            let name = c.added();
            match v.iter_mut().find(|had| had.names() == c.names()) {
                Some(had) if had.cost() <= c.cost() => continue,
                Some(had) => *had = c,
                None => v.push(c),
            }
            improved.push(name);
        }
        v.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
        (improved, sifted)
    }

    /// The best few mechanisms, of those asked for, in every form they have: which one describes best shows only when all
    /// are fitted out.
    pub(super) fn families(
        &self,
        from: &Fitted,
        v: &mut [Fitted],
        sifted: &[Fitted],
        options: &Options,
        asked: &dyn Fn(&str) -> bool,
    ) {
        let Some(best) = v.first().map(|c| c.cost()) else { return };
        let gain = from.chi2() - best;
        let named = |c: &Fitted| c.structure.last().is_some_and(|t| t.mechanism.named);
        // what stands in for the unknown absorbs some of everything: names are compared with the best name
        let best_named = v.iter().find(|c| named(c)).map_or(best, |c| c.cost());
        let is_white = v.first().is_some_and(|c| c.overdispersion() <= WHITE_ALONE);
        let share = if is_white { FAMILY_SHARE_WHITE } else { FAMILY_SHARE };
        let is_near = |c: &Fitted| {
            let best = if named(c) { best_named } else { best };
            c.cost() - best < (share * (from.chi2() - best)).max(DETECT)
        };
        let near = (0..v.len()).filter(|i| is_near(&v[*i])).take(FAMILIES);
        let near: Vec<usize> = near.filter(|i| asked(v[*i].added())).collect();
        let others: Vec<(usize, Term)> = near
            .iter()
            .flat_map(|i| {
                let i = *i;
                let had = &v[i].structure.terms()[from.structure.terms().len()];
                self.candidates()
                    .into_iter()
                    .filter(|t| {
                        t.name() == had.name()
                            && t.form.label != had.form.label
                            && from.structure.is_at_one_bond_with(t)
                    })
                    .map(move |t| (i, t))
                    .collect::<Vec<_>>()
            })
            .collect();
        let fitted: Vec<(usize, Fitted)> = others
            .into_par_iter()
            .filter_map(|(i, t)| {
                let in_that_form = |s: &&Fitted| {
                    s.structure
                        .last()
                        .is_some_and(|u| u.name() == t.name() && u.form.label == t.form.label && u.bond == t.bond)
                };
                let quick = Options { iterations: 12, ..Options::default() };
                let start = match sifted.iter().find(in_that_form) {
                    Some(f) => f.fit.point.clone(),
                    None => from.add(&t, 2, &quick)?.fit.point,
                };
                let ceiling = v[i].chi2() + (BEHIND * gain).max(DETECT);
                Some((i, from.with(t, start, &Options { ceiling, ..*options })))
            })
            .collect();
        let mut forms: Vec<(usize, Fitted)> = near.iter().map(|i| (*i, v[*i].clone())).collect();
        forms.extend(fitted);
        keep_better(v, forms.clone());
        // an extended form that is the best so far may itself be extended
        while !forms.is_empty() {
            let coloured: Vec<usize> = near.iter().copied().filter(|i| v[*i].overdispersion() > WHITE_ALONE).collect();
            let extended: Vec<(usize, Fitted)> = forms
                .par_iter()
                .filter(|(i, _)| coloured.contains(i))
                .flat_map_iter(|(i, c)| {
                    let ceiling = v[*i].chi2() + (BEHIND * gain).max(DETECT);
                    extended_forms(c, &Options { ceiling, ..*options }).into_iter().map(|c| (*i, c))
                })
                .collect();
            let before: Vec<f64> = v.iter().map(|c| c.cost()).collect();
            keep_better(v, extended);
            let bettered = near.iter().filter(|i| v[**i].cost() < before[**i]);
            forms = bettered.map(|i| (*i, v[*i].clone())).collect();
        }
        let is_behind = |c: &Fitted| c.cost() - best > (BEHIND * gain).max(DETECT);
        let restarted: Vec<(usize, Fitted)> = near
            .into_par_iter()
            .filter(|i| !is_behind(&v[*i]))
            .flat_map_iter(|i| PERTURBATIONS.map(|d| (i, d)))
            .filter_map(|(i, d)| Some((i, restarted_from(&v[i], d, options)?)))
            .collect();
        keep_better(v, restarted);
        v.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    }

    /// The best few fitted on until they have converged: bounces make valleys that are long, and what has not come to
    /// their end leaves more than its form does.
    pub(super) fn carry_on(&self, v: &mut [Fitted]) {
        let unfinished = |c: &Fitted| !c.fit.converged && c.overdispersion() > WHITE_ALONE;
        let few: Vec<(usize, &Fitted)> = v.iter().enumerate().take(BEST).filter(|(_, c)| unfinished(c)).collect();
        let found: Vec<(usize, Fitted)> = few.into_par_iter().map(|(i, c)| (i, c.carried_on())).collect();
        keep_better(v, found);
        v.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    }
}

/// `c` with its last term in every form that extends the one it has, fitted from there.
fn extended_forms(c: &Fitted, options: &Options) -> Vec<Fitted> {
    let Some(had) = c.structure.last() else { return Vec::new() };
    let mut out = Vec::new();
    for term in c.structure.base().extensions(had) {
        let starts = term.form.starts.clone();
        let next = c.structure.with_last(term);
        let problem = Problem::new(&c.data, next.model());
        for further in starts {
            let start = problem.evaluate([c.fit.point.theta.clone(), further].concat(), c.fit.point.locals.clone());
            if start.chi2.is_finite() {
                out.push(Fitted::from(&c.data, next.clone(), start, options));
            }
        }
    }
    out
}

/// A perturbed restart: a candidate fitted again from another exponent at the same force and from tolerances and scatter of
/// zero, for the ridge of stiffness and exponent holds local minima. None where that leads no lower.
fn restarted_from(c: &Fitted, by: f64, options: &Options) -> Option<Fitted> {
    let model = c.structure.model();
    let coarse = c.data.coarse();
    let sift = Problem::new(&coarse, model);
    let mut theta = c.fit.point.theta.clone();
    if !c.structure.bend(&mut theta, by) {
        return None;
    }
    for (t, q) in theta.iter_mut().zip(&model.parameters) {
        if let Some((mean, _)) = q.prior {
            *t = mean;
        }
    }
    let start = sift.evaluate(theta, c.data.without_scatter(&c.fit.point.locals));
    let quick = sift.fit(start, &Options { iterations: 14, ..Options::default() });
    // it has to have come near at least
    let near = c.chi2() + DETECT + 0.02 * (quick.objective[0] - c.chi2()).max(0.0);
    if !quick.point.chi2.is_finite() || quick.point.chi2 > near {
        return None;
    }
    let start = c.problem().evaluate(quick.point.theta, quick.point.locals);
    let found = Fitted::from(&c.data, c.structure.clone(), start, options);
    (found.chi2() < c.chi2()).then_some(found)
}
