//! Every mechanism the diagnosis knows: those of the contact as the law declares them, the others a file each.

pub mod contact;
pub mod mechanism;
pub mod physics;
pub mod wear;

use contact::CONTACT;
use mechanism::Mechanism;

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
mod jam;
mod latent_force;
mod loose_part;
mod lowpass_lag;
mod residual_magnetism;
mod return_spring;
mod ripple;
mod sensor_resonance;
mod squeeze_film;

/// All of them: those of the vocabulary first, the contact's at their head, then the stand-ins for the unknown.
pub const ALL: &[Mechanism] = &all();

const fn all() -> [Mechanism; CONTACT.len() + OTHERS.len()] {
    let mut all = [OTHERS[0]; CONTACT.len() + OTHERS.len()];
    let mut i = 0;
    while i < all.len() {
        all[i] = if i < CONTACT.len() { CONTACT[i] } else { OTHERS[i - CONTACT.len()] };
        i += 1;
    }
    all
}

/// Those of the motion, the measuring chain and beyond.
const OTHERS: &[Mechanism] = &[
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
