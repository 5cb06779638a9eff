//! The vocabulary: every mechanism in a file of its own, with its equation, source and forms, and the part that it adds
//! to the physics.
//!
//! A new mechanism is a file and its line in `parts!` below.

pub mod catalogue;
pub mod constants;
pub mod contact;
pub mod load_history;
pub mod mechanism;
pub mod part;
pub mod physics;
pub mod signal;
pub mod wear;

use contact::CONTACT;
use mechanism::Mechanism;

/// The mechanisms that act beside the contact law, in the order in which they act: the module, and where it has a part of
/// its own, the field of [`physics::Physics`] and the part. Hands the list to the macro named.
macro_rules! parts {
    ($list:ident) => {
        $list! {
            cyclic_softening => cyclic_softening: cyclic_softening::CyclicSoftening;
            cyclic_hardening => cyclic_hardening: cyclic_hardening::CyclicHardening;
            residual_magnetism => residual_magnetism: residual_magnetism::ResidualMagnetism;
            guide_friction => guide_friction: guide_friction::GuideFriction;
            fluid_drag => fluid_drag: fluid_drag::FluidDrag;
            squeeze_film => squeeze_film: squeeze_film::SqueezeFilm;
            return_spring => return_spring: return_spring::ReturnSpring;
            gravity;
            base_compliance => base_compliance: base_compliance::BaseCompliance;
            loose_part => loose_part: loose_part::LoosePart;
            attached_mass => attached_mass: attached_mass::AttachedMass;
            sensor_resonance => sensor_resonance: sensor_resonance::Tip;
            lowpass_lag => low_pass: Option<lowpass_lag::LowPass>;
            charge_droop => charge_droop: charge_droop::ChargeDroop;
            channel_skew => channel_skew: channel_skew::ChannelSkew;
            bent_scale => bent_scale: bent_scale::BentScale;
            force_gain => force_gain: force_gain::ForceGain;
            clipping => clipping: clipping::Clipping;
            fracture => fracture: fracture::Fracture;
            jam => jam: jam::Jam;
            ripple => ripple: ripple::Ripple;
            latent_force => latent_force: latent_force::LatentForce;
            learned_force => learned_forces: learned_force::LearnedForces;
        }
    };
}
pub(crate) use parts;

pub mod attached_mass;
pub mod base_compliance;
pub mod bent_scale;
pub mod channel_skew;
pub mod charge_droop;
pub mod clipping;
pub mod cyclic_hardening;
pub mod cyclic_softening;
pub mod fluid_drag;
pub mod force_gain;
pub mod fracture;
pub mod gravity;
pub mod guide_friction;
pub mod jam;
pub mod latent_force;
pub mod learned_force;
pub mod loose_part;
pub mod lowpass_lag;
pub mod residual_magnetism;
pub mod return_spring;
pub mod ripple;
pub mod sensor_resonance;
pub mod squeeze_film;

macro_rules! all {
    ($($module:ident $(=> $field:ident: $part:ty)?;)*) => {
        /// All mechanisms: those of the contact law, then those that act beside it.
        pub const ALL: &[Mechanism] = &all();

        /// Those that act beside the contact law.
        const BESIDE: &[Mechanism] = &[$($module::MECHANISM),*];
    };
}
parts!(all);

const fn all() -> [Mechanism; CONTACT.len() + BESIDE.len()] {
    let mut all = [BESIDE[0]; CONTACT.len() + BESIDE.len()];
    let mut i = 0;
    while i < all.len() {
        all[i] = if i < CONTACT.len() { CONTACT[i] } else { BESIDE[i - CONTACT.len()] };
        i += 1;
    }
    all
}

/// [`ALL`], none of which gives a name.
static STAND_INS: [Mechanism; ALL.len()] = stand_ins();

const fn stand_ins() -> [Mechanism; ALL.len()] {
    let mut all = all();
    let mut i = 0;
    while i < all.len() {
        all[i].named = false;
        i += 1;
    }
    all
}

/// `mechanism` as one that gives no name: its form stands in for something else.
pub fn stand_in(mechanism: &'static Mechanism) -> &'static Mechanism {
    STAND_INS.iter().find(|m| m.name == mechanism.name).unwrap_or(mechanism)
}

/// The mechanism of that name.
pub fn named(name: &str) -> Option<&'static Mechanism> {
    ALL.iter().find(|m| m.name == name)
}

/// Names of the mechanisms that a simulation may list as its terms: all that have a name in the vocabulary.
pub fn terms() -> Vec<&'static str> {
    ALL.iter().filter(|m| m.named).map(|m| m.name).collect()
}
