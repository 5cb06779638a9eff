//! Unpacks archives that come from elsewhere, FMUs and SSP archives alike, each into a folder of its own.

use output::Scratch;
use std::io::Read;
use std::path::{Component, Path, PathBuf};
use zip::read::ZipFile;

/// FMI 2.0's name of this platform's folder of binaries (section 2.3); FMI 2.0 has none for ARM, where exporters
/// use the 64-bit folder of the system.
pub(super) const PLATFORM: &str = if cfg!(target_os = "windows") {
    "win64"
} else if cfg!(target_os = "macos") {
    "darwin64"
} else {
    "linux64"
};

/// What an archive may be.
struct Policy {
    /// Most bytes unpacked.
    bytes: u64,
    /// Most bytes unpacked a byte of the archive, from `small` bytes on.
    ratio: u64,
    small: u64,
    /// Most entries.
    entries: usize,
    /// Most folders inside each other.
    depth: usize,
}

const POLICY: Policy = Policy { bytes: 4 << 30, ratio: 1000, small: 64 << 20, entries: 100_000, depth: 50 };

/// What kind of archive is unpacked.
pub(super) struct Sort {
    /// What to call it.
    pub(super) name: &'static str,
    /// The file that it has at its top.
    pub(super) needs: &'static str,
    /// What its temporary folder's name holds.
    pub(super) folder: &'static str,
}

/// An FMU.
pub(super) const FMU: Sort = Sort { name: "FMU", needs: "modelDescription.xml", folder: "fmu" };
/// An SSP archive.
pub(super) const SSP: Sort = Sort { name: "SSP archive", needs: "SystemStructure.ssd", folder: "ssp" };

/// Unpacks `path`; the folder goes when the value is dropped.
///
/// # Errors
/// Says what is wrong with the file and what to give instead: no zip archive; not of its sort; entries that lead out of
/// it, are links, too many, too deep or too large. Nothing of it stays.
pub(super) fn unpack(path: &Path, sort: &Sort) -> Result<Scratch, String> {
    unpack_by(path, sort, &POLICY)
}

fn unpack_by(path: &Path, sort: &Sort, policy: &Policy) -> Result<Scratch, String> {
    let Sort { name, needs, folder } = sort;
    let give = format!("give the path of an {name}");
    let file = input::open(path).map_err(|e| format!("cannot be read ({e}); {}", input::cure(&e).unwrap_or(&give)))?;
    let packed = file.metadata().map_or(0, |m| m.len());
    let mut zip = zip::ZipArchive::new(std::io::BufReader::new(file))
        .map_err(|e| format!("not a zip archive ({e}), so not an {name}; export it again"))?;
    if zip.index_for_name(needs).is_none() {
        return Err(format!("no {needs} at the top of the archive, so not an {name}; export it again"));
    }
    if zip.len() > policy.entries {
        return Err(format!(
            "{} entries, more than {}; export it without what it does not need",
            zip.len(),
            policy.entries
        ));
    }
    let folder = Scratch::new(folder).map_err(|e| e.to_string())?;
    let most = policy.bytes.min(packed.saturating_mul(policy.ratio).max(policy.small));
    let mut left = most;
    for i in 0..zip.len() {
        let mut entry = zip.by_index(i).map_err(|e| format!("cannot be unpacked ({e}); export it again"))?;
        let name =
            entry.name().map_err(|e| format!("an entry's name cannot be read ({e}); export it again"))?.into_owned();
        let written = one(&mut entry, &name.replace('\\', "/"), folder.path(), left, policy.depth)
            .map_err(|why| format!("{:?} in it {why}", name.chars().take(200).collect::<String>()))?;
        let Some(rest) = left.checked_sub(written) else {
            return Err(format!(
                "more than {} MiB unpacked from {packed} bytes; export it without what it does not need",
                most >> 20
            ));
        };
        left = rest;
    }
    Ok(folder)
}

