//! A structure fitted to a campaign's data: where the fit ended, and what it leaves.

use crate::condition::Guess;
use crate::problem::{Data, Fit, Options, Point, Problem};
use crate::structure::{Structure, Term};
use mechanisms::physics::Physics;
use plant::simulate::Trace;
use rayon::prelude::*;
use std::sync::Arc;

/// Iterations within which a fit that is carried on has converged.
const CONVERGED: usize = 200;
/// Relative change of chi^2 at which a fit has come to its end.
const FINE: f64 = 1e-7;
/// Samples of a batch, over which overdispersion is judged.
const BATCH: usize = 24;
/// Most that the mean of a single batch counts for the overdispersion: no outlier shall decide alone.
pub(crate) const MOST: f64 = 30.0;

/// A structure with its fit.
#[derive(Clone)]
pub struct Fitted {
    /// What it was fitted to.
    pub data: Arc<Data>,
    pub structure: Structure,
    pub fit: Fit,
}

impl Fitted {
    /// `structure` fitted to `data` from the point `start`.
    pub fn from(data: &Arc<Data>, structure: Structure, start: Point, options: &Options) -> Fitted {
        let fit = Problem::new(data, structure.model()).fit(start, options);
        Fitted { data: data.clone(), structure, fit }
    }

    /// The simulation as given, fitted from the campaign's law and from the guess; the better one.
    pub fn base(data: &Arc<Data>, structure: &Structure, guess: &Guess) -> Fitted {
        let starts = structure.starts(guess);
        let problem = Problem::new(data, structure.model());
        let fits: Vec<Fit> = starts
            .into_par_iter()
            .map(|theta| {
                let start = problem.start(theta);
                problem.fit(start, &Options { iterations: 40, ..Options::default() })
            })
            .collect();
        let fit = fits.into_iter().min_by(|a, b| a.point.chi2.total_cmp(&b.point.chi2)).expect("there is a start");
        Fitted { data: data.clone(), structure: structure.clone(), fit }
    }

