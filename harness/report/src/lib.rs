//! Typed results to pages, words and files: of runs, of fits, of diagnoses, of fleets.

pub mod diagnosis;
pub mod fit;
pub mod fleet;
pub mod run;
pub mod trace;
