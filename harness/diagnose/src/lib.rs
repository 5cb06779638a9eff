//! Diagnosis: where the simulation misses the recordings, which physics is missing, and how much better it fits.

pub mod alarm;
pub mod bias;
pub mod bootstrap;
pub mod candidate;
pub mod decide;
pub mod element;
pub mod expand;
pub mod experiment;
pub mod figure;
pub mod findings;
pub mod fit_out;
pub mod heldout;
mod impulse;
pub mod intervals;
pub mod latent;
pub mod map;
pub mod phases;
pub mod plausible;
pub mod rivals;
pub mod run;
pub mod search;
pub mod second;
pub mod sensors;
pub mod sift;
pub mod unclipped;
pub mod verdict;
mod weigh;
