//! Estimation of the law from recordings.

pub mod prepare;
