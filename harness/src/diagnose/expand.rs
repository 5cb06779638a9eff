//! One more effect: every mechanism sifted, the promising ones fitted out in every form they have.

use super::candidate::{Candidate, DETECT, DETECT_TOLERANCE, PENALTY};
use super::search::{Search, Term};
use super::sift::HARD;
use crate::model::estimate::{Fit, Options, Problem};
use rayon::prelude::*;

/// Share of the best gain from which a candidate is fitted out.
const REFINED_SHARE: f64 = 0.25;
/// Mechanisms fitted in every form, and the share of the best gain within which they have to lie.
const FAMILIES: usize = 4;
const FAMILY_SHARE: f64 = 0.25;
/// Share of the best gain by which a form may lie above its mechanism's best after the first steps, to be taken on.
const BEHIND: f64 = 0.1;
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
            self.families(from, &mut v, &sifted, &slow);
        }
        v
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
        for (i, c) in fitted {
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

    /// A candidate fitted again from another exponent at the same force and from tolerances of zero: the ridge of
    /// stiffness and exponent holds false bottoms. None where that leads no lower.
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
        let start = sift.evaluate(theta, c.fit.point.locals.clone());
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
