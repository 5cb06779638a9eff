//! ripple: a force that repeats with depth

use crate::mechanism::*;
use crate::part::Part;

/// F = a (sin(2 pi x/l + f) - sin f) (corrugated face).
pub const MECHANISM: Mechanism = Mechanism {
    name: "ripple",
    origin: Origin::Contact,
    named: false,
    equation: "F = a (sin(2 pi x/l + f) - sin f)",
    source: "corrugated face",
    sentence: "a force that repeats with depth",
    cure: "No mechanism known explains it; the report shows the force it takes.",
    forms,
    acts: Acts::Reading,
    hints: Hints::PLAIN,
};

/// A force periodic in depth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ripple {
    /// Amplitude a, N.
    pub force: f64,
    /// Wave length l, m.
    pub length: f64,
    /// Phase f, rad.
    pub phase: f64,
}

impl Default for Ripple {
    fn default() -> Self {
        Ripple { force: 0.0, length: 1.0, phase: 0.0 }
    }
}

impl Part for Ripple {
    #[inline]
    fn acts_on_face(&self) -> bool {
        self.force != 0.0
    }
    #[inline]
    fn on_face(&self, x: f64, _: f64, f: f64) -> f64 {
        if self.force == 0.0 || x <= 0.0 {
            return f;
        }
        f + self.force * ((std::f64::consts::TAU * x / self.length + self.phase).sin() - self.phase.sin())
    }
}

fn forms(_: &Context) -> Vec<Form> {
    vec![Form {
        label: "periodic in depth",
        parameters: vec![
            parameter("force", -1.0, 1.0, 1e-3),
            parameter("ln length", -3.5, 0.8, 1e-2),
            parameter("phase", -3.2, 3.2, 2e-2),
        ],
        starts: grid(&[&[0.02], &[-2.6, -2.1, -1.7, -1.3, -0.9, -0.5], &[0.0, 1.57]]),
        linear: true,
        extends: None,
        apply: |t, c, p| {
            p.ripple.force = t[0] * c.scales.force;
            p.ripple.length = c.scales.depth * t[1].exp();
            p.ripple.phase = t[2];
        },
        describe: |t, c| {
            vec![
                ("ripple_force", t[0] * c.scales.force, "N"),
                ("ripple_length", c.scales.depth * t[1].exp(), "m"),
                ("ripple_phase", t[2], "rad"),
            ]
        },
    }]
}
