//! Diagnosis: where the simulation misses the recordings, which physics is missing, and how much better it fits.

pub mod answer;
pub mod decide;
pub mod heldout;
pub mod mechanism;
pub mod mechanisms;
pub mod run;
pub mod search;

pub use crate::fit::prepare;
