//! Which structures are weighed: mechanisms added one at a time beside what is likeliest, for as long as that leaves more than
//! noise. What is not worth trying is left out here; what is believed is for the posterior to say.

use super::candidate::{Candidate, DETECT_TOLERANCE, WHITE_ALONE};
use super::evidence::{unknown, weighed, Evidences, Weighed};
use super::expand::{QUICK, SLOW};
use super::posterior::{Posterior, POSSIBLE};
use super::search::Search;
use super::table::Table;
use estimate::fitted::Fitted;
use estimate::problem::{Options, Problem};
use estimate::structure::Term;
use rayon::prelude::*;

/// Fall of chi^2, and share of it, from which a base that had stalled is searched beside once more.
const STALLED: f64 = 100.0;
const STALLED_SHARE: f64 = 0.02;
/// Structures of one mechanism that are weighed.
const SINGLES: usize = 8;
/// Gain of one mechanism that leaves noise alone from which nothing is sought beside it.
const FAINT: f64 = 3000.0;
/// First mechanisms beside which a second is sought, and seconds weighed beside each.
const FIRSTS: usize = 2;
const SECONDS: usize = 4;
/// Overdispersion of what a pair leaves from which either of its mechanisms is exchanged for what does better beside the
/// other, and rounds of that.
const EXCHANGED: f64 = 1.1;
const EXCHANGES: usize = 2;
/// Overdispersion of what several leave from which another is sought, how many are weighed, and mechanisms at most.
const FURTHER: f64 = 3.0;
const OTHERS: usize = 5;
const MOST: usize = 3;

/// Starts from which a term is fitted beside a structure that ended better than the two together, as well as from where it was; the
/// best fit counts, so that more cost time alone.
const STARTS_WITHIN: usize = 3;

/// Nats that a fit whose structure is possible may still gain; more, and it is carried on.
pub const PENDING: f64 = 1.0;

/// chi^2 within which two fits of one structure are the same fit.
const SAME: f64 = 0.5;

/// The structures tried, each with its evidence.
pub struct Pool {
    /// The simulation as given first; in the order of the structures in `evidence`.
    pub fits: Vec<Fitted>,
    pub evidence: Evidences,
    /// Single mechanisms, best form each, best first.
    pub singles: Vec<Fitted>,
    /// What turns evidence into probabilities.
    pub table: Table,
    /// Forms of the structures beside which further mechanisms have been sought.
    searched: Vec<Vec<(&'static str, &'static str)>>,
}

/// Mechanisms and forms of a structure, sorted.
type Forms = Vec<(&'static str, &'static str)>;

fn sorted_forms(f: &Fitted) -> Forms {
    let mut forms = f.structure.forms();
    forms.sort_unstable();
    forms
}

/// The one term that `whole` has beside those of `part`; None where it has others, or not all of them.
fn only_more(part: &Fitted, whole: &Fitted) -> Option<Term> {
    let (few, many) = (part.structure.terms(), whole.structure.terms());
    if many.len() != few.len() + 1 {
        return None;
    }
    let is_same = |t: &Term, u: &Term| (t.name(), t.form.label, t.bond) == (u.name(), u.form.label, u.bond);
    let mut more = many.iter().filter(|t| !few.iter().any(|u| is_same(t, u)));
    more.next().filter(|_| more.next().is_none()).cloned()
}

/// `whole`, which is `part` and `term`, fitted from where `part` ended: with the term as it was, and from its own starts, which a
/// form that extends another has not.
fn from_within(part: &Fitted, whole: &Fitted, term: &Term) -> Option<Fitted> {
    let i = whole.structure.terms().iter().position(|t| t.name() == term.name())?;
    let values = &whole.point().theta[whole.structure.values_of(i)];
    let theta = [&part.point().theta[..], values].concat();
    let structure = part.structure.with(term.clone());
    let start = Problem::new(&part.data, structure.model()).evaluate(theta, part.point().locals.clone());
    let as_it_was = start.chi2.is_finite().then(|| Fitted::from(&part.data, structure, start, &SLOW));
    let stands_alone = term.form.extends.is_none();
    let anew = if stands_alone { part.add(term, STARTS_WITHIN, &SLOW) } else { None };
    as_it_was.into_iter().chain(anew).min_by(|a, b| a.chi2().total_cmp(&b.chi2()))
}

