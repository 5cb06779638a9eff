//! `touchdown run`.

use super::fmus::Fmus;
use super::form::Form;
use crate::place;
use crate::print;
use crate::progress::{catch_interrupts, hand_out, interrupted, interrupted_code, Progress};
use anyhow::{Context, Result};
use host::HostError;
use report::run::{page, Done};
use scenario::{simulate_as_far, table, Case, Outcome, Scenario, Source, Through};
use std::path::PathBuf;
use std::process::ExitCode;

const EXAMPLES: &str = "Examples:
  touchdown run harness/examples/drop_test.toml --out drop      # then open drop/report.html
  touchdown run harness/examples/drop_test.toml --direct --out drop --parquet
  touchdown run drop_test.toml --fmu Other.fmu --out drop       # through somebody else's FMU
  touchdown run machine.ssp --out machine                       # a system of FMUs
  touchdown run machine.ssp --out machine --fmu-seconds 5       # a call that takes longer is an error";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Scenario file (TOML), system of FMUs (TOML) or SSP 1.0 archive
    scenario: PathBuf,
    /// Folder for results.csv, summary.json and report.html
    #[arg(long)]
    pub out: PathBuf,
    /// FMU to run instead of our own, which is packed on the fly
    #[arg(long, conflicts_with = "direct")]
    fmu: Option<PathBuf>,
    /// Call the law directly, without an FMU
    #[arg(long)]
    direct: bool,
    /// Write results.parquet too
    #[arg(long)]
    parquet: bool,
    #[command(flatten)]
    fmus: Fmus,
    #[command(flatten)]
    form: Form,
}

impl Arguments {
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
fn of_fmu(e: &anyhow::Error) -> bool {
    e.chain().any(|c| c.downcast_ref::<HostError>().is_some())
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let isolation = a.fmus.isolation()?;
    if host::master::System::is_one(&a.scenario) {
        return super::system::run(&a.scenario, &a.out, a.parquet, isolation, a.form);
    }
    let scenario = Scenario::load(&a.scenario)?;
    let mut cases = scenario.cases();
    let mut source = Source::new(isolation);
    catch_interrupts();
    let progress = Progress::new("run", cases.len() as u64);
    let mut outcomes: Vec<(usize, Outcome, String)> = Vec::new();
    let mut failure = None;
    for (i, case) in cases.iter_mut().enumerate() {
        let of = if case.name.is_empty() { String::new() } else { format!(" ({})", case.name) };
        let named = || format!("{}{of}", a.scenario.display());
        let (mut element, name) = match source.element(&a.through(case), case) {
            Ok(made) => made,
            Err(e) => {
                failure = Some(e.context(named()));
                break;
            }
        };
        let case = &*case;
        let mut watch = |m: &scenario::Moment| {
            progress.note(&|| format!("{:.6} s simulated, impact {}, {} steps", m.time, m.impacts, m.steps));
            !interrupted()
        };
        let (o, end) = simulate_as_far(case, element.as_mut(), &mut watch);
        progress.add(1);
        failure = end.err().filter(|_| !interrupted()).map(|e| e.context(named()));
        let stop = o.interrupted || interrupted();
        // a motion that cannot be computed is no result; one that an FMU broke off is
        if !o.rows.is_empty() && failure.as_ref().is_none_or(of_fmu) {
            outcomes.push((i, o, name));
        }
        if stop {
            break;
        }
    }
    drop(progress);
    for c in source.complaints() {
        print::warning(&format!("{c}; the results are not touched by it"));
    }
    if let Some(e) = failure.take_if(|_| outcomes.is_empty()) {
        return Err(e);
    }
    hand_out();
    let cut = interrupted() && (outcomes.len() < cases.len() || outcomes.last().is_some_and(|o| o.1.interrupted));
    let title = a.scenario.file_stem().map_or(String::from("run"), |n| n.to_string_lossy().into_owned());
    let done: Vec<Done> =
        outcomes.iter().map(|(i, o, element)| Done { case: &cases[*i], outcome: o, element }).collect();
    let summary = report::run::summary(&title, &done, cases.len(), cut || failure.is_some());
    let pairs: Vec<(&Case, &Outcome)> = done.iter().map(|d| (d.case, d.outcome)).collect();
    let rows = table(&pairs);
    let json = serde_json::to_string_pretty(&summary)? + "\n";
    let mut out = vec![
        ("results.csv", rows.csv().into_bytes()),
        ("summary.json", json.into_bytes()),
        ("report.html", page(&title, &done, &summary).html().into_bytes()),
    ];
    if a.parquet {
        out.push(("results.parquet", rows.parquet().context("results.parquet: cannot be made")?));
    }
    let out: Vec<(&str, &[u8])> = out.iter().map(|(name, bytes)| (*name, bytes.as_slice())).collect();
    place::write(&a.out, "run", &out)?;
    let words = |summary: &report::run::Summary| {
        let mut lines = report::run::lines(&done, summary);
        lines.push(format!("pictures: {}", a.out.join("report.html").display()));
        if cut {
            lines.push(format!("interrupted: {} of {} runs, the last one as far as it came", done.len(), cases.len()));
        }
        lines.join("\n") + "\n"
    };
    print::beside(&a.form.of(&summary, words)?);
    if let Some(e) = failure {
        let whole = done.iter().filter(|d| !d.outcome.interrupted).count();
        let (all, out) = (cases.len(), a.out.display());
        return Err(e.context(format!("{whole} of {all} runs are whole, what there is of all is in {out}")));
    }
    Ok(if cut { interrupted_code() } else { ExitCode::SUCCESS })
}
