//! Archives that touchdown has written, told from those of others.

use std::fs::File;
use std::io::Read;

/// How the description of every archive of ours says who made it.
const MADE_BY: &str = "generationTool=\"touchdown";
/// Bytes of a description that are looked at: it says who made it in its first element.
const HEAD: u64 = 1 << 16;

/// Whether `file` is an archive whose description, its member `description`, says that touchdown has made it.
pub fn is_archive_of_ours(file: File, description: &str) -> bool {
    let Ok(mut archive) = zip::ZipArchive::new(file) else { return false };
    let Ok(member) = archive.by_name(description) else { return false };
    let mut head = Vec::new();
    let read = member.take(HEAD).read_to_end(&mut head);
    read.is_ok() && String::from_utf8_lossy(&head).contains(MADE_BY)
}
