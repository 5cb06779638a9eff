//! Where FMUs have no processes of their own: nothing of [`Apart`] can be made, so nothing of it is ever called.

use super::batch::Call;
use super::here::Making;
use super::isolation::Limits;
use super::log::Log;
use super::trouble::{Answer, Trouble};
use std::ffi::CString;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

/// Serves nothing here.
pub fn serve() -> ExitCode {
    ExitCode::from(2)
}

/// There is none.
pub(super) enum Apart {}

/// Why no slave was made.
pub(super) enum NotMade {
    NotLoaded(String),
    Refused(String),
    Died(&'static str, String),
}

macro_rules! never {
    ($($name:ident($($a:ident: $t:ty),*) -> $r:ty;)*) => {
        impl Apart {
            $(pub(super) fn $name(&mut self, $($a: $t),*) -> $r {
                $(let _ = $a;)*
                match *self {}
            })*
        }
    };
}

impl Apart {
    pub(super) fn start(_: &Path, _: Making, _: &Limits, _: Arc<Log>) -> Result<Apart, NotMade> {
        Err(NotMade::Refused("no process of its own on this platform; run it with --in-process".into()))
    }

    pub(super) fn end(self) -> Result<(), (&'static str, String)> {
        match self {}
    }
}

never! {
    set_patience(patience: Duration) -> Answer;
    hurry(longest: Duration) -> Answer;
    set_debug_logging(on: bool, categories: &[CString]) -> Answer;
    setup_experiment(tolerance: Option<f64>, start: f64, stop: Option<f64>) -> Answer;
    enter_initialization() -> Answer;
    exit_initialization() -> Answer;
    cancel_step() -> Answer;
    terminate() -> Answer;
    reset() -> Answer;
    set_real(references: &[u32], values: &[f64]) -> Answer;
    get_real(references: &[u32], values: &mut [f64]) -> Answer;
    set_integer(references: &[u32], values: &[i32]) -> Answer;
    get_integer(references: &[u32], values: &mut [i32]) -> Answer;
    set_boolean(references: &[u32], values: &[i32]) -> Answer;
    get_boolean(references: &[u32], values: &mut [i32]) -> Answer;
    set_string(references: &[u32], values: &[CString]) -> Answer;
    get_string(references: &[u32]) -> Result<Vec<String>, Box<Trouble>>;
    set_real_input_derivatives(references: &[u32], orders: &[i32], values: &[f64]) -> Answer;
    get_real_output_derivatives(references: &[u32], orders: &[i32], values: &mut [f64]) -> Answer;
    get_directional_derivative(u: &[u32], k: &[u32], direction: &[f64], answer: &mut [f64]) -> Answer;
    do_step(time: f64, step: f64, never_back: bool) -> Answer;
    batch(c: &[Call], n: bool, r: &[u32], v: &mut [f64]) -> Result<(), (usize, Box<Trouble>)>;
    get_state(slot: usize) -> Answer;
    set_state(slot: usize) -> Answer;
    free_state(slot: usize) -> Answer;
    serialize(slot: usize) -> Result<Vec<u8>, Box<Trouble>>;
    deserialize(slot: usize, bytes: &[u8]) -> Answer;
}
