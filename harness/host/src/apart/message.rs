//! What crosses between the host and an FMU's process: a request and its reply.

use crate::here::Making;
use crate::trouble::Trouble;
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::ffi::CString;
use std::path::PathBuf;
use std::time::Duration;

/// Value references.
pub(super) type References<'a> = Cow<'a, [u32]>;

/// What the host asks.
#[derive(Serialize, Deserialize)]
pub(super) enum Request<'a> {
    /// To load the binary, with at most so many bytes of memory.
    Load {
        library: PathBuf,
        memory: Option<u64>,
    },
    /// To make the instance.
    Instantiate(Making),
    /// To free the instance.
    Free,
    /// To unload the binary and end.
    Unload,
    Patience(Duration),
    SetDebugLogging(bool, Cow<'a, [CString]>),
    SetupExperiment(Option<f64>, f64, Option<f64>),
    EnterInitialization,
    ExitInitialization,
    CancelStep,
    Terminate,
    Reset,
    SetReal(References<'a>, Cow<'a, [f64]>),
    GetReal(References<'a>),
    SetInteger(References<'a>, Cow<'a, [i32]>),
    GetInteger(References<'a>),
    SetBoolean(References<'a>, Cow<'a, [i32]>),
    GetBoolean(References<'a>),
    SetString(References<'a>, Cow<'a, [CString]>),
    GetString(References<'a>),
    SetRealInputDerivatives(References<'a>, Cow<'a, [i32]>, Cow<'a, [f64]>),
    GetRealOutputDerivatives(References<'a>, Cow<'a, [i32]>),
    GetDirectionalDerivative(References<'a>, References<'a>, Cow<'a, [f64]>),
    DoStep {
        time: f64,
        step: f64,
        never_back: bool,
    },
    GetState(usize),
    SetState(usize),
    FreeState(usize),
    Serialize(usize),
    Deserialize(usize, Cow<'a, [u8]>),
}

/// What the FMU's process answers.
#[derive(Serialize, Deserialize)]
pub(super) enum Reply {
    Done,
    Reals(Vec<f64>),
    Integers(Vec<i32>),
    Texts(Vec<String>),
    Bytes(Vec<u8>),
    /// The binary was not loaded, or no instance was made: why.
    NotMade(String),
    Refused(Box<Trouble>),
}