/// The bytes of one entry of an archive, at most those of the longest text.
///
/// # Errors
/// No archive, no such entry, or a longer one.
pub(super) fn entry(path: &Path, name: &str) -> Result<Vec<u8>, String> {
    let file = input::open(path).map_err(|e| format!("cannot be read ({e})"))?;
    let mut zip =
        zip::ZipArchive::new(std::io::BufReader::new(file)).map_err(|e| format!("not a zip archive ({e})"))?;
    let entry = zip.by_name(name).map_err(|e| format!("{name:?} in it cannot be read ({e})"))?;
    let mut bytes = Vec::new();
    let longest = crate::xml::LONGEST;
    entry.take(longest + 1).read_to_end(&mut bytes).map_err(|e| format!("{name:?} in it cannot be read ({e})"))?;
    if bytes.len() as u64 > longest {
        return Err(format!("{name:?} in it is longer than {} MiB", longest >> 20));
    }
    Ok(bytes)
}

/// Unpacks one entry, at most one byte more than `left`. Bytes written.
fn one<R: Read>(entry: &mut ZipFile<'_, R>, name: &str, folder: &Path, left: u64, depth: usize) -> Result<u64, String> {
    const AGAIN: &str = "export it again, with plain files alone";
    if entry.is_symlink() {
        return Err(format!("is a link; {AGAIN}"));
    }
    let Ok(path) = inside(folder, name) else { return Err(format!("leads out of the archive; {AGAIN}")) };
    if path.components().count() - folder.components().count() > depth {
        return Err(format!("lies more than {depth} folders deep; {AGAIN}"));
    }
    let cannot = |e: std::io::Error| {
        format!("cannot be unpacked ({e}); {}", input::cure(&e).unwrap_or("export it again, or make room"))
    };
    if name.ends_with('/') {
        std::fs::create_dir_all(&path).map_err(cannot)?;
        return Ok(0);
    }
    if let Some(parent) = path.parent() {
        std::fs::create_dir_all(parent).map_err(cannot)?;
    }
    let mode = entry.unix_mode();
    let mut file = std::fs::File::create(&path).map_err(cannot)?;
    let written = std::io::copy(&mut entry.take(left.saturating_add(1)), &mut file).map_err(cannot)?;
    #[cfg(unix)]
    if mode.is_some_and(|m| m & 0o100 != 0) {
        use std::os::unix::fs::PermissionsExt;
        file.set_permissions(std::fs::Permissions::from_mode(0o755)).map_err(cannot)?;
    }
    Ok(written)
}

/// The path of a file inside a folder that a text from elsewhere names.
///
/// # Errors
/// An absolute path, a climbing one, another place's; says what to write instead.
pub(super) fn inside(folder: &Path, text: &str) -> Result<PathBuf, String> {
    let path = Path::new(text);
    let plain = path.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir));
    if text.is_empty() || !plain || text.contains([':', '\\', '\0']) {
        return Err(format!("{text:?} is no path inside the archive; name a file in it, without .. and drive"));
    }
    Ok(folder.join(path))
}

/// Whether a modelIdentifier is a plain name of a file.
///
/// # Errors
/// Says what FMI 2.0 wants.
pub(super) fn identifier(name: &str) -> Result<(), String> {
    let good = |c: char| c.is_alphanumeric() || "_-+. ()".contains(c);
    if !name.is_empty() && name.len() < 200 && !name.starts_with('.') && name.chars().all(good) {
        return Ok(());
    }
    let shown: String = name.chars().take(200).collect();
    Err(format!(
        "modelIdentifier {shown:?} is no name of a file; FMI 2.0 wants a C identifier, export it again with one"
    ))
}

/// The binary of `model` for this platform.
///
/// # Errors
/// A model identifier that is no name; else says which platforms there are.
pub(super) fn binary(dir: &Path, model: &str) -> Result<PathBuf, String> {
    identifier(model)?;
    let binaries = dir.join("binaries");
    let file = binaries.join(PLATFORM).join(format!("{model}{}", std::env::consts::DLL_SUFFIX));
    if file.is_file() {
        return Ok(file);
    }
    let mut have: Vec<String> = std::fs::read_dir(&binaries)
        .into_iter()
        .flatten()
        .flatten()
        .filter(|e| e.path().is_dir())
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .collect();
    have.sort();
    let name = file.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
    Err(if have.iter().any(|p| p == PLATFORM) {
        format!("binaries/{PLATFORM} holds no {name}, which its modelIdentifier asks for; export it again")
    } else if have.is_empty() {
        format!("no binaries at all, {PLATFORM} is needed here; compile its sources or export it with binaries")
    } else {
        format!("no binaries/{PLATFORM}, only {}; export it for this platform", have.join(", "))
    })
}

