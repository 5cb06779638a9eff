//! The list of an answer's files, by which a later command knows them again.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Result};
use std::path::Path;

/// The format this version writes.
const FORMAT: &str = "manifest/1";

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

    /// That of the answer in `folder`; None where there is none of ours.
    pub fn read(folder: &Path) -> Option<Manifest> {
        let text = std::fs::read_to_string(folder.join(Manifest::NAME)).ok()?;
        serde_json::from_str(&text).ok().filter(|m: &Manifest| m.format == FORMAT)
    }

    /// Whether the file `name` below `folder` is as it was written.
    pub fn holds(&self, folder: &Path, name: &str) -> bool {
        let path = folder.join(name);
        let Some(entry) = self.files.get(name) else { return false };
        let Ok(m) = std::fs::symlink_metadata(&path) else { return false };
        m.is_file() && m.len() == entry.size && Entry::of(&path, &entry.command).is_ok_and(|e| e == *entry)
    }

    /// Whether every file of its command is in `folder` as it was written.
    pub fn is_whole(&self, folder: &Path) -> bool {
        self.files.iter().filter(|(_, e)| e.command == self.command).all(|(name, _)| self.holds(folder, name))
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
    /// As the file system gives them.
    pub fn of(path: &Path, command: &str) -> Result<Entry> {
        let (mut file, mut hash, mut size) = (File::open(path)?, Sha256::new(), 0);
        let mut block = vec![0; 1 << 16];
        loop {
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
