//! An FMU's process: started, watched, ended with all it has started itself.

use super::memory::Shared;
use crate::isolation::{Limits, ARGUMENT};
use rustix::process::{kill_process_group, waitid, Pid, Signal, WaitId, WaitIdOptions, WaitIdStatus};
use std::os::fd::AsFd;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A process that serves an FMU's calls. It goes when this is dropped.
pub(super) struct Process {
    child: Child,
    pid: Option<Pid>,
}

impl Process {
    /// Starts the program of `limits` on the memory. What the FMU prints goes to the standard error.
    ///
    /// # Errors
    /// As the system gives them.
    pub(super) fn start(limits: &Limits, memory: &Shared) -> std::io::Result<Process> {
        let printed = std::io::stderr().as_fd().try_clone_to_owned().map_or_else(|_| Stdio::null(), Stdio::from);
        let mut command = Command::new(&limits.program);
        if limits.arguments.is_empty() {
            // the program may be /proc/self/exe, which says nothing to whoever looks at processes
            command.arg0("touchdown");
        }
        let child =
            command.args(&limits.arguments).arg(ARGUMENT).stdin(memory.file().try_clone()?).stdout(printed).spawn()?;
        let pid = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
        Ok(Process { child, pid })
    }

    /// How it ended; None while it runs.
    pub(super) fn ended(&self) -> Option<String> {
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        match waitid(WaitId::Pid(self.pid?), options) {
            Ok(None) => None,
            Ok(Some(status)) => Some(how(&status)),
            Err(e) => Some(format!("its process cannot be watched ({e})")),
        }
    }

    /// Waits so long for its end: None where it did not end; else how, empty where it left with exit code 0.
    pub(super) fn wait(&self, longest: Duration) -> Option<String> {
        let until = Instant::now() + longest;
        let mut nap = Duration::from_micros(200);
        loop {
            match self.ended() {
                Some(how) => return Some(if how == left(0) { String::new() } else { how }),
                None if Instant::now() >= until => return None,
                None => std::thread::sleep(nap),
            }
            nap = (nap * 2).min(Duration::from_millis(20));
        }
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // not waited for yet, so the numbers are still its own; both fail where there is nothing left to end
        if let Some(pid) = self.pid {
            let _ = kill_process_group(pid, Signal::KILL);
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn left(code: i32) -> String {
    format!("it left with exit code {code}")
}

fn how(status: &WaitIdStatus) -> String {
    if let Some(code) = status.exit_status() {
        return left(code);
    }
    let Some(signal) = status.terminating_signal() else { return "it ended".into() };
    let name = signal_hook::low_level::signal_name(signal).map_or(format!("signal {signal}"), String::from);
    let meaning = match name.as_str() {
        "SIGSEGV" | "SIGBUS" => ", an access beyond its memory",
        "SIGABRT" => ", it gave up by itself, as on an uncaught exception or a stack overflow",
        "SIGFPE" => ", a forbidden operation on numbers",
        "SIGILL" => ", an instruction that this processor does not know",
        "SIGKILL" => ", as the system does where memory runs out",
        _ => "",
    };
    format!("it was ended by {name}{meaning}")
}
