//! `touchdown fit`.

use super::form::Form;
use super::terminal::Terminal;
use crate::print;
use crate::progress::{interrupted, interrupted_code};
use crate::tasks::fit::{fit, Options};
use crate::typed;
use anyhow::Result;
use estimate::case::Method;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Clone, Copy, clap::ValueEnum)]
enum Way {
    /// Nelder and Mead's simplex, as the paper has it
    Simplex,
    /// Levenberg-Marquardt
    Lm,
}

const EXAMPLES: &str = "Examples:
  touchdown fit my_drops --out fit                       # then open fit/report.html
  touchdown fit my_drops --out fit --method simplex --seconds 60";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Campaign folder of format recordings/1
    campaign: PathBuf,
    /// Folder for fit.json, certificate.json and report.html
    #[arg(long)]
    pub out: PathBuf,
    /// How to minimise
    #[arg(long, value_enum, default_value = "lm")]
    method: Way,
    /// Seconds after which the best so far is written
    #[arg(long, default_value_t = 600.0, allow_negative_numbers = true)]
    seconds: f64,
    #[command(flatten)]
    form: Form,
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let method = match a.method {
        Way::Simplex => Method::Simplex,
        Way::Lm => Method::LevenbergMarquardt,
    };
    let o = Options {
        campaign: a.campaign.clone(),
        out: a.out.clone(),
        method,
        seconds: a.seconds,
        command: typed::line(),
    };
    let done = fit(&o, &Terminal::new(a.form))?;
    print::beside(&a.form.of(&done, |d| d.words.clone())?);
    Ok(if interrupted() { interrupted_code() } else { ExitCode::SUCCESS })
}
