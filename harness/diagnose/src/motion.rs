//! Forces that are missing where the motion is not imposed, one or two that act in different places: learned as functions of what
//! they may depend on, through the integrated simulation. What they depend on is said, and what they predict; damping alone has a
//! name, as the class that it is.

use crate::evidence::{ln_sum, of_noise};
use crate::experiment::phi;
use crate::heldout::{held_out, HeldOut};
use crate::phases::shares;
use crate::posterior::POSSIBLE;
use crate::predictions::Predictions;
use crate::propose::PENDING;
use crate::table::Table;
use estimate::fitted::Fitted;
use estimate::problem::{Data, Options, Point, Problem};
use estimate::structure::{Structure, Term};
use mechanisms::learned_force::{by_all_terms, dependences, unit, Dependence, TERMS};
use mechanisms::mechanism::{Mechanism, Origin};
use mechanisms::stand_in;
use rayon::prelude::*;
use std::convert::Infallible;
use std::f64::consts::LN_2;
use std::sync::Arc;

/// A force learned of one dependence, or two that act in different places.
#[derive(Clone)]
pub struct Force {
    /// Empty: what stood in for the unknown cause before.
    pub depends: Vec<Dependence>,
    /// Name of a mechanism beside it whose form stands in for the rest.
    pub beside: Option<&'static str>,
    /// Held against the recordings' own noise.
    pub fitted: Fitted,
    /// Given that the cause is one that no form of the vocabulary explains.
    pub probability: f64,
    /// Every recording predicted by a force learned without its level; None where it is hardly possible.
    pub heldout: Option<HeldOut>,
    /// Misfit of the simulation with it on what it has seen, mean of rms over range of recordings and channels, 1.
    pub misfit: f64,
    /// The mechanism that the force is the class of; None where the vocabulary has no name for its class.
    pub loss: Option<Loss>,
}

/// A mechanism that a learned force is the class of, because what of it depends on the speed takes energy out.
#[derive(Clone, Copy)]
pub struct Loss {
    pub mechanism: &'static Mechanism,
    /// Names that no function of this class parts from it.
    pub also_possible: &'static [&'static str],
    /// That it takes energy out, over all that was recorded, given the force.
    pub probability: f64,
    /// Its largest force, N.
    pub largest: f64,
    /// Share of the force's action in approach, loading, unloading and after.
    pub shares: [f64; 4],
}

impl Loss {
    /// The mechanism that a force of the dependence `of` is the class of, fitted as term `term` of `f`; None where its class has no
    /// name, or the simulation holds the mechanism already.
    fn new(f: &Fitted, term: usize, of: Dependence) -> Option<Loss> {
        let (name, also_possible) = of.loss()?;
        let is_missing = |t: &Term| t.name() == name;
        let known = f.names().contains(&name);
        if known || !f.structure.base().candidates().iter().any(is_missing) {
            return None;
        }
        let force = *f.physics().learned_forces.of(of)?;
        let (mut taken, mut largest) = ([0.0; TERMS], 0.0f64);
        for (r, rec) in f.data.records.iter().enumerate() {
            let (trace, _) = f.predict(r);
            let steps = rec.setup.time.windows(2).map(|w| w[1] - w[0]);
            for (dt, (x, v)) in steps.zip(trace.position.iter().zip(&trace.velocity)) {
                largest = largest.max(force.with_speed(*x, *v).abs());
                taken.iter_mut().zip(force.powers(*x, *v)).for_each(|(sum, p)| *sum += p * dt);
            }
        }
        if largest == 0.0 {
            return None;
        }
        let whole: f64 = taken.iter().zip(&force.learned.coefficients[TERMS..]).map(|(t, c)| t * c).sum();
        let unit = unit(of, &f.structure.base().context);
        let values = f.structure.values_of(term);
        // those of its last series
        let many = values.len() / of.series();
        let first = values.end - many;
        let covariance = f.problem().covariance(f.point())?;
        let pairs = (0..many).flat_map(|i| (0..many).map(move |j| (i, j)));
        let variance: f64 = pairs.map(|(i, j)| taken[i] * covariance[(first + i, first + j)] * taken[j]).sum();
        let sd = unit * variance.max(0.0).sqrt();
        Some(Loss {
            mechanism: mechanisms::named(name)?,
            also_possible,
            probability: if sd > 0.0 { phi(whole / sd) } else { f64::from(u8::from(whole > 0.0)) },
            largest,
            shares: shares(f, term),
        })
    }
}

