//! The machine of FMUs against the rig that they are, and the commands on them.

use super::{diagnosed, touchdown};
use mechanisms::physics::Physics;
use plant::machine::{Machine, Seat};
use plant::simulate::{simulate, Local, Setup, Trace};
use record::Kind;
use std::path::Path;
use std::sync::Arc;

const MASS: f64 = 0.42;
const TRAVEL: f64 = 0.0038;
const RATE: f64 = 8000.0;
const PRELOADS: [f64; 3] = [80.0, 100.0, 125.0];
const LAW: [f64; 3] = [9.4e6, 1.08, 1.9e6];

const SYSTEM: &str = r#"[[fmu]]
name = "bar"
file = "touchdown:moving-bar"
input_orders = 3
[fmu.set]
mass = 0.42
travel = 0.0038
start_penetration = -0.0038
spring_preload = 80.0
return_spring_rate = 8000.0
[[fmu]]
name = "contact"
file = "touchdown:contact"
[fmu.set]
stiffness = 9.4e6
exponent = 1.08
hysteresis_damping = 1.9e6
[[connect]]
from = "bar.penetration"
to = "contact.penetration"
[[connect]]
from = "bar.velocity"
to = "contact.velocity"
[[connect]]
from = "contact.force"
to = "bar.force"
[master]
stop = 0.1
step = 1e-5
"#;

const CAMPAIGN: &str = r#"format = "recordings/1"
[campaign]
kind = "system"
[simulation]
system = "system.toml"
terms = ["hysteresis_damping", "return_spring"]
[[simulation.free]]
variable = "contact.stiffness"
[[simulation.free]]
variable = "bar.mass"
tolerance = 0.002
[[simulation.bond]]
name = "stop"
kind = "contact"
force = "bar.force"
penetration = "bar.penetration"
velocity = "bar.velocity"
[simulation.channels]
force = "contact.force"
acceleration = "bar.acceleration"
penetration = "bar.penetration"
"#;

/// The rig that the FMUs are, at a preload in N.
fn rig(preload: f64) -> (Physics, Setup) {
    let time: Vec<f64> = (0..1200).map(|i| 1e-5 * f64::from(i)).collect();
    let setup = Setup {
        kind: Kind::ContactorOpening,
        travel: TRAVEL,
        preload,
        rate: RATE,
        ..Setup::drop_test(time, 3.3e-4, 1.1, 9e-4)
    };
    let law = law::Parameters::power_law(LAW[0], LAW[1], LAW[2]);
    (Physics { mass: MASS, law, ..Physics::default() }, setup)
}

const RELEASED: Local = Local { start: 0.0, speed: 0.0, stiffness: 0.0, offset: 0.0 };

/// A campaign of the rig's own readings, in noise that no seed is needed for.
fn campaign() -> tempfile::TempDir {
    campaign_of(|_| {})
}

/// The same of a rig with something that the FMUs do not hold.
fn campaign_of(change: fn(&mut Physics)) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let mut text = CAMPAIGN.to_string();
    for (r, preload) in PRELOADS.into_iter().enumerate() {
        let (mut p, setup) = rig(preload);
        change(&mut p);
        let t = simulate(&p, &setup, &RELEASED);
        let noise = |i: usize| ((i * 7919 + r * 31) % 101) as f64 / 50.0 - 1.0;
        let mut csv = String::from("time [s],force [N],acceleration [m/s^2],penetration [m]\n");
        for (i, time) in setup.time.iter().enumerate() {
            let [f, a, x] =
                [t.force[i] + noise(i), t.acceleration[i] + 3.0 * noise(i + 5), t.position[i] + 1e-6 * noise(i + 9)];
            csv += &format!("{time:e},{f:e},{a:e},{x:e}\n");
        }
        std::fs::write(dir.path().join(format!("r{r}.csv")), csv).unwrap();
        text += &format!("[[recording]]\nfile = \"r{r}.csv\"\n[recording.set]\n\"bar.spring_preload\" = {preload:?}\n");
    }
    std::fs::write(dir.path().join("system.toml"), SYSTEM).unwrap();
    std::fs::write(dir.path().join("campaign.toml"), text).unwrap();
    dir
}

fn machine(dir: &Path) -> Arc<dyn Machine> {
    let c = record::load(dir, &mechanisms::terms()).unwrap();
    host::Fmus::open(&c, &host::Isolation::None).unwrap().unwrap()
}

