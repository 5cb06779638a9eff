//! What lets a long estimation be followed, bounded and stopped.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Follows an estimation: says how far it is, and whether it has to end.
pub struct Watch<'a> {
    /// Set when the user wants an end.
    pub stop: &'a AtomicBool,
    /// When time is up; None: never.
    pub deadline: Option<Instant>,
    /// Takes a line of progress.
    pub say: &'a (dyn Fn(&str) + Sync),
}

impl Watch<'_> {
    /// Why the work has to end now, if it has to.
    pub fn over(&self) -> Option<&'static str> {
        if self.stop.load(Ordering::SeqCst) {
            Some("interrupted")
        } else if self.deadline.is_some_and(|d| Instant::now() >= d) {
            Some("time is up")
        } else {
            None
        }
    }
}
