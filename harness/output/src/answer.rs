//! An answer: files in one folder that appear together, or not at all.

use crate::carry::{carry, name_within, settle, Kept};
use crate::exchange::{is_fixed, is_refused};
use crate::folder::{Folder, Hold, Kind};
use crate::in_place;
use crate::manifest::{Entry, Manifest};
use crate::part::Part;
use crate::stage::{self, gated, parent, Stage, NEW};
use std::ffi::{OsStr, OsString};
use std::io::{Error, ErrorKind, Result, Write};
use std::path::{Path, PathBuf};

/// An answer that is being made. What it holds is seen by nobody before [`Answer::commit`]; dropped before that, it
/// leaves nothing.
pub struct Answer {
    /// Where it is made, in the stage.
    made: Folder,
    stage: Stage,
    target: PathBuf,
    /// Whether the stage lies in the folder: then it cannot change places.
    is_fixed: bool,
    manifest: Manifest,
    /// Files that come from the folder itself, with their names in the answer.
    taken: Vec<(Part, String)>,
    /// Whether files of the earlier answer stay that this one does not write.
    amends: bool,
}

/// Where an answer's folder lies.
struct Place {
    above: Folder,
    name: OsString,
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
        self.kept.iter().map(Kept::note)
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
        let made = gated(|| stage.folder().make(NEW))?;
        let manifest = Manifest::new(command);
        Ok(Answer { stage, made, target, is_fixed, manifest, taken: Vec::new(), amends: false })
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

