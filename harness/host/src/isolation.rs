//! Where somebody else's FMU runs.

use std::path::PathBuf;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

/// First argument with which a program is to call [`crate::serve`] before it does anything else.
pub const ARGUMENT: &str = "--fmu-process";

/// What holds an FMU in a process of its own. The process is a fault's end, no sandbox: files can be read and written
/// there as here.
#[derive(Clone, Debug)]
pub struct Limits {
    /// The program that serves its calls where it is started with [`ARGUMENT`].
    pub program: PathBuf,
    /// Longest time of one call, > 0; an asynchronous step gets its patience beside it.
    pub time: Duration,
    /// Most memory its process may ask for, bytes; None: no limit.
    pub memory: Option<u64>,
    /// Set where the host is asked to end; looked at while a call lasts.
    pub stop: Option<&'static AtomicBool>,
}

/// Longest time of one call where nothing else is said.
pub const TIME: Duration = Duration::from_secs(60);

impl Limits {
    /// Limits of time alone, with this program.
    pub fn new() -> Limits {
        // what runs is there under this name even where its file was replaced
        let running = PathBuf::from("/proc/self/exe");
        let program = if running.exists() { running } else { std::env::current_exe().unwrap_or(running) };
        Limits { program, time: TIME, memory: None, stop: None }
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
