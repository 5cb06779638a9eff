//! viscous_damping: a damper that acts from the first touch, whatever the depth

use crate::diagnose::mechanism::*;

/// F = c v, ramped in over a depth (Kelvin-Voigt; Ahn and Ryu 2005, eq. 1).
pub const MECHANISM: Mechanism = Mechanism {
    name: "viscous_damping",
    origin: Origin::Contact,
    named: true,
    equation: "F = c v, ramped in over a depth",
    source: "Kelvin-Voigt; Ahn and Ryu 2005, eq. 1",
    sentence: "a damper that acts from the first touch, whatever the depth",
    cure: "The element now holds it: import the FMU written beside this report.",
    forms,
    acts: Acts::Reading,
};

fn forms(_: &Context) -> Vec<Form> {
    vec![
        Form {
            label: "from first touch",
            parameters: vec![parameter("c", 0.0, 5.0, 1e-3)],
            starts: vec![vec![0.02]],
            linear: true,
            apply: |t, c, p| p.law.viscous_damping += t[0] * c.scales.force / c.scales.speed,
            describe: |t, c| vec![("viscous_damping", t[0] * c.scales.force / c.scales.speed, "N s/m")],
        },
        Form {
            label: "ramped",
            parameters: vec![parameter("c", 0.0, 5.0, 1e-3), parameter("ln ramp", -4.0, 0.3, 1e-2)],
            starts: grid(&[&[0.02], &[-2.5, -1.0]]),
            linear: true,
            apply: |t, c, p| {
                p.law.viscous_damping += t[0] * c.scales.force / c.scales.speed;
                p.law.viscous_ramp = c.scales.depth * t[1].exp();
            },
            describe: |t, c| {
                vec![
                    ("viscous_damping", t[0] * c.scales.force / c.scales.speed, "N s/m"),
                    ("viscous_ramp", c.scales.depth * t[1].exp(), "m"),
                ]
            },
        },
    ]
}
