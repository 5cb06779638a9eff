//! Answers in folders that cannot change places: the files are replaced one by one, the manifest last.
//!
//! Before the first is replaced all of them lie on disk in a folder `ready` of the stage. A process that is killed from there
//! on leaves it, and the next command that writes there finishes the replacement.

use crate::answer::linked;
use crate::carry::{is_free, is_ours, kept_name, Kept};
use crate::exchange::sync_folder;
use crate::manifest::Manifest;
use crate::stage::{gated, parent, Stage};
use std::io::{Error, ErrorKind, Result};
use std::path::Path;

/// Folder of a stage whose files are about to take their places in the folder that the stage lies in.
const READY: &str = "ready";

/// Puts the files of the answer `is`, made in `new`, in their places in `target`; the files that were in the way.
///
/// # Errors
/// As the file system gives them. Where it fails between two files the error says so.
pub fn replace(new: &Path, target: &Path, was: Option<&Manifest>, is: &Manifest) -> Result<Vec<Kept>> {
    let names = || is.files.keys().map(String::as_str).chain([Manifest::NAME]);
    for name in names() {
        let in_the_way = |path: &Path| {
            let why = format!("{} is in the way; move it, or give another --out", path.display());
            Error::new(ErrorKind::AlreadyExists, why)
        };
        let path = target.join(name);
        if path.is_dir() {
            return Err(in_the_way(&path));
        }
        let above = path.ancestors().skip(1).take_while(|a| *a != target).find(|a| a.exists() && !a.is_dir());
        if let Some(file) = above {
            return Err(in_the_way(file));
        }
    }
    let stage = Stage::within(target)?;
    let mut kept = Vec::new();
    for name in names().filter(|n| !is_free(&target.join(n)) && !is_ours(target, n, was)) {
        let kept_as = kept_name(name, |n| is_free(&target.join(n)) && !is.files.contains_key(n));
        gated(|| linked(&target.join(name), &target.join(&kept_as)))?;
        kept.push(Kept { name: name.into(), kept_as });
    }
    gated(|| std::fs::rename(new, stage.path().join(READY)))?;
    let finished = sync_folder(stage.path()).and_then(|()| gated(|| finish(stage.path(), target)));
    if let Err(e) = finished {
        stage.leave();
        let why =
            "some files are of this answer and some of the one before; the next command that writes there finishes it";
        return Err(Error::new(e.kind(), format!("{e}: {why}")));
    }
    Ok(kept)
}

/// Finishes a replacement in `target` that the stage holds; nothing where it holds none.
///
/// # Errors
/// As the file system gives them.
pub fn finish(stage: &Path, target: &Path) -> Result<()> {
    let ready = stage.join(READY);
    // the last to take its place: without it everything is done
    let Some(is) = Manifest::read(&ready) else { return Ok(()) };
    for name in is.files.keys().filter(|n| ready.join(n).exists()) {
        let to = target.join(name);
        std::fs::create_dir_all(parent(&to))?;
        std::fs::rename(ready.join(name), to)?;
    }
    if let Some(was) = Manifest::read(target) {
        for name in was.files.keys().filter(|n| !is.files.contains_key(*n) && was.holds(target, n)) {
            std::fs::remove_file(target.join(name))?;
            let folders = Path::new(name).ancestors().skip(1).filter(|a| !a.as_os_str().is_empty());
            // a folder that holds something of the user's stays
            folders.map(|f| target.join(f)).take_while(|f| std::fs::remove_dir(f).is_ok()).for_each(drop);
        }
    }
    sync_folder(target)?;
    std::fs::rename(ready.join(Manifest::NAME), target.join(Manifest::NAME))?;
    sync_folder(target)
}
