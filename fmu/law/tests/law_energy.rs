//! The law's energies against an integral of its own force, and its forms against what their sources say.

use law::{Memory, Parameters, BRANCHES};

/// A seeded linear congruential generator on (0, 1).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn on(&mut self, x: f64) -> f64 {
        if self.next() < 0.5 {
            x * (0.2 + self.next())
        } else {
            0.0
        }
    }
}

/// Every mechanism on or off at random, sized for millimetres.
fn any_law(r: &mut Random) -> Parameters {
    let p = 1.0 + 3.0 * r.next();
    let k = 200.0 / 1e-3f64.powf(p);
    let values = [
        ("stiffness", k),
        ("exponent", p),
        ("hysteresis_damping", r.on(k)),
        ("damping_exponent_offset", if r.next() < 0.3 { 1.0 - p } else { 0.0 }),
        ("viscous_damping", r.on(30.0)),
        ("viscous_ramp", r.on(2e-4)),
        ("yield_penetration", 1e-4 + r.on(2e-4)),
        ("plastic_ratio", r.on(0.4)),
        ("plastic_form", (3.0 * r.next()).floor()),
        ("plastic_unloading_exponent", r.on(1.5).max(0.5)),
        ("plastic_damping_form", (2.0 * r.next()).floor()),
        ("adhesion_force", r.on(20.0)),
        ("adhesion_range", 2e-4),
        ("adhesion_form", (5.0 * r.next()).floor()),
        ("relaxation_stiffness", r.on(0.5 * k)),
        ("relaxation_time", 0.03),
        ("relaxation_spread", r.on(1.0)),
        ("secondary_stiffness", r.on(1e5)),
        ("secondary_depth", 5e-4),
    ];
    let mut q = Parameters::from_names(values).unwrap();
    // near the surface where it is full at once
    q.adhesion.depth = if q.adhesion.form == 3 { 3e-4 } else { 0.0 };
    // thinned where the damping ramps in
    q.viscous_damping.thinning_speed = if q.viscous_damping.ramp > 0.0 { 0.2 } else { 0.0 };
    q.hysteresis_damping.thinning_speed = if q.hysteresis_damping.exponent_offset == 0.0 { 0.3 } else { 0.0 };
    // of a layer's onsets, some at one depth and some over a width
    q.secondary_stiffening.width = if q.viscous_damping.ramp > 0.0 { 1.5e-4 } else { 0.0 };
    // a contact spring under preload where no neck is
    q.contact_preload.force = if q.adhesion.force == 0.0 { 8.0 } else { 0.0 };
    q.contact_preload.ramp = 2e-6;
    q.validate().unwrap();
    q
}

/// A smooth path that loads, unloads, separates and comes back: (x, v) at time t.
fn path(t: f64, w: [f64; 3]) -> (f64, f64) {
    let (a, b) = (7e-4, 3e-4);
    let x = a * (w[0] * t).sin() + b * (w[1] * t + w[2]).sin() - b * w[2].sin() - 1e-5;
    (x, a * w[0] * (w[0] * t).cos() + b * w[1] * (w[1] * t + w[2]).cos())
}

/// Integral of `f` over (a, b) by the three-point Gauss rule, halved at least three times and until
/// two halves agree with the whole.
fn adaptive(f: &dyn Fn(f64) -> f64, a: f64, b: f64, whole: f64, depth: u32) -> f64 {
    let mid = 0.5 * (a + b);
    let (left, right) = (gauss(f, a, mid), gauss(f, mid, b));
    if depth == 0 || depth < 28 && (left + right - whole).abs() < 1e-16 {
        return left + right;
    }
    adaptive(f, a, mid, left, depth - 1) + adaptive(f, mid, b, right, depth - 1)
}

fn gauss(f: &dyn Fn(f64) -> f64, a: f64, b: f64) -> f64 {
    let (mid, half) = (0.5 * (a + b), 0.5 * (b - a));
    let r = 0.6f64.sqrt() * half;
    half * (5.0 * f(mid - r) + 8.0 * f(mid) + 5.0 * f(mid + r)) / 9.0
}

