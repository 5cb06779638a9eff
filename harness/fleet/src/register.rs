//! What is known of campaigns that have no answer: which there are, and why one was lost. Files in a hidden folder beside the
//! answers.

use output::Folder;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io::{Error, ErrorKind, Result};
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
    /// Where its recordings are; written as text, with what is no UTF-8 replaced.
    #[serde(serialize_with = "as_text")]
    pub folder: PathBuf,
}

fn as_text<S: serde::Serializer>(path: &Path, to: S) -> std::result::Result<S::Ok, S::Error> {
    to.serialize_str(&path.to_string_lossy())
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
    let name = format!("{FOLDER}/campaigns-{}.json", &hash[..16]);
    // one that was damaged is written anew
    let is_there = Folder::open(out).and_then(|f| f.bytes(&name, MOST)).is_ok_and(|b| b == text.as_bytes());
    if is_there {
        return Ok(());
    }
    output::write_below(out, name, text.as_bytes())
}

/// All campaigns that were to be answered in `out`, sorted; none where nobody has written them down. What cannot be read is
/// reported to `complain`, and left out.
///
/// # Errors
/// As the file system gives them.
pub fn members(out: &Path, complain: &mut dyn FnMut(String)) -> Result<Vec<Member>> {
    let mut all = Vec::new();
    for (path, _, text) in files(out, FOLDER, "campaigns-")? {
        match text.and_then(|t| Ok(serde_json::from_str::<List>(&t)?)) {
            Ok(list) => all.extend(list.campaigns),
            Err(e) => complain(format!(
                "{}: cannot be read ({e}), and campaigns that it alone names are not missed; give diagnose --shard the same \
                 campaigns again, which writes it anew",
                path.display()
            )),
        }
    }
    all.sort();
    all.dedup_by(|a, b| a.campaign == b.campaign);
    Ok(all)
}

/// Where it is written down why a campaign is lost, below the answers.
///
/// # Errors
/// A campaign's name that is no name of a folder.
fn place(campaign: &str) -> Result<PathBuf> {
    if campaign.is_empty() || campaign == "." || campaign == ".." || campaign.contains(['/', '\0']) {
        return Err(Error::new(ErrorKind::InvalidInput, format!("{campaign:?} is no name of a folder")));
    }
    Ok(Path::new(FOLDER).join("lost").join(format!("{campaign}.json")))
}

/// Writes down why `campaign` has no answer in `out`.
///
/// # Errors
/// As the file system gives them.
pub fn lose(out: &Path, campaign: &str, why: &str) -> Result<()> {
    let text = serde_json::to_string_pretty(&Lost { campaign: campaign.into(), why: why.into() })? + "\n";
    let place = place(campaign)?;
    output::write_below(out, &place, text.as_bytes()).map_err(|e| named(&out.join(place), e))
}

/// Strikes out what was written down of `campaign`, which has its answer now.
///
/// # Errors
/// As the file system gives them.
pub fn find(out: &Path, campaign: &str) -> Result<()> {
    let place = place(campaign)?;
    match output::remove_below(out, &place) {
        Err(e) if e.kind() != ErrorKind::NotFound => Err(named(&out.join(place), e)),
        _ => Ok(()),
    }
}

/// An error with the file that it is of and the cure.
fn named(path: &Path, e: Error) -> Error {
    let said = e.to_string();
    let path = path.display().to_string();
    match said.contains(&path) {
        true => e,
        false => Error::new(e.kind(), format!("{path}: {said}; move what has that name, or give another --out")),
    }
}

/// Why campaigns have no answer in `out`, by campaign. Of a file that cannot be read the campaign is known by its name.
///
/// # Errors
/// As the file system gives them.
pub fn lost(out: &Path) -> Result<BTreeMap<String, String>> {
    let mut all = BTreeMap::new();
    for (path, name, text) in files(out, &format!("{FOLDER}/lost"), "")? {
        let of = |e: &dyn std::fmt::Display| {
            let campaign = name.strip_suffix(".json").unwrap_or(&name).to_string();
            Lost { campaign, why: format!("why was written to {}, which cannot be read ({e})", path.display()) }
        };
        let l = match text {
            Ok(text) => serde_json::from_str(&text).unwrap_or_else(|e| of(&e)),
            Err(e) => of(&e),
        };
        all.insert(l.campaign, l.why);
    }
    Ok(all)
}

