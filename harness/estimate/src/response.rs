//! The rig linearised about a simulated path: what a small force, or a small error of a reading, does to the readings.

use crate::problem::Data;
use law::Memory;
use mechanisms::physics::Physics;
use plant::chain::readings;
use plant::simulate::Trace;
use record::{Channel, Kind};

/// Where something small and unknown enters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A force between body and stop, N, positive in compression.
    Contact,
    /// A force on the body besides the contact, N, positive into the stop.
    Motion,
    /// An error of one reading, in its SI unit.
    Reading(Channel),
}

impl Place {
    /// Every place at which something can enter the recordings of `data`.
    pub fn all(data: &Data) -> Vec<Place> {
        if data.kind == Kind::Indentation {
            return vec![Place::Contact];
        }
        let channels = Channel::ALL.into_iter().filter(|c| data.has(*c)).map(Place::Reading);
        if !data.takes_force() {
            return channels.collect();
        }
        [Place::Contact, Place::Motion].into_iter().chain(channels).collect()
    }

    /// The part of the system it belongs to, as the verdict names it.
    pub fn origin(self) -> &'static str {
        match self {
            Place::Contact => "contact",
            Place::Motion => "motion",
            Place::Reading(_) => "chain",
        }
    }

    /// Unit of what enters there.
    pub fn unit(self) -> &'static str {
        match self {
            Place::Reading(c) => c.unit(),
            _ => "N",
        }
    }

    /// What enters there, in words.
    pub fn words(self) -> String {
        match self {
            Place::Contact => "a force between body and stop, positive in compression".into(),
            Place::Motion => "a force on the body besides the contact, positive into the stop".into(),
            Place::Reading(c) => format!("an error of the {} reading", c.name()),
        }
    }
}

/// One recording's rig, linearised: the contact as a spring k(t) and a damper c(t) along the path.
pub struct Response<'a> {
    physics: &'a Physics,
    trace: &'a Trace,
    time: &'a [f64],
    /// k N/m and c N s/m, sample by sample; empty where the path is imposed.
    tangents: Vec<(f64, f64)>,
}

impl<'a> Response<'a> {
    /// About `trace`, which `physics` has given at the sample times `time`, s.
    pub fn new(physics: &'a Physics, trace: &'a Trace, time: &'a [f64], kind: Kind) -> Response<'a> {
        let tangents = if kind == Kind::Indentation { Vec::new() } else { tangents(physics, trace, time) };
        Response { physics, trace, time, tangents }
    }

    /// Change of the readings (force N, acceleration m/s^2, penetration m) by `drive`, one value a sample, that enters at
    /// `place`; through the measuring chain, save for what enters behind it.
    pub fn to(&self, drive: &[f64], place: Place) -> [Vec<f64>; 3] {
        let n = self.time.len();
        if let Place::Reading(c) = place {
            let mut out = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
            out[c.index()].copy_from_slice(drive);
            return out;
        }
        let bare = if self.tangents.is_empty() {
            let shown = if place == Place::Contact { drive.to_vec() } else { vec![0.0; n] };
            [shown, vec![0.0; n], vec![0.0; n]]
        } else {
            self.motion(drive, place)
        };
        self.through_chain(bare)
    }

    /// What the chain makes of a small change of what it measures.
    fn through_chain(&self, change: [Vec<f64>; 3]) -> [Vec<f64>; 3] {
        let [force, acceleration, position] = change;
        let add = |a: &[f64], b: Vec<f64>| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a + b).collect() };
        let moved = Trace {
            force: add(&self.trace.force, force),
            acceleration: add(&self.trace.acceleration, acceleration),
            position: add(&self.trace.position, position),
            ..self.trace.clone()
        };
        let mut out = readings(self.physics, &moved, self.time);
        for (y, y0) in out.iter_mut().zip(readings(self.physics, self.trace, self.time)) {
            for (a, b) in y.iter_mut().zip(y0) {
                *a -= b;
            }
        }
        out
    }

    /// (force, acceleration, position) by a drive, from rest relative to the path.
    fn motion(&self, drive: &[f64], place: Place) -> [Vec<f64>; 3] {
        let (time, tangent, mass) = (self.time, &self.tangents, self.physics.mass);
        let n = time.len();
        let mut out = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
        let (mut x, mut v) = (0.0, 0.0);
        let (push, shown) = if place == Place::Contact { (-1.0, 1.0) } else { (1.0, 0.0) };
        // k, c and the force that pushes the body, a share w of the way from sample i to the next
        let at = |i: usize, w: f64| {
            let j = (i + 1).min(n - 1);
            let between = |a: f64, b: f64| a * (1.0 - w) + b * w;
            let (k, c) = (between(tangent[i].0, tangent[j].0), between(tangent[i].1, tangent[j].1));
            (k, c, push * between(drive[i], drive[j]))
        };
        let acceleration = |i: usize, w: f64, x: f64, v: f64| {
            let (k, c, force) = at(i, w);
            (force - k * x - c * v) / mass
        };
        for i in 0..n {
            out[0][i] = tangent[i].0 * x + tangent[i].1 * v + shown * drive[i];
            out[1][i] = acceleration(i, 0.0, x, v);
            out[2][i] = x;
            if i + 1 == n {
                break;
            }
            let h = time[i + 1] - time[i];
            if is_stiff(h, mass, &tangent[i..=i + 1]) {
                (x, v) = stiff_step(h, mass, |w| at(i, w), (x, v));
            } else {
                // classical fourth-order step
                let (a1, v1) = (acceleration(i, 0.0, x, v), v);
                let (a2, v2) = (acceleration(i, 0.5, x + 0.5 * h * v1, v + 0.5 * h * a1), v + 0.5 * h * a1);
                let (a3, v3) = (acceleration(i, 0.5, x + 0.5 * h * v2, v + 0.5 * h * a2), v + 0.5 * h * a2);
                let (a4, v4) = (acceleration(i, 1.0, x + h * v3, v + h * a3), v + h * a3);
                x += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
                v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
            }
        }
        out
    }
}

