//! A reader that has gone, as `| head -1` does: what only prints ends quietly as other Unix tools do, what writes files goes
//! on.

use plant::recipe::{write_campaign, Recipe};
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// Runs with a standard output that nobody reads.
fn unread(arguments: &[&str], folder: &Path) -> (Option<i32>, String) {
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let o: Output = Command::new(env!("CARGO_BIN_EXE_touchdown"))
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::from(writer))
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    (o.status.code(), String::from_utf8_lossy(&o.stderr).into_owned())
}

fn folder() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    write_campaign(&dir.path().join("c"), &Recipe::default()).unwrap();
    dir
}

#[test]
fn what_only_prints_ends_quietly() {
    let dir = folder();
    for arguments in [
        &["impact", "--mass", "1", "--speed", "1", "--stiffness", "1e7"][..],
        &["mechanisms"],
        &["mechanisms", "--format", "json"],
        &["check", "c", "c"],
        &["compare", "c/r01.csv", "c/r02.csv"],
        &["import", "--list", "c/r01.csv"],
    ] {
        assert_eq!(unread(arguments, dir.path()), (Some(141), String::new()), "{arguments:?}");
    }
}

#[test]
fn what_writes_files_writes_them_all() {
    let dir = folder();
    let scenario = format!("{}/../examples/drop_test.toml", env!("CARGO_MANIFEST_DIR"));
    for (arguments, files) in [
        (
            &["run", &scenario, "--direct", "--out", "run"][..],
            &["run/results.csv", "run/summary.json", "run/report.html"][..],
        ),
        (&["init", "other", "--kind", "drop-test"], &["other/campaign.toml"]),
        (&["import", "c/r01.csv", "--height", "5mm", "--mass", "0.5", "--out", "imported"], &["imported/import.html"]),
    ] {
        std::fs::create_dir_all(dir.path().join("other")).unwrap();
        std::fs::copy(dir.path().join("c/r01.csv"), dir.path().join("other/r01.csv")).unwrap();
        let (code, err) = unread(arguments, dir.path());
        assert_eq!(code, Some(0), "{arguments:?}: {err}");
        assert!(files.iter().all(|f| dir.path().join(f).exists()), "{arguments:?}");
        assert!(!err.contains("error"), "{err}");
    }
}

#[test]
fn a_diagnosis_answers_every_campaign() {
    let dir = tempfile::tempdir().unwrap();
    // few samples: what is found does not matter here
    for name in ["a", "b"] {
        write_campaign(&dir.path().join(name), &Recipe { samples: 250, interval: 2.8e-5, ..Recipe::default() })
            .unwrap();
    }
    let (code, err) = unread(&["diagnose", "a", "b", "--out", "out"], dir.path());
    assert_eq!(code, Some(0), "{err}");
    for file in ["out/a/verdict.json", "out/b/verdict.json", "out/index.html"] {
        assert!(dir.path().join(file).exists(), "{file}: {err}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_reported() {
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let o = Command::new(env!("CARGO_BIN_EXE_touchdown")).arg("mechanisms").stdout(full).output().unwrap();
    assert_eq!(o.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&o.stderr).starts_with("error: standard output: "));
}
