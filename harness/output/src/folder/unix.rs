//! Folders held open, and files by their names in them, as Unix has them.

use super::{Found, Hold, Kind};
use rustix::fs::{
    fchmod, fsync, linkat, mkdirat, openat, renameat, statat, unlinkat, AtFlags, Dir, FileType, FlockOperation, Mode,
    OFlags, CWD,
};
use rustix::io::Errno;
use std::ffi::{OsStr, OsString};
use std::fs::{File, Metadata};
use std::io::Result;
use std::os::fd::OwnedFd;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

pub type Handle = OwnedFd;

const AS_FOLDER: OFlags = OFlags::RDONLY.union(OFlags::DIRECTORY).union(OFlags::CLOEXEC);
/// A pipe is not waited for, a link not followed, and a terminal does not become ours.
const PLAIN: OFlags = OFlags::NOFOLLOW.union(OFlags::NONBLOCK).union(OFlags::NOCTTY).union(OFlags::CLOEXEC);

fn mode(bits: u32) -> Mode {
    Mode::from_bits_truncate(bits as rustix::fs::RawMode)
}

pub fn open(path: &Path) -> Result<Handle> {
    Ok(openat(CWD, path, AS_FOLDER, Mode::empty())?)
}

pub fn open_folder(at: &Handle, name: &OsStr) -> Result<Handle> {
    Ok(openat(at, name, AS_FOLDER | OFlags::NOFOLLOW, Mode::empty())?)
}

pub fn make_folder(at: &Handle, name: &OsStr, is_private: bool) -> Result<()> {
    Ok(mkdirat(at, name, mode(if is_private { 0o700 } else { 0o777 }))?)
}

pub fn read(at: &Handle, name: &OsStr) -> Result<File> {
    Ok(openat(at, name, OFlags::RDONLY | PLAIN, Mode::empty())?.into())
}

pub fn create(at: &Handle, name: &OsStr) -> Result<File> {
    let new = OFlags::RDWR | OFlags::CREATE | OFlags::EXCL;
    Ok(openat(at, name, new | PLAIN, mode(0o666))?.into())
}

pub fn look(at: &Handle, name: &OsStr) -> Result<Found> {
    let s = statat(at, name, AtFlags::SYMLINK_NOFOLLOW)?;
    let kind = match FileType::from_raw_mode(s.st_mode) {
        FileType::RegularFile => Kind::File,
        FileType::Directory => Kind::Folder,
        _ => Kind::Other,
    };
    #[allow(clippy::unnecessary_cast)] // other platforms have other integers
    let (device, number, length) = (s.st_dev as u64, s.st_ino as u64, s.st_size as u64);
    Ok(Found { kind, length, identity: (device, number), is_own: s.st_uid == user() })
}

fn user() -> u32 {
    rustix::process::geteuid().as_raw()
}

pub fn remove(at: &Handle, name: &OsStr) -> Result<()> {
    Ok(unlinkat(at, name, AtFlags::empty())?)
}

pub fn remove_folder(at: &Handle, name: &OsStr) -> Result<()> {
    Ok(unlinkat(at, name, AtFlags::REMOVEDIR)?)
}

/// Lets the user read, write and enter a folder of theirs whose mode forbids it.
pub fn open_up(at: &Handle, name: &OsStr) -> Result<()> {
    #[cfg(target_os = "linux")]
    {
        use std::os::fd::AsRawFd;
        // a handle that needs no right to read; by /proc its mode is changed and no link followed
        let flags = OFlags::PATH | OFlags::DIRECTORY | OFlags::NOFOLLOW | OFlags::CLOEXEC;
        let held = openat(at, name, flags, Mode::empty())?;
        let path = format!("/proc/self/fd/{}", held.as_raw_fd());
        Ok(rustix::fs::chmodat(CWD, path, mode(0o700), AtFlags::empty())?)
    }
    #[cfg(not(target_os = "linux"))]
    Ok(rustix::fs::chmodat(at, name, mode(0o700), AtFlags::SYMLINK_NOFOLLOW)?)
}

pub fn rename(at: &Handle, name: &OsStr, to: &Handle, new: &OsStr) -> Result<()> {
    Ok(renameat(at, name, to, new)?)
}

