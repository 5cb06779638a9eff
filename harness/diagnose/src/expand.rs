//! One more effect: every mechanism sifted, the promising ones fitted.

use super::candidate::{Candidate, DETECT_TOLERANCE, PENALTY};
use super::search::{Search, Term};
use super::sift::HARD;
use estimate::problem::{Fit, Options, Point};
use rayon::prelude::*;

/// Share of the best gain from which a candidate is fitted out.
const REFINED_SHARE: f64 = 0.25;

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
                let slowly = |start: &Point| self.fitted(from, t.clone(), start.clone(), &slow).fit;
                let mut out = slowly(&f.point);
                if starts > 1 {
                    if let Some(g) = self.add(
                        &from.make_up,
                        &from.fit.point,
                        t,
                        starts + 1,
                        &Options { iterations: 18, ..Options::default() },
                    ) {
                        if g.point.chi2 < out.point.chi2 {
                            out = slowly(&g.point);
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
            self.families(from, &mut v, &sifted, &slow, &|_| true);
            let (improved, sifted) = self.borrowed(from, &mut v, quick, &slow, starts);
            self.families(from, &mut v, &sifted, &slow, &|name| improved.contains(&name));
            self.take_on(&mut v);
        }
        v
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
