//! clipping: the chain reads no more beyond a level

use crate::mechanism::*;
use crate::part::{Part, Sampling};
use record::Channel;

/// y = min(u, c) (range of the amplifier).
pub const MECHANISM: Mechanism = Mechanism {
    name: "clipping",
    origin: Origin::Chain,
    named: true,
    equation: "y = min(u, c)",
    source: "range of the amplifier",
    sentence: "the chain reads no more beyond a level",
    cure: "The contact element is right; leave readings at the limit out, or give the channel a wider range.",
    forms,
    acts: Acts::Reading,
    hints: Hints { limits_reading: true, ..Hints::PLAIN },
};

/// Level beyond which a channel reads no more.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clipping {
    /// N or m/s^2, of magnitude; infinite: none.
    pub level: f64,
    /// Whether it saturates smoothly.
    pub soft: bool,
    /// Time for which an overloaded amplifier goes on reading the level, s.
    pub recovery: f64,
    pub channel: Channel,
}

impl Default for Clipping {
    fn default() -> Self {
        Clipping { level: f64::INFINITY, soft: false, recovery: 0.0, channel: Channel::Force }
    }
}

impl Part for Clipping {
    fn measure(&self, y: &mut [Vec<f64>; 3], s: &Sampling) {
        if !self.level.is_finite() {
            return;
        }
        let (y, c) = (&mut y[self.channel.index()], self.level);
        if self.soft {
            // linear to 0.8 c, then bent smoothly towards c
            let k = 0.8 * c;
            for v in y {
                let a = v.abs();
                if a > k {
                    *v = v.signum() * (k + (c - k) * ((a - k) / (c - k)).tanh());
                }
            }
            return;
        }
        // samples that an overload still holds at the level, the last of them in part
        let held = self.recovery / s.dt;
        let (mut left, mut level) = (0.0, c);
        for v in y {
            if v.abs() > c {
                level = c.copysign(*v);
                *v = level;
                left = held;
            } else if left > 0.0 {
                *v += left.min(1.0) * (level - *v);
                left -= 1.0;
            }
        }
    }
}

fn clip(level: f64, channel: Channel, soft: bool, p: &mut crate::physics::Physics) {
    p.clipping.level = level;
    p.clipping.channel = channel;
    p.clipping.soft = soft;
}

fn slowly(t: &[f64], c: &Context, channel: Channel, p: &mut crate::physics::Physics) {
    clip(t[0] * c.top[channel.index()], channel, false, p);
    p.clipping.recovery = t[1] * c.scales.duration;
}

fn level(t: &[f64], c: &Context, channel: Channel) -> (&'static str, f64, &'static str) {
    let unit = if channel == Channel::Force { "N" } else { "m/s^2" };
    ("clip_level", t[0] * c.top[channel.index()], unit)
}

/// The level a soft limit runs towards: readings stay below it, so it starts above the top.
const ABOVE: f64 = 1.1;

fn softly(t: &[f64], c: &Context, channel: Channel, p: &mut crate::physics::Physics) {
    clip(ABOVE * t[0] * c.top[channel.index()], channel, true, p);
}

fn soft_level(t: &[f64], c: &Context, channel: Channel) -> (&'static str, f64, &'static str) {
    let (name, level, unit) = level(t, c, channel);
    (name, ABOVE * level, unit)
}

fn recovery(t: &[f64], c: &Context) -> (&'static str, f64, &'static str) {
    ("clip_recovery", t[1] * c.scales.duration, "s")
}

fn forms(c: &Context) -> Vec<Form> {
    let hard = |label, apply: Apply| Form {
        label,
        parameters: vec![chain_parameter("level", 0.3, 1.2, 1e-3)],
        starts: vec![vec![0.995], vec![0.95]],
        linear: false,
        extends: None,
        apply,
        describe: |t, c| vec![level(t, c, Channel::Force)],
    };
    // an overloaded amplifier takes its time to let go
    let slow = |of: &Form, label, apply: Apply, describe: Describe| Form {
        apply,
        describe,
        ..of.extended(label, vec![chain_parameter("recovery", 0.0, 0.5, 1e-3)], vec![vec![0.03], vec![0.1]])
    };
    let mut v = Vec::new();
    if c.has[0] {
        let force = hard("force, hard", |t, c, p| clip(t[0] * c.top[0], Channel::Force, false, p));
        let slow = slow(
            &force,
            "force, hard, slow to recover",
            |t, c, p| slowly(t, c, Channel::Force, p),
            |t, c| vec![level(t, c, Channel::Force), recovery(t, c)],
        );
        v.extend([force, slow]);
        // a soft limit leaves no flat top
        if c.flat != Some(Channel::Force) {
            v.push(Form {
                describe: |t, c| vec![soft_level(t, c, Channel::Force)],
                ..hard("force, soft", |t, c, p| softly(t, c, Channel::Force, p))
            });
        }
    }
    if c.has[1] {
        let acceleration = Form {
            describe: |t, c| vec![level(t, c, Channel::Acceleration)],
            ..hard("acceleration, hard", |t, c, p| clip(t[0] * c.top[1], Channel::Acceleration, false, p))
        };
        let slow = slow(
            &acceleration,
            "acceleration, hard, slow to recover",
            |t, c, p| slowly(t, c, Channel::Acceleration, p),
            |t, c| vec![level(t, c, Channel::Acceleration), recovery(t, c)],
        );
        v.extend([acceleration, slow]);
        if c.flat != Some(Channel::Acceleration) {
            v.push(Form {
                describe: |t, c| vec![soft_level(t, c, Channel::Acceleration)],
                ..hard("acceleration, soft", |t, c, p| softly(t, c, Channel::Acceleration, p))
            });
        }
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_overload_holds_its_level_for_the_time_it_takes_to_recover() {
        let p = Clipping { level: 2.0, recovery: 2.5e-3, ..Clipping::default() };
        let y = vec![1.0, 3.0, -1.0, 1.0, 1.0, 1.0, -4.0, 0.0, 0.0, 0.0, 0.0];
        let mut y = [y, Vec::new(), Vec::new()];
        p.measure(&mut y, &Sampling { dt: 1e-3, before: 0.0 });
        assert_eq!(y[0], [1.0, 2.0, 2.0, 2.0, 1.5, 1.0, -2.0, -2.0, -2.0, -1.0, 0.0]);
    }
}
