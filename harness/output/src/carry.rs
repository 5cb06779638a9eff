//! The user's own files in an answer's folder.

use crate::exchange::is_refused;
use crate::folder::{Folder, Kind};
use crate::manifest::Manifest;
use crate::stage::is_stage;
use std::ffi::{OsStr, OsString};
use std::io::{Error, ErrorKind, Result};
use std::path::{Path, PathBuf};

/// A file that was in the way and is not as touchdown wrote it.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept {
    pub name: String,
    pub kept_as: String,
}

impl Kept {
    /// What is to be reported of it.
    pub fn note(&self) -> String {
        format!("{} was not as touchdown writes it, and is kept as {}", self.name, self.kept_as)
    }
}

/// The name of `entry` of the folder `folder` of an answer, as manifests have it. Of one that is no UTF-8, which no answer holds,
/// a name that is in no manifest.
pub fn name_within(folder: &str, entry: &OsStr) -> String {
    let entry = match entry.to_str() {
        Some(name) => name.into(),
        None => entry.to_string_lossy() + "\0",
    };
    if folder.is_empty() {
        entry.into_owned()
    } else {
        format!("{folder}/{entry}")
    }
}

/// Whether the file `name` in `folder` is as the answer `was` wrote it.
///
/// # Errors
/// As [`Manifest::find`].
pub fn is_ours(folder: &Folder, name: &str, was: Option<&Manifest>) -> Result<bool> {
    match was {
        Some(_) if name == Manifest::NAME => Ok(true),
        Some(was) => was.find(folder, name),
        None => Ok(false),
    }
}

/// Whether the answer `is` writes a file, or a folder, of that name.
fn is_written(name: &str, is: &Manifest) -> bool {
    name == Manifest::NAME || is.files.contains_key(name) || is.passes(name)
}

/// Longest name of a file, bytes, and most names that are tried.
const LONGEST: usize = 255;
const TRIED: u64 = 10_000;

/// The name under which `name` is kept: `results.kept.csv`, `results.kept-2.csv`; the first that is free. What is too long with that
/// is cut. Where none of many is free it is the last of them, which can then not be given.
pub fn kept_name(name: &str, is_free: impl Fn(&str) -> bool) -> String {
    let (folder, file) = name.rsplit_once('/').map_or(("", name), |(d, f)| (d, f));
    let (stem, end) = match file.rsplit_once('.') {
        Some((stem, end)) if !stem.is_empty() => (stem, format!(".{end}")),
        _ => (file, String::new()),
    };
    let numbered = |n: u64| {
        let number = if n > 1 { format!("-{n}") } else { String::new() };
        let end = format!(".kept{number}{end}");
        let mut length = stem.len().min(LONGEST.saturating_sub(end.len()));
        while !stem.is_char_boundary(length) {
            length -= 1;
        }
        name_within(folder, OsStr::new(&format!("{}{end}", &stem[..length])))
    };
    let free = (1..TRIED).find(|n| is_free(&numbered(*n)));
    numbered(free.unwrap_or(TRIED))
}

/// Gives the file `name` in `folder`, which is about to be replaced, the name that it is kept under, beside its own where
/// there are second names; `is_taken` says which names are about to be written. None where a process that was killed here has
/// kept it already.
///
/// # Errors
/// As the file system gives them.
pub fn keep(folder: &Folder, name: &str, is_taken: impl Fn(&str) -> bool) -> Result<Option<Kept>> {
    let is = folder.found(name)?.map(|f| f.identity).filter(|i| *i != (0, 0));
    let has_it = |n: &str| is.is_some() && folder.found(n).ok().flatten().map(|f| f.identity) == is;
    let kept_as = kept_name(name, |n| has_it(n) || folder.is_free(n) && !is_taken(n));
    if has_it(&kept_as) {
        return Ok(None);
    }
    match folder.link(name, folder, &kept_as) {
        Err(e) if is_refused(&e) => folder.rename(name, folder, &kept_as)?,
        done => done?,
    }
    Ok(Some(Kept { name: name.into(), kept_as }))
}

/// A walk through a folder of an answer: folders still to see, by their names as the file system and as manifests have them.
struct Walk<'a> {
    root: &'a Folder,
    open: Vec<(PathBuf, String)>,
}

