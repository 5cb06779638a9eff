//! Temporary folders that also go where their process was killed: the next command clears them away.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::sync::Once;
use tempfile::TempDir;

/// How the names of all of them begin.
const PREFIX: &str = "touchdown-";
/// File that the process holds locked as long as it lives.
const LOCK: &str = "lock";
/// What is unpacked lies in here.
const CONTENT: &str = "content";

/// A temporary folder; it goes with all it holds once it is dropped.
#[derive(Debug)]
pub struct Scratch {
    content: PathBuf,
    // unlocked after the folder has gone
    _folder: TempDir,
    _lock: File,
}

impl Scratch {
    /// Makes one whose name holds `what`, and clears away, once in a process, those of processes that have ended.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn new(what: &str) -> std::io::Result<Scratch> {
        static SWEPT: Once = Once::new();
        let within = std::env::temp_dir();
        SWEPT.call_once(|| sweep(&within));
        Scratch::within(&within, what)
    }

    fn within(within: &Path, what: &str) -> std::io::Result<Scratch> {
        let folder = tempfile::Builder::new().prefix(&format!("{PREFIX}{what}-")).tempdir_in(within)?;
        // a file system without locks has none to recognize a live folder by, and there none is cleared away
        let lock = File::create(folder.path().join(LOCK))?;
        drop(lock.try_lock());
        let content = folder.path().join(CONTENT);
        std::fs::create_dir(&content)?;
        Ok(Scratch { content, _folder: folder, _lock: lock })
    }

    /// The folder to put things into.
    pub fn path(&self) -> &Path {
        &self.content
    }
}

/// Clears away what ended processes of this user have left in `folder`. What cannot be cleared away stays.
fn sweep(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.file_name().to_string_lossy().starts_with(PREFIX) && is_left(&entry.path()) {
            drop(std::fs::remove_dir_all(entry.path()));
        }
    }
}

/// Whether a folder is one of ours and its process has ended. A folder without content is being made or is of somebody else,
/// as is what a link leads to.
fn is_left(folder: &Path) -> bool {
    let is = |path: &Path, of: fn(&std::fs::Metadata) -> bool| {
        path.symlink_metadata().is_ok_and(|m| of(&m) && is_of_this_user(&m))
    };
    let lock = folder.join(LOCK);
    is(folder, std::fs::Metadata::is_dir)
        && is(&folder.join(CONTENT), std::fs::Metadata::is_dir)
        && is(&lock, std::fs::Metadata::is_file)
        && File::open(lock)
            .is_ok_and(|lock| !matches!(lock.try_lock(), Err(TryLockError::WouldBlock | TryLockError::Error(_))))
}

#[cfg(target_os = "linux")]
fn is_of_this_user(m: &std::fs::Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    m.uid() == rustix::process::geteuid().as_raw()
}

#[cfg(not(target_os = "linux"))]
fn is_of_this_user(_: &std::fs::Metadata) -> bool {
    // temporary folders are a user's own there
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_process_has_left_is_cleared_away_and_nothing_else() {
        let temporary = TempDir::new().unwrap();
        let left = temporary.path().join("touchdown-fmu-killed");
        std::fs::create_dir_all(left.join(CONTENT).join("binaries")).unwrap();
        std::fs::write(left.join(LOCK), "").unwrap();
        let live = Scratch::within(temporary.path(), "fmu").unwrap();
        std::fs::write(live.path().join("x"), "").unwrap();
        // a user's folder of such a name, and one that a link leads to
        let own = temporary.path().join("touchdown-notes");
        std::fs::create_dir_all(own.join(CONTENT)).unwrap();
        let elsewhere = TempDir::new().unwrap();
        std::fs::create_dir(elsewhere.path().join(CONTENT)).unwrap();
        std::fs::write(elsewhere.path().join(LOCK), "").unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink(elsewhere.path(), temporary.path().join("touchdown-link")).unwrap();
        sweep(temporary.path());
        assert!(!left.exists());
        assert!(live.path().join("x").exists() && own.exists() && elsewhere.path().join(LOCK).exists());
        let outside = live.path().parent().unwrap().to_path_buf();
        drop(live);
        assert!(!outside.exists());
    }
}
