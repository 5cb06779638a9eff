//! The gate through which everything below a folder is opened, made, renamed and removed: by names in a folder that is held
//! open, one component at a time, and without following a link.
//!
//! Invariant: no name that comes from a file leads out of the folder, and no call of this module waits for a pipe.

use std::ffi::{OsStr, OsString};
use std::fs::{File, TryLockError};
use std::io::{Error, ErrorKind, Read, Result, Write};
use std::path::{Component, Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Folders inside each other that are removed at most.
const DEPTH: usize = 200;
/// Time that a folder is waited for while another process puts its answer there.
const WAIT: Duration = Duration::from_secs(30);
const LOOK: Duration = Duration::from_millis(10);

/// A folder held open. Whatever happens to its path, calls go to this folder.
#[derive(Debug)]
pub struct Folder {
    handle: sys::Handle,
    /// How it was reached, for messages.
    path: PathBuf,
}

/// What has a name in a folder, the link itself where it is one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    pub kind: Kind,
    /// Bytes.
    pub length: u64,
    /// Device and number of the file, by which it is known under another name; zeros where the platform has none.
    pub identity: (u64, u64),
    /// Whether this process' user owns it.
    pub is_own: bool,
}

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    File,
    Folder,
    /// A link, pipe, socket or device.
    Other,
}

/// Where a name with folders in it ends.
enum Way<'a> {
    Here(&'a Folder),
    Below(Folder),
}

impl std::ops::Deref for Way<'_> {
    type Target = Folder;
    fn deref(&self) -> &Folder {
        match self {
            Way::Here(f) => f,
            Way::Below(f) => f,
        }
    }
}

/// Whether a name is one below a folder: not empty, relative, and without `.`, `..` or a prefix.
pub fn is_plain(name: &Path) -> bool {
    let text = name.as_os_str().as_encoded_bytes();
    // components() passes over a . and over doubled or last separators
    let parts = text.split(|b| *b == b'/').all(|p| !p.is_empty() && p != b"." && p != b"..");
    parts && !text.contains(&0) && name.components().all(|c| matches!(c, Component::Normal(_)))
}

