//! A model structure: the simulation as given, and the mechanisms added to it, each in one of its forms.

mod coordinates;
mod fmus;

use crate::condition::Guess;
use crate::flat::{flat_top, tops};
use crate::problem::{Data, Model, Parameter, STIFFNESS_SCALE};
use crate::ring;
use fmus::model_of_fmus;
use mechanisms::mechanism::{Context, Form, Hints, Mechanism, Origin};
use mechanisms::physics::{Physics, GRAVITY};
use mechanisms::ALL;
use plant::machine::Machine;
use record::{Campaign, Channel, Kind, Simulation};
use std::sync::Arc;

/// Relative standard deviation of a calibrated gain of force or acceleration.
pub const GAIN: f64 = 0.007;
/// The same of a calibrated penetration, and of a weighed mass.
const PENETRATION_GAIN: f64 = 0.003;
const MASS: f64 = 0.002;
/// Standard deviations beyond which a calibration's tolerance is no tolerance.
const WIDEST: f64 = 6.0;
/// Terms that the base holds by itself where the simulation lists them.
const GRAVITY_TERM: &str = mechanisms::gravity::MECHANISM.name;
const HYSTERESIS_TERM: &str = <law::parts::HysteresisDamping as law::part::Part>::MECHANISM.name;

/// A law that a fit starts from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    /// Stiffness, N/m^p.
    pub k: f64,
    /// Exponent, 1.
    pub p: f64,
    /// Hysteresis damping, N s/m^(p+1).
    pub mu_d: f64,
}

/// A mechanism in one of its forms.
#[derive(Clone)]
pub struct Term {
    pub mechanism: &'static Mechanism,
    pub form: Form,
    /// The bond of a system of FMUs that it acts at; 0 of a rig of ours.
    pub bond: usize,
}

impl Term {
    /// Its mechanism's name.
    pub fn name(&self) -> &'static str {
        self.mechanism.name
    }

    /// Whether it acts on what moves, and does not change what is read alone.
    pub fn acts(&self) -> bool {
        self.mechanism.origin != Origin::Chain || self.form.parameters.iter().any(|p| p.dynamic)
    }

    /// Values of its parameters, dimensionless, where a fit starts first; zero for those of a form it extends.
    pub fn start(&self) -> Vec<f64> {
        let further = &self.form.starts[0];
        let mut values = vec![0.0; self.form.parameters.len() - further.len()];
        values.extend(further);
        values
    }
}

/// The simulation as its user has it: what every structure of a campaign has in common.
#[derive(Clone)]
pub struct Base {
    /// What mechanisms may ask of the campaign.
    pub context: Context,
    /// Moving mass, kg.
    pub mass: f64,
    /// Whether the simulation holds gravity, and hysteresis damping.
    pub gravity: bool,
    pub hysteresis: bool,
    /// Mechanisms the simulation holds beyond those two.
    pub given: Vec<Term>,
    /// As the campaign declares it.
    pub simulation: Simulation,
    /// What simulates the recordings in place of a rig of ours.
    pub machine: Option<Arc<dyn Machine>>,
}

impl Base {
    /// Of a campaign and its data.
    pub fn new(campaign: &Campaign, data: &Data) -> Base {
        let terms = campaign.simulation.terms.clone();
        let top = tops(data);
        let mut context = Context {
            kind: data.kind,
            has: [data.has(Channel::Force), data.has(Channel::Acceleration), data.has(Channel::Penetration)],
            scales: data.scales,
            terms: Vec::new(),
            top,
            // the limit of a chain is one of magnitude
            flat: flat_top(data).filter(|f| f.value.abs() == top[f.channel.index()]).map(|f| f.channel),
            ring: if data.kind == Kind::Indentation { None } else { ring::line(data, Channel::Force) },
        };
        let given = ALL
            .iter()
            .filter(|m| {
                terms.iter().any(|t| t == m.name)
                    && m.name != GRAVITY_TERM
                    && m.name != HYSTERESIS_TERM
                    && !m.hints.declared_by_rig.contains(&data.kind)
                    // the FMUs hold theirs by themselves
                    && data.kind != Kind::System
            })
            .filter_map(|m| m.forms(&context).into_iter().next().map(|form| Term { mechanism: m, form, bond: 0 }))
            .collect();
        context.terms = terms.clone();
        Base {
            context,
            mass: data.mass,
            gravity: terms.iter().any(|t| t == GRAVITY_TERM) && data.kind == Kind::DropTest,
            hysteresis: terms.iter().any(|t| t == HYSTERESIS_TERM) && data.kind != Kind::System,
            given,
            simulation: campaign.simulation.clone(),
            machine: data.records.first().and_then(|r| r.setup.machine.as_ref()).map(|s| s.machine.clone()),
        }
    }

