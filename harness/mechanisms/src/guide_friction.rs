//! guide_friction: the guide rubs on the moving body

use crate::mechanism::*;
use crate::part::{Allowed, Key, Motion, Part};

/// F = -(F_c (1 + s exp(-(v/v_s)^2)) tanh(v/v_0) + c v) (Coulomb 1785; Stribeck 1902).
pub const MECHANISM: Mechanism = Mechanism {
    name: "guide_friction",
    origin: Origin::Motion,
    named: true,
    equation: "F = -(F_c (1 + s exp(-(v/v_s)^2)) tanh(v/v_0) + c v)",
    source: "Coulomb 1785; Stribeck 1902",
    sentence: "the guide rubs on the moving body",
    cure: "The contact element is right; add this friction against the motion in the rig's model.",
    forms,
    acts: Acts::Force,
    hints: Hints::PLAIN,
};

pub use law::body::GuideFriction;

impl Part for GuideFriction {
    const KEYS: &'static [Key<Self>] = &[
        Key { name: "friction", unit: "N", allowed: Allowed::FromZero, put: |p, v| p.coulomb = v },
        Key { name: "friction_viscous", unit: "N s/m", allowed: Allowed::FromZero, put: |p, v| p.viscous = v },
        Key { name: "stribeck_excess", unit: "1", allowed: Allowed::FromZero, put: |p, v| p.stribeck_excess = v },
        Key { name: "stribeck_speed", unit: "m/s", allowed: Allowed::AboveZero, put: |p, v| p.stribeck_speed = v },
    ];

    #[inline]
    fn on_body(&self, at: &Motion, f: f64) -> f64 {
        self.on(at.v, f)
    }
}

fn forms(c: &Context) -> Vec<Form> {
    if c.is_imposed() {
        return Vec::new();
    }
    vec![
        Form {
            label: "Coulomb",
            parameters: vec![parameter("coulomb", 0.0, 1.0, 2e-4)],
            starts: vec![vec![0.01]],
            linear: true,
            extends: None,
            apply: |t, c, p| p.guide_friction.coulomb = t[0] * c.scales.force,
            describe: |t, c| vec![("friction", t[0] * c.scales.force, "N")],
        },
        Form {
            label: "Coulomb and viscous",
            parameters: vec![parameter("coulomb", 0.0, 1.0, 2e-4), parameter("viscous share", 0.0, 60.0, 1e-2)],
            starts: vec![vec![0.01, 1.0], vec![0.01, 10.0]],
            linear: true,
            extends: None,
            apply: |t, c, p| {
                p.guide_friction.coulomb = t[0] * c.scales.force;
                p.guide_friction.viscous = t[0] * t[1] * c.scales.force / c.scales.speed;
            },
            describe: |t, c| {
                vec![
                    ("friction", t[0] * c.scales.force, "N"),
                    ("friction_viscous", t[0] * t[1] * c.scales.force / c.scales.speed, "N s/m"),
                ]
            },
        },
        Form {
            label: "Stribeck",
            parameters: vec![
                parameter("coulomb", 0.0, 1.0, 2e-4),
                parameter("excess", 0.0, 3.0, 1e-2),
                parameter("ln speed", -4.0, 1.0, 2e-2),
            ],
            starts: vec![vec![0.01, 0.5, -1.5]],
            linear: true,
            extends: None,
            apply: |t, c, p| {
                p.guide_friction.coulomb = t[0] * c.scales.force;
                p.guide_friction.stribeck_excess = t[1];
                p.guide_friction.stribeck_speed = c.scales.speed * t[2].exp();
            },
            describe: |t, c| {
                vec![
                    ("friction", t[0] * c.scales.force, "N"),
                    ("stribeck_excess", t[1], "1"),
                    ("stribeck_speed", c.scales.speed * t[2].exp(), "m/s"),
                ]
            },
        },
    ]
}
