//! `touchdown study`.

use crate::print;
use crate::progress::Progress;
use crate::study::coupling;
use anyhow::Result;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const EXAMPLES: &str = "Examples:
  touchdown study coupling --out coupling                # tables, a picture, and the figures as CSV and JSON
  touchdown study coupling --out coupling > coupling.md";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    #[command(subcommand)]
    study: Which,
}

#[derive(clap::Subcommand)]
enum Which {
    /// Error of an impact against macro-steps a contact, for every master and lookahead
    #[command(after_help = EXAMPLES)]
    Coupling {
        /// Folder for coupling.md, coupling.csv, coupling.json and coupling.svg
        #[arg(long)]
        out: PathBuf,
    },
}

impl Arguments {
    /// Where the study's files go.
    pub fn out(&self) -> &Path {
        let Which::Coupling { out } = &self.study;
        out
    }
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let out = a.out();
    let progress = Progress::new("study", coupling::setups().len() as u64);
    let study = coupling::study(&|| progress.add(1))?;
    drop(progress);
    let table = study.markdown();
    let json = serde_json::to_string_pretty(&study)? + "\n";
    let (csv, picture) = (study.csv(), study.picture());
    let files = [
        ("coupling.md", table.as_bytes()),
        ("coupling.csv", csv.as_bytes()),
        ("coupling.json", json.as_bytes()),
        ("coupling.svg", picture.as_bytes()),
    ];
    print::warnings(&crate::place::write(out, "study", &files)?);
    print::beside(&table);
    Ok(ExitCode::SUCCESS)
}
