//! The forces on the body that were found, as an FMU to be put between the contact and the body: BodyForce.

use crate::holding;
use crate::next::plain;
use anyhow::Result;
use body_force_variables::{Forces, Settings, PARAMETERS, PARAMETER_TABLE};
use estimate::fitted::Fitted;
use law::body::LearnedForce;
use mechanisms::learned_force;
use mechanisms::mechanism::{Acts, Mechanism, Origin};
use pack::{Binary, Model};
use std::path::Path;

/// The packed forces.
pub struct PackedBody {
    /// The bytes of BodyForce.fmu.
    pub fmu: Vec<u8>,
    pub holds: OnBody,
}

/// What BodyForce.fmu holds.
#[derive(Clone, Debug, PartialEq)]
pub struct OnBody {
    /// Its mechanisms.
    pub names: Vec<&'static str>,
    /// Start values that differ from the FMU's defaults: name, value, unit.
    pub starts: Vec<(&'static str, f64, &'static str)>,
}

impl OnBody {
    /// The forces that the FMU holds, in words.
    pub fn words(&self) -> String {
        let word = |name: &&str| match *name {
            name if name == learned_force::MECHANISM.name => "the force that was learned".to_string(),
            name => plain(name),
        };
        self.names.iter().map(word).collect::<Vec<_>>().join(" and ")
    }
}

/// Whether a mechanism acts as a force on the body.
pub fn is_force_on_body(m: &Mechanism) -> bool {
    m.origin == Origin::Motion && matches!(m.acts, Acts::Force)
}

/// The forces that they are, as `f` has them.
fn forces(f: &Fitted, names: &[&str]) -> Forces {
    let p = f.physics();
    let learned = holding::law(f).1;
    let mut all =
        Forces { learned, travel: f.data.records.first().map_or(0.0, |r| r.setup.travel), ..Forces::default() };
    for name in names {
        match *name {
            "guide_friction" => all.friction = p.guide_friction,
            "fluid_drag" => all.drag = p.fluid_drag,
            "return_spring" => all.spring = p.return_spring,
            "residual_magnetism" => all.magnet = p.residual_magnetism,
            "squeeze_film" => all.film = p.squeeze_film,
            "gravity" => all.weight = p.mass * p.gravity,
            _ => {}
        }
    }
    all
}

/// The FMU's libraries: those in `platforms`, which may have been given for the element alone, or else where
/// [`Model::libraries`] looks.
///
/// # Errors
/// As [`Model::libraries`].
pub fn libraries(platforms: Option<&Path>) -> Result<Vec<Binary>> {
    let model = Model::body_force();
    model.libraries(platforms).or_else(|_| model.libraries(None))
}

/// Packs the forces on the body that `f` has beside the simulation as given, with the libraries in `platforms`; None where it has
/// none. What stands in for something else is no name: it counts as learned.
///
/// # Errors
/// As [`libraries`] and [`Model::archive`].
pub fn packed_body(f: &Fitted, platforms: Option<&Path>) -> Result<Option<PackedBody>> {
    let terms = f.structure.terms().iter().map(|t| t.mechanism).filter(|m| is_force_on_body(m));
    let (named, others): (Vec<&Mechanism>, Vec<&Mechanism>) = terms.partition(|m| m.named);
    let mut names: Vec<&str> = named.iter().map(|m| m.name).collect();
    let all: Vec<&str> = named.iter().chain(&others).map(|m| m.name).collect();
    let forces = forces(f, &all);
    if !others.is_empty() || forces.learned != LearnedForce::default() {
        names.push(learned_force::MECHANISM.name);
    }
    if names.is_empty() {
        return Ok(None);
    }
    let (settings, plain) = (forces.settings(), Settings::default());
    let all = |i: usize| (PARAMETER_TABLE[i].name, settings.get(i), PARAMETER_TABLE[i].unit);
    let starts: Vec<_> = (0..PARAMETERS).filter(|i| settings.get(*i) != plain.get(*i)).map(all).collect();
    let given: Vec<(String, f64)> = starts.iter().map(|(name, value, _)| (name.to_string(), *value)).collect();
    Ok(Some(PackedBody {
        fmu: Model::body_force().archive(&given, &libraries(platforms)?)?,
        holds: OnBody { names, starts },
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use mechanisms::ALL;

    #[test]
    fn every_force_on_the_body_is_one_that_the_fmu_holds() {
        let on_body = ALL.iter().filter(|m| m.named && is_force_on_body(m));
        let mut held: Vec<&str> = on_body.map(|m| m.name).collect();
        held.sort_unstable();
        let all = ["fluid_drag", "gravity", "guide_friction", "residual_magnetism", "return_spring", "squeeze_film"];
        assert_eq!(held, all, "give BodyForce and `forces` what is new here");
    }
}