impl Pool {
    fn new(base: &Fitted, singles: Vec<Fitted>) -> Pool {
        // the simulation as given has its place even where its evidence cannot be worked out
        let given = weighed(base).unwrap_or_else(|| Weighed::without_evidence(base));
        let evidence = Evidences { structures: vec![given], ..Evidences::of(base) };
        let mut pool = Pool {
            fits: vec![base.clone()],
            evidence,
            singles: Vec::new(),
            table: Table::calibrated(),
            searched: Vec::new(),
        };
        pool.take_singles(singles);
        pool
    }

    /// Weighs the best of `singles`, those that do no worse than the simulation as given.
    fn take_singles(&mut self, mut singles: Vec<Fitted>) {
        singles.retain(|c| c.chi2() <= self.fits[0].chi2() + 1.0);
        let calibrations = singles.iter().skip(SINGLES).filter(|s| s.calibrates());
        self.take(singles.iter().take(SINGLES).chain(calibrations).cloned().collect());
        self.singles = singles;
    }

    /// Whether one cause alone makes up the credible set, and it is not an unknown one.
    fn is_settled(&self) -> bool {
        matches!(self.posterior().credible_set(), [one] if !one.is_unknown())
    }

    /// Weighs `fits` and keeps them; of one structure the better fit.
    fn take(&mut self, fits: Vec<Fitted>) {
        let mut new: Vec<Fitted> = Vec::new();
        for f in fits {
            let is_known = |g: &Fitted| sorted_forms(g) == sorted_forms(&f) && g.chi2() <= f.chi2() + SAME;
            if !self.fits.iter().chain(&new).any(is_known) {
                new.push(f);
            }
        }
        let weighed: Vec<_> = new.into_par_iter().filter_map(|f| weighed(&f).map(|w| (f, w))).collect();
        for (f, w) in weighed {
            match self.fits.iter().position(|g| sorted_forms(g) == sorted_forms(&f)) {
                Some(i) => (self.fits[i], self.evidence.structures[i]) = (f, w),
                None => {
                    self.fits.push(f);
                    self.evidence.structures.push(w);
                }
            }
        }
    }

    /// What the structures tried so far come to.
    pub fn posterior(&self) -> Posterior {
        Posterior::new(&self.evidence, &self.table)
    }

    /// The likeliest structures with `count` mechanisms of the vocabulary, one for each set of names, the likeliest
    /// first, as long as they are possible beside that.
    fn likeliest(&self, count: usize) -> Vec<Fitted> {
        let causes = self.posterior().causes;
        let of = causes.iter().filter(|c| !c.is_unknown() && c.names.len() == count);
        let most = of.clone().next().map_or(0.0, |c| c.probability);
        let of = of.filter(|c| c.probability > POSSIBLE * most).filter_map(|c| c.structure);
        of.map(|i| self.fits[i].clone()).collect()
    }

    /// Carries on the fits of what is possible that have not come to their end. Where that leads no lower, what their
    /// linearised equations foretell is not there.
    fn come_to_their_ends(&mut self) {
        let mut tried: Vec<usize> = Vec::new();
        loop {
            let causes = self.posterior().causes;
            let possible = causes.iter().filter(|c| c.probability > POSSIBLE).filter_map(|c| c.structure);
            let unfinished = |i: &usize| self.evidence.structures[*i].pending > PENDING && !tried.contains(i);
            let few: Vec<usize> = possible.filter(unfinished).collect();
            if few.is_empty() {
                return;
            }
            tried.extend(&few);
            self.take(few.par_iter().map(|i| self.fits[*i].to_its_end()).collect());
            few.iter().for_each(|i| self.evidence.structures[*i].forgo_pending(PENDING));
        }
    }

