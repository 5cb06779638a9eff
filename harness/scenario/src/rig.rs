//! The equations of motion, plain SI. x > 0 is into the stop; every body's x is zero where it stands as the tip
//! touches with the sensors' springs unstretched.
//!
//! One body (Ahn and Ryu 2005, eq. 6, here with what drives it): M x'' + F = M g - friction + drive.
//! Three (eqs 3 to 5): m_t x_t'' = k_t (x_b - x_t) - F, m_b x_b'' = -k_t (x_b - x_t) - k_a (x_b - x_a),
//! m_a x_a'' = k_a (x_b - x_a), each with its weight, and dampers beside both springs.

use super::integrator::{State, MOST};

/// Width of the smoothed zero of Coulomb friction, m/s.
const SLIP: f64 = 1e-3;

/// A sensor's spring with a damper beside it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// N/m.
    pub stiffness: f64,
    /// N s/m.
    pub damping: f64,
}

/// What moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bodies {
    /// All masses as one, kg.
    One(f64),
    /// Accelerometer, body, tip, kg, with the sensors' springs between.
    Three {
        /// Mass of the accelerometer, kg.
        accelerometer: f64,
        /// Mass of the body, kg.
        body: f64,
        /// Mass of the tip, kg.
        tip: f64,
        /// Spring between accelerometer and body.
        accelerometer_spring: Link,
        /// Spring of the force transducer, between body and tip.
        transducer: Link,
    },
}

/// The drive of a contactor: a return spring, and a holding force that fades.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// From rest to the stop, m.
    pub travel: f64,
    /// Spring force at rest, N.
    pub preload: f64,
    /// Spring rate, N/m.
    pub rate: f64,
    /// Holding force at the first instant, N.
    pub holding_force: f64,
    /// Time constant with which it fades, s.
    pub holding_time: f64,
}

/// A rig without its contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rig {
    /// What moves.
    pub bodies: Bodies,
    /// Gravity along +x before the first touch, m/s^2.
    pub gravity_before: f64,
    /// Gravity along +x from the first touch on, m/s^2.
    pub gravity_after: f64,
    /// Coulomb friction of the guide on the body, N.
    pub friction: f64,
    /// What drives it, for a contactor.
    pub spring: Option<Spring>,
}

/// Places of what is integrated along beside the motion.
pub struct Places {
    /// Work done on the contact, J.
    pub work: usize,
    /// Heat in guide and sensors, J.
    pub heat: usize,
    /// Work done against the holding force, J.
    pub holding: usize,
    /// Impulse of the contact force, N s.
    pub impulse: usize,
}

impl Rig {
    /// Number of bodies.
    pub fn count(&self) -> usize {
        match self.bodies {
            Bodies::One(_) => 1,
            Bodies::Three { .. } => 3,
        }
    }

    /// Length of the state: position and velocity of tip, body, accelerometer; then [`Places`].
    pub fn dimension(&self) -> usize {
        2 * self.count() + 4
    }

    /// Where the quantities beside the motion stand.
    pub fn places(&self) -> Places {
        let n = 2 * self.count();
        Places { work: n, heat: n + 1, holding: n + 2, impulse: n + 3 }
    }

    /// Masses in the order of the state, kg.
    pub fn masses(&self) -> [f64; 3] {
        match self.bodies {
            Bodies::One(m) => [m, 0.0, 0.0],
            Bodies::Three { accelerometer, body, tip, .. } => [tip, body, accelerometer],
        }
    }

    /// All masses, kg.
    pub fn mass(&self) -> f64 {
        self.masses().iter().sum()
    }

