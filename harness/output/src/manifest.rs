//! The list of an answer's files, by which a later command knows them again.

use crate::folder::{is_plain, Folder, Kind};
use crate::stage::is_ending;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io::{Error, Read, Result};
use std::path::Path;

/// The format this version writes.
const FORMAT: &str = "manifest/1";
/// Bytes of a manifest at most.
const MOST: u64 = 64 << 20;
/// Bytes of all files of a list at most: more is not hashed.
const WHOLE: u64 = 64 << 30;

/// A file as it was written.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Entry {
    /// Bytes.
    pub size: u64,
    /// SHA-256 of the contents (FIPS 180-4), hexadecimal.
    pub sha256: String,
    /// The command that wrote it.
    pub command: String,
}

/// manifest.json: what was written into a folder by which command.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Manifest {
    pub format: String,
    /// Version of touchdown.
    pub touchdown: String,
    /// The command that wrote last; files of others lie beside its own.
    pub command: String,
    /// SHA-256 of all that the answer depends on, where the command gives it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub input: Option<String>,
    /// Files by their names below the folder, parted by `/`.
    pub files: BTreeMap<String, Entry>,
}

impl Manifest {
    /// Its file's name.
    pub const NAME: &str = "manifest.json";

    /// One of `command` that lists nothing yet.
    pub fn new(command: &str) -> Manifest {
        Manifest {
            format: FORMAT.into(),
            touchdown: env!("CARGO_PKG_VERSION").into(),
            command: command.into(),
            input: None,
            files: BTreeMap::new(),
        }
    }

    /// That of the answer in `folder`; None where there is none of ours: what is no regular file, a list with a name
    /// that leads out of the folder, and one of files of more than 64 GiB, are none.
    pub fn read(folder: &Path) -> Option<Manifest> {
        Manifest::of(&Folder::open(folder).ok()?)
    }

    /// As [`Manifest::read`], of an open folder.
    pub fn of(folder: &Folder) -> Option<Manifest> {
        let bytes = folder.bytes(Manifest::NAME, MOST).ok()?;
        let m: Manifest = serde_json::from_slice(&bytes).ok()?;
        let is_ours = m.format == FORMAT && m.files.keys().all(|n| is_plain(Path::new(n)) && n != Manifest::NAME);
        let whole = m.files.values().fold(0, |sum: u64, e| sum.saturating_add(e.size));
        (is_ours && whole <= WHOLE).then_some(m)
    }

    /// Whether the file `name` below `folder` is as it was written; a link is not.
    pub fn holds(&self, folder: &Folder, name: &str) -> bool {
        self.find(folder, name).unwrap_or(false)
    }

    /// As [`Manifest::holds`], for who is about to change files by it.
    ///
    /// # Errors
    /// That the process is about to end: then nobody knows.
    pub(crate) fn find(&self, folder: &Folder, name: &str) -> Result<bool> {
        let Some(entry) = self.files.get(name) else { return Ok(false) };
        let Ok(Some(found)) = folder.found(name) else { return Ok(false) };
        if found.kind != Kind::File || found.length != entry.size {
            return Ok(false);
        }
        match folder.read(name).and_then(|f| Entry::hashed(f.take(entry.size + 1), &entry.command)) {
            Err(e) if is_ending() => Err(e),
            hashed => Ok(hashed.is_ok_and(|e| e == *entry)),
        }
    }

    /// Whether the file `name` below `folder` is as it was written.
    pub fn has(&self, folder: &Path, name: &str) -> bool {
        Folder::open(folder).is_ok_and(|f| self.holds(&f, name))
    }

    /// Whether every file of its command is in `folder` as it was written.
    pub fn is_whole(&self, folder: &Path) -> bool {
        let Ok(folder) = Folder::open(folder) else { return false };
        self.files.iter().filter(|(_, e)| e.command == self.command).all(|(name, _)| self.holds(&folder, name))
    }

    /// Whether `name` is a folder on the way to a file of the list.
    pub fn passes(&self, name: &str) -> bool {
        let way = format!("{name}/");
        self.files.range(way.clone()..).next().is_some_and(|(n, _)| n.starts_with(&way))
    }
}

/// A hash as a manifest has it: two hexadecimal digits a byte.
pub fn hexadecimal(hash: &[u8]) -> String {
    hash.iter().map(|b| format!("{b:02x}")).collect()
}

impl Entry {
    /// The entry of a file that `command` has written.
    ///
    /// # Errors
    /// As the file system gives them; what is no regular file.
    pub fn of(path: &Path, command: &str) -> Result<Entry> {
        Entry::hashed(input::open(path)?, command)
    }

    /// The entry of an open file.
    ///
    /// # Errors
    /// As the file system gives them; that the process is about to end, which waits for no large file.
    pub(crate) fn hashed(mut file: impl Read, command: &str) -> Result<Entry> {
        let (mut hash, mut size) = (Sha256::new(), 0);
        let mut block = vec![0; 1 << 16];
        loop {
            if is_ending() {
                return Err(Error::other("the command was ended meanwhile"));
            }
            let n = file.read(&mut block)?;
            if n == 0 {
                let sha256 = hexadecimal(&hash.finalize());
                return Ok(Entry { size, sha256, command: command.into() });
            }
            hash.update(&block[..n]);
            size += n as u64;
        }
    }
}
