//! The answers of a fleet put together: one table, one page.

use crate::place;
use crate::print::Shown;
use crate::typed::COMMIT;
use anyhow::{ensure, Context, Result};
use fleet::growth::{growths, Growths};
use fleet::{table, Fleet};
use report::trace::Made;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// What a merge wrote.
pub struct Merged {
    pub fleet: Fleet,
    pub summary: Summary,
    /// The page in words.
    pub sentence: String,
    pub page: PathBuf,
    pub table: PathBuf,
    /// What is to be known beside it: what could not be read, and what was in the way.
    pub notes: Vec<String>,
}

/// fleet.json: what a program wants to know of a fleet beside the table.
#[derive(Serialize)]
pub struct Summary {
    pub format: &'static str,
    pub campaigns: usize,
    pub judged: usize,
    /// Those where something is missing, and of these how many hold at the level of false discoveries.
    pub detected: usize,
    pub held: usize,
    pub not_judged: Vec<Without>,
    pub lost: Vec<Without>,
    pub growth: Growths,
}

/// A campaign that is not judged, and why.
#[derive(Serialize)]
pub struct Without {
    pub campaign: String,
    pub why: String,
}

/// Puts the answers in the folders `answers` together in `out`: fleet.parquet, fleet.json and index.html, the same bytes from the
/// same answers. Somebody else's files of these names are kept under others, and somebody else's index.html is left as it is.
///
/// # Errors
/// No answer nor any campaign that should have one; what cannot be read or written.
pub fn merge(answers: &[PathBuf], out: &Path) -> Result<Merged> {
    // the same answers make the same page, whenever and by whatever command they are put together
    let made = Made::dateless(COMMIT, "")?;
    let fleet = Fleet::read(answers)?;
    // a folder that is named by mistake would be missed by nobody
    for folder in answers {
        ensure!(
            fleet.found_in.contains(folder),
            "{}: holds no answer of touchdown; give the folder that diagnose --out had",
            folder.shown()
        );
    }
    let growth = growths(&fleet);
    let without = |(a, why): (&fleet::Answer, &str)| Without { campaign: a.campaign.clone(), why: why.into() };
    let detected = || fleet.judged().filter(|(_, j)| j.detected);
    let summary = Summary {
        format: "fleet/1",
        campaigns: fleet.answers.len(),
        judged: fleet.judged().count(),
        detected: detected().count(),
        held: detected().filter(|(_, j)| j.false_discovery_rate <= fleet::growth::LEVEL).count(),
        not_judged: fleet.unjudged().map(without).collect(),
        lost: fleet.lost().map(without).collect(),
        growth,
    };
    let (page, table_at) = (out.join(report::fleet::INDEX), out.join(table::FILE));
    // before anything is written
    report::fleet::check(out).with_context(|| page.shown())?;
    let json = serde_json::to_string_pretty(&summary)? + "\n";
    let html = report::fleet::html(out, &fleet, &summary.growth, &made);
    let table_of = table::parquet(&fleet)?;
    // all of them, or none
    let files =
        [(table::FILE, &table_of[..]), (fleet::SUMMARY, json.as_bytes()), (report::fleet::INDEX, html.as_bytes())];
    let mut notes = fleet.complaints.clone();
    notes.extend(place::write(out, "merge", &files)?);
    Ok(Merged { sentence: report::fleet::sentence(&fleet), fleet, summary, page, table: table_at, notes })
}
