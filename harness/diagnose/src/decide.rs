//! The decision: which names are given, whether the cause is unknown, or nothing is missing; by the posterior over what was
//! tried and by what each predicts of levels not seen.

use super::candidate::Candidate;
use super::evidence::Evidences;
use super::heldout::{folds, held_out, windows, Folds, HeldOut};
use super::holding;
use super::learned::{learned, Learned, Named, Size, CURE, HELD_SHAPE};
use super::material::remainder;
use super::motion::{learn, learn_beside, nats_ahead, Force, Loss};
use super::nearest::nearest;
use super::order::trend;
use super::phases::of_force;
use super::posterior::{limits_reading, Cause, Posterior, POSSIBLE, UNKNOWN};
use super::propose::Pool;
use super::rings::rings;
use super::table::Table;
use estimate::fitted::Fitted;
use estimate::problem::Options;
use estimate::structure::Term;
use mechanisms::latent_force::MECHANISM as LATENT;
use mechanisms::mechanism::Mechanism;
use record::Campaign;

/// Structures at most whose predictions of levels not seen are worked out.
const PREDICTED: usize = 6;
/// Structures of names that every fold chooses among, beside the simulation as given, and that every window does.
const CHOICES: usize = 3;
const WINDOW_CHOICES: usize = 2;

/// The decision on a campaign.
pub struct Decision {
    pub base: Fitted,
    pub chosen: Fitted,
    /// Single candidates, best form each, best first.
    pub singles: Vec<Fitted>,
    pub detected: bool,
    /// Names that fit as well as the chosen one, by term.
    pub ties: Vec<Vec<&'static str>>,
    pub unexplained: bool,
    /// What the chosen model's stiffness differs by between recordings of one level (rms of ln), beyond repeat scatter.
    pub excess_scatter: Option<f64>,
    /// Overdispersion of the base's and the chosen model's residual.
    pub overdispersion: (f64, f64),
    /// Fall of chi^2 by the best structure tried.
    pub gain: f64,
    /// What it was weighed by, what turned that into probabilities, and what came of it.
    pub evidence: Evidences,
    pub table: Table,
    pub posterior: Posterior,
    /// Predictions of levels not seen by the simulation as given, and by what is chosen; None where nothing is added.
    pub before: HeldOut,
    pub after: Option<HeldOut>,
    /// What else is likely of the vocabulary, with its predictions; the simulation as given first, what is chosen second.
    /// Empty where nothing is named.
    pub choices: Vec<(Fitted, HeldOut)>,
    /// Predictions of levels not seen by names chosen without them; None where they were not worked out.
    pub folds: Option<Folds>,
    /// Names that recordings give which end so many contact times after the touch.
    pub windows: Vec<(f64, Vec<&'static str>)>,
    /// Laws learned as functions of imposed motion, whatever their shape; None where that was not done.
    pub learned: Option<Learned>,
    /// Where such a law leads, the equation that an FMU can hold in its place, and what it predicts of levels not seen; None where
    /// none predicts them better than the simulation as given.
    pub nearest: Option<(Fitted, HeldOut)>,
    /// Forces learned where it is not, the likeliest first; empty where that was not done.
    pub forces: Vec<Force>,
    /// Index of the one of them that the recordings are simulated with; None where none is.
    taken: Option<usize>,
    /// Mechanisms named for a class in motion: that of this force, of the stiffness by order, of oscillations after the contact.
    by_class: Vec<Named>,
    /// The structures weighed, and what those of them that may be behind the recordings predict of levels not seen.
    fits: Vec<Fitted>,
    predicted: Vec<Option<HeldOut>>,
}

impl Decision {
    /// Decides among the structures of `pool`: names that are more likely than not are given; else nothing is said where
    /// nothing is the most probable of all causes, and the cause is unknown. Predictions of levels not seen count among the
    /// evidence.
    pub fn new(pool: Pool) -> Decision {
        let gain = pool.gain();
        let Pool { fits, mut evidence, singles, table, .. } = pool;
        let mut predicted: Vec<Option<HeldOut>> = fits.iter().map(|_| None).collect();
        let mut posterior = Posterior::new(&evidence, &table);
        let mut next = Some(0);
        for _ in 0..=PREDICTED {
            let Some(i) = next else { break };
            let of = held_out(&fits[i]);
            evidence.structures[i].heldout = Some(of.nrmse);
            predicted[i] = Some(of);
            posterior = Posterior::new(&evidence, &table);
            next = unpredicted(&posterior, &fits, &evidence);
        }
        let at = likeliest(&posterior, &fits, &evidence);
        predicted[at].get_or_insert_with(|| held_out(&fits[at]));
        let lacks_limit = posterior.is_limited() && !limits_reading(&fits[at].names());
        let limited = if lacks_limit { with_limit(&fits[at]) } else { None };
        let chosen = limited.clone().unwrap_or_else(|| fits[at].clone());
        let base = fits[0].clone();
        let adds = !chosen.structure.terms().is_empty();
        // what differs between recordings of one level is seen by no force within one
        let excess_scatter = chosen.excess_scatter_left(base.excess_scatter());
        let scatters = excess_scatter.is_some();
        let is_unknown = posterior.likely_names().is_empty() && !posterior.is_nothing();
        let left = chosen.overdispersion();
        let is_large = |c: &Cause| c.structure == Some(at) && c.large > 0.5;
        let much = posterior.causes.iter().any(is_large) || posterior.unknown() > 0.5;
        let leaves_much = adds && much && remainder(&chosen, false).is_material();
        let mut choices = Vec::new();
        if at > 0 && chosen.is_named() && limited.is_none() {
            let near = posterior.causes.iter().filter(|c| !c.names.is_empty()).filter_map(|c| c.structure);
            let near = [0, at].into_iter().chain(near.filter(|i| *i != at));
            let of = near.filter_map(|i| Some((fits[i].clone(), predicted[i].clone()?)));
            choices = of.take(1 + CHOICES).collect();
        }
        Decision {
            detected: adds || is_unknown || scatters,
            unexplained: is_unknown || scatters || leaves_much,
            ties: rivals(&posterior, &chosen),
            overdispersion: (base.overdispersion(), left),
            before: predicted[0].clone().unwrap_or_default(),
            after: limited.map(|f| held_out(&f)).or_else(|| predicted[at].clone().filter(|_| at > 0)),
            folds: None,
            windows: Vec::new(),
            learned: None,
            nearest: None,
            forces: Vec::new(),
            taken: None,
            by_class: Vec::new(),
            base,
            chosen,
            singles,
            excess_scatter,
            gain,
            evidence,
            table,
            posterior,
            choices,
            fits,
            predicted,
        }
    }