    /// The problem it solves.
    pub fn problem(&self) -> Problem<'_> {
        Problem::new(&self.data, self.structure.model())
    }

    /// Where the fit ended.
    pub fn point(&self) -> &Point {
        &self.fit.point
    }

    /// chi^2 there.
    pub fn chi2(&self) -> f64 {
        self.fit.point.chi2
    }

    /// Names of the mechanisms added.
    pub fn names(&self) -> Vec<&'static str> {
        self.structure.names()
    }

    /// Name of the mechanism added last, empty where there is none.
    pub fn added(&self) -> &'static str {
        self.structure.last().map_or("", Term::name)
    }

    /// Parameters of the mechanisms added.
    pub fn parameters(&self) -> f64 {
        self.structure.terms().iter().map(|t| t.form.parameters.len() as f64).sum()
    }

    /// Whether every mechanism added has a name of the vocabulary.
    pub fn is_named(&self) -> bool {
        self.structure.terms().iter().all(|t| t.mechanism.named)
    }

    /// Names of the parameters of the mechanisms added that rest at a bound. What a form has beside its amplitude and is 0
    /// there is not there: a yield from the first touch, a mode without damping. That is a finding, not the bound's.
    pub fn at_bounds(&self) -> Vec<String> {
        let amplitudes = self.structure.terms().iter().flat_map(|t| (0..t.form.parameters.len()).map(|i| i == 0));
        let all = self.structure.model().parameters.iter().zip(&self.fit.point.theta);
        let added = all.skip(self.structure.first_term()).zip(amplitudes);
        let rests =
            added.filter(|((p, x), amplitude)| **x >= p.upper || **x <= p.lower && (*amplitude || p.lower != 0.0));
        rests.map(|((p, _), _)| p.name.clone()).collect()
    }

    /// The physics it stands for.
    pub fn physics(&self) -> Physics {
        self.problem().physics(&self.fit.point.theta)
    }

    /// Trace and readings of recording `r`.
    pub fn predict(&self, r: usize) -> (Trace, [Vec<f64>; 3]) {
        self.problem().predict(&self.fit.point.theta, r, &self.fit.point.locals[r])
    }

    /// Trace and whitened residual of every recording; None where a simulation fails.
    pub fn residuals(&self) -> Option<Vec<(Trace, Vec<f64>)>> {
        self.problem().residuals(&self.fit.point)
    }

    /// Variance of batch means of the whitened residual over that of white noise (batch means: Conway 1963), of
    /// batches of two lengths the larger; 1 for white noise, and where there are too few samples.
    pub fn overdispersion(&self) -> f64 {
        self.overdispersion_up_to(MOST)
    }

    /// The same where single batches count up to `most`: infinity gives how much wider the noise would have to be to
    /// hold what the model leaves.
    pub fn overdispersion_up_to(&self, most: f64) -> f64 {
        let Some(left) = self.residuals() else { return 1.0 };
        let records = self.data.records.iter().zip(&left);
        overdispersion_of(records.map(|(r, (_, residual))| (r.setup.time.len(), &residual[..])), most)
    }

    /// With one more term, fitted from `start`.
    pub fn with(&self, term: Term, start: Point, options: &Options) -> Fitted {
        Fitted::from(&self.data, self.structure.with(term), start, options)
    }

    /// Without its term `i`, fitted from its own values. None where the simulation fails.
    pub fn without(&self, i: usize, options: &Options) -> Option<Fitted> {
        self.without_from(self, i, options)
    }

    /// Without its term `i`, fitted from the law and the nuisances of `base`, of whatever terms, and its own values of the other
    /// terms: the term may have stood in the place of the law. None where the simulation fails.
    pub fn without_from(&self, base: &Fitted, i: usize, options: &Options) -> Option<Fitted> {
        let structure = self.structure.without(i);
        let mut theta = self.structure.theta_without(&self.fit.point.theta, i);
        let own = structure.first_term();
        theta[..own].copy_from_slice(&base.fit.point.theta[..own]);
        let start = Problem::new(&self.data, structure.model()).evaluate(theta, base.fit.point.locals.clone());
        start.chi2.is_finite().then(|| Fitted::from(&self.data, structure, start, options))
    }

    /// The same fit with its term `i` as the last one.
    pub fn turned_to(&self, i: usize) -> Fitted {
        let mut turned = self.clone();
        (turned.structure, turned.fit.point.theta) = self.structure.turned_to(&self.fit.point.theta, i);
        turned
    }

    /// The same fit with nothing named: its forms stand in for something else.
    pub fn standing_in(&self) -> Fitted {
        Fitted { structure: self.structure.standing_in(), ..self.clone() }
    }

    /// Fitted on from where it stands, until it has converged.
    pub fn carried_on(&self) -> Fitted {
        self.carried_on_to(Options::default().tolerance)
    }

    /// Fitted on from where it stands, along valleys in which every step gains little.
    pub fn to_its_end(&self) -> Fitted {
        self.carried_on_to(FINE)
    }

    fn carried_on_to(&self, tolerance: f64) -> Fitted {
        let options = Options { iterations: CONVERGED, tolerance, ..Options::default() };
        Fitted::from(&self.data, self.structure.clone(), self.fit.point.clone(), &options)
    }

    /// The same fit, held against other data of the same recordings; its chi^2 stays as it was.
    pub fn on(&self, data: Arc<Data>) -> Fitted {
        Fitted { data, structure: self.structure.clone(), fit: self.fit.clone() }
    }
}

/// Overdispersion of whitened residuals, each recording's with its samples a channel; single batches count up to `most`.
pub(crate) fn overdispersion_of<'a>(residuals: impl Iterator<Item = (usize, &'a [f64])> + Clone, most: f64) -> f64 {
    let over = |batch: usize| {
        let (mut sum, mut n) = (0.0, 0.0);
        for (samples, residual) in residuals.clone() {
            for ch in residual.chunks(samples) {
                for w in ch.chunks_exact(batch) {
                    sum += batch_square(w, most);
                    n += 1.0;
                }
            }
        }
        if n < 10.0 {
            1.0
        } else {
            sum / n
        }
    };
    over(BATCH).max(over(3 * BATCH))
}

