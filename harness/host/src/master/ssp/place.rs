//! Files that an archive names, by URI references (RFC 3986).

use super::node::Node;
use crate::archive;
use anyhow::{anyhow, Result};
use std::path::{Path, PathBuf};

/// Where the names of a file are resolved: the archive's folder, and the file's own folder in it.
#[derive(Clone)]
pub(super) struct Base {
    pub root: PathBuf,
    pub folder: String,
}

/// A reference with its %XX decoded; what is no such escape stays.
fn decoded(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut i = 0;
    while i < bytes.len() {
        let hex = (bytes[i] == b'%').then(|| text.get(i + 1..i + 3)).flatten();
        let byte =
            hex.filter(|h| h.bytes().all(|b| b.is_ascii_hexdigit())).and_then(|h| u8::from_str_radix(h, 16).ok());
        out.push(byte.unwrap_or(bytes[i]));
        i += if byte.is_some() { 3 } else { 1 };
    }
    String::from_utf8(out).unwrap_or_else(|_| text.to_string())
}

/// A path without . and .. in it; as it is where it climbs out, which is refused later.
fn plain(path: &str) -> String {
    let mut parts: Vec<&str> = Vec::new();
    for part in path.split('/') {
        match part {
            "." => {}
            ".." if parts.pop().is_none() => return path.to_string(),
            ".." => {}
            part => parts.push(part),
        }
    }
    parts.join("/")
}

impl Base {
    /// The base of the top of an archive.
    pub fn top(root: &Path) -> Base {
        Base { root: root.to_path_buf(), folder: String::new() }
    }

    /// Name in the archive of what `source` refers to: as written where there is such a file, else with its escapes decoded.
    fn named(&self, source: &str) -> String {
        let name = |s: &str| {
            // a base never helps what names a place of its own
            let own = s.starts_with('/') || s.contains(':');
            plain(&if own || self.folder.is_empty() { s.to_string() } else { format!("{}/{s}", self.folder) })
        };
        let written = name(source);
        let there = archive::inside(&self.root, &written).is_ok_and(|p| p.exists());
        if there {
            written
        } else {
            name(&decoded(source))
        }
    }

    /// Name in the archive and path of what `source`, an attribute of `at`, refers to.
    ///
    /// # Errors
    /// What is outside the archive.
    pub fn path(&self, source: &str, at: &Node) -> Result<(String, PathBuf)> {
        let name = self.named(source);
        let path = archive::inside(&self.root, &name).map_err(|why| anyhow!("{}: {why}", at.place()))?;
        Ok((name, path))
    }

    /// The base of the file that is called `name` in the archive.
    pub fn of(&self, name: &str) -> Base {
        let folder = name.rsplit_once('/').map_or("", |f| f.0);
        Base { root: self.root.clone(), folder: folder.to_string() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_are_decoded_and_stay_inside() {
        assert_eq!(decoded("resources/My%20Contact%2efmu"), "resources/My Contact.fmu");
        assert_eq!(decoded("100%.fmu"), "100%.fmu");
        assert_eq!(decoded("a%zz%"), "a%zz%");
        let base = Base { root: "/f".into(), folder: "systems".into() };
        assert_eq!(base.named("./../resources/a.fmu"), "resources/a.fmu");
        let at = Node::default();
        assert_eq!(base.path("a%20b.fmu", &at).unwrap().1, Path::new("/f/systems/a b.fmu"));
        for bad in ["../../x", "%2e%2e/../x", "/etc/passwd", "file:///etc/passwd", "http://x/y.fmu", "a\\b"] {
            assert!(base.path(bad, &at).unwrap_err().to_string().contains("no path inside the archive"), "{bad}");
        }
    }

    #[test]
    fn a_file_whose_name_holds_an_escape_is_found_as_written() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a%20b.fmu"), "").unwrap();
        assert_eq!(Base::top(folder.path()).named("a%20b.fmu"), "a%20b.fmu");
    }
}
