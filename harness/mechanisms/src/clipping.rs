//! clipping: the chain reads no more beyond a level

use crate::mechanism::*;
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
};

fn clip(level: f64, channel: Channel, soft: bool, p: &mut crate::physics::Physics) {
    p.clip = level;
    p.clip_channel = channel;
    p.clip_soft = soft;
}

fn slowly(t: &[f64], c: &Context, channel: Channel, p: &mut crate::physics::Physics) {
    clip(t[0] * c.top[channel.index()], channel, false, p);
    p.clip_recovery = t[1] * c.scales.duration;
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
