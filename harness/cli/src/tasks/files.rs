//! Files of answers and of campaigns that the Python package reads, hands on and makes.

use crate::print::Shown;
use anyhow::{bail, ensure, Context, Result};
use output::{Answer, Folder, Manifest};
use std::fs::File;
use std::path::Path;

/// Bytes of a file of an answer at most.
const MOST: u64 = 1 << 32;
/// The command by which a campaign made of tables is listed.
const COMMAND: &str = "campaign";

/// The bytes of the file `name` in the folder of an answer: no link is followed, and the name leads to no other folder.
///
/// # Errors
/// Names the file.
pub fn bytes(folder: &Path, name: &str) -> Result<Vec<u8>> {
    let of = || format!("{}: cannot be read; name the folder of an answer", folder.join(name).shown());
    Folder::open(folder).and_then(|f| f.bytes(name, MOST)).with_context(of)
}

/// Whether a file is a page or an FMU that touchdown has written.
fn is_ours(file: File) -> bool {
    report::diagnosis::lead_of(&file).is_some() || ::pack::is_archive_of_ours(file, "modelDescription.xml")
}

/// Writes the file `name` of the answer in `folder` to `out`, whole or not at all. A file of somebody's that is there is kept under
/// another name; what is to be reported of that.
///
/// # Errors
/// Names the file that cannot be read or written.
pub fn copied(folder: &Path, name: &str, out: &Path) -> Result<Option<String>> {
    let bytes = bytes(folder, name)?;
    ensure!(!out.is_dir(), "{}: is a folder; give the name of a file", out.shown());
    let kept = output::write_keeping_at(out, &bytes, is_ours).with_context(|| crate::place::unwritten(out))?;
    Ok(kept.map(|k| k.note()))
}

/// Writes the files of a campaign to `folder`, all or none. Those of an earlier call go where they are as that wrote them.
///
/// # Errors
/// [`std::io::ErrorKind::AlreadyExists`] where files of these names are there that no earlier call has left so; as the file system
/// gives them.
pub fn campaign(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<()> {
    let was = Manifest::read(folder).filter(|m| m.command == COMMAND);
    for (name, bytes) in files {
        let path = folder.join(name);
        let Ok(there) = path.symlink_metadata() else { continue };
        let is_same = || there.is_file() && input::bytes(&path, MOST).is_ok_and(|b| b == *bytes);
        if !was.as_ref().is_some_and(|m| m.has(folder, name)) && !is_same() {
            let why = "is in the way, and is not as Campaign.of wrote it; give another folder, or move it";
            bail!(std::io::Error::new(std::io::ErrorKind::AlreadyExists, format!("{} {why}", path.shown())));
        }
    }
    let answer = Answer::begin(folder, COMMAND)?;
    files.iter().try_for_each(|(name, bytes)| answer.write(name, bytes))?;
    answer.commit()?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_an_answer_is_handed_on_whole_and_replaces_none_of_somebodys() {
        let t = tempfile::tempdir().unwrap();
        let answer = t.path().join("answer");
        std::fs::create_dir(&answer).unwrap();
        std::fs::write(t.path().join("secret"), "x").unwrap();
        std::fs::write(answer.join("report.html"), chart::Page::new("t").sentence("It is so.").html()).unwrap();
        let out = t.path().join("mine.html");
        std::fs::write(&out, "mine").unwrap();
        assert!(copied(&answer, "report.html", &out).unwrap().unwrap().contains("mine.kept.html"));
        assert_eq!(std::fs::read_to_string(t.path().join("mine.kept.html")).unwrap(), "mine");
        // an earlier report is ours
        assert_eq!(copied(&answer, "report.html", &out).unwrap(), None);
        assert!(copied(&answer, "../secret", &out).is_err() && copied(&answer, "/etc/hostname", &out).is_err());
        assert!(copied(&answer, "report.html", t.path()).is_err());
    }

    #[test]
    fn a_campaign_replaces_what_an_earlier_one_wrote_and_nothing_else() {
        let t = tempfile::tempdir().unwrap();
        let folder = t.path().join("c");
        let files = |names: &[&str], text: &str| {
            names.iter().map(|n| (n.to_string(), text.as_bytes().to_vec())).collect::<Vec<_>>()
        };
        let text = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
        let refused = |e: anyhow::Error| {
            e.downcast_ref::<std::io::Error>().is_some_and(|e| e.kind() == std::io::ErrorKind::AlreadyExists)
        };
        campaign(&folder, &files(&["campaign.toml", "a.csv", "b.csv"], "1")).unwrap();
        std::fs::write(folder.join("mine.csv"), "mine").unwrap();
        campaign(&folder, &files(&["campaign.toml", "a.csv"], "2")).unwrap();
        assert!(text("a.csv") == "2" && text("mine.csv") == "mine" && !folder.join("b.csv").exists());
        // a recording of the user's with a name that is wanted, and one that was edited
        assert!(refused(campaign(&folder, &files(&["campaign.toml", "mine.csv"], "3")).unwrap_err()));
        std::fs::write(folder.join("campaign.toml"), "2 and notes").unwrap();
        assert!(refused(campaign(&folder, &files(&["campaign.toml", "a.csv"], "3")).unwrap_err()));
        assert!(text("campaign.toml") == "2 and notes" && text("mine.csv") == "mine" && text("a.csv") == "2");
    }
}