    /// Fits once more what is worse than a structure that it contains: it holds that one's point.
    fn mend_what_contains_better(&mut self) {
        let mut tried: Vec<(Forms, Forms)> = Vec::new();
        for _ in 0..MOST {
            let mut worse: Vec<(usize, usize, Term)> = Vec::new();
            for (b, whole) in self.fits.iter().enumerate() {
                let contained = (0..self.fits.len()).filter_map(|a| Some((a, only_more(&self.fits[a], whole)?)));
                let least = contained.min_by(|x, y| self.fits[x.0].chi2().total_cmp(&self.fits[y.0].chi2()));
                let is_worse = |(a, _): &(usize, Term)| self.fits[*a].chi2() < whole.chi2() - SAME;
                worse.extend(least.filter(is_worse).map(|(a, term)| (a, b, term)));
            }
            let pair = |(a, b, _): &(usize, usize, Term)| (sorted_forms(&self.fits[*a]), sorted_forms(&self.fits[*b]));
            worse.retain(|w| !tried.contains(&pair(w)));
            if worse.is_empty() {
                return;
            }
            tried.extend(worse.iter().map(pair));
            let again = |(a, b, term): &(usize, usize, Term)| from_within(&self.fits[*a], &self.fits[*b], term);
            self.take(worse.par_iter().filter_map(again).collect());
        }
    }

    /// Fall of chi^2 by the best structure tried.
    pub fn gain(&self) -> f64 {
        let best = self.fits.iter().map(|f| f.chi2()).fold(f64::INFINITY, f64::min);
        self.fits.first().map_or(0.0, |base| (base.chi2() - best).max(0.0))
    }
}

impl Search {
    /// A better base: nothing added, started from where a candidate had led the base's parameters.
    fn polish(&self, base: &mut Fitted, singles: &[Fitted]) {
        let g = base.structure.model().parameters.len();
        for c in singles.iter().take(3) {
            let start = base.problem().evaluate(c.fit.point.theta[..g].to_vec(), c.fit.point.locals.clone());
            let f = base.problem().fit(start, &Options::default());
            if f.point.chi2 < base.chi2() - 1.0 {
                base.fit = f;
            }
        }
    }

    /// Every mechanism beside `base`, best form each, best first; `base` fitted better where they have led to that.
    fn singles(&self, base: &mut Fitted) -> Vec<Fitted> {
        let mut singles = self.expand(base, &QUICK, 2, 6);
        let before = base.chi2();
        self.polish(base, &singles);
        if base.chi2() < before - STALLED.max(STALLED_SHARE * before) {
            // what was compared with a base that had stalled says nothing
            singles = self.expand(base, &QUICK, 2, 6);
            self.polish(base, &singles);
        }
        singles
    }

    /// The structures that may be behind the recordings, weighed, each of those that are possible fitted to its end.
    pub fn propose(&self, base: Fitted) -> Pool {
        let mut pool = self.tried(base);
        pool.mend_what_contains_better();
        pool.come_to_their_ends();
        pool
    }

    /// The structures that may be behind the recordings, weighed.
    fn tried(&self, mut base: Fitted) -> Pool {
        let singles = self.singles(&mut base);
        let mut pool = Pool::new(&base, singles);
        let alone = pool.likeliest(1);
        let beside = [Some(&base), alone.first()];
        pool.evidence.unknown = beside.into_iter().flatten().flat_map(unknown).collect();
        if !pool.is_settled() {
            let mut singles = std::mem::take(&mut pool.singles);
            self.expand_further(&base, &mut singles);
            pool.take_singles(singles);
        }
        let alone = pool.likeliest(1);
        let flat = pool.evidence.flat;
        let limited = pool.singles.iter().find(|c| flat > 0.0 && c.structure.has(|h| h.limits_reading)).cloned();
        let nothing = pool.posterior().causes.first().is_none_or(|c| c.names.is_empty());
        match (limited, alone.first()) {
            // what shows in the readings without any fit comes first
            (Some(first), _) => {
                self.seek_beside(&first, &mut pool, 2, 6);
            }
            (None, Some(first))
                if !nothing && (!is_explained(&base, first) || self.promise(first) >= DETECT_TOLERANCE) =>
            {
                self.pairs(&mut pool, &alone);
                self.further(&mut pool);
            }
            _ => return pool,
        }
        self.without_each(&base, &mut pool);
        // one of several that was not seen to do so much alone may do it, and more beside it
        let likeliest = pool.posterior().causes.into_iter().next().filter(|c| c.names.len() == 1 && !c.is_unknown());
        let first = likeliest.and_then(|c| c.structure).map(|i| pool.fits[i].clone());
        if first.is_some_and(|f| !is_explained(&base, &f) && self.seek_beside(&f, &mut pool, 1, 3)) {
            self.without_each(&base, &mut pool);
        }
        pool
    }

