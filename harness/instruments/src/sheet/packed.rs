//! Zip files are checked before a reader takes them whole: what they claim to hold, and what they do hold.

use crate::Fault;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use zip::ZipArchive;

/// Bytes that the unpacked file may have; and those a byte of the file, from `SMALL` unpacked bytes on: sheets are packed to a
/// tenth, what is packed to less than a hundredth was made to fill memory.
const UNPACKED: u64 = 2 << 30;
const RATIO: u64 = 100;
const SMALL: u64 = 32 << 20;

/// The archive at `path`, whose parts can all be unpacked and stay within the limit.
pub(super) fn archive(path: &Path) -> Result<ZipArchive<BufReader<File>>, Fault> {
    let damaged = |e: &dyn std::fmt::Display| Fault::new(path, e, "copy or write the file whole");
    let file = input::open(path).map_err(|e| Fault::unreadable(path, e))?;
    let packed = file.metadata().map_or(0, |m| m.len());
    let mut archive = ZipArchive::new(BufReader::new(file)).map_err(|e| damaged(&e))?;
    let mut left = UNPACKED.min(packed.saturating_mul(RATIO).max(SMALL));
    for index in 0..archive.len() {
        let at = |e: &dyn std::fmt::Display| damaged(e).at(format!("part {index} of the archive"));
        let part = archive.by_index(index).map_err(|e| at(&e))?;
        let name = part.name().map_err(|e| at(&e))?.into_owned();
        if part.size() > left {
            return Err(too_large(path).at(format!("part \"{name}\"")));
        }
        let mut part = part.take(left + 1);
        let held =
            std::io::copy(&mut part, &mut std::io::sink()).map_err(|e| damaged(&e).at(format!("part \"{name}\"")))?;
        left = left.checked_sub(held).ok_or_else(|| too_large(path).at(format!("part \"{name}\"")))?;
    }
    Ok(archive)
}

fn too_large(path: &Path) -> Fault {
    let what = format!("unpacked, the file has more than 2 GiB, or more than {RATIO} times its size");
    Fault::new(path, what, "split it, or export its sheets as text (CSV)")
}
