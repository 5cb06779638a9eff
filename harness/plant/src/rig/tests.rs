use crate::integrate::Control;
use crate::simulate::{simulate, Local, Setup};
use mechanisms::physics::Physics;
use record::Kind;

fn rig() -> (Physics, Setup, Local) {
    let mut p = Physics { mass: 0.8, gravity: 9.81, ..Physics::default() };
    p.law.elastic.stiffness = 2e7;
    p.law.elastic.exponent = 1.5;
    p.law.hysteresis_damping.coefficient = 8e6;
    let setup = Setup {
        control: Control::dense(1e-9),
        ..Setup::drop_test((0..900).map(|i| i as f64 * 2e-5).collect(), 1e-3, 0.6, 5e-3)
    };
    (p, setup, Local { start: 2e-3, speed: 0.6, stiffness: 0.0, offset: 0.0 })
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    let top = a.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / top
}

#[test]
fn a_swing_in_closed_form_is_the_one_integrated() {
    let (bare, setup, local) = rig();
    for what in 0..3 {
        let mut p = bare;
        let (m, w) = (0.05, 6000.0);
        if what == 0 {
            (p.sensor_resonance.mass, p.sensor_resonance.stiffness, p.sensor_resonance.damping) =
                (m, m * w * w, 0.06 * m * w);
        } else {
            (p.base_compliance.mass, p.base_compliance.stiffness, p.base_compliance.damping) =
                (m, m * w * w, 0.06 * m * w);
            p.base_compliance.reads = what == 2;
        }
        let closed = simulate(&p, &setup, &local);
        // a film too thin to act keeps the closed form from being used
        p.squeeze_film.coefficient = 1e-200;
        let integrated = simulate(&p, &setup, &local);
        assert!(closed.ok && integrated.ok);
        let worst = [
            apart(&integrated.force, &closed.force),
            apart(&integrated.acceleration, &closed.acceleration),
            apart(&integrated.position, &closed.position),
        ];
        assert!(worst.iter().all(|w| *w < 1e-5), "{what}: {worst:?}");
        // and it rings on after the contact where the transducer is what swings
        let last = closed.force[850].abs().max(closed.force[851].abs()).max(closed.force[853].abs());
        assert_eq!(last > 1e-6, what != 1, "{what}: {last}");
    }
}

#[test]
fn a_film_beside_the_transducer_moves_the_body_alike_and_reads_nothing() {
    let (mut p, setup, local) = rig();
    (p.squeeze_film.coefficient, p.squeeze_film.gap) = (5.0, 1e-4);
    let under = simulate(&p, &setup, &local);
    p.squeeze_film.reads = false;
    let beside = simulate(&p, &setup, &local);
    assert_eq!(under.position, beside.position);
    for i in 0..setup.time.len() {
        let film = p.squeeze_film.coefficient * under.velocity[i] * 1e-4 / ((-under.position[i]).max(0.0) + 1e-4);
        assert!((under.force[i] - beside.force[i] - film).abs() < 1e-9, "{i}");
    }
    assert!(under.force.iter().zip(&beside.force).any(|(a, b)| (a - b).abs() > 1.0));
}

#[test]
fn a_hardening_stop_begins_as_the_linear_one_and_gives_less_a_softening_one_more() {
    let (mut p, setup, local) = rig();
    (p.base_compliance.mass, p.base_compliance.stiffness, p.base_compliance.damping) = (0.4, 2e5, 5.0);
    let linear = simulate(&p, &setup, &local);
    p.base_compliance.hardening = 1e-6;
    assert!(apart(&linear.force, &simulate(&p, &setup, &local).force) < 1e-5);
    p.base_compliance.hardening = 1e6;
    let hard = simulate(&p, &setup, &local);
    let deepest = |x: &[f64]| x.iter().cloned().fold(f64::MIN, f64::max);
    assert!(hard.ok && deepest(&hard.position) < 0.95 * deepest(&linear.position));
    p.base_compliance.hardening = -1e-6;
    assert!(apart(&linear.force, &simulate(&p, &setup, &local).force) < 1e-5);
    p.base_compliance.hardening = -1e6;
    let soft = simulate(&p, &setup, &local);
    assert!(soft.ok && deepest(&soft.position) > 1.05 * deepest(&linear.position));
}

#[test]
fn drag_of_a_power_is_quadratic_at_two() {
    let (mut p, setup, local) = rig();
    p.fluid_drag.coefficient = 3.0;
    let quadratic = simulate(&p, &setup, &local);
    p.fluid_drag.power = 2.0 + 1e-9;
    assert!(apart(&quadratic.acceleration, &simulate(&p, &setup, &local).acceleration) < 1e-6);
    // at 0.6 m/s a lower power drags more
    p.fluid_drag.power = 1.6;
    assert!(simulate(&p, &setup, &local).first_speed > quadratic.first_speed);
}

#[test]
fn drag_past_its_crisis_is_a_share_of_what_it_was() {
    let (mut p, setup, local) = rig();
    let first = |p: &Physics| simulate(p, &setup, &local).first_speed;
    p.fluid_drag.coefficient = 3.0;
    let whole = first(&p);
    let mut less = p;
    less.fluid_drag.coefficient = 1.2;
    let share = first(&less);
    (p.fluid_drag.crisis_speed, p.fluid_drag.beyond) = (Some(0.06), 0.4);
    assert!((first(&p) - share).abs() < 1e-6 * share, "far above it");
    p.fluid_drag.crisis_speed = Some(6.0);
    assert!((first(&p) - whole).abs() < 1e-6 * whole, "far below it");
}

