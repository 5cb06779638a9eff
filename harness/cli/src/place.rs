//! Where a command is to write, checked before it computes anything; and answers of several files written there.

use crate::print::Shown;
use anyhow::{Context, Result};
use output::{Answer, Committed};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// What `--out` names.
#[derive(Clone, Copy, Debug)]
pub enum Place<'a> {
    /// One file.
    File(&'a Path),
    /// A folder for several; it need not be there yet.
    Folder(&'a Path),
}

/// Why nothing can be written there, and what to do.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum Unwritable {
    #[error("--out is empty; give a name")]
    Empty,
    #[error("{0}: a file is in the way; give another --out")]
    FileInTheWay(String),
    #[error("{0}: a folder is in the way; give --out the name of a file")]
    FolderInTheWay(String),
    #[error("{place}: cannot be written, {above} is no folder; give another --out")]
    NoFolder { place: String, above: String },
    #[error("{place}: cannot be written ({why}); {cure}")]
    Refused { place: String, why: String, cure: String },
}

impl Place<'_> {
    /// Sees that it can be written, by trying; nothing is left behind.
    ///
    /// # Errors
    /// Why it cannot, and the cure.
    pub fn check(&self) -> std::result::Result<(), Unwritable> {
        let (Place::File(path) | Place::Folder(path)) = *self;
        if path.as_os_str().is_empty() {
            return Err(Unwritable::Empty);
        }
        let place = path.shown();
        let folder = match self {
            Place::File(_) if path.is_dir() => return Err(Unwritable::FolderInTheWay(place)),
            Place::Folder(_) if path.exists() && !path.is_dir() => return Err(Unwritable::FileInTheWay(place)),
            Place::File(_) => path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new(".")),
            Place::Folder(_) => path,
        };
        if let Some(above) = folder.ancestors().find(|a| a.exists()).filter(|a| !a.is_dir()) {
            return Err(Unwritable::NoFolder { place, above: above.shown() });
        }
        let refused = |why: String, cure: &str| Unwritable::Refused { place: place.clone(), why, cure: cure.into() };
        const ANOTHER: &str = "give --out a place that can";
        if path.file_name().is_none() && !path.exists() {
            return Err(refused("it ends in no name".into(), "give --out a path that ends in a name"));
        }
        // a name that no file can have, links that lead to each other
        if let Some((e, cure)) = path.metadata().err().and_then(|e| input::cure(&e).map(|cure| (e, cure))) {
            return Err(refused(e.to_string(), cure));
        }
        if path.is_symlink() && !path.exists() {
            return Err(refused("it is a link that leads nowhere".into(), ANOTHER));
        }
        let why = |e: &std::io::Error| match e.kind() {
            ErrorKind::PermissionDenied => "no permission to write there".to_string(),
            ErrorKind::NotFound => "nothing can be made there".to_string(),
            _ => e.to_string(),
        };
        output::probe(folder).map_err(|e| refused(why(&e), input::cure(&e).unwrap_or(ANOTHER)))
    }
}

/// Writes an answer of `command`: all the files into `folder`, or none. What was found in its way is to be reported.
///
/// # Errors
/// As the file system gives them, with the folder.
pub fn write(folder: &Path, command: &str, files: &[(&str, &[u8])]) -> Result<Vec<String>> {
    fill(folder, Answer::begin(folder, command), files)
}

/// Writes files into the answer that is in `folder`; its others stay. What was found in its way is to be reported.
///
/// # Errors
/// As the file system gives them, with the folder.
pub fn amend(folder: &Path, command: &str, files: &[(&str, &[u8])]) -> Result<Vec<String>> {
    fill(folder, Answer::amend(folder, command), files)
}

fn fill(folder: &Path, answer: std::io::Result<Answer>, files: &[(&str, &[u8])]) -> Result<Vec<String>> {
    let written = answer.and_then(|a| {
        files.iter().try_for_each(|(name, bytes)| a.write(name, bytes))?;
        a.commit()
    });
    Ok(notes(folder, &written.with_context(|| unwritten(folder))?).collect())
}

/// What an answer in `folder` has found in its way, and what was finished there of processes that were killed.
pub fn notes<'a>(folder: &'a Path, answer: &'a Committed) -> impl Iterator<Item = String> + 'a {
    output::finished().into_iter().chain(answer.notes().map(|n| format!("{}: {n}", folder.shown())))
}

/// Sees that `out` is none of the files that are read for it.
///
/// # Errors
/// The one that it is.
pub fn is_none_of(out: &Path, mut inputs: impl Iterator<Item = PathBuf>) -> Result<()> {
    let Ok(there) = out.canonicalize() else { return Ok(()) };
    match inputs.find(|i| i.canonicalize().is_ok_and(|i| i == there)) {
        Some(_) => anyhow::bail!("{}: --out is a file that is read for it; give another name", out.shown()),
        None => Ok(()),
    }
}

/// That nothing could be written to `path`.
pub fn unwritten(path: &Path) -> String {
    format!("{}: cannot be written", path.shown())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_that_no_file_can_be_at_is_refused_with_its_cure() {
        let t = tempfile::tempdir().unwrap();
        let refused = |path: &Path| {
            let of = |place: Place<'_>| place.check().unwrap_err().to_string();
            [of(Place::File(path)), of(Place::Folder(path))]
        };
        for said in refused(&t.path().join("o".repeat(256))) {
            assert!(said.contains("give a shorter one"), "{said}");
        }
        for said in refused(&t.path().join("none/..")) {
            assert!(said.contains("ends in no name"), "{said}");
        }
        if cfg!(target_os = "linux") {
            for said in refused(Path::new("/proc/self/x")) {
                assert!(
                    said.ends_with("cannot be written (nothing can be made there); give --out a place that can"),
                    "{said}"
                );
            }
            std::os::unix::fs::symlink(t.path().join("b"), t.path().join("a")).unwrap();
            std::os::unix::fs::symlink(t.path().join("a"), t.path().join("b")).unwrap();
            for said in [refused(&t.path().join("a")), refused(&t.path().join("a/x"))].concat() {
                assert!(said.contains("lead to each other"), "{said}");
            }
        }
    }

    #[test]
    fn what_is_in_the_way_is_named() {
        let t = tempfile::tempdir().unwrap();
        let file = t.path().join("f");
        std::fs::write(&file, "").unwrap();
        let below = file.join("a/b");
        for ok in [Place::Folder(t.path()), Place::Folder(&t.path().join("x/y")), Place::File(&file)] {
            assert_eq!(ok.check(), Ok(()), "{ok:?}");
        }
        let name = |p: &Path| p.shown();
        assert_eq!(Place::Folder(&file).check(), Err(Unwritable::FileInTheWay(name(&file))));
        assert_eq!(Place::File(t.path()).check(), Err(Unwritable::FolderInTheWay(name(t.path()))));
        let no_folder = Unwritable::NoFolder { place: name(&below), above: name(&file) };
        assert_eq!(Place::Folder(&below).check(), Err(no_folder));
        assert_eq!(Place::File(Path::new("")).check(), Err(Unwritable::Empty));
        assert_eq!(std::fs::read_dir(t.path()).unwrap().count(), 1, "something was left behind");
        #[cfg(unix)]
        {
            let link = t.path().join("link");
            std::os::unix::fs::symlink(t.path().join("nowhere"), &link).unwrap();
            for place in [Place::Folder(&link), Place::File(&link)] {
                let said = place.check().unwrap_err().to_string();
                assert!(said.ends_with("(it is a link that leads nowhere); give --out a place that can"), "{said}");
            }
        }
    }
}
