//! The forward model of a recording: rig, contact law and measuring chain.
//!
//! `element` is what stands in for the contact, `integrate` and `simulate` say what the rig does, `chain` what the
//! instruments make of it, `noise` how they scatter, `recipe` writes a campaign simulated with seeded noise.

pub mod chain;
pub mod element;
pub mod integrate;
pub mod kernels;
pub mod noise;
pub mod recipe;
mod rig;
pub mod roots;
pub mod simulate;
pub mod tableau;

pub use rig::motion;
