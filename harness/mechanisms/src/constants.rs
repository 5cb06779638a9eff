//! Constants of every simulation, each in one place.

pub use record::GRAVITY;

/// Speed over which Coulomb friction turns with the motion, m/s: its sign is smoothed as tanh(v/[`SLIP_SPEED`])
/// (Andersson, Soderberg, Bjorklund 2007, Tribology International 40, 580).
pub const SLIP_SPEED: f64 = 1e-3;
