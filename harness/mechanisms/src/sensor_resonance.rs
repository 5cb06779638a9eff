//! sensor_resonance: the transducer and its tip ring at their own frequency

use crate::lowpass_lag::{Filter, LowPass};
use crate::mechanism::*;
use crate::part::Part;
use record::Channel;

/// tip mass m_t before a transducer of stiffness k_t (Ahn and Ryu 2005, eqs. 3 to 5).
pub const MECHANISM: Mechanism = Mechanism {
    name: "sensor_resonance",
    origin: Origin::Chain,
    named: true,
    equation: "tip mass m_t before a transducer of stiffness k_t",
    source: "Ahn and Ryu 2005, eqs. 3 to 5",
    sentence: "the transducer and its tip ring at their own frequency",
    cure: "The contact element is right; simulate the transducer's tip mass and stiffness, or mount it stiffer.",
    forms,
    acts: Acts::Push,
    hints: Hints { strongly_nonlinear: true, rings: true, ..Hints::PLAIN },
};

/// The transducer's tip before its spring, taken out of the moving mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tip {
    /// kg; 0: the transducer is rigid.
    pub mass: f64,
    /// Stiffness of the transducer, N/m.
    pub stiffness: f64,
    /// Its damping, N s/m.
    pub damping: f64,
}

impl Tip {
    /// Force of the transducer, N, compressed by `u` m and further by `w` m/s.
    #[inline]
    pub fn force(&self, u: f64, w: f64) -> f64 {
        self.stiffness * u + self.damping * w
    }
}

impl Part for Tip {}

/// Logarithm of the damping ratio from which nothing rings any more: what is damped like that is a low-pass filter.
const LEAST_RINGING: f64 = -1.0;

fn forms(c: &Context) -> Vec<Form> {
    if c.is_imposed() || !c.has[0] {
        return Vec::new();
    }
    let line = c.ring.map(|w| (w * c.scales.duration).ln());
    let mut tip = Form {
        label: "tip mass on the transducer's spring",
        parameters: vec![
            parameter("ln mass", -6.0, -0.7, 2e-2),
            parameter("ln frequency", 1.2, 4.9, 1e-2),
            parameter("ln damping", -6.0, LEAST_RINGING, 5e-2),
        ],
        starts: grid(&[&[-4.0, -2.7], &[1.8, 2.2, 2.6, 3.0, 3.4, 3.9, 4.5], &[-3.5, -1.5]]),
        linear: false,
        extends: None,
        apply: |t, c, p| {
            let w = t[1].exp() / c.scales.duration;
            p.sensor_resonance.mass = c.scales.mass * t[0].exp();
            p.sensor_resonance.stiffness = p.sensor_resonance.mass * w * w;
            p.sensor_resonance.damping = 2.0 * t[2].exp() * p.sensor_resonance.mass * w;
        },
        describe: |t, c| {
            let (w, m) = (t[1].exp() / c.scales.duration, c.scales.mass * t[0].exp());
            vec![
                ("tip_mass", m, "kg"),
                ("transducer_stiffness", m * w * w, "N/m"),
                ("transducer_damping", 2.0 * t[2].exp() * m * w, "N s/m"),
            ]
        },
    };
    // the same on the stop's side: the transducer carries what is struck
    let mut struck = Form {
        label: "struck tip on the transducer's spring",
        starts: grid(&[&[-4.0, -2.7], &[1.8, 2.4, 3.0, 3.6, 4.3], &[-3.5, -1.5]]),
        apply: |t, c, p| {
            let w = t[1].exp() / c.scales.duration;
            p.base_compliance.mass = c.scales.mass * t[0].exp();
            p.base_compliance.stiffness = p.base_compliance.mass * w * w;
            p.base_compliance.damping = 2.0 * t[2].exp() * p.base_compliance.mass * w;
            p.base_compliance.reads = true;
        },
        ..tip.clone()
    };
    let mut ringing = Form {
        label: "reading rings at one frequency",
        parameters: vec![
            chain_parameter("ln frequency", 1.2, 6.5, 1e-2),
            chain_parameter("ln damping", -6.0, LEAST_RINGING, 5e-2),
        ],
        starts: grid(&[&[2.0, 2.5, 3.0, 3.5, 4.0, 4.6], &[-3.2, -1.5]]),
        linear: false,
        extends: None,
        apply: |t, c, p| p.low_pass = Some(rings(t, c, 1.0, 0.0)),
        describe: mode,
    };
    if let Some(l) = line {
        // what rings in flight says where to begin
        let l = l.clamp(1.3, 4.8);
        for form in [&mut tip, &mut struck] {
            form.starts.extend(grid(&[&[-4.0, -3.3, -2.6], &[l], &[-3.5, -2.5]]));
        }
        ringing.starts.extend(grid(&[&[l], &[-4.0, -3.2]]));
    }
    // a mounted transducer has more modes than one, and what it reads at rest is shared among them
    let further = vec![chain_parameter("ln ratio", 0.1, 2.0, 1e-2), chain_parameter("share", 0.0, 0.9, 5e-3)];
    let mut second = ringing.extended("reading rings at two frequencies", further, grid(&[&[0.35, 0.6, 0.9], &[0.2]]));
    second.apply = |t, c, p| {
        p.low_pass = Some(rings(t, c, t[2].exp(), t[3]));
    };
    second.describe = |t, c| {
        let second = ("second_frequency", (t[0] + t[2]).exp() / c.scales.duration, "rad/s");
        [mode(t, c), vec![second, ("second_share", t[3], "1")]].concat()
    };
    vec![struck, tip, ringing, second]
}

fn rings(t: &[f64], c: &Context, second_ratio: f64, second_share: f64) -> LowPass {
    let filter = Filter::Resonance { damping: t[1].exp(), second_ratio, second_share };
    LowPass::new(t[0].exp() / c.scales.duration, filter, Channel::Force)
}

fn mode(t: &[f64], c: &Context) -> Vec<(&'static str, f64, &'static str)> {
    vec![
        ("transducer_frequency", t[0].exp() / c.scales.duration, "rad/s"),
        ("transducer_damping_ratio", t[1].exp(), "1"),
    ]
}
