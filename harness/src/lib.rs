//! touchdown's library: scenario -> host -> record -> model -> fit -> diagnose -> report.
pub mod record;
pub mod report;
