//! `touchdown mechanisms`.

use super::form::Form;
use crate::print;
use anyhow::{bail, Result};
use mechanisms::catalogue::{catalogue, Entry, Quantity};
use serde::Serialize;
use std::process::ExitCode;

#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum Format {
    /// For a terminal
    Text,
    /// A table for documentation
    Markdown,
    /// For programs
    Json,
}

const EXAMPLES: &str = "Examples:
  touchdown mechanisms                                   # all of them
  touchdown mechanisms guide_friction attached_mass
  touchdown mechanisms --json > mechanisms.json";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Mechanisms to print (default: all)
    names: Vec<String>,
    /// How they are printed
    #[arg(long, value_enum, default_value = "text", conflicts_with = "json")]
    format: Format,
    #[command(flatten)]
    form: Form,
}

fn quantities(e: &Entry) -> String {
    let all: Vec<String> = e
        .quantities
        .iter()
        .map(|q| if q.unit == "1" { q.name.to_string() } else { format!("{} [{}]", q.name, q.unit) })
        .collect();
    all.join(", ")
}

fn text(e: &Entry) -> String {
    let m = e.mechanism;
    let kinds: Vec<&str> = e.kinds.iter().map(|k| k.name()).collect();
    let keys: Vec<&str> = e.keys.iter().map(|k| k.name).collect();
    let scenario =
        if keys.is_empty() { String::new() } else { format!("  scenario: [motion.{}] {}\n", m.name, keys.join(", ")) };
    format!(
        "{} ({})\n  {}\n  {}\n  quantities: {}\n  forms: {}\n  shown by: {}\n{scenario}  source: {}\n",
        m.name,
        m.origin.name(),
        m.sentence,
        m.equation,
        quantities(e),
        e.forms.join("; "),
        kinds.join(", "),
        m.source
    )
}

fn markdown(table: &[Entry]) -> String {
    let mut s = String::from("| mechanism | origin | equation | quantities | source |\n|---|---|---|---|---|\n");
    for e in table {
        let m = e.mechanism;
        let cell = |t: &str| t.replace('|', "\\|");
        s += &format!(
            "| `{}` | {} | {} | {} | {} |\n",
            m.name,
            m.origin.name(),
            cell(m.equation),
            quantities(e),
            cell(m.source)
        );
    }
    s
}

/// A mechanism for programs.
#[derive(Serialize)]
struct Listed<'a> {
    name: &'a str,
    origin: &'a str,
    sentence: &'a str,
    equation: &'a str,
    source: &'a str,
    forms: &'a [&'static str],
    kinds: Vec<&'a str>,
    scenario_keys: Vec<&'a str>,
    quantities: &'a [Quantity],
}

fn listed(e: &Entry) -> Listed<'_> {
    let m = e.mechanism;
    Listed {
        name: m.name,
        origin: m.origin.name(),
        sentence: m.sentence,
        equation: m.equation,
        source: m.source,
        forms: &e.forms,
        kinds: e.kinds.iter().map(|k| k.name()).collect(),
        scenario_keys: e.keys.iter().map(|k| k.name).collect(),
        quantities: &e.quantities,
    }
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let mut table = catalogue();
    for name in &a.names {
        if table.iter().all(|e| e.mechanism.name != name) {
            let all: Vec<&str> = table.iter().map(|e| e.mechanism.name).collect();
            bail!("{name} is no mechanism; {}", record::words::instead(name, &all));
        }
    }
    table.retain(|e| a.names.is_empty() || a.names.iter().any(|n| n == e.mechanism.name));
    let form = if a.format == Format::Json { Form { json: true } } else { a.form };
    let all: Vec<Listed<'_>> = table.iter().map(listed).collect();
    let words = |_: &Vec<Listed<'_>>| match a.format {
        Format::Markdown => markdown(&table),
        _ => table.iter().map(text).collect::<Vec<_>>().join("\n"),
    };
    print::answer(&form.of(&all, words)?)?;
    Ok(ExitCode::SUCCESS)
}
