//! `touchdown run`.

use super::fmus::Fmus;
use super::form::Form;
use super::terminal::Terminal;
use crate::print;
use crate::progress::interrupted_code;
use crate::tasks::run::{simulated, Options};
use crate::typed;
use anyhow::Result;
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
    /// Scenario file (TOML), system of FMUs (TOML) or SSP archive
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
    /// Macro-step of a system of FMUs in place of its own, s
    #[arg(long, value_name = "SECONDS")]
    step: Option<f64>,
    /// End of a system of FMUs in place of its own, s
    #[arg(long, value_name = "SECONDS")]
    stop: Option<f64>,
    #[command(flatten)]
    fmus: Fmus,
    #[command(flatten)]
    form: Form,
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let o = Options {
        scenario: a.scenario.clone(),
        out: a.out.clone(),
        fmu: a.fmu.clone(),
        direct: a.direct,
        parquet: a.parquet,
        isolation: a.fmus.isolation()?,
        step: a.step,
        stop: a.stop,
        command: typed::line(),
    };
    let done = simulated(&o, &Terminal::new(a.form))?;
    match &done.summary {
        // what there is of a system that was interrupted is words alone
        None => print::beside(&done.words),
        Some(summary) => print::beside(&a.form.of(summary, |_| done.words.clone())?),
    }
    if let Some(e) = done.failure {
        return Err(e);
    }
    Ok(if done.interrupted { interrupted_code() } else { ExitCode::SUCCESS })
}
