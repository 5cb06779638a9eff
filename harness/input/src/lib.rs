//! Files opened to be read: regular ones alone, and no larger than what reads them can take.
//!
//! Invariant: every file that a user names is opened here. A pipe, a device or a socket in the place of a file would
//! keep the reader waiting or never end.

use std::fs::{File, FileType, Metadata, OpenOptions};
use std::io::{Error, ErrorKind, Read, Result};
use std::path::Path;

/// Bytes of a text of tables and keys, such as campaign.toml, at most.
pub const TEXT: u64 = 16 << 20;
/// Bytes of a recording in CSV at most.
pub const RECORDING: u64 = 2 << 30;
/// Bytes of a shared library at most.
pub const LIBRARY: u64 = 1 << 30;

/// Opens a regular file, or what a link to one leads to.
///
/// # Errors
/// As the file system gives them; where it is a folder, a pipe, a device or a socket: what it is, and the cure.
pub fn open(path: &Path) -> Result<File> {
    // looked at before it is opened, for opening a pipe waits for who writes to it
    regular(&std::fs::metadata(path)?)?;
    let mut options = OpenOptions::new();
    options.read(true);
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        // what has become a pipe since then does not wait either
        options.custom_flags(libc::O_NONBLOCK);
    }
    let file = options.open(path)?;
    regular(&file.metadata()?)?;
    Ok(file)
}

/// Opens a regular file of at most `most` bytes.
///
/// # Errors
/// As [`open`]; a larger file.
pub fn open_at_most(path: &Path, most: u64) -> Result<File> {
    let file = open(path)?;
    let length = file.metadata()?.len();
    if length > most {
        return Err(too_large(length, most));
    }
    Ok(file)
}

/// The bytes of a regular file of at most `most`.
///
/// # Errors
/// As [`open_at_most`].
pub fn bytes(path: &Path, most: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    // the file may have grown since its length was taken
    let read = open_at_most(path, most)?.take(most + 1).read_to_end(&mut bytes)? as u64;
    if read > most {
        return Err(too_large(read, most));
    }
    Ok(bytes)
}

/// The text of a regular file of at most `most` bytes.
///
/// # Errors
/// As [`bytes`]; bytes that are no UTF-8.
pub fn text(path: &Path, most: u64) -> Result<String> {
    String::from_utf8(bytes(path, most)?)
        .map_err(|_| Error::new(ErrorKind::InvalidData, "it is no text in UTF-8; save it as UTF-8"))
}

/// The names of a header above rows of `width` cells. A name such as `F[1,2]` that was written without the quotes which
/// its comma needs (RFC 4180), and was therefore read as two, is one again where that gives `width` names.
pub fn whole_names(cells: Vec<String>, width: usize) -> Vec<String> {
    if cells.len() <= width {
        return cells;
    }
    let mut names: Vec<String> = Vec::new();
    // brackets that are open in the last name; below 0 where more were closed
    let mut open = 0i64;
    for cell in &cells {
        match names.last_mut().filter(|_| open > 0) {
            Some(name) => *name += &format!(",{cell}"),
            None => {
                open = 0;
                names.push(cell.clone());
            }
        }
        open += cell.matches('[').count() as i64 - cell.matches(']').count() as i64;
    }
    if names.len() == width {
        names
    } else {
        cells
    }
}

fn regular(of: &Metadata) -> Result<()> {
    if of.is_file() {
        return Ok(());
    }
    let (what, cure) = match of.is_dir() {
        true => ("a folder", "name the files in it"),
        false => (special(of.file_type()), "write what it holds into a file"),
    };
    Err(Error::new(ErrorKind::InvalidInput, format!("it is {what}, not a file; {cure}")))
}

#[cfg(unix)]
fn special(of: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    if of.is_fifo() {
        "a pipe"
    } else if of.is_socket() {
        "a socket"
    } else {
        "a device"
    }
}

#[cfg(not(unix))]
fn special(_: FileType) -> &'static str {
    "a device"
}

/// Whether an error says that too many files are open.
pub fn is_out_of_files(e: &Error) -> bool {
    // EMFILE and ENFILE have no name in the standard library
    cfg!(unix) && matches!(e.raw_os_error(), Some(23 | 24))
}

