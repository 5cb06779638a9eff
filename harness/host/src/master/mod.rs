//! A co-simulation host: several FMUs from anyone, connected, and masters to step them.
//!
//! [`System`] is what a user writes, as TOML or as an SSP archive; [`Network`] the slaves with their connections, in
//! the order that declared feedthrough gives; [`Options`] how they are stepped; [`run`] steps them and hands every
//! communication point on.
//!
//! Invariant: a master knows slaves by [`Slave`] only, never what they model.

pub(crate) mod build;
mod drive;
mod export;
mod implicit;
pub(crate) mod network;
mod options;
mod sink;
mod slave;
mod ssp;
mod step;
mod system;

pub use build::{build, Built};
pub use drive::{run, Moment, Outcome};
pub use export::export_ssp;
pub use network::{Feed, Input, Map, Network, Output, Part};
pub use options::{Adapt, Bond, Inputs, Lookahead, Method, Options, Shape, Touch};
pub use sink::{are_rows, Sink, TIME};
pub use slave::{Abilities, FmuSlave, Slave};
pub use system::{files_of, Component, Connection, Master, System};
