//! One case for every tip, drop height and comparison a scenario asks for.

use super::contact::{Contact, Variables};
use super::file::{Compare, Kind, Model, PhotoInterrupters, Scenario, Tip};
use super::rig::{Bodies, Link, Rig, Spring};
use super::GRAVITY;
use host::Value;
use law::Parameters;
use mechanisms::physics::Physics;
use mechanisms::residual_magnetism::ResidualMagnetism;
use std::path::PathBuf;

/// How a case begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// At rest this far above the stop, m.
    Fall(f64),
    /// At touch with this speed, m/s.
    Touch(f64),
    /// At rest where the contactor's bar is held.
    Held,
}

/// One run.
#[derive(Clone, Debug)]
pub struct Case {
    /// What distinguishes it from the others; empty for the only one.
    pub name: String,
    /// Its tip's name.
    pub tip: Option<String>,
    /// The comparison it belongs to; None for the scenario's own stiffness.
    pub compare: Option<String>,
    /// What moves.
    pub rig: Rig,
    /// How it begins.
    pub start: Start,
    /// The contact.
    pub law: Parameters,
    /// Parameters of the law that the file gives, by name: what an FMU of somebody else's gets.
    pub given: Vec<(String, f64)>,
    /// FMU of somebody else's, if any; a path from the scenario's folder, as the file gives it.
    pub fmu: Option<PathBuf>,
    /// Names of that FMU's variables.
    pub variables: Variables,
    /// Further parameters of that FMU by its own names.
    pub parameters: Vec<(String, Value)>,
    /// Macro-step over which that FMU's force is held, s.
    pub macro_step: Option<f64>,
    /// Impacts at most.
    pub impacts: usize,
    /// Rebound height taken as rest, m.
    pub rest_height: f64,
    /// Photo interrupters.
    pub interrupters: Option<PhotoInterrupters>,
}

impl Case {
    /// Drop height, m, for a fall.
    pub fn drop_height(&self) -> Option<f64> {
        match self.start {
            Start::Fall(h) => Some(h),
            _ => None,
        }
    }

    /// How far it moves before touch, m.
    pub fn way(&self) -> Option<f64> {
        self.drop_height().or(self.rig.spring.map(|s| s.travel))
    }

    /// Whether nothing but the plain law, and no FMU of somebody else's, acts on one body from touch on, so that
    /// law::impact knows the answer.
    pub fn is_free_and_plain(&self) -> bool {
        let r = &self.rig;
        let free = r.count() == 1 && r.gravity_after == 0.0 && !r.acts_on_the_way() && r.spring.is_none();
        free && self.fmu.is_none() && self.law.is_power_law()
    }
}

impl Scenario {
    /// Every run the file asks for: tips, within them heights, within them the own stiffness and the comparisons.
    pub fn cases(&self) -> Vec<Case> {
        let tips: Vec<Option<&Tip>> =
            if self.tip.is_empty() { vec![None] } else { self.tip.iter().map(Some).collect() };
        let starts: Vec<Start> = match (self.kind, self.impact_speed) {
            (Kind::ContactorOpening, _) => vec![Start::Held],
            (_, Some(v)) => vec![Start::Touch(v)],
            _ => self.heights().into_iter().map(Start::Fall).collect(),
        };
        let none = Contact::default();
        let mut all = Vec::new();
        for tip in tips {
            let contact = tip.map(|t| &t.contact).or(self.contact.as_ref()).unwrap_or(&none);
            // checked when the file was read
            let law = contact.parameters().unwrap_or_default();
            for start in &starts {
                for other in std::iter::once(None).chain(self.compare.iter().map(Some)) {
                    let mut words = Vec::new();
                    words.extend(tip.map(|t| t.name.clone()));
                    if let (Start::Fall(h), true) = (start, starts.len() > 1) {
                        words.push(format!("{h} m"));
                    }
                    words.extend(other.map(|c| c.name.clone()).or(contact.name.clone()));
                    all.push(Case {
                        name: words.join(", "),
                        tip: tip.map(|t| t.name.clone()),
                        compare: other.map(|c| c.name.clone()),
                        rig: self.rig(tip),
                        start: *start,
                        given: given(contact, other),
                        law: other.map_or(law, |c| with_stiffness(&law, c)),
                        fmu: contact.fmu.clone(),
                        variables: contact.variables.clone(),
                        parameters: contact.parameters.clone().into_iter().collect(),
                        macro_step: contact.macro_step,
                        impacts: self.most_impacts(),
                        rest_height: self.rest_height,
                        interrupters: self.photo_interrupters,
                    });
                }
            }
        }
        all
    }

    fn rig(&self, tip: Option<&Tip>) -> Rig {
        let own = tip.map_or(0.0, |t| t.mass);
        let bodies = match (self.model, &self.masses, &self.sensors) {
            (Model::ThreeMass, Some(m), Some(s)) => {
                let tip = if own > 0.0 { own } else { m.tip };
                let link =
                    |k: f64, mass: f64, ratio: f64| Link { stiffness: k, damping: 2.0 * ratio * (k * mass).sqrt() };
                Bodies::Three {
                    accelerometer: m.accelerometer,
                    body: m.body,
                    tip,
                    accelerometer_spring: link(
                        s.accelerometer_stiffness,
                        m.accelerometer,
                        s.accelerometer_damping_ratio,
                    ),
                    transducer: link(s.transducer_stiffness, tip, s.transducer_damping_ratio),
                }
            }
            _ => Bodies::One(self.moving_mass(tip)),
        };
        let after = if self.gravity { GRAVITY } else { 0.0 };
        let contactor = self.kind == Kind::ContactorOpening;
        let mut parts = Physics::default();
        parts.guide_friction.coulomb = self.guide_friction;
        if contactor && self.holding_force > 0.0 {
            parts.residual_magnetism =
                ResidualMagnetism { force: self.holding_force, gap: f64::INFINITY, time: self.holding_time };
        }
        self.motion.put(&mut parts);
        Rig {
            bodies,
            gravity_before: if contactor { after } else { GRAVITY },
            gravity_after: after,
            parts,
            spring: contactor.then_some(Spring {
                travel: self.travel,
                preload: self.spring_preload,
                rate: self.return_spring_rate,
            }),
        }
    }
}

fn given(contact: &Contact, other: Option<&Compare>) -> Vec<(String, f64)> {
    let mut all = contact.given();
    if contact.faces.is_some() || other.is_some() {
        let law = contact.parameters().unwrap_or_default();
        let law = other.map_or(law, |c| with_stiffness(&law, c));
        all.retain(|(n, _)| n != "stiffness" && n != "exponent");
        all.extend([("stiffness".to_string(), law.elastic.stiffness), ("exponent".to_string(), law.elastic.exponent)]);
    }
    all
}

fn with_stiffness(law: &Parameters, c: &Compare) -> Parameters {
    let k = c.faces.as_ref().and_then(|f| f.stiffness().ok()).or(c.stiffness);
    let mut law = *law;
    law.elastic.stiffness = k.unwrap_or(law.elastic.stiffness);
    law
}
