//! What stands in for the contact while a scenario runs: the law called directly, or any FMI 2.0 co-simulation FMU.
//!
//! [`Fmu`] is an unpacked archive; [`Instance`] is one slave of it, in this process on the raw binding of the crate `fmi`
//! or, by [`Isolation`], in a process of its own; [`FmuElement`] is a contact [`Element`] made of one.

#[cfg_attr(not(target_os = "linux"), path = "apart_nowhere.rs")]
mod apart;
mod archive;
mod arithmetic;
mod batch;
mod coupled;
mod description;
mod error;
mod fmu;
mod fmu_element;
mod here;
mod instance;
mod isolation;
mod log;
pub mod master;
mod missing;
mod state;
mod status;
mod trouble;
mod units;
mod value;
mod xml;

pub use apart::serve;
pub use batch::Call;
pub use coupled::{handed_back, propose, replaceable, Fmus, Ours, Proposal, ProposedBond};
pub use description::{Capabilities, Causality, Description, Kind, Start, Unit, Variability, Variable};
pub use error::{end_asked, CallError, Discarded, HostError};
pub use fmu::Fmu;
pub use fmu_element::{Coupling, FmuElement, Names};
pub use instance::Instance;
pub use isolation::{served_by, Isolation, Limits, ARGUMENT, TIME};
pub use log::LogLine;
pub use plant::element::{Direct, Element};
pub use state::State;
pub use status::Status;
pub use value::Value;
