//! One more effect: every mechanism sifted, the promising ones fitted out in every form they have.

use super::candidate::{Candidate, DETECT, DETECT_TOLERANCE, PENALTY, WHITE};
use super::search::{Search, Term};
use super::sift::HARD;
use crate::model::estimate::{Fit, Nuisance, Options, Problem};
use rayon::prelude::*;

/// Share of the best gain from which a candidate is fitted out.
const REFINED_SHARE: f64 = 0.25;
/// Mechanisms fitted in every form, and the share of the best gain within which they have to lie.
const FAMILIES: usize = 4;
const FAMILY_SHARE: f64 = 0.25;
/// Share of the best gain by which a form may lie above its mechanism's best after the first steps, to be taken on.
const BEHIND: f64 = 0.1;
/// Wander of the residual from which a form is extended.
const EXTENDED: f64 = 1.05;
/// Candidates whose base parameters others start from, where the best leaves more than noise.
const LENDERS: usize = 2;
/// Changes of the exponent from which the best candidates are fitted again.
const SHAKES: [f64; 3] = [-0.3, 0.0, 0.3];

impl Search<'_> {
    /// Best form of each mechanism, refined where it stands a chance.
    pub fn expand(&self, from: &Candidate, quick: &Options, starts: usize, keep: usize) -> Vec<Candidate> {
        let list = self.candidates();
        let first = self.screen(&from.make_up, &from.fit, &list, starts, quick);
        let sifted = first.clone();
        let mut best: Vec<(Term, Fit)> = Vec::new();
        for (t, f) in first {
            let cost = |t: &Term, f: &Fit| f.point.chi2 + PENALTY * t.form.parameters.len() as f64;
            match best.iter_mut().find(|b| b.0.mechanism.name == t.mechanism.name) {
                Some(b) if cost(&b.0, &b.1) <= cost(&t, &f) => {}
                Some(b) => *b = (t, f),
                None => best.push((t, f)),
            }
        }
        best.sort_by(|a, b| a.1.point.chi2.total_cmp(&b.1.point.chi2));
        let top = best.first().map_or(0.0, |b| from.fit.point.chi2 - b.1.point.chi2);
        if top < 0.5 * DETECT_TOLERANCE {
            return best.into_iter().map(|(t, f)| self.candidate(from, t, f)).collect();
        }
        // refine: what is among the best, and what is hard to fit and so may have been missed
        let mut rank = 0;
        let refine: Vec<(usize, usize)> = best
            .iter()
            .enumerate()
            .filter_map(|(i, (t, f))| {
                let gain = from.fit.point.chi2 - f.point.chi2;
                let is_hard = HARD.contains(&t.mechanism.name);
                if (rank < keep && (rank < 2 || gain > REFINED_SHARE * top))
                    || (is_hard && gain > 0.1 * top && keep > 3)
                {
                    rank += 1;
                    Some((i, if is_hard { 2 } else { 1 }))
                } else {
                    None
                }
            })
            .collect();
        let slow = Options { iterations: 60, ..Options::default() };
        let refined: Vec<(usize, Term, Fit)> = refine
            .into_par_iter()
            .filter_map(|(i, starts)| {
                let (t, f) = &best[i];
                // go on from where the quick fit stopped
                let mut next = from.make_up.clone();
                next.terms.push(t.clone());
                let m = self.model(&next, 1.0, 1.0, 0.0);
                let p = Problem::new(self.data, &m);
                let mut out = p.fit(f.point.clone(), &slow);
                if starts > 1 {
                    if let Some(g) = self.add(
                        &from.make_up,
                        &from.fit.point,
                        t,
                        starts + 1,
                        &Options { iterations: 18, ..Options::default() },
                    ) {
                        if g.point.chi2 < out.point.chi2 {
                            out = p.fit(g.point, &slow);
                        }
                    }
                }
                Some((i, t.clone(), out))
            })
            .collect();
        for (i, t, f) in refined {
            if f.point.chi2 <= best[i].1.point.chi2 {
                best[i] = (t, f);
            }
        }
        let mut v: Vec<Candidate> = best.into_iter().map(|(t, f)| self.candidate(from, t, f)).collect();
        v.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
        if keep > 3 {
            self.borrowed(from, &mut v, quick, &slow, starts);
            self.families(from, &mut v, &sifted, &slow);
        }
        v
    }

    /// Every mechanism sifted once more from where the best few have led the base parameters: a base that took up part of
    /// what is missing hides the rest of it. Only where the best leaves more than noise.
    fn borrowed(&self, from: &Candidate, v: &mut Vec<Candidate>, quick: &Options, slow: &Options, starts: usize) {
        let Some(best) = v.first().filter(|c| self.wander_of(c) > WHITE) else { return };
        let reach = best.fit.point.chi2 + BEHIND * (from.fit.point.chi2 - best.fit.point.chi2).max(0.0);
        let model = self.model(&from.make_up, 1.0, 1.0, 0.0);
        let problem = Problem::new(self.data, &model);
        let lent: Vec<Fit> = v
            .iter()
            .take(LENDERS)
            .map(|c| {
                let theta = c.fit.point.theta[..model.parameters.len()].to_vec();
                Fit { point: problem.evaluate(theta, c.fit.point.locals.clone()), ..from.fit.clone() }
            })
            .filter(|f| f.point.chi2.is_finite())
            .collect();
        let list = self.candidates();
        let mut promising: Vec<(Term, Fit)> = Vec::new();
        for (t, f) in lent.iter().flat_map(|f| self.screen(&from.make_up, f, &list, starts, quick)) {
            match promising.iter_mut().find(|p| p.0.mechanism.name == t.mechanism.name) {
                _ if f.point.chi2 > reach => {}
                Some(p) if p.1.point.chi2 <= f.point.chi2 => {}
                Some(p) => *p = (t, f),
                None => promising.push((t, f)),
            }
        }
        let fitted: Vec<Candidate> = promising
            .into_par_iter()
            .map(|(t, f)| {
                let mut next = from.make_up.clone();
                next.terms.push(t);
                let model = self.model(&next, 1.0, 1.0, 0.0);
                let fit = Problem::new(self.data, &model).fit(f.point, slow);
                Candidate { make_up: next, fit }
            })
            .collect();
        for c in fitted {
            match v.iter_mut().find(|had| had.names() == c.names()) {
                Some(had) if had.cost() <= c.cost() => {}
                Some(had) => *had = c,
                None => v.push(c),
            }
        }
        v.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    }

    /// The best few mechanisms in every form they have: which one describes best shows only when all are fitted out.
    fn families(&self, from: &Candidate, v: &mut [Candidate], sifted: &[(Term, Fit)], options: &Options) {
        let Some(best) = v.first().map(|c| c.cost()) else { return };
        let gain = from.fit.point.chi2 - best;
        let near: Vec<usize> =
            (0..v.len()).filter(|i| v[*i].cost() - best < (FAMILY_SHARE * gain).max(DETECT)).take(FAMILIES).collect();
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
                let mut next = from.make_up.clone();
                next.terms.push(t);
                let model = self.model(&next, 1.0, 1.0, 0.0);
                let ceiling = v[i].fit.point.chi2 + (BEHIND * gain).max(DETECT);
                let fit = Problem::new(self.data, &model).fit(start, &Options { ceiling, ..*options });
                Some((i, Candidate { make_up: next, fit }))
            })
            .collect();
        let mut forms: Vec<(usize, Candidate)> = near.iter().map(|i| (*i, v[*i].clone())).collect();
        forms.extend(fitted);
        for (i, c) in &forms {
            if c.cost() < v[*i].cost() {
                v[*i] = c.clone();
            }
        }
        let extended: Vec<(usize, Candidate)> = forms
            .par_iter()
            .filter(|(i, _)| self.wander_of(&v[*i]) > EXTENDED)
            .flat_map_iter(|(i, c)| {
                let ceiling = v[*i].fit.point.chi2 + (BEHIND * gain).max(DETECT);
                self.extended(c, &Options { ceiling, ..*options }).into_iter().map(|c| (*i, c))
            })
            .collect();
        for (i, c) in extended {
            if c.cost() < v[i].cost() {
                v[i] = c;
            }
        }
        let shaken: Vec<(usize, Candidate)> = near
            .into_par_iter()
            .flat_map_iter(|i| SHAKES.map(|d| (i, d)))
            .filter_map(|(i, d)| Some((i, self.shaken(&v[i], d, options)?)))
            .collect();
        for (i, c) in shaken {
            if c.cost() < v[i].cost() {
                v[i] = c;
            }
        }
        v.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
    }

    /// `c` with its last term in every form that extends the one it has, fitted from there.
    fn extended(&self, c: &Candidate, options: &Options) -> Vec<Candidate> {
        let Some(had) = c.make_up.terms.last() else { return Vec::new() };
        let mut out = Vec::new();
        for term in self.extensions(had.mechanism.name) {
            if term.form.extends != Some(had.form.label) {
                continue;
            }
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
        let mut locals = c.fit.point.locals.clone();
        for (r, local) in locals.iter_mut().enumerate() {
            for (l, n) in local.iter_mut().zip(sift.nuisances()) {
                if let (Nuisance::Stiffness, Some((mean, _))) = (n, self.data.prior(r, *n)) {
                    *l = mean;
                }
            }
        }
        let start = sift.evaluate(theta, locals);
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

    /// Named candidates with one more effect than `from`, best first.
    pub fn beside(&self, from: &Candidate, iterations: usize, starts: usize, keep: usize) -> Vec<Candidate> {
        let quick = Options { iterations, hopeless: 3.0, ..Options::default() };
        let mut v = self.expand(from, &quick, starts, keep);
        v.retain(|c| c.make_up.terms.iter().all(|t| t.mechanism.named));
        v
    }

    /// The best few named candidates with one more effect than `from`.
    pub fn further(&self, from: &Candidate, most: usize) -> Vec<Candidate> {
        let mut v = self.beside(from, 12, 2, 6);
        v.sort_by(|a, b| a.cost().total_cmp(&b.cost()));
        v.truncate(most);
        v
    }
}