/// A file URI of an absolute path, as fmi2Instantiate takes it.
pub(super) fn uri(path: &Path) -> String {
    let mut s = String::from("file://");
    let text = path.to_string_lossy().replace('\\', "/");
    if !text.starts_with('/') {
        s.push('/');
    }
    for b in text.bytes() {
        if b.is_ascii_alphanumeric() || b"/-._~:".contains(&b) {
            s.push(char::from(b));
        } else {
            s += &format!("%{b:02X}");
        }
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use tempfile::TempDir;
    use zip::write::SimpleFileOptions;

    #[test]
    fn a_path_becomes_a_uri() {
        assert_eq!(uri(Path::new("/tmp/a b/ü")), "file:///tmp/a%20b/%C3%BC");
        assert_eq!(uri(Path::new("C:\\x")), "file:///C:/x");
    }

    const SMALL: Policy = Policy { bytes: 1 << 20, ratio: 10, small: 1 << 16, entries: 20, depth: 3 };

    /// What becomes of an archive with these entries beside the one it needs.
    fn unpacked(fill: impl FnOnce(&mut zip::ZipWriter<std::fs::File>)) -> Result<Scratch, String> {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("x.fmu");
        let mut zip = zip::ZipWriter::new(std::fs::File::create(&path).unwrap());
        zip.start_file(FMU.needs, SimpleFileOptions::default()).unwrap();
        fill(&mut zip);
        zip.finish().unwrap();
        unpack_by(&path, &FMU, &SMALL)
    }

    fn file(name: &str, bytes: usize) -> Result<Scratch, String> {
        unpacked(|zip| {
            zip.start_file(name, SimpleFileOptions::default()).unwrap();
            zip.write_all(&vec![b'x'; bytes]).unwrap();
        })
    }

    #[test]
    fn what_is_plain_is_unpacked() {
        let folder = file("resources/a/b.txt", 1000).unwrap();
        assert_eq!(std::fs::read(folder.path().join("resources/a/b.txt")).unwrap().len(), 1000);
    }

    #[test]
    fn entries_that_lead_out_are_refused() {
        for name in ["../x", "/x", "a/../../x", "..\\x", "C:\\x", "C:/x"] {
            let e = file(name, 1).unwrap_err();
            assert!(e.contains("leads out of the archive; export it again"), "{name}: {e}");
        }
    }

    #[test]
    fn links_are_refused() {
        let e =
            unpacked(|zip| zip.add_symlink("resources", "/etc", SimpleFileOptions::default()).unwrap()).unwrap_err();
        assert!(e.contains("\"resources\" in it is a link"), "{e}");
    }

    #[test]
    fn what_is_too_much_is_refused() {
        let e = file("bomb", 100_000).unwrap_err();
        assert!(e.contains("MiB unpacked from") && e.contains("export it without"), "{e}");
        let e = file("a/b/c/d/e", 1).unwrap_err();
        assert!(e.contains("more than 3 folders deep"), "{e}");
        let e = unpacked(|zip| {
            for n in 0..30 {
                zip.start_file(n.to_string(), SimpleFileOptions::default()).unwrap();
            }
        });
        assert!(e.unwrap_err().contains("31 entries, more than 20"));
    }

    #[test]
    fn a_model_identifier_is_a_plain_name() {
        for good in ["spring", "A_b-1.0", "Motor (2)"] {
            assert!(identifier(good).is_ok(), "{good}");
        }
        for bad in ["", "../../x", "a/b", "a\\b", "..", ".x", "a\0b", "C:x", &"x".repeat(300)] {
            assert!(identifier(bad).unwrap_err().contains("C identifier"), "{bad}");
        }
    }

    #[test]
    fn a_source_lies_inside() {
        let folder = Path::new("/f");
        assert_eq!(inside(folder, "resources/a.fmu").unwrap(), Path::new("/f/resources/a.fmu"));
        for bad in ["", "/etc/passwd", "../x", "a/../../x", "file:///x", "a\\b"] {
            assert!(inside(folder, bad).unwrap_err().contains("no path inside the archive"), "{bad}");
        }
    }
}
