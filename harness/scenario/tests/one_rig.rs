//! A scenario and a recording that a diagnosis simulates are the same motion, to the last bit where both are asked with
//! the same control.

use host::Direct;
use law::impact::impact;
use mechanisms::physics::Physics;
use mechanisms::residual_magnetism::ResidualMagnetism;
use mechanisms::sensor_resonance::Tip;
use plant::integrate::Control;
use plant::simulate::{simulate as recorded, Local, Setup, Trace, TOLERANCE};
use record::Kind;
use scenario::{simulate, Case, Outcome, Scenario, CONTROL, GRAVITY};

const LAW: &str = "[contact]\nstiffness = 1e8\nexponent = 1.5\nhysteresis_damping = 3e7\n";

fn scenario(text: &str) -> (Case, Outcome) {
    let c = text.parse::<Scenario>().unwrap().cases().remove(0);
    let o = simulate(&c, &mut Direct::new(c.law), &mut |_| true).unwrap();
    (c, o)
}

/// The recording of a scenario, sampled at the times of its rows and once more long after, so that no step is cut short
/// by its end.
fn recording(o: &Outcome, p: &Physics, s: &Setup, speed: f64) -> Trace {
    let mut time: Vec<f64> = o.rows.iter().map(|r| r.time).collect();
    time.push(time[time.len() - 1] + 0.1);
    let local = Local { start: 0.0, speed, stiffness: 0.0, offset: 0.0 };
    let t = recorded(p, &Setup { time, ..s.clone() }, &local);
    assert!(t.ok && o.rows.len() > 100, "{}", o.rows.len());
    t
}

fn same_bits(o: &Outcome, t: &Trace) {
    for (i, r) in o.rows.iter().enumerate() {
        for (what, a, b) in [
            ("position", r.state[0], t.position[i]),
            ("velocity", r.state[1], t.velocity[i]),
            ("force", r.force, t.force[i]),
        ] {
            assert_eq!(a.to_bits(), b.to_bits(), "{what} at row {i}, {} s: {a:e} and {b:e}", r.time);
        }
    }
}

/// A drop test and its recording: three impacts of 0.7 m/s with weight and friction of the guide.
fn drop_test(more: &str, change: impl Fn(&mut Physics), control: Control) -> (Outcome, Trace) {
    let text = format!(
        "kind = \"drop_test\"\nmass = 0.8\nimpact_speed = 0.7\ngravity = true\nguide_friction = 0.4\nimpacts = 3\n{LAW}{more}"
    );
    let (c, o) = scenario(&text);
    assert_eq!(o.bounces.len(), 3);
    let mut p = Physics { law: c.law, mass: 0.8, gravity: GRAVITY, ..Physics::default() };
    p.guide_friction.coulomb = 0.4;
    change(&mut p);
    let t = recording(&o, &p, &Setup { control, ..Setup::drop_test(Vec::new(), 3e-4, 0.7, 1e-3) }, 0.7);
    (o, t)
}

#[test]
fn a_drop_test_is_the_same_to_the_last_bit() {
    let (o, t) = drop_test("", |_| {}, CONTROL);
    same_bits(&o, &t);
    let b = &o.bounces[0];
    assert_eq!([b.touch, b.separation.unwrap()], [t.touch, t.leave]);
    // another friction is another motion
    let (o, t) = drop_test("", |p| p.guide_friction.coulomb = 0.400_001, CONTROL);
    assert!(o.rows.iter().zip(&t.velocity).any(|(r, v)| r.state[1] != *v));
}

#[test]
fn contacts_with_a_memory_are_the_same_to_the_last_bit() {
    for more in [
        "plastic_ratio = 0.4\nyield_penetration = 2e-5\n",
        "relaxation_stiffness = 4e7\nrelaxation_time = 1e-4\nrelaxation_exponent = 1.5\n",
        "adhesion_force = 4.0\nadhesion_range = 2e-6\n",
    ] {
        let (o, t) = drop_test(more, |_| {}, CONTROL);
        same_bits(&o, &t);
    }
}

