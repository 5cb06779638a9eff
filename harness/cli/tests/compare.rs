//! `touchdown compare`: bad input gets an error that names file, place and cure, and exit code 2; equal files rate one.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// Rows of a half sine of 8 ms in acceleration, and in force.
fn pulse(rows: usize) -> String {
    let row = |i: usize| {
        let t = 1e-4 * i as f64;
        let u = (t - 0.004) / 0.008;
        let y = if (0.0..=1.0).contains(&u) { 100.0 * (std::f64::consts::PI * u).sin() } else { 0.0 };
        format!("{t},{},{}\n", -y, 2.0 * y)
    };
    "time [s],acceleration [m/s^2],force [N]\n".to_string() + &(0..rows).map(row).collect::<String>()
}

struct Files {
    dir: tempfile::TempDir,
}

impl Files {
    fn new(recording: &str, simulation: &str) -> Files {
        let f = Files { dir: tempfile::tempdir().unwrap() };
        std::fs::write(f.path("r.csv"), recording).unwrap();
        std::fs::write(f.path("s.csv"), simulation).unwrap();
        f
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn compare(&self, words: &[&str]) -> Output {
        compare(&self.path("r.csv"), &self.path("s.csv"), words)
    }
}

fn compare(recording: &Path, simulation: &Path, words: &[&str]) -> Output {
    let mut c = Command::new(env!("CARGO_BIN_EXE_touchdown"));
    c.arg("compare").arg(recording).arg(simulation).args(words).output().unwrap()
}

fn refused(run: Output, says: &[&str]) {
    let err = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(2), "{err}");
    assert!(run.stdout.is_empty());
    assert!(err.lines().all(|l| l.starts_with("error: ")), "{err}");
    for s in says {
        assert!(err.contains(s), "{s:?} is not in {err}");
    }
}

fn answered(run: Output) -> String {
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    String::from_utf8(run.stdout).unwrap()
}

#[test]
fn equal_files_rate_one() {
    let f = Files::new(&pulse(400), &pulse(400));
    let text = answered(f.compare(&["--cfc", "180", "--srs", "10", "--json"]));
    let v: serde_json::Value = serde_json::from_str(&text).unwrap();
    let channels = v["channels"].as_array().unwrap();
    assert_eq!(channels.len(), 2);
    for c in channels {
        assert_eq!(c["rating"]["grade"], "excellent");
        assert!((c["rating"]["overall"].as_f64().unwrap() - 1.0).abs() < 1e-12);
        assert_eq!((c["normalised_rms"].as_f64(), &c["recording"]), (Some(0.0), &c["simulation"]));
    }
    assert_eq!(v["spectra"]["recording"], v["spectra"]["simulation"]);
    assert_eq!((v["bounces"]["recording"]["count"].as_u64(), &v["samples"]), (Some(1), &serde_json::json!(400)));
    let text = answered(f.compare(&[]));
    for said in ["not filtered", "force [N]", "ISO/TS 18571", "excellent", "first impact [s]"] {
        assert!(text.contains(said), "{said:?} is not in {text}");
    }
}

#[test]
fn faults_of_both_files_are_told_at_once() {
    let f = Files::new(&pulse(400).replace("[N]", "[mm]"), &pulse(400).replacen("\n0,", "\nNaN,", 1));
    let wanted = ["r.csv:1", "unit \"mm\" does not measure force", "s.csv:2", "time holds \"NaN\"", "remove the rows"];
    refused(f.compare(&[]), &wanted);
}

#[test]
fn files_that_are_none() {
    let f = Files::new(&pulse(400), "");
    refused(compare(&f.path("none.csv"), f.dir.path(), &[]), &["none.csv: cannot be read", "name a CSV file"]);
    refused(f.compare(&[]), &["s.csv:1", "add time [s]"]);
    refused(compare(&f.path("s.csv"), &f.path("r.csv"), &[]), &["s.csv:1", "there is no channel besides time"]);
    std::fs::write(f.path("s.csv"), [0xff, 0xfe, 0x00, 0x0a, 0xff, 0x80]).unwrap();
    refused(f.compare(&[]), &["s.csv:1"]);
    std::fs::write(f.path("s.csv"), pulse(12)).unwrap();
    refused(f.compare(&[]), &["s.csv:13", "12 samples are too few"]);
}

