//! What lets a long estimation be followed, bounded and stopped.

use crate::budget::{Budget, Ended};

/// Follows an estimation: says how far it is, and whether it has to end.
pub struct Watch<'a> {
    pub budget: Budget,
    /// Takes a line of progress.
    pub say: &'a (dyn Fn(&str) + Sync),
}

impl Watch<'_> {
    /// Why the work has to end now, if it has to.
    pub fn over(&self) -> Option<Ended> {
        self.budget.over()
    }
}
