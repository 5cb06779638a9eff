//! Calls into a library that may panic on a damaged file.

use crate::Fault;
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::path::Path;

/// What `read` gives; a panic in it becomes a fault of the file at `path`.
pub(crate) fn guarded<T>(path: &Path, read: impl FnOnce() -> Result<T, Fault>) -> Result<T, Fault> {
    catch_unwind(AssertUnwindSafe(read)).unwrap_or_else(|_| {
        Err(Fault::new(path, "the file is damaged where its structure is stored", "take an undamaged copy of the file"))
    })
}
