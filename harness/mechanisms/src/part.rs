//! What a part of the physics may add: to the law of a recording, to the forces, to the readings.

use crate::load_history::LoadHistory;
use std::fmt::Debug;

/// Where the body is when a force on it is asked for, SI.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Time since release or touch, s.
    pub time: f64,
    /// Position of the body from the nominal surface, m, positive into the stop.
    pub x: f64,
    /// Speed, m/s.
    pub v: f64,
    /// Distance from rest to the stop, m; 0 in a drop test.
    pub travel: f64,
}

/// What a measuring stage has to know of a recording.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    /// Sampling interval, s.
    pub dt: f64,
    /// Recordings taken before this one.
    pub before: f64,
}

/// What values a key may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Allowed {
    /// Any number.
    Any,
    /// 0 or more.
    FromZero,
    /// More than 0.
    AboveZero,
}

impl Allowed {
    /// Whether it allows `value`, which has to be a number.
    pub fn holds(self, value: f64) -> bool {
        value.is_finite()
            && match self {
                Allowed::Any => true,
                Allowed::FromZero => value >= 0.0,
                Allowed::AboveZero => value > 0.0,
            }
    }

    /// In words.
    pub fn words(self) -> &'static str {
        match self {
            Allowed::Any => "a number",
            Allowed::FromZero => "0 or more",
            Allowed::AboveZero => "more than 0",
        }
    }
}

/// A quantity of a part that a scenario may give, by the name under which a diagnosis reports it.
pub struct Key<P> {
    pub name: &'static str,
    /// SI; "1" for none.
    pub unit: &'static str,
    pub allowed: Allowed,
    pub put: fn(&mut P, f64),
}

/// Factors by which earlier recordings have changed a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wear {
    /// On all stiffness of the contact.
    pub stiffness: f64,
    /// On its hysteresis damping.
    pub damping: f64,
}

/// A part of the physics of a recording: its parameters, and what it adds. Every hook is neutral unless a part says
/// otherwise; `Default` is the part that adds nothing.
pub trait Part: Copy + Debug + Default + PartialEq + 'static {
    /// What a scenario may give of it; empty where it cannot hold the part.
    const KEYS: &'static [Key<Self>] = &[];
    /// Whether it has a mass that rides on the body ([`Part::riding_mass`]).
    const RIDES: bool = false;

    /// What earlier recordings have done to the contact.
    fn wear(&self, _: &LoadHistory) -> Wear {
        Wear { stiffness: 1.0, damping: 1.0 }
    }

    /// `f` with the force on the body along +x, N.
    #[inline]
    fn on_body(&self, _: &Motion, f: f64) -> f64 {
        f
    }

    /// Whether that force keeps a spring-borne mass from swinging free in closed form.
    #[inline]
    fn needs_integration(&self) -> bool {
        false
    }

    /// `f` with what a transducer under the stop reads besides the contact force, N.
    #[inline]
    fn on_transducer(&self, _: &Motion, f: f64) -> f64 {
        f
    }

    /// Whether [`Part::on_face`] adds anything.
    #[inline]
    fn acts_on_face(&self) -> bool {
        false
    }

    /// `f` with the force between the faces beside the contact law's, N, positive out of the stop, at penetration `x` m
    /// and speed `v` m/s.
    #[inline]
    fn on_face(&self, _x: f64, _v: f64, f: f64) -> f64 {
        f
    }

    /// Mass that rides on the body with a motion of its own, kg, taken out of the moving mass; 0: none.
    #[inline]
    fn riding_mass(&self) -> f64 {
        0.0
    }

    /// Force of that mass on the body along +x, N: `z` m ahead of the body, at `w` m/s relative to it.
    #[inline]
    fn riding_force(&self, _z: f64, _w: f64) -> f64 {
        0.0
    }

    /// Way that this mass has to the nearest wall that it may strike, m, negative in contact with it; infinite: it
    /// strikes none.
    #[inline]
    fn riding_play(&self, _z: f64) -> f64 {
        f64::INFINITY
    }

    /// Stiffness, N/m, of the seat that carries this mass along while the body is driven; None: it hangs on a spring.
    fn riding_seat(&self) -> Option<f64> {
        None
    }

    /// Whether the body bears the weight of this mass although it moves on its own.
    #[inline]
    fn bears_riding_weight(&self) -> bool {
        false
    }

    /// Puts a stage of the measuring chain on the readings: force N, acceleration m/s^2, penetration m.
    fn measure(&self, _: &mut [Vec<f64>; 3], _: &Sampling) {}
}
