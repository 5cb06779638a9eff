//! Hidden folders in which a writer makes what is to take its place at once.

use std::fs::{File, TryLockError};
use std::io::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError, RwLock};

/// How the names of stages begin.
const PREFIX: &str = ".touchdown-stage-";
/// File in a stage that its process holds locked: whoever can lock it knows that the process has ended.
const LOCK: &str = "lock";

/// Stages of this process.
static LIVE: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());
/// Held for reading by whoever changes files, for writing by [`abandon`].
static GATE: RwLock<()> = RwLock::new(());

/// A stage; it goes with all it holds once it is dropped.
pub struct Stage {
    path: PathBuf,
    _lock: File,
    /// Whether it stays on disk.
    stays: bool,
}

impl Stage {
    /// Makes one in `folder`.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn within(folder: &Path) -> Result<Stage> {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        // a name is taken where a killed process of the same number has left its stage
        for _ in 0..1000 {
            let n = COUNT.fetch_add(1, Ordering::Relaxed);
            let path = folder.join(format!("{PREFIX}{}-{n}", std::process::id()));
            if let Some(stage) = gated(|| Stage::made(path))? {
                return Ok(stage);
            }
        }
        Err(Error::new(ErrorKind::AlreadyExists, "no name is left for a temporary folder"))
    }

    /// The stage at `path`; None where that name is taken.
    fn made(path: PathBuf) -> Result<Option<Stage>> {
        match std::fs::create_dir(&path) {
            Err(e) if e.kind() == ErrorKind::AlreadyExists => return Ok(None),
            made => made?,
        }
        list(&LIVE).push(path.clone());
        let locked = File::create(path.join(LOCK)).and_then(|lock| match lock.try_lock() {
            // locked by another that is clearing the stage away, or has done so since the file was opened: a lock on a file that
            // no longer has the name holds nobody off
            Ok(()) if !is_named(&lock, &path.join(LOCK)) => Err(Error::new(ErrorKind::NotFound, "cleared away")),
            Err(TryLockError::WouldBlock) => Err(Error::new(ErrorKind::NotFound, "cleared away")),
            // file systems without locks have none to recognize a live stage by, and there none is cleared away
            Ok(()) | Err(TryLockError::Error(_)) => Ok(lock),
        });
        match locked {
            Ok(lock) => Ok(Some(Stage { path, _lock: lock, stays: false })),
            Err(e) => {
                remove(&path);
                list(&LIVE).retain(|p| *p != path);
                // another process has just cleared it away
                if e.kind() == ErrorKind::NotFound {
                    return Ok(None);
                }
                Err(e)
            }
        }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Leaves the stage on disk for the next command to finish, as a process that is killed does.
    pub fn leave(mut self) {
        self.stays = true;
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        if !self.stays {
            // what cannot be removed now is cleared away by the next command
            drop(gated(|| {
                remove(&self.path);
                Ok(())
            }));
        }
        list(&LIVE).retain(|p| *p != self.path);
    }
}

/// Removes a stage, the lock last: until then others see whose it is.
fn remove(stage: &Path) {
    for entry in std::fs::read_dir(stage).into_iter().flatten().flatten() {
        let path = entry.path();
        let is_folder = entry.file_type().is_ok_and(|t| t.is_dir());
        if is_folder {
            drop(std::fs::remove_dir_all(path));
        } else if entry.file_name() != LOCK {
            drop(std::fs::remove_file(path));
        }
    }
    drop(std::fs::remove_file(stage.join(LOCK)));
    drop(std::fs::remove_dir(stage));
}

fn list(all: &Mutex<Vec<PathBuf>>) -> std::sync::MutexGuard<'_, Vec<PathBuf>> {
    all.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Does what changes files, unless the process is about to end: then it waits for that.
pub fn gated<T>(change: impl FnOnce() -> Result<T>) -> Result<T> {
    let _open = GATE.read().unwrap_or_else(PoisonError::into_inner);
    change()
}

/// Removes the stages of this process and lets nothing be written any more: for who is about to end it. What is taking its
/// place at the moment comes to its end first.
pub fn abandon() {
    std::mem::forget(GATE.write().unwrap_or_else(PoisonError::into_inner));
    list(&LIVE).iter().for_each(|p| remove(p));
}

/// Whether a name is that of a stage.
pub fn is_stage(name: &std::ffi::OsStr) -> bool {
    name.to_string_lossy().starts_with(PREFIX)
}

/// Clears away the stages in `folder` whose processes have ended; where one was replacing files one by one, that is
/// finished first. What cannot be cleared away stays.
pub fn sweep(folder: &Path) {
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if is_stage(&entry.file_name()) {
            drop(gated(|| clear(&entry.path(), folder)));
        }
    }
}

/// Whether the open `file` is the one that has the name `path`.
#[cfg(unix)]
fn is_named(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let of = |m: std::fs::Metadata| (m.dev(), m.ino());
    let both = (file.metadata().map(of), std::fs::symlink_metadata(path).map(of));
    matches!(both, (Ok(a), Ok(b)) if a == b)
}

/// Whether the name `path` is there: elsewhere an open file keeps its name.
#[cfg(not(unix))]
fn is_named(_: &File, path: &Path) -> bool {
    path.exists()
}

fn clear(stage: &Path, folder: &Path) -> Result<()> {
    let lock = File::create(stage.join(LOCK))?;
    // what was cleared away since is another's, who may have made a stage of that name
    if lock.try_lock().is_ok() && is_named(&lock, &stage.join(LOCK)) {
        crate::in_place::finish(stage, folder)?;
        remove(stage);
    }
    Ok(())
}

/// The folder that `path` lies in.
pub fn parent(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
