//! `touchdown mechanisms`.

use anyhow::{bail, Result};
use mechanisms::catalogue::{catalogue, Entry};
use std::process::ExitCode;

#[derive(Clone, Copy, clap::ValueEnum)]
enum Format {
    /// For a terminal
    Text,
    /// A table for documentation
    Markdown,
    /// For programs
    Json,
}

#[derive(clap::Args)]
pub struct Arguments {
    /// Mechanisms to print (default: all)
    names: Vec<String>,
    #[arg(long, value_enum, default_value = "text")]
    format: Format,
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

fn json(table: &[Entry]) -> Result<String> {
    let all: Vec<serde_json::Value> = table
        .iter()
        .map(|e| {
            let m = e.mechanism;
            serde_json::json!({
                "name": m.name, "origin": m.origin.name(), "sentence": m.sentence, "equation": m.equation,
                "source": m.source, "forms": e.forms, "kinds": e.kinds.iter().map(|k| k.name()).collect::<Vec<_>>(),
                "scenario_keys": e.keys.iter().map(|k| k.name).collect::<Vec<_>>(),
                "quantities": e.quantities.iter().map(|q| serde_json::json!({"name": q.name, "unit": q.unit}))
                    .collect::<Vec<_>>(),
            })
        })
        .collect();
    Ok(serde_json::to_string_pretty(&all)? + "\n")
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let mut table = catalogue();
    for name in &a.names {
        if table.iter().all(|e| e.mechanism.name != name) {
            let all: Vec<&str> = table.iter().map(|e| e.mechanism.name).collect();
            bail!("{name} is no mechanism; give one of {}", all.join(", "));
        }
    }
    table.retain(|e| a.names.is_empty() || a.names.iter().any(|n| n == e.mechanism.name));
    match a.format {
        Format::Text => print!("{}", table.iter().map(text).collect::<Vec<_>>().join("\n")),
        Format::Markdown => print!("{}", markdown(&table)),
        Format::Json => print!("{}", json(&table)?),
    }
    Ok(ExitCode::SUCCESS)
}
