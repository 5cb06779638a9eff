//! An answer: files in one folder that appear together, or not at all.

use crate::carry::{carry, name_within, settle, Kept};
use crate::exchange::{exchange, is_fixed, is_refused, sync_folder};
use crate::in_place;
use crate::manifest::{Entry, Manifest};
use crate::stage::{self, gated, parent, Stage};
use std::fs::File;
use std::io::{ErrorKind, Result, Write};
use std::path::{Path, PathBuf};

/// An answer that is being made. What it holds is seen by nobody before [`Answer::commit`]; dropped before that, it
/// leaves nothing.
pub struct Answer {
    stage: Stage,
    /// The folder, and whether the stage lies in it: then it cannot change places.
    target: PathBuf,
    is_fixed: bool,
    manifest: Manifest,
    /// Files that come from the folder itself, with their names in the answer.
    taken: Vec<(PathBuf, String)>,
    /// Whether files of the earlier answer stay that this one does not write.
    amends: bool,
}

/// An answer that is in its place.
#[derive(Debug, Default)]
pub struct Committed {
    /// Files that were in the way and are not as touchdown wrote them: their names, and what they are called now.
    pub kept: Vec<Kept>,
}

impl Committed {
    /// What is to be reported of it, a line each.
    pub fn notes(&self) -> impl Iterator<Item = String> + '_ {
        let line = |k: &Kept| format!("{} was not as touchdown writes it, and is kept as {}", k.name, k.kept_as);
        self.kept.iter().map(line)
    }
}

