//! An instance's own log: what the FMU says, line by line, and the bell it rings when an asynchronous step is done.

use super::status::Status;
use std::collections::VecDeque;
use std::ffi::{c_char, c_int, c_void, CStr};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Lines kept, and bytes of text in them; older ones are dropped, and counted.
const MOST_LINES: usize = 1000;
const MOST_BYTES: usize = 1 << 20;
/// Bytes kept of a line; logger.c formats no more.
const LONGEST: usize = 1 << 16;

/// One line an FMU logged.
#[derive(Clone, Debug, PartialEq)]
pub struct LogLine {
    /// Status it was logged with.
    pub status: Status,
    /// Category, as listed under LogCategories.
    pub category: String,
    /// The text, formatted.
    pub message: String,
    /// Number of the host's call during which it came.
    pub call: u64,
}

/// The last lines.
#[derive(Default)]
struct Kept {
    lines: VecDeque<LogLine>,
    bytes: usize,
    dropped: u64,
}

impl Kept {
    fn push(&mut self, line: LogLine) {
        self.bytes += line.size();
        self.lines.push_back(line);
        while self.lines.len() > MOST_LINES || self.bytes > MOST_BYTES {
            let Some(old) = self.lines.pop_front() else { break };
            self.bytes -= old.size();
            self.dropped += 1;
        }
    }
}

impl LogLine {
    fn size(&self) -> usize {
        self.category.len() + self.message.len()
    }
}

/// Where a line goes instead of being kept.
pub(super) type Forward = Box<dyn Fn(LogLine) + Send + Sync>;

/// What an FMU gets as componentEnvironment. `line` comes first: logger.c reads it.
#[repr(C)]
pub(super) struct Log {
    line: unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char, usize),
    call: AtomicU64,
    kept: Mutex<Kept>,
    forward: Option<Forward>,
    finished: Mutex<Option<u32>>,
    bell: Condvar,
}

extern "C" {
    /// In logger.c.
    pub(super) fn touchdown_host_logger(
        environment: *mut c_void,
        instance: *const c_char,
        status: fmi::fmi2::binding::fmi2Status,
        category: *const c_char,
        message: *const c_char,
        ...
    );
}

fn lock<T>(m: &Mutex<T>) -> MutexGuard<'_, T> {
    // a line half pushed is impossible: the guard is held for single operations of the standard library only
    m.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A text that is at most so long, with a count of what is left out.
fn text(s: *const c_char, whole: usize) -> String {
    if s.is_null() {
        return String::new();
    }
    // SAFETY: logger.c passes terminated strings
    let bytes = unsafe { CStr::from_ptr(s) }.to_bytes();
    let mut text = String::from_utf8_lossy(&bytes[..bytes.len().min(LONGEST)]).trim_end().to_string();
    let whole = whole.max(bytes.len());
    if whole > LONGEST {
        text += &format!(" ... ({whole} bytes in all)");
    }
    text
}

/// Called by logger.c, from whichever thread the FMU logs.
unsafe extern "C" fn line(
    environment: *mut c_void,
    status: c_int,
    category: *const c_char,
    message: *const c_char,
    length: usize,
) {
    // SAFETY: the environment is the Log that Here::new passed; it outlives the FMU's instance
    let Some(log) = (unsafe { environment.cast::<Log>().as_ref() }) else { return };
    log.push(LogLine {
        status: Status::from(status as u32),
        category: text(category, 0),
        message: text(message, length),
        call: log.call.load(Ordering::Relaxed),
    });
}

/// The FMU's stepFinished: rings the bell.
pub(super) unsafe extern "C" fn step_finished(environment: *mut c_void, status: fmi::fmi2::binding::fmi2Status) {
    // SAFETY: as in `line`
    let Some(log) = (unsafe { environment.cast::<Log>().as_ref() }) else { return };
    *lock(&log.finished) = Some(status);
    log.bell.notify_all();
}

impl Log {
    pub(super) fn new() -> Self {
        Log {
            line,
            call: AtomicU64::new(0),
            kept: Mutex::default(),
            forward: None,
            finished: Mutex::new(None),
            bell: Condvar::new(),
        }
    }

    /// A log that keeps nothing and hands each line on.
    pub(super) fn forwarding(forward: Forward) -> Self {
        Log { forward: Some(forward), ..Log::new() }
    }

    /// Takes a line.
    pub(super) fn push(&self, line: LogLine) {
        match &self.forward {
            Some(forward) => forward(line),
            None => lock(&self.kept).push(line),
        }
    }

    /// Counts lines that were dropped on their way here.
    pub(super) fn count_dropped(&self, lines: u64) {
        lock(&self.kept).dropped += lines;
    }

    /// Numbers the call that begins.
    #[inline]
    pub(super) fn begin(&self) {
        // one thread calls an instance: a load and a store do, and cost less than an atomic addition
        self.call.store(self.call.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    }

    /// Lines of the call under way.
    pub(super) fn of_call(&self) -> Vec<LogLine> {
        let n = self.call.load(Ordering::Relaxed);
        lock(&self.kept).lines.iter().filter(|l| l.call == n).cloned().collect()
    }

    /// Every line kept.
    pub(super) fn all(&self) -> Vec<LogLine> {
        lock(&self.kept).lines.iter().cloned().collect()
    }

    /// Lines that are not kept any more.
    pub(super) fn dropped(&self) -> u64 {
        lock(&self.kept).dropped
    }

    /// What was logged, in words.
    pub(super) fn said(&self) -> String {
        let lines: Vec<String> = self.all().into_iter().map(|l| format!("\"{}\"", l.message)).collect();
        if lines.is_empty() {
            "it logged nothing".into()
        } else {
            format!("it logged {}", lines.join(", "))
        }
    }

    /// Forgets an earlier step's end.
    pub(super) fn forget_finished(&self) {
        *lock(&self.finished) = None;
    }

    /// Waits for the bell, but no longer than `longest`; the status rung, if it has been.
    pub(super) fn wait_finished(&self, longest: Duration) -> Option<u32> {
        let guard = lock(&self.finished);
        if guard.is_some() {
            return *guard;
        }
        let (guard, _) = self.bell.wait_timeout(guard, longest).unwrap_or_else(PoisonError::into_inner);
        *guard
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(message: &str) -> LogLine {
        LogLine { status: Status::Ok, category: "c".into(), message: message.into(), call: 0 }
    }

    #[test]
    fn a_flood_of_lines_is_bounded_in_lines_and_bytes_and_counted() {
        let log = Log::new();
        for n in 0..5000 {
            log.push(line(&n.to_string()));
        }
        assert_eq!((log.all().len(), log.dropped(), log.all()[999].message.as_str()), (1000, 4000, "4999"));
        let log = Log::new();
        for _ in 0..100 {
            log.push(line(&"x".repeat(50_000)));
        }
        assert_eq!((log.all().len(), log.dropped()), (20, 80));
    }

    #[test]
    fn a_line_that_is_too_long_is_cut_and_says_so() {
        let long = std::ffi::CString::new("x".repeat(100_000)).unwrap();
        let cut = text(long.as_ptr(), 0);
        assert!(cut.len() < 66_000 && cut.ends_with(" ... (100000 bytes in all)"), "{}", cut.len());
        assert_eq!(text(c"x ".as_ptr(), 0), "x");
    }
}
