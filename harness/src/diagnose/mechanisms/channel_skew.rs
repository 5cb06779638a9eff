//! channel_skew: one channel is sampled later than the others

use crate::diagnose::mechanism::*;
use crate::record::Channel;

/// y(t) = u(t - T) (sampling of multiplexed channels).
pub const MECHANISM: Mechanism = Mechanism {
    name: "channel_skew",
    origin: Origin::Chain,
    named: true,
    equation: "y(t) = u(t - T)",
    source: "sampling of multiplexed channels",
    sentence: "one channel is sampled later than the others",
    cure: "The contact element is right; correct the measuring chain.",
    forms,
    acts: Acts::Reading,
};

fn forms(c: &Context) -> Vec<Form> {
    if !(c.has[0] && (c.has[1] || c.has[2])) {
        return Vec::new();
    }
    vec![Form {
        label: "force against the rest",
        parameters: vec![chain_parameter("late", -0.5, 0.5, 1e-3)],
        starts: vec![vec![0.01]],
        linear: true,
        apply: |t, c, p| {
            p.skew = t[0] * c.scales.duration;
            p.skew_channel = Channel::Force;
        },
        describe: |t, c| vec![("skew", t[0] * c.scales.duration, "s")],
    }]
}
