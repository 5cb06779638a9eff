//! Scenarios a user writes in TOML: a drop test, or the opening of a magnetic contactor.
//!
//! `file` reads and checks, `plan` makes one [`Case`] of every height, tip and comparison, `rig` holds the
//! equations of motion, `coupled` steps them with `integrator` beside any contact [`host::Element`], `simulate`
//! takes them to their end, `results` makes tables of what came out.

mod contact;
mod coupled;
mod file;
mod integrator;
mod interrupters;
mod locate;
mod outcome;
mod plan;
mod results;
mod rig;
mod simulate;
mod source;

pub use contact::{Contact, Faces, Variables};
pub use file::{Compare, Kind, Masses, Model, PhotoInterrupters, Scenario, Sensors, Tip};
pub use interrupters::{recover, Recovered};
pub use outcome::{Balance, Bounce, Event, Moment, Outcome, Row};
pub use plan::{Case, Start};
pub use results::{peak, table, Exact, SensorPeak, Table};
pub use rig::{Bodies, Link, Places, Rig, Spring};
pub use simulate::simulate;
pub use source::{Source, Through};

/// Gravity, m/s^2, as the recordings' format has it.
pub const GRAVITY: f64 = 9.81;
