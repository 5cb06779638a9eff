//! What stands in for the contact while a scenario runs: the law called directly, or any FMI 2.0 co-simulation FMU.
//!
//! [`Fmu`] is an unpacked archive with its binary loaded; [`Instance`] is one slave of it, on the raw binding of the
//! crate `fmi`; [`FmuElement`] is a contact [`Element`] made of one.

mod archive;
mod description;
mod error;
mod fmu;
mod fmu_element;
mod instance;
mod log;
pub mod master;
mod state;
mod status;
mod value;

pub use description::{Capabilities, Causality, Description, Kind, Start, Unit, Variability, Variable};
pub use error::{CallError, Discarded, HostError};
pub use fmu::Fmu;
pub use fmu_element::{Coupling, FmuElement, Names};
pub use instance::Instance;
pub use log::LogLine;
pub use plant::element::{Direct, Element};
pub use state::State;
pub use status::Status;
pub use value::Value;
