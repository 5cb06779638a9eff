//! What an FMI function returns.

use std::fmt;

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

impl Status {
    /// The number that FMI 2.0 gives it.
    pub(super) fn number(self) -> u32 {
        match self {
            Status::Ok => 0,
            Status::Warning => 1,
            Status::Discard => 2,
            Status::Error => 3,
            Status::Fatal => 4,
            Status::Pending => 5,
            Status::Unknown(n) => n,
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
