//! What is known of campaigns that have no answer: which there are, and why one was lost. Files in a hidden folder beside the
//! answers.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io::Result;
use std::path::{Path, PathBuf};

/// The folder's name.
pub const FOLDER: &str = ".touchdown-fleet";
/// The format this version writes.
const FORMAT: &str = "fleet/1";
/// Bytes of a file of the register at most.
const MOST: u64 = 1 << 28;

/// A campaign that belongs to the fleet.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Member {
    /// Name of its folder, which is that of its answer.
    pub campaign: String,
    /// Where its recordings are.
    pub folder: PathBuf,
}

#[derive(Serialize, Deserialize)]
struct List {
    format: String,
    campaigns: Vec<Member>,
}

/// Why a campaign has no answer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Lost {
    pub campaign: String,
    pub why: String,
}

/// Writes down which campaigns are to be answered in `out`; once, however many processes say the same.
///
/// # Errors
/// As the file system gives them.
pub fn enlist(out: &Path, members: &[Member]) -> Result<()> {
    let mut campaigns = members.to_vec();
    campaigns.sort();
    let text = serde_json::to_string_pretty(&List { format: FORMAT.into(), campaigns })? + "\n";
    let hash = output::hexadecimal(&Sha256::digest(&text));
    let path = out.join(FOLDER).join(format!("campaigns-{}.json", &hash[..16]));
    if path.exists() {
        return Ok(());
    }
    output::write(&path, text.as_bytes())
}

/// All campaigns that were to be answered in `out`, sorted; none where nobody has written them down.
///
/// # Errors
/// As the file system gives them, and where a list is none of ours.
pub fn members(out: &Path) -> Result<Vec<Member>> {
    let mut all = Vec::new();
    for (_, text) in files(&out.join(FOLDER), "campaigns-")? {
        all.extend(serde_json::from_str::<List>(&text)?.campaigns);
    }
    all.sort();
    all.dedup_by(|a, b| a.campaign == b.campaign);
    Ok(all)
}

fn place(out: &Path, campaign: &str) -> PathBuf {
    out.join(FOLDER).join("lost").join(format!("{campaign}.json"))
}

/// Writes down why `campaign` has no answer in `out`.
///
/// # Errors
/// As the file system gives them.
pub fn lose(out: &Path, campaign: &str, why: &str) -> Result<()> {
    let text = serde_json::to_string_pretty(&Lost { campaign: campaign.into(), why: why.into() })? + "\n";
    output::write(&place(out, campaign), text.as_bytes())
}

/// Strikes out what was written down of `campaign`, which has its answer now.
///
/// # Errors
/// As the file system gives them.
pub fn find(out: &Path, campaign: &str) -> Result<()> {
    match std::fs::remove_file(place(out, campaign)) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(e),
        _ => Ok(()),
    }
}

/// Why campaigns have no answer in `out`, by campaign.
///
/// # Errors
/// As the file system gives them, and where a file is none of ours.
pub fn lost(out: &Path) -> Result<BTreeMap<String, String>> {
    let mut all = BTreeMap::new();
    for (_, text) in files(&out.join(FOLDER).join("lost"), "")? {
        let l: Lost = serde_json::from_str(&text)?;
        all.insert(l.campaign, l.why);
    }
    Ok(all)
}

/// Name and text of the JSON files in `folder` whose names begin with `start`, sorted; none where it is not there.
fn files(folder: &Path, start: &str) -> Result<Vec<(String, String)>> {
    if !folder.exists() {
        return Ok(Vec::new());
    }
    let mut all = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        // the stages of others that write there are none
        if !name.ends_with(".json") || !name.starts_with(start) || !entry.file_type()?.is_file() {
            continue;
        }
        if entry.metadata()?.len() > MOST {
            let why = format!("{}: is larger than any list of touchdown", entry.path().display());
            return Err(std::io::Error::other(why));
        }
        match std::fs::read_to_string(entry.path()) {
            // struck out since
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => {}
            text => all.push((name, text?)),
        }
    }
    all.sort();
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn member(name: &str) -> Member {
        Member { campaign: name.into(), folder: Path::new("/data").join(name) }
    }

    #[test]
    fn lists_are_written_once_and_read_together() {
        let t = tempfile::tempdir().unwrap();
        assert!(members(t.path()).unwrap().is_empty() && lost(t.path()).unwrap().is_empty());
        enlist(t.path(), &[member("b"), member("a")]).unwrap();
        enlist(t.path(), &[member("a"), member("b")]).unwrap();
        assert_eq!(std::fs::read_dir(t.path().join(FOLDER)).unwrap().count(), 1);
        enlist(t.path(), &[member("b"), member("c")]).unwrap();
        assert_eq!(members(t.path()).unwrap(), [member("a"), member("b"), member("c")]);
    }

    #[test]
    fn what_is_lost_is_known_until_it_is_found() {
        let t = tempfile::tempdir().unwrap();
        lose(t.path(), "a b", "its process aborted").unwrap();
        lose(t.path(), "a b", "its process was killed").unwrap();
        assert_eq!(lost(t.path()).unwrap(), [("a b".to_string(), "its process was killed".to_string())].into());
        find(t.path(), "a b").unwrap();
        find(t.path(), "a b").unwrap();
        assert!(lost(t.path()).unwrap().is_empty());
    }
}
