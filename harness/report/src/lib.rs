//! Pages of what was run.
pub mod run;