/// Magnitude of a step times an eigenvalue up to which the classical Runge-Kutta method of fourth order is stable, on the real axis (a
/// damper: 2.785) and on the imaginary one (a spring: 2 sqrt(2)); numbers of the method (Hairer and Wanner 1996, section IV.2).
const STABLE_DAMPER: f64 = 2.785;
const STABLE_SPRING: f64 = 2.0 * std::f64::consts::SQRT_2;

/// Whether an explicit step of `h`, s, of a body of `mass`, kg, would grow without end where the contact has one of `tangents`.
fn is_stiff(h: f64, mass: f64, tangents: &[(f64, f64)]) -> bool {
    let is = |(k, c): &(f64, f64)| h * c / mass > STABLE_DAMPER || h * (k.max(0.0) / mass).sqrt() > STABLE_SPRING;
    tangents.iter().any(is)
}

/// A step of `h`, s, from position and speed `from` that is stable however stiff the contact is: the diagonally implicit
/// Runge-Kutta method of second order that is L-stable (Alexander 1977, eq. 2.3). `at`: k N/m, c N s/m and force N at a share of
/// the step.
fn stiff_step(h: f64, mass: f64, at: impl Fn(f64) -> (f64, f64, f64), from: (f64, f64)) -> (f64, f64) {
    let share = 1.0 - std::f64::consts::FRAC_1_SQRT_2;
    let own = share * h;
    // speed and acceleration of a stage that begins at x, v
    let stage = |w: f64, x: f64, v: f64| {
        let (k, c, force) = at(w);
        // a contact that gives the more the deeper it is does not hold the body back
        let (k, c) = (k.max(0.0), c.max(0.0));
        let a = (force - k * (x + own * v) - c * v) / (mass + own * c + own * own * k);
        (v + own * a, a)
    };
    let (x, v) = from;
    let (v1, a1) = stage(share, x, v);
    let (x, v) = (x + (h - own) * v1, v + (h - own) * a1);
    let (v2, a2) = stage(1.0, x, v);
    (x + own * v2, v + own * a2)
}

/// k(t) N/m, c(t) N s/m of the contact along a simulated path.
pub(crate) fn tangents(physics: &Physics, trace: &Trace, time: &[f64]) -> Vec<(f64, f64)> {
    let law = &physics.law;
    let mut m = Memory::default();
    (0..time.len())
        .map(|i| {
            let (x, v) = (trace.position[i], trace.velocity[i]);
            if i > 0 {
                let (x0, v0) = (trace.position[i - 1], trace.velocity[i - 1]);
                m = law.advance(&m, x0, v0, x, v, time[i] - time[i - 1]);
            }
            law.derivatives(&m, x, v)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stiff_step_follows_the_exact_motion_and_the_force_over_the_stiffness() {
        // a spring and a damper under a constant force, from rest: against the exact motion, error falls with the square of the step
        let (mass, k, c, force) = (0.5f64, 2e3f64, 3.0, 7.0);
        let (decay, whole) = (c / (2.0 * mass), 0.05);
        let omega = (k / mass - decay * decay).sqrt();
        let (sin, cos) = (omega * whole).sin_cos();
        let exact = force / k * (1.0 - (-decay * whole).exp() * (cos + decay / omega * sin));
        let off = |steps: usize| {
            let h = whole / steps as f64;
            let end = (0..steps).fold((0.0, 0.0), |at, _| stiff_step(h, mass, |_| (k, c, force), at));
            (end.0 / exact - 1.0).abs()
        };
        let (coarse, fine) = (off(50), off(100));
        assert!(fine < 1e-3 && (3.5..4.5).contains(&(coarse / fine)), "{coarse} {fine}");
        // however stiff: at rest where the force is held
        for stiffness in [1e9, 1e15, 1e25] {
            let end = (0..20).fold((0.0, 0.0), |at, _| stiff_step(1e-3, mass, |_| (stiffness, 1e3, force), at));
            assert!((end.0 * stiffness / force - 1.0).abs() < 1e-6, "{end:?} at {stiffness}");
        }
    }

    #[test]
    fn a_step_is_stiff_where_an_explicit_one_grows() {
        let mass = 0.3;
        for (tangent, h, stiff) in [
            ((1e5, 0.0), 4e-3, false),
            ((1e5, 0.0), 6e-3, true),
            ((0.0, 100.0), 8e-3, false),
            ((0.0, 100.0), 1e-2, true),
        ] {
            assert_eq!(is_stiff(h, mass, &[(0.0, 0.0), tangent]), stiff, "{tangent:?} {h}");
        }
        assert!(!is_stiff(1.0, mass, &[(-1e9, -1e9), (0.0, 0.0)]));
    }
}
