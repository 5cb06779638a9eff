//! Constants of every simulation, each in one place.

pub use record::GRAVITY;

/// Speed over which Coulomb friction turns with the motion, m/s: its sign is smoothed as tanh(v/[`SLIP_SPEED`])
/// (Andersson, Soderberg, Bjorklund 2007, Tribology International 40, 580). Five times sharper, estimation's integration
/// errs by 5e-4 of range where it errs by less than 3e-4 now.
pub const SLIP_SPEED: f64 = 5e-3;
