//! Studies: what a method is worth, measured against exact answers.

pub mod coupling;
mod setups;
mod table;