/// Squared mean of a batch of whitened residuals over that expected of white noise, `most` at most.
fn batch_square(w: &[f64], most: f64) -> f64 {
    let m: f64 = w.iter().sum();
    (m * m / w.len() as f64).min(most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prepare::Prepared;
    use crate::structure::Law;
    use plant::recipe::{write_campaign, Recipe};

    #[test]
    fn turned_to_another_term_a_fit_stays_the_same_fit() {
        let dir = tempfile::tempdir().unwrap();
        write_campaign(dir.path(), &Recipe::default()).unwrap();
        let campaign = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let prepared = Prepared::new(&campaign).unwrap();
        let term = |name: &str| {
            let all = prepared.structure.base().candidates();
            all.into_iter().find(|t| t.name() == name).unwrap()
        };
        let mut structure = prepared.structure.clone();
        let mut theta = structure.start(Law { k: prepared.guess.k, p: prepared.guess.p, mu_d: 0.0 });
        for term in [term("guide_friction"), term("secondary_stiffening")] {
            theta.extend(term.start());
            structure = structure.with(term);
        }
        let problem = Problem::new(&prepared.data, structure.model());
        let point = problem.evaluate(theta.clone(), problem.start(theta).locals);
        let fit = Fit { point, iterations: 0, converged: true, objective: Vec::new(), samples: 0 };
        let fitted = Fitted { data: prepared.data.clone(), structure, fit };
        let turned = fitted.turned_to(0);
        assert_eq!(turned.names(), ["secondary_stiffening", "guide_friction"]);
        assert_ne!(turned.point().theta, fitted.point().theta);
        let again = turned.problem().evaluate(turned.point().theta.clone(), turned.point().locals.clone());
        assert!(fitted.chi2().is_finite());
        assert!((again.chi2 / fitted.chi2() - 1.0).abs() < 1e-12, "{} {}", again.chi2, fitted.chi2());
        assert_eq!(turned.turned_to(0).point().theta, fitted.point().theta);
    }

    #[test]
    fn without_a_term_that_stood_in_the_place_of_the_law_a_fit_begins_at_the_law_of_the_simulation_as_given() {
        let dir = tempfile::tempdir().unwrap();
        write_campaign(dir.path(), &Recipe::default()).unwrap();
        let campaign = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let prepared = Prepared::new(&campaign).unwrap();
        let base = Fitted::base(&prepared.data, &prepared.structure, &prepared.guess);
        let term = |name: &str| {
            let all = prepared.structure.base().candidates();
            all.into_iter().find(|t| t.name() == name).unwrap()
        };
        let (friction, second) = (term("guide_friction"), term("secondary_stiffening"));
        let mut theta = base.point().theta.clone();
        // a law ten times too stiff, which the second stiffness is to have made up for
        theta[0] += 10f64.ln();
        theta.extend(friction.start().iter().chain(&second.start()));
        let structure = base.structure.with(friction).with(second);
        let problem = Problem::new(&prepared.data, structure.model());
        let point = problem.evaluate(theta, base.point().locals.clone());
        let fit = Fit { point, iterations: 0, converged: false, objective: Vec::new(), samples: 0 };
        let pair = Fitted { data: prepared.data.clone(), structure, fit };
        let few = Options { iterations: 2, ..Options::default() };
        let (own, from_base) = (pair.without(1, &few).unwrap(), pair.without_from(&base, 1, &few).unwrap());
        assert_eq!(from_base.names(), ["guide_friction"]);
        assert!(from_base.chi2() < base.chi2() + 1.0, "{} {}", from_base.chi2(), base.chi2());
        assert!(own.chi2() > 2.0 * from_base.chi2(), "{} {}", own.chi2(), from_base.chi2());
    }
}
