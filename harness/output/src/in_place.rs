//! Answers in folders that cannot change places: the files are replaced one by one, the manifest last.
//!
//! Before the first is replaced all of them lie on disk in a folder `ready` of the stage. A process that is killed from there
//! on leaves it, and the next command that writes there finishes the replacement.

use crate::carry::{is_ours, keep, Kept};
use crate::folder::{Folder, Kind};
use crate::manifest::Manifest;
use crate::stage::{gated, Stage, READY};
use std::io::{Error, ErrorKind, Result};
use std::path::Path;

/// Puts the files of the answer `is`, made in `new` of the folder `made`, in their places in `target`; the files that were in
/// the way.
///
/// # Errors
/// As the file system gives them. Where it fails between two files the error says so.
pub fn replace(made: &Folder, new: &str, target: &Folder, is: &Manifest) -> Result<Vec<Kept>> {
    for name in is.files.keys().map(String::as_str).chain([Manifest::NAME]) {
        let in_the_way = |name: &Path| {
            let why = format!("{} is in the way; move it, or give another --out", target.path().join(name).display());
            Error::new(ErrorKind::AlreadyExists, why)
        };
        let name = Path::new(name);
        if target.found(name)?.is_some_and(|f| f.kind == Kind::Folder) {
            return Err(in_the_way(name));
        }
        for above in name.ancestors().skip(1).filter(|a| !a.as_os_str().is_empty()) {
            if target.found(above)?.is_some_and(|f| f.kind != Kind::Folder) {
                return Err(in_the_way(above));
            }
        }
    }
    let stage = Stage::within(target.path())?;
    gated(|| made.rename(new, stage.folder(), READY))?;
    let finished = stage.folder().sync().and_then(|()| gated(|| finish(stage.folder(), target)));
    finished.map_err(|e| {
        if !has_begun(stage.folder(), target).unwrap_or(true) {
            return Error::new(e.kind(), format!("{e}; the answer before is whole"));
        }
        stage.leave();
        let why =
            "some files are of this answer and some of the one before; the next command that writes there finishes it";
        Error::new(e.kind(), format!("{e}: {why}"))
    })
}

/// Whether a replacement in `target` that the stage of an ended process holds had begun: a file of its list has left
/// the stage for its place. Else the answer before is whole, and nothing is to be finished.
///
/// # Errors
/// As [`Manifest::find`].
pub fn has_begun(stage: &Folder, target: &Folder) -> Result<bool> {
    let Ok(ready) = stage.folder(READY) else { return Ok(false) };
    let Some(is) = Manifest::of(&ready) else { return Ok(false) };
    for name in is.files.keys().filter(|n| ready.is_free(n)) {
        if is.find(target, name)? {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Finishes a replacement in `target` that the stage holds; the files that were in the way. Nothing where it holds none, or
/// one that names files elsewhere.
///
/// # Errors
/// As the file system gives them.
pub fn finish(stage: &Folder, target: &Folder) -> Result<Vec<Kept>> {
    let mut kept = Vec::new();
    let Ok(ready) = stage.folder(READY) else { return Ok(kept) };
    // the last to take its place: without it everything is done
    let Some(is) = Manifest::of(&ready) else { return Ok(kept) };
    let was = Manifest::of(target);
    let is_taken = |n: &str| is.files.contains_key(n);
    // what is in the way goes first: where it cannot be moved, nothing has begun
    for name in is.files.keys().map(String::as_str).filter(|n| is_file(&ready, n)) {
        if target.found(name)?.is_some() && !is_ours(target, name, was.as_ref())? && !is.find(target, name)? {
            kept.extend(keep(target, name, is_taken).map_err(|e| refused(target, name, e))?);
        }
    }
    if was.is_none() && target.found(Manifest::NAME)?.is_some() {
        kept.extend(keep(target, Manifest::NAME, is_taken).map_err(|e| refused(target, Manifest::NAME, e))?);
    }
    for name in is.files.keys().map(String::as_str).filter(|n| is_file(&ready, n)) {
        ready.rename(name, target, name).map_err(|e| refused(target, name, e))?;
    }
    for name in was.iter().flat_map(|w| w.files.keys()).filter(|n| !is.files.contains_key(*n)) {
        if is_ours(target, name, was.as_ref())? {
            target.remove(name).map_err(|e| refused(target, name, e))?;
            let folders = Path::new(name).ancestors().skip(1).filter(|a| !a.as_os_str().is_empty());
            // a folder that holds something of the user's stays
            folders.take_while(|f| target.remove_empty(f).is_ok()).for_each(drop);
        }
    }
    target.sync()?;
    ready.rename(Manifest::NAME, target, Manifest::NAME).map_err(|e| refused(target, Manifest::NAME, e))?;
    target.sync()?;
    Ok(kept)
}

/// That a file cannot be replaced, with its name; with the cure where it is another user's.
fn refused(target: &Folder, name: &str, e: Error) -> Error {
    let cure = match e.kind() {
        ErrorKind::PermissionDenied => "; it is another user's, or may not be changed; give another --out",
        _ => "",
    };
    Error::new(e.kind(), format!("{} cannot be replaced ({e}){cure}", target.path().join(name).display()))
}

fn is_file(ready: &Folder, name: &str) -> bool {
    ready.found(name).is_ok_and(|f| f.is_some_and(|f| f.kind == Kind::File))
}
