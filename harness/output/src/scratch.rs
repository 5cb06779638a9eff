//! Temporary folders that also go where their process was killed: the next command clears them away.

use crate::folder::{self, is_unique, try_hold, unique, Folder, Kind};
use crate::stage::{is_mark, is_named, MARK};
use std::ffi::OsStr;
use std::fs::File;
use std::io::{Error, ErrorKind, Result, Write};
use std::path::{Path, PathBuf};
use std::sync::Once;

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
    /// The folder that it lies in, and its name there.
    home: PathBuf,
    name: String,
    /// Unlocked after the folder has gone.
    lock: File,
}

impl Scratch {
    /// Makes one whose name holds `what`, and clears away, once in a process, those of processes that have ended.
    ///
    /// # Errors
    /// As the file system gives them, with the folder and the cure.
    pub fn new(what: &str) -> Result<Scratch> {
        static SWEPT: Once = Once::new();
        let within = std::env::temp_dir();
        SWEPT.call_once(|| sweep(&within));
        Scratch::within(&within, what).map_err(|e| {
            let cure = match e.kind() {
                ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "make room, or set TMPDIR to a folder with room",
                ErrorKind::ReadOnlyFilesystem => "set TMPDIR to a folder that can be written",
                _ => input::cure(&e).unwrap_or("set TMPDIR to a folder that can be written"),
            };
            Error::new(e.kind(), format!("no temporary folder can be made in {} ({e}); {cure}", within.display()))
        })
    }

    fn within(within: &Path, what: &str) -> Result<Scratch> {
        let home = Folder::open(within)?;
        let name = format!("{PREFIX}{what}-{}", unique());
        let made = home.make_private(&name).and_then(|folder| {
            let mut lock = folder.create(LOCK)?;
            // a file system without locks has none to recognize a live folder by, and there none is cleared away
            try_hold(&lock);
            lock.write_all(MARK)?;
            folder.make(CONTENT)?;
            folder::hold_spares()?;
            Ok(lock)
        });
        match made {
            Ok(lock) => Ok(Scratch { content: within.join(&name).join(CONTENT), home: within.into(), name, lock }),
            Err(e) => {
                if let Ok(folder) = home.folder(&name) {
                    remove(&home, OsStr::new(&name), &folder);
                }
                drop(home.remove_empty(&name));
                Err(e)
            }
        }
    }

    /// The folder to put things into.
    pub fn path(&self) -> &Path {
        &self.content
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        folder::free_spares();
        if let Ok(home) = Folder::open(&self.home) {
            if let Ok(folder) = home.folder(&self.name) {
                if is_named(&self.lock, &folder, LOCK) {
                    remove(&home, OsStr::new(&self.name), &folder);
                }
            }
        }
        // where there are none to be had the next one holds them, or says so
        drop(folder::hold_spares());
    }
}

/// Removes a temporary folder, the lock last: until then others see whose it is. What cannot be removed stays, with the lock.
fn remove(home: &Folder, name: &OsStr, folder: &Folder) {
    if folder.remove_all(CONTENT).is_ok() {
        drop(folder.remove(LOCK));
        drop(home.remove_empty(name));
    }
}

/// Clears away what ended processes of this user have left in `within`. What cannot be cleared away stays.
fn sweep(within: &Path) {
    let Ok(home) = Folder::open(within) else { return };
    for name in home.names().into_iter().flatten() {
        let text = name.to_string_lossy();
        if text.starts_with(PREFIX) && text.rsplit('-').next().is_some_and(is_unique) {
            drop(clear(&home, &name));
        }
    }
}

/// Clears away a folder that is one of ours and whose process has ended: its lock holds our mark, and nobody holds it. One without such a
/// lock is being made or is of somebody else, as is one with anything beside lock and content, and what a link leads to.
fn clear(home: &Folder, name: &OsStr) -> Result<()> {
    let folder = home.folder(name)?;
    let is = |name: &str, kind: Kind| matches!(folder.found(name), Ok(Some(f)) if f.kind == kind && f.is_own);
    let is_one = folder.is_own()
        && is(LOCK, Kind::File)
        && (is(CONTENT, Kind::Folder) || folder.is_free(CONTENT))
        && folder.names()?.iter().all(|n| n == LOCK || n == CONTENT);
    if is_one {
        let mut lock = folder.read(LOCK)?;
        if is_mark(&mut lock, &folder)? && matches!(lock.try_lock(), Ok(())) {
            remove(home, name, &folder);
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_process_has_left_is_cleared_away_and_nothing_else() {
        let temporary = tempfile::tempdir().unwrap();
        let left = temporary.path().join("touchdown-fmu-0011223344556677");
        std::fs::create_dir_all(left.join(CONTENT).join("binaries")).unwrap();
        std::fs::write(left.join(LOCK), MARK).unwrap();
        let begun = temporary.path().join("touchdown-own-8899aabbccddeeff");
        std::fs::create_dir(&begun).unwrap();
        std::fs::write(begun.join(LOCK), MARK).unwrap();
        let live = Scratch::within(temporary.path(), "fmu").unwrap();
        std::fs::write(live.path().join("x"), "").unwrap();
        // a user's folder of such a name, and one that a link leads to
        let own = ["touchdown-notes", "touchdown-fmu-0011223344556688"].map(|n| temporary.path().join(n));
        for own in &own {
            std::fs::create_dir_all(own.join(CONTENT)).unwrap();
            std::fs::write(own.join(LOCK), "mine").unwrap();
        }
        let elsewhere = tempfile::tempdir().unwrap();
        std::fs::create_dir(elsewhere.path().join(CONTENT)).unwrap();
        std::fs::write(elsewhere.path().join(LOCK), MARK).unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink(elsewhere.path(), temporary.path().join("touchdown-fmu-0011223344556699")).unwrap();
        sweep(temporary.path());
        assert!(!left.exists() && !begun.exists());
        assert!(
            live.path().join("x").exists() && own.iter().all(|o| o.exists()) && elsewhere.path().join(LOCK).exists()
        );
        let outside = live.path().parent().unwrap().to_path_buf();
        drop(live);
        assert!(!outside.exists());
    }
}
