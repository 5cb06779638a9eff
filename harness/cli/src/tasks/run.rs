//! A scenario or a system of FMUs simulated.

use super::Follow;
use crate::campaign::hashed;
use crate::place;
use crate::print::Shown;
use crate::typed::COMMIT;
use anyhow::{ensure, Context, Error, Result};
use host::{HostError, Isolation};
use report::run::{page, Done, Summary};
use report::trace::{files, Made};
use scenario::{simulate_as_far, table, Case, Outcome, Scenario, Source, Through};
use serde::Serialize;
use std::path::PathBuf;

/// What to simulate, and how.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Scenario file (TOML), system of FMUs (TOML) or SSP archive.
    pub scenario: PathBuf,
    /// Folder for results.csv, summary.json and report.html.
    pub out: PathBuf,
    /// FMU to run in place of our own.
    pub fmu: Option<PathBuf>,
    /// Whether to call the law directly, without an FMU.
    pub direct: bool,
    /// Whether to write results.parquet too.
    pub parquet: bool,
    /// Where somebody else's FMUs run.
    pub isolation: Isolation,
    /// Macro-step of a system in place of its own, s.
    pub step: Option<f64>,
    /// End of a system's run in place of its own, s.
    pub stop: Option<f64>,
    /// The command as typed, for the page to say; empty where there was none.
    pub command: String,
}

/// What came of it.
pub struct Ran {
    /// What summary.json holds; None of a system that was interrupted before its end.
    pub summary: Option<Summed>,
    /// The same for a terminal.
    pub words: String,
    /// Whether it was ended before its end.
    pub interrupted: bool,
    /// What broke it off; what was computed before is written.
    pub failure: Option<Error>,
}

/// The summary of a scenario, or that of a system.
#[derive(Serialize)]
#[serde(untagged)]
pub enum Summed {
    Scenario(Box<Summary>),
    System(serde_json::Value),
}

impl Options {
    fn through(&self, case: &Case) -> Through {
        match (&self.fmu, &case.fmu) {
            _ if self.direct => Through::Direct,
            (Some(f), _) => Through::Fmu(f.clone()),
            (None, Some(f)) => Through::Fmu(self.scenario.parent().map_or(f.clone(), |d| d.join(f))),
            (None, None) => Through::Own,
        }
    }
}

/// Whether an error is of an FMU that was running.
fn of_fmu(e: &Error) -> bool {
    e.chain().any(|c| c.downcast_ref::<HostError>().is_some())
}

/// Simulates a scenario or a system and writes what comes out, as far as it came where it was broken off.
///
/// # Errors
/// What is wrong with the file, with an FMU or with the motion, where there is nothing to write; a place that cannot be
/// written.
pub fn simulated(o: &Options, follow: &dyn Follow) -> Result<Ran> {
    if host::master::System::is_one(&o.scenario) {
        return super::system::simulated(o, follow);
    }
    let only = |given: bool, option: &str| {
        ensure!(!given, "{option} is for systems of FMUs, and {} is a scenario; leave it out", o.scenario.shown());
        Ok(())
    };
    only(o.step.is_some(), "--step")?;
    only(o.stop.is_some(), "--stop")?;
    let made = Made::now(COMMIT, &o.command)?;
    let read = hashed(&o.scenario);
    let scenario = Scenario::load(&o.scenario)?;
    let mut cases = scenario.cases();
    let mut source = Source::new(o.isolation.clone());
    follow.looks();
    follow.begin("run", cases.len() as u64);
    let mut outcomes: Vec<(usize, Outcome, String)> = Vec::new();
    let mut failure = None;
    let mut ended = Vec::new();
    for (i, case) in cases.iter_mut().enumerate() {
        let of = if case.name.is_empty() { String::new() } else { format!(" ({})", case.name) };
        let named = || format!("{}{of}", o.scenario.shown());
        let (mut element, name) = match source.element(&o.through(case), case) {
            Ok(made) => made,
            Err(e) => {
                failure = Some(e.context(named()));
                break;
            }
        };
        let case = &*case;
        let mut watch = |m: &scenario::Moment| {
            follow.note(&|| format!("{:.6} s simulated, impact {}, {} steps", m.time, m.impacts, m.steps));
            !follow.stopped()
        };
        let (outcome, end) = simulate_as_far(case, element.as_mut(), &mut watch);
        follow.add(1);
        failure = end.err().filter(|_| !follow.stopped()).map(|e| e.context(named()));
        let asked = failure.as_ref().filter(|_| !outcome.rows.is_empty()).and_then(host::end_asked).map(String::from);
        if let Some(who) = &asked {
            let at = outcome.rows.last().map_or(0.0, |r| r.time);
            ended.push(format!("{who} asked for the end{of} at {at} s, and the run ends there"));
            failure = None;
        }
        let stop = (outcome.interrupted && asked.is_none()) || follow.stopped();
        // a motion that cannot be computed is no result; one that an FMU broke off is
        if !outcome.rows.is_empty() && failure.as_ref().is_none_or(of_fmu) {
            outcomes.push((i, outcome, name));
        }
        if stop {
            break;
        }
    }
    follow.end();
    for c in source.complaints() {
        follow.warning(&format!("{c}; the results are not touched by it"));
    }
    if let Some(e) = failure.take_if(|_| outcomes.is_empty()) {
        return Err(e);
    }
    ensure!(!follow.is_dropped(), "interrupted: nothing is written");
    follow.hands_out();
    let cut = follow.stopped() && (outcomes.len() < cases.len() || outcomes.last().is_some_and(|o| o.1.interrupted));
    let title = o.scenario.file_stem().map_or(String::from("run"), |n| n.to_string_lossy().into_owned());
    let done: Vec<Done> =
        outcomes.iter().map(|(i, outcome, element)| Done { case: &cases[*i], outcome, element }).collect();
    let summary = report::run::summary(&title, &done, cases.len(), cut || failure.is_some());
    let pairs: Vec<(&Case, &Outcome)> = done.iter().map(|d| (d.case, d.outcome)).collect();
    let rows = table(&pairs);
    let json = serde_json::to_string_pretty(&summary)? + "\n";
    let foot: Vec<_> = made.rows().into_iter().chain(files(read.as_slice())).collect();
    let mut out = vec![
        ("results.csv", rows.csv().into_bytes()),
        ("summary.json", json.into_bytes()),
        ("report.html", page(&title, &done, &summary).trace(&foot).html().into_bytes()),
    ];
    if o.parquet {
        out.push(("results.parquet", rows.parquet().context("results.parquet: cannot be made")?));
    }
    let out: Vec<(&str, &[u8])> = out.iter().map(|(name, bytes)| (*name, bytes.as_slice())).collect();
    place::write(&o.out, "run", &out)?.iter().for_each(|n| follow.warning(n));
    let mut lines = report::run::lines(&done, &summary);
    lines.extend(ended);
    lines.push(format!("pictures: {}", o.out.join("report.html").shown()));
    if cut {
        lines.push(format!("interrupted: {} of {} runs, the last one as far as it came", done.len(), cases.len()));
    }
    let words = lines.join("\n") + "\n";
    let failure = failure.map(|e| {
        let whole = done.iter().filter(|d| !d.outcome.interrupted).count();
        let (all, out) = (cases.len(), o.out.shown());
        e.context(format!("{whole} of {all} runs are whole, what there is of all is in {out}"))
    });
    Ok(Ran { summary: Some(Summed::Scenario(Box::new(summary))), words, interrupted: cut, failure })
}
