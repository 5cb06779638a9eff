//! The user's own files in an answer's folder.

use crate::exchange::is_refused;
use crate::manifest::Manifest;
use crate::stage::is_stage;
use std::ffi::OsStr;
use std::io::Result;
use std::path::Path;

/// A file that was in the way and is not as touchdown wrote it.
#[derive(Clone, Debug, PartialEq)]
pub struct Kept {
    pub name: String,
    pub kept_as: String,
}

/// The name of `entry` of the folder `folder` of an answer, as manifests have it.
pub fn name_within(folder: &str, entry: &OsStr) -> String {
    let entry = entry.to_string_lossy();
    if folder.is_empty() {
        entry.into_owned()
    } else {
        format!("{folder}/{entry}")
    }
}

/// Whether the file `name` in `folder` is as the answer `was` wrote it.
pub fn is_ours(folder: &Path, name: &str, was: Option<&Manifest>) -> bool {
    match was {
        Some(_) if name == Manifest::NAME => true,
        Some(was) => was.holds(folder, name),
        None => false,
    }
}

/// Whether the answer `is` writes a file, or a folder, of that name.
fn is_written(name: &str, is: &Manifest) -> bool {
    name == Manifest::NAME || is.files.contains_key(name) || is.passes(name)
}

/// The name under which `name` is kept: `results.kept.csv`, `results.kept-2.csv`; the first that is free.
pub fn kept_name(name: &str, is_free: impl Fn(&str) -> bool) -> String {
    let (folder, file) = name.rsplit_once('/').map_or(("", name), |(d, f)| (d, f));
    let (stem, end) = match file.rsplit_once('.') {
        Some((stem, end)) if !stem.is_empty() => (stem, format!(".{end}")),
        _ => (file, String::new()),
    };
    let numbered = |n: u64| {
        let number = if n > 1 { format!("-{n}") } else { String::new() };
        name_within(folder, OsStr::new(&format!("{stem}.kept{number}{end}")))
    };
    let mut n = 1;
    while !is_free(&numbered(n)) {
        n += 1;
    }
    numbered(n)
}

/// Whether nothing has the name `path`, not even a link that leads nowhere.
pub fn is_free(path: &Path) -> bool {
    std::fs::symlink_metadata(path).is_err()
}

/// Gives all that is not of the answer `was` in the folder `old` a second name in `new`, the folder of the answer `is`, but
/// for the files `without`. None where that cannot be: a folder of the user's lies there, or there are no second names.
///
/// # Errors
/// As the file system gives them.
pub fn carry(
    old: &Path,
    new: &Path,
    was: Option<&Manifest>,
    is: &Manifest,
    without: &[&Path],
) -> Result<Option<Vec<Kept>>> {
    let mut kept = Vec::new();
    let mut folders = vec![String::new()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(old.join(&folder))? {
            let entry = entry?;
            let (path, file) = (entry.path(), entry.file_name());
            let name = name_within(&folder, &file);
            let is_taken = without.iter().any(|w| w.file_name() == Some(&file)) && folder.is_empty();
            if is_stage(&file) || is_taken {
                continue;
            }
            if entry.file_type()?.is_dir() {
                if !(is.passes(&name) || was.is_some_and(|w| w.passes(&name))) {
                    return Ok(None);
                }
                folders.push(name);
                continue;
            }
            if is_ours(old, &name, was) {
                continue;
            }
            let mut to = new.join(&folder).join(&file);
            if is_written(&name, is) {
                let kept_as = kept_name(&name, |n| is_free(&old.join(n)) && is_free(&new.join(n)));
                to = new.join(&kept_as);
                kept.push(Kept { name, kept_as });
            }
            std::fs::create_dir_all(new.join(&folder))?;
            match std::fs::hard_link(&path, &to) {
                Err(e) if is_refused(&e) => return Ok(None),
                linked => linked?,
            }
        }
    }
    Ok(Some(kept))
}

/// Moves what came into the folder after [`carry`] from `old` into `new`, which has taken its place. What cannot be moved
/// stays.
pub fn settle(old: &Path, new: &Path, is: &Manifest, without: &[&Path]) {
    let was = Manifest::read(old);
    let mut folders = vec![String::new()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(old.join(&folder)).into_iter().flatten().flatten() {
            let file = entry.file_name();
            let name = name_within(&folder, &file);
            let to = new.join(&folder).join(&file);
            let is_taken = without.iter().any(|w| w.file_name() == Some(&file)) && folder.is_empty();
            let is_folder = entry.file_type().is_ok_and(|t| t.is_dir());
            let was_written = was.as_ref().is_some_and(|w| w.files.contains_key(&name) || w.passes(&name));
            if is_folder && (to.is_dir() || was_written) {
                folders.push(name);
            } else if !is_taken && !is_stage(&file) && !was_written && !is_written(&name, is) {
                // two names of one file: nothing happens
                drop(std::fs::rename(entry.path(), to));
            }
        }
    }
}