#[test]
fn a_spring_drives_the_loose_part_along_until_the_stop_and_the_part_strikes() {
    let (mut p, drop, mut local) = rig();
    p.gravity = 0.0;
    let setup = Setup { kind: Kind::ContactorOpening, travel: 2e-3, preload: 40.0, rate: 4e3, ..drop };
    local.start = 0.0;
    let whole = simulate(&p, &setup, &local);
    (p.loose_part.mass, p.loose_part.gap, p.loose_part.stiffness, p.loose_part.damping) = (0.08, 2e-4, 4e7, 200.0);
    p.loose_part.back = 0.0;
    let split = simulate(&p, &setup, &local);
    assert!(whole.ok && split.ok && whole.touch < setup.time[890]);
    // the whole mass is moved until the touch ...
    assert!((split.touch / whole.touch - 1.0).abs() < 1e-5, "{} {}", split.touch, whole.touch);
    // ... and the part gives its push late
    let body = p.mass - p.loose_part.mass;
    let force = |i: usize| {
        let drive = setup.preload - setup.rate * (split.position[i] + setup.travel);
        body * split.acceleration[i] + split.force[i] - drive
    };
    let strike = (0..900).max_by(|a, b| force(*a).total_cmp(&force(*b))).unwrap();
    let flight = split.velocity.iter().fold(0.0f64, |m, v| m.max(*v));
    assert!(setup.time[strike] > split.touch && force(strike) > 0.5 * flight * (4e7f64 * 0.08).sqrt());
}

#[test]
fn a_part_loose_both_ways_bounces_between_its_walls() {
    let (mut p, setup, local) = rig();
    p.gravity = 0.0;
    (p.loose_part.mass, p.loose_part.gap, p.loose_part.stiffness, p.loose_part.damping) = (0.08, 2e-4, 4e7, 0.0);
    let pushed = |p: &Physics| -> (f64, f64) {
        let t = simulate(p, &setup, &local);
        assert!(t.ok);
        let body = p.mass - p.loose_part.mass;
        let force = t.acceleration.iter().zip(&t.force).map(|(a, f)| body * a + f);
        force.fold((0.0f64, 0.0f64), |(low, high), f| (low.min(f), high.max(f)))
    };
    let one = pushed(&p);
    p.loose_part.back = 3e-4;
    let two = pushed(&p);
    // the wall before it is struck either way, the one behind only where there is one
    assert!(one.1 > 100.0 && (two.1 / one.1 - 1.0).abs() < 1e-6, "{one:?} {two:?}");
    assert!(one.0 > -1e-6 && two.0 < -100.0, "{one:?} {two:?}");
}

#[test]
fn a_body_that_bears_its_loose_part_falls_faster_than_gravity() {
    let (mut p, setup, local) = rig();
    (p.loose_part.mass, p.loose_part.gap, p.loose_part.stiffness, p.loose_part.damping) = (0.16, 1e-5, 1e6, 10.0);
    for (borne, want) in [(false, 0.0), (true, 9.81 * 0.16 / 0.64)] {
        p.loose_part.borne = borne;
        let t = simulate(&p, &setup, &local);
        assert!(t.ok);
        // before touch the reading is what the body falls faster than gravity
        assert!((t.acceleration[10] - want).abs() < 1e-9, "{borne} {}", t.acceleration[10]);
        assert!(t.force.iter().fold(0.0f64, |m, f| m.max(*f)) > 100.0);
    }
}

#[test]
fn an_attached_mass_keeps_momentum_and_rings_at_its_own_frequency() {
    let (mut p, setup, local) = rig();
    p.gravity = 0.0;
    p.law.hysteresis_damping.coefficient = 0.0;
    let alone = simulate(&p, &setup, &local);
    let (m, w) = (0.2, 3000.0);
    (p.attached_mass.mass, p.attached_mass.stiffness) = (m, m * w * w);
    let t = simulate(&p, &setup, &local);
    assert!(alone.ok && t.ok);
    // the impulse of the contact goes into both: the body alone swings about the centre of mass behind it
    let dt = setup.time[1] - setup.time[0];
    let impulse: f64 = t.force.iter().sum::<f64>() * dt;
    let after: Vec<f64> = (0..900).filter(|i| setup.time[*i] > t.leave).map(|i| t.velocity[i]).collect();
    // a whole number of periods of the free pair, m (M - m)/M on the spring
    let period = std::f64::consts::TAU / (w * (0.8 / (0.8 - m)).sqrt());
    let whole = (after.len() as f64 * dt / period).floor() * period / dt;
    let mean = after.iter().take(whole.round() as usize).sum::<f64>() / whole.round();
    assert!((impulse - 0.8 * (0.6 - mean)).abs() < 2e-3 * impulse, "{impulse} {mean}");
    let (high, low) = after.iter().fold((f64::MIN, f64::MAX), |(h, l), v| (h.max(*v), l.min(*v)));
    assert!(high - low > 0.02, "it rings: {}", high - low);
    // as stiff as it gets it is one with the body
    p.attached_mass.stiffness = m * 2e5f64.powi(2);
    let stiff = simulate(&p, &setup, &local);
    assert!(apart(&alone.position, &stiff.position) < 2e-3);
}
