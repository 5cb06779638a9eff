//! What crosses between the host and an FMU's process: a request and its reply.

use crate::batch::Call;
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
    /// Calls in order, then reading.
    Batch {
        calls: Cow<'a, [Call<'a>]>,
        never_back: bool,
        read: References<'a>,
    },
    GetState(usize),
    SetState(usize),
    FreeState(usize),
    Serialize(usize),
    Deserialize(usize, Cow<'a, [u8]>),
}

impl Request<'_> {
    /// How many values it asks for.
    pub(super) fn asked(&self) -> usize {
        match self {
            Request::GetReal(r) | Request::GetInteger(r) | Request::GetBoolean(r) | Request::GetString(r) => r.len(),
            Request::Batch { read, .. } => read.len(),
            Request::GetRealOutputDerivatives(r, _) | Request::GetDirectionalDerivative(r, ..) => r.len(),
            _ => 0,
        }
    }
}

/// What the FMU's process answers. Those with values come first: see [`Reply::of`].
#[derive(Serialize, Deserialize)]
pub(super) enum Reply {
    Reals(Vec<f64>),
    Integers(Vec<i32>),
    Texts(Vec<String>),
    Done,
    Bytes(Vec<u8>),
    /// The binary was not loaded, or no instance was made: why.
    NotMade(String),
    Refused(Box<Trouble>),
    /// Which call of a batch was refused.
    RefusedAt(usize, Box<Trouble>),
}

/// How many kinds of reply hold values.
const WITH_VALUES: u32 = 3;

impl Reply {
    /// The reply that bytes are, to a request for `asked` values; None where they are none. Of more values than were asked for
    /// nothing is read: a text in a vector takes 24 times the byte that it crossed as.
    pub(super) fn of(bytes: &[u8], asked: usize) -> Option<Reply> {
        let (kind, rest) = postcard::take_from_bytes::<u32>(bytes).ok()?;
        if kind < WITH_VALUES {
            let (count, _) = postcard::take_from_bytes::<u64>(rest).ok()?;
            if count != asked as u64 {
                return None;
            }
        }
        postcard::from_bytes(bytes).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_values_than_were_asked_for_are_not_read() {
        let bytes = |r: Reply| postcard::to_stdvec(&r).unwrap();
        let texts = |n: usize| bytes(Reply::Texts(vec![String::new(); n]));
        assert!(matches!(Reply::of(&texts(2), 2), Some(Reply::Texts(t)) if t.len() == 2));
        let mut many = texts(200);
        assert!(Reply::of(&many, 2).is_none() && Reply::of(&many, 0).is_none());
        many.truncate(3);
        assert!(Reply::of(&many, 200).is_none(), "as many as it says are not there");
        assert!(matches!(Reply::of(&bytes(Reply::Reals(vec![1.0])), 1), Some(Reply::Reals(_))));
        assert!(Reply::of(&bytes(Reply::Integers(vec![1])), 2).is_none());
        assert!(matches!(Reply::of(&bytes(Reply::Done), 0), Some(Reply::Done)));
        assert!(matches!(Reply::of(&bytes(Reply::Bytes(vec![0; 9])), 0), Some(Reply::Bytes(b)) if b.len() == 9));
        assert!(Reply::of(&[], 0).is_none());
    }
}
