//! gravity: the simulation leaves out the weight of the body

use crate::mechanism::*;
use record::Kind;

/// F = m g (Newton 1687).
pub const MECHANISM: Mechanism = Mechanism {
    name: "gravity",
    origin: Origin::Motion,
    named: true,
    equation: "F = m g",
    source: "Newton 1687",
    sentence: "the simulation leaves out the weight of the body",
    cure: "The contact element is right; let gravity act on the body in the rig's model.",
    forms,
    acts: Acts::Force,
    hints: Hints { collinear_with: &["return_spring"], ..Hints::PLAIN },
};

fn forms(c: &Context) -> Vec<Form> {
    if c.kind != Kind::DropTest || c.terms.iter().any(|t| t == "gravity") {
        return Vec::new();
    }
    vec![Form {
        label: "weight",
        // less along the motion where the guide leans, up to 18 degrees
        parameters: vec![parameter("g", 9.33, 9.92, 0.05)],
        starts: vec![vec![crate::constants::GRAVITY]],
        linear: false,
        extends: None,
        apply: |t, _, p| p.gravity = t[0],
        describe: |t, _| vec![("gravity", t[0], "m/s^2")],
    }]
}
