//! bent_scale: the scale of a sensor is bent

use crate::mechanism::*;
use crate::part::{Part, Sampling};
use record::Channel;

/// reading = u (1 + b u / span) (nonlinear sensor).
pub const MECHANISM: Mechanism = Mechanism {
    name: "bent_scale",
    origin: Origin::Chain,
    named: false,
    equation: "reading = u (1 + b u / span)",
    source: "nonlinear sensor",
    sentence: "the scale of a sensor is bent",
    cure: "No mechanism known explains it; the report shows the force it takes.",
    forms,
    acts: Acts::Reading,
    hints: Hints::PLAIN,
};

/// Curvature of a sensor's scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BentScale {
    /// b.
    pub bend: f64,
    /// Reading at which the curvature counts b, N or m.
    pub span: f64,
    pub channel: Channel,
}

impl Default for BentScale {
    fn default() -> Self {
        BentScale { bend: 0.0, span: 1.0, channel: Channel::Penetration }
    }
}

impl Part for BentScale {
    fn measure(&self, y: &mut [Vec<f64>; 3], _: &Sampling) {
        if self.bend != 0.0 {
            for u in &mut y[self.channel.index()] {
                *u *= 1.0 + self.bend * *u / self.span;
            }
        }
    }
}

fn bend(t: &[f64], c: &Context, p: &mut crate::physics::Physics, channel: Channel) {
    p.bent_scale.bend = t[0];
    p.bent_scale.channel = channel;
    p.bent_scale.span = if channel == Channel::Force { c.scales.peak } else { c.scales.depth };
}

fn forms(c: &Context) -> Vec<Form> {
    let form = |label, apply: Apply| Form {
        label,
        parameters: vec![chain_parameter("bend", -0.9, 0.9, 1e-3)],
        starts: vec![vec![0.01]],
        linear: true,
        extends: None,
        apply,
        describe: |t, _| vec![("bend", t[0], "1")],
    };
    let mut v = Vec::new();
    if c.has[2] && !c.is_imposed() {
        v.push(form("displacement", |t, c, p| bend(t, c, p, Channel::Penetration)));
    }
    if c.has[0] && !c.is_imposed() {
        v.push(form("force", |t, c, p| bend(t, c, p, Channel::Force)));
    }
    v
}