    /// Whether a mechanism of the vocabulary is named.
    pub fn names_something(&self) -> bool {
        self.detected && self.chosen.structure.terms().iter().any(|t| t.mechanism.named)
    }

    /// Names that were given for what was learned, with no form.
    pub fn names_by_shape(&self) -> &[Named] {
        self.learned.as_ref().map_or(&self.by_class, |l| &l.names)
    }

    /// Whether what was learned takes the place of every form.
    pub fn is_learned(&self) -> bool {
        self.learned.as_ref().is_some_and(|l| l.leads)
    }

    /// Whether the motion of every recording is imposed.
    fn is_imposed(&self) -> bool {
        self.base.data.records.iter().all(|r| !r.setup.imposed.is_empty())
    }

    /// Whether the missing force may be learned as a function: the motion is imposed, and nothing missing is not the likeliest cause.
    pub fn may_learn(&self) -> bool {
        self.is_imposed() && !self.posterior.is_nothing()
    }

    /// Whether a force may be learned through the simulation: the motion is not imposed, something is missing, and an unknown cause
    /// is possible.
    pub fn may_learn_in_motion(&self) -> bool {
        !self.is_imposed() && !self.posterior.is_nothing() && self.posterior.unknown() > POSSIBLE
    }

    /// Whether the chosen structure names more than a limit of a reading.
    fn names_physics(&self) -> bool {
        self.chosen.is_named() && self.chosen.names().iter().any(|n| !limits_reading(&[n]))
    }

    /// Learns forces through the simulation: beside what is named, or where nothing is, in the place of what stands in for the
    /// unknown cause. The likeliest is taken, unless it predicts levels not seen worse than the simulation as given, or than what
    /// is named alone.
    pub fn learn_in_motion(&mut self) {
        if self.names_physics() {
            self.learn_beside_names();
        } else {
            self.learn_the_unknown();
        }
        self.learn_order();
        self.learn_ringing();
    }

