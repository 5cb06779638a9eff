//! The forward model of a campaign: rig, contact law and measuring chain, and its estimation.
//!
//! `physics` says what there is, `wear` what earlier recordings did to it, `integrate` and `simulate` what it does, `chain` what the
//! instruments make of it, `noise` how they scatter, `estimate` which parameters fit.

pub mod chain;
pub mod estimate;
pub mod integrate;
mod kernels;
pub mod noise;
pub mod physics;
mod rig;
pub mod simulate;
pub mod wear;
