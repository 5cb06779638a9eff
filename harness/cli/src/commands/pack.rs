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
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let model = pack::Model::named(&a.model)?;
    let starts = a
        .starts
        .iter()
        .map(|s| {
            let (name, value) = s.split_once('=').with_context(|| format!("--set {s}: give NAME=VALUE"))?;
            let name = name.trim();
            let value = model.number(name, value.trim()).with_context(|| format!("--set {s}"))?;
            Ok((name.to_string(), value))
        })
        .collect::<Result<Vec<(String, f64)>>>()?;
    let binaries = if a.all_platforms {
        model.libraries_everywhere()?
    } else if a.binaries.is_empty() {
        model.libraries(a.platforms.as_deref())?
    } else {
        a.binaries.iter().map(|b| pack::library(b)).collect::<Result<Vec<_>>>()?
    };
    model.pack(&a.out, &starts, &binaries)?;
    let platforms: Vec<&str> = binaries.iter().map(|b| b.platform.as_str()).collect();
    println!("{}: {}", a.out.display(), platforms.join(", "));
    Ok(ExitCode::SUCCESS)
}
