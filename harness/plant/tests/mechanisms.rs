//! What every form of every mechanism owes the search, and that what extends a form holds it.

use mechanisms::load_history::LoadHistory;
use mechanisms::mechanism::Scales;
use mechanisms::mechanism::{Context, Form};
use mechanisms::physics::Physics;
use mechanisms::ALL;
use plant::chain::readings;
use plant::simulate::{simulate, Local, Setup};
use record::{largest, range, Kind};

fn context(kind: Kind) -> Context {
    let (p, setup, local) = recording(kind);
    let top = readings(&p, &simulate(&p, &setup, &local), &setup.time).map(|y| largest(&y));
    Context {
        kind,
        has: [true, kind != Kind::Indentation, true],
        scales: Scales {
            force: 900.0,
            depth: 1.2e-3,
            speed: 0.6,
            duration: 5e-3,
            mass: 0.8,
            length: 18e-3,
            dt: 2e-5,
            x_ref: 0.7e-3,
            v_ref: 0.6,
            orders: 10.0,
            peak: 900.0,
            deepest: 1.6e-3,
        },
        terms: Vec::new(),
        top,
        flat: None,
        ring: None,
    }
}

/// The second recording of a campaign of that kind.
fn recording(kind: Kind) -> (Physics, Setup, Local) {
    let time: Vec<f64> = (0..900).map(|i| f64::from(i) * 2e-5).collect();
    let mut p = Physics { mass: 0.8, ..Physics::default() };
    p.law.elastic.stiffness = 2e7;
    p.law.hysteresis_damping.coefficient = 8e6;
    let mut setup = Setup { history: LoadHistory::alike(1.0), ..Setup::drop_test(time, 1.2e-3, 0.6, 5e-3) };
    let mut local = Local { start: 2e-3, speed: 0.6, stiffness: 0.0, offset: 0.0 };
    setup.kind = kind;
    match kind {
        // a simulation without weight: it is one of the mechanisms
        Kind::DropTest | Kind::System => {}
        Kind::ContactorOpening => {
            (setup.travel, setup.preload, setup.rate) = (2e-3, 90.0, 9e3);
            local.start = 0.0;
        }
        Kind::Indentation => {
            let at = |t: f64| (1.2e-3 * (1.0 - (t / 9e-3 - 1.0).abs()), 1.2e-3 / 9e-3 * (9e-3 - t).signum());
            (setup.imposed, setup.imposed_rate) = setup.time.iter().map(|t| at(*t)).unzip();
        }
    }
    (p, setup, local)
}

/// What the chain reads of it with a form at `values`; None where the simulation fails.
fn read(form: &Form, values: &[f64], kind: Kind) -> Option<[Vec<f64>; 3]> {
    let (mut p, setup, local) = recording(kind);
    form.apply(values, &context(kind), &mut p);
    let trace = simulate(&p, &setup, &local);
    trace.ok.then(|| readings(&p, &trace, &setup.time))
}

/// Largest difference of any channel, in parts of its range.
fn apart(a: &[Vec<f64>; 3], b: &[Vec<f64>; 3]) -> f64 {
    let channel = |(a, b): (&Vec<f64>, &Vec<f64>)| {
        let difference = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        difference / range(b).max(1e-300)
    };
    a.iter().zip(b).map(channel).fold(0.0, f64::max)
}

/// The form another extends.
fn extended<'a>(forms: &'a [Form], form: &Form) -> &'a Form {
    let label = form.extends.expect("it extends one");
    forms.iter().find(|f| f.label == label).expect(label)
}

/// Values of all its parameters from which a form starts; those of the form it extends as that one starts first.
fn starts(forms: &[Form], form: &Form) -> Vec<Vec<f64>> {
    let lead = form.extends.map_or(Vec::new(), |_| starts(forms, extended(forms, form)).remove(0));
    form.starts.iter().map(|s| [lead.clone(), s.clone()].concat()).collect()
}

#[test]
fn what_no_parameter_moves_is_held() {
    let c = context(Kind::DropTest);
    let forms = mechanisms::named("contact_preload").expect("a mechanism").forms(&c);
    let t = &forms[0].starts[0];
    let names: Vec<_> = forms[0].describe(t, &c).into_iter().map(|q| q.0).collect();
    assert_eq!((names, forms[0].held(t, &c)), (vec!["contact_preload", "contact_preload_ramp"], vec![false, true]));
}

