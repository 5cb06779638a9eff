//! Files and folders written whole or not at all.
//!
//! What is written is made in a hidden folder beside its place, the stage, and put on disk; then it takes its place in one
//! step. A file takes its place by a rename. An answer, a folder of files with a manifest, changes places with the folder
//! that had its name. A process that is killed leaves a stage, which the next command that writes there clears away.

mod answer;
mod carry;
mod exchange;
mod in_place;
mod manifest;
mod scratch;
mod stage;

pub use answer::{Answer, Committed};
pub use manifest::{hexadecimal, Entry, Manifest};
pub use scratch::Scratch;
pub use stage::abandon;

use stage::{parent, Stage};
use std::io::Write;
use std::path::Path;

/// Writes `bytes` to `path`, in the place of what had that name; makes the folders it needs.
///
/// # Errors
/// As the file system gives them.
pub fn write(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    place(path, bytes, |staged| std::fs::rename(staged, path))
}

/// As [`write()`], where nothing has that name yet.
///
/// # Errors
/// As the file system gives them; `AlreadyExists` where something has the name.
pub fn write_new(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    place(path, bytes, |staged| match std::fs::hard_link(staged, path) {
        Err(e) if exchange::is_refused(&e) && !path.exists() => std::fs::rename(staged, path),
        linked => linked,
    })
}

/// Stages `bytes` beside `path` and hands them to `put`.
fn place(path: &Path, bytes: &[u8], put: impl FnOnce(&Path) -> std::io::Result<()>) -> std::io::Result<()> {
    let folder = parent(path);
    std::fs::create_dir_all(folder)?;
    stage::sweep(folder);
    let stage = Stage::within(folder)?;
    let staged = stage.path().join("new");
    stage::gated(|| {
        let mut file = std::fs::File::create_new(&staged)?;
        file.write_all(bytes)?;
        file.sync_all()
    })?;
    stage::gated(|| put(&staged))?;
    exchange::sync_folder(folder)
}

/// Whether files could be written in `folder`: tries it with a stage in there, or where it is not there yet in the nearest
/// folder above that is. Clears away what a killed process has left.
///
/// # Errors
/// As the file system gives them.
pub fn probe(folder: &Path) -> std::io::Result<()> {
    let whole = std::path::absolute(folder)?;
    let there = whole.ancestors().find(|d| d.exists()).unwrap_or(Path::new("."));
    stage::sweep(there);
    Stage::within(there).map(drop)
}

#[cfg(test)]
mod tests;