    /// The likeliest of several mechanisms without each of them in turn.
    fn without_each(&self, base: &Fitted, pool: &mut Pool) {
        for f in [2, 3].into_iter().flat_map(|count| pool.likeliest(count).into_iter().take(1)).collect::<Vec<_>>() {
            let each = 0..f.structure.terms().len();
            let from = |i: usize| [f.without(i, &SLOW), f.without_from(base, i, &SLOW)];
            pool.take(each.into_par_iter().flat_map_iter(from).flatten().collect());
        }
    }

    /// Weighs the best few with a further mechanism beside `first`, each fitted from so many `starts`, the best `keep` of them
    /// refined. False, and nothing is done, where that was sought before.
    fn seek_beside(&self, first: &Fitted, pool: &mut Pool, starts: usize, keep: usize) -> bool {
        let forms = sorted_forms(first);
        if pool.searched.contains(&forms) {
            return false;
        }
        pool.searched.push(forms);
        pool.take(self.beside(first, 9, starts, keep).into_iter().take(SECONDS).collect());
        true
    }

    /// A second mechanism beside the likeliest few, and what makes the best of them better.
    fn pairs(&self, pool: &mut Pool, alone: &[Fitted]) {
        let firsts = alone.iter().take(FIRSTS).cloned().chain(self.plainer(&pool.fits[0], &alone[0]));
        for first in firsts.collect::<Vec<_>>() {
            self.seek_beside(&first, pool, 1, 3);
        }
        self.exchanges(pool);
        self.forms_of_pairs(pool);
    }

    /// Each of the likeliest pair exchanged for what does better beside the other, as long as that leads on and leaves more
    /// than noise.
    fn exchanges(&self, pool: &mut Pool) {
        for _ in 0..EXCHANGES {
            let Some(pair) = pool.likeliest(2).into_iter().next() else { return };
            let is_possible = pool.posterior().of_several() >= POSSIBLE;
            if !is_possible || pair.overdispersion() < EXCHANGED {
                return;
            }
            for i in 0..pair.structure.terms().len() {
                let Some(kept) = pair.without(i, &SLOW) else { continue };
                self.seek_beside(&kept, pool, 1, 3);
            }
            if pool.likeliest(2).first().is_some_and(|p| p.names() == pair.names()) {
                return;
            }
        }
    }

    /// The likeliest pair, and the pair of least cost, with each mechanism in every form it has, as long as they leave more
    /// than noise: what a wrong form of one leaves looks like nothing of the other.
    fn forms_of_pairs(&self, pool: &mut Pool) {
        let likeliest = pool.likeliest(2).into_iter().next();
        let pairs = pool.fits.iter().filter(|f| f.is_named() && f.names().len() == 2);
        let cheapest = pairs.min_by(|a, b| a.cost().total_cmp(&b.cost())).cloned();
        let mut done: Vec<Vec<&str>> = Vec::new();
        for pair in [likeliest, cheapest].into_iter().flatten() {
            let names = pair.names();
            if done.contains(&names) || pair.overdispersion() < EXCHANGED {
                continue;
            }
            let mut best = vec![pair];
            for name in &names {
                let pair = &best[0];
                let Some(i) = pair.names().iter().position(|n| n == name) else { continue };
                let Some(kept) = pair.without(i, &SLOW) else { continue };
                let mut turned = vec![pair.turned_to(i)];
                self.families(&kept, &mut turned, &[], &SLOW, &|_| true);
                self.carry_on(&mut turned);
                best = turned;
            }
            done.push(names);
            pool.take(best);
        }
    }

    /// Further mechanisms beside several, where those are the likeliest cause and leave far more than noise.
    fn further(&self, pool: &mut Pool) {
        for count in 2..MOST {
            let likeliest = pool.posterior().causes.into_iter().next();
            let several = likeliest.filter(|c| c.names.len() == count && !c.is_unknown()).and_then(|c| c.structure);
            let Some(several) = several.map(|i| pool.fits[i].clone()) else { return };
            if several.overdispersion() < FURTHER {
                return;
            }
            pool.take(self.beside(&several, 12, 2, 6).into_iter().take(OTHERS).collect());
        }
    }

