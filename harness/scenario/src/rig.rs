//! A scenario's bodies and what drives them, as the plant's rig has them, and their energies. Plain SI; x > 0 is into
//! the stop; every body's x is zero where it stands as the tip touches with the sensors' springs unstretched.
//!
//! One body is that of Ahn and Ryu 2005, eq. 6: M x'' + F = M g - friction + drive. Three are those of eqs 3 to 5:
//! m_t x_t'' = k_t (x_b - x_t) - F, m_b x_b'' = -k_t (x_b - x_t) - k_a (x_b - x_a), m_a x_a'' = k_a (x_b - x_a), each
//! with its weight, and dampers beside both springs.

use law::Parameters;
use mechanisms::attached_mass::AttachedMass;
use mechanisms::physics::Physics;
use mechanisms::sensor_resonance::Tip;
use plant::simulate::Setup;

/// Most numbers in a row's state.
pub const MOST: usize = 10;
/// State of a row: position m and velocity m/s of tip, body, accelerometer (one body: the first pair), then [`Places`];
/// only the first [`Rig::dimension`] entries are used.
pub type State = [f64; MOST];

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
    /// Parts that act on the body on its way: friction of the guide, the holding force, and what else a scenario gives;
    /// its law, mass and gravity count for nothing.
    pub parts: Physics,
    /// What drives it, for a contactor.
    pub spring: Option<Spring>,
}

/// Places of what is integrated along beside the motion.
pub struct Places {
    /// Work done on the contact, J.
    pub work: usize,
    /// Work against guide and other forces on the way, and heat in the sensors, J.
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

    /// Whether anything but weight, spring and contact acts on the body.
    pub fn acts_on_the_way(&self) -> bool {
        self.parts != Physics::default()
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

    /// The bodies and the forces on them, under `gravity` along +x, m/s^2. Of the law only what distinguishes a depth from a
    /// speed is used: the force is the contact element's.
    pub fn physics(&self, law: &Parameters, gravity: f64) -> Physics {
        let mut p = Physics { law: *law, mass: self.mass(), gravity, ..self.parts };
        if let Bodies::Three { accelerometer, tip, accelerometer_spring: a, transducer: t, .. } = self.bodies {
            p.sensor_resonance = Tip { mass: tip, stiffness: t.stiffness, damping: t.damping };
            p.attached_mass =
                AttachedMass { mass: accelerometer, stiffness: a.stiffness, damping: a.damping, hardening: 0.0 };
        }
        p
    }

    /// What drives the bodies beside those forces.
    pub fn setup(&self) -> Setup {
        let drop = Setup::drop_test(Vec::new(), 1.0, 1.0, 1.0);
        match self.spring {
            None => drop,
            Some(s) => Setup {
                kind: record::Kind::ContactorOpening,
                travel: s.travel,
                preload: s.preload,
                rate: s.rate,
                ..drop
            },
        }
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

    /// How far the tip can get ahead of the centre of mass, whose speed is `v` m/s, by what rings in the sensors now, m: the energy of the
    /// relative motion cannot grow in free flight, and bounds both stretches.
    pub fn reach(&self, y: &State, v: f64) -> f64 {
        match &self.bodies {
            Bodies::One(_) => 0.0,
            Bodies::Three { accelerometer, body, accelerometer_spring: a, transducer: b, .. } => {
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