/// Work of the force, J, over a step of straight x, v and branch forces.
fn work(p: &Parameters, m: &Memory, a: (f64, f64), b: (f64, f64), dt: f64) -> f64 {
    let end = p.advance(m, a.0, a.1, b.0, b.1, dt);
    let touch = if a.0 < 0.0 && b.0 > 0.0 { a.0 / (a.0 - b.0) } else { 0.0 };
    let power = |s: f64| {
        let mut here = *m;
        for i in 0..BRANCHES {
            here.relaxation[i] += ((s - touch) / (1.0 - touch)).max(0.0) * (end.relaxation[i] - m.relaxation[i]);
        }
        p.force(&here, a.0 + s * (b.0 - a.0), a.1 + s * (b.1 - a.1)) * (b.0 - a.0)
    };
    // the force jumps where the body touches the surface or its permanent set
    let jumps = [0.0, p.permanent_set(m.deepest)];
    let mut cuts: Vec<f64> = jumps.iter().map(|x| (x - a.0) / (b.0 - a.0)).filter(|s| *s > 0.0 && *s < 1.0).collect();
    cuts.extend([0.0, 1.0]);
    cuts.sort_by(f64::total_cmp);
    cuts.windows(2).map(|c| adaptive(&power, c[0], c[1], gauss(&power, c[0], c[1]), 30)).sum()
}

#[test]
fn the_balance_closes_to_1e_9_on_random_paths_of_random_laws() {
    let mut r = Random(2026);
    for law in 0..60 {
        let p = any_law(&mut r);
        let w = [6.0 + 20.0 * r.next(), 30.0 + 50.0 * r.next(), 6.0 * r.next()];
        let (mut m, mut integral, mut gross) = (Memory::default(), 0.0, 0.0f64);
        let (n, dt) = (20_000, 0.6 / 20_000.0);
        let mut a = path(0.0, w);
        m.stored = p.stored_energy(&m, a.0);
        m.work = m.stored;
        integral += m.work;
        for i in 1..=n {
            let b = path(dt * f64::from(i), w);
            let step = work(&p, &m, a, b, dt);
            integral += step;
            gross += step.abs();
            m = p.advance(&m, a.0, a.1, b.0, b.1, dt);
            a = b;
        }
        assert!(gross > 1e-3 && m.deepest > 2e-4, "the path must load the contact");
        let gap = (m.stored + m.dissipated() - integral).abs() / gross;
        assert!(gap < 1e-9, "law {law}: {gap:.1e} {p:?}");
    }
}

#[test]
fn the_balance_of_the_power_law_and_its_damping_closes_in_steps_of_any_size() {
    let mut r = Random(31);
    for case in 0..3000 {
        let p = 1.0 + 3.0 * r.next();
        let k = 200.0 / 1e-3f64.powf(p);
        let law = Parameters::power_law(k, p, r.on(k));
        let a = (1e-5 + 1e-3 * r.next(), 1.6 * r.next() - 0.8);
        let size = 10f64.powf(-9.0 * r.next());
        let b = (a.0 + size * (1e-5 + 1e-3 * r.next() - a.0), a.1 + size * (1.6 * r.next() - 0.8 - a.1));
        let m = law.start(a.0);
        let n = law.advance(&m, a.0, a.1, b.0, b.1, 1e-5);
        let integral = work(&law, &m, a, b, 1e-5);
        let scale = (law.force(&m, a.0, a.1).abs() + law.force(&m, b.0, b.1).abs()) * (b.0 - a.0).abs();
        let gap = (n.work - m.work - integral).abs();
        assert!(gap <= 1e-9 * scale + 1e-15 * m.work + 1e-16, "{case}: {gap:e} of {scale:e}, {a:?} {b:?} {law:?}");
    }
}

