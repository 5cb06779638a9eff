//! Files written whole or not at all.

use std::io::Write;
use std::path::Path;

/// Writes `bytes` to `path` by way of a temporary file beside it; makes the folders it needs.
///
/// # Errors
/// As the file system gives them.
pub fn write(path: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let dir = match path.parent() {
        Some(d) if !d.as_os_str().is_empty() => d,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(dir)?;
    let mut f = tempfile::NamedTempFile::new_in(dir)?;
    f.write_all(bytes)?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        f.as_file().set_permissions(std::fs::Permissions::from_mode(0o644))?;
    }
    f.persist(path).map_err(|e| e.error)?;
    Ok(())
}

/// Makes the folder `dir` by way of a temporary one beside it that `fill` fills: it appears whole, in the place of
/// what had that name, or nothing changes.
///
/// # Errors
/// As the file system or `fill` give them.
pub fn folder(dir: &Path, fill: impl FnOnce(&Path) -> std::io::Result<()>) -> std::io::Result<()> {
    let parent = match dir.parent() {
        Some(d) if !d.as_os_str().is_empty() => d,
        _ => Path::new("."),
    };
    std::fs::create_dir_all(parent)?;
    let temporary = tempfile::Builder::new().prefix(".touchdown-").tempdir_in(parent)?;
    let new = temporary.path().join("new");
    std::fs::create_dir(&new)?;
    fill(&new)?;
    let old = temporary.path().join("old");
    let had = dir.exists();
    if had {
        std::fs::rename(dir, &old)?;
    }
    if let Err(e) = std::fs::rename(&new, dir) {
        if had {
            std::fs::rename(&old, dir)?;
        }
        return Err(e);
    }
    // what had the name goes with the temporary folder
    Ok(())
}

/// Whether files could be written in `folder`: tries it with a temporary folder in there, or where it is not there yet in the
/// nearest folder above that is.
///
/// # Errors
/// As the file system gives them.
pub fn probe(folder: &Path) -> std::io::Result<()> {
    let whole = std::path::absolute(folder)?;
    let there = whole.ancestors().find(|d| d.exists()).unwrap_or(Path::new("."));
    tempfile::Builder::new().prefix(".touchdown-").tempdir_in(there).map(drop)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_where_nothing_can_be_written_is_told_before_any_work() {
        let t = tempfile::tempdir().unwrap();
        std::fs::write(t.path().join("file"), b"1").unwrap();
        assert!(probe(&t.path().join("a/b/c")).is_ok() && probe(t.path()).is_ok());
        assert!(probe(&t.path().join("file/b")).is_err());
        assert_eq!(std::fs::read_dir(t.path()).unwrap().count(), 1);
    }

    #[test]
    fn a_folder_appears_whole_or_stays_as_it_was() {
        let t = tempfile::tempdir().unwrap();
        let dir = t.path().join("a/b");
        folder(&dir, |d| write(&d.join("x"), b"1")).unwrap();
        assert_eq!(std::fs::read(dir.join("x")).unwrap(), b"1");
        let failed = folder(&dir, |d| {
            write(&d.join("y"), b"2")?;
            Err(std::io::Error::other("no"))
        });
        assert!(failed.is_err() && dir.join("x").exists() && !dir.join("y").exists());
        folder(&dir, |d| write(&d.join("z"), b"3")).unwrap();
        assert!(dir.join("z").exists() && !dir.join("x").exists());
        // nothing temporary stays
        assert_eq!(std::fs::read_dir(t.path().join("a")).unwrap().count(), 1);
    }
}