    /// Mechanisms of the vocabulary that may be missing in the simulation as given.
    fn candidates(&self) -> Vec<&'static Mechanism> {
        let mut all: Vec<&'static Mechanism> =
            self.base.structure.base().candidates().iter().map(|t| t.mechanism).filter(|m| m.named).collect();
        all.dedup_by_key(|m| m.name);
        all
    }

    /// Names a stiffness that follows the order of the recordings, whatever else is missing; not where the simulation holds such a
    /// course, or one was found.
    fn learn_order(&mut self) {
        if self.names_one_that(|m| m.hints.depends_on_history) {
            return;
        }
        let Some(found) = trend(&self.base.data, self.table.learned.class) else { return };
        let name = found.mechanism.name;
        if self.candidates().iter().all(|m| m.name != name) {
            return;
        }
        self.posterior = self.posterior.with_another(name, found.probability, self.table.level);
        if self.posterior.likely_names().contains(&name) {
            self.by_class.push(found.named(self.posterior.of(name), of_force(self.simulated())));
        }
    }

    /// Whether the chosen structure names a mechanism like this; what stands in for a cause without a name is none.
    fn names_one_that(&self, is_it: impl Fn(&Mechanism) -> bool) -> bool {
        self.chosen.structure.terms().iter().any(|t| t.mechanism.named && is_it(t.mechanism))
    }

    /// Names what rings on after the contact; not where something that rings is named already. Which of the mechanisms that do it
    /// is goes by what each explains beside the learned force, or where none was tried there, alone.
    fn learn_ringing(&mut self) {
        if self.names_one_that(|m| m.hints.rings) {
            return;
        }
        let Some(found) = rings(self.simulated()) else { return };
        let ringing: Vec<&'static Mechanism> = self.candidates().into_iter().filter(|m| m.hints.rings).collect();
        let alone = |m: &&Mechanism| {
            let of = self.evidence.structures.iter().filter(|w| w.names == [m.name]);
            of.map(|w| self.table.mass(w)).fold(f64::NEG_INFINITY, f64::max)
        };
        let beside = |m: &&Mechanism| -> f64 {
            self.forces.iter().filter(|f| f.beside == Some(m.name)).map(|f| f.probability).sum()
        };
        let by_force: Vec<f64> = ringing.iter().map(beside).collect();
        let shares = match by_force.iter().sum::<f64>() {
            all if all > POSSIBLE => by_force.iter().map(|p| p / all).collect(),
            _ => self.posterior.shares(&ringing.iter().map(alone).collect::<Vec<f64>>()),
        };
        let possible: Vec<_> = ringing.into_iter().zip(shares).filter(|(_, share)| *share > POSSIBLE).collect();
        for (m, share) in &possible {
            let probability = found.probability(&self.table.learned) * share;
            self.posterior = self.posterior.with_another(m.name, probability, self.table.level);
        }
        let likely = self.posterior.likely_names();
        let Some((mechanism, _)) = possible.iter().find(|(m, _)| likely.contains(&m.name)) else { return };
        let others = possible.iter().map(|(m, _)| m.name).filter(|n| *n != mechanism.name).collect();
        self.by_class.push(found.named(mechanism, self.posterior.of(mechanism.name), others));
    }

    fn learn_beside_names(&mut self) {
        let most = self.after.as_ref().map_or(self.before.nrmse, |a| a.nrmse.min(self.before.nrmse));
        self.forces = learn_beside(&self.chosen, &self.table, self.before.nrmse);
        // the likeliest may be that there is none
        let predicts = |f: &&Force| f.predicts(most) && !f.depends.is_empty();
        let Some(best) = self.forces.first().filter(predicts) else { return };
        self.overdispersion.1 = best.fitted.overdispersion();
        self.after.clone_from(&best.heldout);
        self.taken = Some(0);
        let names = self.chosen.names();
        for (name, share) in self.losses_by_name() {
            self.posterior = self.posterior.with_beside(&names, name, share, self.table.level);
        }
        self.by_class = self.likely_losses();
        self.unexplained |= self.by_class.is_empty();
    }