#[test]
fn heat_never_comes_back() {
    let mut r = Random(7);
    for law in 0..60 {
        // two clamps can make a Maxwell branch do work on the rest; it has its own test
        let mut p = any_law(&mut r);
        p.viscoelastic_relaxation.stiffness = 0.0;
        // at a turn x is straight while v changes sign within one step: hence the allowance; the neck is lossy over a cycle only
        if ![0, 2].contains(&p.adhesion.form) {
            p.adhesion.form = 0;
        }
        let w = [6.0 + 20.0 * r.next(), 30.0 + 50.0 * r.next(), 6.0 * r.next()];
        let mut a = path(0.0, w);
        let mut m = Memory::default();
        m.stored = p.stored_energy(&m, a.0);
        m.work = m.stored;
        for i in 1..=20_000 {
            let b = path(3e-5 * f64::from(i), w);
            let n = p.advance(&m, a.0, a.1, b.0, b.1, 3e-5);
            assert!(
                n.dissipated() >= m.dissipated() - 1e-9,
                "law {law} step {i}: {:e} {p:?}",
                n.dissipated() - m.dissipated()
            );
            m = n;
            a = b;
        }
    }
}

#[test]
fn the_force_never_pulls_without_adhesion() {
    let mut r = Random(99);
    let mut pushed = 0;
    for _ in 0..20_000 {
        let mut p = any_law(&mut r);
        p.adhesion.force = 0.0;
        let m = Memory { deepest: 1e-3 * r.next(), relaxation: [10.0 * r.next() - 5.0; BRANCHES], ..Memory::default() };
        let f = p.force(&m, 1.2e-3 * r.next() - 1e-4, 10.0 * r.next() - 5.0);
        assert!(f >= 0.0 && f.is_finite());
        pushed += i32::from(f > 0.0);
    }
    assert!(pushed > 5000);
}

#[test]
fn derivatives_are_those_of_the_force_for_any_law() {
    let mut r = Random(5);
    let mut checked = 0;
    while checked < 5000 {
        let p = any_law(&mut r);
        let m = Memory { deepest: 1e-3 * r.next(), relaxation: [10.0 * r.next(); BRANCHES], ..Memory::default() };
        let (x, v) = (1.2e-3 * r.next() - 1e-4, 2.0 * r.next() - 1.0);
        let h = 1e-9;
        let kinks = [
            0.0,
            p.viscous_damping.ramp,
            p.permanent_set(m.deepest),
            m.deepest,
            p.secondary_stiffening.depth,
            p.secondary_stiffening.depth + p.secondary_stiffening.width,
        ];
        let clear = kinks.iter().all(|k| (x - k).abs() > 2e-5);
        let f = p.force(&m, x, v);
        let mut q = p;
        q.adhesion.force = 0.0;
        let pull = q.force(&m, x, v);
        if !clear || (pull > 0.0 && pull < 0.1) {
            continue;
        }
        checked += 1;
        let (fx, fv) = p.derivatives(&m, x, v);
        let dx = (p.force(&m, x + h, v) - p.force(&m, x - h, v)) / (2.0 * h);
        let dv = (p.force(&m, x, v + 1e-6) - p.force(&m, x, v - 1e-6)) / 2e-6;
        assert!((fx - dx).abs() <= 1e-5 * (f.abs() / 1e-4 + dx.abs() + 1.0), "{fx} {dx} {x} {v} {p:?}");
        assert!((fv - dv).abs() <= 1e-6 * (f.abs() + dv.abs() + 1.0), "{fv} {dv} {p:?}");
    }
}

/// Runs straight to `depth` and back out to -1e-4 m in `n` steps, quickly enough for nothing to relax.
fn in_and_out(p: &Parameters, depth: f64, n: i32) -> Memory {
    let mut m = Memory::default();
    let at =
        |i: i32| depth * (1.0 - (f64::from(i) / f64::from(n)).abs()) - 1e-4 * (f64::from(i) / f64::from(n)).max(0.0);
    for i in -n..n {
        m = p.advance(&m, at(i), 0.0, at(i + 1), 0.0, 1e-9);
    }
    m
}

