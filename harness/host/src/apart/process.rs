//! An FMU's process: started, watched, ended with all it has started itself.

use super::memory::Shared;
use crate::isolation::{Limits, ARGUMENT};
use rustix::process::{kill_process, kill_process_group, waitid, Pid, Signal, WaitId, WaitIdOptions, WaitIdStatus};
use std::os::fd::AsFd;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Name of the variable by which all that an FMU's process has started is known, whoever its parent is by now.
const MARK: &str = "TOUCHDOWN_FMU";
/// Time that a process is waited for which was killed: one that another traces stays until that one has gone.
const DYING: Duration = Duration::from_secs(2);
/// Looks for processes that are left, at most, and the time between two.
const LOOKS: usize = 20;
const BETWEEN: Duration = Duration::from_millis(5);

/// A process that serves an FMU's calls. It goes when this is dropped, with all that it has started.
pub(super) struct Process {
    child: Child,
    pid: Option<Pid>,
    /// Value of [`MARK`] in its environment.
    mark: String,
    /// Whether it came to its end by itself, with nothing left that it has started.
    well: bool,
}

impl Process {
    /// Starts the program of `limits` on the memory. What the FMU prints goes to the standard error.
    ///
    /// # Errors
    /// As the system gives them.
    pub(super) fn start(limits: &Limits, memory: &Shared) -> std::io::Result<Process> {
        let printed = std::io::stderr().as_fd().try_clone_to_owned().map_or_else(|_| Stdio::null(), Stdio::from);
        let mut command = Command::new(&limits.program);
        let mark = mark();
        command.env(MARK, &mark);
        if limits.arguments.is_empty() {
            // the program may be /proc/self/exe, which says nothing to whoever looks at processes
            command.arg0("touchdown");
        }
        let child =
            command.args(&limits.arguments).arg(ARGUMENT).stdin(memory.file().try_clone()?).stdout(printed).spawn()?;
        let pid = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
        Ok(Process { child, pid, mark, well: false })
    }

    /// Its number; None where the system's has no place in ours.
    pub(super) fn id(&self) -> Option<Pid> {
        self.pid
    }

    /// Notes that it came to its end as it should, which it does once nothing is left that it has started.
    pub(super) fn has_ended_well(&mut self) {
        self.well = true;
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
        if !self.well {
            self.end_all();
        }
        // of one that is not dead by now the number is lost, and nothing else
        let until = Instant::now() + DYING;
        while matches!(self.child.try_wait(), Ok(None)) && Instant::now() < until {
            std::thread::sleep(BETWEEN);
        }
    }
}

impl Process {
    /// Kills it and all that it has started.
    fn end_all(&mut self) {
        // not waited for yet, so the numbers are still its own; both fail where there is nothing left to end
        if let Some(pid) = self.pid {
            kill_below(pid);
            let _ = kill_process_group(pid, Signal::KILL);
        }
        let _ = self.child.kill();
        // what was started while the others were killed, and what had lost its parent before
        let mut mark = MARK.as_bytes().to_vec();
        mark.push(b'=');
        mark.extend(self.mark.as_bytes());
        for _ in 0..LOOKS {
            let left: Vec<Pid> = all().filter(|p| is_marked(*p, &mark)).collect();
            if left.is_empty() {
                break;
            }
            for p in left {
                let _ = kill_process(p, Signal::KILL);
            }
            std::thread::sleep(BETWEEN);
        }
    }
}

/// Kills all that the process `of` and its children have started, and started by them what is left.
pub(super) fn kill_below(of: Pid) {
    for _ in 0..LOOKS {
        let parents: Vec<(Pid, Pid)> = all().filter_map(|p| Some((p, parent(p)?))).collect();
        let mut below = vec![of];
        let mut seen = 0;
        while seen < below.len() {
            let here = below[seen];
            below.extend(parents.iter().filter(|(p, above)| *above == here && *p != of).map(|(p, _)| *p));
            seen += 1;
        }
        if below.len() == 1 {
            break;
        }
        for p in &below[1..] {
            let _ = kill_process(*p, Signal::KILL);
        }
        std::thread::sleep(BETWEEN);
    }
}

/// All processes.
fn all() -> impl Iterator<Item = Pid> {
    let names = std::fs::read_dir("/proc").into_iter().flatten().flatten().map(|e| e.file_name());
    names.filter_map(|n| n.to_str()?.parse().ok().and_then(Pid::from_raw))
}

/// The parent of a process that lives.
fn parent(of: Pid) -> Option<Pid> {
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", of.as_raw_nonzero())).ok()?;
    // a name in brackets, which may hold anything, state, parent
    let mut after = stat[stat.rfind(')')? + 1..].split_whitespace();
    let lives = after.next().is_some_and(|state| state != "Z" && state != "X");
    after.next()?.parse().ok().filter(|_| lives).and_then(Pid::from_raw)
}

/// Whether a process that lives was started with the mark in its environment.
fn is_marked(pid: Pid, mark: &[u8]) -> bool {
    let environment = std::fs::read(format!("/proc/{}/environ", pid.as_raw_nonzero())).unwrap_or_default();
    environment.split(|b| *b == 0).any(|v| v == mark) && parent(pid).is_some()
}

/// A mark that no other process has.
fn mark() -> String {
    use std::hash::{BuildHasher, Hasher};
    let hash = std::collections::hash_map::RandomState::new().build_hasher();
    format!("{}-{:016x}", std::process::id(), hash.finish())
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