impl Folder {
    /// The folder at a path of the user's: links on the way are followed.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn open(path: &Path) -> Result<Folder> {
        let path = if path.as_os_str().is_empty() { Path::new(".") } else { path };
        Ok(Folder { handle: sys::open(path)?, path: path.to_path_buf() })
    }

    /// As [`Folder::open`]; makes it, and the folders it lies in, where they are not there.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn made(path: &Path) -> Result<Folder> {
        match Folder::open(path) {
            Err(e) if e.kind() == ErrorKind::NotFound => {
                std::fs::create_dir_all(path)?;
                Folder::open(path)
            }
            opened => opened,
        }
    }

    /// As [`Folder::open`], of a folder that may lie in one whose answer is taking its place: that is waited for.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn settled(path: &Path) -> Result<Folder> {
        match Folder::open(path) {
            Err(e) if e.kind() == ErrorKind::NotFound => {
                let whole = std::path::absolute(path)?;
                let Some(above) = whole.ancestors().skip(1).find(|a| a.is_dir()) else { return Err(e) };
                let _above = Folder::held(above, Hold::Together)?;
                Folder::open(path)
            }
            opened => opened,
        }
    }

    /// The folder that `path` leads to, held: it stays in its place until it is let go.
    ///
    /// # Errors
    /// As [`Folder::settled`] and [`Folder::hold`].
    pub fn held(path: &Path, how: Hold) -> Result<Folder> {
        let until = Instant::now() + WAIT;
        loop {
            let folder = Folder::settled(path)?;
            folder.hold_as(how)?;
            // else another has taken its place since
            if folder.is_in_place()? {
                return Ok(folder);
            }
            if Instant::now() > until {
                return Err(in_use(path));
            }
        }
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The folder of the last component of `name`, and that component. Folders on the way are made where `make`.
    fn way<'a, 'n>(&'a self, name: &'n Path, make: bool) -> Result<(Way<'a>, &'n OsStr)> {
        if !is_plain(name) {
            let why = format!("{:?} is no name of a file below {}", name.display(), self.path.display());
            return Err(Error::new(ErrorKind::InvalidInput, why));
        }
        let mut way = Way::Here(self);
        let mut parts = name.components().map(Component::as_os_str).peekable();
        while let Some(part) = parts.next() {
            if parts.peek().is_none() {
                return Ok((way, part));
            }
            if make {
                way.make_one(part)?;
            }
            way = Way::Below(way.one(part)?);
        }
        Err(ErrorKind::InvalidInput.into())
    }

    fn one(&self, part: &OsStr) -> Result<Folder> {
        let path = self.path.join(part);
        match sys::open_folder(&self.handle, part) {
            Err(e) if e.kind() == ErrorKind::NotFound => Err(e),
            Err(e) if self.look(part)?.is_some_and(|f| f.kind != Kind::Folder) => {
                let why = format!("{} is no folder of its own, but a link or a file; move it away", path.display());
                Err(Error::new(e.kind(), why))
            }
            opened => Ok(Folder { handle: opened?, path }),
        }
    }

    fn make_one(&self, part: &OsStr) -> Result<()> {
        match sys::make_folder(&self.handle, part, false) {
            Err(e) if e.kind() == ErrorKind::AlreadyExists => Ok(()),
            made => made,
        }
    }

    fn look(&self, part: &OsStr) -> Result<Option<Found>> {
        match sys::look(&self.handle, part) {
            Err(e) if matches!(e.kind(), ErrorKind::NotFound | ErrorKind::NotADirectory) => Ok(None),
            found => found.map(Some),
        }
    }

    /// The folder `name` below; no link.
    ///
    /// # Errors
    /// As the file system gives them; something else has the name.
    pub fn folder(&self, name: impl AsRef<Path>) -> Result<Folder> {
        let (way, part) = self.way(name.as_ref(), false)?;
        way.one(part)
    }

    /// Makes the folder `name` below, which nothing may have as its name yet.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn make(&self, name: impl AsRef<Path>) -> Result<Folder> {
        let (way, part) = self.way(name.as_ref(), true)?;
        sys::make_folder(&way.handle, part, false)?;
        way.one(part)
    }

    /// As [`Folder::make`], a folder that nobody else may enter.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn make_private(&self, name: impl AsRef<Path>) -> Result<Folder> {
        let (way, part) = self.way(name.as_ref(), true)?;
        sys::make_folder(&way.handle, part, true)?;
        let made = way.one(part);
        if made.is_err() {
            // where it cannot be opened it is of no use
            drop(sys::remove_folder(&way.handle, part));
        }
        made
    }

    /// The folder `name` below, made where it is not there.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn make_all(&self, name: impl AsRef<Path>) -> Result<Folder> {
        let (way, part) = self.way(name.as_ref(), true)?;
        way.make_one(part)?;
        way.one(part)
    }

    /// What has the name; None where nothing has it, or what lies on the way is no folder.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn found(&self, name: impl AsRef<Path>) -> Result<Option<Found>> {
        match self.way(name.as_ref(), false) {
            Ok((way, part)) => way.look(part),
            Err(e) if e.kind() == ErrorKind::InvalidInput => Err(e),
            Err(e) if e.kind() == ErrorKind::PermissionDenied => Err(e),
            Err(_) => Ok(None),
        }
    }

    /// Whether nothing has the name, as far as one can see.
    pub fn is_free(&self, name: impl AsRef<Path>) -> bool {
        matches!(self.found(name), Ok(None))
    }

    /// Opens a regular file of this folder for reading.
    ///
    /// # Errors
    /// As the file system gives them; a link, a pipe, a folder, a device.
    pub fn read(&self, name: impl AsRef<Path>) -> Result<File> {
        let (way, part) = self.way(name.as_ref(), false)?;
        let refused = || {
            let path = way.path.join(part);
            Error::new(
                ErrorKind::InvalidInput,
                format!("{} is no file, but a link, a pipe or a folder", path.display()),
            )
        };
        match sys::read(&way.handle, part) {
            Err(e) if e.kind() == ErrorKind::NotFound => Err(e),
            Err(_) if way.look(part)?.is_some_and(|f| f.kind != Kind::File) => Err(refused()),
            opened => opened.and_then(|file| if file.metadata()?.is_file() { Ok(file) } else { Err(refused()) }),
        }
    }

    /// What a regular file of at most `most` bytes holds.
    ///
    /// # Errors
    /// As [`Folder::read`]; a larger file.
    pub fn bytes(&self, name: impl AsRef<Path>, most: u64) -> Result<Vec<u8>> {
        let mut bytes = Vec::new();
        let read = self.read(name)?.take(most + 1).read_to_end(&mut bytes)? as u64;
        if read > most {
            return Err(Error::new(ErrorKind::InvalidData, format!("it has more than the {most} bytes that are read")));
        }
        Ok(bytes)
    }

    /// Makes a file, whose name nothing may have yet; folders on the way are made.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn create(&self, name: impl AsRef<Path>) -> Result<File> {
        let (way, part) = self.way(name.as_ref(), true)?;
        sys::create(&way.handle, part)
    }

    /// Makes a file that holds `bytes`, and puts them on disk.
    ///
    /// # Errors
    /// As [`Folder::create`].
    pub fn write(&self, name: impl AsRef<Path>, bytes: &[u8]) -> Result<()> {
        let mut file = self.create(name)?;
        file.write_all(bytes)?;
        file.sync_all()
    }

    /// Removes what is no folder.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn remove(&self, name: impl AsRef<Path>) -> Result<()> {
        let (way, part) = self.way(name.as_ref(), false)?;
        sys::remove(&way.handle, part)
    }

    /// Removes an empty folder.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn remove_empty(&self, name: impl AsRef<Path>) -> Result<()> {
        let (way, part) = self.way(name.as_ref(), false)?;
        sys::remove_folder(&way.handle, part)
    }

    /// Removes what has the name, and all that it holds: links themselves, not what they lead to. Folders whose mode forbids
    /// it are opened up first. What can be removed is, whatever else cannot.
    ///
    /// # Errors
    /// As the file system gives them, the first.
    pub fn remove_all(&self, name: impl AsRef<Path>) -> Result<()> {
        let remove = || {
            let (way, part) = self.way(name.as_ref(), false)?;
            way.remove_tree(part, DEPTH)
        };
        match remove() {
            Err(e) if input::is_out_of_files(&e) => {
                free_spares();
                let removed = remove();
                // where there are none to be had the next one holds them
                drop(hold_spares());
                removed
            }
            removed => removed,
        }
    }

    fn remove_tree(&self, part: &OsStr, depth: usize) -> Result<()> {
        match self.look(part)? {
            None => return Ok(()),
            Some(f) if f.kind != Kind::Folder => return sys::remove(&self.handle, part),
            Some(_) if depth == 0 => return Err(Error::other("folders lie too deep in each other")),
            Some(_) => {}
        }
        if sys::remove_folder(&self.handle, part).is_ok() {
            return Ok(());
        }
        let below = match self.one(part) {
            Err(e) if e.kind() == ErrorKind::PermissionDenied => {
                sys::open_up(&self.handle, part)?;
                self.one(part)
            }
            opened => opened,
        }?;
        if sys::mount(&below.handle) != sys::mount(&self.handle) {
            return Err(Error::other(format!("another file system is mounted on {}", below.path.display())));
        }
        let mut failed = None;
        let mut clear = |below: &Folder| -> Result<()> {
            for name in below.names()? {
                if let Err(e) = below.remove_tree(&name, depth - 1) {
                    failed.get_or_insert(e);
                }
            }
            Ok(())
        };
        clear(&below)?;
        if failed.as_ref().is_some_and(|e| e.kind() == ErrorKind::PermissionDenied) {
            sys::open_up(&self.handle, part)?;
            failed = None;
            for name in below.names()? {
                if let Err(e) = below.remove_tree(&name, depth - 1) {
                    failed.get_or_insert(e);
                }
            }
        }
        match failed {
            Some(e) => Err(e),
            None => sys::remove_folder(&self.handle, part),
        }
    }

    /// Gives what has the name another, in the place of the file that has it; folders on the way to it are made.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn rename(&self, name: impl AsRef<Path>, to: &Folder, new: impl AsRef<Path>) -> Result<()> {
        let ((way, part), (to, new)) = (self.way(name.as_ref(), false)?, to.way(new.as_ref(), true)?);
        sys::rename(&way.handle, part, &to.handle, new)
    }

    /// Gives what has the name a second one, which nothing may have yet; a link gets it itself. Folders on the way are made.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn link(&self, name: impl AsRef<Path>, to: &Folder, new: impl AsRef<Path>) -> Result<()> {
        let ((way, part), (to, new)) = (self.way(name.as_ref(), false)?, to.way(new.as_ref(), true)?);
        sys::link(&way.handle, part, &to.handle, new)
    }

    /// Lets what has the name and what has the name `other` in `to` change places, in one step.
    ///
    /// # Errors
    /// As the file system gives them; where it has no such step.
    pub fn exchange(&self, name: impl AsRef<Path>, to: &Folder, other: impl AsRef<Path>) -> Result<()> {
        let ((way, part), (to, other)) = (self.way(name.as_ref(), false)?, to.way(other.as_ref(), false)?);
        sys::exchange(&way.handle, part, &to.handle, other)
    }

    /// Names of all that lies in the folder, in any order.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn names(&self) -> Result<Vec<OsString>> {
        sys::names(&self.handle)
    }

    /// Puts the names in the folder on disk.
    ///
    /// # Errors
    /// As the file system gives them; none where folders cannot be put on disk by themselves.
    pub fn sync(&self) -> Result<()> {
        match sys::sync(&self.handle) {
            Err(e) if crate::exchange::is_refused(&e) => Ok(()),
            done => done,
        }
    }

    /// Gives the folder owner, group and permissions of another.
    ///
    /// # Errors
    /// As the file system gives them; where the other has attributes beside these, such as an access control list.
    pub fn permit_as(&self, other: &Folder) -> Result<()> {
        sys::permit_as(&self.handle, &other.handle)
    }

    /// Whether this is what has the name in the folder `above`.
    pub fn is_named(&self, above: &Folder, name: &OsStr) -> bool {
        match (sys::identity(&self.handle), above.look(name)) {
            (Ok(a), Ok(Some(b))) => a == b.identity && b.kind == Kind::Folder,
            _ => false,
        }
    }

    /// Whether this is what its path still leads to.
    ///
    /// # Errors
    /// As the file system gives them; none where nothing is there.
    pub fn is_in_place(&self) -> Result<bool> {
        match std::fs::metadata(&self.path) {
            Err(e) if e.kind() == ErrorKind::NotFound => Ok(false),
            there => Ok(sys::identity_of(&there?)? == sys::identity(&self.handle)?),
        }
    }

    /// Whether it has the mode of those that [`Folder::make_private`] makes.
    pub fn is_private(&self) -> bool {
        sys::is_private(&self.handle)
    }

    /// Whether this process' user owns it.
    pub fn is_own(&self) -> bool {
        sys::is_own(&self.handle)
    }

    /// Holds the folder against other processes and threads that hold it, or its place; waits for one that does, for
    /// half a minute at most. Let go when it is dropped. Where there are no locks nobody is held off.
    ///
    /// # Errors
    /// That another held it all the time, with the cure.
    pub fn hold(&self) -> Result<()> {
        self.hold_as(Hold::Alone)
    }

    fn hold_as(&self, how: Hold) -> Result<()> {
        let until = Instant::now() + WAIT;
        loop {
            match sys::try_hold(&self.handle, how) {
                Err(e) if e.kind() == ErrorKind::WouldBlock && Instant::now() < until => std::thread::sleep(LOOK),
                Err(e) if e.kind() == ErrorKind::WouldBlock => return Err(in_use(&self.path)),
                _ => return Ok(()),
            }
        }
    }
}

