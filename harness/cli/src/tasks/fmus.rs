//! Where somebody else's FMUs run.

use anyhow::{ensure, Result};
use host::{Isolation, Limits};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// In this process, or in one of its own where a call may take `seconds` s and all of it `memory` MB (None: no limit). `stop`
/// ends a call that is under way.
///
/// # Errors
/// A time or a memory of none.
pub fn isolation(in_process: bool, seconds: f64, memory: Option<u64>, stop: &'static AtomicBool) -> Result<Isolation> {
    if in_process {
        return Ok(Isolation::None);
    }
    let time = Duration::try_from_secs_f64(seconds).unwrap_or_default();
    ensure!(!time.is_zero(), "--fmu-seconds {seconds}: give a time above 0, in s");
    let memory = memory.map(|mb| mb.saturating_mul(1 << 20));
    ensure!(memory != Some(0), "--fmu-memory 0: give MB above 0, or leave it out");
    Ok(Isolation::Process(Limits { time, memory, stop: Some(stop), ..Limits::new() }))
}
