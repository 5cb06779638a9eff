//! A drop test by `touchdown run` beside the same one in Python.

use super::{cpu_seconds, taken, Pair, Python, FMPY_SIDE};
use anyhow::{ensure, Context, Result};
use scenario::{simulate, Scenario, Source, Through, GRAVITY};
use serde_json::Value;
use std::hint::black_box;
use std::path::Path;
use std::process::{Command, Stdio};

/// What both sides came to.
pub struct DropTest {
    /// CPU ms to load the FMU and step it through the test, nothing written, imports done.
    pub inside: Pair,
    /// CPU ms of a process from its start to its end: `touchdown run` with results and report, a Python with results.
    pub process: Pair,
    /// Figures of the last impact: name, ours, theirs.
    pub figures: Vec<(&'static str, f64, f64)>,
}

impl DropTest {
    /// Impacts in the test.
    pub const IMPACTS: usize = 3;
    /// Relative tolerance of both integrators.
    pub const TOLERANCE: f64 = 1e-11;
}

/// Relative difference of the sides' last impacts beyond which they did not run the same test.
const AGREEMENT: f64 = 1e-6;
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

/// Loads `fmu` and steps it through the scenario; CPU ms.
fn inside(scenario: &Scenario, fmu: &Path) -> Result<f64> {
    let start = cpu_seconds();
    for mut case in scenario.cases() {
        let (mut element, _) = Source::default().element(&Through::Fmu(fmu.into()), &mut case)?;
        black_box(simulate(&case, element.as_mut(), &mut |_| true)?);
    }
    Ok((cpu_seconds() - start) * 1e3)
}

/// Runs the drop test on both sides, `rounds` times in turn, in `folder`; `side` is [`FMPY_SIDE`] started with `fmu`
/// in `python`.
///
/// # Errors
/// Where the command, its answer or Python fails; sides that do not come to the same last impact.
pub fn drop_test(fmu: &Path, python: &Path, side: &mut Python, folder: &Path, rounds: usize) -> Result<DropTest> {
    let path = folder.join("bench.toml");
    let contact: String = CONTACT.iter().map(|(n, x)| format!("{n} = {x:e}\n")).collect();
    let text = format!(
        "kind = \"drop_test\"\nmass = {MASS:?}\ndrop_height = {HEIGHT:?}\ngravity = true\nimpacts = {}\n\n[contact]\n{contact}",
        DropTest::IMPACTS
    );
    std::fs::write(&path, text)?;
    let scenario = Scenario::load(&path)?;
    let program = std::env::current_exe().context("the program's own path is not known")?;
    let out = folder.join("run");
    let question = serde_json::json!({
        "mass": MASS,
        "gravity": GRAVITY,
        "drop_height": HEIGHT,
        "impacts": DropTest::IMPACTS,
        "tolerance": DropTest::TOLERANCE,
        "contact": CONTACT.iter().map(|(n, x)| (n.to_string(), Value::from(*x))).collect::<serde_json::Map<_, _>>(),
        "out": folder.join("python.csv"),
    })
    .to_string();
    let mut test = DropTest { inside: Pair::default(), process: Pair::default(), figures: Vec::new() };
    let mut theirs = Vec::new();
    // the first of each warms files and caches and does not count
    for round in 0..=rounds {
        let ours = inside(&scenario, fmu)?;
        theirs = side.ask(&format!("drop {question}"))?;
        let here = taken(
            Command::new(&program)
                .arg("run")
                .arg(&path)
                .arg("--out")
                .arg(&out)
                .arg("--fmu")
                .arg(fmu)
                .stdout(Stdio::null()),
        )?;
        let there = taken(Command::new(python).args(["-c", FMPY_SIDE]).arg(fmu).arg(&question).stdout(Stdio::null()))?;
        if round > 0 {
            test.inside.rounds.push((ours, theirs[0] * 1e3));
            test.process.rounds.push((here.cpu * 1e3, there.cpu * 1e3));
        }
    }
    let names = ["deepest", "restitution", "duration"];
    let path = out.join("summary.json");
    let summary: Value = serde_json::from_slice(&std::fs::read(&path)?)?;
    let last = last_with(&summary, &names).with_context(|| format!("{}: no impact in it", path.display()))?;
    test.figures = names
        .iter()
        .enumerate()
        .map(|(i, n)| (*n, last[*n].as_f64().unwrap_or(f64::NAN), theirs.get(i + 1).copied().unwrap_or(f64::NAN)))
        .collect();
    for (name, x, y) in &test.figures {
        ensure!(
            (x - y).abs() <= AGREEMENT * y.abs(),
            "the sides do not run the same: {name} is {x} here, {y} in Python"
        );
    }
    Ok(test)
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
