//! Scenarios a user writes in TOML: a drop test, or the opening of a magnetic contactor.
//!
//! `file` reads and checks, `plan` makes one [`Case`] of every height, tip and comparison, `rig` says what moves as the
//! plant's rig has it, `observed` adds what is integrated along, `simulate` takes a case to its end on any contact
//! [`host::Element`], `results` makes tables of what came out. Equations of motion and integrator are the plant's.

mod contact;
mod file;
mod interrupters;
mod locate;
mod motion;
mod observed;
mod outcome;
mod plan;
mod results;
mod rig;
mod simulate;
mod source;

pub use contact::{Contact, Faces, Variables};
pub use file::{Compare, Kind, Masses, Model, PhotoInterrupters, Scenario, Sensors, Tip};
pub use interrupters::{recover, Recovered};
pub use outcome::{Balance, Bounce, Event, Exact, Moment, Outcome, Row};
pub use plan::{Case, Start};
pub use results::{peak, table, SensorPeak, Table};
pub use rig::{Bodies, Link, Places, Rig, Spring};
pub use simulate::{simulate, simulate_as_far, CONTROL};
pub use source::{Source, Through};

pub use mechanisms::physics::GRAVITY;
