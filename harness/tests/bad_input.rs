//! Bad recordings get an error that names file, line and cure, exit code 2, and nothing half-written.

use std::path::Path;
use std::process::Command;
use touchdown::demo::{write_campaign, Recipe};

fn refused(spoil: impl Fn(&Path), says: &[&str]) {
    let dir = tempfile::tempdir().unwrap();
    let campaign = dir.path().join("c");
    write_campaign(&campaign, &Recipe::default()).unwrap();
    spoil(&campaign);
    let out = dir.path().join("out");
    let run = Command::new(env!("CARGO_BIN_EXE_touchdown"))
        .arg("diagnose")
        .arg(&campaign)
        .arg("--out")
        .arg(&out)
        .output()
        .unwrap();
    let err = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(2), "{err}");
    for s in says {
        assert!(err.contains(s), "{s:?} is not in {err}");
    }
    assert!(!out.exists(), "something was written");
}

fn edit(dir: &Path, file: &str, change: impl Fn(Vec<String>) -> Vec<String>) {
    let path = dir.join(file);
    let lines: Vec<String> = std::fs::read_to_string(&path).unwrap().lines().map(str::to_string).collect();
    std::fs::write(path, change(lines).join("\n") + "\n").unwrap();
}

#[test]
fn not_a_number() {
    refused(
        |d| {
            edit(d, "r03.csv", |mut l| {
                l[100] = "1.0e-3,NaN,0,0".into();
                l
            })
        },
        &["r03.csv:101", "force", "remove the rows"],
    );
}

#[test]
fn a_gap() {
    refused(
        |d| {
            edit(d, "r02.csv", |mut l| {
                l.drain(200..260);
                l
            })
        },
        &["r02.csv:201", "gap", "cut the recording"],
    );
}

#[test]
fn time_running_backwards() {
    refused(
        |d| {
            edit(d, "r01.csv", |mut l| {
                l.swap(50, 51);
                l
            })
        },
        &["r01.csv:52", "time does not increase"],
    );
}

#[test]
fn a_unit_of_another_kind() {
    refused(
        |d| {
            edit(d, "r01.csv", |mut l| {
                l[0] = l[0].replace("[N]", "[mm]");
                l
            })
        },
        &["r01.csv:1", "mm", "does not measure force"],
    );
}

#[test]
fn three_samples() {
    refused(
        |d| {
            edit(d, "r04.csv", |mut l| {
                l.truncate(4);
                l
            })
        },
        &["r04.csv", "3 samples are too few"],
    );
}

#[test]
fn a_recording_of_nothing() {
    refused(
        |d| {
            edit(d, "r05.csv", |l| {
                l.into_iter()
                    .enumerate()
                    .map(|(i, s)| if i == 0 { s } else { format!("{},0,0,0", s.split(',').next().unwrap()) })
                    .collect()
            })
        },
        &["r05.csv", "no impact"],
    );
}

#[test]
fn a_file_that_is_not_there() {
    refused(|d| std::fs::remove_file(d.join("r07.csv")).unwrap(), &["r07.csv", "cannot be read"]);
}

#[test]
fn a_mass_that_is_none() {
    refused(
        |d| {
            edit(d, "campaign.toml", |l| {
                l.into_iter()
                    .map(|s| if s.starts_with("moving_mass") { "moving_mass = -1.0".into() } else { s })
                    .collect()
            })
        },
        &["campaign.toml:8", "moving_mass"],
    );
}

#[test]
fn a_kind_nobody_knows() {
    refused(
        |d| edit(d, "campaign.toml", |l| l.into_iter().map(|s| s.replace("drop-test", "crash-test")).collect()),
        &["campaign.toml:5", "crash-test", "drop-test"],
    );
}
