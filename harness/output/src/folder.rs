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

#[cfg(unix)]
mod sys {
    use super::{Found, Hold, Kind};
    use rustix::fs::{
        fchmod, fsync, linkat, mkdirat, openat, renameat, statat, unlinkat, AtFlags, Dir, FileType, FlockOperation,
        Mode, OFlags, CWD,
    };
    use rustix::io::Errno;
    use std::ffi::{OsStr, OsString};
    use std::fs::{File, Metadata};
    use std::io::Result;
    use std::os::fd::OwnedFd;
    use std::os::unix::ffi::OsStrExt;
    use std::os::unix::fs::MetadataExt;
    use std::path::Path;

    pub type Handle = OwnedFd;

    const AS_FOLDER: OFlags = OFlags::RDONLY.union(OFlags::DIRECTORY).union(OFlags::CLOEXEC);
    /// A pipe is not waited for, a link not followed, and a terminal does not become ours.
    const PLAIN: OFlags = OFlags::NOFOLLOW.union(OFlags::NONBLOCK).union(OFlags::NOCTTY).union(OFlags::CLOEXEC);

    fn mode(bits: u32) -> Mode {
        Mode::from_bits_truncate(bits as rustix::fs::RawMode)
    }

    pub fn open(path: &Path) -> Result<Handle> {
        Ok(openat(CWD, path, AS_FOLDER, Mode::empty())?)
    }

    pub fn open_folder(at: &Handle, name: &OsStr) -> Result<Handle> {
        Ok(openat(at, name, AS_FOLDER | OFlags::NOFOLLOW, Mode::empty())?)
    }

    pub fn make_folder(at: &Handle, name: &OsStr, is_private: bool) -> Result<()> {
        Ok(mkdirat(at, name, mode(if is_private { 0o700 } else { 0o777 }))?)
    }

    pub fn read(at: &Handle, name: &OsStr) -> Result<File> {
        Ok(openat(at, name, OFlags::RDONLY | PLAIN, Mode::empty())?.into())
    }

    pub fn create(at: &Handle, name: &OsStr) -> Result<File> {
        let new = OFlags::RDWR | OFlags::CREATE | OFlags::EXCL;
        Ok(openat(at, name, new | PLAIN, mode(0o666))?.into())
    }

    pub fn look(at: &Handle, name: &OsStr) -> Result<Found> {
        let s = statat(at, name, AtFlags::SYMLINK_NOFOLLOW)?;
        let kind = match FileType::from_raw_mode(s.st_mode) {
            FileType::RegularFile => Kind::File,
            FileType::Directory => Kind::Folder,
            _ => Kind::Other,
        };
        #[allow(clippy::unnecessary_cast)] // other platforms have other integers
        let (device, number, length) = (s.st_dev as u64, s.st_ino as u64, s.st_size as u64);
        Ok(Found { kind, length, identity: (device, number), is_own: s.st_uid == user() })
    }

    fn user() -> u32 {
        rustix::process::geteuid().as_raw()
    }

    pub fn remove(at: &Handle, name: &OsStr) -> Result<()> {
        Ok(unlinkat(at, name, AtFlags::empty())?)
    }

    pub fn remove_folder(at: &Handle, name: &OsStr) -> Result<()> {
        Ok(unlinkat(at, name, AtFlags::REMOVEDIR)?)
    }

    /// Lets the user read, write and enter a folder of theirs whose mode forbids it.
    pub fn open_up(at: &Handle, name: &OsStr) -> Result<()> {
        #[cfg(target_os = "linux")]
        {
            use std::os::fd::AsRawFd;
            // a handle that needs no right to read; by /proc its mode is changed and no link followed
            let flags = OFlags::PATH | OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC;
            let held = openat(at, name, flags, Mode::empty())?;
            let path = format!("/proc/self/fd/{}", held.as_raw_fd());
            Ok(rustix::fs::chmodat(CWD, path, mode(0o700), AtFlags::empty())?)
        }
        #[cfg(not(target_os = "linux"))]
        Ok(rustix::fs::chmodat(at, name, mode(0o700), AtFlags::SYMLINK_NOFOLLOW)?)
    }

