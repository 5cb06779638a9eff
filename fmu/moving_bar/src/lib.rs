//! MovingBar: a bar with return spring and magnet, or a falling body, behind the FMI 2.0 face of the contact element.
//!
//! Invariant: the face, the life of an instance, the block of start values and the exponential are the element's own files.
pub mod bar;
#[path = "../../src/fmi2.rs"]
pub mod fmi2;
pub mod instance;
#[path = "../../src/life.rs"]
pub mod life;
#[path = "../../src/start.rs"]
pub mod start;
pub mod state;
pub mod variables;