#[test]
fn what_acts_on_the_way_is_the_same_to_the_last_bit() {
    let more = "[motion.fluid_drag]\ndrag = 0.9\ndrag_back = 1.4\n[motion.squeeze_film]\nsqueeze_film = 2.0\nsqueeze_gap = 1e-4\n\
                [motion.return_spring]\nspring_preload = 1.5\nspring_rate = 300.0\n\
                [motion.guide_friction]\nfriction_viscous = 0.2\nstribeck_excess = 0.5\n";
    let put = |p: &mut Physics| {
        (p.fluid_drag.coefficient, p.fluid_drag.back) = (0.9, 1.4);
        (p.squeeze_film.coefficient, p.squeeze_film.gap) = (2.0, 1e-4);
        (p.return_spring.preload, p.return_spring.rate) = (1.5, 300.0);
        (p.guide_friction.viscous, p.guide_friction.stribeck_excess) = (0.2, 0.5);
    };
    let (o, t) = drop_test(more, put, CONTROL);
    // a film before the transducer pushes on it as well
    let free = Trace { force: o.rows.iter().map(|r| r.force).chain([0.0]).collect(), ..t.clone() };
    same_bits(&o, &free);
    assert!(o.rows.iter().zip(&t.force).any(|(r, f)| r.force != *f));
    assert!(o.balance.residual_of_motion < 1e-7, "{:?}", o.balance);
    let (plain, _) = drop_test("", |_| {}, CONTROL);
    let apart = |a: &Outcome| a.bounces[0].rebound_height.unwrap();
    assert!(apart(&o) < 0.9 * apart(&plain), "{} {}", apart(&o), apart(&plain));
}

/// A contactor opening and its recording: two impacts, against a holding force that fades.
fn opening(control: Control) -> (Outcome, Trace) {
    let text = format!(
        "kind = \"contactor_opening\"\nmass = 0.5\ntravel = 0.004\nspring_preload = 12.3\nreturn_spring_rate = 900.0\n\
         holding_force = 9.0\nholding_time = 0.002\nguide_friction = 0.3\nimpacts = 2\n{LAW}"
    );
    let (c, o) = scenario(&text);
    assert_eq!(o.bounces.len(), 2);
    let mut p = Physics { law: c.law, mass: 0.5, ..Physics::default() };
    p.guide_friction.coulomb = 0.3;
    p.residual_magnetism = ResidualMagnetism { force: 9.0, gap: f64::INFINITY, time: 0.002 };
    let drop = Setup::drop_test(Vec::new(), 2e-4, 0.4, 1e-3);
    let s = Setup { kind: Kind::ContactorOpening, travel: 0.004, preload: 12.3, rate: 900.0, control, ..drop };
    let t = recording(&o, &p, &s, 0.0);
    (o, t)
}

#[test]
fn a_contactor_opening_is_the_same_to_the_last_bit() {
    let (o, t) = opening(CONTROL);
    same_bits(&o, &t);
    assert_eq!([o.bounces[0].touch, o.bounces[0].separation.unwrap()], [t.touch, t.leave]);
}

/// Largest difference of force, and of position and velocity, over their ranges.
fn apart(o: &Outcome, t: &Trace) -> f64 {
    let of = |a: &dyn Fn(usize) -> f64, b: &[f64]| {
        let range = (0..o.rows.len()).fold(0.0f64, |m, i| m.max(a(i).abs()));
        (0..o.rows.len()).fold(0.0f64, |m, i| m.max((a(i) - b[i]).abs())) / range
    };
    of(&|i| o.rows[i].force, &t.force)
        .max(of(&|i| o.rows[i].state[0], &t.position))
        .max(of(&|i| o.rows[i].state[1], &t.velocity))
}

