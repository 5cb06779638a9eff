//! Bad recordings get an error that names file, line and cure, exit code 2, and nothing half-written; what can be put
//! right is, with a note.

use plant::recipe::{write_campaign, Recipe};
use std::path::Path;
use std::process::{Command, Output};

fn diagnose(campaigns: &[&Path], out: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_touchdown"))
        .arg("diagnose")
        .args(campaigns)
        .arg("--out")
        .arg(out)
        .output()
        .unwrap()
}

fn refused(spoil: impl Fn(&Path), says: &[&str]) {
    let dir = tempfile::tempdir().unwrap();
    let campaign = dir.path().join("c");
    write_campaign(&campaign, &Recipe::default()).unwrap();
    spoil(&campaign);
    let out = dir.path().join("out");
    let run = diagnose(&[&campaign], &out);
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
fn time_running_backwards() {
    refused(
        |d| {
            edit(d, "r01.csv", |mut l| {
                l.swap(50, 51);
                l
            })
        },
        &["r01.csv:52", "time goes back here", "sort the rows"],
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

/// The rows with their times and nothing read.
fn nothing(l: Vec<String>) -> Vec<String> {
    let row = |(i, s): (usize, String)| if i == 0 { s } else { format!("{},0,0,0", s.split(',').next().unwrap()) };
    l.into_iter().enumerate().map(row).collect()
}

/// The rows with their times and noise alone.
fn noise(l: Vec<String>) -> Vec<String> {
    let z = |i: usize, k: usize| f64::from(((i * 7919 + k * 104729) % 1009) as u32) / 1009.0 - 0.5;
    let row = |(i, s): (usize, String)| match i {
        0 => s,
        _ => format!("{},{:e},{:e},{:e}", s.split(',').next().unwrap(), z(i, 1), z(i, 2), 1e-6 * z(i, 3)),
    };
    l.into_iter().enumerate().map(row).collect()
}

#[test]
fn recordings_of_nothing_alone() {
    let all = |d: &Path| (1..=10).for_each(|i| edit(d, &format!("r{i:02}.csv"), nothing));
    refused(all, &["no recording is left to judge", "r01.csv: no impact", "7 more", "check the signs"]);
}

#[test]
fn everything_wrong_at_once() {
    let spoil = |d: &Path| {
        edit(d, "campaign.toml", |l| {
            let slips = [("drop-test", "drop_tests"), ("\"gravity\"", "\"grvity\""), ("order = 3", "ordre = 3")];
            l.into_iter().map(|s| slips.iter().fold(s, |s, (a, b)| s.replace(a, b))).collect()
        });
        edit(d, "r01.csv", |mut l| {
            l[0] = l[0].replace("[N]", "[Kn]").replace("acceleration", "accelaration");
            l
        });
        edit(d, "r02.csv", |mut l| {
            l.swap(50, 51);
            l
        });
    };
    refused(
        spoil,
        &[
            "campaign.toml:5: kind \"drop_tests\" is not known; did you mean \"drop-test\"?",
            "campaign.toml:11: term \"grvity\" is not known; did you mean \"gravity\"?",
            "key \"ordre\" is not known under [[recording]]; did you mean \"order\"?",
            "r01.csv:1: unit \"Kn\" does not measure force; did you mean \"kN\"?",
            "r01.csv:1: column \"accelaration\" is not known; did you mean \"acceleration\"?",
            "r02.csv:52: time goes back here",
        ],
    );
}

#[test]
fn what_can_be_put_right_is_noted_and_a_bad_campaign_stops_no_other() {
    let dir = tempfile::tempdir().unwrap();
    let [bad, good, out] = ["bad", "good", "out"].map(|n| dir.path().join(n));
    for d in [&bad, &good] {
        write_campaign(d, &Recipe::default()).unwrap();
    }
    std::fs::remove_file(bad.join("r07.csv")).unwrap();
    edit(&good, "r02.csv", |mut l| {
        // a pause
        l.drain(600..650);
        l
    });
    edit(&good, "r03.csv", |mut l| {
        l.insert(50, l[50].clone());
        l
    });
    edit(&good, "r04.csv", |mut l| {
        // a spike of force
        let cells: Vec<&str> = l[40].split(',').collect();
        l[40] = format!("{},100,{},{}", cells[0], cells[2], cells[3]);
        l
    });
    edit(&good, "r05.csv", nothing);
    edit(&good, "r06.csv", noise);
    let run = diagnose(&[&bad, &good], &out);
    let err = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(2), "{err}");
    assert!(err.contains("r07.csv: cannot be read") && !out.join("bad").exists(), "{err}");
    let verdict = std::fs::read_to_string(out.join("good/verdict.json")).unwrap();
    for note in [
        "r02.csv: a pause of 0.00051 s after 0.00598 s: what lies after it was left out.",
        "r03.csv: rows of one time were merged into one sample, the mean of their readings: 1 in all, the first at 0.00049",
        "r05.csv: no impact is to be seen in it: it was left out.",
        "r06.csv: its peak does not stand out of the noise: it was left out.",
    ] {
        assert!(err.contains(note), "{note:?} is not in {err}");
        assert!(verdict.contains(note), "{note:?} is not in {verdict}");
    }
    assert!(verdict.contains("r04.csv at 3.900e-4 s (force)"), "{verdict}");
    let verdict: serde_json::Value = serde_json::from_str(&verdict).unwrap();
    assert_eq!(verdict["mismatch"]["detected"], false, "{verdict}");
    // a row for each of the file's, at its time, every cell a number
    for file in ["r01.csv", "r02.csv", "r03.csv"] {
        let table = |path: &Path| -> Vec<Vec<f64>> {
            let text = std::fs::read_to_string(path).unwrap();
            text.lines().skip(1).map(|l| l.split(',').map(|c| c.parse().unwrap()).collect()).collect()
        };
        let (rows, predicted) = (table(&good.join(file)), table(&out.join("good/predictions/before").join(file)));
        assert_eq!(rows.len(), predicted.len(), "{file}");
        for (r, p) in rows.iter().zip(&predicted) {
            assert!((r[0] - p[0]).abs() < 1e-12 && p.iter().all(|v| v.is_finite()), "{file}: {r:?} {p:?}");
        }
    }
    assert!(!out.join("good/predictions/before/r05.csv").exists());
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
fn a_force_in_pounds_that_is_called_newton() {
    let in_pounds = |l: Vec<String>| {
        let row = |(i, s): (usize, String)| {
            if i == 0 {
                return s;
            }
            let mut cells: Vec<String> = s.split(',').map(String::from).collect();
            cells[1] = format!("{:e}", cells[1].parse::<f64>().unwrap() / 4.448_221_6);
            cells.join(",")
        };
        l.into_iter().enumerate().map(row).collect()
    };
    refused(
        |d| (1..=10).for_each(|i| edit(d, &format!("r{i:02}.csv"), in_pounds)),
        &["force over mass times acceleration is 0.22", "force looks like lbf; correct the unit"],
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
fn two_campaigns_in_one_folder() {
    let other = |d: &Path| {
        let mut stiffer = Recipe { seed: 7, ..Recipe::default() };
        stiffer.physics.law.elastic.stiffness *= 10.0;
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
                let c = touchdown::campaign::load(&dir).unwrap();
                assert!(
                    !c.warnings.iter().any(|w| w.contains("no impact") || w.contains("stand out")),
                    "{:?}",
                    c.warnings
                );
                if c.kind == record::Kind::System {
                    // its FMUs are asked first: tests/systems
                    continue;
                }
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

#[test]
fn a_system_of_more_steps_than_can_be_run_is_refused_at_once() {
    let dir = tempfile::tempdir().unwrap();
    let example = concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/contactor_system.toml");
    let text = std::fs::read_to_string(example).unwrap();
    for stop in ["stop = 1e16", "stop = 1e9"] {
        let path = dir.path().join("far.toml");
        std::fs::write(&path, text.replace("stop = 0.1 ", stop)).unwrap();
        let out = dir.path().join("out");
        let run = Command::new(env!("CARGO_BIN_EXE_touchdown"))
            .arg("run")
            .arg(&path)
            .arg("--out")
            .arg(&out)
            .output()
            .unwrap();
        let err = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{err}");
        assert!(err.contains("a run takes at most 1e9: give an earlier stop or a longer step"), "{err}");
    }
}

#[cfg(unix)]
#[test]
fn a_pipe_or_a_device_in_the_place_of_a_file_is_refused_at_once_by_every_command() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    for name in ["pipe.csv", "pipe.toml", "pipe.fmu", "pipe.ssp", "c/campaign.toml", "d/r01.csv"] {
        std::fs::create_dir_all(at(name).parent().unwrap()).unwrap();
        if name == "d/r01.csv" {
            write_campaign(&at("d"), &Recipe::default()).unwrap();
            std::fs::remove_file(at(name)).unwrap();
        }
        assert!(Command::new("mkfifo").arg(at(name)).status().unwrap().success());
    }
    std::os::unix::fs::symlink("/dev/zero", at("zero.toml")).unwrap();
    let system = "[[fmu]]\nname = \"a\"\nfile = \"pipe.fmu\"\n[run]\nstop_time = 1\n";
    std::fs::write(at("system.toml"), system).unwrap();
    let cases: [(&[&str], &str); 11] = [
        (&["check", "c"], "campaign.toml"),
        (&["check", "d"], "r01.csv"),
        (&["diagnose", "c", "--out", "o"], "campaign.toml"),
        (&["diagnose", "d", "--out", "o"], "r01.csv"),
        (&["run", "pipe.toml", "--out", "o"], "pipe.toml"),
        (&["run", "zero.toml", "--out", "o"], "zero.toml"),
        (&["run", "pipe.ssp", "--out", "o"], "pipe.ssp"),
        (&["run", "system.toml", "--out", "o"], "system.toml"),
        (&["import", "pipe.csv", "--out", "o"], "pipe.csv"),
        (&["compare", "pipe.csv", "pipe.csv"], "pipe.csv"),
        (&["pack", "--binary", "linux64=pipe.fmu", "--out", "o.fmu"], "pipe.fmu"),
    ];
    for (arguments, file) in cases {
        let o = Command::new(env!("CARGO_BIN_EXE_touchdown")).args(arguments).current_dir(dir.path()).output().unwrap();
        let e = String::from_utf8_lossy(&o.stderr);
        assert_eq!(o.status.code(), Some(2), "{arguments:?}: {e}");
        assert!(e.contains(file), "{arguments:?}: {e}");
        let said = ["a pipe, not a file", "a device, not a file"].iter().any(|w| e.contains(w));
        assert!(said || file == "system.toml", "{arguments:?}: {e}");
    }
    assert!(!at("o").exists() && !at("o.fmu").exists());
}