    /// Writes the file `name`, with `/` between folders.
    ///
    /// # Errors
    /// As the file system gives them; a name that is written already, or that leads out of the answer.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<()> {
        gated(|| self.made.create(name)?.write_all(bytes))
    }

    /// Writes the file `name` of this answer anew, which [`Answer::write`] wrote.
    ///
    /// # Errors
    /// As the file system gives them; a name that was not written, or that leads out of the answer.
    pub fn rewrite(&self, name: &str, bytes: &[u8]) -> Result<()> {
        gated(|| {
            self.made.remove(name)?;
            self.made.create(name)?.write_all(bytes)
        })
    }

    /// Takes the finished rows in as `name`, which were written in the answer's folder while they were worked out.
    pub fn take(&mut self, rows: Part, name: &str) {
        self.taken.push((rows, name.into()));
    }

    /// Puts everything on disk and the answer in its place. Files in the folder that are not of an earlier answer of
    /// the same command stay; those that are go. Where others put their answers into the same folder it waits for them.
    ///
    /// # Errors
    /// As the file system gives them; then the folder is as it was, unless the error says otherwise.
    pub fn commit(mut self) -> Result<Committed> {
        for (rows, name) in &self.taken {
            gated(|| rows.linked(&self.made, name))?;
        }
        self.enlist("")?;
        let own = self.manifest.clone();
        loop {
            let place = self.place()?;
            let there = self.held(place.as_ref())?;
            let was = there.as_ref().and_then(Manifest::of);
            self.manifest = own.clone();
            if let Some((was, there)) = was.as_ref().zip(there.as_ref()) {
                self.stay(was, there)?;
            }
            let text = serde_json::to_string_pretty(&self.manifest)? + "\n";
            gated(|| {
                drop(self.made.remove(Manifest::NAME));
                self.made.write(Manifest::NAME, text.as_bytes())
            })?;
            self.made.sync()?;
            let kept = match &there {
                Some(there) => Some(self.put(place.as_ref(), there, was.as_ref())?),
                None => self.put_first(place.as_ref())?.then(Vec::new),
            };
            if let Some(kept) = kept {
                // with the names under which the rows were written
                self.taken.into_iter().for_each(|(rows, _)| drop(rows));
                return Ok(Committed { kept });
            }
        }
    }

    /// The folder that the answer's folder lies in, and its name there; None of one that is fixed. It is held: no
    /// answer takes the place of the folder above while this one takes its own.
    fn place(&self) -> Result<Option<Place>> {
        let Some(name) = self.target.file_name().filter(|_| !self.is_fixed) else { return Ok(None) };
        let above = Folder::held(parent(&self.target), Hold::Together)?;
        if self.stage.is_in(&above) {
            return Ok(Some(Place { above, name: name.into() }));
        }
        let why = format!("{} was taken away while it was written", self.stage.folder().path().display());
        Err(Error::new(ErrorKind::NotFound, why))
    }

    /// The answer's folder, held against others that put an answer there; None where it is not there.
    fn held(&self, place: Option<&Place>) -> Result<Option<Folder>> {
        let Some(Place { above, name }) = place else { return Folder::held(&self.target, Hold::Alone).map(Some) };
        loop {
            let there = match above.found(name)? {
                None => return Ok(None),
                Some(f) if f.kind == Kind::Folder => above.folder(name),
                Some(_) => {
                    let why = format!("{} is in the way; move it, or give another --out", self.target.display());
                    return Err(Error::new(ErrorKind::AlreadyExists, why));
                }
            };
            let there = match there {
                // it has just changed places
                Err(e) if e.kind() == ErrorKind::NotFound => continue,
                there => there?,
            };
            there.hold()?;
            if there.is_named(above, name) {
                return Ok(Some(there));
            }
        }
    }

    /// Takes in what stays of the answer before: the files of other commands, and of one that is amended all but those that
    /// are written anew.
    fn stay(&mut self, was: &Manifest, there: &Folder) -> Result<()> {
        for (name, entry) in &was.files {
            let stays = self.amends || entry.command != self.manifest.command;
            if stays && !self.manifest.files.contains_key(name) && was.find(there, name)? {
                gated(|| linked_or_copied(there, &self.made, name))?;
                self.manifest.files.insert(name.clone(), entry.clone());
            }
        }
        Ok(())
    }

    /// Lists the files below `folder` in the manifest and puts them on disk.
    fn enlist(&mut self, folder: &str) -> Result<()> {
        let below = if folder.is_empty() { None } else { Some(self.made.folder(folder)?) };
        let names = below.as_ref().unwrap_or(&self.made).names()?;
        for file in names {
            let name = name_within(folder, &file);
            let found = self.made.found(&name)?.map(|f| f.kind);
            if found == Some(Kind::Folder) {
                self.enlist(&name)?;
                continue;
            }
            let file = self.made.read(&name)?;
            // elsewhere a file has to be open for writing
            if cfg!(unix) {
                gated(|| file.sync_all())?;
            }
            self.manifest.files.insert(name, Entry::hashed(file, &self.manifest.command)?);
        }
        below.as_ref().unwrap_or(&self.made).sync()
    }

    /// Gives the finished answer its name, which no folder has yet; false where one has it since.
    fn put_first(&self, place: Option<&Place>) -> Result<bool> {
        let Some(Place { above, name }) = place else { return Err(ErrorKind::NotFound.into()) };
        match gated(|| self.stage.folder().rename(NEW, above, name)) {
            Err(e) if matches!(e.kind(), ErrorKind::AlreadyExists | ErrorKind::DirectoryNotEmpty) => Ok(false),
            renamed => {
                renamed?;
                above.sync()?;
                Ok(true)
            }
        }
    }

    /// Puts the finished answer in the place of the folder that is there; the files that were in the way.
    fn put(&self, place: Option<&Place>, there: &Folder, was: Option<&Manifest>) -> Result<Vec<Kept>> {
        let is = &self.manifest;
        if let Some(Place { above, name }) = place {
            let taken: Vec<OsString> = self.taken.iter().map(|(rows, _)| rows.name().into()).collect();
            let taken: Vec<&OsStr> = taken.iter().map(OsString::as_os_str).collect();
            let carried = gated(|| carry(there, &self.made, was, is, &taken))?;
            // a folder whose owner, group or access list the new one cannot have stays where it is
            if let Some(kept) = carried.filter(|_| self.made.permit_as(there).is_ok()) {
                // who waits for the folder waits on until what came there late has been moved
                self.made.hold()?;
                match gated(|| self.stage.folder().exchange(NEW, above, name)) {
                    Err(e) if is_refused(&e) => {}
                    exchanged => {
                        exchanged?;
                        drop(gated(|| {
                            settle(there, &self.made, is, &taken);
                            Ok(())
                        }));
                        above.sync()?;
                        return Ok(kept);
                    }
                }
            }
        }
        in_place::replace(self.stage.folder(), NEW, there, is)
    }
}

fn linked_or_copied(from: &Folder, to: &Folder, name: &str) -> Result<()> {
    match from.link(name, to, name) {
        Err(e) if is_refused(&e) => std::io::copy(&mut from.read(name)?, &mut to.create(name)?).map(drop),
        done => done,
    }
}
