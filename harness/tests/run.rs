//! `touchdown run`: golden impacts, and bad scenarios.

use std::path::Path;
use std::process::{Command, Output};

fn run(dir: &Path, text: &str) -> Output {
    let file = dir.join("s.toml");
    std::fs::write(&file, text).unwrap();
    Command::new(env!("CARGO_BIN_EXE_touchdown"))
        .arg("run")
        .arg(&file)
        .arg("--out")
        .arg(dir.join("out"))
        .output()
        .unwrap()
}

/// Golden impacts of the law F = k x^p + mu_d x^p v at 1 kg and 1 m/s: k, p, mu_d; deepest, e, duration, peak.
const GOLDEN: [[f64; 7]; 2] = [
    [3.51e10, 2.79, 2.70e10, 1.7588165601242512e-3, 0.65712174496578164, 5.8181339632048352e-3, 813.04615987599714],
    [1.85e8, 1.96, 8.77e7, 1.6803097731131710e-3, 0.75847045292087518, 5.4497898388347824e-3, 716.04884002798315],
];

#[test]
fn golden_impacts_hold_to_a_millionth() {
    for g in GOLDEN {
        let dir = tempfile::tempdir().unwrap();
        let text = format!(
            "kind = \"drop_test\"\nmass = 1.0\nimpact_speed = 1.0\n[contact]\nstiffness = {:?}\nexponent = {:?}\nhysteresis_damping = {:?}\n",
            g[0], g[1], g[2]
        );
        let o = run(dir.path(), &text);
        assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
        let json = std::fs::read_to_string(dir.path().join("out/summary.json")).unwrap();
        let v: serde_json::Value = serde_json::from_str(&json).unwrap();
        for (name, wanted) in [("deepest", g[3]), ("restitution", g[4]), ("duration", g[5]), ("peak_force", g[6])] {
            let got = v["impacts"][0][name].as_f64().unwrap();
            assert!((got / wanted - 1.0).abs() < 1e-6, "{name}: {got} for {wanted}");
        }
    }
}

#[test]
fn bad_scenarios_name_file_line_and_cure() {
    for (text, line) in [
        (
            "kind = \"drop_test\"\nmass = -1.0\nimpact_speed = 1.0\n[contact]\nstiffness = 1e8\nexponent = 1.5\n",
            "s.toml:2: mass",
        ),
        ("kind = \"drop_test\"\nmass = 1.0\nspeed = 1.0\n", "line 3"),
        (
            "kind = \"drop_test\"\nmass = 1.0\nimpact_speed = 1.0\n[contact]\nstiffness = 1e8\nexponent = 9.0\n",
            "s.toml:6: exponent",
        ),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let o = run(dir.path(), text);
        let e = String::from_utf8_lossy(&o.stderr).into_owned();
        assert_eq!(o.status.code(), Some(2), "{e}");
        assert!(e.contains(line) && e.contains("s.toml"), "{e}");
        assert!(!dir.path().join("out").exists());
    }
}

#[test]
fn the_examples_run_and_bounces_get_lower() {
    for name in ["drop_test", "contactor_opening"] {
        let dir = tempfile::tempdir().unwrap();
        let text = std::fs::read_to_string(format!("{}/examples/{name}.toml", env!("CARGO_MANIFEST_DIR"))).unwrap();
        let o = run(dir.path(), &text);
        assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
        let json = std::fs::read_to_string(dir.path().join("out/summary.json")).unwrap();
        let v: serde_json::Value = serde_json::from_str(&json).unwrap();
        let all = v["impacts"].as_array().unwrap();
        assert_eq!(all.len(), if name == "drop_test" { 1 } else { 5 });
        let speeds: Vec<f64> = all.iter().map(|b| b["impact_speed"].as_f64().unwrap()).collect();
        assert!(speeds.windows(2).all(|w| w[1] < w[0]), "{speeds:?}");
    }
}
