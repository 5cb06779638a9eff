//! An instance's own log: what the FMU says, line by line, and the bell it rings when an asynchronous step is done.

use super::status::Status;
use std::collections::VecDeque;
use std::ffi::{c_char, c_int, c_void, CStr, CString};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, Once, PoisonError, Weak};
use std::thread::ThreadId;
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

/// What an FMU logs into. Its address is what the FMU gets as componentEnvironment; what an FMU passes back is never
/// followed, but looked up among those that were handed out ([`HandedOut`]).
pub(super) struct Log {
    call: AtomicU64,
    kept: Mutex<Kept>,
    forward: Option<Forward>,
    finished: Mutex<Option<u32>>,
    bell: Condvar,
}

/// In logger.c: who takes a line.
type Taker = unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, usize);

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
    /// In logger.c.
    fn touchdown_host_logger_into(taker: Taker);
}

/// An environment that an instance was given.
struct Given {
    environment: usize,
    name: CString,
    /// Where the instance was made, and is called from.
    thread: ThreadId,
    log: Weak<Log>,
}

/// Every environment that is handed out.
static GIVEN: Mutex<Vec<Given>> = Mutex::new(Vec::new());

/// A log handed out as the environment of an instance, until this is dropped.
pub(super) struct HandedOut(usize);

impl HandedOut {
    /// Hands out `log` to the instance called `name`.
    pub(super) fn new(log: &Arc<Log>, name: &CStr) -> HandedOut {
        static ONCE: Once = Once::new();
        // SAFETY: a pointer to a function of the type that logger.c has
        ONCE.call_once(|| unsafe { touchdown_host_logger_into(line) });
        let environment = Arc::as_ptr(log) as usize;
        let thread = std::thread::current().id();
        lock(&GIVEN).push(Given { environment, name: name.to_owned(), thread, log: Arc::downgrade(log) });
        HandedOut(environment)
    }

    /// What the FMU gets.
    pub(super) fn environment(&self) -> *mut c_void {
        self.0 as *mut c_void
    }
}

impl Drop for HandedOut {
    fn drop(&mut self) {
        lock(&GIVEN).retain(|g| g.environment != self.0);
    }
}

/// The log of an environment that was handed out. Where an FMU passes another (code generators of some tools pass one of
/// their own): the log of the instance of that name, of this thread's where several have it; where it passes a name of its
/// own too, that of the only instance in this thread.
fn log_of(environment: *mut c_void, instance: Option<&CStr>) -> Option<Arc<Log>> {
    let given = lock(&GIVEN);
    if let Some(g) = given.iter().find(|g| g.environment == environment as usize) {
        return g.log.upgrade();
    }
    let here = std::thread::current().id();
    let named = |g: &&Given| instance.is_some_and(|n| *n == *g.name);
    let of_name = given.iter().filter(named).count();
    if of_name > 0 {
        return given.iter().filter(named).find(|g| of_name == 1 || g.thread == here)?.log.upgrade();
    }
    let mut of_thread = given.iter().filter(|g| g.thread == here);
    of_thread.next().filter(|_| of_thread.next().is_none())?.log.upgrade()
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
    instance: *const c_char,
    status: c_int,
    category: *const c_char,
    message: *const c_char,
    length: usize,
) {
    // SAFETY: FMI 2.0 section 2.1.5: null or a terminated string
    let instance = (!instance.is_null()).then(|| unsafe { CStr::from_ptr(instance) });
    let Some(log) = log_of(environment, instance) else { return };
    log.push(LogLine {
        status: Status::from(status as u32),
        category: text(category, 0),
        message: text(message, length),
        call: log.call.load(Ordering::Relaxed),
    });
}

/// The FMU's stepFinished: rings the bell.
pub(super) unsafe extern "C" fn step_finished(environment: *mut c_void, status: fmi::fmi2::binding::fmi2Status) {
    let Some(log) = log_of(environment, None) else { return };
    *lock(&log.finished) = Some(status);
    log.bell.notify_all();
}

impl Log {
    pub(super) fn new() -> Self {
        Log {
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
    fn an_environment_is_looked_up_and_never_followed() {
        let (a, b) = (Arc::new(Log::new()), Arc::new(Log::new()));
        let log = |environment: *mut c_void, name: &CStr, text: &CStr| {
            // SAFETY: terminated strings; the environment is not read
            unsafe { super::line(environment, name.as_ptr(), 0, c"c".as_ptr(), text.as_ptr(), 0) }
        };
        // as Overture's code generator passes it
        let own = std::ptr::without_provenance_mut::<c_void>(1);
        let (given, other) = (HandedOut::new(&a, c"an element"), HandedOut::new(&b, c"another element"));
        log(given.environment(), c"whatever", c"1");
        log(own, c"an element", c"2");
        log(std::ptr::null_mut(), c"another element", c"3");
        // two instances in this thread, and a name of neither
        log(own, c"unknown", c"lost");
        drop(other);
        log(own, c"unknown", c"4");
        let environment = given.environment();
        drop(given);
        log(environment, c"an element", c"lost");
        let texts = |l: &Log| l.all().into_iter().map(|l| l.message).collect::<Vec<_>>();
        assert_eq!((texts(&a), texts(&b)), (vec!["1".into(), "2".into(), "4".into()], vec!["3".to_string()]));
    }

    #[test]
    fn a_line_that_is_too_long_is_cut_and_says_so() {
        let long = std::ffi::CString::new("x".repeat(100_000)).unwrap();
        let cut = text(long.as_ptr(), 0);
        assert!(cut.len() < 66_000 && cut.ends_with(" ... (100000 bytes in all)"), "{}", cut.len());
        assert_eq!(text(c"x ".as_ptr(), 0), "x");
    }
}
