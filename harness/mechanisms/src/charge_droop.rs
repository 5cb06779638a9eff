//! charge_droop: the force transducer is AC-coupled: its reading droops and undershoots

use crate::mechanism::*;
use crate::part::{Part, Sampling};
use crate::signal::pole;
use record::Channel;

/// y = u - w, w' = (u - w)/tau (charge amplifier, first-order AC coupling).
pub const MECHANISM: Mechanism = Mechanism {
    name: "charge_droop",
    origin: Origin::Chain,
    named: true,
    equation: "y = u - w, w' = (u - w)/tau",
    source: "charge amplifier, first-order AC coupling",
    sentence: "the force transducer is AC-coupled: its reading droops and undershoots",
    cure: "The contact element is right; undo the AC coupling with the time constant given here, or record DC-coupled.",
    forms,
    acts: Acts::Reading,
    hints: Hints::PLAIN,
};

/// AC coupling of a channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChargeDroop {
    /// 1/s; 0: DC-coupled.
    pub rate: f64,
    /// Two such stages instead of one.
    pub double: bool,
    /// Share of the charge that leaks away.
    pub share: f64,
    pub channel: Channel,
}

impl Default for ChargeDroop {
    fn default() -> Self {
        ChargeDroop { rate: 0.0, double: false, share: 1.0, channel: Channel::Force }
    }
}

impl Part for ChargeDroop {
    fn measure(&self, y: &mut [Vec<f64>; 3], s: &Sampling) {
        if self.rate <= 0.0 {
            return;
        }
        let u = &mut y[self.channel.index()];
        for _ in 0..if self.double { 2 } else { 1 } {
            // the charge that has leaked away is zero at the first sample
            let mut leaked = u.clone();
            leaked[0] = 0.0;
            pole(&mut leaked, self.rate, s.dt);
            for (a, b) in u.iter_mut().zip(&leaked) {
                *a -= self.share * b;
            }
        }
    }
}

fn droop(t: &[f64], c: &Context, p: &mut crate::physics::Physics, channel: Channel, double: bool) {
    p.charge_droop.rate = t[0] / c.scales.duration;
    p.charge_droop.double = double;
    p.charge_droop.channel = channel;
}

fn in_part(t: &[f64], c: &Context, p: &mut crate::physics::Physics, channel: Channel) {
    droop(t, c, p, channel, false);
    p.charge_droop.share = t[1];
}

fn forms(c: &Context) -> Vec<Form> {
    let form = |label, apply: Apply| Form {
        label,
        parameters: vec![chain_parameter("rate", 0.0, 5.0, 2e-4)],
        starts: vec![vec![0.01]],
        linear: true,
        extends: None,
        apply,
        describe: |t, c| vec![("droop_rate", t[0] / c.scales.duration, "1/s")],
    };
    // an amplifier that is coupled in part only comes to rest on a shelf
    let shelf = |of: &Form, label, apply: Apply| Form {
        apply,
        describe: |t, c| vec![("droop_rate", t[0] / c.scales.duration, "1/s"), ("droop_share", t[1], "1")],
        ..of.extended(label, vec![chain_parameter("share", 0.02, 1.0, 2e-3)], vec![vec![0.5]])
    };
    let mut v = Vec::new();
    if c.has[0] {
        let first = form("first order", |t, c, p| droop(t, c, p, Channel::Force, false));
        let part = shelf(&first, "a share of it, first order", |t, c, p| in_part(t, c, p, Channel::Force));
        v.push(first);
        // where the penetration is imposed, a share that fades is what a Maxwell branch does to the force: that is said
        if !c.is_imposed() {
            v.push(part);
        }
        v.push(form("second order", |t, c, p| droop(t, c, p, Channel::Force, true)));
    }
    if c.has[1] {
        let first = form("acceleration, first order", |t, c, p| droop(t, c, p, Channel::Acceleration, false));
        let label = "acceleration, a share of it, first order";
        let part = shelf(&first, label, |t, c, p| in_part(t, c, p, Channel::Acceleration));
        v.extend([first, part]);
        v.push(form("acceleration, second order", |t, c, p| droop(t, c, p, Channel::Acceleration, true)));
    }
    v
}