    pub fn rename(at: &Handle, name: &OsStr, to: &Handle, new: &OsStr) -> Result<()> {
        Ok(renameat(at, name, to, new)?)
    }

    pub fn link(at: &Handle, name: &OsStr, to: &Handle, new: &OsStr) -> Result<()> {
        Ok(linkat(at, name, to, new, AtFlags::empty())?)
    }

    #[cfg(any(target_os = "linux", target_os = "macos"))]
    pub fn exchange(at: &Handle, name: &OsStr, to: &Handle, other: &OsStr) -> Result<()> {
        Ok(rustix::fs::renameat_with(at, name, to, other, rustix::fs::RenameFlags::EXCHANGE)?)
    }

    #[cfg(not(any(target_os = "linux", target_os = "macos")))]
    pub fn exchange(_: &Handle, _: &OsStr, _: &Handle, _: &OsStr) -> Result<()> {
        Err(std::io::ErrorKind::Unsupported.into())
    }

    pub fn names(at: &Handle) -> Result<Vec<OsString>> {
        let mut all = Vec::new();
        for entry in Dir::read_from(at)? {
            let entry = entry?;
            let name = entry.file_name().to_bytes();
            if name != b"." && name != b".." {
                all.push(OsStr::from_bytes(name).to_os_string());
            }
        }
        Ok(all)
    }

    pub fn sync(at: &Handle) -> Result<()> {
        Ok(fsync(at)?)
    }

    pub fn permit_as(at: &Handle, other: &Handle) -> Result<()> {
        let (is, was) = (rustix::fs::fstat(at)?, rustix::fs::fstat(other)?);
        if has_attributes(other) {
            return Err(std::io::ErrorKind::Unsupported.into());
        }
        let owner = (is.st_uid != was.st_uid).then(|| rustix::fs::Uid::from_raw(was.st_uid));
        let group = (is.st_gid != was.st_gid).then(|| rustix::fs::Gid::from_raw(was.st_gid));
        if owner.is_some() || group.is_some() {
            rustix::fs::fchown(at, owner, group)?;
        }
        // the last: a change of owner takes bits of the mode away
        Ok(fchmod(at, Mode::from_raw_mode(was.st_mode))?)
    }

    /// Whether a folder has attributes beside owner, group and mode, such as an access control list, that one in its place has not.
    #[cfg(target_os = "linux")]
    fn has_attributes(at: &Handle) -> bool {
        let mut names = vec![0u8; 1 << 16];
        match rustix::fs::flistxattr(at, &mut names) {
            // labels of the system's security are those that it gives
            Ok(n) => names[..n].split(|b| *b == 0).any(|name| !name.is_empty() && !name.starts_with(b"security.")),
            Err(e) => e != Errno::NOTSUP,
        }
    }

    #[cfg(not(target_os = "linux"))]
    fn has_attributes(_: &Handle) -> bool {
        false
    }

    pub fn identity(at: &Handle) -> Result<(u64, u64)> {
        let s = rustix::fs::fstat(at)?;
        #[allow(clippy::unnecessary_cast)] // other platforms have other integers
        Ok((s.st_dev as u64, s.st_ino as u64))
    }

    pub fn identity_of(m: &Metadata) -> Result<(u64, u64)> {
        Ok((m.dev(), m.ino()))
    }

    pub fn is_own(at: &Handle) -> bool {
        rustix::fs::fstat(at).is_ok_and(|s| s.st_uid == user())
    }

    pub fn is_private(at: &Handle) -> bool {
        rustix::fs::fstat(at).is_ok_and(|s| s.st_mode & 0o777 == 0o700)
    }

