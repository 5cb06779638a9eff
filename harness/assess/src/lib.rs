//! What signals of impacts, measured and simulated, are judged by: channel frequency class filters, shock response
//! spectra, the objective rating of ISO/TS 18571, pulses and bounces. Numbers in, numbers out: no files.

pub mod bounces;
pub mod cfc;
pub mod pulse;
pub mod rating;
pub mod sampling;
pub mod srs;
mod warp;
