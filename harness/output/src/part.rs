//! Rows that are written into an answer's folder while they are worked out.

use crate::carry::{keep, Kept};
use crate::exchange::is_refused;
use crate::folder::{try_hold, Folder, Hold, Kind};
use crate::stage::{gated, is_named, parent};
use std::ffi::OsStr;
use std::fs::File;
use std::io::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// How the name of a file ends that is being written.
const END: &str = ".part";

/// A file in an answer's folder, of this process alone as long as it is open. It goes when it is dropped, unless it was
/// left.
#[derive(Debug)]
pub struct Part {
    /// The folder's path: another answer may take its place meanwhile, with the file in it.
    folder: PathBuf,
    name: String,
    /// Held against others; its own name is in the folder.
    file: File,
}

impl Part {
    /// Makes `path` with `.part` behind it; its folders are made. What a process that was killed has left under that name goes
    /// where it is one of ours, as `is_ours` says of the open file; anything else is kept under another name, which is returned.
    ///
    /// # Errors
    /// As the file system gives them; that another process is writing there, with the cure.
    pub fn new(path: &Path, is_ours: impl Fn(File) -> bool) -> Result<(Part, Vec<Kept>)> {
        let folder = Folder::made(parent(path))?;
        let name = path.file_name().and_then(OsStr::to_str).ok_or(ErrorKind::InvalidInput)?;
        let name = format!("{name}{END}");
        let mut kept = Vec::new();
        for _ in 0..1000 {
            match gated(|| folder.create(&name)) {
                Err(e) if e.kind() == ErrorKind::AlreadyExists => {
                    kept.extend(gated(|| make_room(&folder, &name, &is_ours))?);
                }
                file => {
                    let file = file?;
                    // another may have taken it to be left behind
                    if try_hold(&file) && is_named(&file, &folder, &name) {
                        return Ok((Part { folder: std::path::absolute(folder.path())?, name, file }, kept));
                    }
                }
            }
        }
        Err(in_use(&folder, &name))
    }

    /// The file, to be written to; both it and the one held here are one.
    ///
    /// # Errors
    /// As the system gives them.
    pub fn file(&self) -> Result<File> {
        self.file.try_clone()
    }

    /// Its name in the folder.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The folder that the file lies in now.
    fn home(&self) -> Result<Folder> {
        let folder = Folder::open(&self.folder)?;
        match is_named(&self.file, &folder, &self.name) {
            true => Ok(folder),
            false => {
                let why = format!(
                    "{} was taken away or replaced while it was written",
                    self.folder.join(&self.name).display()
                );
                Err(Error::new(ErrorKind::NotFound, why))
            }
        }
    }

    /// Gives the file the name `name` in the folder `to` too.
    pub(crate) fn linked(&self, to: &Folder, name: &str) -> Result<()> {
        let folder = self.home()?;
        match folder.link(&self.name, to, name) {
            Err(e) if is_refused(&e) => folder.rename(&self.name, to, name),
            done => done,
        }
    }

    /// Leaves the rows under their name without `.part`, in the place of rows that a run before has left there. What else
    /// has that name is kept under another, which is returned.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn leave(self, is_ours: impl Fn(File) -> bool) -> Result<Option<Kept>> {
        let name = self.name.strip_suffix(END).unwrap_or(&self.name).to_string();
        // an answer that takes the folder's place is waited for, and waits
        let _held = Folder::held(&self.folder, Hold::Alone)?;
        gated(|| {
            let folder = self.home()?;
            let kept = match folder.found(&name)? {
                Some(_) if !is_one(&folder, &name, &is_ours) => keep(&folder, &name, |_| false)?,
                _ => None,
            };
            folder.rename(&self.name, &folder, &name)?;
            Ok(kept)
        })
    }
}

impl Drop for Part {
    fn drop(&mut self) {
        // where it has taken its place already there is nothing to remove
        drop(gated(|| self.home()?.remove(&self.name)));
    }
}

fn in_use(folder: &Folder, name: &str) -> Error {
    let why = format!(
        "{} is being written by another process; wait for its end, or give another --out",
        folder.path().join(name).display()
    );
    Error::new(ErrorKind::ResourceBusy, why)
}

/// Whether the file is one of ours; an empty one is.
pub fn is_one(folder: &Folder, name: &str, is_ours: &impl Fn(File) -> bool) -> bool {
    let file = folder.read(name).and_then(|f| Ok((f.metadata()?.len(), f)));
    file.is_ok_and(|(length, f)| length == 0 || is_ours(f))
}

/// Takes away what has the name of a part, or gives it another.
fn make_room(folder: &Folder, name: &str, is_ours: &impl Fn(File) -> bool) -> Result<Option<Kept>> {
    let kind = folder.found(name)?.map(|f| f.kind);
    if kind == Some(Kind::Folder) {
        let why = format!("{} is in the way; move it, or give another --out", folder.path().join(name).display());
        return Err(Error::new(ErrorKind::AlreadyExists, why));
    }
    if kind == Some(Kind::File) {
        let there = match folder.read(name) {
            Err(e) if e.kind() == ErrorKind::NotFound => return Ok(None),
            there => there?,
        };
        if !try_hold(&there) {
            return Err(in_use(folder, name));
        }
        if !is_named(&there, folder, name) {
            return Ok(None);
        }
        if is_one(folder, name, is_ours) {
            folder.remove(name)?;
            return Ok(None);
        }
        let kept = keep(folder, name, |_| false)?;
        folder.remove(name)?;
        return Ok(kept);
    }
    if kind.is_some() {
        let kept = keep(folder, name, |_| false)?;
        drop(folder.remove(name));
        return Ok(kept);
    }
    Ok(None)
}
