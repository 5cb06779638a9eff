//! Constants of every simulation, each in one place.

pub use law::body::SLIP_SPEED;
pub use record::GRAVITY;