/// That others write into the folder all the time, with the cure.
pub fn in_use(folder: &Path) -> Error {
    let why = format!(
        "{} is in use by another process that writes there; wait for its end, or give another --out",
        folder.display()
    );
    Error::new(ErrorKind::ResourceBusy, why)
}

/// Who else may hold a folder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Hold {
    /// Nobody: its files are about to change, or it is about to change places.
    Alone,
    /// Those who hold it so too: it only is to stay where it is.
    Together,
}

/// Files that can be opened though no more are to be had: what was made can be removed with them, folder by folder.
const SPARE: usize = 4;
static SPARES: Mutex<Vec<File>> = Mutex::new(Vec::new());

/// Holds what is needed to remove folders where no more files can be opened.
///
/// # Errors
/// Where no more can be opened.
pub fn hold_spares() -> Result<()> {
    let mut spares = SPARES.lock().unwrap_or_else(PoisonError::into_inner);
    while cfg!(unix) && spares.len() < SPARE {
        spares.push(File::open("/dev/null")?);
    }
    Ok(())
}

/// Gives back what [`hold_spares`] holds, until it is called again.
pub fn free_spares() {
    SPARES.lock().unwrap_or_else(PoisonError::into_inner).clear();
}

/// The identity of an open file, as [`Found`] has it.
///
/// # Errors
/// As the file system gives them.
pub fn identity(file: &File) -> Result<(u64, u64)> {
    sys::identity_of(&file.metadata()?)
}

