//! BodyForce: friction, drag, spring, magnet and film on a body behind the FMI 2.0 interface of [`face`].
//!
//! Invariant: the forces stand in `law::body` only; the interface is [`face`]'s.
#![deny(unsafe_code)]

pub mod instance;
pub mod start;
pub mod state;

face::export!(instance::Instance);
