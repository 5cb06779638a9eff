//! channel_skew: one channel is sampled later than the others

use crate::mechanism::*;
use crate::part::{Part, Sampling};
use crate::signal::shift;
use record::Channel;

/// y(t) = u(t - T) (sampling of multiplexed channels).
pub const MECHANISM: Mechanism = Mechanism {
    name: "channel_skew",
    origin: Origin::Chain,
    named: true,
    equation: "y(t) = u(t - T)",
    source: "sampling of multiplexed channels",
    sentence: "one channel is sampled later than the others",
    cure: "The contact element is right; shift the late channel back by the time given here before comparing.",
    forms,
    acts: Acts::Reading,
    hints: Hints { collinear_with: &["lowpass_lag"], ..Hints::PLAIN },
};

/// Samples of a channel that come late.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelSkew {
    /// s.
    pub time: f64,
    pub channel: Channel,
}

impl Default for ChannelSkew {
    fn default() -> Self {
        ChannelSkew { time: 0.0, channel: Channel::Force }
    }
}

impl Part for ChannelSkew {
    fn measure(&self, y: &mut [Vec<f64>; 3], s: &Sampling) {
        if self.time != 0.0 {
            shift(&mut y[self.channel.index()], self.time, s.dt);
        }
    }
}

fn forms(c: &Context) -> Vec<Form> {
    let form = |label, apply: Apply| Form {
        label,
        parameters: vec![chain_parameter("late", -0.5, 0.5, 1e-3)],
        starts: vec![vec![0.01]],
        linear: true,
        extends: None,
        apply,
        describe: |t, c| vec![("skew", t[0] * c.scales.duration, "s")],
    };
    let mut v = Vec::new();
    if c.has[0] && (c.has[1] || c.has[2]) {
        v.push(form("force against the rest", |t, c, p| late(t, c, p, Channel::Force)));
    }
    if c.has[1] && c.has[2] && !c.is_imposed() {
        v.push(form("acceleration against the rest", |t, c, p| late(t, c, p, Channel::Acceleration)));
    }
    if c.has[0] && c.has[1] && c.has[2] && !c.is_imposed() {
        v.push(form("penetration against the rest", |t, c, p| late(t, c, p, Channel::Penetration)));
    }
    v
}

fn late(t: &[f64], c: &Context, p: &mut crate::physics::Physics, channel: Channel) {
    p.channel_skew.time = t[0] * c.scales.duration;
    p.channel_skew.channel = channel;
}
