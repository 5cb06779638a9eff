//! Why a call of an FMU's function has no good answer, before anyone knows of which instance it is.

use super::error::Discarded;
use super::status::Status;
use serde::{Deserialize, Serialize};

/// Why a call has no good answer.
#[derive(Debug, Serialize, Deserialize)]
pub(super) enum Trouble {
    /// The function answered neither fmi2OK nor fmi2Warning.
    Answered {
        /// Its answer.
        status: u32,
        /// What the host knows beside it.
        detail: String,
        /// For a discarded fmi2DoStep.
        discarded: Option<Discarded>,
    },
    /// The binary has no such function.
    Missing,
    /// It was asked for what cannot be.
    Misuse(String),
    /// The FMU's process ended, or was ended: how.
    Died(String),
}

/// What a call that answers nothing but a status comes to.
pub(super) type Answer = Result<(), Box<Trouble>>;

/// The answer that a status is.
#[cold]
pub(super) fn judge(status: u32) -> Answer {
    match Status::from(status) {
        Status::Ok | Status::Warning => Ok(()),
        _ => Err(Box::new(Trouble::Answered { status, detail: String::new(), discarded: None })),
    }
}

/// That it was asked for what cannot be.
pub(super) fn misuse(why: impl Into<String>) -> Box<Trouble> {
    Box::new(Trouble::Misuse(why.into()))
}
