//! `touchdown run`.

use super::form::Form;
use crate::place;
use crate::print;
use crate::progress::{catch_interrupts, hand_out, interrupted, interrupted_code, Progress};
use anyhow::{Context, Result};
use report::run::{page, Done};
use scenario::{simulate, table, Case, Outcome, Scenario, Source, Through};
use std::path::PathBuf;
use std::process::ExitCode;

const EXAMPLES: &str = "Examples:
  touchdown run harness/examples/drop_test.toml --out drop      # then open drop/report.html
  touchdown run harness/examples/drop_test.toml --direct --out drop --parquet
  touchdown run drop_test.toml --fmu Other.fmu --out drop       # through somebody else's FMU
  touchdown run machine.ssp --out machine                       # a system of FMUs";

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

pub fn run(a: &Arguments) -> Result<ExitCode> {
    if host::master::System::is_one(&a.scenario) {
        return super::system::run(&a.scenario, &a.out, a.parquet, a.form);
    }
    let scenario = Scenario::load(&a.scenario)?;
    let mut cases = scenario.cases();
    let mut source = Source::new();
    catch_interrupts();
    let progress = Progress::new("run", cases.len() as u64);
    let mut outcomes: Vec<(usize, Outcome, String)> = Vec::new();
    for (i, case) in cases.iter_mut().enumerate() {
        let of = if case.name.is_empty() { String::new() } else { format!(" ({})", case.name) };
        let named = || format!("{}{of}", a.scenario.display());
        let (mut element, name) = source.element(&a.through(case), case).with_context(named)?;
        let case = &*case;
        let mut watch = |m: &scenario::Moment| {
            progress.note(&|| format!("{:.6} s simulated, impact {}, {} steps", m.time, m.impacts, m.steps));
            !interrupted()
        };
        let o = simulate(case, element.as_mut(), &mut watch).with_context(named)?;
        progress.add(1);
        let stop = o.interrupted || interrupted();
        outcomes.push((i, o, name));
        if stop {
            break;
        }
    }
    drop(progress);
    hand_out();
    let cut = interrupted() && (outcomes.len() < cases.len() || outcomes.last().is_some_and(|o| o.1.interrupted));
    let title = a.scenario.file_stem().map_or(String::from("run"), |n| n.to_string_lossy().into_owned());
    let done: Vec<Done> =
        outcomes.iter().map(|(i, o, element)| Done { case: &cases[*i], outcome: o, element }).collect();
    let summary = report::run::summary(&title, &done, cases.len(), cut);
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
    Ok(if cut { interrupted_code() } else { ExitCode::SUCCESS })
}
