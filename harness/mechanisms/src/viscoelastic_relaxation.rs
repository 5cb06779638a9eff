//! viscoelastic_relaxation: the contact remembers: part of its force relaxes with a time constant

use crate::mechanism::*;

/// Maxwell branches: dF_i/dt = k_r d(x^p)/dt / n - F_i / tau_i (Maxwell 1867; Wiechert 1893).
pub const MECHANISM: Mechanism = Mechanism {
    name: "viscoelastic_relaxation",
    origin: Origin::Contact,
    named: true,
    equation: "Maxwell branches: dF_i/dt = k_r d(x^p)/dt / n - F_i / tau_i",
    source: "Maxwell 1867; Wiechert 1893",
    sentence: "the contact remembers: part of its force relaxes with a time constant",
    cure: "The element now holds it: import the FMU written beside this report.",
    forms,
    acts: Acts::Reading,
};

fn branch(t: &[f64], c: &Context, p: &mut crate::physics::Physics, spread: f64) {
    p.law.relaxation_stiffness = t[0] * p.law.stiffness;
    p.law.relaxation_time = c.scales.duration * t[1].exp();
    p.law.relaxation_spread = spread;
}

fn forms(_: &Context) -> Vec<Form> {
    let form = |label, apply: Apply| Form {
        label,
        parameters: vec![parameter("share", 0.0, 20.0, 2e-3), parameter("ln tau", -4.5, 4.0, 2e-2)],
        starts: grid(&[&[0.05], &[-2.5, -1.0, 0.5]]),
        linear: true,
        extends: None,
        apply,
        describe: |t, c| {
            vec![("relaxation_share", t[0], "1"), ("relaxation_time", c.scales.duration * t[1].exp(), "s")]
        },
    };
    vec![
        form("one branch", |t, c, p| branch(t, c, p, 0.0)),
        form("three branches", |t, c, p| branch(t, c, p, 0.7)),
        form("one branch on a linear spring", |t, c, p| {
            branch(t, c, p, 0.0);
            p.law.relaxation_exponent = 1.0;
            p.law.relaxation_stiffness = t[0] * c.scales.force / c.scales.depth;
        }),
    ]
}
