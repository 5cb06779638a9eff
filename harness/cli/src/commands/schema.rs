//! `touchdown schema`.

use crate::print;
use anyhow::Result;
use clap::ValueEnum;
use schemars::schema_for;
use serde_json::Value;
use std::process::ExitCode;

const EXAMPLES: &str = "Examples:
  touchdown schema recordings > recordings.schema.json
  touchdown schema scenario > scenario.schema.json   # and \"#:schema scenario.schema.json\" on a file's first line";

/// A file that engineers write.
#[derive(Clone, Copy, ValueEnum)]
enum Format {
    /// campaign.toml of a campaign of recordings
    Recordings,
    /// A drop test or a contactor's opening, as `touchdown run` takes it
    Scenario,
    /// A system of FMUs, as `touchdown run` takes it
    System,
}

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// The file that the schema is of
    format: Format,
}

/// The JSON schema of a format.
fn schema(format: Format) -> Value {
    match format {
        Format::Recordings => record::schema(&mechanisms::terms()),
        Format::Scenario => schema_for!(scenario::Scenario).to_value(),
        Format::System => schema_for!(host::master::System).to_value(),
    }
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    print::answer(&format!("{}\n", serde_json::to_string_pretty(&schema(a.format))?))?;
    Ok(ExitCode::SUCCESS)
}
