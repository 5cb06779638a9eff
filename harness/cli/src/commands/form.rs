//! How a command's answer is printed.

use anyhow::Result;
use serde::Serialize;

/// The form of an answer, of every command whose answer is data.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct Form {
    /// Print the answer as JSON, in SI units
    #[arg(long, display_order = 900)]
    pub json: bool,
}

impl Form {
    /// The answer as it is to be printed: as JSON where that was asked for, else in `words`.
    ///
    /// # Errors
    /// Where it cannot be written as JSON.
    pub fn of<T: Serialize>(self, value: &T, words: impl FnOnce(&T) -> String) -> Result<String> {
        if self.json {
            return Ok(serde_json::to_string_pretty(value)? + "\n");
        }
        Ok(words(value))
    }
}
