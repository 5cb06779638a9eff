//! HysteresisContact: the contact law behind the FMI 2.0 interface of [`face`].
//!
//! Invariant: physics stands in [`law`] only; the modules here name, count and carry, and hold no formula.
#![deny(unsafe_code)]

pub mod instance;
pub mod start;
pub mod state;
pub mod variables;

face::export!(instance::Instance);
