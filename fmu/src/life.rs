//! What any model behind the FMI face shares: its phases, its refusals, its times. Both models of the workspace use
//! this file and `fmi2.rs` as they stand.

/// Where an instance stands in its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Phase {
    /// fmi2Instantiate returned it, or fmi2Reset.
    Instantiated = 0,
    /// Between fmi2EnterInitializationMode and fmi2ExitInitializationMode.
    Initialization = 1,
    /// May step.
    Stepping = 2,
    /// After fmi2Terminate.
    Terminated = 3,
}

impl Phase {
    /// The phase of a byte that [`Phase`] was written as.
    pub fn from_byte(b: u8) -> Option<Phase> {
        match b {
            0 => Some(Phase::Instantiated),
            1 => Some(Phase::Initialization),
            2 => Some(Phase::Stepping),
            3 => Some(Phase::Terminated),
            _ => None,
        }
    }
}

/// Why a call was not done.
#[derive(Clone, Debug, PartialEq)]
pub enum Refusal {
    /// The call cannot be done now; the instance is as it was.
    Discard(String),
    /// The call is wrong; the instance is as it was.
    Error(String),
}

/// What a call comes to.
pub type Outcome<T> = Result<T, Refusal>;

/// Times agree within this share of themselves, so that t = i h and a running sum of h both pass.
const TIME_TOLERANCE: f64 = 1e-8;

/// An error that says why.
pub fn error<T>(message: String) -> Outcome<T> {
    Err(Refusal::Error(message))
}

/// Holds a call against the phases it is allowed in.
///
/// # Errors
/// Names the call and the phase.
pub fn require(phase: Phase, call: &str, allowed: &[Phase]) -> Outcome<()> {
    if allowed.contains(&phase) {
        Ok(())
    } else {
        error(format!("{} is not allowed while {:?}", call, phase))
    }
}

/// End of an experiment from `start` s to `stop` s, infinite where the host names none.
///
/// # Errors
/// Times that are none.
pub fn experiment(start: f64, stop: Option<f64>) -> Outcome<f64> {
    let end = stop.unwrap_or(f64::INFINITY);
    if !start.is_finite() || end.is_nan() || end < start {
        return error(format!("start {} s and stop {} s: give finite times, stop not before start", start, end));
    }
    Ok(end)
}

/// Holds a step from `time` s over `step` s against where the instance `stands` and where it must `stop`, s.
///
/// # Errors
/// A step that is none, a time that is not where the instance stands, a step past the stop time.
pub fn step_is_good(time: f64, step: f64, stands: f64, stop: f64) -> Outcome<()> {
    if !(step.is_finite() && step > 0.0) {
        return error(format!("communicationStepSize is {}: give a finite step above 0 s", step));
    }
    let tolerance = TIME_TOLERANCE * time.abs().max(stands.abs()).max(step);
    if !time.is_finite() || (time - stands).abs() > tolerance {
        return error(format!("currentCommunicationPoint is {} s, the instance stands at {} s", time, stands));
    }
    if time + step > stop + tolerance {
        return error(format!("a step to {} s leads past the stop time {} s", time + step, stop));
    }
    Ok(())
}

/// Fowler, Noll and Vo's hash FNV-1a, 64 bits: finds bytes that were cut or changed.
pub fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3))
}
