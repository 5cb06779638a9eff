//! return_spring: a spring acts on the body

use crate::mechanism::*;
use crate::part::{Allowed, Key, Motion, Part};
use record::Kind;

/// F = -(P + r x + g x^3) (Hooke 1678; Duffing 1918).
pub const MECHANISM: Mechanism = Mechanism {
    name: "return_spring",
    origin: Origin::Motion,
    named: true,
    equation: "F = -(P + r x + g x^3)",
    source: "Hooke 1678; Duffing 1918",
    sentence: "a spring acts on the body",
    cure: "The contact element is right; add this return spring to the rig's model.",
    forms,
    acts: Acts::Force,
    hints: Hints {
        strongly_nonlinear: true,
        collinear_with: &["gravity"],
        declared_by_rig: &[Kind::ContactorOpening],
        ..Hints::PLAIN
    },
};

pub use law::body::ReturnSpring;

impl Part for ReturnSpring {
    const KEYS: &'static [Key<Self>] = &[
        Key { name: "spring_preload", unit: "N", allowed: Allowed::Any, put: |p, v| p.preload = v },
        Key { name: "spring_rate", unit: "N/m", allowed: Allowed::FromZero, put: |p, v| p.rate = v },
        Key { name: "spring_growth", unit: "N/m^3", allowed: Allowed::FromZero, put: |p, v| p.growth = v },
    ];

    #[inline]
    fn on_body(&self, at: &Motion, f: f64) -> f64 {
        self.on(at.x, f)
    }
}

fn forms(c: &Context) -> Vec<Form> {
    let held = c.kind == Kind::System && c.terms.iter().any(|t| t == MECHANISM.name);
    if held || !matches!(c.kind, Kind::DropTest | Kind::System) {
        return Vec::new();
    }
    vec![
        Form {
            label: "preload",
            parameters: vec![parameter("preload", -2.0, 2.0, 2e-4)],
            starts: vec![vec![0.01]],
            linear: true,
            extends: None,
            apply: |t, c, p| p.return_spring.preload = t[0] * c.scales.force,
            describe: |t, c| vec![("spring_preload", t[0] * c.scales.force, "N")],
        },
        Form {
            label: "preload and rate",
            parameters: vec![parameter("preload", -2.0, 2.0, 2e-4), parameter("rate", 0.0, 1.0, 2e-4)],
            starts: vec![vec![0.01, 0.005], vec![-0.01, 0.005]],
            linear: false,
            extends: None,
            apply: |t, c, p| {
                p.return_spring.preload = t[0] * c.scales.force;
                p.return_spring.rate = t[1] * c.scales.force / c.scales.depth;
            },
            describe: |t, c| {
                vec![
                    ("spring_preload", t[0] * c.scales.force, "N"),
                    ("spring_rate", t[1] * c.scales.force / c.scales.depth, "N/m"),
                ]
            },
        },
        Form {
            label: "progressive",
            parameters: vec![
                parameter("preload", -2.0, 2.0, 2e-4),
                parameter("rate", 0.0, 1.0, 2e-4),
                parameter("growth", 0.0, 1.0, 2e-4),
            ],
            starts: vec![vec![0.01, 0.003, 0.003], vec![-0.01, 0.003, 0.003]],
            linear: false,
            extends: None,
            apply: |t, c, p| {
                let rate = c.scales.force / c.scales.depth;
                (p.return_spring.preload, p.return_spring.rate) = (t[0] * c.scales.force, t[1] * rate);
                p.return_spring.growth = t[2] * rate / c.scales.depth.powi(2);
            },
            describe: |t, c| {
                let rate = c.scales.force / c.scales.depth;
                vec![
                    ("spring_preload", t[0] * c.scales.force, "N"),
                    ("spring_rate", t[1] * rate, "N/m"),
                    ("spring_growth", t[2] * rate / c.scales.depth.powi(2), "N/m^3"),
                ]
            },
        },
    ]
}
