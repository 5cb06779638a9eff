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

impl std::fmt::Display for Value {
    /// As TOML has it.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Value::Boolean(b) => write!(f, "{b}"),
            Value::Integer(n) => write!(f, "{n}"),
            Value::Real(x) => write!(f, "{x:?}"),
            Value::Text(t) => write!(f, "{}", toml::Value::String(t.clone())),
        }
    }
}
