//! The whole forward model of one recording: the contact law, the mass, and the parts of every mechanism.

use crate::load_history::LoadHistory;
use crate::part::{Allowed, Motion, Part, Sampling, Wear};
use crate::*;
use ::law::Parameters;

pub use crate::constants::GRAVITY;

/// Most variables of FMUs that a calibration may move.
pub const FREE: usize = 16;

/// A mass that rides on the body with a motion of its own; see the hooks of [`Part`].
#[derive(Clone, Copy, Debug)]
pub struct Rider {
    /// kg, > 0.
    pub mass: f64,
    /// Whether the body bears its weight.
    pub borne: bool,
    /// Stiffness of the seat that carries it along, N/m.
    pub seat: Option<f64>,
    /// Its force on the body along +x, N, from its place `z` m before the body and its speed `w` m/s against it.
    pub force: fn(&Physics, f64, f64) -> f64,
    /// Way to the nearest wall that it may strike, m.
    pub play: fn(&Physics, f64) -> f64,
}

/// A key of a scenario: a quantity of a part of the physics.
#[derive(Clone, Copy, Debug)]
pub struct Given {
    /// Mechanism whose part it is of.
    pub mechanism: &'static str,
    pub name: &'static str,
    /// SI; "1" for none.
    pub unit: &'static str,
    pub allowed: Allowed,
    put: fn(&str, &mut Physics, f64),
}

impl Given {
    /// Puts `value`, in its unit, into the part of `p`.
    pub fn put(&self, p: &mut Physics, value: f64) {
        (self.put)(self.name, p, value);
    }
}

/// Composes [`Physics`] of the parts that act beside the contact law, in the order in which they act.
macro_rules! physics {
    ($($module:ident $(=> $name:ident: $part:ty)?;)*) => {
        /// The forward model of one recording, plain SI; `Physics::default()` is a body of one kilogram without any
        /// force on it.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Physics {
            pub law: Parameters,
            /// Impact speed at which the law's hysteresis damping is as given, m/s: it goes with 1/impact speed
            /// (Lankarani and Nikravesh 1990, eq. for mu); None: the same at every speed. Drop tests only.
            pub damping_speed: Option<f64>,
            /// Moving mass, kg, with all that rides on the body.
            pub mass: f64,
            /// Gravity along +x, m/s^2.
            pub gravity: f64,
            /// Where FMUs simulate the recording: the bond that all of this acts at, and how far their free variables are
            /// from where the system file has them, each in its own measure.
            pub bond: usize,
            pub free: [f64; FREE],
            $($(pub $name: $part,)?)*
        }

        impl Default for Physics {
            fn default() -> Self {
                Physics {
                    law: Parameters::default(),
                    damping_speed: None,
                    mass: 1.0,
                    gravity: 0.0,
                    bond: 0,
                    free: [0.0; FREE],
                    $($($name: Default::default(),)?)*
                }
            }
        }

        impl Physics {
            /// What earlier recordings have done to the contact, all parts together.
            pub fn wear(&self, history: &LoadHistory) -> Wear {
                let mut all = Wear { stiffness: 1.0, damping: 1.0 };
                $($(
                    let one = Part::wear(&self.$name, history);
                    all.stiffness *= one.stiffness;
                    all.damping *= one.damping;
                )?)*
                all
            }

            /// `f` with the forces of all parts on the body along +x, N.
            #[inline]
            pub fn on_body(&self, at: &Motion, f: f64) -> f64 {
                $($(let f = Part::on_body(&self.$name, at, f);)?)*
                f
            }

            /// Whether any part keeps a spring-borne mass from swinging free in closed form.
            pub fn needs_integration(&self) -> bool {
                false $($(|| Part::needs_integration(&self.$name))?)*
            }

            /// `f` with what a transducer under the stop reads besides the contact force, N.
            #[inline]
            pub fn on_transducer(&self, at: &Motion, f: f64) -> f64 {
                $($(let f = Part::on_transducer(&self.$name, at, f);)?)*
                f
            }

            /// Whether any part acts between the faces.
            pub fn acts_on_face(&self) -> bool {
                false $($(|| Part::acts_on_face(&self.$name))?)*
            }

            /// Force of all parts between the faces beside the law's, N, at penetration `x` m and speed `v` m/s.
            #[inline]
            pub fn on_face(&self, x: f64, v: f64) -> f64 {
                let f = 0.0;
                $($(let f = Part::on_face(&self.$name, x, v, f);)?)*
                f
            }

            /// What a scenario may give, of every part.
            pub fn keys() -> Vec<Given> {
                let mut all = Vec::new();
                $($(all.extend(<$part as Part>::KEYS.iter().map(|k| Given {
                    mechanism: $module::MECHANISM.name,
                    name: k.name,
                    unit: k.unit,
                    allowed: k.allowed,
                    put: |key, p, v| {
                        if let Some(k) = <$part as Part>::KEYS.iter().find(|k| k.name == key) {
                            (k.put)(&mut p.$name, v);
                        }
                    },
                }));)?)*
                all
            }

            /// Masses that may ride on the body at once.
            pub const RIDERS: usize = 0 $($(+ <$part as Part>::RIDES as usize)?)*;

            /// The masses that ride on the body, in the order of their parts.
            pub fn riders(&self) -> impl Iterator<Item = Rider> {
                let riders = [$($(Rider {
                    mass: if <$part as Part>::RIDES { Part::riding_mass(&self.$name) } else { 0.0 },
                    borne: Part::bears_riding_weight(&self.$name),
                    seat: Part::riding_seat(&self.$name),
                    force: |p, z, w| Part::riding_force(&p.$name, z, w),
                    play: |p, z| Part::riding_play(&p.$name, z),
                },)?)*];
                riders.into_iter().filter(|r| r.mass > 0.0)
            }

            /// Puts the stages of the measuring chain on the readings: force N, acceleration m/s^2, penetration m.
            pub fn measure(&self, y: &mut [Vec<f64>; 3], s: &Sampling) {
                $($(Part::measure(&self.$name, y, s);)?)*
            }
        }
    };
}

crate::parts!(physics);

impl Physics {
    /// Mass of the body alone, without what rides on it and the transducer's tip, kg.
    pub fn body_mass(&self) -> f64 {
        self.mass - self.sensor_resonance.mass - self.riders().map(|r| r.mass).sum::<f64>()
    }

    /// Whether a body alone meets a rigid stop: nothing rides on it, and neither stop nor transducer moves.
    pub fn is_one_body(&self) -> bool {
        let moves = self.base_compliance.mass > 0.0 || self.base_compliance.reads || self.sensor_resonance.mass > 0.0;
        !moves && self.riders().next().is_none()
    }

    /// Weight of riding masses that the body bears, N.
    pub fn borne_weight(&self) -> f64 {
        self.riders().filter(|r| r.borne).map(|r| r.mass * self.gravity).sum()
    }
}
