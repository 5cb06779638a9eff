//! latent_force: a force of depth alone that no mechanism known has

use crate::mechanism::*;
use crate::physics::LATENT;

/// F = d(x), or d(x) sign(v), on knots (non-parametric residual force).
pub const MECHANISM: Mechanism = Mechanism {
    name: "latent_force",
    origin: Origin::Contact,
    named: false,
    equation: "F = d(x), or d(x) sign(v), on knots",
    source: "non-parametric residual force",
    sentence: "a force of depth alone that no mechanism known has",
    cure: "No mechanism known explains it; the report shows the force it takes.",
    forms,
    acts: Acts::Reading,
};

const NAMES: [&str; LATENT] = ["knot_1", "knot_2", "knot_3", "knot_4", "knot_5", "knot_6", "knot_7", "knot_8"];

fn latent(t: &[f64], c: &Context, p: &mut crate::physics::Physics, dissipative: bool) {
    for (a, b) in p.latent.iter_mut().zip(t) {
        *a = b * c.scales.force;
    }
    p.latent_span = 2.0 * c.scales.depth;
    p.latent_dissipative = dissipative;
}

fn forms(_: &Context) -> Vec<Form> {
    let form = |label, apply: Apply| Form {
        label,
        parameters: (0..LATENT).map(|i| parameter(&format!("knot {}", i + 1), -2.0, 2.0, 1e-3)).collect(),
        starts: vec![vec![1e-3; LATENT]],
        linear: false,
        extends: None,
        apply,
        describe: |t, c| NAMES.iter().zip(t).map(|(n, a)| (*n, a * c.scales.force, "N")).collect(),
    };

    vec![
        form("conservative", |t, c, p| latent(t, c, p, false)),
        form("against the motion", |t, c, p| latent(t, c, p, true)),
    ]
}
