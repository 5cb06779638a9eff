//! lowpass_lag: a low-pass filter in the chain lags and rounds the reading

use crate::mechanism::*;
use record::Channel;

/// y' = w (u - y), or of higher order (Butterworth 1930; Thomson 1949).
pub const MECHANISM: Mechanism = Mechanism {
    name: "lowpass_lag",
    origin: Origin::Chain,
    named: true,
    equation: "y' = w (u - y), or of higher order",
    source: "Butterworth 1930; Thomson 1949",
    sentence: "a low-pass filter in the chain lags and rounds the reading",
    cure: "The contact element is right; pass the simulated readings through the same filter, or record with a higher corner.",
    forms,
    acts: Acts::Reading,
};

fn filter(t: &[f64], c: &Context, p: &mut crate::physics::Physics, form: u8, channel: Channel) {
    p.low_pass = Some(crate::physics::LowPass::new(t[0].exp() / c.scales.duration, form, channel));
}

fn forms(c: &Context) -> Vec<Form> {
    let form = |label, apply: Apply| Form {
        label,
        parameters: vec![chain_parameter("ln corner", -0.5, 7.0, 1e-2)],
        starts: vec![vec![2.0], vec![3.0], vec![4.2]],
        linear: false,
        extends: None,
        apply,
        describe: |t, c| vec![("corner", t[0].exp() / c.scales.duration, "rad/s")],
    };
    let mut v = Vec::new();
    if c.has[0] {
        v.push(form("force, first order", |t, c, p| filter(t, c, p, 1, Channel::Force)));
        v.push(form("force, second order", |t, c, p| filter(t, c, p, 2, Channel::Force)));
        v.push(form("force, two poles", |t, c, p| filter(t, c, p, 3, Channel::Force)));
        v.push(form("force, Bessel", |t, c, p| filter(t, c, p, 4, Channel::Force)));
    }
    if c.has[1] {
        v.push(form("acceleration, first order", |t, c, p| filter(t, c, p, 1, Channel::Acceleration)));
        v.push(form("acceleration, second order", |t, c, p| filter(t, c, p, 2, Channel::Acceleration)));
    }
    v
}
