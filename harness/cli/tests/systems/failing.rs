//! FMUs that fail in the middle of a fit, and FMUs that take no force.

use super::foreign::*;
use super::{diagnosed, touchdown};
use host::{Isolation, Limits};
use mechanisms::physics::{Physics, FREE};
use plant::machine::{Machine, Push, Running, Seat};
use plant::simulate::{simulate, Local, Setup};
use std::path::Path;
use std::time::{Duration, Instant};

/// What the FMU does, as fixtures/machine.c numbers it, the call that it shows in, and how.
const FAILURES: [(u32, &str, &str); 4] = [
    (1, "fmi2DoStep", "SIGSEGV"),
    (2, "fmi2DoStep", "no answer for 1 s"),
    (3, "fmi2DoStep", "no step from here"),
    (4, "fmi2GetReal", "NaN"),
];

/// A campaign whose FMU misbehaves where `tripped_by` is from `from` to `to`.
fn place(dir: &Path, of: &Described, tripped_by: &'static str, behaviour: u32, (from, to): (f64, f64), truth: &Truth) {
    Bodies { tripped_by, takes_forces: of.takes_forces, ..Bodies::default() }.write(dir);
    let more = format!("[fmu.set]\nbehaviour = {behaviour}\nfrom = {from:?}\nto = {to:?}\n");
    campaign(dir, &STOPS_INSIDE.replacen("[fmu.set]\n", &more, 1), of, truth);
}

#[test]
fn what_fails_at_some_parameters_is_told_and_the_rest_goes_on() {
    for (behaviour, call, how) in FAILURES {
        let dir = tempfile::tempdir().unwrap();
        place(dir.path(), &INSIDE, "K_A", behaviour, (1.3e7, 1.4e7), &Truth::new([None, None]));
        let c = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let limits =
            Limits { program: env!("CARGO_BIN_EXE_touchdown").into(), time: Duration::from_secs(1), ..Limits::new() };
        let m = host::Fmus::open(&c, &Isolation::Process(limits)).unwrap().unwrap();
        let run = |stiffness: f64| {
            let time: Vec<f64> = (0..SAMPLES).map(|i| INTERVAL * i as f64).collect();
            let seat = Seat { machine: m.clone(), set: 0, level: 0 };
            let setup =
                Setup { kind: record::Kind::System, machine: Some(seat), ..Setup::drop_test(time, 5e-4, 1.2, 1.2e-3) };
            let mut p = Physics { mass: 0.4, ..Physics::default() };
            p.free[0] = (stiffness / 1.2e7).ln();
            simulate(&p, &setup, &Local { start: 0.0, speed: 0.0, stiffness: 0.0, offset: 0.0 })
        };
        let before = run(1.2e7);
        assert!(before.ok && m.troubles().is_empty(), "{:?}", m.troubles());
        for _ in 0..2 {
            assert!(!run(1.35e7).ok);
        }
        let troubles = m.troubles();
        assert_eq!(troubles.len(), 1, "{troubles:?}");
        for part in ["bodies", call, how] {
            assert!(troubles[0].contains(part), "no {part:?} in {troubles:?}");
        }
        // and what comes after is as what came before
        let after = run(1.2e7);
        assert!(after.ok && after.force == before.force && after.position == before.position);
    }
}

#[test]
fn a_call_that_hangs_in_a_fit_is_ended_after_the_time_of_ten_runs() {
    let dir = tempfile::tempdir().unwrap();
    place(dir.path(), &INSIDE, "K_A", 2, (1.3e7, 1.4e7), &Truth::new([None, None]));
    let c = record::load(dir.path(), &mechanisms::terms()).unwrap();
    // a minute a call
    let limits = Limits { program: env!("CARGO_BIN_EXE_touchdown").into(), ..Limits::new() };
    let m = host::Fmus::open(&c, &Isolation::Process(limits)).unwrap().unwrap();
    let mut free = [0.0; FREE];
    free[0] = (1.35e7f64 / 1.2e7).ln();
    let since = Instant::now();
    // the FMU misbehaves from 2 ms on
    let to_where_it_hangs = |r: &mut dyn Running| {
        r.advance(3e-3, &[Push::default(); 2])?;
        r.follow(&[(0.0, 0.0); 2])?;
        r.advance(1e-5, &[Push::default(); 2])
    };
    let e = m.run(0, &free, &mut |r| to_where_it_hangs(r)).unwrap_err();
    assert!(since.elapsed() < Duration::from_secs(20), "{:?}", since.elapsed());
    let said = format!("{e:#}");
    for part in ["bodies", "fmi2DoStep", "no answer for", "its whole runs before"] {
        assert!(said.contains(part), "no {part:?} in {said:?}");
    }
}

#[test]
fn a_recording_that_an_fmu_fails_at_is_left_out_and_the_others_and_other_campaigns_are_judged() {
    let dir = tempfile::tempdir().unwrap();
    // the transducer of both reads more than there is
    let truth = Truth { read: [|f| 1.06 * f, |a| a, |x| x], ..Truth::new([None, None]) };
    for (name, behaviour) in [("good", 0), ("bad", 1)] {
        let folder = dir.path().join(name);
        std::fs::create_dir(&folder).unwrap();
        place(&folder, &MONOLITH, "PRELOAD", behaviour, (105.0, 110.0), &truth);
    }
    let (code, _, said) = touchdown(&["diagnose", "bad", "good", "--out", "out", "--quiet"], dir.path());
    assert_eq!(code, Some(0), "{said}");
    for name in ["good", "bad"] {
        let text = std::fs::read_to_string(dir.path().join("out").join(name).join("verdict.json")).unwrap();
        let v: serde_json::Value = serde_json::from_str(&text).unwrap();
        assert_eq!(v["missing"][0]["mechanism"], "force_gain", "{name}: {}", v["missing"]);
        let left_out =
            v["caveats"].as_array().unwrap().iter().filter_map(|c| c.as_str()).find(|c| c.contains("r2.csv"));
        assert_eq!(left_out.is_some(), name == "bad", "{left_out:?}");
        for part in left_out.map_or(vec![], |_| vec!["bodies", "fmi2DoStep", "SIGSEGV", "left out"]) {
            assert!(left_out.unwrap().contains(part), "no {part:?} in {left_out:?}");
        }
    }
}

#[test]
fn without_an_input_for_a_force_contact_is_unexplained_and_the_input_is_asked_for() {
    let dir = tempfile::tempdir().unwrap();
    let stiffening: Effect = |x, _| if x > 1.2e-4 { 4e6 * (x - 1.2e-4) } else { 0.0 };
    place(dir.path(), &MONOLITH, "PRELOAD", 0, (0.0, 0.0), &Truth::new([Some(stiffening), None]));
    let (v, _) = diagnosed(dir.path(), &["--in-process"]);
    assert_eq!(v["missing"].as_array().unwrap().len(), 0, "{}", v["missing"]);
    assert_eq!(v["unexplained"]["detected"], true);
    let next = v["next"].to_string();
    for part in ["an input that takes a force", "bodies.x_a"] {
        assert!(
            format!("{next}{}", v["unexplained"]["text"]).contains(part),
            "no {part:?} in {next} {}",
            v["unexplained"]
        );
    }
}
