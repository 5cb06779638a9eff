//! The first command of the README, from the packed FMU to the FMU that holds the missing physics.

use std::process::Command;

#[test]
fn every_step_of_the_demo_leaves_its_picture_and_the_last_fmu_holds_what_was_found() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("demo");
    let run = || Command::new(env!("CARGO_BIN_EXE_touchdown")).args(["demo", "--out"]).arg(&out).output().unwrap();
    let o = run();
    assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
    let index = std::fs::read_to_string(out.join("index.html")).unwrap();
    assert_eq!(index.matches("<svg class=\"chart\"").count(), 6, "a picture a step but packing");
    let verdict = std::fs::read_to_string(out.join("diagnosis/bench_drop/verdict.json")).unwrap();
    let verdict: serde_json::Value = serde_json::from_str(&verdict).unwrap();
    assert_eq!(verdict["missing"].as_array().unwrap().len(), 1);
    assert_eq!(verdict["missing"][0]["mechanism"], "plastic_indentation");
    let nrmse = |part: &str| verdict["fit"][part]["heldout_nrmse"].as_f64().unwrap();
    assert!(nrmse("after") < 0.6 * nrmse("before"));
    let summary = std::fs::read_to_string(out.join("same_drops/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let element = summary["runs"][0]["element"].as_str().unwrap();
    assert!(element.contains("diagnosis/bench_drop/HysteresisContact.fmu"), "{element}");
    let answer = out.join("fmus/bench_contactor");
    let verdict = std::fs::read_to_string(answer.join("verdict.json")).unwrap();
    let verdict: serde_json::Value = serde_json::from_str(&verdict).unwrap();
    assert_eq!(verdict["missing"].as_array().unwrap().len(), 1);
    assert_eq!(verdict["missing"][0]["mechanism"], "adhesion");
    assert_eq!(verdict["mismatch"]["where"][0]["bond"], "stop");
    assert!(answer.join("system/system.toml").exists() && answer.join("system/system.ssp").exists());
    // a spring drives this bar: by the impulse alone it would leave faster than it came
    let page = std::fs::read_to_string(answer.join("report.html")).unwrap();
    let (_, chart) = page.split_once("<title>Restitution: restitution over speed at touch</title>").unwrap();
    let (_, measured) = chart.split_once("measured: least ").unwrap();
    let least: f64 = measured.split(' ').next().unwrap().parse().unwrap();
    assert!((0.9..0.96).contains(&least), "{least}");
}

#[test]
fn a_folder_of_somebody_elses_files_is_left_alone() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("thesis.txt"), "mine").unwrap();
    let o = Command::new(env!("CARGO_BIN_EXE_touchdown")).args(["demo", "--out"]).arg(dir.path()).output().unwrap();
    assert_eq!(o.status.code(), Some(2));
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
}