/// Whether links of a path lead to each other.
fn is_loop(e: &Error) -> bool {
    // ELOOP has no stable name in the standard library
    cfg!(target_os = "linux") && e.raw_os_error() == Some(40)
}

/// What is to be done about an error of the system that has nothing to do with the file: room, memory, limits.
pub fn cure(e: &Error) -> Option<&'static str> {
    match e.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => Some("make room there"),
        ErrorKind::FileTooLarge => Some("the limit for the size of a file is too small; raise it, as with ulimit -f"),
        ErrorKind::ReadOnlyFilesystem => Some("it is on a file system that is only read; take another place"),
        ErrorKind::OutOfMemory => Some("close other programs, or raise the limit of memory, as with ulimit -v"),
        ErrorKind::InvalidFilename => Some("the name is too long for the file system; give a shorter one"),
        _ if e.get_ref().is_some_and(|e| e.is::<TooLarge>()) => Some("part it into smaller ones"),
        _ if is_loop(e) => Some("links in it lead to each other; give the place that they were to lead to"),
        _ if is_out_of_files(e) => Some("too many files are open for the limit; raise it, as with ulimit -n"),
        _ => None,
    }
}

/// A file has more bytes than are read of one.
#[derive(Debug)]
struct TooLarge {
    length: u64,
    most: u64,
}

impl std::fmt::Display for TooLarge {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "it has {} bytes, more than the {} that are read", self.length, self.most)
    }
}

impl std::error::Error for TooLarge {}

fn too_large(length: u64, most: u64) -> Error {
    Error::new(ErrorKind::InvalidData, TooLarge { length, most })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_its_limit_and_a_folder_is_none() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a");
        std::fs::write(&path, "text").unwrap();
        assert_eq!(text(&path, 4).unwrap(), "text");
        assert_eq!(text(&path, 3).err().as_ref().and_then(cure), Some("part it into smaller ones"));
        let e = text(&path, 3).unwrap_err().to_string();
        assert!(e.contains("4 bytes, more than the 3"), "{e}");
        std::fs::write(&path, [0xff, 0xfe]).unwrap();
        assert!(text(&path, 4).unwrap_err().to_string().contains("UTF-8"));
        assert!(bytes(dir.path(), 4).unwrap_err().to_string().contains("a folder, not a file"));
        assert_eq!(open(&dir.path().join("none")).unwrap_err().kind(), ErrorKind::NotFound);
    }

    #[test]
    fn a_name_parted_at_its_comma_is_one_again_where_the_rows_say_so() {
        let names = |head: &str, width| whole_names(head.split(';').map(String::from).collect(), width);
        assert_eq!(names("t;F[1;2];G[1;2;3] [N];x", 4), ["t", "F[1,2]", "G[1,2,3] [N]", "x"]);
        for (head, width) in [("t;F[1;2]", 3), ("t;a;b", 2), ("t;F[1;2];x", 2), ("F[1;2", 2)] {
            assert_eq!(names(head, width).join(";"), head);
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_pipe_a_socket_a_device_and_links_to_them_are_refused_at_once() {
        use std::os::unix::ffi::OsStrExt;
        use std::os::unix::fs::symlink;
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        let name = std::ffi::CString::new(at("pipe").as_os_str().as_bytes()).unwrap();
        // SAFETY: the path is a string that ends with 0 and outlives the call
        assert_eq!(unsafe { libc::mkfifo(name.as_ptr(), 0o600) }, 0);
        let _socket = std::os::unix::net::UnixListener::bind(at("socket")).unwrap();
        symlink("/dev/zero", at("zero")).unwrap();
        symlink(at("pipe"), at("link")).unwrap();
        for (file, what) in [("pipe", "a pipe"), ("link", "a pipe"), ("socket", "a socket"), ("zero", "a device")] {
            let e = text(&at(file), TEXT).unwrap_err().to_string();
            assert!(e.contains(&format!("it is {what}, not a file; write")), "{file}: {e}");
        }
        std::fs::write(at("file"), "1").unwrap();
        symlink(at("file"), at("good")).unwrap();
        assert_eq!(text(&at("good"), TEXT).unwrap(), "1");
    }
}
