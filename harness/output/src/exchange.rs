//! What the operating system does in one step.

use std::io::{Error, ErrorKind, Result};
use std::path::Path;

/// Lets the folder `new` take the place of `old`, which is found under the name of `new` afterwards.
///
/// # Errors
/// As the file system gives them; [`is_refused`] where it has no such step.
#[cfg(any(target_os = "linux", target_os = "macos"))]
pub fn exchange(new: &Path, old: &Path) -> Result<()> {
    use rustix::fs::{renameat_with, RenameFlags, CWD};
    Ok(renameat_with(CWD, new, CWD, old, RenameFlags::EXCHANGE)?)
}

/// There is no such step here.
///
/// # Errors
/// Always.
#[cfg(not(any(target_os = "linux", target_os = "macos")))]
pub fn exchange(_new: &Path, _old: &Path) -> Result<()> {
    Err(Error::from(ErrorKind::Unsupported))
}

/// Whether an error says that a step is not to be had here, rather than that it failed: another file system, no such step,
/// no permission, in use as a mount point.
pub fn is_refused(e: &Error) -> bool {
    use ErrorKind::{CrossesDevices, InvalidInput, PermissionDenied, ResourceBusy, TooManyLinks, Unsupported};
    matches!(e.kind(), CrossesDevices | InvalidInput | PermissionDenied | ResourceBusy | TooManyLinks | Unsupported)
}

/// Puts the names in a folder on disk.
///
/// # Errors
/// As the file system gives them; none where folders cannot be put on disk by themselves.
pub fn sync_folder(folder: &Path) -> Result<()> {
    if !cfg!(unix) {
        return Ok(());
    }
    match std::fs::File::open(folder)?.sync_all() {
        Err(e) if is_refused(&e) => Ok(()),
        done => done,
    }
}

/// Whether a folder is one that cannot change places: the root, a mount point, or one that this process works in.
pub fn is_fixed(folder: &Path) -> bool {
    let Some(above) = folder.parent() else { return true };
    if std::env::current_dir().is_ok_and(|d| d.starts_with(folder)) {
        return true;
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        let device = |p: &Path| std::fs::metadata(p).map(|m| m.dev()).ok();
        device(folder) != device(above)
    }
    #[cfg(not(unix))]
    {
        let _ = above;
        false
    }
}