    /// Rates of the state under the contact force `f`, N.
    pub fn rates(&self, gravity: f64, t: f64, y: &State, f: f64) -> State {
        let mut d = [0.0; MOST];
        let at = self.places();
        let outside = |v: f64, x: f64, d: &mut State| {
            let friction = self.friction * (v / SLIP).tanh();
            d[at.heat] += friction * v;
            let mut drive = -friction;
            if let Some(s) = &self.spring {
                drive += s.preload - s.rate * (x + s.travel);
                if s.holding_force > 0.0 {
                    let hold = s.holding_force * (-t / s.holding_time).exp();
                    drive -= hold;
                    d[at.holding] = hold * v;
                }
            }
            drive
        };
        match &self.bodies {
            Bodies::One(m) => {
                let drive = outside(y[1], y[0], &mut d);
                d[0] = y[1];
                d[1] = (drive - f) / m + gravity;
            }
            Bodies::Three { accelerometer, body, tip, accelerometer_spring: a, transducer: b } => {
                let drive = outside(y[3], y[2], &mut d);
                let (vt, va) = (y[3] - y[1], y[3] - y[5]);
                let ft = b.stiffness * (y[2] - y[0]) + b.damping * vt;
                let fa = a.stiffness * (y[2] - y[4]) + a.damping * va;
                d[0] = y[1];
                d[1] = (ft - f) / tip + gravity;
                d[2] = y[3];
                d[3] = (drive - ft - fa) / body + gravity;
                d[4] = y[5];
                d[5] = fa / accelerometer + gravity;
                d[at.heat] += b.damping * vt * vt + a.damping * va * va;
            }
        }
        d[at.work] = f * y[1];
        d[at.impulse] = f;
        d
    }

    /// Kinetic energy, J.
    pub fn kinetic(&self, y: &State) -> f64 {
        let m = self.masses();
        (0..self.count()).map(|i| 0.5 * m[i] * y[2 * i + 1] * y[2 * i + 1]).sum()
    }

    /// Energy in the sensors' springs, J.
    pub fn in_sensors(&self, y: &State) -> f64 {
        match &self.bodies {
            Bodies::One(_) => 0.0,
            Bodies::Three { accelerometer_spring: a, transducer: b, .. } => {
                0.5 * (b.stiffness * (y[2] - y[0]).powi(2) + a.stiffness * (y[2] - y[4]).powi(2))
            }
        }
    }

    /// Potential energy of weight and return spring, zero with every x at zero, J.
    pub fn potential(&self, gravity: f64, y: &State) -> f64 {
        let m = self.masses();
        let weight: f64 = (0..self.count()).map(|i| -gravity * m[i] * y[2 * i]).sum();
        let body = if self.count() == 3 { y[2] } else { y[0] };
        let spring = self.spring.map_or(0.0, |s| {
            // force preload - rate (x + travel): minus its integral from 0
            -(s.preload - s.rate * s.travel) * body + 0.5 * s.rate * body * body
        });
        weight + spring
    }

    /// Position m and velocity m/s of the centre of mass.
    pub fn centre(&self, y: &State) -> (f64, f64) {
        let m = self.masses();
        if self.count() == 1 {
            return (y[0], y[1]);
        }
        let all = self.mass();
        let sum = |o: usize| (0..3).map(|i| m[i] * y[2 * i + o]).sum::<f64>() / all;
        (sum(0), sum(1))
    }

    /// How far the tip can get ahead of the centre of mass by what rings in the sensors now, m: the energy of the
    /// relative motion cannot grow in free flight, and bounds both stretches.
    pub fn reach(&self, y: &State) -> f64 {
        match &self.bodies {
            Bodies::One(_) => 0.0,
            Bodies::Three { accelerometer, body, accelerometer_spring: a, transducer: b, .. } => {
                let v = self.centre(y).1;
                let ringing = (self.kinetic(y) - 0.5 * self.mass() * v * v).max(0.0) + self.in_sensors(y);
                let stretch = |k: f64| (2.0 * ringing / k).sqrt();
                ((accelerometer + body) * stretch(b.stiffness) + accelerometer * stretch(a.stiffness)) / self.mass()
            }
        }
    }

    /// (force in the transducer N, accelerometer's reading m/s^2) for three bodies. The transducer is positive in
    /// compression; the accelerometer reads kinematic acceleration less gravity along x.
    pub fn sensors(&self, y: &State) -> Option<(f64, f64)> {
        match &self.bodies {
            Bodies::One(_) => None,
            Bodies::Three { accelerometer, accelerometer_spring: a, transducer: b, .. } => Some((
                b.stiffness * (y[2] - y[0]) + b.damping * (y[3] - y[1]),
                (a.stiffness * (y[2] - y[4]) + a.damping * (y[3] - y[5])) / accelerometer,
            )),
        }
    }
}
