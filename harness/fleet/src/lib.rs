//! Fleets: many campaigns, answered by many processes on one machine or several, and what they show together.
//!
//! Processes share one folder of answers and talk through files in it alone: each answer appears whole or not at all, and
//! what is known of campaigns without an answer stands in [`register`]'s hidden folder. So no process has to outlive another,
//! and whoever reads the folder at any time sees the same.

pub mod answers;
pub mod growth;
pub mod register;
pub mod shard;
pub mod statistics;
pub mod table;

/// The name of the file that sums a fleet up.
pub const SUMMARY: &str = "fleet.json";

pub use answers::{Answer, Fleet, Judged, Named, State};
