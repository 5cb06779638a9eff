//! Estimation of the law from recordings.

pub mod answer;
pub mod course;
pub mod descent;
pub mod estimate;
pub mod levels;
pub mod paper;
pub mod prepare;
pub mod scan;
pub mod simplex;
pub mod vertices;
mod watch;

pub use watch::Watch;
