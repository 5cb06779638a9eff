//! An instance's own log: what the FMU says, line by line, and the bell it rings when an asynchronous step is done.

use super::status::Status;
use std::collections::VecDeque;
use std::ffi::{c_char, c_int, c_void, CStr};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Lines kept; older ones are dropped.
const MOST_LINES: usize = 1000;

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

/// What an FMU gets as componentEnvironment. `line` comes first: logger.c reads it.
#[repr(C)]
pub(super) struct Log {
    line: unsafe extern "C" fn(*mut c_void, c_int, *const c_char, *const c_char),
    call: AtomicU64,
    lines: Mutex<VecDeque<LogLine>>,
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

fn text(s: *const c_char) -> String {
    if s.is_null() {
        return String::new();
    }
    // SAFETY: logger.c passes terminated strings
    unsafe { CStr::from_ptr(s) }.to_string_lossy().trim_end().to_string()
}

/// Called by logger.c, from whichever thread the FMU logs.
unsafe extern "C" fn line(environment: *mut c_void, status: c_int, category: *const c_char, message: *const c_char) {
    // SAFETY: the environment is the Log that Instance::new passed; it outlives the FMU's instance
    let Some(log) = (unsafe { environment.cast::<Log>().as_ref() }) else { return };
    let line = LogLine {
        status: Status::from(status as u32),
        category: text(category),
        message: text(message),
        call: log.call.load(Ordering::Relaxed),
    };
    let mut lines = lock(&log.lines);
    if lines.len() >= MOST_LINES {
        lines.pop_front();
    }
    lines.push_back(line);
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
            lines: Mutex::new(VecDeque::new()),
            finished: Mutex::new(None),
            bell: Condvar::new(),
        }
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
        lock(&self.lines).iter().filter(|l| l.call == n).cloned().collect()
    }

    /// Every line kept.
    pub(super) fn all(&self) -> Vec<LogLine> {
        lock(&self.lines).iter().cloned().collect()
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