/// What a walk came by.
struct Entry {
    path: PathBuf,
    name: String,
    file: OsString,
    is_top: bool,
    is_folder: bool,
}

impl Walk<'_> {
    fn of(root: &Folder) -> Walk<'_> {
        Walk { root, open: vec![(PathBuf::new(), String::new())] }
    }

    /// All in the next folder.
    fn next(&mut self) -> Option<Result<Vec<Entry>>> {
        let (path, name) = self.open.pop()?;
        let is_top = name.is_empty();
        let names = match is_top {
            true => self.root.names(),
            false => self.root.folder(&path).and_then(|f| f.names()),
        };
        let entry = |file: OsString| {
            let (path, name) = (path.join(&file), name_within(&name, &file));
            let found = self.root.found(&path)?.ok_or_else(|| Error::from(ErrorKind::NotFound))?;
            Ok(Entry { path, name, file, is_top, is_folder: found.kind == Kind::Folder })
        };
        // what has gone since it was listed is not there
        let is_there = |e: &Result<Entry>| !e.as_ref().is_err_and(|e| e.kind() == ErrorKind::NotFound);
        Some(names.and_then(|all| all.into_iter().map(entry).filter(is_there).collect()))
    }

    fn enter(&mut self, e: &Entry) {
        self.open.push((e.path.clone(), e.name.clone()));
    }
}

/// Gives all that is not of the answer `was` in the folder `old` a second name in `new`, the folder of the answer `is`, but
/// for the files `without`. None where that cannot be: a folder of the user's lies there, or there are no second names.
///
/// # Errors
/// As the file system gives them.
pub fn carry(
    old: &Folder,
    new: &Folder,
    was: Option<&Manifest>,
    is: &Manifest,
    without: &[&OsStr],
) -> Result<Option<Vec<Kept>>> {
    let mut kept = Vec::new();
    let mut walk = Walk::of(old);
    while let Some(entries) = walk.next() {
        for e in entries? {
            if e.is_top && without.contains(&e.file.as_os_str()) {
                continue;
            }
            if e.is_folder {
                // a stage is of a process that works in here, or somebody's folder of such a name
                if is_stage(&e.file) || !(is.passes(&e.name) || was.is_some_and(|w| w.passes(&e.name))) {
                    return Ok(None);
                }
                walk.enter(&e);
                continue;
            }
            if is_ours(old, &e.name, was)? {
                continue;
            }
            let mut to = e.path.clone();
            if is_written(&e.name, is) {
                let kept_as = kept_name(&e.name, |n| old.is_free(n) && new.is_free(n));
                to = Path::new(&kept_as).to_path_buf();
                kept.push(Kept { name: e.name, kept_as });
            }
            match old.link(&e.path, new, &to) {
                // taken away by its owner since
                Err(e) if e.kind() == ErrorKind::NotFound => {}
                Err(e) if is_refused(&e) => return Ok(None),
                linked => linked?,
            }
        }
    }
    Ok(Some(kept))
}

/// Moves what came into the folder after [`carry`] from `old` into `new`, which has taken its place: files, folders,
/// and stages of others, who find them there. What cannot be moved stays.
pub fn settle(old: &Folder, new: &Folder, is: &Manifest, without: &[&OsStr]) {
    let was = Manifest::of(old);
    let mut walk = Walk::of(old);
    let enter = |walk: &mut Walk, e: &Entry| {
        // who is putting a file there comes to an end first; who comes later sees that the place is another
        drop(old.folder(&e.path).and_then(|folder| folder.hold()));
        walk.enter(e);
    };
    while let Some(entries) = walk.next() {
        for e in entries.into_iter().flatten() {
            let is_taken = e.is_top && without.contains(&e.file.as_os_str());
            let was_written = was.as_ref().is_some_and(|w| w.files.contains_key(&e.name) || w.passes(&e.name));
            let is_in_new = || matches!(new.found(&e.path), Ok(Some(f)) if f.kind == Kind::Folder);
            if e.is_folder && (was_written || is_in_new()) {
                enter(&mut walk, &e);
            } else if !is_taken && !was_written && !is_written(&e.name, is) {
                // two names of one file: nothing happens
                let moved = old.rename(&e.path, new, &e.path);
                // somebody has made a folder of that name there meanwhile
                if moved.is_err() && e.is_folder && is_in_new() {
                    enter(&mut walk, &e);
                }
            }
        }
    }
}