/// Largest difference over the largest value, of force and position.
fn apart(a: &Trace, b: &Trace) -> f64 {
    let of = |x: &[f64], y: &[f64]| {
        let top = x.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        x.iter().zip(y).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / top
    };
    of(&a.force, &b.force).max(of(&a.position, &b.position))
}

#[test]
fn what_is_found_out_of_the_fmus_is_what_they_were_given() {
    let dir = campaign();
    let m = machine(dir.path());
    let b = &m.facts().bonds[0];
    let law = b.law.unwrap();
    assert!((b.mass.at.exp() / MASS - 1.0).abs() < 1e-6 && b.takes_force && b.reported && !b.inside);
    assert!((law.stiffness.at - LAW[0].ln()).abs() < 1e-4 && (law.exponent.at - LAW[1]).abs() < 1e-5);
    assert!((law.damping.at - LAW[2] / LAW[0]).abs() < 1e-4, "{law:?}");
    assert!((b.spring.0 / RATE - 1.0).abs() < 1e-2, "{:?}", b.spring);
    // stiffness goes by its logarithm, and does to the law what it does
    let f = m.facts();
    assert!(f.free[0].by_logarithm && (law.stiffness.slopes[0] - 1.0).abs() < 1e-3);
    assert!((b.mass.slopes[1] - 1.0).abs() < 1e-3 && law.stiffness.slopes[1].abs() < 1e-3);
}

#[test]
fn fmus_connected_by_other_types_than_real_are_coupled_too() {
    use super::relay::{fmu, FREE};
    let dir = campaign();
    let counter =
        ["Integer.0 parameter teeth", "Integer.10 output count", "Boolean.0 parameter on", "Boolean.10 output closed"];
    let gauge = [
        "Real.0 input count",
        "Boolean.0 input closed",
        "Real.10 output got unit=\"m\"",
        "Boolean.10 output got_closed",
    ];
    std::fs::write(dir.path().join("counter.fmu"), fmu((FREE, ""), &counter)).unwrap();
    std::fs::write(dir.path().join("gauge.fmu"), fmu((FREE, ""), &gauge)).unwrap();
    let more = "[[fmu]]\nname = \"gauge\"\nfile = \"gauge.fmu\"\n[[fmu]]\nname = \"counter\"\nfile = \"counter.fmu\"\n\
                [fmu.set]\nteeth = 7\non = true\n[[connect]]\nfrom = \"counter.count\"\nto = \"gauge.count\"\nmap = [[7, 9]]\n\
                [[connect]]\nfrom = \"counter.closed\"\nto = \"gauge.closed\"\n[master]";
    std::fs::write(dir.path().join("system.toml"), SYSTEM.replace("[master]", more)).unwrap();
    let text = std::fs::read_to_string(dir.path().join("campaign.toml")).unwrap();
    let text = text.replace("penetration = \"bar.penetration\"\n[[rec", "penetration = \"gauge.got\"\n[[rec");
    std::fs::write(dir.path().join("campaign.toml"), text).unwrap();
    let m = machine(dir.path());
    let mut seen = f64::NAN;
    m.run(0, &[0.0; mechanisms::physics::FREE], &mut |r| {
        seen = r.output(2);
        Ok(())
    })
    .unwrap();
    assert_eq!(seen, 9.0);
}

#[test]
fn fmus_with_a_mechanism_at_their_bond_move_as_the_rig_with_it() {
    type Change = fn(&mut Physics);
    let dir = campaign();
    let m = machine(dir.path());
    let changes: [(&str, Change, f64); 7] = [
        ("nothing", |_| {}, 2e-5),
        ("squeeze_film", |p| (p.squeeze_film.coefficient, p.squeeze_film.gap) = (5.0, 1e-4), 2e-5),
        ("guide_friction", |p| p.guide_friction.coulomb = 8.0, 2e-4),
        ("adhesion", |p| p.law.adhesion.force = 30.0, 3e-5),
        ("residual_magnetism", |p| (p.residual_magnetism.force, p.residual_magnetism.time) = (20.0, 3e-3), 2e-5),
        (
            "base_compliance",
            |p| {
                (p.base_compliance.mass, p.base_compliance.stiffness, p.base_compliance.damping) = (0.5, 4e7, 200.0);
            },
            2e-5,
        ),
        (
            "attached_mass",
            |p| (p.attached_mass.mass, p.attached_mass.stiffness, p.attached_mass.damping) = (0.04, 1e6, 20.0),
            1e-3,
        ),
    ];
    for (name, change, within) in changes {
        for (set, preload) in PRELOADS.into_iter().enumerate() {
            let (mut p, setup) = rig(preload);
            change(&mut p);
            let ours = simulate(&p, &setup, &RELEASED);
            let seat = Seat { machine: m.clone(), set, level: 0 };
            let of_fmus = Setup { kind: Kind::System, machine: Some(seat), ..setup };
            let theirs = simulate(&p, &of_fmus, &RELEASED);
            assert!(theirs.ok, "{name}: {:?}", m.troubles());
            assert!(apart(&ours, &theirs) < within, "{name} at {preload} N: {:e}", apart(&ours, &theirs));
        }
    }
}

