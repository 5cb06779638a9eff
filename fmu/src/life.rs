//! What any model behind the FMI face shares: its phases, its refusals, its times. Both models of the workspace use
//! this file and `fmi2.rs` as they stand.

use crate::instance::Instance;
use crate::variables::{by_reference, Kind, Variable};

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

/// What every model does alike; the rest stands in its own `instance.rs`.
impl Instance {
    /// Holds a call against the phases it is allowed in.
    ///
    /// # Errors
    /// Names the call and the phase.
    pub(crate) fn require(&self, call: &str, allowed: &[Phase]) -> Outcome<()> {
        if allowed.contains(&self.state.phase) {
            Ok(())
        } else {
            error(format!("{} is not allowed while {:?}", call, self.state.phase))
        }
    }

    /// The variable of a value reference.
    ///
    /// # Errors
    /// No such variable, or one of another kind.
    pub(crate) fn find(&self, reference: u32, kind: Kind) -> Outcome<Variable> {
        match by_reference(reference) {
            Some(v) if v.kind == kind => Ok(v),
            Some(v) => error(format!("{} (value reference {}) is {:?}, not {:?}", v.name, reference, v.kind, kind)),
            None => error(format!("no variable has value reference {}", reference)),
        }
    }

    /// fmi2SetupExperiment: start and, where there is one, stop, s.
    ///
    /// # Errors
    /// Out of order, or times that are none.
    pub fn setup_experiment(&mut self, start: f64, stop: Option<f64>) -> Outcome<()> {
        self.require("fmi2SetupExperiment", &[Phase::Instantiated])?;
        self.state.stop = experiment(start, stop)?;
        self.state.time = start;
        Ok(())
    }

    /// fmi2EnterInitializationMode.
    ///
    /// # Errors
    /// Out of order.
    pub fn enter_initialization(&mut self) -> Outcome<()> {
        self.require("fmi2EnterInitializationMode", &[Phase::Instantiated])?;
        self.state.phase = Phase::Initialization;
        Ok(())
    }

    /// fmi2Terminate.
    ///
    /// # Errors
    /// Out of order.
    pub fn terminate(&mut self) -> Outcome<()> {
        self.require("fmi2Terminate", &[Phase::Stepping])?;
        self.state.phase = Phase::Terminated;
        Ok(())
    }

    /// fmi2Reset: start values, as fmi2Instantiate left it.
    pub fn reset(&mut self) {
        *self = Instance::default();
    }
}

/// Fowler, Noll and Vo's hash FNV-1a, 64 bits: finds bytes that were cut or changed.
fn checksum(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x0100_0000_01b3))
}

/// Ends a state's bytes with their checksum.
pub fn seal(bytes: &mut [u8]) {
    let at = bytes.len() - 8;
    let sum = checksum(&bytes[..at]);
    bytes[at..].copy_from_slice(&sum.to_le_bytes());
}

/// Holds bytes against their length, their first eight and the checksum of [`seal`].
///
/// # Errors
/// What is wrong with them.
pub fn unseal(b: &[u8], length: usize, magic: [u8; 8]) -> Result<(), &'static str> {
    if b.len() != length {
        return Err("not as long as a state of this version");
    }
    if b[..8] != magic {
        return Err("not a state of this model and version");
    }
    if u64::from_le_bytes(eight(b, length - 8)) != checksum(&b[..length - 8]) {
        return Err("changed since they were written");
    }
    Ok(())
}

/// The number that stands in eight bytes from `at` on, little endian.
pub fn number(b: &[u8], at: usize) -> f64 {
    f64::from_le_bytes(eight(b, at))
}

fn eight(b: &[u8], at: usize) -> [u8; 8] {
    let mut eight = [0u8; 8];
    eight.copy_from_slice(&b[at..at + 8]);
    eight
}
