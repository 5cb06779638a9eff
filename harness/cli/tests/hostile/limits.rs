//! Limits that are given, and the way out of them.

use crate::fixture::{Behaviour, Place};
use std::process::Command;
use std::time::{Duration, Instant};

#[test]
fn limits_that_are_none_are_refused_with_a_cure() {
    for (option, value) in [("--fmu-seconds", "0"), ("--fmu-seconds", "-1"), ("--fmu-seconds", "nan")] {
        let e = Place::new().system(Behaviour::Good, &[&format!("{option}={value}")]);
        assert_eq!(e.code, Some(2), "{}", e.said);
        assert!(e.said.contains("give a time above 0, in s") && e.rows.is_empty(), "{}", e.said);
    }
    let e = Place::new().system(Behaviour::Good, &["--fmu-memory", "0"]);
    assert!(e.code == Some(2) && e.said.contains("give MB above 0"), "{}", e.said);
}

#[test]
fn in_the_process_it_runs_as_well_and_gives_the_same_rows() {
    let apart = Place::new().system(Behaviour::Good, &[]);
    let here = Place::new().system(Behaviour::Good, &["--in-process"]);
    here.is_whole();
    assert_eq!(here.rows, apart.rows);
}

#[test]
fn in_the_process_the_log_is_bounded_too() {
    let e = Place::new().system(Behaviour::FloodsTheLog, &["--in-process"]);
    e.is_whole();
    assert!(e.log.contains("99000 earlier lines are left out"), "{}", e.log.len());
}

/// Whether something temporary is there.
fn holds_temporary(place: &Place) -> bool {
    std::fs::read_dir(place.path().join("tmp")).unwrap().count() > 0
}

/// Sends a signal to a command whose FMU never ends. Its exit code.
fn signalled(place: &Place, signal: &str) -> Option<i32> {
    std::fs::write(place.path().join("file.toml"), Place::text(Behaviour::NeverEnds)).unwrap();
    let quiet = std::process::Stdio::null;
    let mut command = place.command(&["run", "file.toml", "--out", "out"]);
    let mut child = command.stdout(quiet()).stderr(quiet()).spawn().unwrap();
    // a generous wait for the step that never ends, that only a failure exhausts
    let until = Instant::now() + Duration::from_secs(60);
    while !place.path().join("out/results.partial.csv.part").exists() {
        assert!(Instant::now() < until, "no results while it runs");
        std::thread::sleep(Duration::from_millis(10));
    }
    std::thread::sleep(Duration::from_millis(300));
    assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
    let code = child.wait().unwrap().code();
    place.holds_no_process();
    code
}

#[test]
fn ctrl_c_ends_a_command_whose_fmu_never_ends() {
    let place = Place::new();
    assert_eq!(signalled(&place, "-INT"), Some(130));
    assert!(!holds_temporary(&place));
}

#[test]
fn a_command_that_is_killed_takes_the_process_of_the_fmu_with_it_and_the_next_clears_away_what_it_has_left() {
    let place = Place::new();
    assert_eq!(signalled(&place, "-KILL"), None);
    assert!(holds_temporary(&place));
    // it looks that nothing temporary stays
    place.system(Behaviour::Good, &[]).is_whole();
}

#[test]
fn its_process_started_by_hand_says_what_it_is() {
    let o = Command::new(env!("CARGO_BIN_EXE_touchdown"))
        .arg(host::ARGUMENT)
        .stdin(std::process::Stdio::null())
        .output()
        .unwrap();
    assert_eq!(o.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&o.stderr).contains("this starts by itself"), "{o:?}");
}