#[test]
fn plastic_loss_is_the_area_between_the_curves() {
    let k = 1e5;
    let linear = [("stiffness", k), ("exponent", 1.0), ("plastic_ratio", 0.36), ("plastic_form", 1.0)];
    let linear = Parameters::from_names(linear).unwrap();
    let d = 1e-3;
    let m = in_and_out(&linear, d, 100);
    assert!((m.dissipated() - 0.36 * 0.5 * k * d * d).abs() < 1e-12 * k * d * d);
    assert!((linear.permanent_set(d) - 0.36 * d).abs() < 1e-18 && m.stored == 0.0);

    // permanent set with power n: W = k d^(p+1)/(p+1), back comes F(d) (d - x_r)/(n + 1)
    let mut p = Parameters::power_law(3e6, 1.5, 0.0);
    p.plastic_indentation.ratio = 0.3;
    p.plastic_indentation.yield_penetration = 2e-4;
    p.plastic_indentation.unloading_exponent = 2.0;
    let top = 3e6 * 1e-3f64.powf(1.5);
    let wanted = top * 1e-3 / 2.5 - top * (1e-3 - 0.3 * 8e-4) / 3.0;
    assert!((in_and_out(&p, d, 100).dissipated() / wanted - 1.0).abs() < 1e-12);

    // Thornton: F at d on the tangent at y; unloading meets it
    let mut t = p;
    (t.plastic_indentation.form, t.plastic_indentation.ratio) = (2, 0.5);
    let y: f64 = 2e-4;
    let top = 3e6 * (y.powf(1.5) + 1.5 * y.sqrt() * (1e-3 - y));
    let m = Memory { deepest: d, ..Memory::default() };
    assert!((t.force(&m, d, 0.0) / top - 1.0).abs() < 1e-12);
    assert!((t.force(&m, d * (1.0 - 1e-12), 0.0) / top - 1.0).abs() < 1e-10);
    let set = t.permanent_set(d);
    assert!(set > 0.0 && t.force(&m, set, 0.0) == 0.0);
    // with the radius grown: k_u = k sqrt(elastic load/load)
    let ku = 3e6 * (3e6 * d.powf(1.5) / top).sqrt();
    assert!((t.force(&m, 0.9e-3, 0.0) / (ku * (0.9e-3 - set).powf(1.5)) - 1.0).abs() < 1e-9);

    // Walton and Braun's straight return, cut off by the loading curve k x^p: below the crossing the line, above it
    // what loading was; back comes the area under the lower of the two
    let mut w = p;
    (w.plastic_indentation.form, w.plastic_indentation.ratio) = (1, 0.2);
    w.plastic_indentation.yield_penetration = 0.0;
    let m = Memory { deepest: d, ..Memory::default() };
    let (line, curve) = (|x: f64| 3e6 * d.powf(1.5) * (x - 2e-4) / 8e-4, |x: f64| 3e6 * x.powf(1.5));
    let n = 200_000;
    let mut back = 0.0;
    for i in 0..n {
        let x = 2e-4 + 8e-4 * (f64::from(i) + 0.5) / f64::from(n);
        let lower = line(x).min(curve(x));
        assert!((w.force(&m, x, 0.0) - lower).abs() < 1e-9 * line(d));
        back += lower * 8e-4 / f64::from(n);
    }
    let wanted = curve(d) * d / 2.5 - back;
    assert!((in_and_out(&w, d, 100).dissipated() / wanted - 1.0).abs() < 1e-8);
}

#[test]
fn a_branch_held_turns_its_energy_to_heat_and_never_stores_less_than_nothing() {
    let p = Parameters::from_names([("relaxation_stiffness", 1e8), ("relaxation_time", 1e-3)]).unwrap();
    let mut m = Memory::default();
    for i in 0..2000 {
        let at = |i: i32| 1e-3 * f64::from(i) / 2000.0;
        m = p.advance(&m, at(i), 0.0, at(i + 1), 0.0, 1e-15);
    }
    let elastic = 1e8 * 1e-3f64.powf(2.5) / 2.5;
    assert!((m.stored / (2.0 * elastic) - 1.0).abs() < 1e-6);
    let mut heat = m.dissipated();
    for _ in 0..50 {
        m = p.advance(&m, 1e-3, 0.0, 1e-3, 0.0, 1e-3);
        assert!(m.stored >= elastic * (1.0 - 1e-13) && m.dissipated() >= heat - 1e-13 * elastic);
        heat = m.dissipated();
    }
    assert!((heat / elastic - 1.0).abs() < 1e-6);
}

