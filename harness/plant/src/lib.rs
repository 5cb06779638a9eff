//! The forward model of a recording: rig, contact law and measuring chain.
//!
//! `element` is what stands in for the contact; `integrate` is the one integrator, whose events `roots` locates;
//! `coupled` is the motion where FMUs simulate it, each a [`machine::Machine`]'s; `motion` follows the rig from event to event, as a scenario does, `simulate` gives what a recording of it holds;
//! `tangent` is how that changes with forces that are learned,
//! `chain` is what the instruments make of it, `noise` how they scatter, `recipe` writes a campaign simulated with
//! seeded noise.

pub mod chain;
mod coupled;
pub mod element;
pub mod integrate;
pub mod kernels;
pub mod machine;
pub mod noise;
pub mod recipe;
mod rig;
pub mod roots;
pub mod setup;
pub mod simulate;
pub mod squares;
mod tableau;
pub mod tangent;

pub use rig::motion;
