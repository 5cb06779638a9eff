//! Files and folders written whole or not at all.
//!
//! What is written is made in a hidden folder beside its place, the stage, and put on disk; then it takes its place in one
//! step. A file takes its place by a rename. An answer, a folder of files with a manifest, changes places with the folder
//! that had its name. A process that is killed leaves a stage, which the next command that writes there clears away.

//!
//! Below a folder everything is opened, made, renamed and removed by [`Folder`], which follows no link and takes no name
//! that leads out of it.

mod answer;
mod carry;
mod exchange;
mod folder;
mod in_place;
mod manifest;
mod part;
mod scratch;
mod stage;

pub use answer::{Answer, Committed};
pub use carry::Kept;
pub use folder::Folder;
pub use manifest::{hexadecimal, Entry, Manifest};
pub use part::Part;
pub use scratch::Scratch;
pub use stage::{abandon, finished, is_ending};

use stage::{parent, Stage, NEW};
use std::path::Path;

/// Writes `bytes` to `path`, in the place of what had that name; makes the folders it needs.
///
/// # Errors
/// As the file system gives them.
pub fn write(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let name = path.file_name().ok_or(std::io::ErrorKind::InvalidInput)?;
    write_below(parent(path), Path::new(name), bytes)
}

/// As [`write()`], to the plain name `name` below `folder`: no link is followed on the way from there.
///
/// # Errors
/// As the file system gives them; a name that leads out of the folder; something of that name that is no file.
pub fn write_below(folder: &Path, name: impl AsRef<Path>, bytes: &[u8]) -> std::io::Result<()> {
    place(folder, name.as_ref(), bytes, |staged, home, name| {
        // a link, a pipe or a device of that name is not what the user meant to replace
        match home.found(name)? {
            Some(found) if found.kind != folder::Kind::File => Err(std::io::Error::new(
                std::io::ErrorKind::AlreadyExists,
                format!("{} is no file; move it, or give another --out", home.path().join(name).display()),
            )),
            _ => staged.rename(NEW, home, name),
        }
    })
}

/// As [`write_below`], where a file that is none of ours, as `is_ours` says of it, is kept under another name, which is
/// returned.
///
/// # Errors
/// As [`write_below`].
pub fn write_keeping(
    folder: &Path,
    name: impl AsRef<Path>,
    bytes: &[u8],
    is_ours: impl Fn(std::fs::File) -> bool,
) -> std::io::Result<Option<Kept>> {
    place(folder, name.as_ref(), bytes, |staged, home, name| {
        let name = name.to_str().ok_or(std::io::ErrorKind::InvalidInput)?;
        let kept = match home.found(name)? {
            Some(_) if !part::is_one(home, name, &is_ours) => carry::keep(home, name, |_| false)?,
            _ => None,
        };
        staged.rename(NEW, home, name)?;
        Ok(kept)
    })
}

/// As [`write_keeping`], to `path`.
///
/// # Errors
/// As [`write()`].
pub fn write_keeping_at(
    path: &Path,
    bytes: &[u8],
    is_ours: impl Fn(std::fs::File) -> bool,
) -> std::io::Result<Option<Kept>> {
    let name = path.file_name().ok_or(std::io::ErrorKind::InvalidInput)?;
    write_keeping(parent(path), Path::new(name), bytes, is_ours)
}

/// As [`write()`], where nothing has that name yet.
///
/// # Errors
/// As the file system gives them; `AlreadyExists` where something has the name.
pub fn write_new(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let name = path.file_name().ok_or(std::io::ErrorKind::InvalidInput)?;
    place(parent(path), Path::new(name), bytes, |staged, home, name| match staged.link(NEW, home, name) {
        Err(e) if exchange::is_refused(&e) && home.is_free(name) => staged.rename(NEW, home, name),
        linked => linked,
    })
}

/// Stages `bytes` where they are to be, and hands the stage, the folder that the file `name` below `folder` lies in, and the
/// name in there to `put`. An answer that takes the place of `folder` at the same time is waited for.
fn place<T>(
    folder: &Path,
    name: &Path,
    bytes: &[u8],
    put: impl Fn(&Folder, &Folder, &std::ffi::OsStr) -> std::io::Result<T>,
) -> std::io::Result<T> {
    let file = name.file_name().ok_or(std::io::ErrorKind::InvalidInput)?;
    for _ in 0..1000 {
        let root = Folder::made(folder)?;
        let below = match name.parent().filter(|p| !p.as_os_str().is_empty()) {
            Some(above) => Some(stage::gated(|| root.make_all(above))?),
            None => None,
        };
        let home = below.as_ref().unwrap_or(&root);
        stage::sweep(home.path());
        let stage = Stage::within(home.path())?;
        stage::gated(|| stage.folder().write(NEW, bytes))?;
        root.hold()?;
        if !root.is_in_place()? || !home.is_in_place()? {
            // another answer has taken its place since
            continue;
        }
        let put = stage::gated(|| put(stage.folder(), home, file))?;
        home.sync()?;
        return Ok(put);
    }
    Err(folder::in_use(folder))
}

/// Removes the file of the plain name `name` below `folder`, and follows no link on the way.
///
/// # Errors
/// As the file system gives them; a name that leads out of the folder.
pub fn remove_below(folder: &Path, name: impl AsRef<Path>) -> std::io::Result<()> {
    stage::gated(|| Folder::open(folder)?.remove(name))
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
