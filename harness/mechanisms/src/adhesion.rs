//! adhesion: the faces pull on each other, above all while leaving

use crate::mechanism::*;
use record::Kind;

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

fn pull(t: &[f64], c: &Context, p: &mut crate::physics::Physics, form: i32) {
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
        extends: None,
        apply,
        describe: described,
    };
    let neck = form("neck, while leaving", |t, c, p| pull(t, c, p, 1));
    // the neck is where the faces are near each other, not as deep as the contact has been
    let mut near = neck.extended(
        "neck near the surface, while leaving",
        vec![parameter("ln depth", -6.0, 1.0, 1e-2)],
        grid(&[&[-2.5, -1.0]]),
    );
    near.apply = |t, c, p| {
        pull(t, c, p, 3);
        p.law.adhesion_depth = c.scales.depth * t[2].exp();
    };
    near.describe = |t, c| [described(t, c), vec![("adhesion_depth", c.scales.depth * t[2].exp(), "m")]].concat();
    // growing with the contact: the pull at the surface is what is given
    let mut growing = neck.extended("growing with the contact, and a neck", Vec::new(), vec![Vec::new()]);
    growing.apply = |t, c, p| pull(t, c, p, 4);
    vec![
        form("reversible, in contact", |t, c, p| pull(t, c, p, 0)),
        neck,
        near,
        growing,
        form("while leaving, reaching out", |t, c, p| pull(t, c, p, 3)),
        form("reaching out, reversible", |t, c, p| pull(t, c, p, 2)),
    ]
}

fn described(t: &[f64], c: &Context) -> Vec<(&'static str, f64, &'static str)> {
    vec![("adhesion_force", t[0] * c.scales.force, "N"), ("adhesion_range", c.scales.depth * t[1].exp(), "m")]
}