    fn learn_the_unknown(&mut self) {
        // a force on knots is one of the shapes that are learned
        let is_other = |t: &Term| !t.mechanism.named && t.name() != LATENT.name;
        let stands_in = Some(&self.chosen).filter(|c| c.structure.terms().iter().any(is_other));
        let limited = limits_reading(&self.chosen.names()) && self.chosen.is_named();
        let from = if limited { &self.chosen } else { &self.base };
        self.forces = learn(from, stands_in, &self.table, self.before.nrmse);
        let first = self.forces.iter().position(|f| f.predicts(self.before.nrmse));
        let Some(i) = first.filter(|i| !self.forces[*i].depends.is_empty()) else { return };
        let best = &self.forces[i];
        if let Some((standing, heldout)) = self.standing_in_better(best) {
            self.overdispersion.1 = standing.overdispersion();
            (self.chosen, self.after) = (standing, Some(heldout));
            return;
        }
        self.overdispersion.1 = best.fitted.overdispersion();
        self.chosen = best.fitted.clone();
        self.after.clone_from(&best.heldout);
        self.taken = Some(i);
        let by_name = self.losses_by_name();
        if !by_name.is_empty() {
            let rest = 1.0 - by_name.iter().map(|(_, share)| share).sum::<f64>();
            let sets = by_name.into_iter().map(|(name, share)| (vec![name], share)).chain([(vec![UNKNOWN], rest)]);
            self.posterior = self.posterior.refined(sets, self.table.level);
        }
        self.by_class = self.likely_losses();
    }

    /// Forms of the vocabulary that stand in for the unknown cause better than `force` does: by what both predict of levels not seen,
    /// and by evidence. An unknown cause need not be of any class that can be learned.
    fn standing_in_better(&self, force: &Force) -> Option<(Fitted, HeldOut)> {
        let predicted = self.fits.iter().zip(&self.predicted).filter_map(|(f, h)| Some((f, h.as_ref()?)));
        let named = predicted.filter(|(f, _)| f.is_named());
        let (best, heldout) = named.min_by(|a, b| a.1.nrmse.total_cmp(&b.1.nrmse))?;
        let predicts_better = force.heldout.as_ref().is_none_or(|h| heldout.nrmse < h.nrmse);
        let is_better = predicts_better && nats_ahead(&force.fitted, best)? < 0.0;
        is_better.then(|| (best.standing_in(), heldout.clone()))
    }

