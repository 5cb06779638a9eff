//! Estimation of a campaign's parameters from its recordings.

mod budget;
pub mod case;
pub mod condition;
mod coupling;
pub mod course;
pub mod descent;
pub mod discrepancy;
pub mod evidence;
pub mod fitted;
pub mod flat;
pub mod impact;
pub mod levels;
pub mod paper;
pub mod prepare;
pub mod problem;
pub mod response;
mod ring;
pub mod scan;
pub mod simplex;
pub mod smooth;
pub mod starts;
pub mod structure;
pub mod usable;
pub mod vertices;
mod watch;
pub mod window;

pub use budget::{Budget, Ended};
pub use watch::Watch;
