//! A value as files set it.

use schemars::JsonSchema;
use serde::Deserialize;

/// A value that a file sets.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Value {
    /// Of a Boolean.
    Boolean(bool),
    /// Of an Integer, Enumeration or Real.
    Integer(i64),
    /// Of a Real.
    Real(f64),
    /// Of a String, or the item's name of an Enumeration.
    Text(String),
}