#[test]
fn every_form_starts_within_its_bounds_is_named_once_and_described_in_numbers() {
    for kind in Kind::BUILT_IN {
        let c = context(kind);
        for m in ALL {
            let forms = m.forms(&c);
            for (i, f) in forms.iter().enumerate() {
                let which = format!("{} ({}), {kind:?}", m.name, f.label);
                assert!(forms[i + 1..].iter().all(|g| g.label != f.label), "{which} is there twice");
                assert!(!f.starts.is_empty(), "{which} starts nowhere");
                // a simulation that holds a mechanism already takes its first form: behind the plain one stands what extends it
                let lead = f.extends.map_or(0, |_| extended(&forms[..i], f).parameters.len());
                for s in &f.starts {
                    assert_eq!(s.len() + lead, f.parameters.len(), "{which}");
                    for (v, q) in s.iter().zip(&f.parameters[lead..]) {
                        assert!(q.lower <= *v && *v <= q.upper, "{which}: {} = {v}", q.name);
                    }
                }
                for s in starts(&forms, f) {
                    let said = f.describe(&s, &c);
                    assert!(!said.is_empty() && said.iter().all(|(_, v, _)| v.is_finite()), "{which}: {said:?}");
                }
            }
        }
    }
}

#[test]
fn every_form_acts_on_what_is_read_from_one_of_its_starts() {
    for kind in Kind::BUILT_IN {
        let c = context(kind);
        let (bare, setup, local) = recording(kind);
        let none = readings(&bare, &simulate(&bare, &setup, &local), &setup.time);
        for m in ALL {
            let forms = m.forms(&c);
            for f in forms.iter().filter(|f| f.extends.is_none()) {
                let most = f.starts.iter().filter_map(|s| read(f, s, kind)).map(|y| apart(&y, &none));
                let most = most.fold(0.0, f64::max);
                assert!(most > 1e-5, "{} ({}), {kind:?}: {most:e}", m.name, f.label);
            }
        }
    }
}

#[test]
fn what_extends_a_form_is_that_form_where_its_further_parameters_are_neutral() {
    // value of the further parameters at which they change nothing, and how near the forms then are
    let neutral: [(&str, &[f64], f64); 20] = [
        ("hardening spring", &[0.0], 1e-12),
        ("neck near the surface, while leaving", &[9.0], 0.05),
        ("reading rings at two frequencies", &[0.6, 0.0], 1e-12),
        ("a share of it, first order", &[1.0], 1e-12),
        ("acceleration, a share of it, first order", &[1.0], 1e-12),
        ("quadratic, less beyond a speed", &[1.0, 0.0], 1e-12),
        ("quadratic, otherwise on the way back", &[1.0], 1e-12),
        ("force, hard, slow to recover", &[0.0], 1e-12),
        ("acceleration, hard, slow to recover", &[0.0], 1e-12),
        ("linear inner contact on both sides", &[1e3], 1e-12),
        ("inner contact of any power", &[1.0], 1e-12),
        ("inner contact of any power on both sides", &[1.0], 1e-12),
        ("gain, drifting by a power of the count", &[1.0], 1e-12),
        ("linear inner contact, its damping ramped in", &[-7.0], 0.02),
        ("any power", &[1.5], 1e-12),
        ("any power, over a width", &[1.5, 0.0], 1e-12),
        ("mass on a softening spring", &[0.0], 1e-12),
        ("force, two poles and a delay", &[0.0], 1e-12),
        ("acceleration, second order and a delay", &[0.0], 1e-12),
        // as many parameters, another course: only their meaning is shared
        ("growing with the contact, and a neck", &[], f64::INFINITY),
    ];
    let mut seen = 0;
    for kind in Kind::BUILT_IN {
        for m in ALL {
            let forms = m.forms(&context(kind));
            for f in forms.iter().filter(|f| f.extends.is_some()) {
                let which = format!("{} ({}), {kind:?}", m.name, f.label);
                let (_, further, near) = neutral.iter().find(|n| n.0 == f.label).unwrap_or_else(|| panic!("{which}"));
                let plain = extended(&forms, f);
                for (a, b) in plain.parameters.iter().zip(&f.parameters) {
                    assert_eq!((&a.name, a.lower, a.upper), (&b.name, b.lower, b.upper), "{which}");
                }
                for s in starts(&forms, plain).into_iter().take(3) {
                    let Some(want) = read(plain, &s, kind) else { continue };
                    let got = read(f, &[s.as_slice(), further].concat(), kind).expect(&which);
                    assert!(apart(&got, &want) <= *near, "{which} at {s:?}: {:e}", apart(&got, &want));
                    seen += 1;
                }
            }
        }
    }
    assert!(seen >= 30, "{seen}");
}

#[test]
fn the_clipping_level_told_is_the_one_that_acts() {
    let (c, clipping) = (context(Kind::DropTest), ALL.iter().find(|m| m.name == "clipping").expect("it is there"));
    for form in clipping.forms(&c).iter().filter(|f| f.extends.is_none()) {
        let mut p = Physics::default();
        form.apply(&form.starts[0], &c, &mut p);
        let stated = form.describe(&form.starts[0], &c)[0].1;
        assert!(
            (stated / p.clipping.level - 1.0).abs() < 1e-12,
            "{}: {stated} stated, {} acts",
            form.label,
            p.clipping.level
        );
    }
}