#[test]
fn no_common_channel_or_part() {
    let alone = |keep: &str| {
        let (a, b) = ("acceleration [m/s^2]", "force [N]");
        let (left, name) = if keep == a { (b, "else") } else { (a, "else") };
        pulse(400).replace(left, name)
    };
    let f = Files::new(&alone("acceleration [m/s^2]"), &alone("force [N]"));
    refused(f.compare(&[]), &["r.csv, ", "s.csv:1", "no channel is in both", "give them a common one"]);
    let f = Files::new(&pulse(400), &pulse(400));
    refused(f.compare(&["--shift", "3"]), &["the recording runs from 0 s", "are too few", "--shift"]);
    refused(f.compare(&["--from", "0.039"]), &["are too few", "--from"]);
    refused(f.compare(&["--from", "2", "--to", "1"]), &["leave nothing", "give --from before --to"]);
    refused(f.compare(&["--shift", "inf"]), &["--shift inf is no time"]);
    refused(f.compare(&["--rating-rate", "0"]), &["--rating-rate 0", "give Hz above 0"]);
    refused(f.compare(&["--rating-rate", "1e300"]), &["--rating-rate", "a lower rate"]);
}

#[test]
fn classes_and_qualities_that_cannot_be_had() {
    let f = Files::new(&pulse(400), &pulse(400));
    refused(f.compare(&["--cfc", "1200"]), &["r.csv", "too low for CFC 1200", "a class of 1000.0 at most"]);
    refused(f.compare(&["--cfc=-60"]), &["is no frequency class", "give a number above 0"]);
    refused(f.compare(&["--srs", "0.5"]), &["--srs", "Q = 0.5", "above 0.5"]);
    let force = pulse(400).replace("acceleration [m/s^2]", "else");
    let f = Files::new(&force, &pulse(400));
    refused(f.compare(&["--srs", "10"]), &["--srs needs the channel acceleration", "leave --srs out"]);
}

#[test]
fn what_was_done_to_the_files_is_reported() {
    // the simulation: fewer samples, and a pause
    let head = pulse(0);
    let rows: Vec<String> = pulse(400).lines().skip(1).map(|l| l.to_string() + "\n").collect();
    let sparse: String =
        rows.iter().enumerate().filter(|(i, _)| i % 2 == 0 && !(20..30).contains(i)).map(|r| r.1.as_str()).collect();
    let f = Files::new(&pulse(400).replace("force [N]", "Force"), &(head + &sparse));
    let text = answered(f.compare(&["--cfc", "60"]));
    for said in [
        "r.csv: column \"Force\" is not known; did you mean \"force\"?",
        "r.csv: columns that are not known were left out: Force.",
        "s.csv: its sampling is not even: resampled at 5000 Hz.",
        "s.csv: the other file has no channel force: it was left out.",
        "the recording has 10000 Hz and the simulation 5000 Hz: both are compared at 10000 Hz.",
    ] {
        assert!(text.contains(said), "{said:?} is not in {text}");
    }
}

#[test]
fn events_alone_make_a_bounce_table() {
    let closed = |late: usize| {
        let at = |i: usize| usize::from(i >= 20 + late && !(40..60).contains(&i) && !(70..80 + late).contains(&i));
        "time [ms],closed [1]\n".to_string() + &(0..120).map(|i| format!("{i},{}\n", at(i))).collect::<String>()
    };
    let f = Files::new(&closed(0), &closed(2));
    let v: serde_json::Value = serde_json::from_str(&answered(f.compare(&["--json"]))).unwrap();
    let of = |file: &str, key: &str| v["bounces"][file][key].as_f64().unwrap();
    assert!((of("recording", "first") - 0.0195).abs() < 1e-9 && (of("simulation", "first") - 0.0215).abs() < 1e-9);
    assert_eq!((of("recording", "count"), of("simulation", "count")), (3.0, 3.0));
    assert!(
        (of("recording", "bounce_time") - 0.060).abs() < 1e-9 && (of("simulation", "bounce_time") - 0.060).abs() < 1e-9
    );
    assert!((v["bounces"]["recording"]["impacts"][1]["flight_ratio"].as_f64().unwrap() - 0.5).abs() < 1e-9);
    refused(f.compare(&["--srs", "10"]), &["--srs needs the channel acceleration"]);
    std::fs::write(f.path("s.csv"), closed(0).replace("30,1\n", "30,0.4\n")).unwrap();
    refused(
        f.compare(&[]),
        &["s.csv:32", "closed holds \"0.4\", neither 0 nor 1", "write 1 where the contact is closed"],
    );
}
