//! `touchdown pack`.

use super::form::Form;
use crate::print::{self, Shown};
use crate::tasks::pack::{packed, Options};
use anyhow::{Context, Result};
use std::path::PathBuf;
use std::process::ExitCode;

const EXAMPLES: &str = "Examples:
  touchdown pack --out HysteresisContact.fmu
  touchdown pack --out Soft.fmu --set stiffness=2e6 --set exponent=1
  touchdown pack --out Contact.fmu --all-platforms       # for old Linux and Windows, too";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// What to pack: contact (the element), moving-bar (a bar with spring and magnet, the element's partner) or body-force
    /// (friction, drag, spring, magnet and film on a body)
    #[arg(long, default_value = "contact")]
    model: String,
    /// The FMU to write
    #[arg(long)]
    pub out: PathBuf,
    /// Start value of a parameter, NAME=VALUE, a number or the name of a choice; may be given again
    #[arg(long = "set", value_name = "NAME=VALUE")]
    starts: Vec<String>,
    /// Library to pack, PLATFORM=FILE, instead of those that lie ready and this machine's; may be given again
    #[arg(long = "binary", value_name = "PLATFORM=FILE")]
    binaries: Vec<String>,
    /// Build and pack the library for old Linux (glibc 2.17) and Windows too; says what to install for it
    #[arg(long, conflicts_with = "binaries")]
    all_platforms: bool,
    /// Folder of libraries that lie ready, DIR/PLATFORM/LIBRARY as in an FMU's binaries/ (default: lib/platforms beside
    /// the command, or those that --all-platforms has left)
    #[arg(long, value_name = "DIR", conflicts_with_all = ["binaries", "all_platforms"])]
    platforms: Option<PathBuf>,
    #[command(flatten)]
    form: Form,
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let pair = |s: &String| {
        let (name, value) = s.split_once('=').with_context(|| format!("--set {s}: give NAME=VALUE"))?;
        Ok((name.trim().to_string(), value.trim().to_string()))
    };
    let o = Options {
        model: a.model.clone(),
        out: a.out.clone(),
        starts: a.starts.iter().map(pair).collect::<Result<_>>()?,
        binaries: a.binaries.clone(),
        all_platforms: a.all_platforms,
        platforms: a.platforms.clone(),
    };
    let done = packed(&o)?;
    done.kept.iter().for_each(|k| print::warning(k));
    print::beside(&a.form.of(&done, |p| format!("{}: {}\n", p.fmu.shown(), p.platforms.join(", ")))?);
    Ok(ExitCode::SUCCESS)
}