/// Whether the open `file` could be held against other processes: false where another holds it. File systems without locks
/// hold nobody off.
pub fn try_hold(file: &File) -> bool {
    !matches!(file.try_lock(), Err(TryLockError::WouldBlock))
}

/// A name's end that no other process has, and that nobody can guess: 16 hexadecimal digits.
pub fn unique() -> String {
    use std::hash::{BuildHasher, Hasher};
    // keys from the system's source of randomness
    let mut hash = std::collections::hash_map::RandomState::new().build_hasher();
    hash.write_u32(std::process::id());
    format!("{:016x}", hash.finish())
}

/// Whether a text is such an end.
pub fn is_unique(end: &str) -> bool {
    end.len() == 16 && end.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'))
}

/// Whether, by what the system says, something else is mounted on `folder` than on `above`.
pub fn is_mounted(folder: &Path, above: &Path) -> bool {
    let mount = |p: &Path| sys::open(p).ok().and_then(|h| sys::mount(&h));
    matches!((mount(folder), mount(above)), (Some(is), Some(of_above)) if is != of_above)
}

#[cfg(unix)]
#[path = "folder/unix.rs"]
mod sys;

/// Where folders cannot be held open: paths, looked at before each step.
#[cfg(not(unix))]
#[path = "folder/elsewhere.rs"]
mod sys;