/// Path, name and text of the JSON files in `folder` of `out` whose names begin with `start`, sorted; none where it is not there.
fn files(out: &Path, folder: &str, start: &str) -> Result<Vec<(PathBuf, String, Result<String>)>> {
    let open = match Folder::open(out).and_then(|f| f.folder(folder)) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Vec::new()),
        open => open?,
    };
    let mut names: Vec<String> = open.names()?.iter().map(|n| n.to_string_lossy().into_owned()).collect();
    // the stages of others that write there are none
    names.retain(|n| n.ends_with(".json") && n.starts_with(start));
    names.sort();
    let mut all = Vec::new();
    for name in names {
        let text = open.bytes(&name, MOST).and_then(|b| {
            String::from_utf8(b).map_err(|_| Error::new(ErrorKind::InvalidData, "it is no text in UTF-8"))
        });
        match text {
            // struck out since
            Err(e) if e.kind() == ErrorKind::NotFound => {}
            text => all.push((open.path().join(&name), name, text)),
        }
    }
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
        let members = |out: &Path| members(out, &mut |why| panic!("{why}"));
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

    #[test]
    fn a_damaged_file_of_the_register_loses_nothing_else_and_is_named() {
        let t = tempfile::tempdir().unwrap();
        enlist(t.path(), &[member("a")]).unwrap();
        lose(t.path(), "b", "its process aborted").unwrap();
        lose(t.path(), "c", "its process aborted").unwrap();
        let folder = t.path().join(FOLDER);
        std::fs::write(folder.join("campaigns-0.json"), "{\"format\": \"fle").unwrap();
        std::fs::write(folder.join("lost/b.json"), "{\"campaign\":").unwrap();
        let mut complaints = Vec::new();
        assert_eq!(members(t.path(), &mut |c| complaints.push(c)).unwrap(), [member("a")]);
        assert!(complaints.len() == 1 && complaints[0].contains("campaigns-0.json: cannot be read"), "{complaints:?}");
        let lost = lost(t.path()).unwrap();
        assert!(lost["b"].contains("lost/b.json, which cannot be read") && lost["c"] == "its process aborted");
    }

    #[test]
    #[cfg(unix)]
    fn a_folder_whose_name_is_no_utf_8_is_enlisted() {
        use std::os::unix::ffi::OsStrExt;
        let t = tempfile::tempdir().unwrap();
        let folder = Path::new("/data").join(std::ffi::OsStr::from_bytes(b"c\xff"));
        enlist(t.path(), &[member("a"), Member { campaign: "c\u{fffd}".into(), folder }]).unwrap();
        let names: Vec<String> =
            members(t.path(), &mut |why| panic!("{why}")).unwrap().into_iter().map(|m| m.campaign).collect();
        assert_eq!(names, ["a", "c\u{fffd}"]);
    }

    #[test]
    #[cfg(unix)]
    fn a_register_that_is_a_link_is_not_followed() {
        let t = tempfile::tempdir().unwrap();
        let (out, precious) = (t.path().join("out"), t.path().join("precious"));
        std::fs::create_dir_all(precious.join("lost")).unwrap();
        std::fs::create_dir(&out).unwrap();
        std::fs::write(precious.join("lost/a.json"), "mine").unwrap();
        std::os::unix::fs::symlink(&precious, out.join(FOLDER)).unwrap();
        assert!(enlist(&out, &[member("a")]).is_err() && lose(&out, "a", "").is_err() && find(&out, "a").is_err());
        assert!(lose(&out, "../a", "").is_err());
        assert_eq!(std::fs::read_to_string(precious.join("lost/a.json")).unwrap(), "mine");
        assert_eq!(std::fs::read_dir(&precious).unwrap().count(), 1);
    }
}