#[test]
fn forms_of_adhesion_pull_where_they_say() {
    let p = |form| {
        let mut p = Parameters::power_law(1e-9, 1.5, 0.0);
        (p.adhesion.force, p.adhesion.range, p.adhesion.form) = (5.0, 1e-4, form);
        p
    };
    let virgin = Memory::default();
    let after = Memory { deepest: 1e-3, ..Memory::default() };
    // before touch
    assert_eq!(p(0).force(&virgin, -5e-5, 1.0), 0.0);
    assert_eq!(p(1).force(&virgin, -5e-5, 1.0), 0.0);
    assert!((p(2).force(&virgin, -5e-5, 1.0) + 2.5).abs() < 1e-12);
    // going in
    assert!((p(0).force(&virgin, 1e-4, 1.0) + 5.0 * (1.0 - (-1f64).exp())).abs() < 1e-9);
    assert!(p(1).force(&virgin, 1e-4, 1.0).abs() < 1e-9);
    assert!((p(2).force(&virgin, 1e-4, 1.0) + 5.0).abs() < 1e-9);
    // leaving
    assert!((p(1).force(&after, 9e-4, -1.0) + 5.0 * (1.0 - (-1f64).exp())).abs() < 1e-9);
    assert!((p(1).force(&after, -5e-5, -1.0) + 2.5).abs() < 1e-3);
    assert_eq!(p(1).force(&after, -1.1e-4, -1.0), 0.0);
    // near the surface only
    let mut near = p(3);
    near.adhesion.depth = 2e-4;
    assert!((near.force(&after, 2e-4, -1.0) + 5.0 * (-1f64).exp()).abs() < 1e-9);
    assert!((near.force(&after, -5e-5, -1.0) + 2.5).abs() < 1e-9);
    // growing with the contact going in, by the exponent's half; leaving, the neck reaches R at the surface
    let grows = p(4);
    assert!((grows.force(&virgin, 2e-4, 1.0) + 5.0 * 2f64.powf(0.75)).abs() < 1e-9);
    assert!((grows.force(&after, 1e-3, -1.0) - grows.force(&virgin, 1e-3, -1.0)).abs() < 1e-9);
    assert!((grows.force(&after, 5e-4, -1.0) + 5.0 * 5.5f64.powf(0.75)).abs() < 1e-9);
    assert!((grows.force(&after, 0.0, -1.0) + 5.0).abs() < 1e-9);
    assert!((grows.force(&after, -5e-5, -1.0) + 5.0 * 0.5f64.powf(0.75)).abs() < 1e-9);
    assert_eq!(grows.force(&after, -1.1e-4, -1.0), 0.0);
    assert_eq!(grows.force(&virgin, -5e-5, 1.0), 0.0);
    // once broken, the neck is not there on the way back
    let broken = p(1).advance(&after, 0.0, -1.0, -2e-4, -1.0, 2e-4);
    assert_eq!(p(1).force(&broken, -5e-5, 1.0), 0.0);
    assert!(p(1).force(&broken, 1e-4, 1.0).abs() < 1e-9);
    let again = p(1).advance(&broken, -2e-4, 1.0, 3e-4, 1.0, 5e-4);
    assert!(p(1).force(&again, 2e-4, -1.0) < -3.0);
}

#[test]
fn a_contact_found_loaded_starts_with_the_work_that_loaded_it() {
    let values = [("stiffness", 3e6), ("plastic_ratio", 0.3), ("yield_penetration", 2e-4)];
    let p = Parameters::from_names(values).unwrap();
    let (a, b) = (p.start(1e-3), p.advance(&Memory::default(), 0.0, 0.0, 1e-3, 0.0, 1.0));
    assert!((a.work / b.work - 1.0).abs() < 1e-14 && (a.stored / b.stored - 1.0).abs() < 1e-14);
    assert_eq!(p.start(-1e-3), Memory::default());
}