    /// `first` in the form of fewest parameters, where its best form has more: those may stand in for a second mechanism.
    fn plainer(&self, base: &Fitted, first: &Fitted) -> Option<Fitted> {
        let term = first.structure.terms().first()?;
        let forms = self.candidates().into_iter().filter(|t| t.name() == term.name() && t.bond == term.bond);
        let plain = forms.min_by_key(|t| t.form.parameters.len())?;
        let has_fewer = plain.form.parameters.len() < term.form.parameters.len();
        has_fewer.then(|| base.add(&plain, 2, &Options::default())).flatten()
    }
}

/// Whether one mechanism leaves noise alone, and gained so much that hardly another one hides in it.
fn is_explained(base: &Fitted, first: &Fitted) -> bool {
    first.overdispersion() <= WHITE_ALONE && first.gain(base) >= FAINT
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant::recipe::{write_campaign, Recipe};

    #[test]
    fn a_form_that_extends_another_is_fitted_again_from_its_own_values() {
        let dir = tempfile::tempdir().unwrap();
        write_campaign(dir.path(), &Recipe { samples: 350, interval: 2e-5, ..Recipe::default() }).unwrap();
        let campaign = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let prepared = estimate::prepare::Prepared::new(&campaign).unwrap();
        let search = Search::new(&prepared);
        let base = Fitted::base(&search.data, &search.structure, &prepared.guess);
        let part = search.candidates().into_iter().find(|t| t.name() == "loose_part").unwrap();
        let extended = search.structure.base().extensions(&part).remove(0);
        let values = [&part.form.starts[0][..], &extended.form.starts[0]].concat();
        let both = base.structure.with(extended.clone());
        let theta = [&base.point().theta[..], &values].concat();
        let start = Problem::new(&search.data, both.model()).evaluate(theta, base.point().locals.clone());
        let whole = base.with(extended.clone(), start, &Options { iterations: 0, ..SLOW });
        let again = from_within(&base, &whole, &extended).unwrap();
        assert!(again.chi2() <= whole.chi2(), "{} {}", again.chi2(), whole.chi2());
    }

    #[test]
    fn what_contains_a_better_fit_is_fitted_again_from_there() {
        let dir = tempfile::tempdir().unwrap();
        write_campaign(dir.path(), &Recipe { samples: 350, interval: 2e-5, ..Recipe::default() }).unwrap();
        let mut campaign = record::load(dir.path(), &mechanisms::terms()).unwrap();
        campaign.simulation.terms.retain(|t| t != "hysteresis_damping");
        let prepared = estimate::prepare::Prepared::new(&campaign).unwrap();
        let search = Search::new(&prepared);
        let base = Fitted::base(&search.data, &search.structure, &prepared.guess);
        let term = |name: &str| search.candidates().into_iter().find(|t| t.name() == name).unwrap();
        let (damping, drag) = (term("hysteresis_damping"), term("fluid_drag"));
        let single = base.add(&damping, 2, &SLOW).unwrap();
        // the two together, stopped far from their end
        let pair = base.add(&drag, 1, &QUICK).unwrap();
        let both = pair.structure.with(damping.clone());
        let theta = [&pair.point().theta[..], &damping.form.starts[0]].concat();
        let start = Problem::new(&search.data, both.model()).evaluate(theta, pair.point().locals.clone());
        let pair = pair.with(damping.clone(), start, &Options { iterations: 0, ..SLOW });
        assert!(pair.chi2() > single.chi2() + 100.0, "{} {}", pair.chi2(), single.chi2());
        assert_eq!(only_more(&single, &pair).map(|t| t.name()), Some("fluid_drag"));
        assert!(only_more(&pair, &single).is_none() && only_more(&base, &pair).is_none());
        let mut pool = Pool::new(&base, vec![single.clone()]);
        pool.take(vec![pair]);
        pool.mend_what_contains_better();
        let mended = pool.fits.iter().find(|f| f.names().len() == 2).unwrap();
        assert!(mended.chi2() <= single.chi2() + SAME, "{} {}", mended.chi2(), single.chi2());
    }
}
