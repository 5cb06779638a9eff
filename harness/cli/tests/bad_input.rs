//! Bad recordings get an error that names file, line and cure, exit code 2, and nothing half-written.

use plant::recipe::{write_campaign, Recipe};
use std::path::Path;
use std::process::Command;

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

#[test]
fn force_in_kilonewton_that_is_in_newton() {
    refused(
        |d| edit(d, "r03.csv", |l| l.into_iter().map(|s| s.replace("force [N]", "force [kN]")).collect()),
        &["r03.csv", "times mass times acceleration", "correct the unit"],
    );
}

#[test]
fn time_in_milliseconds_that_is_in_seconds() {
    refused(
        |d| edit(d, "r02.csv", |l| l.into_iter().map(|s| s.replace("time [s]", "time [ms]")).collect()),
        &["r02.csv", "times", "correct the unit"],
    );
}

#[test]
fn noise_alone_in_one_recording() {
    let noise = |l: Vec<String>| {
        l.into_iter()
            .enumerate()
            .map(|(i, s)| {
                let time = s.split(',').next().unwrap().to_string();
                let z = |k: usize| f64::from(((i * 7919 + k * 104729) % 1009) as u32) / 1009.0 - 0.5;
                if i == 0 {
                    s
                } else {
                    format!("{time},{:e},{:e},{:e}", z(1), z(2), 1e-6 * z(3))
                }
            })
            .collect()
    };
    refused(|d| edit(d, "r06.csv", noise), &["r06.csv"]);
}

#[test]
fn two_campaigns_in_one_folder() {
    let other = |d: &Path| {
        let mut stiffer = Recipe { seed: 7, ..Recipe::default() };
        stiffer.physics.law.elastic.stiffness *= 5.0;
        let second = d.join("second");
        write_campaign(&second, &stiffer).unwrap();
        let mut listed = String::new();
        for i in 1..=10 {
            std::fs::rename(second.join(format!("r{i:02}.csv")), d.join(format!("s{i:02}.csv"))).unwrap();
        }
        let text = std::fs::read_to_string(second.join("campaign.toml")).unwrap();
        listed += &text[text.find("[[recording]]").unwrap()..].replace("\"r", "\"s");
        std::fs::remove_dir_all(second).unwrap();
        let path = d.join("campaign.toml");
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(path, text + "\n" + &listed).unwrap();
    };
    refused(other, &["two sets", "r01.csv", "s01.csv", "two folders", "both have order 1"]);
}

#[test]
fn no_open_campaign_is_refused() {
    let Some(shared) = shared() else { return };
    let mut seen = 0;
    for folder in ["concealed/open", "recordings"] {
        for entry in std::fs::read_dir(shared.join(folder)).unwrap() {
            let dir = entry.unwrap().path();
            if dir.join("campaign.toml").exists() {
                let c = record::load(&dir).unwrap();
                let conditioned = estimate::condition::condition(&c).unwrap();
                diagnose::plausible::check(&c, &conditioned.data).unwrap();
                seen += 1;
            }
        }
    }
    assert!(seen > 0, "no campaign in {}", shared.display());
}

/// The shared recordings beside the project; a message where they are absent, a failure where CI expects them.
fn shared() -> Option<std::path::PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    if path.is_dir() {
        return Some(path);
    }
    assert!(std::env::var("CI").is_err(), "{} is absent", path.display());
    eprintln!("skipped: {} is absent", path.display());
    None
}
