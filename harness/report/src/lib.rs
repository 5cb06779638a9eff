//! Typed results to pages, words and files: of runs, of fits, of diagnoses.

pub mod diagnosis;
pub mod fit;
pub mod run;
