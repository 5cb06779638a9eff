//! The body's motion: Dormand and Prince 1980, order 5(4), with touch, separation, turning points and the peak of
//! the force found by shortening the step itself until it ends on them.

use super::{Kind, Scenario, GRAVITY};
use anyhow::{bail, Result};
use hysteresis_contact::law::{Memory, Parameters};

/// One accepted step.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Time, s.
    pub time: f64,
    /// Penetration, m; negative before touch.
    pub penetration: f64,
    /// Velocity, m/s, positive into the stop.
    pub velocity: f64,
    /// Contact force, N, positive in compression.
    pub force: f64,
    /// Energy stored in the contact, J.
    pub stored: f64,
    /// Energy the contact has turned into heat, J.
    pub dissipated: f64,
}

/// One impact.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub struct Bounce {
    /// Time of touch, s.
    pub touch: f64,
    /// Speed at touch, m/s.
    pub impact_speed: f64,
    /// Deepest penetration, m.
    pub deepest: f64,
    /// Largest force, N.
    pub peak_force: f64,
    /// From touch to separation, s.
    pub duration: f64,
    /// Speed of leaving over speed of touch.
    pub restitution: f64,
    /// Kinetic energy lost, J.
    pub energy_lost: f64,
    /// Height of the rebound after it, m; absent where the simulation ended before.
    pub rebound_height: Option<f64>,
}

/// What a scenario came to.
pub struct Outcome {
    /// Accepted steps.
    pub rows: Vec<Row>,
    /// Impacts in order.
    pub bounces: Vec<Bounce>,
}

const TOLERANCE: f64 = 1e-11;
const MOST_STEPS: usize = 2_000_000;
/// Width of the smoothed zero of Coulomb friction, m/s.
const SLIP: f64 = 1e-3;

const A: [[f64; 6]; 6] = [
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
const C: [f64; 6] = [0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];
/// Fifth-order weights less the fourth-order ones.
const E: [f64; 7] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0];

struct Motion<'a> {
    s: &'a Scenario,
    law: Parameters,
}

impl Motion<'_> {
    fn acceleration(&self, m: &Memory, t: f64, x: f64, v: f64) -> f64 {
        let s = self.s;
        let mut f = -self.law.force(m, x, v) - s.guide_friction * (v / SLIP).tanh();
        if s.gravity {
            f += s.mass * GRAVITY;
        }
        if s.kind == Kind::ContactorOpening {
            f += s.spring_preload - s.return_spring_rate * (x + s.travel);
            if s.holding_force > 0.0 {
                f -= s.holding_force * (-t / s.holding_time).exp();
            }
        }
        f / s.mass
    }

    /// One step from (x, v): the new state and the error of it.
    fn step(&self, m: &Memory, t: f64, y: [f64; 2], h: f64) -> ([f64; 2], [f64; 2]) {
        let mut k = [[0.0; 2]; 7];
        k[0] = [y[1], self.acceleration(m, t, y[0], y[1])];
        let mut z = y;
        for i in 0..6 {
            z = y;
            for j in 0..=i {
                z[0] += h * A[i][j] * k[j][0];
                z[1] += h * A[i][j] * k[j][1];
            }
            k[i + 1] = [z[1], self.acceleration(m, t + C[i] * h, z[0], z[1])];
        }
        let mut e = [0.0; 2];
        for i in 0..7 {
            e[0] += h * E[i] * k[i][0];
            e[1] += h * E[i] * k[i][1];
        }
        (z, e)
    }

    /// Penetration, velocity and rate of the force: each has an event where it is zero.
    fn events(&self, m: &Memory, t: f64, y: [f64; 2]) -> [f64; 3] {
        let rate = if y[0] > 0.0 {
            let (fx, fv) = self.law.derivatives(m, y[0], y[1]);
            fx * y[1] + fv * self.acceleration(m, t, y[0], y[1])
        } else {
            0.0
        };
        [y[0], y[1], rate]
    }
}

