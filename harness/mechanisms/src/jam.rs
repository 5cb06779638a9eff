//! jam: the motion is resisted at one place

use crate::latent_force::against;
use crate::mechanism::*;
use crate::part::{Motion, Part};

/// F = -a sign(v) exp(-((x - x0)/w)^2/2) on the body, in the stop (a tight place in the guide).
pub const MECHANISM: Mechanism = Mechanism {
    name: "jam",
    origin: Origin::Motion,
    named: false,
    equation: "F = -a sign(v) exp(-((x - x0)/w)^2/2), x > 0",
    source: "a tight place in the guide",
    sentence: "the motion is resisted at one place",
    cure: "No mechanism known explains it; the report shows the force it takes.",
    forms,
    acts: Acts::Reading,
    hints: Hints::PLAIN,
};

/// A tight place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jam {
    /// Resistance a, N.
    pub force: f64,
    /// Centre x0, m.
    pub position: f64,
    /// Width w, m.
    pub width: f64,
    /// Whether the motion is imposed: then what moves the body reads the resistance beside the contact's force.
    pub is_imposed: bool,
}

impl Default for Jam {
    fn default() -> Self {
        Jam { force: 0.0, position: 0.0, width: 1.0, is_imposed: false }
    }
}

impl Jam {
    /// Resistance against the motion, N: in the stop alone, for what resists before it depends on more than one place.
    fn resistance(&self, x: f64, v: f64) -> f64 {
        if x <= 0.0 {
            return 0.0;
        }
        let z = (x - self.position) / self.width;
        self.force * against(v) * (-0.5 * z * z).exp()
    }
}

impl Part for Jam {
    #[inline]
    fn needs_integration(&self) -> bool {
        self.force != 0.0
    }
    #[inline]
    fn acts_on_face(&self) -> bool {
        self.is_imposed && self.force != 0.0
    }
    #[inline]
    fn on_face(&self, x: f64, v: f64, f: f64) -> f64 {
        if !self.acts_on_face() {
            return f;
        }
        f + self.resistance(x, v)
    }
    #[inline]
    fn on_body(&self, at: &Motion, f: f64) -> f64 {
        if self.is_imposed || self.force == 0.0 {
            return f;
        }
        f - self.resistance(at.x, at.v)
    }
}

fn forms(_: &Context) -> Vec<Form> {
    vec![Form {
        label: "bump of resistance",
        parameters: vec![
            parameter("force", 0.0, 1.0, 1e-3),
            parameter("position", -2.0, 2.0, 5e-3),
            parameter("ln width", -3.5, 0.0, 2e-2),
        ],
        starts: grid(&[&[0.02], &[-0.5, 0.1, 0.35, 0.6, 0.9, 1.2], &[-2.0]]),
        linear: true,
        extends: None,
        apply: |t, c, p| {
            p.jam.is_imposed = c.is_imposed();
            p.jam.force = t[0] * c.scales.force;
            p.jam.position = t[1] * c.scales.depth;
            p.jam.width = c.scales.depth * t[2].exp();
        },
        describe: |t, c| {
            vec![
                ("jam_force", t[0] * c.scales.force, "N"),
                ("jam_position", t[1] * c.scales.depth, "m"),
                ("jam_width", c.scales.depth * t[2].exp(), "m"),
            ]
        },
    }]
}
