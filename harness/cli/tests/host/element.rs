//! Contact elements made of somebody else's FMU, by each coupling.

use crate::spring;
use host::{Coupling, Element, FmuElement, Names};

fn names() -> Names {
    Names { penetration: "depth".into(), velocity: Some("speed".into()), force: "push".into() }
}

fn parameters(more: &[(&str, f64)]) -> Vec<(String, f64)> {
    let all = [("rate", 2000.0), ("dash", 3.0), ("tau", 0.01)];
    all.iter().chain(more).map(|(n, x)| (n.to_string(), *x)).collect()
}

/// Force of the spring: rate (x - creep) + dash v.
fn exact(x: f64, v: f64, creep: f64) -> f64 {
    2000.0 * (x - creep) + 3.0 * v
}

/// Creep at the end of a step in which the depth goes from x0 to x1 evenly.
fn crept(creep: f64, x0: f64, x1: f64, h: f64) -> f64 {
    let (tau, slope) = (0.01, (x1 - x0) / h);
    x1 - slope * tau + (creep - x0 + slope * tau) * (-h / tau).exp()
}

#[test]
fn an_fmu_that_must_be_stepped_is_tried_and_taken_back() {
    let f = spring::able();
    let mut e = FmuElement::new(&f, &parameters(&[]), &names()).unwrap();
    assert_eq!(e.coupling(), Coupling::Trial { step: 1e-9 });
    let (mut creep, mut x) = (0.0, 0.0);
    for n in 0..50 {
        let (x1, v) = (1e-3 * (f64::from(n) * 0.1).sin(), 0.2);
        for wild in [-1.0, 0.5, 1e-4] {
            let got = e.force(wild, -v).unwrap();
            assert!((got - exact(wild, -v, creep)).abs() < 1e-3, "{got}");
        }
        e.advance((x, v), (x1, v), 2e-3).unwrap();
        creep = crept(creep, x, x1, 2e-3);
        x = x1;
        assert!((e.real("creep").unwrap() - creep).abs() < 1e-15);
        // the trial step is short, yet a step: it moves the creep by some 1e-7 of the depth
        assert!((e.force(x, v).unwrap() - exact(x, v, creep)).abs() < 1e-6);
    }
    let (fx, fv) = e.derivatives(1e-3, 0.1).unwrap();
    assert!((fx / 2000.0 - 1.0).abs() < 1e-12 && (fv / 3.0 - 1.0).abs() < 1e-12);
    assert!(e.energies().unwrap().is_none());
    assert_eq!(e.longest_step(), None);
}

#[test]
fn declared_feedthrough_is_believed_only_where_a_try_shows_it() {
    let f = spring::direct();
    // declared, and so it is
    let mut e = FmuElement::new(&f, &parameters(&[("direct", 1.0)]), &names()).unwrap();
    assert_eq!(e.coupling(), Coupling::Direct);
    assert_eq!(e.force(1e-3, 0.5).unwrap(), exact(1e-3, 0.5, 0.0));
    let (fx, fv) = e.derivatives(1e-3, 0.5).unwrap();
    assert!((fx / 2000.0 - 1.0).abs() < 1e-12 && (fv / 3.0 - 1.0).abs() < 1e-12);
    // declared, but only steps move it
    let e = FmuElement::new(&f, &parameters(&[]), &names()).unwrap();
    assert_eq!(e.coupling(), Coupling::Trial { step: 1e-9 });
}

#[test]
fn derivatives_are_differences_where_the_fmu_has_none() {
    let flags = r#"canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true""#;
    let f = spring::open(&spring::description(flags, ""));
    let mut e = FmuElement::new(&f, &parameters(&[]), &names()).unwrap();
    let (fx, fv) = e.derivatives(1e-3, 0.1).unwrap();
    assert!((fx / 2000.0 - 1.0).abs() < 1e-5 && (fv / 3.0 - 1.0).abs() < 1e-5, "{fx} {fv}");
}

#[test]
fn without_state_or_feedthrough_a_macro_step_is_asked_for() {
    let f = spring::open(&spring::description("", r#"dependencies="""#));
    let refused = FmuElement::new(&f, &parameters(&[]), &names()).map(|_| ()).unwrap_err().to_string();
    assert!(refused.contains("canGetAndSetFMUstate") && refused.contains("macro-step"), "{refused}");
    assert!(FmuElement::held(&f, &parameters(&[]), &names(), 0.0).is_err());
    let mut e = FmuElement::held(&f, &parameters(&[]), &names(), 1e-3).unwrap();
    assert_eq!(e.force(0.0, 1.0).unwrap(), 3.0);
    // from 0 to 2.5 mm at 1 m/s: communication points at 1 and 2 ms
    assert!((e.longest_step().unwrap() - 1e-3).abs() < 1e-15);
    e.advance((0.0, 1.0), (0.4e-3, 1.0), 0.4e-3).unwrap();
    assert_eq!(e.force(0.4e-3, 1.0).unwrap(), 3.0);
    assert!((e.longest_step().unwrap() - 0.6e-3).abs() < 1e-15);
    e.advance((0.4e-3, 1.0), (2.5e-3, 1.0), 2.1e-3).unwrap();
    // no interpolation: inputs of a macro-step are those at its end
    let mut creep = 0.0;
    for x in [1e-3, 2e-3] {
        creep = x + (creep - x) * (-0.1f64).exp();
    }
    assert!((e.force(2.5e-3, 1.0).unwrap() - exact(2e-3, 1.0, creep)).abs() < 1e-12);
    assert_eq!(e.derivatives(0.0, 0.0).unwrap(), (0.0, 0.0));
}

#[test]
fn motion_may_begin_elsewhere_than_it_was_asked_about_but_not_jump() {
    let mut e = FmuElement::new(&spring::able(), &parameters(&[]), &names()).unwrap();
    e.force(5e-3, 0.0).unwrap();
    e.advance((1e-3, 0.0), (2e-3, 0.0), 1e-3).unwrap();
    assert!((e.real("creep").unwrap() - crept(0.0, 1e-3, 2e-3, 1e-3)).abs() < 1e-15);
    let e = e.advance((3e-3, 0.0), (4e-3, 0.0), 1e-3).unwrap_err().to_string();
    assert!(e.contains("cannot jump"), "{e}");
}

#[test]
fn wrong_names_and_values_are_refused_with_the_right_ones() {
    let f = spring::able();
    let refused = |p: &[(String, f64)], n: &Names| FmuElement::new(&f, p, n).map(|_| ()).map_err(|e| format!("{e:#}"));
    let e = refused(&[], &Names::default()).unwrap_err();
    assert!(e.contains("no Real input penetration; its inputs are: depth, speed"), "{e}");
    let e = refused(&parameters(&[("stiffness", 1.0)]), &names()).unwrap_err();
    assert!(e.contains("no parameter stiffness; its parameters are: rate"), "{e}");
    let e = refused(&parameters(&[("misbehave", 0.5)]), &names()).unwrap_err();
    assert!(e.contains("misbehave is of type Integer and cannot be 0.5"), "{e}");
    // a depth where a speed is wanted
    let n = Names { velocity: Some("depth".into()), ..names() };
    let e = refused(&parameters(&[]), &n).unwrap_err();
    assert!(e.contains("depth is in mm, which is not a speed"), "{e}");
    let n = Names { velocity: None, ..names() };
    refused(&parameters(&[]), &n).unwrap();
}