impl Answer {
    /// Begins an answer of `command` (its name) in `folder`, which need not be there yet. Clears away what killed processes have
    /// left there.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn begin(folder: &Path, command: &str) -> Result<Answer> {
        let mut target = std::path::absolute(folder)?;
        if target.exists() {
            // a link stays one, and what it leads to is what changes places
            target = target.canonicalize()?;
            stage::sweep(&target);
        }
        let beside = if target.exists() && is_fixed(&target) {
            None
        } else {
            std::fs::create_dir_all(parent(&target))?;
            stage::sweep(parent(&target));
            match Stage::within(parent(&target)) {
                Err(e) if is_refused(&e) && target.exists() => None,
                stage => Some(stage?),
            }
        };
        let is_fixed = beside.is_none();
        let stage = beside.map_or_else(|| Stage::within(&target), Ok)?;
        let manifest = Manifest::new(command);
        let a = Answer { stage, target, is_fixed, manifest, taken: Vec::new(), amends: false };
        gated(|| std::fs::create_dir(a.made_in()))?;
        Ok(a)
    }

    /// Begins a change of single files of the answer that is in `folder`; the others stay.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn amend(folder: &Path, command: &str) -> Result<Answer> {
        let mut a = Answer::begin(folder, command)?;
        if let Some(was) = Manifest::read(&a.target) {
            a.manifest = Manifest { files: Default::default(), ..was };
        }
        a.amends = true;
        Ok(a)
    }

    /// Records what the answer depends on, as a hash, by which a later command knows that it need not work it out again.
    #[must_use]
    pub fn of_input(mut self, hash: Option<String>) -> Answer {
        self.manifest.input = hash;
        self
    }

    fn made_in(&self) -> PathBuf {
        self.stage.path().join("new")
    }

    /// Where the file `name` is made; folders on the way are made.
    fn place(&self, name: &str) -> Result<PathBuf> {
        let path = self.made_in().join(name);
        std::fs::create_dir_all(parent(&path))?;
        Ok(path)
    }

    /// Writes the file `name`, with `/` between folders.
    ///
    /// # Errors
    /// As the file system gives them.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        gated(|| File::create(self.place(name)?)?.write_all(bytes))
    }

    /// Takes a finished file from the answer's folder in as `name`: rows that were written there while they were worked out.
    pub fn take(&mut self, file: &Path, name: &str) {
        self.taken.push((file.to_path_buf(), name.into()));
    }

    /// Puts everything on disk and the answer in its place. Files in the folder that are not of an earlier answer of
    /// the same command stay; those that are go.
    ///
    /// # Errors
    /// As the file system gives them; then the folder is as it was, unless the error says otherwise.
    pub fn commit(mut self) -> Result<Committed> {
        for (file, name) in &self.taken {
            gated(|| linked(file, &self.place(name)?))?;
        }
        let was = Manifest::read(&self.target);
        self.enlist("")?;
        if let Some(was) = &was {
            self.stay(was)?;
        }
        self.write(Manifest::NAME, (serde_json::to_string_pretty(&self.manifest)? + "\n").as_bytes())?;
        gated(|| synced(&self.made_in().join(Manifest::NAME)))?;
        sync_folder(&self.made_in())?;
        let kept = self.put(was.as_ref())?;
        for (file, _) in &self.taken {
            // gone already where the folder changed places
            drop(gated(|| std::fs::remove_file(file)));
        }
        Ok(Committed { kept })
    }

    /// Takes in what stays of the answer before: the files of other commands, and of one that is amended all but those that
    /// are written anew.
    fn stay(&mut self, was: &Manifest) -> Result<()> {
        for (name, entry) in &was.files {
            let stays = self.amends || entry.command != self.manifest.command;
            if stays && !self.manifest.files.contains_key(name) && was.holds(&self.target, name) {
                gated(|| linked_or_copied(&self.target.join(name), &self.place(name)?))?;
                self.manifest.files.insert(name.clone(), entry.clone());
            }
        }
        Ok(())
    }

    /// Lists the files below `folder` in the manifest and puts them on disk.
    fn enlist(&mut self, folder: &str) -> Result<()> {
        let path = self.made_in().join(folder);
        for entry in std::fs::read_dir(&path)? {
            let entry = entry?;
            let name = name_within(folder, &entry.file_name());
            if entry.file_type()?.is_dir() {
                self.enlist(&name)?;
            } else {
                gated(|| synced(&entry.path()))?;
                self.manifest.files.insert(name, Entry::of(&entry.path(), &self.manifest.command)?);
            }
        }
        sync_folder(&path)
    }

    /// Puts the finished answer in its place; the files that were in the way.
    fn put(&self, was: Option<&Manifest>) -> Result<Vec<Kept>> {
        let (new, target, is) = (self.made_in(), &self.target, &self.manifest);
        let there;
        let mut was = was;
        if !target.exists() {
            match gated(|| std::fs::rename(&new, target)) {
                // another process has put its answer there since
                Err(e) if matches!(e.kind(), ErrorKind::AlreadyExists | ErrorKind::DirectoryNotEmpty) => {
                    there = Manifest::read(target);
                    was = there.as_ref();
                }
                renamed => {
                    renamed?;
                    sync_folder(parent(target))?;
                    return Ok(Vec::new());
                }
            }
        }
        if !self.is_fixed {
            let taken: Vec<&Path> = self.taken.iter().map(|(file, _)| file.as_path()).collect();
            if let Some(kept) = gated(|| carry(target, &new, was, is, &taken))? {
                drop(std::fs::metadata(target).and_then(|m| std::fs::set_permissions(&new, m.permissions())));
                match gated(|| exchange(&new, target)) {
                    Err(e) if is_refused(&e) => {}
                    exchanged => {
                        exchanged?;
                        settle(&new, target, is, &taken);
                        sync_folder(parent(target))?;
                        return Ok(kept);
                    }
                }
            }
        }
        in_place::replace(&new, target, was, is)
    }
}

fn synced(file: &Path) -> Result<()> {
    // elsewhere a file has to be open for writing
    if cfg!(unix) {
        File::open(file)?.sync_all()?;
    }
    Ok(())
}

/// Gives `file` a second name; moves it where there are no second names.
pub fn linked(file: &Path, name: &Path) -> Result<()> {
    match std::fs::hard_link(file, name) {
        Err(e) if is_refused(&e) => std::fs::rename(file, name),
        done => done,
    }
}

fn linked_or_copied(file: &Path, name: &Path) -> Result<()> {
    match std::fs::hard_link(file, name) {
        Err(e) if is_refused(&e) => std::fs::copy(file, name).map(drop),
        done => done,
    }
}