impl Force {
    /// The curves of each dependence, as tables of so many rows.
    pub fn tables(&self, rows: usize) -> Vec<Curves> {
        let forces = &self.fitted.physics().learned_forces;
        self.depends.iter().filter_map(|of| Some(forces.of(*of)?.table(rows))).collect()
    }

    /// Whether it predicts levels not seen no worse than a misfit over range of `most`.
    pub fn predicts(&self, most: f64) -> bool {
        self.heldout.as_ref().is_some_and(|h| h.nrmse <= most)
    }

    /// Where it acts and what it depends on, in words; empty of what stood in before.
    pub fn words(&self) -> String {
        let learned = self.depends.iter().map(|of| of.words().to_string());
        let beside = self.beside.map(|name| format!("{} stands in for the rest", name.replace('_', " ")));
        learned.chain(beside).collect::<Vec<_>>().join(", and ")
    }
}

/// Curves that were learned: their columns with their units, and the rows.
pub type Curves = (Vec<&'static str>, Vec<Vec<f64>>);

/// Terms of the series by which dependences are told apart: half a wave is a tenth of a middling depth, as fine as splines of 10 to 14
/// intervals. Every dependence is fitted so; more terms cost time for each, and what is possible then is learned by all terms there are.
const COARSE: usize = 12;

/// How a force is learned.
const OPTIONS: Options = Options { iterations: 60, tolerance: 1e-5, hopeless: 0.0, ceiling: f64::INFINITY };

/// The same recordings, their noise with `ratio` times the variance.
fn widened(data: &Data, ratio: f64) -> Data {
    Data { noise: data.noise.map(|n| n.widened(ratio)), ..data.clone() }
}

fn evaluated(data: &Data, structure: &Structure, at: &Point) -> Point {
    Problem::new(data, structure.model()).evaluate(at.theta.clone(), at.locals.clone())
}

/// `structure` fitted to `data` from the point `at`, whatever that was evaluated on.
fn fitted_from(data: &Arc<Data>, structure: Structure, at: &Point) -> Fitted {
    let start = evaluated(data, &structure, at);
    Fitted::from(data, structure, start, &OPTIONS)
}

/// `from` with a force learned beside it, from none at all.
fn beside(from: &Fitted, term: Term) -> Fitted {
    let zeros = vec![0.0; term.form.parameters.len()];
    let structure = from.structure.with(term);
    let at = Point { theta: [from.point().theta.clone(), zeros].concat(), ..from.point().clone() };
    fitted_from(&from.data, structure, &at)
}

/// Misfit of a fit on what it has seen, mean of rms over range of recordings and channels, 1.
pub fn misfit(f: &Fitted) -> f64 {
    let judged = (0..f.data.records.len()).map(|r| f.predict(r).1).collect();
    let none = |_: &Data, _: usize| Ok::<_, Infallible>(Default::default());
    Predictions::new(judged, &f.data, none).unwrap_or_else(|e| match e {}).misfit(&f.data)
}

/// A force fitted and weighed, with the ln of its prior over that of a force of one dependence.
struct Tried {
    depends: Vec<Dependence>,
    beside: Option<&'static str>,
    fitted: Fitted,
    /// Its ln evidence, of noise alone: what a shape leaves is noise by now.
    ln: f64,
    /// Nats that its fit would still gain, which `ln` counts as gained.
    pending: f64,
    ln_prior: f64,
    heldout: Option<HeldOut>,
}

impl Tried {
    /// None where it cannot be weighed.
    fn new(depends: Vec<Dependence>, beside: Option<&'static str>, fitted: Fitted, ln_prior: f64) -> Option<Tried> {
        let (ln, pending) = of_noise(&fitted)?;
        Some(Tried { depends, beside, fitted, ln, pending, ln_prior, heldout: None })
    }

    /// The same fitted to its end; what it has not gained by then counts for nothing.
    fn to_its_end(&self) -> Option<Tried> {
        let mut of = Tried::new(self.depends.clone(), self.beside, self.fitted.to_its_end(), self.ln_prior)?;
        if of.pending > PENDING {
            of.ln -= std::mem::take(&mut of.pending);
        }
        Some(of)
    }

    /// The mechanism that one of its forces is the class of; None where none has a name.
    fn loss(&self) -> Option<Loss> {
        let of = *self.depends.iter().find(|of| of.loss().is_some())?;
        let term = self.fitted.structure.terms().iter().position(|t| t.form.label == of.words())?;
        Loss::new(&self.fitted, term, of)
    }

    /// Whether it is known to predict levels not seen worse than `given`, misfit over range.
    fn is_worse(&self, given: f64) -> bool {
        self.heldout.as_ref().is_some_and(|h| h.nrmse > given)
    }
}

/// The terms of every dependence, as the force of this index of those side by side, by series of so many terms.
fn terms(base: &Fitted, index: usize, of_series: usize) -> Vec<(Dependence, Term)> {
    let given = base.structure.base();
    let at = |(of, mechanism, form)| given.at_bonds(mechanism, &form).into_iter().map(move |term| (of, term));
    dependences(&given.context, index, of_series).into_iter().flat_map(at).collect()
}

/// A force of the dependence `of` that was learned beside `from` by coarse series, by all terms that series have, from where it is.
fn finer(from: &Fitted, of: Dependence, coarse: &Fitted) -> Option<Fitted> {
    let bond = coarse.structure.last()?.bond;
    let is_same = |(depends, t): &(Dependence, Term)| *depends == of && t.bond == bond;
    let (_, term) = terms(from, 0, TERMS).into_iter().find(is_same)?;
    let structure = from.structure.with(term);
    let at = coarse.point();
    let (before, learned) = at.theta.split_at(at.theta.len() - of.series() * COARSE);
    let learned = by_all_terms(of, &structure.base().context, learned, COARSE);
    let at = Point { theta: [before.to_vec(), learned].concat(), ..at.clone() };
    Some(fitted_from(&coarse.data, structure, &at))
}

/// Probability of each, by its evidence, as laws learned of imposed motion are weighed, and by what it predicts of levels not seen,
/// as names are. What has not predicted them yet may do so as well as the best that has.
fn probabilities(all: &[Tried], given: f64, table: &Table) -> Vec<f64> {
    let predicts = |t: &Tried| {
        let known = t.heldout.as_ref().filter(|h| h.nrmse > 0.0 && given > 0.0);
        known.map(|h| table.of_heldout((given / h.nrmse).ln()))
    };
    let best = all.iter().filter_map(predicts).fold(0.0, f64::max);
    let score = |t: &Tried| t.ln / table.learned.temperature + t.ln_prior + predicts(t).unwrap_or(best);
    let score: Vec<f64> = all.iter().map(score).collect();
    let whole = ln_sum(&score);
    score.iter().map(|s| if whole.is_finite() { (s - whole).exp() } else { 0.0 }).collect()
}

/// Fits to its end whatever is possible, until all of that is.
fn end_what_is_possible(tried: &mut [Tried], given: f64, table: &Table) {
    loop {
        let shares = probabilities(tried, given, table);
        let mut unfinished: Vec<&mut Tried> = tried
            .iter_mut()
            .zip(shares)
            .filter(|(t, share)| *share > POSSIBLE && t.pending > PENDING)
            .map(|t| t.0)
            .collect();
        if unfinished.is_empty() {
            return;
        }
        unfinished.par_iter_mut().for_each(|t| match t.to_its_end() {
            Some(ended) => **t = ended,
            None => t.pending = 0.0,
        });
    }
}

/// The forces that can be learned beside `base`, and what `stands_in` for them already, the likeliest first: of one dependence,
/// and the likeliest of those with something beside it. What they predict of levels not seen counts as it does of names; `given`:
/// the misfit over range of what the simulation as given predicts.
pub fn learn(base: &Fitted, stands_in: Option<&Fitted>, table: &Table, given: f64) -> Vec<Force> {
    let (mut tried, noise) = alone(base, terms(base, 0, COARSE), stands_in, |_| 0.0);
    refine(base, &mut tried, given, table);
    predict(&mut tried, given, table);
    let alone = tried.iter().zip(probabilities(&tried, given, table)).enumerate();
    let alone = alone.filter(|(_, (t, _))| !t.depends.is_empty() && !t.is_worse(given));
    if let Some((first, _)) = alone.max_by(|a, b| a.1 .1.total_cmp(&b.1 .1)) {
        let many = tried.len();
        let pairs = pairs(base, &tried[first], table);
        tried.extend(pairs);
        end_what_is_possible(&mut tried, given, table);
        let most = tried[many..].iter().max_by(|a, b| a.ln.total_cmp(&b.ln));
        if let Some(better) = most.and_then(|most| contained(most, &tried[first])) {
            tried[first] = better;
        }
        tried = in_less_noise(base, tried, noise);
        predict(&mut tried, given, table);
    }
    forces(base, tried, given, table)
}

/// Forces learned beside the mechanisms that `named` holds, and no force at all, the likeliest first: each acts in another place than
/// the mechanisms, and has the prior of a second part.
pub fn learn_beside(named: &Fitted, table: &Table, given: f64) -> Vec<Force> {
    let origins: Vec<Origin> = named.structure.terms().iter().map(|t| t.mechanism.origin).collect();
    let elsewhere: Vec<_> =
        terms(named, 0, COARSE).into_iter().filter(|(of, _)| !origins.contains(&of.origin())).collect();
    let ln_prior = ln_prior_of_second(elsewhere.len(), table);
    let (mut tried, _) =
        alone(named, elsewhere, Some(named), |depends| if depends.is_empty() { 0.0 } else { ln_prior });
    refine(named, &mut tried, given, table);
    predict(&mut tried, given, table);
    forces(named, tried, given, table)
}

/// ln prior of each of so many things that may act beside a first.
fn ln_prior_of_second(many: usize, table: &Table) -> f64 {
    table.learned.class - (many.max(1) as f64).ln()
}

/// Every force of `terms` learned beside `from`, and what `stands_in` for one, fitted and weighed. What no shape explains counts as
/// noise, as much as the shape that explains most leaves: else every shape would be bent to follow it. With them how much larger its
/// variance is than that of the recordings' own.
fn alone(
    from: &Fitted,
    terms: Vec<(Dependence, Term)>,
    stands_in: Option<&Fitted>,
    ln_prior: impl Fn(&[Dependence]) -> f64 + Sync,
) -> (Vec<Tried>, f64) {
    let names: Vec<&str> = terms.iter().map(|(of, _)| of.name()).collect();
    let ways = |depends: &[Dependence]| match depends.first() {
        Some(of) => names.iter().filter(|name| **name == of.name()).count(),
        None => 1,
    };
    let tried: Vec<(Vec<Dependence>, Fitted)> =
        terms.into_par_iter().map(|(of, term)| (vec![of], beside(from, term))).collect();
    let tried = tried.into_iter().chain(stands_in.map(|f| (Vec::new(), f.clone())));
    let mut tried: Vec<_> = tried.filter(|(_, f)| f.chi2().is_finite()).collect();
    fit_from_each_other(&mut tried);
    let Some(best) = least(&tried) else { return (Vec::new(), 1.0) };
    let noise = left(best);
    let wider = Arc::new(widened(&from.data, noise));
    let again = |(depends, f): (Vec<Dependence>, Fitted)| {
        let ln_prior = ln_prior(&depends) - (ways(&depends) as f64).ln();
        Tried::new(depends, None, fitted_again(&wider, f), ln_prior)
    };
    (tried.into_par_iter().filter_map(again).collect(), noise)
}

/// Fits every force from the ends of those that it contains and of those that contain it, until no fit gains so what counts: a fit may
/// have ended in a valley of its own, and none may end worse than what it contains.
fn fit_from_each_other(tried: &mut [(Vec<Dependence>, Fitted)]) {
    let mut is_new = vec![true; tried.len()];
    while is_new.contains(&true) {
        let Some(best) = least(tried) else { return };
        // a tenth of a nat of evidence, where what the best leaves counts as noise: in a valley every round gains little
        let counts = 0.2 * left(best);
        let of = |i: usize| tried[i].0.first().copied();
        let better = |i: usize| -> Option<Fitted> {
            let f = &tried[i].1;
            let news = (0..tried.len()).filter(|j| is_new[*j]);
            let starts = news.filter_map(|j| same_force(f, of(i)?, &tried[j].1, of(j)?));
            let fits = starts.map(|at| fitted_from(&f.data, f.structure.clone(), &at));
            let better = fits.filter(|again| again.chi2() < f.chi2() - counts);
            better.min_by(|a, b| a.chi2().total_cmp(&b.chi2()))
        };
        let found: Vec<Option<Fitted>> = (0..tried.len()).into_par_iter().map(better).collect();
        is_new = found.iter().map(Option::is_some).collect();
        for ((_, f), better) in tried.iter_mut().zip(found) {
            if let Some(better) = better {
                *f = better;
            }
        }
    }
}

/// The fit of the least chi^2; None of none.
fn least(tried: &[(Vec<Dependence>, Fitted)]) -> Option<&Fitted> {
    tried.iter().map(|(_, f)| f).min_by(|a, b| a.chi2().total_cmp(&b.chi2()))
}

/// The point at which a force of the dependence `of`, fitted as `f`, is the same as the one of `other`, or as much of it as it can hold;
/// None where neither contains the other, or they act at different bonds. What was learned comes last among the parameters.
fn same_force(f: &Fitted, of: Dependence, at: &Fitted, other: Dependence) -> Option<Point> {
    let bond = |f: &Fitted| f.structure.last().map(|t| t.bond);
    if bond(f) != bond(at) {
        return None;
    }
    let mut point = at.point().clone();
    let (many, there) = (f.point().theta.len(), point.theta.len());
    let series = many.abs_diff(there);
    let place = |whole: Dependence, part: Dependence| whole.contains().iter().position(|p| *p == Some(part));
    if let Some(second) = place(of, other) {
        let at = there - second * series;
        point.theta.splice(at..at, vec![0.0; series]);
    } else {
        let second = place(other, of)?;
        let at = many - second * series;
        point.theta.drain(at..at + series);
    }
    Some(point)
}

/// By how much the variance of the noise would have to be larger to hold what a fit leaves; at least 1.
fn left(f: &Fitted) -> f64 {
    f.overdispersion_up_to(f64::INFINITY).max(1.0)
}

/// A fit to the same recordings with other noise, from where it has come to.
fn fitted_again(data: &Arc<Data>, f: Fitted) -> Fitted {
    let at = f.point().clone();
    fitted_from(data, f.structure, &at)
}

/// ln of how much likelier `learned` is than `other` by the recordings that both were fitted to: what the better of them leaves counts as
/// noise. None where one cannot be weighed.
pub fn nats_ahead(learned: &Fitted, other: &Fitted) -> Option<f64> {
    let noise = left(learned).min(left(other));
    let wider = Arc::new(widened(&other.data, noise));
    let ln = |f: &Fitted| of_noise(&fitted_again(&wider, f.clone())).map(|(ln, _)| ln);
    Some(ln(learned)? - ln(other)?).filter(|nats| nats.is_finite())
}

/// A fit as it is, held against other noise.
fn held_against(data: &Arc<Data>, f: &Fitted) -> Fitted {
    let mut of = f.on(data.clone());
    of.fit.point = evaluated(data, &f.structure, f.point());
    of
}

/// The forces `tried` beside `base`, all fitted and weighed anew where one leaves less than counted as `noise` so far, its variance
/// over that of the recordings' own: what a force explains is no noise. Of several levels the noise stays, for there a shape that
/// follows those seen too closely predicts the others worse.
fn in_less_noise(base: &Fitted, tried: Vec<Tried>, noise: f64) -> Vec<Tried> {
    if base.data.levels().len() > 1 {
        return tried;
    }
    let Some(best) = tried.iter().min_by(|a, b| a.fitted.chi2().total_cmp(&b.fitted.chi2())) else { return tried };
    let least = left(&held_against(&base.data, &best.fitted));
    if least >= noise {
        return tried;
    }
    let less = Arc::new(widened(&base.data, least));
    let again = |t: Tried| Tried::new(t.depends, t.beside, fitted_again(&less, t.fitted), t.ln_prior);
    tried.into_par_iter().filter_map(again).collect()
}

/// Learns what is possible by all terms that series have too, each way half as likely beforehand.
fn refine(from: &Fitted, tried: &mut Vec<Tried>, given: f64, table: &Table) {
    end_what_is_possible(tried, given, table);
    let shares = probabilities(tried, given, table);
    let possible = tried.par_iter_mut().zip(shares).filter(|(_, share)| *share > POSSIBLE);
    let finer = |(t, _): (&mut Tried, f64)| {
        let fitted = finer(from, *t.depends.first()?, &t.fitted)?;
        let ln_prior = t.ln_prior - LN_2;
        let finer = Tried::new(t.depends.clone(), None, fitted, ln_prior)?;
        t.ln_prior = ln_prior;
        Some(finer)
    };
    let finer: Vec<Tried> = possible.filter_map(finer).collect();
    tried.extend(finer);
}

/// Fits to its end what is possible, and works out what it predicts of levels not seen, until all that is possible has.
fn predict(tried: &mut [Tried], given: f64, table: &Table) {
    loop {
        end_what_is_possible(tried, given, table);
        let shares = probabilities(tried, given, table);
        let possible = tried.iter_mut().zip(shares).filter(|(t, share)| *share > POSSIBLE && t.heldout.is_none());
        let possible: Vec<&mut Tried> = possible.map(|(t, _)| t).collect();
        if possible.is_empty() {
            return;
        }
        possible.into_par_iter().for_each(|t| t.heldout = Some(held_out(&t.fitted)));
    }
}

/// The forces `tried` beside `from`, held against the recordings' own noise, the likeliest first; of several forms of one mechanism
/// the likeliest, with the probability of all.
fn forces(from: &Fitted, tried: Vec<Tried>, given: f64, table: &Table) -> Vec<Force> {
    let shares = probabilities(&tried, given, table);
    let mut tried: Vec<(Tried, f64)> = tried.into_iter().zip(shares).collect();
    tried.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut each: Vec<(Tried, f64)> = Vec::new();
    let names = |t: &Tried| t.depends.iter().map(|of| of.name()).collect::<Vec<_>>();
    for (t, share) in tried {
        match each.iter_mut().find(|(of, _)| names(of) == names(&t) && of.beside == t.beside) {
            Some((_, whole)) => *whole += share,
            None => each.push((t, share)),
        }
    }
    let force = |(t, probability): (Tried, f64)| {
        let loss = Some(&t).filter(|_| probability > POSSIBLE).and_then(Tried::loss);
        let fitted = held_against(&from.data, &t.fitted);
        let (misfit, heldout) = (misfit(&fitted), t.heldout);
        Force { depends: t.depends, beside: t.beside, misfit, fitted, probability, heldout, loss }
    };
    let mut all: Vec<Force> = each.into_par_iter().map(force).collect();
    all.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    all
}

/// `first` with everything beside it that acts in another place, each as likely beforehand: what can be learned, and the forms of
/// the vocabulary.
fn pairs(base: &Fitted, first: &Tried, table: &Table) -> Vec<Tried> {
    let learned = terms(base, 1, COARSE).into_iter().filter(|(of, _)| first.depends.iter().all(|f| f.goes_with(*of)));
    let origin = first.fitted.structure.last().map(|t| t.mechanism.origin);
    let forms = base.structure.base().candidates().into_iter();
    let there = first.fitted.names();
    let is_elsewhere = |t: &Term| Some(t.mechanism.origin) != origin && !there.contains(&t.name());
    let forms = forms.filter(|t| t.mechanism.named && is_elsewhere(t));
    let second: Vec<_> = learned.map(|(of, term)| (Some(of), term)).chain(forms.map(|term| (None, term))).collect();
    let ln_prior = ln_prior_of_second(second.len(), table);
    let problem = first.fitted.problem();
    let Some(linear) = problem.linearise(first.fitted.point()) else { return Vec::new() };
    let further = first.fitted.further();
    let pair = |(of, term): (Option<Dependence>, Term)| {
        let (fitted, mechanism) = match of {
            Some(_) => (beside(&first.fitted, term), None),
            // its form stands in for what has no name
            None => {
                let term = Term { mechanism: stand_in(term.mechanism), ..term };
                let mut starts = first.fitted.scored(&problem, &linear, &term);
                starts.truncate(STARTS);
                (first.fitted.fit_from(&further, &term, &starts, &FEW)?, Some(term.name()))
            }
        };
        let depends = first.depends.iter().copied().chain(of).collect();
        Tried::new(depends, mechanism, fitted, ln_prior).filter(|t| t.fitted.chi2().is_finite())
    };
    second.into_par_iter().filter_map(pair).collect()
}

/// `first` fitted from where `pair`, which contains it, ends; None where that is no better.
fn contained(pair: &Tried, first: &Tried) -> Option<Tried> {
    let structure = first.fitted.structure.clone();
    let mut at = pair.fitted.point().clone();
    at.theta.truncate(first.fitted.point().theta.len());
    let fitted = fitted_from(&first.fitted.data, structure, &at);
    Tried::new(first.depends.clone(), first.beside, fitted, first.ln_prior).filter(|t| t.ln > first.ln)
}

/// Starts from which a form of the vocabulary is fitted beside a learned force, and how far each is: what it is then still to gain counts
/// as gained, and the best one is fitted to its end where that makes it possible.
const STARTS: usize = 3;
const FEW: Options = Options { iterations: 8, ..OPTIONS };

#[cfg(test)]
mod tests {
    use super::*;
    use estimate::prepare::Prepared;
    use law::learned::Learned;
    use mechanisms::learned_force::{LearnedForce, LearnedForces};
    use plant::recipe::{write_campaign, Recipe};

    /// Half as many samples: a force is learned through many simulations.
    fn recipe() -> Recipe {
        Recipe { samples: 350, interval: 2e-5, ..Recipe::default() }
    }

    fn by_itself(force: LearnedForce) -> LearnedForces {
        LearnedForces([force, LearnedForce::default()])
    }

    /// The simulation as given of a campaign that holds `forces`.
    fn base_of(forces: LearnedForces) -> Fitted {
        let dir = tempfile::tempdir().unwrap();
        let mut recipe = recipe();
        recipe.physics.learned_forces = forces;
        write_campaign(dir.path(), &recipe).unwrap();
        let campaign = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let prepared = Prepared::new(&campaign).unwrap();
        Fitted::base(&prepared.data, &prepared.structure, &prepared.guess)
    }

    /// The simulation as given of a campaign that holds `forces`, and what is learned beside it.
    fn learned(forces: LearnedForces) -> (Fitted, Vec<Force>) {
        let base = base_of(forces);
        let given = held_out(&base).nrmse;
        let forces = learn(&base, None, &Table::calibrated(), given);
        (base, forces)
    }

    #[test]
    fn a_force_that_gives_way_at_some_depth_is_learned_as_one_of_depth_and_predicts_levels_not_seen() {
        let mut force = LearnedForce { of: Dependence::Depth, learned: Learned { range: 4e-4, ..Learned::default() } };
        (force.learned.coefficients[2], force.learned.coefficients[5]) = (20.0, -15.0);
        let (base, forces) = learned(by_itself(force));
        let first = &forces[0];
        let all: Vec<_> = forces.iter().map(|f| (f.words(), f.probability)).collect();
        assert_eq!(first.depends, [Dependence::Depth], "{all:?}");
        assert!(first.probability > 0.5, "{}", first.probability);
        let (before, after) = (held_out(&base).nrmse, first.heldout.as_ref().unwrap().nrmse);
        assert!(after < 0.7 * before, "{after} of {before}");
        assert!(first.misfit < 0.7 * misfit(&base));
        assert!(first.fitted.chi2() < base.chi2());
        let [(columns, rows)] = &first.tables(21)[..] else { panic!("one table") };
        assert!(columns.len() == 4 && rows.len() == 21 && rows.iter().all(|r| r.len() == 4));
    }

    #[test]
    fn what_lies_deeper_than_a_middling_impact_is_learned_by_all_terms() {
        let mut force = LearnedForce { of: Dependence::Depth, learned: Learned { range: 7e-4, ..Learned::default() } };
        (force.learned.coefficients[5], force.learned.coefficients[8]) = (20.0, -15.0);
        let base = base_of(by_itself(force));
        let of = Dependence::Depth;
        let (_, term) = terms(&base, 0, COARSE).into_iter().find(|(depends, _)| *depends == of).unwrap();
        let coarse = beside(&base, term);
        let fine = finer(&base, of, &coarse).unwrap();
        assert_eq!(fine.point().theta.len(), coarse.point().theta.len() + TERMS - COARSE);
        // far more than so many terms gain by chance
        assert!(fine.chi2() < coarse.chi2() - 10.0 * (TERMS - COARSE) as f64, "{} of {}", fine.chi2(), coarse.chi2());
    }

    /// The simulation without hysteresis damping of a campaign that has it.
    fn without_damping() -> Fitted {
        let dir = tempfile::tempdir().unwrap();
        write_campaign(dir.path(), &recipe()).unwrap();
        let mut campaign = record::load(dir.path(), &mechanisms::terms()).unwrap();
        campaign.simulation.terms.retain(|t| t != "hysteresis_damping");
        let prepared = Prepared::new(&campaign).unwrap();
        Fitted::base(&prepared.data, &prepared.structure, &prepared.guess)
    }

    #[test]
    fn what_contains_a_force_can_begin_where_that_ended_and_ends_no_worse() {
        let base = without_damping();
        let fitted = |of: Dependence| {
            let (_, term) = terms(&base, 0, COARSE).into_iter().find(|(depends, _)| *depends == of).unwrap();
            beside(&base, term)
        };
        let whole = Dependence::DepthAndSpeed;
        let parts = [Dependence::Depth, Dependence::DepthTimesSpeed];
        let both = fitted(whole);
        let mut tried: Vec<(Vec<Dependence>, Fitted)> = parts.iter().map(|of| (vec![*of], fitted(*of))).collect();
        for (of, part) in &tried {
            let at = same_force(&both, whole, part, of[0]).unwrap();
            let there = evaluated(&both.data, &both.structure, &at);
            assert!((there.chi2 - part.chi2()).abs() < 1e-9 * part.chi2(), "{of:?}: {} {}", there.chi2, part.chi2());
            // and what it holds of that is what it was
            let mut held = both.clone();
            held.fit.point = there;
            assert_eq!(same_force(part, of[0], &held, whole).unwrap().theta, part.point().theta);
        }
        assert!(same_force(&tried[0].1, parts[0], &tried[1].1, parts[1]).is_none());
        tried.push((vec![whole], both));
        fit_from_each_other(&mut tried);
        let counts = 2.0 * left(least(&tried).unwrap());
        assert!(tried[..2].iter().all(|(_, part)| tried[2].1.chi2() < part.chi2() + counts));
    }

    #[test]
    fn a_force_of_depth_and_speed_that_takes_energy_out_is_damping() {
        let base = without_damping();
        let of = Dependence::DepthAndSpeed;
        let fitted = |base: &Fitted| {
            let (_, term) = terms(base, 0, COARSE).into_iter().find(|(depends, _)| *depends == of).unwrap();
            beside(base, term)
        };
        let damping = fitted(&base);
        let loss = Loss::new(&damping, 0, of).unwrap();
        assert_eq!(loss.mechanism.name, "hysteresis_damping");
        assert!(loss.probability > 0.99 && loss.largest > 0.0, "{}", loss.probability);
        // turned round it gives energy
        let mut turned = damping;
        let first = turned.structure.first_term() + COARSE;
        turned.fit.point.theta[first..].iter_mut().for_each(|c| *c = -*c);
        let loss = Loss::new(&turned, 0, of).unwrap();
        assert!(loss.probability < 0.01, "{}", loss.probability);
        // a simulation that holds it already names it no more
        let is_damping = |t: &Term| t.name() == "hysteresis_damping";
        let term = base.structure.base().candidates().into_iter().find(is_damping).unwrap();
        let named = base.add(&term, 2, &OPTIONS).unwrap();
        assert!(Loss::new(&fitted(&named), 1, of).is_none());
    }

    #[test]
    fn beside_what_is_named_nothing_is_learned_where_nothing_is_left_and_nothing_in_the_same_place() {
        let base = without_damping();
        let given = held_out(&base).nrmse;
        let is_damping = |t: &Term| t.name() == "hysteresis_damping";
        let damping = base.structure.base().candidates().into_iter().find(is_damping).unwrap();
        let named = base.add(&damping, 2, &OPTIONS).unwrap();
        let forces = learn_beside(&named, &Table::calibrated(), given);
        assert!(forces[0].depends.is_empty(), "{}", forces[0].words());
        assert!(forces.iter().flat_map(|f| &f.depends).all(|of| of.origin() != Origin::Contact));
    }

    #[test]
    fn a_force_in_flight_is_learned_as_one_on_the_body() {
        let mut force = LearnedForce { of: Dependence::Speed, learned: Learned { speed: 1.0, ..Learned::default() } };
        (force.learned.coefficients[0], force.learned.coefficients[3]) = (8.0, 8.0);
        let (_, forces) = learned(by_itself(force));
        let words = forces[0].words();
        assert!(words.starts_with("on the body"), "{words}");
    }

    #[test]
    fn two_forces_that_act_in_different_places_are_learned_side_by_side() {
        let mut depth = LearnedForce { of: Dependence::Depth, learned: Learned { range: 4e-4, ..Learned::default() } };
        (depth.learned.coefficients[2], depth.learned.coefficients[5]) = (20.0, -15.0);
        let mut speed = LearnedForce { of: Dependence::Speed, learned: Learned { speed: 1.0, ..Learned::default() } };
        (speed.learned.coefficients[0], speed.learned.coefficients[3]) = (8.0, 8.0);
        let (base, forces) = learned(LearnedForces([depth, speed]));
        let first = &forces[0];
        let all: Vec<_> = forces.iter().map(|f| (f.words(), f.probability)).collect();
        let acts = |of: &str| first.words().contains(of);
        assert!(acts("between the faces") && (acts("on the body") || first.beside.is_some()), "{all:?}");
        let of_one: Vec<&Force> = forces.iter().filter(|f| f.depends.len() == 1 && f.beside.is_none()).collect();
        assert!(of_one.iter().all(|f| first.misfit < f.misfit), "{all:?}");
        let (before, after) = (held_out(&base).nrmse, first.heldout.as_ref().unwrap().nrmse);
        assert!(after < 0.7 * before, "{after} of {before}");
    }
}
