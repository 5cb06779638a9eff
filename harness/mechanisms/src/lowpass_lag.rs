//! lowpass_lag: a low-pass filter in the chain lags and rounds the reading; one of many poles delays it as well

use crate::mechanism::*;
use crate::part::{Part, Sampling};
use crate::signal::{pole, pole_pair, shift};
use record::Channel;

/// y' = w (u - y), or of higher order (Butterworth 1930; Thomson 1949); what further poles add is a delay, to first order.
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
    hints: Hints { collinear_with: &["channel_skew"], ..Hints::PLAIN },
};

/// How a channel is filtered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// One pole.
    Pole,
    /// Two poles after Butterworth 1930.
    Butterworth,
    /// Two equal poles.
    TwoPoles,
    /// Fourth order after Bessel (Thomson 1949), corner of -3 dB.
    Bessel,
    /// A resonance of this damping ratio, with a second mode: its frequency over the first's, and its share of what is
    /// read at rest (0: none).
    Resonance { damping: f64, second_ratio: f64, second_share: f64 },
}

/// Low-pass behaviour of one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LowPass {
    /// Corner, rad/s.
    pub corner: f64,
    pub filter: Filter,
    pub channel: Channel,
    /// What poles beyond those of `filter` delay by, s.
    pub delay: f64,
}

impl LowPass {
    pub fn new(corner: f64, filter: Filter, channel: Channel) -> LowPass {
        LowPass { corner, filter, channel, delay: 0.0 }
    }

    fn apply(&self, u: &mut [f64], dt: f64) {
        let w = self.corner;
        if self.delay > 0.0 {
            shift(u, self.delay, dt);
        }
        match self.filter {
            Filter::Pole => pole(u, w, dt),
            Filter::Butterworth => pole_pair(u, w, std::f64::consts::FRAC_1_SQRT_2, dt),
            Filter::TwoPoles => {
                pole(u, w, dt);
                pole(u, w, dt);
            }
            Filter::Bessel => {
                pole_pair(u, 1.4302 * w, 0.9580, dt);
                pole_pair(u, 1.6033 * w, 0.6207, dt);
            }
            Filter::Resonance { damping, second_ratio, second_share } if second_share > 0.0 => {
                let mut second = u.to_vec();
                pole_pair(&mut second, second_ratio * w, damping, dt);
                pole_pair(u, w, damping, dt);
                for (a, b) in u.iter_mut().zip(second) {
                    *a += second_share * (b - *a);
                }
            }
            Filter::Resonance { damping, .. } => pole_pair(u, w, damping, dt),
        }
    }
}

impl Part for Option<LowPass> {
    fn measure(&self, y: &mut [Vec<f64>; 3], s: &Sampling) {
        if let Some(l) = self.filter(|l| l.corner.is_finite()) {
            l.apply(&mut y[l.channel.index()], s.dt);
        }
    }
}

fn filtered(t: &[f64], c: &Context, p: &mut crate::physics::Physics, filter: Filter, channel: Channel) {
    let delay = t.get(1).map_or(0.0, |late| late * c.scales.duration);
    p.low_pass = Some(LowPass { delay, ..LowPass::new(t[0].exp() / c.scales.duration, filter, channel) });
}

/// `of` with a delay.
fn delayed(of: &Form, label: &'static str) -> Form {
    let mut form = of.extended(label, vec![chain_parameter("delay", 0.0, 0.5, 1e-3)], vec![vec![0.01], vec![0.05]]);
    form.describe =
        |t, c| vec![("corner", t[0].exp() / c.scales.duration, "rad/s"), ("delay", t[1] * c.scales.duration, "s")];
    form
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
        v.push(form("force, first order", |t, c, p| filtered(t, c, p, Filter::Pole, Channel::Force)));
        v.push(form("force, second order", |t, c, p| filtered(t, c, p, Filter::Butterworth, Channel::Force)));
        let two = form("force, two poles", |t, c, p| filtered(t, c, p, Filter::TwoPoles, Channel::Force));
        let late = delayed(&two, "force, two poles and a delay");
        v.extend([two, late]);
        v.push(form("force, Bessel", |t, c, p| filtered(t, c, p, Filter::Bessel, Channel::Force)));
    }
    if c.has[1] {
        v.push(form("acceleration, first order", |t, c, p| filtered(t, c, p, Filter::Pole, Channel::Acceleration)));
        let second =
            form("acceleration, second order", |t, c, p| filtered(t, c, p, Filter::Butterworth, Channel::Acceleration));
        let late = delayed(&second, "acceleration, second order and a delay");
        v.extend([second, late]);
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_equal_poles_are_nearer_to_two_with_a_delay_than_to_two() {
        let pulse: Vec<f64> = (0..400).map(|i| (std::f64::consts::PI * i as f64 / 400.0).sin().powi(2)).collect();
        let mut three = pulse.clone();
        for _ in 0..3 {
            pole(&mut three, 5e3, 1e-5);
        }
        let off = |delay: f64| {
            (20..80).fold(f64::INFINITY, |least, hundred| {
                let mut u = pulse.clone();
                let two = LowPass::new(100.0 * f64::from(hundred), Filter::TwoPoles, Channel::Force);
                LowPass { delay, ..two }.apply(&mut u, 1e-5);
                least.min(u.iter().zip(&three).map(|(a, b)| (a - b).powi(2)).sum::<f64>())
            })
        };
        assert!(off(1e-4) < 0.2 * off(0.0), "{} {}", off(1e-4), off(0.0));
    }

    #[test]
    fn two_modes_share_what_one_reads_and_settle_where_it_does() {
        let mode = |corner: f64, second_share: f64| {
            let filter = Filter::Resonance { damping: 0.05, second_ratio: 2.0, second_share };
            LowPass::new(corner, filter, Channel::Force)
        };
        let step = |l: LowPass| {
            let mut u = vec![1.0; 4000];
            u[0] = 0.0;
            l.apply(&mut u, 1e-4);
            u
        };
        let (both, other) = (step(mode(300.0, 0.3)), step(mode(600.0, 0.0)));
        let one = step(mode(300.0, 0.0));
        for ((b, o), t) in both.iter().zip(&one).zip(&other) {
            assert!((b - 0.7 * o - 0.3 * t).abs() < 1e-12);
        }
        assert!((both[3999] - 1.0).abs() < 3e-3);
    }
}
