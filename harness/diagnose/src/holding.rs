//! The law and the forces that the FMUs handed back hold: those of one of the fits of a diagnosis.

use crate::body::is_force_on_body;
use crate::decide::Decision;
use crate::gates::little_measured;
use crate::heldout::HeldOut;
use crate::next::words;
use estimate::fitted::Fitted;
use estimate::structure::Term;
use law::body::LearnedForce;
use law::Parameters;
use mechanisms::learned_force::Dependence;
use mechanisms::mechanism::{Mechanism, Origin};

/// The FMUs that hold a force learned in motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Holds {
    /// HysteresisContact.fmu.
    pub in_contact: bool,
    /// BodyForce.fmu.
    pub on_body: bool,
}

impl Holds {
    /// Whether any FMU holds it.
    pub fn any(self) -> bool {
        self.in_contact || self.on_body
    }
}

/// The FMUs that can hold the force that `d` has learned; None where they would do something else than the simulation with it:
/// what stands in beside it, or follows the order of the recordings, is in no FMU, or too little was measured.
pub fn learned(d: &Decision) -> Option<Holds> {
    let force = d.force()?;
    if little_measured(d).is_some() {
        return None;
    }
    let stands_in = |t: &Term| !t.mechanism.named && mechanisms::learned_force::MECHANISM.name != t.name();
    let others = || force.fitted.structure.terms().iter().filter(|t| stands_in(t)).map(|t| t.mechanism);
    let is_held = |m: &Mechanism| m.origin == Origin::Chain || can_be_held(m);
    if force.depends.contains(&Dependence::Order) || !others().all(is_held) {
        return None;
    }
    let is = |origin: Origin| force.depends.iter().any(|of| of.origin() == origin);
    let in_contact = is(Origin::Contact) || others().any(|m| pack::holds(m.name));
    let on_body = is(Origin::Motion) || others().any(is_force_on_body);
    (is(Origin::Contact) || is(Origin::Motion)).then_some(Holds { in_contact, on_body })
}

/// Whether one of our FMUs can hold a mechanism.
pub fn can_be_held(m: &Mechanism) -> bool {
    is_force_on_body(m) || pack::holds(m.name)
}

/// The equation that the FMUs hold in the place of a law learned of imposed motion, and what it predicts; None where there is none to
/// be relied on.
pub fn instead(d: &Decision, relied_on: bool) -> Option<&(Fitted, HeldOut)> {
    d.nearest.as_ref().filter(|_| relied_on)
}

/// That equation in words: which FMU holds it, and how well it predicts.
pub fn instead_words(d: &Decision, relied_on: bool) -> Option<String> {
    let (f, h) = instead(d, relied_on)?;
    let law = &d.learned.as_ref()?.heldout;
    let percent = |h: &HeldOut| 100.0 * h.predictions.misfit_of_compared(&d.base.data);
    let names = words(&f.names());
    let fmus = match f.structure.terms().iter().any(|t| is_force_on_body(t.mechanism)) {
        true => "HysteresisContact.fmu and BodyForce.fmu hold",
        false => "HysteresisContact.fmu holds",
    };
    Some(format!(
        "{fmus} {names} by equation, the nearest that there is: of the force that the fit did not see it misses {:.2} % of range, the law \
         learned {:.2} %, the simulation as given {:.2} %",
        percent(h),
        percent(law),
        percent(&d.before)
    ))
}

/// The fit whose law and forces the FMUs hold: the equation in the place of a law learned of imposed motion; with the force that was
/// learned where they can, as `holds` says; with the names where those are relied on; or else the simulation as given.
pub fn held(d: &Decision, holds: Holds, relied_on: bool) -> &Fitted {
    if let Some((nearest, _)) = instead(d, relied_on) {
        nearest
    } else if holds.any() {
        d.simulated()
    } else if relied_on && d.chosen.is_named() {
        &d.chosen
    } else {
        &d.base
    }
}

/// The contact law of a fit with what was learned between the faces, and what was learned on the body.
pub fn law(f: &Fitted) -> (Parameters, LearnedForce) {
    let p = f.physics();
    let (mut law, mut on_body) = (p.law, LearnedForce::default());
    for force in &p.learned_forces.0 {
        force.put(&mut law, &mut on_body);
    }
    (law, on_body)
}
