//! force_gain: the force transducer reads too much or too little, beyond its tolerance

use crate::mechanism::*;
use crate::part::{Part, Sampling};
use crate::physics::Physics;
use record::Channel;

/// y = g u, and an amplifier that warms up from recording to recording, evenly or by a power of their count (calibration of
/// the transducer).
pub const MECHANISM: Mechanism = Mechanism {
    name: "force_gain",
    origin: Origin::Chain,
    named: true,
    equation: "y = g u",
    source: "calibration of the transducer",
    sentence: "the force transducer reads too much or too little, beyond its tolerance",
    cure:
        "The contact element is right; divide the force readings by the gain given here, and calibrate the transducer.",
    forms,
    acts: Acts::Reading,
    hints: Hints { is_calibration: true, ..Hints::PLAIN },
};

/// Gains of the chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ForceGain {
    /// Reading over true, of force, acceleration and penetration.
    pub channel: [f64; 3],
    /// Share by which the gain of the force has grown after `span` recordings.
    pub drift: f64,
    /// Recordings, 1.
    pub span: f64,
    /// Power of their count by which it grows, 1: alike from one to the next; below: it settles.
    pub power: f64,
}

impl Default for ForceGain {
    fn default() -> Self {
        ForceGain { channel: [1.0; 3], drift: 0.0, span: 1.0, power: 1.0 }
    }
}

impl Part for ForceGain {
    fn measure(&self, y: &mut [Vec<f64>; 3], s: &Sampling) {
        if self.drift != 0.0 {
            let g = 1.0 + self.drift * (s.before / self.span).powf(self.power);
            y[Channel::Force.index()].iter_mut().for_each(|v| *v *= g);
        }
        for (u, gain) in y.iter_mut().zip(self.channel) {
            if gain != 1.0 {
                u.iter_mut().for_each(|v| *v *= gain);
            }
        }
    }
}

fn drift(t: &[f64], c: &Context, p: &mut Physics) {
    p.force_gain.channel[0] *= t[0].exp();
    p.force_gain.drift = t[1];
    p.force_gain.span = c.scales.orders - 1.0;
}

fn forms(c: &Context) -> Vec<Form> {
    if !c.has[0] || c.is_imposed() {
        return Vec::new();
    }
    let gain = chain_parameter("ln gain", -0.8, 0.8, 1e-3);
    let mut forms = vec![Form {
        label: "gain",
        parameters: vec![gain.clone()],
        starts: vec![vec![0.01]],
        linear: true,
        extends: None,
        apply: |t, _, p| p.force_gain.channel[0] *= t[0].exp(),
        describe: |t, _| vec![("gain", t[0].exp(), "1")],
    }];
    if c.scales.orders > 2.0 {
        let drifting = Form {
            label: "gain, drifting",
            parameters: vec![gain, chain_parameter("drift", -0.9, 0.9, 1e-3)],
            starts: vec![vec![0.0, 0.01]],
            linear: true,
            extends: None,
            apply: drift,
            describe: |t, _| vec![("gain", t[0].exp(), "1"), ("drift_over_campaign", t[1], "1")],
        };
        let further = vec![parameter("power", 0.1, 2.0, 1e-2)];
        let mut settling = drifting.extended("gain, drifting by a power of the count", further, grid(&[&[0.4]]));
        settling.apply = |t, c, p| {
            drift(t, c, p);
            p.force_gain.power = t[2];
        };
        settling.describe =
            |t, _| vec![("gain", t[0].exp(), "1"), ("drift_over_campaign", t[1], "1"), ("drift_power", t[2], "1")];
        forms.extend([drifting, settling]);
    }
    forms
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gain_drifts_by_a_power_of_the_recordings_before() {
        let gain = |before: f64| {
            let part = ForceGain { drift: 0.2, span: 9.0, power: 0.5, ..ForceGain::default() };
            let mut y = [vec![1.0], vec![1.0], vec![1.0]];
            part.measure(&mut y, &Sampling { dt: 1e-5, before });
            (y[0][0], y[1][0])
        };
        assert_eq!(gain(0.0), (1.0, 1.0));
        assert!((gain(9.0).0 - 1.2).abs() < 1e-15 && (gain(2.25).0 - 1.1).abs() < 1e-15);
    }
}
