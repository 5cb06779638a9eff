//! What a long estimation may use of time, and who may end it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// When an estimation has to end. It travels with the data, so that every fit of them ends in time, with what it has.
#[derive(Clone, Copy, Debug, Default)]
pub struct Budget {
    /// Set when the user wants an end; None: nobody asks.
    pub stop: Option<&'static AtomicBool>,
    /// When time is up; None: never.
    pub deadline: Option<Instant>,
}

/// Why an estimation had to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// The user asked for it.
    Interrupted,
    /// Its time was up.
    TimeIsUp,
}

impl std::fmt::Display for Ended {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Ended::Interrupted => "interrupted",
            Ended::TimeIsUp => "time is up",
        })
    }
}

impl Budget {
    /// Why the work has to end now, if it has to.
    pub fn over(&self) -> Option<Ended> {
        if self.stop.is_some_and(|s| s.load(Ordering::SeqCst)) {
            Some(Ended::Interrupted)
        } else if self.deadline.is_some_and(|d| Instant::now() >= d) {
            Some(Ended::TimeIsUp)
        } else {
            None
        }
    }
}
