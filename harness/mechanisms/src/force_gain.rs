//! force_gain: the force transducer reads too much or too little, beyond its tolerance

use crate::mechanism::*;
use record::Kind;

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
};

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
        apply: |t, _, p| p.gain[0] *= t[0].exp(),
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
                p.gain[0] *= t[0].exp();
                p.gain_drift = t[1] / (c.scales.orders - 1.0);
            },
            describe: |t, _| vec![("gain", t[0].exp(), "1"), ("drift_over_campaign", t[1], "1")],
        });
    }
    forms
}
