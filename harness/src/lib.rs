//! touchdown's library: scenario -> host -> record -> model -> fit -> diagnose -> report.
pub mod diagnose;
pub mod model;
pub mod record;
pub mod report;
