//! residual_magnetism: what is left of the magnet still pulls on the bar

use crate::mechanism::*;
use crate::part::{Allowed, Key, Motion, Part};
use crate::physics::Physics;

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
    hints: Hints::PLAIN,
};

pub use law::body::ResidualMagnetism;

impl Part for ResidualMagnetism {
    const KEYS: &'static [Key<Self>] = &[
        Key { name: "magnet_force", unit: "N", allowed: Allowed::FromZero, put: |p, v| p.force = v },
        Key { name: "magnet_gap", unit: "m", allowed: Allowed::AboveZero, put: |p, v| p.gap = v },
        Key { name: "magnet_time", unit: "s", allowed: Allowed::AboveZero, put: |p, v| p.time = v },
    ];

    #[inline]
    fn on_body(&self, at: &Motion, f: f64) -> f64 {
        self.on(at.time, at.x + at.travel, f)
    }
}

/// A travel is of the order of so many depths.
const TRAVELS: f64 = 20.0;

fn forms(c: &Context) -> Vec<Form> {
    if !c.kind.starts_driven() {
        return Vec::new();
    }
    let force = parameter("force", 0.0, 0.5, 1e-4);
    let gap = parameter("ln gap", -4.0, 1.0, 3e-2);
    let time = parameter("ln time", -4.0, 1.5, 3e-2);
    vec![
        Form {
            label: "fading with gap and time",
            parameters: vec![force.clone(), gap.clone(), time.clone()],
            starts: grid(&[&[0.003], &[-2.0, -0.7], &[-1.5, 0.3]]),
            linear: true,
            extends: None,
            apply: |t, c, p| pull(p, t[0] * c.scales.force, fades_over(t[1], c), fades_in(t[2], c)),
            describe: |t, c| {
                vec![
                    ("magnet_force", t[0] * c.scales.force, "N"),
                    ("magnet_gap", fades_over(t[1], c), "m"),
                    ("magnet_time", fades_in(t[2], c), "s"),
                ]
            },
        },
        // a core that keeps its remanence for as long as the opening lasts
        Form {
            label: "fading with gap",
            parameters: vec![force.clone(), gap],
            starts: grid(&[&[0.003], &[-2.0, -0.7]]),
            linear: true,
            extends: None,
            apply: |t, c, p| pull(p, t[0] * c.scales.force, fades_over(t[1], c), f64::INFINITY),
            describe: |t, c| {
                vec![("magnet_force", t[0] * c.scales.force, "N"), ("magnet_gap", fades_over(t[1], c), "m")]
            },
        },
        // a travel that is short beside the iron's own gaps
        Form {
            label: "fading with time",
            parameters: vec![force, time],
            starts: grid(&[&[0.003], &[-2.7, -1.5, 0.3]]),
            linear: true,
            extends: None,
            apply: |t, c, p| pull(p, t[0] * c.scales.force, f64::INFINITY, fades_in(t[1], c)),
            describe: |t, c| {
                vec![("magnet_force", t[0] * c.scales.force, "N"), ("magnet_time", fades_in(t[1], c), "s")]
            },
        },
    ]
}

/// Gap over which the pull fades, m.
fn fades_over(ln_gap: f64, c: &Context) -> f64 {
    TRAVELS * c.scales.depth * ln_gap.exp()
}

/// Time in which it fades, s.
fn fades_in(ln_time: f64, c: &Context) -> f64 {
    c.scales.length * ln_time.exp()
}

fn pull(p: &mut Physics, force: f64, gap: f64, time: f64) {
    (p.residual_magnetism.force, p.residual_magnetism.gap, p.residual_magnetism.time) = (force, gap, time);
}
