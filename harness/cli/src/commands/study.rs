//! `touchdown study`.

use anyhow::{Context, Result};
use std::path::PathBuf;
use std::process::ExitCode;
use touchdown::progress::Progress;
use touchdown::study::coupling;

#[derive(clap::Args)]
pub struct Arguments {
    #[command(subcommand)]
    study: Which,
}

#[derive(clap::Subcommand)]
enum Which {
    /// Error of an impact against macro-steps a contact, for every master and lookahead
    Coupling {
        /// Folder for coupling.md, coupling.csv, coupling.json and coupling.svg
        #[arg(long)]
        out: PathBuf,
    },
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let Which::Coupling { out } = &a.study;
    let progress = Progress::new("study", coupling::setups().len() as u64);
    let study = coupling::study(&|| progress.add(1))?;
    drop(progress);
    let table = study.markdown();
    let json = serde_json::to_string_pretty(&study)? + "\n";
    for (name, text) in [
        ("coupling.md", &table),
        ("coupling.csv", &study.csv()),
        ("coupling.json", &json),
        ("coupling.svg", &study.picture()),
    ] {
        let path = out.join(name);
        output::write(&path, text.as_bytes()).with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    print!("{table}");
    Ok(ExitCode::SUCCESS)
}
