//! touchdown's library: scenario -> host -> record -> model -> fit -> diagnose -> report.
pub mod bench;
pub mod demo;
pub mod diagnose;
pub mod files;
pub mod fit;
pub mod host;
pub mod master;
pub mod model;
pub mod pack;
pub mod progress;
pub mod record;
pub mod report;
pub mod scenario;
pub mod study;
pub mod tableau;
