//! A structure whose recordings FMUs simulate: where mechanisms may act, its parameters, and the law of its contact.

use super::{Base, Structure, Term, WIDEST};
use crate::problem::{Model, Parameter};
use law::Parameters;
use mechanisms::mechanism::{Form, Origin};
use mechanisms::physics::Physics;
use plant::machine::{BondFacts, Machine};
use std::sync::Arc;

/// Change of the exponent with a variable from which that is taken to bend the law: a mass or a stiffness does a little, as its law
/// is found from steps of some length.
const BENDS: f64 = 0.05;

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

    /// Raises ln of the force at the reference depth by `by`: of FMUs, by the least change of the free variables that does.
    pub fn raise(&self, theta: &mut [f64], by: f64) {
        let Some(m) = &self.base.machine else {
            theta[0] += by;
            return;
        };
        if by == 0.0 {
            return;
        }
        let facts = m.facts();
        let Some(law) = facts.bonds.get(self.base.first_bond()).and_then(|b| b.law) else { return };
        let n = facts.free.len();
        let ln_x = self.base.context.scales.x_ref.ln();
        let slopes: Vec<f64> = (0..n).map(|i| law.stiffness.slopes[i] + ln_x * law.exponent.slopes[i]).collect();
        // what scales the force alone comes before what also bends it
        let weight = |i: usize| {
            if law.exponent.slopes[i].abs() > 1e-3 || facts.free[i].tolerance.is_some() {
                0.0
            } else {
                slopes[i]
            }
        };
        let square: f64 = (0..n).map(|i| weight(i) * slopes[i]).sum();
        if square > 0.0 {
            (0..n).for_each(|i| theta[i] += by * weight(i) / square);
        }
    }

    /// Changes the ratio of damping to stiffness of the contact's law to `ratio`, s/m, by the free variable that moves it and
    /// little else; nothing where there is none.
    pub fn damp(&self, theta: &mut [f64], ratio: f64) {
        let Some(m) = &self.base.machine else { return };
        let facts = m.facts();
        let Some(law) = facts.bonds.get(self.base.first_bond()).and_then(|b| b.law) else { return };
        let at = law.damping.at;
        let moves_it_alone = |i: &usize| {
            let (stiffness, exponent) = (law.stiffness.slopes[*i].abs(), law.exponent.slopes[*i].abs());
            law.damping.slopes[*i].abs() > 1e-3 * at && stiffness < BENDS && exponent < BENDS
        };
        let Some(i) = (0..facts.free.len()).find(moves_it_alone).filter(|_| at > 0.0) else { return };
        let others: f64 = (0..facts.free.len()).filter(|j| *j != i).map(|j| law.damped(j, theta[j])).product();
        let factor = ratio / (at * others);
        let change = if law.straight[i] { factor - 1.0 } else { factor.ln() };
        let q = &self.model.parameters[i];
        theta[i] = (change * at / law.damping.slopes[i]).clamp(q.lower, q.upper);
    }

    /// Changes the exponent of the contact's law by `by`, the force at the reference depth held. Whether there is one to change.
    pub fn bend(&self, theta: &mut [f64], by: f64) -> bool {
        let free = match &self.base.machine {
            None => Some((1, 1.0)),
            Some(m) => {
                let law = m.facts().bonds.get(self.base.first_bond()).and_then(|b| b.law);
                law.and_then(|l| {
                    (0..m.facts().free.len()).map(|i| (i, l.exponent.slopes[i])).find(|(_, s)| s.abs() > BENDS)
                })
            }
        };
        let Some((i, slope)) = free else { return false };
        let q = &self.model.parameters[i];
        let force = self.ln_force(theta);
        let margin = 0.05 / slope.abs();
        if q.upper - q.lower < 2.0 * margin {
            return false;
        }
        theta[i] = (theta[i] + by / slope).clamp(q.lower + margin, q.upper - margin);
        if self.base.machine.is_some() {
            self.raise(theta, force - self.ln_force(theta));
        }
        true
    }

    /// ln of the force at the reference depth, N, at `theta`.
    pub(super) fn ln_force(&self, theta: &[f64]) -> f64 {
        let elastic = self.law_at(theta).elastic;
        elastic.stiffness.ln() + elastic.exponent * self.base.context.scales.x_ref.ln()
    }
}

/// The model of `base`, which FMUs simulate, with `added` terms: their free variables, the gains of the instruments, terms.
pub(super) fn model_of_fmus(base: &Arc<Base>, machine: Arc<dyn Machine>, added: &[Term]) -> Model<'static> {
    let mut ps: Vec<Parameter> = Vec::new();
    for f in &machine.facts().free {
        let (lower, upper) = (f.away(f.bounds.0), f.away(f.bounds.1));
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
        p.free[..facts.free.len()].copy_from_slice(&th[..facts.free.len()]);
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
