//! What is missing where the motion is not imposed: a force learned as a function of what it may depend on, through the
//! integrated simulation. It has no name; what it depends on is said, and what it predicts.

use crate::evidence::weighed;
use crate::heldout::{held_out, HeldOut};
use crate::posterior::{Posterior, POSSIBLE};
use crate::predictions::Predictions;
use estimate::fitted::Fitted;
use estimate::problem::{Data, Options, Point, Problem};
use estimate::structure::{Structure, Term};
use mechanisms::learned_force::{dependences, Dependence};
use rayon::prelude::*;
use std::convert::Infallible;
use std::sync::Arc;

/// A force learned of one dependence.
#[derive(Clone)]
pub struct Force {
    /// None: what stood in for the unknown cause before.
    pub depends: Option<Dependence>,
    /// Held against the recordings' own noise.
    pub fitted: Fitted,
    /// Given that the cause is one that no form of the vocabulary explains.
    pub probability: f64,
    /// Every recording predicted by a force learned without its level; None where it is hardly possible.
    pub heldout: Option<HeldOut>,
    /// Misfit of the simulation with it on what it has seen, mean of rms over range of recordings and channels, 1.
    pub misfit: f64,
}

impl Force {
    /// What was learned as a table of so many rows: its columns with their units, and the rows.
    pub fn table(&self, rows: usize) -> (Vec<&'static str>, Vec<Vec<f64>>) {
        self.fitted.physics().learned_force.table(rows)
    }

    /// What it depends on, in words; empty of what stood in before.
    pub fn words(&self) -> &'static str {
        self.depends.map_or("", Dependence::words)
    }
}

/// How a force is learned.
const OPTIONS: Options = Options { iterations: 60, tolerance: 1e-5, hopeless: 0.0, ceiling: f64::INFINITY };

/// The same recordings, their noise with `ratio` times the variance.
fn widened(data: &Data, ratio: f64) -> Data {
    Data { noise: data.noise.map(|n| n.widened(ratio)), ..data.clone() }
}

fn evaluated(data: &Data, structure: &Structure, at: &Point) -> Point {
    Problem::new(data, structure.model()).evaluate(at.theta.clone(), at.locals.clone())
}

/// `from` with a force learned beside it, from none at all.
fn beside(from: &Fitted, term: Term) -> Fitted {
    let zeros = vec![0.0; term.form.parameters.len()];
    let structure = from.structure.with(term);
    let at = Point { theta: [from.point().theta.clone(), zeros].concat(), ..from.point().clone() };
    let start = evaluated(&from.data, &structure, &at);
    Fitted::from(&from.data, structure, start, &OPTIONS)
}

/// Misfit of a fit on what it has seen, mean of rms over range of recordings and channels, 1.
pub fn misfit(f: &Fitted) -> f64 {
    let judged = (0..f.data.records.len()).map(|r| f.predict(r).1).collect();
    let none = |_: &Data, _: usize| Ok::<_, Infallible>(Default::default());
    Predictions::new(judged, &f.data, none).unwrap_or_else(|e| match e {}).misfit(&f.data)
}

