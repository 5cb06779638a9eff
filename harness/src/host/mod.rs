//! What stands in for the contact while a scenario runs: the law called directly, or an FMU.

pub mod element;

pub use element::{Direct, Element};
