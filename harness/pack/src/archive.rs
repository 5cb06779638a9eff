//! Archives that touchdown writes, told from those of others.

use anyhow::{Context, Result};
use output::Kept;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// How the description of every archive of ours says who made it.
const MADE_BY: &str = "generationTool=\"touchdown";
/// Bytes of a description that are looked at: it says who made it in its first element.
const HEAD: u64 = 1 << 16;

/// Writes the archive `bytes`, which is described by its member `description`, to `out`. A file there that is no archive of ours is
/// kept under another name, which is returned.
///
/// # Errors
/// As the file system gives them; none is left half-written.
pub fn write_archive(out: &Path, bytes: &[u8], description: &str) -> Result<Option<Kept>> {
    output::write_keeping_at(out, bytes, |f| is_archive_of_ours(f, description))
        .with_context(|| format!("{}: cannot be written", out.display()))
}

/// Whether `file` is an archive whose description says that touchdown has made it.
pub fn is_archive_of_ours(file: File, description: &str) -> bool {
    let Ok(mut archive) = zip::ZipArchive::new(file) else { return false };
    let Ok(member) = archive.by_name(description) else { return false };
    let mut head = Vec::new();
    let read = member.take(HEAD).read_to_end(&mut head);
    read.is_ok() && String::from_utf8_lossy(&head).contains(MADE_BY)
}
