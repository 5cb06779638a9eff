//! Two bodies that strike a stop each: the bond that misses something is named, and not the other.

use super::foreign::*;
use super::{diagnosed, touchdown};
use mechanisms::physics::{Physics, FREE};
use plant::machine::{Machine, Seat};
use plant::simulate::{simulate, Local, Setup};
use std::path::Path;
use std::sync::Arc;
use tempfile::TempDir;

/// A level that no recording has, N.
const UNSEEN: f64 = 140.0;

fn stiffening(x: f64, _: f64) -> f64 {
    if x > 1.2e-4 {
        4e6 * (x - 1.2e-4)
    } else {
        0.0
    }
}

fn place(system: &str, of: &Described, bodies: Bodies, truth: &Truth) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    bodies.write(dir.path());
    write_stop(dir.path());
    campaign(dir.path(), system, of, truth);
    dir
}

fn opened(dir: &Path) -> Arc<host::Fmus> {
    let c = record::load(dir, &mechanisms::terms()).unwrap();
    host::Fmus::open(&c, &host::Isolation::None).unwrap().unwrap()
}

/// Root mean square of the acceleration of B that the system in `file` has beside the truth, over the truth's, at a level that no
/// recording has.
fn off(file: &Path, truth: &Truth) -> f64 {
    let dir = tempfile::tempdir().unwrap();
    let (code, _, said) = touchdown(&["run", file.to_str().unwrap(), "--out", "out", "--in-process"], dir.path());
    assert_eq!(code, Some(0), "{said}");
    let text = std::fs::read_to_string(dir.path().join("out/results.csv")).unwrap();
    let mut lines = text.lines();
    let at = lines.next().unwrap().split(',').position(|h| h.starts_with("bodies.a_b")).unwrap();
    let a: Vec<f64> = lines.map(|l| l.split(',').nth(at).unwrap().parse().unwrap()).collect();
    // rows of 1 us
    let every = (INTERVAL / 1e-6).round() as usize;
    let pairs: Vec<(f64, f64)> = truth.rows(UNSEEN).iter().enumerate().map(|(i, r)| (a[i * every], r[1])).collect();
    let square: f64 = pairs.iter().map(|(a, b)| (a - b).powi(2)).sum();
    (square / pairs.iter().map(|p| p.1 * p.1).sum::<f64>()).sqrt()
}

#[test]
fn the_machine_of_fmus_moves_as_another_program_has_it() {
    let truth = Truth::new([None, None]);
    for (system, of) in [(STOPS_APART, &APART), (STOPS_INSIDE, &INSIDE)] {
        let dir = place(system, of, Bodies::default(), &truth);
        let m = opened(dir.path());
        let rows = truth.rows(PRELOADS[1]);
        let time: Vec<f64> = (0..SAMPLES).map(|i| INTERVAL * i as f64).collect();
        let seat = Seat { machine: m.clone(), set: 1, level: 2 };
        let setup =
            Setup { kind: record::Kind::System, machine: Some(seat), ..Setup::drop_test(time, 5e-4, 1.2, 1.2e-3) };
        let f = &m.facts().bonds[0];
        let p = Physics { mass: f.mass.at.exp(), law: f.law.unwrap().of(&[0.0; FREE]), ..Physics::default() };
        let t = simulate(&p, &setup, &Local { start: 0.0, speed: 0.0, stiffness: 0.0, offset: 0.0 });
        assert!(t.ok, "{:?}", m.troubles());
        // force and penetration of A, acceleration of B, in hundredths of the noise they are judged by or so
        for (y, c) in [(&t.force, 0), (t.read[1].as_ref().unwrap(), 1), (&t.position, 2)] {
            let square: f64 = y.iter().zip(&rows).map(|(a, r)| (a - r[c]).powi(2)).sum();
            let off = (square / y.len() as f64).sqrt();
            assert!(off < 0.2 * NOISE[c], "channel {c} of {}: {off:e}", of.force);
        }
    }
}

#[test]
fn an_effect_at_one_of_two_stops_is_found_there_and_handed_back() {
    let truth = Truth::new([None, Some(stiffening)]);
    let dir = place(STOPS_APART, &APART, Bodies::default(), &truth);
    let (v, _) = diagnosed(dir.path(), &["--in-process"]);
    let missing = v["missing"].as_array().unwrap();
    assert_eq!(missing.len(), 1, "{missing:?} {} {}", v["posterior"], v["fit"]);
    assert_eq!(missing[0]["mechanism"], "secondary_stiffening");
    let place = &v["mismatch"]["where"][0];
    assert_eq!((place["bond"].as_str(), place["fmu"].as_str()), (Some("stop b"), Some("bodies")));
    // every bond with its probability, the likeliest first
    let bonds = place["bonds"].as_array().unwrap();
    let probability = |i: usize| bonds[i]["probability"].as_f64().unwrap();
    assert_eq!((bonds.len(), bonds[0]["bond"].as_str()), (2, Some("stop b")));
    assert!(probability(0) > 0.9 && (probability(0) + probability(1) - 1.0).abs() < 1e-9, "{bonds:?}");
    let nrmse = |part: &str| v["fit"][part]["heldout_nrmse"].as_f64().unwrap();
    assert!(nrmse("after") < 0.6 * nrmse("before"), "{} {}", nrmse("after"), nrmse("before"));
    // what was handed back, run: nearer to what was never recorded
    let before = off(&dir.path().join("system.toml"), &truth);
    let answer = std::fs::read_dir(dir.path().join("out")).unwrap().flatten();
    let handed = answer.map(|f| f.path().join("system")).find(|p| p.exists()).unwrap();
    for name in ["system.toml", "system.ssp"] {
        let after = off(&handed.join(name), &truth);
        assert!(after < 0.2 * before, "{name}: {after} {before}");
    }
}

#[test]
fn a_directional_derivative_tells_the_mass_exactly() {
    let truth = Truth::new([None, None]);
    let reported = place(STOPS_INSIDE, &INSIDE, Bodies { gives_derivatives: true, ..Bodies::default() }, &truth);
    let shown = place(STOPS_INSIDE, &INSIDE, Bodies::default(), &truth);
    let (reported, shown) = (opened(reported.path()), opened(shown.path()));
    let off = |m: &host::Fmus, b: usize, mass: f64| (m.facts().bonds[b].mass.at.exp() / mass - 1.0).abs();
    for (b, mass) in [(0, 0.4), (1, 0.3)] {
        assert!(off(&reported, b, mass) < 1e-12, "{b}: {:e}", off(&reported, b, mass));
        // a force tried over a step shows it with the error of that step
        assert!((1e-10..1e-2).contains(&off(&shown, b, mass)), "{b}: {:e}", off(&shown, b, mass));
    }
}
