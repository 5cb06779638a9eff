//! Where somebody else's FMU runs.

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::sync::OnceLock;
use std::time::Duration;

/// First argument with which a program is to call [`crate::serve`] before it does anything else.
pub const ARGUMENT: &str = "--fmu-process";

/// What holds an FMU in a process of its own. The process is a fault's end, no sandbox: files can be read and written
/// there as here.
#[derive(Clone, Debug)]
pub struct Limits {
    /// The program that serves its calls where it is started with `arguments` and [`ARGUMENT`].
    pub program: PathBuf,
    /// Arguments before [`ARGUMENT`].
    pub arguments: Vec<OsString>,
    /// Longest time of one call, > 0; an asynchronous step gets its patience beside it.
    pub time: Duration,
    /// Most memory its process may ask for, bytes; None: no limit.
    pub memory: Option<u64>,
    /// Set where the host is asked to end; looked at while a call lasts.
    pub stop: Option<&'static AtomicBool>,
}

/// Longest time of one call where nothing else is said.
pub const TIME: Duration = Duration::from_secs(60);

/// Program and arguments that [`served_by`] was given.
static SERVED_BY: OnceLock<(PathBuf, Vec<OsString>)> = OnceLock::new();

/// From here on FMUs' processes are this program, started with these arguments and [`ARGUMENT`]: for hosts that are loaded by
/// a program of somebody else's. What was said first holds.
pub fn served_by(program: PathBuf, arguments: Vec<OsString>) {
    SERVED_BY.get_or_init(|| (program, arguments));
}

impl Limits {
    /// Limits of time alone, with this program, or with the one that [`served_by`] was given.
    pub fn new() -> Limits {
        if let Some((program, arguments)) = SERVED_BY.get().cloned() {
            return Limits { program, arguments, time: TIME, memory: None, stop: None };
        }
        // what runs is there under this name even where its file was replaced
        let running = PathBuf::from("/proc/self/exe");
        let program = if running.exists() { running } else { std::env::current_exe().unwrap_or(running) };
        Limits { program, arguments: Vec::new(), time: TIME, memory: None, stop: None }
    }
}

impl Default for Limits {
    fn default() -> Limits {
        Limits::new()
    }
}

/// Where somebody else's FMU runs; our own run in this process always.
#[derive(Clone, Debug, Default)]
pub enum Isolation {
    /// In this process: a fault of it is a fault of the host.
    #[default]
    None,
    /// In a process of its own. Where [`Isolation::is_possible`] says no, in this one.
    Process(Limits),
}

impl Isolation {
    /// Whether FMUs can have processes of their own on this platform: on Linux.
    pub const fn is_possible() -> bool {
        cfg!(target_os = "linux")
    }

    /// The limits, where an FMU gets a process of its own.
    pub(super) fn limits(&self) -> Option<&Limits> {
        match self {
            Isolation::Process(limits) if Isolation::is_possible() => Some(limits),
            _ => None,
        }
    }
}
