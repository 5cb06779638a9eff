//! index.html beside the answers: what was found in every campaign, each with a link to its report.

use crate::fleet;
use crate::trace::Made;
use chart::{lead, Page};
use output::{Answer, Committed};
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// Bytes at the beginning of a report that hold its first sentence.
const HEAD: u64 = 1 << 17;

/// The first sentence of the report in `dir`; None where there is no answer.
fn finding(dir: &Path) -> Option<String> {
    if !dir.join("verdict.json").is_file() {
        return None;
    }
    lead_of(&input::open(&dir.join("report.html")).ok()?)
}

/// The first sentence of a page of ours; None of any other file.
pub fn lead_of(page: &File) -> Option<String> {
    let mut head = Vec::new();
    page.take(HEAD).read_to_end(&mut head).ok()?;
    lead(&String::from_utf8_lossy(&head))
}

/// Names of the folders in `out` that hold an answer, in order.
pub fn answers(out: &Path) -> Vec<String> {
    let all = std::fs::read_dir(out).into_iter().flatten().flatten().map(|e| e.path());
    let is_answer = |d: &std::path::PathBuf| d.join("verdict.json").is_file();
    let mut names: Vec<String> =
        all.filter(is_answer).filter_map(|d| Some(d.file_name()?.to_str()?.to_string())).collect();
    names.sort();
    names
}

/// Writes `out`/index.html, which lists all answers in `out`; what was found in its way is to be reported.
///
/// # Errors
/// As the file system gives them; and where an index.html is there that is none of ours.
pub fn write(out: &Path, made: &Made) -> std::io::Result<Committed> {
    fleet::check(out)?;
    let mut answers: Vec<(String, String)> = Vec::new();
    for entry in std::fs::read_dir(out)? {
        let dir = entry?.path();
        if let (Some(name), Some(text)) = (dir.file_name().and_then(|n| n.to_str()), finding(&dir)) {
            answers.push((name.into(), text));
        }
    }
    answers.sort();
    let mut page = Page::new("Diagnoses").sentence(&match answers.len() {
        1 => "One campaign was diagnosed.".into(),
        n => format!("{n} campaigns were diagnosed."),
    });
    for (name, text) in &answers {
        page = page.entry(&format!("{}/report.html", encoded(name)), name, text);
    }
    page = page.trace(&made.rows());
    let answer = Answer::amend(out, "diagnose")?;
    answer.write(fleet::INDEX, page.html().as_bytes())?;
    answer.commit()
}

/// A folder's name in a link.
pub fn encoded(name: &str) -> String {
    let of = |b: u8| match b {
        b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'~' => (b as char).to_string(),
        _ => format!("%{b:02X}"),
    };
    name.bytes().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_index_lists_the_answers_and_leaves_somebody_elses_page_alone() {
        let dir = tempfile::tempdir().unwrap();
        let answer = dir.path().join("a b#1");
        std::fs::create_dir(&answer).unwrap();
        std::fs::write(answer.join("verdict.json"), "{}").unwrap();
        std::fs::write(answer.join("report.html"), Page::new("t").sentence("It leaves out <this>.").html()).unwrap();
        for _ in 0..2 {
            write(dir.path(), &Made::default()).unwrap();
            let h = std::fs::read_to_string(dir.path().join("index.html")).unwrap();
            assert!(h.contains("href=\"a%20b%231/report.html\"") && h.contains("It leaves out &lt;this&gt;."));
        }
        // also one that looks like ours
        let page = std::fs::read_to_string(dir.path().join("index.html")).unwrap();
        for mine in ["<p>mine</p>".to_string(), page.replace("diagnosed", "diagnosed by me")] {
            std::fs::write(dir.path().join("index.html"), &mine).unwrap();
            assert!(write(dir.path(), &Made::default()).is_err());
            assert_eq!(std::fs::read_to_string(dir.path().join("index.html")).unwrap(), mine);
        }
    }
}