/// The forces that can be learned beside `base`, and what `stands_in` for them already, the likeliest first. What no shape
/// explains counts as noise, as much as the shape that explains most leaves: else every shape would be bent to follow it.
pub fn learn(base: &Fitted, stands_in: Option<&Fitted>, posterior: &Posterior) -> Vec<Force> {
    let given = base.structure.base();
    let terms = dependences(&given.context)
        .into_iter()
        .flat_map(|(of, mechanism, form)| given.at_bonds(mechanism, &form).into_iter().map(move |term| (of, term)));
    let tried: Vec<(Option<Dependence>, Fitted)> =
        terms.collect::<Vec<_>>().into_par_iter().map(|(of, term)| (Some(of), beside(base, term))).collect();
    let tried = tried.into_iter().chain(stands_in.map(|f| (None, f.clone())));
    let tried: Vec<_> = tried.filter(|(_, f)| f.chi2().is_finite()).collect();
    let Some((_, best)) = tried.iter().min_by(|a, b| a.1.chi2().total_cmp(&b.1.chi2())) else { return Vec::new() };
    let wider = Arc::new(widened(&base.data, best.overdispersion_up_to(f64::INFINITY).max(1.0)));
    let again = |(depends, f): (Option<Dependence>, Fitted)| {
        let start = evaluated(&wider, &f.structure, f.point());
        let f = Fitted::from(&wider, f.structure, start, &OPTIONS);
        // of noise alone: what a shape leaves is noise by now
        let ln = *weighed(&f)?.ln[0].first()?;
        Some(((depends, f), ln))
    };
    let (tried, ln): (Vec<_>, Vec<f64>) = tried.into_par_iter().filter_map(again).unzip();
    let force = |((depends, f), probability): ((Option<Dependence>, Fitted), f64)| {
        let heldout = (probability > POSSIBLE).then(|| held_out(&f));
        let mut fitted = f.on(base.data.clone());
        fitted.fit.point = evaluated(&base.data, &f.structure, f.point());
        Force { depends, misfit: misfit(&fitted), fitted, probability, heldout }
    };
    let shares = posterior.shares(&ln);
    let mut all: Vec<Force> = tried.into_par_iter().zip(shares).map(force).collect();
    all.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evidence::Evidences;
    use crate::table::Table;
    use estimate::prepare::Prepared;
    use mechanisms::learned_force::LearnedForce;
    use plant::recipe::{write_campaign, Recipe};

    /// The simulation as given of a campaign that holds `force`, and what is learned beside it.
    fn learned(force: LearnedForce) -> (Fitted, Vec<Force>) {
        let dir = tempfile::tempdir().unwrap();
        let mut recipe = Recipe::default();
        recipe.physics.learned_force = force;
        write_campaign(dir.path(), &recipe).unwrap();
        let campaign = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let prepared = Prepared::new(&campaign).unwrap();
        let base = Fitted::base(&prepared.data, &prepared.structure, &prepared.guess);
        let posterior = Posterior::new(&Evidences::of(&base), &Table::calibrated());
        let forces = learn(&base, None, &posterior);
        (base, forces)
    }

    #[test]
    fn a_force_that_gives_way_at_some_depth_is_learned_as_one_of_depth_and_predicts_levels_not_seen() {
        let mut force = LearnedForce { of: Dependence::Depth, range: 4e-4, ..LearnedForce::default() };
        (force.coefficients[2], force.coefficients[5]) = (20.0, -15.0);
        let (base, forces) = learned(force);
        let first = &forces[0];
        assert_eq!(
            first.depends,
            Some(Dependence::Depth),
            "{:?}",
            forces.iter().map(|f| (f.depends, f.probability)).collect::<Vec<_>>()
        );
        assert!(first.probability > 0.5, "{}", first.probability);
        let (before, after) = (held_out(&base).nrmse, first.heldout.as_ref().unwrap().nrmse);
        assert!(after < 0.7 * before, "{after} of {before}");
        assert!(first.misfit < 0.7 * misfit(&base));
        assert!(first.fitted.chi2() < base.chi2());
        let (columns, rows) = first.table(21);
        assert!(columns.len() == 4 && rows.len() == 21 && rows.iter().all(|r| r.len() == 4));
    }

    #[test]
    fn a_force_in_flight_is_learned_as_one_on_the_body() {
        let mut force = LearnedForce { of: Dependence::Speed, speed: 1.0, ..LearnedForce::default() };
        (force.coefficients[0], force.coefficients[3]) = (8.0, 8.0);
        let (_, forces) = learned(force);
        let words = forces[0].words();
        assert!(words.starts_with("on the body"), "{words}");
    }
}