#[test]
fn variables_that_are_free_move_the_fmus_and_the_law_with_them() {
    let dir = campaign();
    let m = machine(dir.path());
    let (mut p, setup) = rig(PRELOADS[0]);
    // the element's damping is mu_d, which stays
    p.law.elastic.stiffness *= 1.3;
    p.mass *= 1.01;
    let ours = simulate(&p, &setup, &RELEASED);
    (p.free[0], p.free[1]) = (1.3f64.ln(), 1.01f64.ln());
    let seat = Seat { machine: m.clone(), set: 0, level: 1 };
    let theirs = simulate(&p, &Setup { kind: Kind::System, machine: Some(seat), ..setup }, &RELEASED);
    // the law that the contact nearly follows is found at 1 % steps: at 30 % a linear ratio would be off by 5e-3
    assert!(theirs.ok && apart(&ours, &theirs) < 1e-3, "{:e}", apart(&ours, &theirs));
}

#[test]
fn what_is_sampled_before_the_start_reads_as_at_the_start_whatever_the_steps() {
    let dir = campaign();
    let m = machine(dir.path());
    let (p, setup) = rig(PRELOADS[0]);
    let mut start = (f64::NAN, f64::NAN);
    m.run(0, &p.free, &mut |r| {
        start = r.motion(0);
        Ok(())
    })
    .unwrap();
    let late = Local { start: setup.time[20] + 1e-9, ..RELEASED };
    for level in [0, 3] {
        let seat = Seat { machine: m.clone(), set: 0, level };
        let t = simulate(&p, &Setup { kind: Kind::System, machine: Some(seat), ..setup.clone() }, &late);
        assert!(t.ok, "{:?}", m.troubles());
        for i in [0, 20] {
            assert_eq!((t.position[i], t.velocity[i]), start, "sample {i}, level {level}");
        }
        assert_ne!(t.position[22], start.0);
    }
}

#[test]
fn init_proposes_the_bond_and_check_shows_simulation_over_recording() {
    let dir = campaign();
    std::fs::remove_file(dir.path().join("campaign.toml")).unwrap();
    let (code, _, err) = touchdown(&["init", "system.toml"], dir.path());
    assert_eq!(code, Some(0), "{err}");
    let text = std::fs::read_to_string(dir.path().join("campaign.toml")).unwrap();
    for line in [
        "kind = \"system\"",
        "system = \"system.toml\"",
        "force = \"bar.force\"",
        "penetration = \"bar.penetration\"",
        "velocity = \"bar.velocity\"",
        "force = \"contact.force\"",
        "acceleration = \"bar.acceleration\"",
        "variable = \"contact.stiffness\"",
        "variable = \"bar.mass\"",
    ] {
        assert!(text.lines().any(|l| l == line), "{line}: {text}");
    }
    let (code, out, err) = touchdown(&["check", "."], dir.path());
    assert_eq!(code, Some(0), "{err}");
    assert!(out.contains("r0.csv, force: recorded") && out.contains("simulation: FMUs"), "{out}");
}

#[test]
fn a_variable_that_is_none_is_told_with_the_nearest_and_its_line() {
    let dir = campaign();
    let text = std::fs::read_to_string(dir.path().join("campaign.toml")).unwrap();
    for (from, to, said) in [
        ("contact.stiffness", "contact.stifness", "did you mean"),
        ("force = \"bar.force\"", "force = \"bar.penetration\"", "is no Real input"),
        ("\"bar.acceleration\"", "\"baar.acceleration\"", "no FMU is named baar"),
        ("system = \"system.toml\"", "system = \"other.toml\"", "cannot be read"),
    ] {
        std::fs::write(dir.path().join("campaign.toml"), text.replacen(from, to, 1)).unwrap();
        let (code, _, err) = touchdown(&["check", "."], dir.path());
        let line = 1 + text[..text.find(from).unwrap()].matches('\n').count();
        assert!(code == Some(2) && err.contains(said), "{to}: {err}");
        assert!(err.contains(&format!("campaign.toml:{line}:")), "{to}: {err}");
    }
}

