//! Hidden folders in which a writer makes what is to take its place at once.

use crate::carry::Kept;
use crate::folder::{self, identity, is_unique, unique, Folder, Kind};
use crate::in_place;
use std::ffi::{OsStr, OsString};
use std::fs::File;
use std::io::{Error, ErrorKind, Read, Result, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, RwLock, TryLockError};
use std::time::{Duration, Instant};

/// How the names of stages begin; sixteen hexadecimal digits follow.
const PREFIX: &str = ".touchdown-stage-";
/// File in a stage that its process holds locked: whoever can lock it knows that the process has ended.
const LOCK: &str = "lock";
/// What else a stage may hold. A folder that holds anything beside it is none.
pub const NEW: &str = "new";
/// Folder of a stage whose files are about to take their places in the folder that the stage lies in.
pub const READY: &str = "ready";
/// What the lock holds, by which a stage is known from a user's folder of such a name.
pub const MARK: &[u8] = b"touchdown works here\n";
/// Time that a process which is about to end waits for what is taking its place.
const GRACE: Duration = Duration::from_secs(5);

/// Where a stage lies.
struct Held {
    home: Folder,
    name: OsString,
    folder: Folder,
}

/// Stages of this process.
static LIVE: Mutex<Vec<Arc<Held>>> = Mutex::new(Vec::new());
/// Held for reading by whoever changes files, for writing by [`abandon`].
static GATE: RwLock<()> = RwLock::new(());
/// Whether the process is about to end.
static ENDING: AtomicBool = AtomicBool::new(false);
/// What was finished for processes that were killed, and not reported yet.
static FINISHED: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// A stage; it goes with all it holds once it is dropped.
pub struct Stage {
    held: Arc<Held>,
    _lock: File,
    /// Whether it stays on disk.
    stays: bool,
}

impl Stage {
    /// Makes one in the folder at `home`.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn within(home: &Path) -> Result<Stage> {
        // without them it may stay where no more files can be opened
        drop(folder::hold_spares());
        // a sweeper may take one away that has no lock yet, and an answer the place of the folder
        for _ in 0..1000 {
            let name = OsString::from(format!("{PREFIX}{}", unique()));
            let folder = Folder::settled(home)?;
            if let Some(stage) = gated(|| Stage::made(folder, &name))? {
                if stage.home().is_in_place()? {
                    return Ok(stage);
                }
            }
        }
        // a folder as those of the kernel, which are there and take in nothing
        Err(Error::new(ErrorKind::NotFound, "nothing can be made in it"))
    }

    /// The stage of that name; None where the name is taken, or the stage cleared away at once.
    pub fn made(home: Folder, name: &OsStr) -> Result<Option<Stage>> {
        let folder = match home.make_private(name) {
            Err(e) if e.kind() == ErrorKind::AlreadyExists => return Ok(None),
            Err(e) => {
                // made, and it has moved with the place of the folder before it was opened
                remove_moved(&home, name);
                return if e.kind() == ErrorKind::NotFound { Ok(None) } else { Err(e) };
            }
            Ok(folder) => folder,
        };
        let held = Arc::new(Held { home, name: name.to_os_string(), folder });
        list().push(held.clone());
        let locked = held.folder.create(LOCK).and_then(|mut lock| {
            // another may hold it that is clearing the stage away, or may have done so since
            match folder::try_hold(&lock) && is_named(&lock, &held.folder, LOCK) {
                true => lock.write_all(MARK).map(|()| lock),
                false => Err(ErrorKind::NotFound.into()),
            }
        });
        match locked {
            Ok(lock) => Ok(Some(Stage { held, _lock: lock, stays: false })),
            Err(e) => {
                held.remove();
                held.forget();
                match e.kind() {
                    ErrorKind::NotFound => Ok(None),
                    _ => Err(e),
                }
            }
        }
    }

    /// The folder that it lies in.
    pub fn home(&self) -> &Folder {
        &self.held.home
    }

    pub fn folder(&self) -> &Folder {
        &self.held.folder
    }

    /// Whether it lies in `home`: it moves with what comes late into a folder that changes places.
    pub fn is_in(&self, home: &Folder) -> bool {
        self.held.folder.is_named(home, &self.held.name)
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
                self.held.remove();
                Ok(())
            }));
        }
        self.held.forget();
    }
}

impl Held {
    /// Removes the stage, the lock last: until then others see whose it is. Where something cannot be removed the lock stays
    /// with it, by which the next command knows what it is.
    fn remove(&self) {
        if [NEW, READY].map(|name| self.folder.remove_all(name)).iter().all(Result::is_ok) {
            drop(self.folder.remove_all(LOCK));
            let is_gone = self.folder.is_named(&self.home, &self.name) && self.home.remove_empty(&self.name).is_ok();
            if !is_gone {
                remove_moved(&self.home, &self.name);
            }
        }
    }

