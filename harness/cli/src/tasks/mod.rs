//! What the commands do, without a command line: options in, a typed outcome out. The commands and the Python package call
//! the same, so that their answers are the same.

pub mod batch;
pub mod diagnose;
pub mod files;
pub mod fit;
mod fmus;
pub mod impact;
pub mod import;
pub mod merge;
pub mod pack;
pub mod run;
pub mod shard;
mod system;

pub use fmus::isolation;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Follows a task: hears how far it is, and may end it. Called from many threads.
pub trait Follow: Send + Sync {
    /// Set where the task has to end.
    fn stop(&self) -> &'static AtomicBool;

    /// From here on the task looks at [`Follow::stop`].
    fn looks(&self) {}

    /// From here on there is something to hand out: the task, asked to end, comes to its end by itself and writes that.
    fn hands_out(&self) {}

    /// Whether a task that was asked to end hands out what there is by then; else it writes nothing.
    fn takes_parts(&self) -> bool {
        true
    }

    /// Whether the task has to end with nothing.
    fn is_dropped(&self) -> bool {
        self.stopped() && !self.takes_parts()
    }

    /// Where nothing is handed out by `deadline`, the task may be left alone, and is over with `message`: what reads and
    /// prepares looks at no clock.
    fn empty_handed_at(&self, deadline: Option<Instant>, message: String);

    /// A job of `total` parts begins, none of them done; 0: nobody knows how many.
    fn begin(&self, what: &str, total: u64);

    /// The stage that begins.
    fn stage(&self, text: &str);

    /// Where a job stands that moves on fast; `text` is called only where it is shown.
    fn note(&self, text: &dyn Fn() -> String);

    /// `parts` more are done.
    fn add(&self, parts: u64);

    /// The job is over.
    fn end(&self);

    /// What is to be known beside the answer.
    fn warning(&self, text: &str);

    /// What is wrong with a part of the task, while others go on.
    fn error(&self, text: &str);

    /// What a part of the task came to, in words.
    fn answer(&self, text: &str);

    /// Whether the task has to end.
    fn stopped(&self) -> bool {
        self.stop().load(Ordering::SeqCst)
    }
}
