//! adhesion: the faces pull on each other, above all while leaving

use crate::diagnose::mechanism::*;
use crate::record::Kind;

/// a pull of at most F_a over a range (Johnson, Kendall and Roberts 1971; Derjaguin, Muller and Toporov 1975).
pub const MECHANISM: Mechanism = Mechanism {
    name: "adhesion",
    origin: Origin::Contact,
    named: true,
    equation: "a pull of at most F_a over a range",
    source: "Johnson, Kendall and Roberts 1971; Derjaguin, Muller and Toporov 1975",
    sentence: "the faces pull on each other, above all while leaving",
    cure: "The element now holds it: import the FMU written beside this report.",
    forms,
    acts: Acts::Reading,
};

fn pull(t: &[f64], c: &Context, p: &mut crate::model::physics::Physics, form: i32) {
    p.law.adhesion_force = t[0] * c.scales.force;
    p.law.adhesion_range = c.scales.depth * t[1].exp();
    p.law.adhesion_form = form;
}

fn forms(c: &Context) -> Vec<Form> {
    // a pull that reaches farther than the contact is deep is a force in flight
    let longest = if c.kind == Kind::Indentation { 1.5 } else { 0.0 };
    let form = |label, apply: Apply| Form {
        label,
        parameters: vec![parameter("force", 0.0, 3.0, 1e-3), parameter("ln range", -6.0, longest, 1e-2)],
        starts: grid(&[&[0.02], &[-4.0, -2.3, -0.7]]),
        linear: true,
        apply,
        describe: |t, c| {
            vec![("adhesion_force", t[0] * c.scales.force, "N"), ("adhesion_range", c.scales.depth * t[1].exp(), "m")]
        },
    };
    vec![
        form("reversible, in contact", |t, c, p| pull(t, c, p, 0)),
        form("neck, while leaving", |t, c, p| pull(t, c, p, 1)),
        form("while leaving, reaching out", |t, c, p| pull(t, c, p, 3)),
        form("reaching out, reversible", |t, c, p| pull(t, c, p, 2)),
    ]
}
