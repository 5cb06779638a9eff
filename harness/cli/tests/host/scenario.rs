//! Scenarios on somebody else's FMU, by each coupling, through the command.

use crate::spring;
use serde_json::Value;
use std::f64::consts::PI;
use std::path::Path;
use std::process::{Command, Output};

const RATE: f64 = 2000.0;
const SPEED: f64 = 0.1;

fn scenario(more: &str) -> String {
    format!(
        "kind = \"drop_test\"\nmass = 1.0\nimpact_speed = {SPEED:?}\n[contact]\nfmu = \"spring.fmu\"\n\
         variables = {{ penetration = \"depth\", velocity = \"speed\", force = \"push\" }}\n{more}\n"
    )
}

fn run(dir: &Path, text: &str) -> Output {
    std::fs::write(dir.join("s.toml"), text).unwrap();
    let mut c = Command::new(env!("CARGO_BIN_EXE_touchdown"));
    c.arg("run").arg(dir.join("s.toml")).arg("--out").arg(dir.join("out")).output().unwrap()
}

/// The only run's summary.
fn ran(flags: &str, output: &str, more: &str) -> Value {
    let dir = tempfile::tempdir().unwrap();
    spring::write(dir.path(), &spring::description(flags, output));
    let o = run(dir.path(), &scenario(more));
    assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
    let v: Value = serde_json::from_slice(&std::fs::read(dir.path().join("out/summary.json")).unwrap()).unwrap();
    v["runs"][0].clone()
}

fn impact(v: &Value, name: &str) -> f64 {
    v["impacts"][0][name].as_f64().unwrap()
}

/// Half a period of the undamped spring.
fn holds(v: &Value, tolerance: f64) {
    let w = RATE.sqrt();
    for (name, wanted) in [
        ("deepest", SPEED / w),
        ("peak_force", SPEED * w),
        ("duration", PI / w),
        ("restitution", 1.0),
        ("impulse", 2.0 * SPEED),
    ] {
        let got = impact(v, name);
        assert!((got / wanted - 1.0).abs() < tolerance, "{name}: {got} for {wanted}");
    }
}

#[test]
fn a_force_that_follows_at_once_gives_half_a_period() {
    let v = ran(spring::ALL, r#"dependencies="1 2""#, "parameters = { rate = 2000.0, direct = 1 }");
    holds(&v, 1e-8);
    assert!(v["element"].as_str().unwrap().contains("Acme.Spring"));
    // nothing is known of its law, and it reports no energy
    assert!(v["impacts"][0].get("exact").is_none() && v["energy"]["residual"].is_null());
}

#[test]
fn a_force_that_must_be_stepped_for_is_tried_out() {
    holds(&ran(spring::ALL, r#"dependencies="""#, "parameters = { rate = 2000.0 }"), 1e-5);
}

#[test]
fn a_held_force_gains_the_energy_it_must() {
    for step in [4e-4, 2e-4] {
        let more = format!("parameters = {{ rate = 2000.0 }}\nmacro_step = {step:?}");
        let v = ran("", r#"dependencies="1 2""#, &more);
        let gain = impact(&v, "restitution").ln() / (PI / 4.0 * step * RATE.sqrt());
        assert!((gain - 1.0).abs() < 0.1, "{step}: {gain}");
    }
}

#[test]
fn a_contact_that_asks_for_the_end_ends_the_run_with_its_results() {
    let dir = tempfile::tempdir().unwrap();
    spring::write(dir.path(), &spring::description("", r#"dependencies="1 2""#));
    // the spring discards every step where it misbehaves so, and answers fmi2Terminated with true
    let o = run(dir.path(), &scenario("parameters = { rate = 2000.0, misbehave = 1 }\nmacro_step = 1e-3"));
    let said = format!("{}{}", String::from_utf8_lossy(&o.stdout), String::from_utf8_lossy(&o.stderr));
    assert_eq!(o.status.code(), Some(0), "{said}");
    assert!(said.contains("asked for the end at ") && dir.path().join("out/results.csv").exists(), "{said}");
}

#[test]
fn what_an_fmu_lacks_is_told_with_the_cure() {
    let dir = tempfile::tempdir().unwrap();
    spring::write(dir.path(), &spring::description("", r#"dependencies="1 2""#));
    let able = scenario("parameters = { rate = 2000.0 }");
    for (text, words) in [
        (able.clone(), vec!["s.toml", "spring.fmu", "canGetAndSetFMUstate", "macro-step"]),
        (able.replace("\"depth\"", "\"gap\""), vec!["gap", "depth", "speed"]),
        (able.replace("rate =", "ratio ="), vec!["ratio", "rate"]),
        (able.clone() + "hysteresis_damping = 1.0", vec!["hysteresis_damping", "rate"]),
        (able.clone() + "macro_step = 0.0", vec!["s.toml:8: [contact] macro_step", "above 0"]),
        (able.replace("spring.fmu", "string.fmu"), vec!["s.toml:5: [contact] fmu", "string.fmu", "path"]),
        (
            able.replace("fmu = \"spring.fmu\"", "stiffness = 1e3\nexponent = 1.0"),
            vec!["s.toml:7: [contact] variables", "fmu"],
        ),
    ] {
        let o = run(dir.path(), &text);
        let e = String::from_utf8_lossy(&o.stderr).into_owned();
        assert_eq!(o.status.code(), Some(2), "{text}\n{e}");
        assert!(words.iter().all(|w| e.contains(w)), "{words:?} in {e}");
        assert!(!dir.path().join("out").exists());
    }
}
