//! What goes wrong with an FMU, and what it said about it.

use super::log::LogLine;
use super::status::Status;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::PathBuf;

/// What an FMU reports of a step it discarded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Discarded {
    /// End of the part of the step that was done, s; None where the FMU does not report it.
    pub last_successful_time: Option<f64>,
    /// Whether the FMU wants the simulation to end.
    pub terminated: bool,
}

/// A call that did not answer fmi2OK or fmi2Warning.
#[derive(Clone, Debug)]
pub struct CallError {
    /// Name of the instance.
    pub instance: String,
    /// C function.
    pub function: &'static str,
    /// Its answer.
    pub status: Status,
    /// What the host knows beside it; may be empty.
    pub detail: String,
    /// What the FMU logged during the call.
    pub log: Vec<LogLine>,
    /// For a discarded fmi2DoStep.
    pub discarded: Option<Discarded>,
}

impl fmt::Display for CallError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} of {} answered {}", self.function, self.instance, self.status)?;
        if !self.detail.is_empty() {
            write!(f, ": {}", self.detail)?;
        }
        if let Some(d) = self.discarded {
            if let Some(t) = d.last_successful_time {
                write!(f, "; the step was done up to {t} s")?;
            }
            if d.terminated {
                f.write_str("; the FMU wants the simulation to end")?;
            }
        }
        for line in &self.log {
            write!(f, "; it logged \"{}\"", line.message)?;
        }
        if self.log.is_empty() {
            f.write_str("; it logged nothing")?;
        }
        Ok(())
    }
}

/// Why an FMU cannot be opened or used.
#[derive(Debug, thiserror::Error)]
pub enum HostError {
    /// The archive, its description or its binary.
    #[error("{}: {why}", path.display())]
    Open {
        /// The FMU.
        path: PathBuf,
        /// What is wrong, and the cure.
        why: String,
    },
    /// A call failed.
    #[error("{0}")]
    Call(Box<CallError>),
    /// The process that an FMU has of its own ended, or was ended.
    #[error("{}: {instance}: its process ended in {function}{}: {how}", path.display(), at(*time))]
    Died {
        /// The FMU.
        path: PathBuf,
        /// Name of the instance.
        instance: String,
        /// C function under way, or what else was done.
        function: &'static str,
        /// Simulation time, s; None before it is given the start.
        time: Option<f64>,
        /// How, with the signal, the exit code or the limit.
        how: String,
    },
    /// The host was asked for what cannot be.
    #[error("{instance}: {why}")]
    Use {
        /// Name of the instance or of the model.
        instance: String,
        /// What is wrong, and the cure.
        why: String,
    },
}

fn at(time: Option<f64>) -> String {
    time.map_or(String::new(), |t| format!(" at simulation time {t} s"))
}

/// The name of the FMU that ends the simulation, where an error is that: a step discarded, and fmi2Terminated beside it
/// (FMI 2.0 section 4.2.2).
pub fn end_asked(e: &anyhow::Error) -> Option<&str> {
    let call = e.chain().find_map(|c| c.downcast_ref::<HostError>())?.call()?;
    call.discarded.filter(|d| d.terminated).map(|_| call.instance.as_str())
}

impl HostError {
    /// Whether the FMU's process died.
    pub fn is_death(&self) -> bool {
        matches!(self, HostError::Died { .. })
    }

    /// The failed call; None where no call was made.
    pub fn call(&self) -> Option<&CallError> {
        match self {
            HostError::Call(c) => Some(c),
            _ => None,
        }
    }

    /// The status of the failed call; None where no call was made.
    pub fn status(&self) -> Option<Status> {
        self.call().map(|c| c.status)
    }
}
