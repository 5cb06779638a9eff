//! Folders by their path, for systems other than Unix.

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

pub fn mount(_: &Handle) -> Option<u64> {
    None
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
