//! force_gain: the force transducer reads too much or too little, beyond its tolerance

use crate::mechanism::*;
use crate::part::{Part, Sampling};
use record::{Channel, Kind};

/// y = g u, and an amplifier that warms up from recording to recording (calibration of the transducer).
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
    /// Share by which the gain of the force grows from one recording to the next.
    pub drift: f64,
}

impl Default for ForceGain {
    fn default() -> Self {
        ForceGain { channel: [1.0; 3], drift: 0.0 }
    }
}

impl Part for ForceGain {
    fn measure(&self, y: &mut [Vec<f64>; 3], s: &Sampling) {
        if self.drift != 0.0 {
            let g = 1.0 + self.drift * s.before;
            y[Channel::Force.index()].iter_mut().for_each(|v| *v *= g);
        }
        for (u, gain) in y.iter_mut().zip(self.channel) {
            if gain != 1.0 {
                u.iter_mut().for_each(|v| *v *= gain);
            }
        }
    }
}

fn forms(c: &Context) -> Vec<Form> {
    if !c.has[0] || c.kind == Kind::Indentation {
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
        forms.push(Form {
            label: "gain, drifting",
            parameters: vec![gain, chain_parameter("drift", -0.9, 0.9, 1e-3)],
            starts: vec![vec![0.0, 0.01]],
            linear: true,
            extends: None,
            apply: |t, c, p| {
                p.force_gain.channel[0] *= t[0].exp();
                p.force_gain.drift = t[1] / (c.scales.orders - 1.0);
            },
            describe: |t, _| vec![("gain", t[0].exp(), "1"), ("drift_over_campaign", t[1], "1")],
        });
    }
    forms
}
