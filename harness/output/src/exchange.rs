//! What the operating system does in one step.

use std::io::{Error, ErrorKind};
use std::path::Path;

/// Whether an error says that a step is not to be had here, rather than that it failed: another file system, no such step,
/// no permission, in use as a mount point.
pub fn is_refused(e: &Error) -> bool {
    use ErrorKind::{CrossesDevices, InvalidInput, PermissionDenied, ResourceBusy, TooManyLinks, Unsupported};
    matches!(e.kind(), CrossesDevices | InvalidInput | PermissionDenied | ResourceBusy | TooManyLinks | Unsupported)
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
        // a folder mounted a second time has the device of the one above it
        device(folder) != device(above) || crate::folder::is_mounted(folder, above)
    }
    #[cfg(not(unix))]
    {
        let _ = above;
        false
    }
}