    /// The campaign's own law, where it is calibrated.
    pub fn law(&self) -> Option<Law> {
        let s = &self.simulation;
        s.k.zip(s.p).map(|(k, p)| Law { k, p, mu_d: s.mu_d.unwrap_or(0.0) })
    }

    /// All terms that could be added, in forms that stand for themselves.
    pub fn candidates(&self) -> Vec<Term> {
        self.terms().into_iter().filter(|t| t.form.extends.is_none()).collect()
    }

    /// The forms that extend that of `term`.
    pub fn extensions(&self, term: &Term) -> Vec<Term> {
        let is_there = |t: &Term| t.name() == term.name() && t.bond == term.bond;
        let extends = |t: &Term| is_there(t) && t.form.extends == Some(term.form.label);
        self.terms().into_iter().filter(extends).collect()
    }

    /// A form of a mechanism at every bond that it may act at.
    pub fn at_bonds(&self, mechanism: &'static Mechanism, form: &Form) -> Vec<Term> {
        let bonds = self.bonds();
        let bonds = bonds.iter().filter(|b| b.admits(mechanism.origin, form)).map(|b| b.bond);
        bonds.map(|bond| Term { mechanism, form: form.clone(), bond }).collect()
    }

    fn terms(&self) -> Vec<Term> {
        let have: Vec<&str> = self.given.iter().map(Term::name).collect();
        ALL.iter()
            .filter(|m| !have.contains(&m.name))
            .flat_map(|m| m.forms(&self.context).into_iter().map(move |form| (m, form)))
            .flat_map(|(m, form)| self.at_bonds(m, &form))
            .collect()
    }

    /// Puts the instruments' gains behind `ps`: place and channel of each.
    fn gains(&self, ps: &mut Vec<Parameter>) -> Vec<(usize, usize)> {
        let mut gains = Vec::new();
        for (c, sd) in [(Channel::Force, GAIN), (Channel::Acceleration, GAIN), (Channel::Penetration, PENETRATION_GAIN)]
        {
            if self.context.has[c.index()] {
                gains.push((ps.len(), c.index()));
                ps.push(tolerance(&format!("ln gain {}", c.name()), sd, false));
            }
        }
        gains
    }
}

/// The base and the terms added to it, with the model they make; the model is built once.
#[derive(Clone)]
pub struct Structure {
    base: Arc<Base>,
    terms: Vec<Term>,
    model: Arc<Model<'static>>,
}

impl Structure {
    /// `base` with `terms` added.
    pub fn new(base: Arc<Base>, terms: Vec<Term>) -> Structure {
        let model = Arc::new(model(&base, &terms));
        Structure { base, terms, model }
    }

    /// The simulation as given, nothing added.
    pub fn given(campaign: &Campaign, data: &Data) -> Structure {
        Structure::new(Arc::new(Base::new(campaign, data)), Vec::new())
    }

    /// What it is built on.
    pub fn base(&self) -> &Arc<Base> {
        &self.base
    }

    /// The terms added, in their order.
    pub fn terms(&self) -> &[Term] {
        &self.terms
    }

    /// The term added last.
    pub fn last(&self) -> Option<&Term> {
        self.terms.last()
    }

