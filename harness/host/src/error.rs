//! What goes wrong with an FMU, and what it said about it.

use super::log::LogLine;
use std::fmt;
use std::path::PathBuf;

/// Status of FMI 2.0 (section 2.1.3), and any number that is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// All well.
    Ok,
    /// Something to say, all the same all well.
    Warning,
    /// Not done; a smaller step or another value may do.
    Discard,
    /// This instance cannot go on, unless reset or set to an earlier state.
    Error,
    /// No instance of this FMU can go on.
    Fatal,
    /// Still at it.
    Pending,
    /// No status of FMI 2.0.
    Unknown(u32),
}

impl From<u32> for Status {
    fn from(n: u32) -> Self {
        match n {
            0 => Status::Ok,
            1 => Status::Warning,
            2 => Status::Discard,
            3 => Status::Error,
            4 => Status::Fatal,
            5 => Status::Pending,
            n => Status::Unknown(n),
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Status::Ok => f.write_str("fmi2OK"),
            Status::Warning => f.write_str("fmi2Warning"),
            Status::Discard => f.write_str("fmi2Discard"),
            Status::Error => f.write_str("fmi2Error"),
            Status::Fatal => f.write_str("fmi2Fatal"),
            Status::Pending => f.write_str("fmi2Pending"),
            Status::Unknown(n) => write!(f, "{n}, which is no status of FMI 2.0"),
        }
    }
}

/// What an FMU tells of a step it discarded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Discarded {
    /// End of the part of the step that was done, s; None where the FMU does not tell.
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
    /// The host was asked for what cannot be.
    #[error("{instance}: {why}")]
    Use {
        /// Name of the instance or of the model.
        instance: String,
        /// What is wrong, and the cure.
        why: String,
    },
}

impl HostError {
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