pub fn link(at: &Handle, name: &OsStr, to: &Handle, new: &OsStr) -> Result<()> {
    Ok(linkat(at, name, to, new, AtFlags::empty())?)
}

#[cfg(any(target_os = "linux", target_os = "macos"))]
pub fn exchange(at: &Handle, name: &OsStr, to: &Handle, other: &OsStr) -> Result<()> {
    Ok(rustix::fs::renameat_with(at, name, to, other, rustix::fs::RenameFlags::EXCHANGE)?)
}

#[cfg(not(any(target_os = "linux", target_os = "macos")))]
pub fn exchange(_: &Handle, _: &OsStr, _: &Handle, _: &OsStr) -> Result<()> {
    Err(std::io::ErrorKind::Unsupported.into())
}

pub fn names(at: &Handle) -> Result<Vec<OsString>> {
    let mut all = Vec::new();
    for entry in Dir::read_from(at)? {
        let entry = entry?;
        let name = entry.file_name().to_bytes();
        if name != b"." && name != b".." {
            all.push(OsStr::from_bytes(name).to_os_string());
        }
    }
    Ok(all)
}

pub fn sync(at: &Handle) -> Result<()> {
    Ok(fsync(at)?)
}

pub fn permit_as(at: &Handle, other: &Handle) -> Result<()> {
    let (is, was) = (rustix::fs::fstat(at)?, rustix::fs::fstat(other)?);
    if has_attributes(other) {
        return Err(std::io::ErrorKind::Unsupported.into());
    }
    let owner = (is.st_uid != was.st_uid).then(|| rustix::fs::Uid::from_raw(was.st_uid));
    let group = (is.st_gid != was.st_gid).then(|| rustix::fs::Gid::from_raw(was.st_gid));
    if owner.is_some() || group.is_some() {
        rustix::fs::fchown(at, owner, group)?;
    }
    // the last: a change of owner takes bits of the mode away
    Ok(fchmod(at, Mode::from_raw_mode(was.st_mode))?)
}

/// Whether a folder has attributes beside owner, group and mode, such as an access control list, that one in its place has not.
#[cfg(target_os = "linux")]
fn has_attributes(at: &Handle) -> bool {
    let mut names = vec![0u8; 1 << 16];
    match rustix::fs::flistxattr(at, &mut names) {
        // labels of the system's security are those that it gives
        Ok(n) => names[..n].split(|b| *b == 0).any(|name| !name.is_empty() && !name.starts_with(b"security.")),
        Err(e) => e != Errno::NOTSUP,
    }
}

#[cfg(not(target_os = "linux"))]
fn has_attributes(_: &Handle) -> bool {
    false
}

pub fn identity(at: &Handle) -> Result<(u64, u64)> {
    let s = rustix::fs::fstat(at)?;
    #[allow(clippy::unnecessary_cast)] // other platforms have other integers
    Ok((s.st_dev as u64, s.st_ino as u64))
}

/// The mount that an open folder is below; None where the system does not say.
#[cfg(target_os = "linux")]
pub fn mount(at: &Handle) -> Option<u64> {
    let all = rustix::fs::StatxFlags::MNT_ID;
    let s = rustix::fs::statx(at, "", AtFlags::EMPTY_PATH, all).ok()?;
    (s.stx_mask & all.bits() != 0).then_some(s.stx_mnt_id)
}

#[cfg(not(target_os = "linux"))]
pub fn mount(_: &Handle) -> Option<u64> {
    None
}

pub fn identity_of(m: &Metadata) -> Result<(u64, u64)> {
    Ok((m.dev(), m.ino()))
}

pub fn is_own(at: &Handle) -> bool {
    rustix::fs::fstat(at).is_ok_and(|s| s.st_uid == user())
}

pub fn is_private(at: &Handle) -> bool {
    rustix::fs::fstat(at).is_ok_and(|s| s.st_mode & 0o777 == 0o700)
}

pub fn try_hold(at: &Handle, how: Hold) -> Result<()> {
    let operation = match how {
        Hold::Alone => FlockOperation::NonBlockingLockExclusive,
        Hold::Together => FlockOperation::NonBlockingLockShared,
    };
    match rustix::fs::flock(at, operation) {
        Err(Errno::INTR) => Err(std::io::ErrorKind::WouldBlock.into()),
        done => Ok(done?),
    }
}
