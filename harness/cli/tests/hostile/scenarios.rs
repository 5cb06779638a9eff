//! A scenario through a hostile FMU.

use crate::fixture::{Behaviour, Place};

/// Drops from these heights on the FMU, which misbehaves from 5 ms on: not reached by the shorter ones.
fn drops(behaviour: Behaviour, at: f64, impacts: usize) -> String {
    format!(
        "kind = \"drop_test\"\nmass = 1.0\ngravity = true\ndrop_heights = [0.01, 0.02, 0.03, 0.04]\nimpacts = {impacts}\n\
         [contact]\nfmu = \"hostile.fmu\"\nparameters = {{ behaviour = {}, at = {at} }}\n",
        behaviour as i32
    )
}

fn summary(place: &Place) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(place.path().join("out/summary.json")).unwrap()).unwrap()
}

#[test]
fn four_drops_that_end_well_are_whole() {
    let place = Place::new();
    let e = place.run(&drops(Behaviour::Good, 0.0, 1), &[]);
    assert_eq!(e.code, Some(0), "{}", e.said);
    assert_eq!(summary(&place)["runs"].as_array().unwrap().len(), 4);
}

#[test]
fn a_crash_in_the_first_drop_names_it_and_keeps_its_rows() {
    let place = Place::new();
    let e = place.run(&drops(Behaviour::Segfaults, 0.03, 1), &[]);
    e.died("fmi2DoStep", "0.0", "SIGSEGV");
    assert!(e.said.contains("file.toml"), "{}", e.said);
    let whole = summary(&place)["runs"].as_array().unwrap().iter().filter(|r| r["interrupted"] == false).count();
    assert!(whole < 4 && e.said.contains(&format!("{whole} of 4 runs are whole")), "{}", e.said);
    assert!(!e.rows.is_empty());
}

#[test]
fn an_error_in_the_fourth_drop_keeps_the_three_before() {
    // the fourth falls longest, so that its time alone reaches `at`
    let place = Place::new();
    let fall = |h: f64| (2.0 * h / 9.80665f64).sqrt();
    let at = 0.5 * (fall(0.03) + fall(0.04));
    for (behaviour, code) in [(Behaviour::Segfaults, 4), (Behaviour::Fails, 2)] {
        let e = place.run(&drops(behaviour, at, 1), &[]);
        assert_eq!(e.code, Some(code), "{}", e.said);
        for part in ["3 of 4 runs are whole", "0.04", "fmi2DoStep"] {
            assert!(e.said.contains(part), "no {part:?} in {}", e.said);
        }
        let runs = summary(&place);
        let runs = runs["runs"].as_array().unwrap();
        assert!(runs.len() >= 3 && runs[..3].iter().all(|r| r["interrupted"] == false), "{runs:?}");
    }
}
