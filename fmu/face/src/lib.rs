//! The FMI 2.0 co-simulation interface over any [`Model`]: the C functions, the life cycle, states, the log, and the
//! block of start values.
//!
//! A model implements [`Model`] and calls [`export!`] once in its own library. Another version of the standard is a
//! module beside [`fmi2`].
//!
//! Invariant: all `unsafe` of the FMUs is in this crate; no panic leaves a call; the host's logger is called only while
//! nothing of the instance is borrowed.

mod arrays;
pub mod bytes;
#[cfg(feature = "drive")]
pub mod drive;
mod export;
pub mod fmi2;
pub mod life;
mod log;
pub mod memory;
pub mod model;
pub mod start;
#[cfg(test)]
mod tests;

pub use life::{error, Life, Outcome, Phase, Refusal};
pub use model::{checked, Kind, Model};
