//! A drop test by `touchdown run` beside the same one in Python.

use super::{Pair, Python};
use anyhow::{bail, Context, Result};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;

/// What both sides came to.
pub struct DropTest {
    /// Milliseconds: `touchdown run` as a process from its start to its end, with the FMU packed and unpacked, results
    /// and report written; Python inside a process that has its imports behind it, with results written.
    pub time: Pair,
    /// Figures of the last impact: name, ours, theirs.
    pub figures: Vec<(&'static str, f64, f64)>,
}

impl DropTest {
    /// Impacts in the test.
    pub const IMPACTS: usize = 3;
    /// Relative tolerance of both integrators.
    pub const TOLERANCE: f64 = 1e-11;
}

const MASS: f64 = 1.0;
const HEIGHT: f64 = 0.02;
const CONTACT: [(&str, f64); 3] = [("stiffness", 1e8), ("exponent", 1.5), ("hysteresis_damping", 3e7)];

/// The last object below `v` that has all of `keys`.
fn last_with<'a>(v: &'a Value, keys: &[&str]) -> Option<&'a Value> {
    match v {
        Value::Object(m) if keys.iter().all(|k| m.get(*k).is_some_and(Value::is_number)) => Some(v),
        Value::Object(m) => m.values().filter_map(|v| last_with(v, keys)).next_back(),
        Value::Array(a) => a.iter().filter_map(|v| last_with(v, keys)).next_back(),
        _ => None,
    }
}

/// Runs the drop test on both sides, `rounds` times in turn, in `folder`; `told` hears after each.
///
/// # Errors
/// Where the command, its answer or Python fails.
pub fn drop_test(
    fmu: &Path,
    python: &mut Python,
    folder: &Path,
    rounds: usize,
    mut told: impl FnMut(),
) -> Result<DropTest> {
    let scenario = folder.join("bench.toml");
    let contact: String = CONTACT.iter().map(|(n, x)| format!("{n} = {x:e}\n")).collect();
    let text = format!(
        "kind = \"drop_test\"\nmass = {MASS:?}\ndrop_height = {HEIGHT:?}\ngravity = true\nimpacts = {}\n\n[contact]\n{contact}",
        DropTest::IMPACTS
    );
    std::fs::write(&scenario, text)?;
    let program = std::env::current_exe().context("the program's own path is not known")?;
    let (out, csv) = (folder.join("run"), folder.join("python.csv"));
    let question = serde_json::json!({
        "mass": MASS,
        "drop_height": HEIGHT,
        "impacts": DropTest::IMPACTS,
        "tolerance": DropTest::TOLERANCE,
        "contact": CONTACT.iter().map(|(n, x)| (n.to_string(), Value::from(*x))).collect::<serde_json::Map<_, _>>(),
        "out": csv,
    });
    let mut time = Pair::default();
    let mut theirs = Vec::new();
    // the first of each warms files and caches and does not count
    for round in 0..=rounds {
        let start = Instant::now();
        let done = Command::new(&program)
            .args(["run".as_ref(), scenario.as_os_str(), "--out".as_ref(), out.as_os_str()])
            .args(["--fmu".as_ref(), fmu.as_os_str()])
            .stdout(Stdio::null())
            .status()?;
        let ours = start.elapsed().as_secs_f64() * 1e3;
        if !done.success() {
            bail!("touchdown run failed; its words are above");
        }
        theirs = python.ask(&format!("drop {question}"))?;
        if round > 0 {
            time.rounds.push((ours, theirs[0] * 1e3));
            told();
        }
    }
    let names = ["deepest", "peak_force", "restitution", "duration"];
    let path = out.join("summary.json");
    let summary: Value = serde_json::from_slice(&std::fs::read(&path)?)?;
    let last = last_with(&summary, &names).with_context(|| format!("{}: no impact in it", path.display()))?;
    let figures = names
        .iter()
        .enumerate()
        .map(|(i, n)| (*n, last[*n].as_f64().unwrap_or(f64::NAN), theirs.get(i + 1).copied().unwrap_or(f64::NAN)))
        .collect();
    Ok(DropTest { time, figures })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_impact_is_found_at_any_depth() {
        let v = serde_json::json!({"runs": [{"impacts": [{"deepest": 1.0, "e": 2.0}, {"deepest": 3.0, "e": 4.0}]}], "e": 5.0});
        assert_eq!(last_with(&v, &["deepest", "e"]).unwrap()["deepest"], 3.0);
        assert!(last_with(&v, &["absent"]).is_none());
    }
}
