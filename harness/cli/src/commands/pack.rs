//! `touchdown pack`.

use anyhow::{Context, Result};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(clap::Args)]
pub struct Arguments {
    /// What to pack: contact (the element) or moving-bar (a bar with spring and magnet, the element's partner)
    #[arg(long, default_value = "contact")]
    model: String,
    /// The FMU to write
    #[arg(long)]
    out: PathBuf,
    /// Start value of a parameter, NAME=VALUE; may be given again
    #[arg(long = "set", value_name = "NAME=VALUE")]
    starts: Vec<String>,
    /// Library to pack, PLATFORM=FILE, instead of this machine's; may be given again
    #[arg(long = "binary", value_name = "PLATFORM=FILE")]
    binaries: Vec<String>,
    /// Build and pack the library for old Linux (glibc 2.17) and Windows too; says what to install for it
    #[arg(long, conflicts_with = "binaries")]
    all_platforms: bool,
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let model = pack::Model::named(&a.model)?;
    let starts = a
        .starts
        .iter()
        .map(|s| {
            let (name, value) = s.split_once('=').with_context(|| format!("--set {s}: give NAME=VALUE"))?;
            let value = value.trim().parse().with_context(|| format!("--set {s}: give a number after ="))?;
            Ok((name.trim().to_string(), value))
        })
        .collect::<Result<Vec<(String, f64)>>>()?;
    let binaries = if a.all_platforms {
        model.libraries_everywhere()?
    } else if a.binaries.is_empty() {
        vec![model.built_library()?]
    } else {
        a.binaries.iter().map(|b| pack::library(b)).collect::<Result<Vec<_>>>()?
    };
    model.pack(&a.out, &starts, &binaries)?;
    let platforms: Vec<&str> = binaries.iter().map(|b| b.platform.as_str()).collect();
    println!("{}: {}", a.out.display(), platforms.join(", "));
    Ok(ExitCode::SUCCESS)
}
