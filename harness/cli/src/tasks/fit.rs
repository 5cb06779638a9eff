//! The law of a campaign estimated.

use super::Follow;
use crate::place;
use crate::print::{self, Shown};
use crate::progress::deadline;
use crate::typed::COMMIT;
use anyhow::{anyhow, ensure, Context, Result};
use estimate::case::{Case, Method};
use estimate::condition::condition;
use estimate::course::estimate;
use estimate::levels::{levels, readings};
use estimate::prepare::Prepared;
use estimate::{Budget, Ended, Watch};
use report::fit::Answer;
use report::trace::Made;
use serde::Serialize;
use std::path::PathBuf;

/// What to fit, and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// Campaign folder of format recordings/1.
    pub campaign: PathBuf,
    /// Folder for fit.json, certificate.json and report.html.
    pub out: PathBuf,
    pub method: Method,
    /// Seconds after which the best so far is written, above 0.
    pub seconds: f64,
    /// The command as typed, for the page to say; empty where there was none.
    pub command: String,
}

/// What came of it: what its files hold, and where its page is.
#[derive(Serialize)]
pub struct Fit {
    pub campaign: String,
    pub fit: serde_json::Value,
    pub certificate: serde_json::Value,
    /// The page.
    pub pictures: PathBuf,
    /// The same for a terminal.
    #[serde(skip)]
    pub words: String,
}

/// Estimates the law of a campaign and writes it. Asked to end, it writes the best so far.
///
/// # Errors
/// Everything wrong with the campaign; a place that cannot be written.
pub fn fit(o: &Options, follow: &dyn Follow) -> Result<Fit> {
    let budget = Budget { stop: Some(follow.stop()), deadline: deadline(Some(o.seconds))? };
    let cure = "nothing is written; give more";
    let up = format!("{}: the {} s given were up before the first fit; {cure}", o.campaign.shown(), o.seconds);
    follow.empty_handed_at(budget.deadline, up);
    let made = Made::now(COMMIT, &o.command)?;
    // before they are read: a page never says that it is of files that were changed since
    let inputs = crate::campaign::inputs(&o.campaign).unwrap_or_default();
    let campaign = crate::campaign::load(&o.campaign)?;
    for w in &campaign.warnings {
        follow.warning(&format!("{}: {w}", campaign.dir.shown()));
    }
    follow.looks();
    follow.begin(&format!("fit {}", campaign.folder), 0);
    let say = |line: &str| follow.stage(line);
    let watch = Watch { budget, say: &say };
    say(&format!("preparing {} recordings", campaign.recordings.len()));
    let of_campaign = || campaign.dir.shown();
    let mut conditioned = condition(&campaign).with_context(of_campaign)?;
    diagnose::plausible::check(&campaign, &conditioned.data)
        .map_err(|e| anyhow!(crate::campaign::of_campaign(&campaign.dir, &e)))?;
    conditioned.data.budget = budget;
    let case = Case::new(Prepared::from(&campaign, conditioned).with_context(of_campaign)?);
    // from here on there is a best so far
    follow.hands_out();
    let e = estimate(&case, o.method, &watch).with_context(of_campaign)?;
    // what it starts from is no estimate
    let has_begun = e.iterations > 0 || e.stopped != Some(Ended::Interrupted);
    ensure!(has_begun, "interrupted before the first iteration; nothing is written");
    say("level by level");
    let (initial, last) = (readings(&case, &e.start), readings(&case, &e.point));
    let levels = levels(&campaign, &case, &e, &last, &watch);
    ensure!(!follow.is_dropped(), "interrupted: nothing is written");
    let answer =
        Answer { campaign: &campaign, case: &case, estimate: &e, initial, last, levels, made: &made, inputs: &inputs };
    let committed = answer.write(&o.out).with_context(|| place::unwritten(&o.out))?;
    place::notes(&o.out, &committed).for_each(|n| follow.warning(&n));
    follow.end();
    let pictures = o.out.join("report.html");
    let (sentence, by_level) = (answer.sentence(), answer.by_level());
    let words =
        format!("{}: {sentence}\n{by_level}pictures: {}\n", print::spelled_out(&campaign.folder), pictures.shown());
    let (fit, certificate) = (answer.json(), answer.certificate());
    Ok(Fit { campaign: campaign.folder, fit, certificate, pictures, words })
}
