//! Every mechanism the diagnosis knows, a file each.

pub mod constants;
pub mod mechanism;
pub mod physics;
pub mod wear;

use mechanism::Mechanism;

mod adhesion;
mod base_compliance;
mod bent_scale;
mod channel_skew;
mod charge_droop;
mod clipping;
mod cyclic_softening;
mod fluid_drag;
mod force_gain;
mod fracture;
mod gravity;
mod guide_friction;
mod hysteresis_damping;
mod jam;
mod latent_force;
mod loose_part;
mod lowpass_lag;
mod plastic_indentation;
mod residual_magnetism;
mod return_spring;
mod ripple;
mod secondary_stiffening;
mod sensor_resonance;
mod squeeze_film;
mod viscoelastic_relaxation;
mod viscous_damping;

/// All of them: those of the vocabulary first, then the stand-ins for the unknown.
pub const ALL: &[Mechanism] = &[
    hysteresis_damping::MECHANISM,
    viscous_damping::MECHANISM,
    plastic_indentation::MECHANISM,
    adhesion::MECHANISM,
    viscoelastic_relaxation::MECHANISM,
    secondary_stiffening::MECHANISM,
    cyclic_softening::MECHANISM,
    gravity::MECHANISM,
    guide_friction::MECHANISM,
    fluid_drag::MECHANISM,
    squeeze_film::MECHANISM,
    base_compliance::MECHANISM,
    loose_part::MECHANISM,
    return_spring::MECHANISM,
    residual_magnetism::MECHANISM,
    sensor_resonance::MECHANISM,
    charge_droop::MECHANISM,
    lowpass_lag::MECHANISM,
    channel_skew::MECHANISM,
    clipping::MECHANISM,
    force_gain::MECHANISM,
    fracture::MECHANISM,
    bent_scale::MECHANISM,
    ripple::MECHANISM,
    jam::MECHANISM,
    latent_force::MECHANISM,
];
