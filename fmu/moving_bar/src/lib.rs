//! MovingBar: a bar with return spring and magnet, or a falling body, behind the FMI 2.0 interface of [`face`].
//!
//! Invariant: the motion stands in [`bar`] only; the interface is [`face`]'s, the exponential [`law`]'s.
#![deny(unsafe_code)]

pub mod bar;
pub mod instance;
pub mod start;
pub mod state;

face::export!(instance::Instance);