/// Runs a scenario to its last impact's rebound, or to separation where it asks for one impact only.
///
/// # Errors
/// Where the motion never ends: too many steps, or a step too small to take.
pub fn simulate(s: &Scenario) -> Result<Outcome> {
    let motion = Motion { s, law: s.parameters() };
    let mut m = Memory::default();
    let mut t = 0.0;
    let mut y = match (s.kind, s.impact_speed, s.drop_height) {
        (Kind::ContactorOpening, _, _) => {
            // the bar leaves when the holding force has faded to what the spring overcomes
            let free = s.spring_preload - s.guide_friction;
            if s.holding_force > free {
                t = s.holding_time * (s.holding_force / free).ln();
            }
            [-s.travel, 0.0]
        }
        (_, Some(v), _) => [0.0, v],
        (_, None, h) => [-h.unwrap_or(0.0), 0.0],
    };
    let q = s.contact.exponent + 1.0;
    // a thousandth of the time an undamped impact at this speed takes to its deepest point, or so
    let short = |v: f64| 1e-3 * (q * s.mass * v * v / (2.0 * s.contact.stiffness)).powf(1.0 / q) / v;
    let mut o = Outcome { rows: Vec::new(), bounces: Vec::new() };
    let row = |t: f64, y: [f64; 2], m: &Memory| Row {
        time: t,
        penetration: y[0],
        velocity: y[1],
        force: motion.law.force(m, y[0], y[1]),
        stored: m.stored,
        dissipated: m.dissipated(),
    };
    o.rows.push(row(t, y, &m));
    let mut h = 1e-5;
    if y[0] == 0.0 {
        o.bounces.push(Bounce { touch: t, impact_speed: y[1], ..Bounce::default() });
        h = short(y[1]);
    }
    let (mut scale_x, mut scale_v) = (y[0].abs().max(1e-6), y[1].abs().max(1e-3));
    while o.rows.len() < MOST_STEPS {
        let (mut z, e) = motion.step(&m, t, y, h);
        let err = (e[0] / (TOLERANCE * scale_x)).abs().max((e[1] / (TOLERANCE * scale_v)).abs());
        let grow = (0.9 * err.max(1e-10).powf(-0.2)).clamp(0.2, 4.0);
        if err.is_nan() || err > 1.0 {
            h *= if err.is_nan() { 0.2 } else { grow };
            if h < 1e-16 * (1.0 + t) {
                bail!("at {t} s the step has become too small: the contact is too stiff for this mass and speed");
            }
            continue;
        }
        // the earliest event in this step
        let before = motion.events(&m, t, y);
        let after = motion.events(&m, t + h, z);
        let mut event: Option<(usize, f64)> = None;
        for i in 0..3 {
            if before[i] * after[i] >= 0.0 {
                continue;
            }
            let (mut lo, mut hi) = (0.0, h);
            for _ in 0..60 {
                let mid = 0.5 * (lo + hi);
                let w = motion.step(&m, t, y, mid).0;
                if motion.events(&m, t + mid, w)[i] * before[i] > 0.0 {
                    lo = mid;
                } else {
                    hi = mid;
                }
            }
            if hi > 1e-9 * h && event.is_none_or(|(_, at)| hi < at) {
                event = Some((i, hi));
            }
        }
        let taken = event.map_or(h, |(_, at)| at);
        if let Some((i, at)) = event {
            z = motion.step(&m, t, y, at).0;
            if i < 2 {
                z[i] = 0.0;
            }
        }
        m = motion.law.advance(&m, y[0], y[1], z[0], z[1], taken);
        t += taken;
        y = z;
        (scale_x, scale_v) = (scale_x.max(y[0].abs()), scale_v.max(y[1].abs()));
        let r = row(t, y, &m);
        o.rows.push(r);
        h *= grow;
        if let Some(b) = o.bounces.last_mut() {
            if y[0] > 0.0 {
                b.deepest = b.deepest.max(y[0]);
                b.peak_force = b.peak_force.max(r.force);
            }
        }
        match event {
            Some((0, _)) if y[1] > 0.0 => {
                o.bounces.push(Bounce { touch: t, impact_speed: y[1], ..Bounce::default() });
                h = short(y[1]);
            }
            Some((0, _)) => {
                if let Some(b) = o.bounces.last_mut() {
                    b.duration = t - b.touch;
                    b.restitution = -y[1] / b.impact_speed;
                    b.energy_lost = 0.5 * s.mass * (b.impact_speed * b.impact_speed - y[1] * y[1]);
                }
                if s.impacts == 1 || y[1] == 0.0 {
                    return Ok(o);
                }
                h = short(-y[1]);
            }
            Some((1, _)) if y[0] < 0.0 => {
                let n = o.bounces.len();
                if let Some(b) = o.bounces.last_mut() {
                    b.rebound_height = Some(-y[0]);
                    if n >= s.impacts || -y[0] < s.rest_height {
                        return Ok(o);
                    }
                }
            }
            // at rest inside the stop: nothing leaves any more
            Some((1, _))
                if r.force > 0.0
                    && y[0] > 0.0
                    && motion.acceleration(&m, t, y[0], 0.0).abs() < 1e-6 * r.force / s.mass =>
            {
                return Ok(o);
            }
            _ => {}
        }
        if t > 1e4 {
            break;
        }
    }
    bail!("the motion does not end after {t} s and {} steps: ask for fewer impacts", o.rows.len())
}