    /// Parameters: ln F_ref, p, the damping ratio where there is one, tolerances (those with priors), terms.
    pub fn model(&self) -> &Model<'static> {
        &self.model
    }

    /// This structure with one more term.
    pub fn with(&self, term: Term) -> Structure {
        let mut terms = self.terms.clone();
        terms.push(term);
        Structure::new(self.base.clone(), terms)
    }

    /// This structure without its term `i`.
    pub fn without(&self, i: usize) -> Structure {
        let mut terms = self.terms.clone();
        terms.remove(i);
        Structure::new(self.base.clone(), terms)
    }

    /// This structure with mechanisms that give no name in the place of those added.
    pub fn standing_in(&self) -> Structure {
        let unnamed = |t: &Term| Term { mechanism: mechanisms::stand_in(t.mechanism), ..t.clone() };
        Structure::new(self.base.clone(), self.terms.iter().map(unnamed).collect())
    }

    /// This structure with `term` in the place of the last one.
    pub fn with_last(&self, term: Term) -> Structure {
        let mut terms = self.terms.clone();
        terms.pop();
        terms.push(term);
        Structure::new(self.base.clone(), terms)
    }

    /// Names of the mechanisms added.
    pub fn names(&self) -> Vec<&'static str> {
        self.terms.iter().map(Term::name).collect()
    }

    /// Names and forms of the mechanisms added.
    pub fn forms(&self) -> Vec<(&'static str, &'static str)> {
        self.terms.iter().map(|t| (t.name(), t.form.label)).collect()
    }

    /// Whether it holds a mechanism of that name.
    pub fn holds(&self, name: &str) -> bool {
        self.terms.iter().any(|t| t.name() == name)
    }

    /// Whether a mechanism may be added: not what it holds already, nor what does the opposite, nor what no recordings part
    /// from what it holds: that would be one cause by two names.
    pub fn admits(&self, other: &Mechanism) -> bool {
        let hints = &other.hints;
        let excluded = hints.opposite_of.iter().chain(hints.collinear_with);
        !self.holds(other.name) && !excluded.into_iter().any(|name| self.holds(name))
    }

    /// Whether `term` may be added: what [`Structure::admits`] says, and of a system of FMUs, one bond at a time.
    pub fn takes(&self, term: &Term) -> bool {
        self.admits(term.mechanism) && self.is_at_one_bond_with(term)
    }

    /// Whether `term` acts at the bond that the terms here act at, where both act on what moves.
    pub fn is_at_one_bond_with(&self, term: &Term) -> bool {
        self.acting().is_none_or(|bond| !term.acts() || term.bond == bond)
    }

    /// Whether a mechanism added has what `hint` asks for.
    pub fn has(&self, hint: impl Fn(&Hints) -> bool) -> bool {
        self.terms.iter().any(|t| hint(&t.mechanism.hints))
    }

    /// Index of the first parameter of the terms added.
    pub fn first_term(&self) -> usize {
        self.model.parameters.len() - self.terms.iter().map(|t| t.form.parameters.len()).sum::<usize>()
    }

    /// The parameters `theta` without those of term `i`.
    pub fn theta_without(&self, theta: &[f64], i: usize) -> Vec<f64> {
        let mut theta = theta.to_vec();
        theta.drain(self.values_of(i));
        theta
    }

    /// Where the values of term `i` stand among the parameters.
    pub fn values_of(&self, i: usize) -> std::ops::Range<usize> {
        let before: usize = self.terms[..i].iter().map(|t| t.form.parameters.len()).sum();
        let at = self.first_term() + before;
        at..at + self.terms[i].form.parameters.len()
    }

    /// This structure with its term `i` as the last one, and the parameters `theta` in that order.
    pub fn turned_to(&self, theta: &[f64], i: usize) -> (Structure, Vec<f64>) {
        let mut turned = self.theta_without(theta, i);
        turned.extend(&theta[self.values_of(i)]);
        (self.without(i).with(self.terms[i].clone()), turned)
    }

    /// Parameters that a fit of the simulation as given starts from, each: its own law where it is calibrated, that of the
    /// guess, and where it is not calibrated others of the same force. Of FMUs, where the system file has them, with the
    /// force of the guess, and with its law.
    pub fn starts(&self, guess: &Guess) -> Vec<Vec<f64>> {
        let s = self.base.context.scales;
        if self.base.machine.is_some() {
            let as_given = self.start(Law { k: 1.0, p: 1.0, mu_d: 0.0 });
            let own = self.ln_force(&as_given);
            if !own.is_finite() {
                return vec![as_given];
            }
            let force = guess.k.ln() + guess.p * s.x_ref.ln();
            let mut raised = as_given.clone();
            self.raise(&mut raised, force - own);
            // the ridge of stiffness and exponent holds local minima: where the user's law is far along it, the guess is nearer
            let mut guessed = raised.clone();
            self.bend(&mut guessed, guess.p - self.exponent(&as_given));
            self.damp(&mut guessed, 0.15 / s.v_ref);
            let mut starts = vec![as_given, raised, guessed];
            starts.dedup();
            return starts;
        }
        let mut laws: Vec<Law> = self.base.law().into_iter().collect();
        laws.push(Law { k: guess.k, p: guess.p, mu_d: 0.15 * guess.k / s.v_ref });
        if self.base.simulation.k.is_none() {
            // the same force at 0.6 depth with other powers
            for p in [1.0, 1.5, 2.2, 3.0] {
                let k = guess.k * s.x_ref.powf(guess.p - p);
                laws.push(Law { k, p, mu_d: 0.3 * k / s.v_ref });
            }
        }
        laws.into_iter().map(|law| self.start(law)).collect()
    }

    /// Parameters to start from: a law, tolerances at zero, every term at its first start.
    pub fn start(&self, law: Law) -> Vec<f64> {
        let s = self.base.context.scales;
        if self.base.machine.is_some() {
            let mut theta = vec![0.0; self.base.own_parameters()];
            self.base.given.iter().chain(&self.terms).for_each(|t| theta.extend(t.start()));
            return theta;
        }
        let mut theta = vec![(law.k * s.x_ref.powf(law.p)).ln(), law.p];
        if self.base.hysteresis {
            theta.push(law.mu_d * s.v_ref / law.k);
        }
        theta.extend(self.model.parameters.iter().filter(|p| p.prior.is_some()).map(|_| 0.0));
        for t in self.base.given.iter().chain(&self.terms) {
            theta.extend(t.start());
        }
        theta
    }
}

