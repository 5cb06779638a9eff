//! Candidates fitted out: from the law that others have led to, in every form of their mechanism, with further parameters,
//! and shaken out of false bottoms.

use super::candidate::{Candidate, DETECT, WHITE};
use super::search::{Search, Term};
use estimate::problem::{Fit, Options, Problem};
use rayon::prelude::*;

/// Mechanisms fitted in every form, and the share of the best gain within which they have to lie.
const FAMILIES: usize = 4;
const FAMILY_SHARE: f64 = 0.25;
/// Share of the best gain by which a form may lie above its mechanism's best after the first steps, to be taken on.
const BEHIND: f64 = 0.1;
/// Wander of the residual from which a form is extended.
const EXTENDED: f64 = 1.05;
/// Share of the base's wander from which what the best leaves is more than a form that is not quite the one present.
const LEFT: f64 = 0.05;
/// The best few, which are taken on, and whose base parameters others start from, where the best leaves more than noise.
const BEST: usize = 2;
/// Changes of the exponent from which the best candidates are fitted again.
const SHAKES: [f64; 3] = [-0.3, 0.0, 0.3];

/// Puts each candidate found in the place it was found for, where it is the better one.
fn keep_better(v: &mut [Candidate], found: Vec<(usize, Candidate)>) {
    for (i, c) in found {
        if c.cost() < v[i].cost() {
            v[i] = c;
        }
    }
}

