//! Estimation of a campaign's parameters from its recordings.

pub mod answer;
pub mod case;
pub mod course;
pub mod descent;
pub mod levels;
pub mod paper;
pub mod prepare;
pub mod problem;
pub mod scan;
pub mod simplex;
pub mod vertices;
mod watch;

pub use watch::Watch;