    pub fn try_hold(at: &Handle, how: Hold) -> Result<()> {
        let operation = match how {
            Hold::Alone => FlockOperation::NonBlockingLockExclusive,
            Hold::Together => FlockOperation::NonBlockingLockShared,
        };
        match rustix::fs::flock(at, operation) {
            Err(Errno::INTR) => Err(std::io::ErrorKind::WouldBlock.into()),
            done => Ok(done?),
        }
    }
}

/// Where folders cannot be held open: paths, looked at before each step.
#[cfg(not(unix))]
mod sys {
    use super::{Found, Hold, Kind};
    use std::ffi::{OsStr, OsString};
    use std::fs::{File, Metadata, OpenOptions};
    use std::io::{Error, ErrorKind, Result};
    use std::path::{Path, PathBuf};

    pub type Handle = PathBuf;

    pub fn open(path: &Path) -> Result<Handle> {
        if std::fs::metadata(path)?.is_dir() {
            return Ok(path.to_path_buf());
        }
        Err(ErrorKind::NotADirectory.into())
    }

    pub fn open_folder(at: &Handle, name: &OsStr) -> Result<Handle> {
        match look(at, name)?.kind {
            Kind::Folder => Ok(at.join(name)),
            _ => Err(ErrorKind::NotADirectory.into()),
        }
    }

    pub fn make_folder(at: &Handle, name: &OsStr, _is_private: bool) -> Result<()> {
        std::fs::create_dir(at.join(name))
    }

    pub fn read(at: &Handle, name: &OsStr) -> Result<File> {
        match look(at, name)?.kind {
            Kind::File => File::open(at.join(name)),
            _ => Err(ErrorKind::InvalidInput.into()),
        }
    }

    pub fn create(at: &Handle, name: &OsStr) -> Result<File> {
        OpenOptions::new().read(true).write(true).create_new(true).open(at.join(name))
    }

    pub fn look(at: &Handle, name: &OsStr) -> Result<Found> {
        let m = std::fs::symlink_metadata(at.join(name))?;
        let kind = match () {
            () if m.is_file() => Kind::File,
            () if m.is_dir() => Kind::Folder,
            () => Kind::Other,
        };
        Ok(Found { kind, length: m.len(), identity: (0, 0), is_own: true })
    }

    pub fn remove(at: &Handle, name: &OsStr) -> Result<()> {
        std::fs::remove_file(at.join(name))
    }

    pub fn remove_folder(at: &Handle, name: &OsStr) -> Result<()> {
        std::fs::remove_dir(at.join(name))
    }

    pub fn open_up(_: &Handle, _: &OsStr) -> Result<()> {
        Err(ErrorKind::PermissionDenied.into())
    }

    pub fn rename(at: &Handle, name: &OsStr, to: &Handle, new: &OsStr) -> Result<()> {
        std::fs::rename(at.join(name), to.join(new))
    }

    pub fn link(at: &Handle, name: &OsStr, to: &Handle, new: &OsStr) -> Result<()> {
        std::fs::hard_link(at.join(name), to.join(new))
    }

    pub fn exchange(_: &Handle, _: &OsStr, _: &Handle, _: &OsStr) -> Result<()> {
        Err(Error::from(ErrorKind::Unsupported))
    }

    pub fn names(at: &Handle) -> Result<Vec<OsString>> {
        std::fs::read_dir(at)?.map(|e| Ok(e?.file_name())).collect()
    }

    pub fn sync(_: &Handle) -> Result<()> {
        Ok(())
    }

    pub fn permit_as(_: &Handle, _: &Handle) -> Result<()> {
        Ok(())
    }

    pub fn identity(_: &Handle) -> Result<(u64, u64)> {
        Ok((0, 0))
    }

    pub fn identity_of(_: &Metadata) -> Result<(u64, u64)> {
        Ok((0, 0))
    }

    pub fn is_own(_: &Handle) -> bool {
        true
    }

    pub fn is_private(_: &Handle) -> bool {
        true
    }

    pub fn try_hold(_: &Handle, _: Hold) -> Result<()> {
        Ok(())
    }
}