/// The model of `base` with `added` terms.
fn model(base: &Arc<Base>, added: &[Term]) -> Model<'static> {
    if let Some(machine) = &base.machine {
        return model_of_fmus(base, machine.clone(), added);
    }
    let s = base.context.scales;
    let free = |name: &str, lower, upper, step| Parameter {
        name: name.into(),
        lower,
        upper,
        step,
        prior: None,
        dynamic: true,
    };
    let mut ps = vec![free(STIFFNESS_SCALE, -60.0, 60.0, 2e-3), free("p", 0.8, 4.5, 1e-3)];
    let hysteresis = base.hysteresis;
    if hysteresis {
        ps.push(free("damping ratio", 0.0, 20.0, 1e-3));
    }
    let gravity = base.gravity;
    let mass = base.mass;
    let with_mass = base.context.kind != Kind::Indentation;
    let gains = if with_mass { base.gains(&mut ps) } else { Vec::new() };
    let at_mass = ps.len();
    if with_mass {
        ps.push(tolerance("ln mass", MASS, true));
    }
    let mut spans = Vec::new();
    let all: Vec<Term> = base.given.iter().chain(added).cloned().collect();
    for t in &all {
        spans.push(ps.len());
        for q in &t.form.parameters {
            ps.push(Parameter { name: format!("{}: {}", t.mechanism.name, q.name), ..q.clone() });
        }
    }
    let base = base.clone();
    Model::new(ps, move |th: &[f64], p: &mut Physics| {
        p.law.elastic.exponent = th[1];
        p.law.elastic.stiffness = (th[0] - th[1] * s.x_ref.ln()).exp();
        p.law.hysteresis_damping.coefficient = if hysteresis { th[2] * p.law.elastic.stiffness / s.v_ref } else { 0.0 };
        p.mass = if with_mass { mass * th[at_mass].exp() } else { mass };
        p.gravity = if gravity { GRAVITY } else { 0.0 };
        for (i, c) in &gains {
            p.force_gain.channel[*c] = th[*i].exp();
        }
        for (t, at) in all.iter().zip(&spans) {
            t.form.apply(&th[*at..*at + t.form.parameters.len()], &base.context, p);
        }
    })
}

/// A parameter with a tolerance of standard deviation `sd`.
fn tolerance(name: &str, sd: f64, dynamic: bool) -> Parameter {
    Parameter {
        name: name.into(),
        lower: -WIDEST * sd,
        upper: WIDEST * sd,
        step: 1e-3,
        prior: Some((0.0, sd)),
        dynamic,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prepare::Prepared;
    use plant::recipe::{write_campaign, Recipe};

    #[test]
    fn it_admits_neither_what_it_holds_nor_what_does_the_opposite() {
        let dir = tempfile::tempdir().unwrap();
        write_campaign(dir.path(), &Recipe::default()).unwrap();
        let campaign = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let base = Prepared::new(&campaign).unwrap().structure;
        let candidates = base.base().candidates();
        let hardening = candidates.iter().find(|t| t.name() == "cyclic_hardening").unwrap().clone();
        let with = base.with(hardening);
        let mut refused: Vec<&str> = ALL.iter().filter(|m| !with.admits(m)).map(|m| m.name).collect();
        refused.sort_unstable();
        assert_eq!(refused, ["cyclic_hardening", "cyclic_softening"]);
        assert!(ALL.iter().all(|m| base.admits(m)));
    }
}
