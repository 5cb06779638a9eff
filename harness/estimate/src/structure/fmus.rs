//! A structure whose recordings FMUs simulate: where mechanisms may act, its parameters, and the law of its contact.

use super::coordinates::Coordinates;
use super::{Base, Structure, Term, WIDEST};
use crate::problem::{Model, Parameter};
use law::Parameters;
use mechanisms::mechanism::{Form, Origin};
use mechanisms::physics::Physics;
use plant::machine::{BondFacts, Machine};
use std::sync::Arc;

/// A place where mechanisms may act, by where they come from.
pub(super) struct Acting {
    pub bond: usize,
    contact: bool,
    motion: bool,
    chain: bool,
}

impl Acting {
    /// Whether a mechanism's form may act here. A form of the chain that moves the body needs a force as well.
    pub fn admits(&self, origin: Origin, form: &Form) -> bool {
        match origin {
            Origin::Contact => self.contact,
            Origin::Motion => self.motion,
            Origin::Chain => self.chain && (self.motion || form.parameters.iter().all(|p| !p.dynamic)),
        }
    }
}

impl Base {
    /// Where mechanisms may act: the one body of a rig of ours; of FMUs, every bond that takes a force, the first contact
    /// first, and the measuring chain in any case.
    pub(super) fn bonds(&self) -> Vec<Acting> {
        let Some(m) = &self.machine else { return vec![Acting { bond: 0, contact: true, motion: true, chain: true }] };
        let bonds = &m.facts().bonds;
        let of = |(bond, b): (usize, &BondFacts)| Acting {
            bond,
            contact: b.is_contact && b.law.is_some(),
            motion: true,
            chain: false,
        };
        let mut all: Vec<Acting> = bonds.iter().enumerate().filter(|(_, b)| b.takes_force).map(of).collect();
        all.sort_by_key(|a| !a.contact);
        match all.first_mut() {
            Some(first) => first.chain = true,
            None => all.push(Acting { bond: 0, contact: false, motion: false, chain: true }),
        }
        all
    }

    /// Parameters of a system of FMUs before those of any mechanism.
    pub(super) fn own_parameters(&self) -> usize {
        let free = self.machine.as_ref().map_or(0, |m| m.facts().free.len());
        free + self.context.has.iter().filter(|has| **has).count()
    }

    /// The coordinates of the free variables of FMUs; None of a rig built in.
    fn coordinates(&self) -> Option<Coordinates> {
        let machine = self.machine.as_ref()?;
        Some(Coordinates::new(machine.facts(), self.first_bond(), self.context.scales.x_ref))
    }

    /// The bond that is looked at where no mechanism acts.
    pub fn first_bond(&self) -> usize {
        self.bonds()[0].bond
    }
}

impl Structure {
    /// The bond that its terms act at; None where none acts on what moves.
    pub(super) fn acting(&self) -> Option<usize> {
        self.terms().iter().find(|t| t.acts()).map(|t| t.bond)
    }

    /// The bond that is looked at: where its terms act, or else the first.
    pub fn bond(&self) -> usize {
        self.acting().unwrap_or_else(|| self.base.first_bond())
    }

    /// Exponent of the contact's law at `theta`, 1.
    pub fn exponent(&self, theta: &[f64]) -> f64 {
        self.law_at(theta).elastic.exponent
    }

    fn law_at(&self, theta: &[f64]) -> Parameters {
        let mut p = Physics::default();
        self.model.apply(theta, &mut p);
        p.law
    }

    /// How far away the free variables of FMUs are at `theta`, each in its measure; none of a rig built in.
    pub fn free(&self, theta: &[f64]) -> Vec<f64> {
        self.base.coordinates().map_or_else(Vec::new, |c| c.free(theta))
    }

    /// Raises ln of the force at the reference depth by `by`: of FMUs, by the free variable that scales it.
    pub fn raise(&self, theta: &mut [f64], by: f64) {
        match self.base.coordinates() {
            None => theta[0] += by,
            Some(c) => {
                if let Some(i) = c.scale {
                    let (lower, upper) = c.bounds(i);
                    theta[i] = (theta[i] + by / c.force(i)).clamp(lower, upper);
                }
            }
        }
    }

    /// Changes the ratio of damping to stiffness of the contact's law of FMUs to `ratio`, s/m, by the free variable that moves it
    /// and little else; nothing where there is none.
    pub fn damp(&self, theta: &mut [f64], ratio: f64) {
        if let Some((i, at)) = self.base.coordinates().and_then(|c| c.damping_of(ratio)) {
            theta[i] = at;
        }
    }

    /// Changes the exponent of the contact's law by `by`, the force at the reference depth held. Whether there is one to change.
    pub fn bend(&self, theta: &mut [f64], by: f64) -> bool {
        match self.base.coordinates() {
            None => {
                let q = &self.model.parameters[1];
                theta[1] = (theta[1] + by).clamp(q.lower + 0.05, q.upper - 0.05);
                true
            }
            Some(c) => c.bent(theta, by).map(|(i, at)| theta[i] = at).is_some(),
        }
    }

    /// ln of the force at the reference depth, N, at `theta`.
    pub(super) fn ln_force(&self, theta: &[f64]) -> f64 {
        let elastic = self.law_at(theta).elastic;
        elastic.stiffness.ln() + elastic.exponent * self.base.context.scales.x_ref.ln()
    }
}

/// The model of `base`, which FMUs simulate, with `added` terms: the coordinates of their free variables, the gains of the
/// instruments, terms.
pub(super) fn model_of_fmus(base: &Arc<Base>, machine: Arc<dyn Machine>, added: &[Term]) -> Model<'static> {
    let mut ps: Vec<Parameter> = Vec::new();
    let coordinates = Coordinates::new(machine.facts(), base.first_bond(), base.context.scales.x_ref);
    for (i, f) in machine.facts().free.iter().enumerate() {
        let (lower, upper) = coordinates.bounds(i);
        let plain = Parameter { name: f.name.clone(), lower, upper, step: 1e-3, prior: None, dynamic: true };
        ps.push(match f.tolerance {
            Some(sd) => Parameter { prior: Some((0.0, sd)), lower: -WIDEST * sd, upper: WIDEST * sd, ..plain },
            None => plain,
        });
    }
    let gains = base.gains(&mut ps);
    let mut spans = Vec::new();
    for t in added {
        spans.push(ps.len());
        let named = |q: &Parameter| Parameter { name: format!("{}: {}", t.mechanism.name, q.name), ..q.clone() };
        ps.extend(t.form.parameters.iter().map(named));
    }
    let bond = added.iter().find(|t| t.acts()).map_or(base.first_bond(), |t| t.bond);
    let (base, all) = (base.clone(), added.to_vec());
    Model::new(ps, move |th: &[f64], p: &mut Physics| {
        let facts = machine.facts();
        p.free[..facts.free.len()].copy_from_slice(&coordinates.free(th));
        p.bond = bond;
        p.gravity = facts.gravity;
        p.mass = facts.bonds.get(bond).map_or(base.mass, |b| b.mass.of(&p.free).exp());
        let law = facts.bonds.get(bond).and_then(|b| b.law);
        p.law = law.map_or_else(|| Parameters::power_law(0.0, 1.0, 0.0), |l| l.of(&p.free));
        for (i, c) in &gains {
            p.force_gain.channel[*c] = th[*i].exp();
        }
        for (t, at) in all.iter().zip(&spans) {
            t.form.apply(&th[*at..*at + t.form.parameters.len()], &base.context, p);
        }
    })
}