    fn forget(self: &Arc<Held>) {
        list().retain(|h| !Arc::ptr_eq(h, self));
    }
}

/// Removes an empty stage that has moved, before or just now, into the folder that has taken the place of `home`.
fn remove_moved(home: &Folder, name: &OsStr) {
    if let Ok(there) = Folder::open(home.path()) {
        drop(there.remove_empty(name));
    }
}

fn list() -> std::sync::MutexGuard<'static, Vec<Arc<Held>>> {
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Does what changes files, unless the process is about to end: then it waits for that.
pub fn gated<T>(change: impl FnOnce() -> Result<T>) -> Result<T> {
    let _open = GATE.read().unwrap_or_else(PoisonError::into_inner);
    change()
}

/// Whether [`abandon`] was called.
pub fn is_ending() -> bool {
    ENDING.load(Ordering::SeqCst)
}

/// What was finished for processes that were killed since this was asked last, to be reported, a line each.
pub fn finished() -> Vec<String> {
    std::mem::take(&mut *FINISHED.lock().unwrap_or_else(PoisonError::into_inner))
}

/// Removes the stages of this process and lets nothing be written any more: for who is about to end it. What is taking its
/// place at the moment comes to its end first, where it does so within some seconds.
pub fn abandon() {
    ENDING.store(true, Ordering::SeqCst);
    let until = Instant::now() + GRACE;
    loop {
        match GATE.try_write() {
            Ok(gate) => break std::mem::forget(gate),
            Err(TryLockError::Poisoned(gate)) => break std::mem::forget(gate),
            // a file system that does not answer holds nobody for ever; what is there is left to the next command
            Err(TryLockError::WouldBlock) if Instant::now() >= until => return,
            Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(1)),
        }
    }
    let all: Vec<Arc<Held>> = list().drain(..).collect();
    all.iter().for_each(|h| h.remove());
}

/// Whether a name is that of a stage.
pub fn is_stage(name: &OsStr) -> bool {
    name.to_str().and_then(|n| n.strip_prefix(PREFIX)).is_some_and(is_unique)
}

/// Clears away the stages in `home` whose processes have ended; where one was replacing files one by one, that is
/// finished first. What cannot be cleared away stays.
pub fn sweep(home: &Path) {
    let Ok(folder) = Folder::open(home) else { return };
    for name in folder.names().into_iter().flatten().filter(|n| is_stage(n)) {
        drop(gated(|| clear(&folder, &name)));
    }
}

/// Whether the open `file` is the one that has the name in `folder`.
pub fn is_named(file: &File, folder: &Folder, name: impl AsRef<Path>) -> bool {
    let there = folder.found(name).ok().flatten();
    there.is_some_and(|f| f.kind == Kind::File && identity(file).is_ok_and(|i| i == f.identity))
}

/// Whether the open `lock` in `folder` is one of ours: it holds what ours hold, or nothing, where the process was
/// killed before it had made anything else.
pub fn is_mark(lock: &mut File, folder: &Folder) -> Result<bool> {
    let mut mark = Vec::new();
    lock.take(MARK.len() as u64 + 1).read_to_end(&mut mark)?;
    Ok(mark == MARK || mark.is_empty() && folder.names()?.iter().all(|n| n == LOCK))
}

/// Clears a stage away that is one: a folder of this user's that holds what stages hold and nothing else, and whose lock
/// nobody holds.
fn clear(home: &Folder, name: &OsStr) -> Result<()> {
    let stage = home.folder(name)?;
    let is_known = |n: &OsString| [NEW, READY, LOCK].iter().any(|k| n == k);
    if !stage.is_own() || !stage.names()?.iter().all(is_known) {
        return Ok(());
    }
    if stage.is_free(LOCK) {
        // its process was killed before it made the lock, or after it removed it; else this fails, or it is a user's, who gave it the
        // mode that folders have
        return match stage.is_private() {
            true => home.remove_empty(name),
            false => Ok(()),
        };
    }
    let mut lock = stage.read(LOCK)?;
    // what was cleared away since is another's, who may have made a stage of that name
    if is_mark(&mut lock, &stage)? && folder::try_hold(&lock) && is_named(&lock, &stage, LOCK) {
        let home = Folder::open(home.path())?;
        if in_place::has_begun(&stage, &home)? {
            home.hold()?;
            let kept = in_place::finish(&stage, &home)?;
            let mut all =
                vec!["an answer that a process had begun to put there, and was ended, is whole now".to_string()];
            all.extend(kept.iter().map(Kept::note));
            let lines = all.into_iter().map(|l| format!("{}: {l}", home.path().display()));
            FINISHED.lock().unwrap_or_else(PoisonError::into_inner).extend(lines);
        }
        Held { home, name: name.into(), folder: stage }.remove();
    }
    Ok(())
}

/// The folder that `path` lies in.
pub fn parent(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
