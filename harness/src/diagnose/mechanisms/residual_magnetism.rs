//! residual_magnetism: what is left of the magnet still pulls on the bar

use crate::diagnose::mechanism::*;
use crate::record::Kind;

/// F = -F_m exp(-t/tau) / (1 + z/z_0)^2 (Maxwell 1873; reluctance of an air gap).
pub const MECHANISM: Mechanism = Mechanism {
    name: "residual_magnetism",
    origin: Origin::Motion,
    named: true,
    equation: "F = -F_m exp(-t/tau) / (1 + z/z_0)^2",
    source: "Maxwell 1873; reluctance of an air gap",
    sentence: "what is left of the magnet still pulls on the bar",
    cure: "The contact element is right; add this pull to the body's motion in the rig's model.",
    forms,
    acts: Acts::Force,
};

/// A travel is of the order of so many depths.
const TRAVELS: f64 = 20.0;

fn forms(c: &Context) -> Vec<Form> {
    if c.kind != Kind::ContactorOpening {
        return Vec::new();
    }
    vec![Form {
        label: "fading with gap and time",
        parameters: vec![
            parameter("force", 0.0, 0.5, 1e-4),
            parameter("ln gap", -4.0, 1.0, 3e-2),
            parameter("ln time", -4.0, 1.5, 3e-2),
        ],
        starts: grid(&[&[0.003], &[-2.0, -0.7], &[-1.5, 0.3]]),
        linear: true,
        apply: |t, c, p| {
            p.magnet_force = t[0] * c.scales.force;
            p.magnet_gap = TRAVELS * c.scales.depth * t[1].exp();
            p.magnet_time = c.scales.length * t[2].exp();
        },
        describe: |t, c| {
            vec![
                ("magnet_force", t[0] * c.scales.force, "N"),
                ("magnet_gap", TRAVELS * c.scales.depth * t[1].exp(), "m"),
                ("magnet_time", c.scales.length * t[2].exp(), "s"),
            ]
        },
    }]
}
