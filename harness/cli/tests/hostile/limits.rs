//! Limits that are given, and the way out of them.

use crate::fixture::{Behaviour, Place};

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

#[test]
fn its_process_started_by_hand_says_what_it_is() {
    let o = std::process::Command::new(env!("CARGO_BIN_EXE_touchdown"))
        .arg(host::ARGUMENT)
        .stdin(std::process::Stdio::null())
        .output()
        .unwrap();
    assert_eq!(o.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&o.stderr).contains("this starts by itself"), "{o:?}");
}
