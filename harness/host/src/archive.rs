//! Unpacks an FMU into a folder of its own.

use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// FMI 2.0's name of this platform's folder of binaries (section 2.3); FMI 2.0 has none for ARM, where exporters
/// use the 64-bit folder of the system.
pub(super) const PLATFORM: &str = if cfg!(target_os = "windows") {
    "win64"
} else if cfg!(target_os = "macos") {
    "darwin64"
} else {
    "linux64"
};

/// Unpacks `path`; the folder goes when the value is dropped.
///
/// # Errors
/// Says what is wrong with the file and what to give instead.
pub(super) fn unpack(path: &Path) -> Result<TempDir, String> {
    let file = input::open(path).map_err(|e| format!("cannot be read ({e}); give the path of an FMU"))?;
    let mut zip = zip::ZipArchive::new(std::io::BufReader::new(file))
        .map_err(|e| format!("not a zip archive ({e}), so not an FMU; export it again"))?;
    if zip.index_for_name("modelDescription.xml").is_none() {
        return Err("no modelDescription.xml at the top of the archive, so not an FMU; export it again".into());
    }
    let dir = tempfile::Builder::new()
        .prefix("touchdown-fmu-")
        .tempdir()
        .map_err(|e| format!("no temporary folder to unpack into ({e})"))?;
    zip.extract(dir.path()).map_err(|e| format!("cannot be unpacked ({e})"))?;
    Ok(dir)
}

/// The binary of `model` for this platform.
///
/// # Errors
/// Says which platforms there are.
pub(super) fn binary(dir: &Path, model: &str) -> Result<PathBuf, String> {
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

    #[test]
    fn a_path_becomes_a_uri() {
        assert_eq!(uri(Path::new("/tmp/a b/ü")), "file:///tmp/a%20b/%C3%BC");
        assert_eq!(uri(Path::new("C:\\x")), "file:///C:/x");
    }
}