impl Search<'_> {
    /// Every mechanism sifted once more from where the best few have led the base parameters: a base that took up part of
    /// what is missing hides the rest of it. Only where the best leaves more than noise. Names of what came out better,
    /// and all that was sifted.
    pub(super) fn borrowed(
        &self,
        from: &Candidate,
        v: &mut Vec<Candidate>,
        quick: &Options,
        slow: &Options,
        starts: usize,
    ) -> (Vec<&'static str>, Vec<(Term, Fit)>) {
        let restless = |c: &&Candidate| {
            let wander = self.wander_of(c);
            wander > WHITE && wander - 1.0 > LEFT * (self.wander_of(from) - 1.0)
        };
        let Some(best) = v.first().filter(restless) else { return (Vec::new(), Vec::new()) };
        let gain = (from.fit.point.chi2 - best.fit.point.chi2).max(0.0);
        let reach = best.fit.point.chi2 + BEHIND * gain;
        let model = self.model(&from.make_up, 1.0, 1.0, 0.0);
        let problem = Problem::new(self.data, &model);
        let lent: Vec<Fit> = v
            .iter()
            .take(BEST)
            .map(|c| {
                let theta = c.fit.point.theta[..model.parameters.len()].to_vec();
                Fit { point: problem.evaluate(theta, c.fit.point.locals.clone()), ..from.fit.clone() }
            })
            .filter(|f| f.point.chi2.is_finite())
            .collect();
        let list = self.candidates();
        let mut sifted: Vec<(Term, Fit)> =
            lent.iter().flat_map(|f| self.screen(&from.make_up, f, &list, starts, quick)).collect();
        sifted.sort_by(|a, b| a.1.point.chi2.total_cmp(&b.1.point.chi2));
        let mut promising: Vec<(Term, Fit)> = Vec::new();
        for (t, f) in sifted.iter().filter(|s| s.1.point.chi2 <= reach) {
            if promising.iter().all(|p| p.0.mechanism.name != t.mechanism.name) {
                promising.push((t.clone(), f.clone()));
            }
        }
        let fitted: Vec<Candidate> =
            promising.into_par_iter().map(|(t, f)| self.fitted(from, t, f.point, slow)).collect();
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
        from: &Candidate,
        v: &mut [Candidate],
        sifted: &[(Term, Fit)],
        options: &Options,
        asked: &dyn Fn(&str) -> bool,
    ) {
        let Some(best) = v.first().map(|c| c.cost()) else { return };
        let gain = from.fit.point.chi2 - best;
        let named = |c: &Candidate| c.make_up.terms.last().is_some_and(|t| t.mechanism.named);
        // what stands in for the unknown takes up some of everything: names are held against the best name
        let best_named = v.iter().find(|c| named(c)).map_or(best, |c| c.cost());
        let is_near = |c: &Candidate| {
            let best = if named(c) { best_named } else { best };
            c.cost() - best < (FAMILY_SHARE * (from.fit.point.chi2 - best)).max(DETECT)
        };
        let near = (0..v.len()).filter(|i| is_near(&v[*i])).take(FAMILIES);
        let near: Vec<usize> = near.filter(|i| asked(v[*i].added())).collect();
        let others: Vec<(usize, Term)> = near
            .iter()
            .flat_map(|i| {
                let i = *i;
                let had = &v[i].make_up.terms[from.make_up.terms.len()];
                self.candidates()
                    .into_iter()
                    .filter(|t| t.mechanism.name == had.mechanism.name && t.form.label != had.form.label)
                    .map(move |t| (i, t))
                    .collect::<Vec<_>>()
            })
            .collect();
        let fitted: Vec<(usize, Candidate)> = others
            .into_par_iter()
            .filter_map(|(i, t)| {
                let before =
                    sifted.iter().find(|s| s.0.mechanism.name == t.mechanism.name && s.0.form.label == t.form.label);
                let quick = Options { iterations: 12, ..Options::default() };
                let start = match before {
                    Some((_, f)) => f.point.clone(),
                    None => self.add(&from.make_up, &from.fit.point, &t, 2, &quick)?.point,
                };
                let ceiling = v[i].fit.point.chi2 + (BEHIND * gain).max(DETECT);
                Some((i, self.fitted(from, t, start, &Options { ceiling, ..*options })))
            })
            .collect();
        let mut forms: Vec<(usize, Candidate)> = near.iter().map(|i| (*i, v[*i].clone())).collect();
        forms.extend(fitted);
        keep_better(v, forms.clone());
        let restless: Vec<usize> = near.iter().copied().filter(|i| self.wander_of(&v[*i]) > EXTENDED).collect();
        let extended: Vec<(usize, Candidate)> = forms
            .par_iter()
            .filter(|(i, _)| restless.contains(i))
            .flat_map_iter(|(i, c)| {
                let ceiling = v[*i].fit.point.chi2 + (BEHIND * gain).max(DETECT);
                self.extended(c, &Options { ceiling, ..*options }).into_iter().map(|c| (*i, c))
            })
            .collect();
        keep_better(v, extended);
        let shaken: Vec<(usize, Candidate)> = near
            .into_par_iter()
            .flat_map_iter(|i| SHAKES.map(|d| (i, d)))
            .filter_map(|(i, d)| Some((i, self.shaken(&v[i], d, options)?)))
            .collect();
        keep_better(v, shaken);
        v.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    }

    /// The best few taken on until they have converged: bounces make valleys that are long, and what has not come to their
    /// end leaves more than its form does.
    pub(super) fn take_on(&self, v: &mut [Candidate]) {
        let restless = |c: &Candidate| !c.fit.converged && self.wander_of(c) > EXTENDED;
        let few: Vec<(usize, &Candidate)> = v.iter().enumerate().take(BEST).filter(|(_, c)| restless(c)).collect();
        let found: Vec<(usize, Candidate)> = few.into_par_iter().map(|(i, c)| (i, self.taken_on(c))).collect();
        keep_better(v, found);
        v.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    }

    /// `c` with its last term in every form that extends the one it has, fitted from there.
    fn extended(&self, c: &Candidate, options: &Options) -> Vec<Candidate> {
        let Some(had) = c.make_up.terms.last() else { return Vec::new() };
        let mut out = Vec::new();
        for term in self.extensions(had) {
            let starts = term.form.starts.clone();
            let mut next = c.make_up.clone();
            *next.terms.last_mut().expect("there is one") = term;
            let model = self.model(&next, 1.0, 1.0, 0.0);
            let problem = Problem::new(self.data, &model);
            for further in starts {
                let start = problem.evaluate([c.fit.point.theta.clone(), further].concat(), c.fit.point.locals.clone());
                if start.chi2.is_finite() {
                    out.push(Candidate { make_up: next.clone(), fit: problem.fit(start, options) });
                }
            }
        }
        out
    }

    /// A candidate fitted again from another exponent at the same force and from tolerances and scatter of zero: the
    /// ridge of stiffness and exponent holds false bottoms. None where that leads no lower.
    fn shaken(&self, c: &Candidate, by: f64, options: &Options) -> Option<Candidate> {
        let model = self.model(&c.make_up, 1.0, 1.0, 0.0);
        let coarse = self.data.coarse();
        let sift = Problem::new(&coarse, &model);
        let mut theta = c.fit.point.theta.clone();
        let q = &model.parameters[1];
        theta[1] = (theta[1] + by).clamp(q.lower + 0.05, q.upper - 0.05);
        for (t, q) in theta.iter_mut().zip(&model.parameters) {
            if let Some((mean, _)) = q.prior {
                *t = mean;
            }
        }
        let start = sift.evaluate(theta, self.without_scatter(&c.fit.point.locals));
        let quick = sift.fit(start, &Options { iterations: 14, ..Options::default() });
        // it has to have come near at least
        let near = c.fit.point.chi2 + DETECT + 0.02 * (quick.objective[0] - c.fit.point.chi2).max(0.0);
        if !quick.point.chi2.is_finite() || quick.point.chi2 > near {
            return None;
        }
        let fine = Problem::new(self.data, &model);
        let start = fine.evaluate(quick.point.theta, quick.point.locals);
        let fit = fine.fit(start, options);
        (fit.point.chi2 < c.fit.point.chi2).then(|| Candidate { make_up: c.make_up.clone(), fit })
    }
}
