//! `touchdown export-ssp`.

use super::fmus::Fmus;
use crate::place;
use crate::print::{self, Shown};
use anyhow::Result;
use host::master::{export_ssp, System};
use std::path::PathBuf;
use std::process::ExitCode;

const EXAMPLES: &str = "Examples:
  touchdown export-ssp harness/examples/contactor_system.toml --out contactor.ssp
  touchdown export-ssp machine.toml --out machine.ssp    # then: touchdown run machine.ssp --out machine";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct ExportArguments {
    /// System file (TOML) or SSP archive
    system: PathBuf,
    /// The archive to write
    #[arg(long)]
    pub out: PathBuf,
    #[command(flatten)]
    fmus: Fmus,
}

pub fn export(a: &ExportArguments) -> Result<ExitCode> {
    let mut s = System::load(&a.system)?;
    s.isolation = a.fmus.isolation()?;
    place::is_none_of(&a.out, s.fmus().chain([a.system.clone()]))?;
    for note in export_ssp(&s, &a.out)? {
        print::warning(&note);
    }
    print::beside(&format!("{}\n", a.out.shown()));
    Ok(ExitCode::SUCCESS)
}