#[test]
fn with_an_estimations_control_they_differ_by_its_tolerance() {
    let control = Control::dense(TOLERANCE);
    for (o, t) in [drop_test("", |_| {}, control), opening(control)] {
        let off = apart(&o, &t);
        assert!(off < 3e-4 && off > 1e-12, "{off}");
    }
    // and by less with a finer one
    let control = Control::dense(1e-3 * TOLERANCE);
    for (o, t) in [drop_test("", |_| {}, control), opening(control)] {
        let off = apart(&o, &t);
        assert!(off < 1e-6, "{off}");
    }
}

#[test]
fn a_tip_before_a_transducer_rings_alike() {
    let text = format!(
        "kind = \"drop_test\"\nmodel = \"three_mass\"\nimpact_speed = 0.7\ngravity = true\n[masses]\n\
         accelerometer = 1e-9\nbody = 0.7\ntip = 0.1\n[sensors]\naccelerometer_stiffness = 1e2\n\
         transducer_stiffness = 3e7\ntransducer_damping_ratio = 0.02\n{LAW}"
    );
    let (c, o) = scenario(&text);
    let mut p = Physics { law: c.law, mass: 0.8, gravity: GRAVITY, ..Physics::default() };
    p.sensor_resonance = Tip { mass: 0.1, stiffness: 3e7, damping: 2.0 * 0.02 * (3e7f64 * 0.1).sqrt() };
    for (control, within) in [(CONTROL, 1e-7), (Control::dense(TOLERANCE), 2e-4)] {
        let t = recording(&o, &p, &Setup { control, ..Setup::drop_test(Vec::new(), 3e-4, 0.7, 1e-3) }, 0.7);
        let read: Vec<(f64, f64)> = o.rows.iter().map(|r| (c.rig.sensors(&r.state).unwrap().0, r.state[2])).collect();
        let top = read.iter().fold((0.0f64, 0.0f64), |m, r| (m.0.max(r.0), m.1.max(r.1)));
        for (i, r) in read.iter().enumerate() {
            assert!((r.0 - t.force[i]).abs() < within * top.0, "force {i}: {} {}", r.0, t.force[i]);
            assert!((r.1 - t.position[i]).abs() < within * top.1, "position {i}: {} {}", r.1, t.position[i]);
        }
    }
}

#[test]
fn both_are_the_exact_impact() {
    let (m, v) = (1.3, 0.9);
    let text = format!("kind = \"drop_test\"\nmass = {m:?}\nimpact_speed = {v:?}\n{LAW}");
    let (c, o) = scenario(&text);
    let e =
        impact(m, v, c.law.elastic.stiffness, c.law.elastic.exponent, c.law.hysteresis_damping.coefficient).unwrap();
    let b = &o.bounces[0];
    let close = |got: f64, wanted: f64, within: f64| {
        assert!((got / wanted - 1.0).abs() < within, "{got} for {wanted}: {:.1e}", got / wanted - 1.0);
    };
    close(b.restitution, e.restitution, 1e-9);
    close(b.deepest, e.deepest, 1e-9);
    close(b.duration, e.duration, 1e-9);
    close(b.peak_force, e.peak_force, 1e-9);
    let p = Physics { law: c.law, mass: m, ..Physics::default() };
    for (control, within) in [(CONTROL, 1e-9), (Control::dense(TOLERANCE), 2e-5)] {
        let s = Setup { control, ..Setup::drop_test(Vec::new(), e.deepest, v, e.duration) };
        let t = recording(&o, &p, &s, v);
        close(t.leave - t.touch, e.duration, within);
        close(-t.velocity[o.rows.len() - 1] / v, e.restitution, within);
        let row = |time: f64| o.rows.iter().position(|r| r.time == time).unwrap();
        close(t.force[row(b.peak_time)], e.peak_force, within);
        let turn = o.events.iter().find(|e| e.what == "deepest").unwrap().time;
        close(t.position[row(turn)], e.deepest, within);
    }
}
