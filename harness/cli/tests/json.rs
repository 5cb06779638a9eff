//! `--json`: the answer as JSON on standard output, the same as in the files; errors stay text on standard error.

use plant::recipe::{write_campaign, Recipe};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn run(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_touchdown")).args(arguments).current_dir(folder).output().unwrap()
}

/// The answer of a command that has to succeed.
fn answer(arguments: &[&str], folder: &Path) -> Value {
    let o = run(arguments, folder);
    assert!(o.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&o.stderr));
    serde_json::from_slice(&o.stdout).unwrap_or_else(|e| panic!("{arguments:?}: {e}"))
}

fn words(arguments: &[&str], folder: &Path) -> String {
    String::from_utf8(run(arguments, folder).stdout).unwrap()
}

fn written(path: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// A folder with the campaign `c`, of few samples.
fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    write_campaign(&dir.path().join("c"), &Recipe { samples: 250, interval: 2.8e-5, ..Recipe::default() }).unwrap();
    dir
}

#[test]
fn an_impact_has_the_figures_that_are_printed() {
    let dir = tempfile::tempdir().unwrap();
    let plain = ["impact", "--mass", "0.5", "--speed", "0.8", "--stiffness", "2e7", "--restitution", "0.7"];
    let v = answer(&[&plain[..], &["--json"]].concat(), dir.path());
    let said = words(&plain, dir.path());
    for key in ["hysteresis_damping", "deepest", "peak_force", "duration", "energy_lost", "impulse"] {
        assert!(said.contains(&format!("{:.15e}", v[key].as_f64().unwrap())), "{key}: {said}");
    }
    assert!((v["restitution"].as_f64().unwrap() - 0.7).abs() < 1e-9);
}

#[test]
fn check_tells_programs_what_is_understood_and_what_is_wrong() {
    let dir = folder();
    let v = answer(&["check", "c", "--json"], dir.path());
    assert_eq!(v[0]["kind"], "drop-test");
    assert_eq!(v[0]["recordings"].as_array().unwrap().len(), 10);
    assert_eq!(v[0]["recordings"][0]["samples"], 250);
    assert_eq!(v[0]["noise"].as_array().unwrap().len(), 3);
    let path = dir.path().join("c/r03.csv");
    let text = std::fs::read_to_string(&path).unwrap().replace("force [N]", "force [kN]");
    std::fs::write(path, text).unwrap();
    let o = run(&["check", "c", "--json"], dir.path());
    assert_eq!(o.status.code(), Some(2));
    let v: Value = serde_json::from_slice(&o.stdout).unwrap();
    let reported = v[0]["errors"][0].as_str().unwrap();
    assert!(reported.contains("r03.csv") && String::from_utf8_lossy(&o.stderr).contains(&format!("error: {reported}")));
}

#[test]
fn a_run_prints_its_summary_and_packing_what_it_packed() {
    let dir = tempfile::tempdir().unwrap();
    let scenario = format!("{}/../examples/drop_test.toml", env!("CARGO_MANIFEST_DIR"));
    let v = answer(&["run", &scenario, "--direct", "--out", "run", "--json"], dir.path());
    assert_eq!(v, written(&dir.path().join("run/summary.json")));
    let v = answer(&["pack", "--out", "a.fmu", "--set", "stiffness=2e6", "--json"], dir.path());
    assert_eq!((v["fmu"].as_str(), v["starts"]["stiffness"].as_f64()), (Some("a.fmu"), Some(2e6)));
    assert!(!v["platforms"].as_array().unwrap().is_empty());
}

#[test]
fn a_diagnosis_prints_its_verdicts_and_a_fit_its_certificate() {
    let dir = folder();
    let v = answer(&["diagnose", "c", "--out", "answer", "--json", "--quiet"], dir.path());
    assert_eq!(v[0]["verdict"], written(&dir.path().join("answer/c/verdict.json")));
    assert_eq!(v[0]["answer"], "answer/c");
    let v = answer(&["fit", "c", "--out", "fit", "--json"], dir.path());
    assert_eq!(v["fit"], written(&dir.path().join("fit/fit.json")));
    assert_eq!(v["certificate"], written(&dir.path().join("fit/certificate.json")));
}

#[test]
fn import_tells_what_a_file_holds_and_what_was_taken() {
    let dir = folder();
    let v = answer(&["import", "--list", "c/r01.csv", "--json"], dir.path());
    let channels = v[0]["groups"][0]["channels"].as_array().unwrap();
    assert_eq!(channels.len(), 4);
    assert_eq!((channels[1]["name"].as_str(), channels[1]["unit"].as_str()), (Some("force"), Some("N")));
    let v = answer(&["import", "c/r01.csv", "--height", "5mm", "--mass", "0.5", "--out", "i", "--json"], dir.path());
    assert_eq!((v["kind"].as_str(), v["recordings"].as_array().unwrap().len()), (Some("drop-test"), 1));
    assert!(dir.path().join("i").join(v["recordings"][0]["recording"].as_str().unwrap()).exists());
}

#[test]
fn mechanisms_and_comparisons_are_data() {
    let dir = folder();
    let v = answer(&["mechanisms", "--json"], dir.path());
    assert_eq!(v, answer(&["mechanisms", "--format", "json"], dir.path()));
    assert!(v.as_array().unwrap().iter().any(|m| m["name"] == "guide_friction" && m["quantities"][0]["unit"] == "N"));
    let v = answer(&["compare", "c/r01.csv", "c/r02.csv", "--json"], dir.path());
    assert_eq!(v["channels"].as_array().unwrap().len(), 3);
}

#[test]
fn errors_stay_text_and_quiet_leaves_them() {
    let dir = folder();
    for more in [&["--json"][..], &["--json", "--quiet"]] {
        let o = run(&[&["fit", "none", "--out", "o"][..], more].concat(), dir.path());
        assert_eq!((o.status.code(), o.stdout.len()), (Some(2), 0));
        assert!(String::from_utf8_lossy(&o.stderr).starts_with("error: "));
    }
}

#[test]
fn quiet_leaves_out_warnings_and_nothing_of_the_answer() {
    let dir = folder();
    // a row twice, which is merged with a note
    let path = dir.path().join("c/r01.csv");
    let mut lines: Vec<String> = std::fs::read_to_string(&path).unwrap().lines().map(str::to_string).collect();
    lines.insert(50, lines[50].clone());
    std::fs::write(&path, lines.join("\n") + "\n").unwrap();
    let reported = |more: &[&str]| {
        let o = run(&[&["fit", "c", "--out", "fit"][..], more].concat(), dir.path());
        assert!(o.status.success());
        (String::from_utf8(o.stdout).unwrap(), String::from_utf8(o.stderr).unwrap())
    };
    let (loud, quiet) = (reported(&[]), reported(&["--quiet"]));
    assert!(loud.1.contains("warning: c: "), "{}", loud.1);
    assert_eq!((quiet.1.as_str(), quiet.0), ("", loud.0));
}