    /// Names of what the forces learned are the class of, with their probability given that one of the forces is right.
    fn losses_by_name(&self) -> Vec<(&'static str, f64)> {
        let mut all: Vec<(&'static str, f64)> = Vec::new();
        for (force, loss) in self.forces.iter().filter_map(|f| Some((f, f.loss?))) {
            let share = force.probability * loss.probability;
            match all.iter_mut().find(|(name, _)| *name == loss.mechanism.name) {
                Some((_, whole)) => *whole += share,
                None => all.push((loss.mechanism.name, share)),
            }
        }
        all
    }

    /// The name of what the force that is taken is the class of, where it is more likely than not.
    fn likely_losses(&self) -> Vec<Named> {
        let likely = self.posterior.likely_names();
        let loss = self.force().and_then(|f| f.loss).filter(|l| likely.contains(&l.mechanism.name));
        let in_contact = holding::learned(self).is_some_and(|h| h.in_contact);
        let named = |l: Loss| Named {
            mechanism: l.mechanism,
            probability: self.posterior.of(l.mechanism.name),
            also_possible: l.also_possible.to_vec(),
            size: Size::largest_force(l.largest),
            cure: if in_contact { HELD_SHAPE } else { CURE },
            shares: l.shares,
        };
        loss.into_iter().map(named).collect()
    }

    /// The learned force that the recordings are simulated with: in the place of the unknown cause, or beside what is named.
    pub fn force(&self) -> Option<&Force> {
        self.forces.get(self.taken?)
    }

    /// The fit that the recordings are simulated with: the chosen structure, and a force learned beside it where one is.
    pub fn simulated(&self) -> &Fitted {
        self.force().map_or(&self.chosen, |f| &f.fitted)
    }

    /// Whether a force was learned beside what is named.
    pub fn has_remainder(&self) -> bool {
        self.force().is_some() && self.names_physics()
    }

    /// Takes the unknown cause apart into classes of forces that are learned as functions.
    pub fn learn(&mut self, c: &Campaign) {
        let Some((l, posterior)) = learned(c, self) else { return };
        // where laws of free shape neither lead nor name anything, what was decided without them stays, and why
        let is_mute = !l.leads && l.names.is_empty() && self.chosen.names().is_empty();
        if !is_mute {
            self.posterior = posterior;
        }
        if l.leads {
            // what stood in for the unknown is known now
            self.chosen = self.base.clone();
            self.overdispersion.1 = self.overdispersion.0;
            self.ties = Vec::new();
            self.after = Some(l.heldout.clone());
            // the fit of the simulation as given follows with its stiffness what it has no force for
            self.excess_scatter = l.excess_scatter(self.base.data.repeat_scatter);
            self.unexplained =
                l.names.is_empty() || l.misfit > self.table.learned.discrepancy || self.excess_scatter.is_some();
            let named: Vec<&str> = l.names.iter().map(|n| n.mechanism.name).collect();
            self.nearest = nearest(&self.base, &self.fits, &named, self.before.nrmse);
        }
        self.detected |= !l.names.is_empty();
        self.learned = Some(l);
    }

    /// Gain of the best structure tried over the overdispersion of what is left: how far the recordings are from the
    /// simulation as given.
    pub fn strength(&self) -> f64 {
        self.gain / self.overdispersion.1.max(1.0)
    }

    /// Lets every fold and every shorter window choose its own names among what is likely.
    pub fn choose_again(&mut self) {
        if self.choices.is_empty() {
            return;
        }
        let table = &self.table;
        let all: Vec<(&Fitted, &HeldOut)> = self.choices.iter().map(|(f, h)| (f, h)).collect();
        let few: Vec<&Fitted> = all.iter().map(|c| c.0).take(1 + WINDOW_CHOICES).collect();
        (self.folds, self.windows) = (Some(folds(&all, table)), windows(&few, table));
    }
}

/// The next structure whose predictions of levels not seen are worth working out: what would be chosen, the likeliest names,
/// of several each alone (better predictions may be the work of one of them), what has the most evidence (its predictions may
/// be what it lacks), then what is possible; None where all of those are known.
fn unpredicted(posterior: &Posterior, fits: &[Fitted], evidence: &Evidences) -> Option<usize> {
    let best = posterior.best_named();
    let several = best.filter(|c| c.names.len() > 1);
    let of_several = |c: &&Cause| c.names.len() == 1 && several.is_some_and(|s| s.names.contains(&c.names[0]));
    let alone = posterior.causes.iter().filter(of_several);
    let possible = posterior.causes.iter().filter(|c| c.probability > POSSIBLE);
    let names = best.into_iter().chain(alone).filter_map(|c| c.structure);
    let possible = possible.filter_map(|c| c.structure);
    let mut all =
        [likeliest(posterior, fits, evidence)].into_iter().chain(names).chain(evidence.most()).chain(possible);
    all.find(|i| evidence.structures[*i].heldout.is_none())
}

/// Index of the fit that stands for the names that are likely, for an unknown cause or for nothing; the simulation as given
/// is first.
fn likeliest(posterior: &Posterior, fits: &[Fitted], evidence: &Evidences) -> usize {
    let names = posterior.likely_names();
    match posterior.with_names(&names).and_then(|c| c.structure) {
        Some(named) if !names.is_empty() => named,
        _ if posterior.is_nothing() => 0,
        _ => stand_in(fits, evidence),
    }
}

/// `f` with the limit of a reading beside it, that explains most; None where none can be fitted.
fn with_limit(f: &Fitted) -> Option<Fitted> {
    let context = &f.structure.base().context;
    context.flat?;
    let limits = f.structure.base().candidates().into_iter().filter(|t| t.mechanism.hints.limits_reading);
    let fitted = limits.filter_map(|t| f.add(&t, 2, &Options::default()));
    fitted.min_by(|a, b| a.chi2().total_cmp(&b.chi2()))
}

/// What stands in for a cause that nobody has named: the fit of least cost among those with a stand-in that is not known to
/// predict worse, or nothing added.
fn stand_in(fits: &[Fitted], evidence: &Evidences) -> usize {
    let standing = (0..fits.len()).filter(|i| !fits[*i].is_named() && !evidence.is_worse(*i));
    standing.min_by(|a, b| fits[*a].cost().total_cmp(&fits[*b].cost())).unwrap_or(0)
}

/// Names that may stand in the place of each of the chosen ones: those of the credible set that differ in one name, and
/// those that no recordings part.
fn rivals(posterior: &Posterior, chosen: &Fitted) -> Vec<Vec<&'static str>> {
    let names = chosen.names();
    let candidates = chosen.structure.base().candidates();
    let rest = |set: &[&'static str], without: &str| -> Vec<&'static str> {
        let mut v: Vec<&'static str> = set.iter().copied().filter(|n| *n != without).collect();
        v.sort_unstable();
        v
    };
    let of = |i: usize| {
        let others = rest(&names, names[i]);
        let mut v: Vec<&'static str> = Vec::new();
        for cause in posterior.credible_set().iter().filter(|c| !c.is_unknown() && c.names.len() == names.len()) {
            let differs = cause.names.iter().find(|n| !names.contains(n));
            if let Some(n) = differs.filter(|n| rest(&cause.names, n) == others) {
                v.push(n);
            }
        }
        for n in chosen.structure.terms()[i].mechanism.hints.collinear_with {
            if !v.contains(n) && candidates.iter().any(|c| c.name() == *n) {
                v.push(n);
            }
        }
        v
    };
    (0..names.len()).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::misfit;
    use crate::search::Search;
    use estimate::prepare::Prepared;
    use estimate::problem::Problem;
    use mechanisms::learned_force::{dependences, Dependence};
    use plant::recipe::{write_campaign, Recipe};

    /// A decision on drops of a body on which a mass rides, which the simulation as given leaves out.
    fn of_a_mass_that_rides() -> Decision {
        let dir = tempfile::tempdir().unwrap();
        let mut recipe = Recipe { samples: 350, interval: 2e-5, ..Recipe::default() };
        recipe.physics.law.scale_stiffness(30.0);
        recipe.physics.law.hysteresis_damping.coefficient *= 30.0;
        let riding = &mut recipe.physics.attached_mass;
        (riding.mass, riding.stiffness, riding.damping) = (0.1, 0.1 * 1.2e4 * 1.2e4, 0.02 * 0.1 * 1.2e4);
        write_campaign(dir.path(), &recipe).unwrap();
        let campaign = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let prepared = Prepared::new(&campaign).unwrap();
        let base = Fitted::base(&prepared.data, &prepared.structure, &prepared.guess);
        Decision::new(Search::new(&prepared).propose(base))
    }

    /// A force of the depth alone, learned beside `base`.
    fn of_depth(base: &Fitted) -> Force {
        let given = base.structure.base();
        let mut all = dependences(&given.context, 0, 12).into_iter();
        let (of, mechanism, form) = all.find(|(of, ..)| *of == Dependence::Depth).unwrap();
        let term = given.at_bonds(mechanism, &form).into_iter().next().unwrap();
        let theta = [base.point().theta.clone(), vec![0.0; 12]].concat();
        let structure = base.structure.with(term.clone());
        let start = Problem::new(&base.data, structure.model()).evaluate(theta, base.point().locals.clone());
        let fitted = base.with(term, start, &Options::default());
        let (heldout, misfit) = (Some(held_out(&fitted)), misfit(&fitted));
        Force { depends: vec![of], beside: None, fitted, probability: 1.0, heldout, misfit, loss: None }
    }

    #[test]
    fn what_rings_is_named_beside_a_stand_in_and_forms_stand_in_for_what_is_learned_worse() {
        let named = of_a_mass_that_rides();
        assert_eq!(named.chosen.names(), ["attached_mass"]);
        let mut decision = named;
        decision.learn_ringing();
        assert!(decision.names_by_shape().is_empty(), "it is named already");
        // the same where nobody had named it, and its form stands in for the rest
        let ridden = decision.chosen.clone();
        let term = ridden.structure.terms()[0].clone();
        let standing = Term { mechanism: mechanisms::stand_in(term.mechanism), ..term };
        decision.chosen =
            decision.base.with(standing, ridden.point().clone(), &Options { iterations: 0, ..Options::default() });
        decision.learn_ringing();
        assert_eq!(decision.names_by_shape().iter().map(|n| n.mechanism.name).collect::<Vec<_>>(), ["attached_mass"]);
        // and a force of the depth alone stands in for it worse than that form does
        let force = of_depth(&decision.base);
        let (standing, heldout) = decision.standing_in_better(&force).unwrap();
        assert!(!standing.is_named() && standing.names().contains(&"attached_mass"), "{:?}", standing.names());
        assert!(standing.chi2() < force.fitted.chi2() && heldout.nrmse < force.heldout.unwrap().nrmse);
    }
}