/// The system that was handed back, run at the first preload: the bar's penetration at the times of the rig's.
fn run(file: &Path, dir: &Path, times: &[f64]) -> Vec<f64> {
    let (code, _, said) = touchdown(&["run", file.to_str().unwrap(), "--out", "after", "--in-process"], dir);
    assert_eq!(code, Some(0), "{said}");
    let text = std::fs::read_to_string(dir.join("after/results.csv")).unwrap();
    let mut lines = text.lines();
    let at = lines.next().unwrap().split(',').position(|h| h.starts_with("bar.penetration")).unwrap();
    let x: Vec<f64> = lines.map(|l| l.split(',').nth(at).unwrap().parse().unwrap()).collect();
    // rows of 10 us
    times.iter().map(|t| x[(t / 1e-5).round() as usize]).collect()
}

/// Largest difference in penetration, m, before the touch: inputs held over 10 us change the rebound.
fn before_touch(x: &[f64], t: &Trace) -> f64 {
    let flight = t.position.iter().take_while(|x| **x < 0.0);
    x.iter().zip(flight).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn a_system_handed_back_with_forces_on_the_body_moves_as_the_rig_with_them() {
    let dir = campaign();
    let c = record::load(dir.path(), &mechanisms::terms()).unwrap();
    let of = c.system.as_ref().unwrap();
    let friction = [("friction".to_string(), 8.0), ("friction_viscous".to_string(), 4.0)];
    let binaries = pack::Model::body_force().libraries(None).unwrap();
    let body = pack::Model::body_force().archive(&friction, &binaries).unwrap();
    let element = {
        let starts = [("stiffness".into(), LAW[0]), ("exponent".into(), LAW[1]), ("hysteresis_damping".into(), LAW[2])];
        pack::Model::contact().archive(&starts, &pack::Model::contact().libraries(None).unwrap()).unwrap()
    };
    let (mut p, setup) = rig(PRELOADS[0]);
    let without = simulate(&p, &setup, &RELEASED);
    (p.guide_friction.coulomb, p.guide_friction.viscous) = (8.0, 4.0);
    let with = simulate(&p, &setup, &RELEASED);
    for element in [None, Some(&element[..])] {
        let ours = host::Ours { element, body: Some(&body), turned: false };
        let there = tempfile::tempdir().unwrap();
        for (name, bytes) in host::handed_back(of, 0, &[], &ours).unwrap() {
            std::fs::write(there.path().join(name), bytes).unwrap();
        }
        for name in ["system.toml", "system.ssp"] {
            let x = run(&there.path().join(name), there.path(), &setup.time);
            let (with, without) = (before_touch(&x, &with), before_touch(&x, &without));
            assert!(with < 0.02 * without, "{name}: {with:e} {without:e}");
            std::fs::remove_dir_all(there.path().join("after")).unwrap();
        }
    }
}

#[test]
fn friction_that_is_found_comes_back_in_a_system_that_holds_it() {
    let dir = campaign_of(|p| (p.guide_friction.coulomb, p.guide_friction.viscous) = (6.0, 0.0));
    let (v, _) = diagnosed(dir.path(), &["--in-process"]);
    let missing: Vec<&str> =
        v["missing"].as_array().unwrap().iter().map(|m| m["mechanism"].as_str().unwrap()).collect();
    assert_eq!(missing, ["guide_friction"]);
    assert_eq!(v["body_force"]["mechanisms"][0], "guide_friction");
    let friction = v["body_force"]["starts"]["friction"]["value"].as_f64().unwrap();
    assert!((friction / 6.0 - 1.0).abs() < 0.2, "{friction}");
    let next =
        v["next"].as_array().unwrap().iter().any(|n| n.as_str().unwrap().contains("BodyForce.fmu feeds bar.force"));
    assert!(next, "{}", v["next"]);
    let answer = std::fs::read_dir(dir.path().join("out")).unwrap().flatten();
    let handed = answer.map(|f| f.path().join("system")).find(|p| p.exists()).unwrap();
    assert!(handed.join("BodyForce.fmu").exists() && !handed.join("HysteresisContact.fmu").exists());
    let (mut p, setup) = rig(PRELOADS[0]);
    let without = simulate(&p, &setup, &RELEASED);
    p.guide_friction.coulomb = 6.0;
    let with = simulate(&p, &setup, &RELEASED);
    let x = run(&handed.join("system.toml"), dir.path(), &setup.time);
    let (with, without) = (before_touch(&x, &with), before_touch(&x, &without));
    assert!(with < 0.2 * without, "{with:e} {without:e}");
}
