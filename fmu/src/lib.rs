//! HysteresisContact: the contact law and its FMI 2.0 co-simulation face.
//!
//! Invariant: physics stands in [`law`] only; the modules beside it name, count and carry, and hold no formula.
pub mod fmi2;
pub mod instance;
pub mod life;
pub mod start;
pub mod state;
pub mod variables;
