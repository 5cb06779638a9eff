//! Progress of what lasts, and Ctrl-C that loses nothing.
//!
//! Nothing is shown in the first second. After it a terminal shows a bar, anything else gets a plain line every
//! five seconds; both on standard error, with the stage, and with the time left where parts done allow an estimate. Safe
//! to call from many threads.

use crate::print;
use anyhow::{ensure, Result};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicU8, Ordering};
use std::sync::mpsc::{channel, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time within which signals are one request to end.
const ONE_REQUEST: Duration = Duration::from_millis(300);
/// Time that a command has to end by itself, once it was asked to and has nothing to hand out.
const GRACE: Duration = Duration::from_millis(700);

/// Exit code where a campaign is read but cannot be judged.
pub const UNJUDGED_CODE: u8 = 3;

/// Number of the signal that asked the command to end; 0 where none did.
static SIGNAL: AtomicU8 = AtomicU8::new(0);
static INTERRUPTED: AtomicBool = AtomicBool::new(false);
/// Whether the command looks at [`interrupted`], and whether it hands out what there is.
static LOOKS: AtomicBool = AtomicBool::new(false);
static HANDS_OUT: AtomicBool = AtomicBool::new(false);

/// From here on Ctrl-C, SIGTERM, SIGHUP and SIGXCPU end the process at once, but for an answer that is just taking its place, and
/// leave no stage behind. A signal that the process was started to ignore, as a hangup by `nohup`, stays ignored.
pub fn end_cleanly() {
    // without a handler the signals end the process as they always did
    #[cfg(unix)]
    catch_signals();
    #[cfg(not(unix))]
    drop(ctrlc::set_handler(|| asked_to_end(INTERRUPT)));
}

/// From here on the signals only ask: [`interrupted`] answers true, and the command comes to its end within 0.7 s, or is
/// ended then. Asked once more after 0.3 s the process ends at once.
pub fn catch_interrupts() {
    HANDS_OUT.store(false, Ordering::SeqCst);
    LOOKS.store(true, Ordering::SeqCst);
}

/// From here on the command, asked to end, comes to its end by itself and writes what there is.
pub fn hand_out() {
    HANDS_OUT.store(true, Ordering::SeqCst);
}

/// Number of the signal of Ctrl-C.
const INTERRUPT: u8 = 2;

/// Number of the signal of a limit on processor time, which comes again with each second beyond it.
const TIME_IS_UP: u8 = 24;

/// SIGINT, SIGTERM, SIGHUP and SIGXCPU. Where there is no thread to be had that waits for them, they stay as they are.
#[cfg(unix)]
fn catch_signals() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXCPU};
    use signal_hook::iterator::Signals;
    let (ready, is_ready) = channel();
    let wait = move || {
        // a shell without a terminal has what it starts in the background ignore SIGINT, which asks for an end all the same
        let asked = [SIGHUP, SIGTERM, SIGXCPU].into_iter().filter(|s| !is_ignored(*s));
        let signals = Signals::new(asked.chain([SIGINT]));
        // nobody waits for it who has ended meanwhile
        let _ = ready.send(());
        if let Ok(mut signals) = signals {
            signals.forever().for_each(|s| asked_to_end(u8::try_from(s).unwrap_or(INTERRUPT)));
        }
    };
    if std::thread::Builder::new().spawn(wait).is_ok() {
        let _ = is_ready.recv();
    }
}

/// Whether the process was started to ignore a signal, as Linux reports it.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|l| l.strip_prefix("SigIgn:"));
    mask.and_then(|m| u64::from_str_radix(m.trim(), 16).ok()).is_some_and(|m| m >> (signal - 1) & 1 == 1)
}

/// A request to end.
fn asked_to_end(signal: u8) {
    static FIRST: Mutex<Option<Instant>> = Mutex::new(None);
    let Ok(mut first) = FIRST.lock() else { return };
    match *first {
        // shells and `timeout` signal a process and its group: that is one request
        Some(at) if at.elapsed() < ONE_REQUEST || signal == TIME_IS_UP => {}
        Some(_) => end(),
        None => {
            *first = Some(Instant::now());
            SIGNAL.store(signal, Ordering::SeqCst);
            INTERRUPTED.store(true, Ordering::SeqCst);
            if !LOOKS.load(Ordering::SeqCst) {
                end();
            }
            print::line("interrupted: ending; once more to end at once");
            let end_after = || {
                std::thread::sleep(GRACE);
                if !HANDS_OUT.load(Ordering::SeqCst) {
                    end();
                }
            };
            if std::thread::Builder::new().spawn(end_after).is_err() {
                drop(first);
                end_after();
            }
        }
    }
}

/// When `seconds` from now are over; None: never.
///
/// # Errors
/// Where that is no time to work in.
pub fn deadline(seconds: Option<f64>) -> Result<Option<Instant>> {
    let Some(seconds) = seconds else { return Ok(None) };
    ensure!(
        seconds > 0.0 && seconds < 1e9,
        "--seconds {} is no time to work in; give more than 0 and less than 1e9",
        format!("{seconds:?}").trim_end_matches(".0")
    );
    Ok(Some(Instant::now() + Duration::from_secs_f64(seconds)))
}

/// From here on the process ends by [`UNJUDGED_CODE`], `message` said, where nothing is handed out 0.7 s after `deadline`:
/// what reads and prepares looks at no clock.
pub fn end_empty_handed_at(deadline: Option<Instant>, message: String) {
    let Some(deadline) = deadline else { return };
    let end_then = move || {
        std::thread::sleep(deadline.saturating_duration_since(Instant::now()) + GRACE);
        if !HANDS_OUT.load(Ordering::SeqCst) {
            output::abandon();
            print::error(&message);
            std::process::exit(i32::from(UNJUDGED_CODE));
        }
    };
    // without a thread the command takes as long as it takes
    drop(std::thread::Builder::new().spawn(end_then));
}

/// Ends the process; what is not in its place by now never is.
fn end() {
    output::abandon();
    print::line("interrupted: nothing more is written");
    std::process::exit(i32::from(code()));
}

/// 128 and the number of the signal.
fn code() -> u8 {
    128 + SIGNAL.load(Ordering::SeqCst)
}

/// Exit code of a command that was asked to end: 128 and the number of the signal.
pub fn interrupted_code() -> ExitCode {
    ExitCode::from(code())
}

/// Whether the command was asked to end.
pub fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::SeqCst)
}

/// What [`interrupted`] reads, for those who take a flag.
pub fn interruption() -> &'static AtomicBool {
    &INTERRUPTED
}

/// Time before anything is shown, and between looks at how far the job is.
const QUIET: Duration = Duration::from_secs(1);
/// Time between plain lines, after the first.
const BETWEEN_LINES: Duration = Duration::from_secs(5);

/// What is shown, and when again.
struct Shown {
    bar: Option<ProgressBar>,
    due: Instant,
    note: String,
    /// Time from the beginning to the last part done.
    last: Duration,
    over: bool,
}

struct Job {
    what: String,
    total: u64,
    done: AtomicU64,
    terminal: bool,
    began: Instant,
    shown: Mutex<Shown>,
}

/// Progress of one job of `total` parts. A thread of its own shows it, so that a long stage is seen to be alive.
pub struct Progress {
    job: Arc<Job>,
    ended: Option<Sender<()>>,
    clock: Option<JoinHandle<()>>,
}

impl Progress {
    /// A job that has `total` parts to do, none done; 0: nobody knows how many.
    pub fn new(what: &str, total: u64) -> Progress {
        let due = Instant::now() + QUIET;
        let job = Arc::new(Job {
            what: what.into(),
            total,
            done: AtomicU64::new(0),
            terminal: std::io::stderr().is_terminal(),
            began: Instant::now(),
            shown: Mutex::new(Shown { bar: None, due, note: String::new(), last: Duration::ZERO, over: false }),
        });
        let (ended, end) = channel();
        let shows = job.clone();
        let show = move || {
            while end.recv_timeout(QUIET) == Err(RecvTimeoutError::Timeout) {
                shows.show(None);
            }
        };
        // without a thread of its own it is shown as parts are done
        let clock = std::thread::Builder::new().spawn(show).ok();
        Progress { job, ended: Some(ended), clock }
    }

    /// `n` parts more are done.
    pub fn add(&self, n: u64) {
        self.job.done.fetch_add(n, Ordering::Relaxed);
        if let Ok(mut s) = self.job.shown.lock() {
            s.last = self.job.began.elapsed();
        }
        self.job.show(None);
    }

    /// A few words on where a job stands that moves on fast; `text` is called only where it is shown.
    pub fn note(&self, text: &dyn Fn() -> String) {
        self.job.show(Some(text));
    }

    /// The stage that begins.
    pub fn stage(&self, text: &str) {
        if let Ok(mut s) = self.job.shown.lock() {
            s.note = text.into();
        }
        self.job.show(None);
    }

    /// Prints through `print` without a bar in the way.
    pub fn aside(&self, print: impl FnOnce()) {
        match self.job.shown.lock().ok().and_then(|s| s.bar.clone()) {
            Some(bar) => bar.suspend(print),
            None => print(),
        }
    }

    /// Nothing is shown from here on.
    pub fn end(&self) {
        if let Ok(mut s) = self.job.shown.lock() {
            s.over = true;
            if let Some(b) = s.bar.take() {
                b.finish_and_clear();
            }
        }
    }
}

impl Job {
    fn show(&self, note: Option<&dyn Fn() -> String>) {
        // another thread is showing already: good enough
        let Ok(mut s) = self.shown.try_lock() else { return };
        if s.over || print::is_quiet() || s.bar.is_none() && Instant::now() < s.due {
            return;
        }
        if let Some(text) = note {
            s.note = text();
        }
        let (done, now) = (self.done.load(Ordering::Relaxed), self.began.elapsed());
        let left = left(done, self.total, s.last, now).map(|l| format!("about {} left", lasting(l)));
        let more = [Some(s.note.clone()).filter(|n| !n.is_empty()), left];
        let join = |head: String| [Some(head)].into_iter().chain(more).flatten().collect::<Vec<_>>().join(", ");
        if self.terminal {
            let text = join(self.what.clone());
            let bar = s.bar.get_or_insert_with(|| self.bar());
            bar.set_message(text);
            bar.set_position(done);
            bar.tick();
        } else {
            let count = if self.total > 0 { format!("{done} of {}, ", self.total) } else { String::new() };
            print::line(&join(format!("{}: {count}{}", self.what, lasting(now))));
            s.due = Instant::now() + BETWEEN_LINES;
        }
    }

    fn bar(&self) -> ProgressBar {
        let target = ProgressDrawTarget::stderr();
        let (bar, form) = if self.total > 0 {
            (ProgressBar::with_draw_target(Some(self.total), target), "{bar:30} {pos}/{len} {elapsed} {msg}")
        } else {
            (ProgressBar::with_draw_target(None, target), "{spinner} {elapsed} {msg}")
        };
        if let Ok(style) = ProgressStyle::with_template(form) {
            bar.set_style(style);
        }
        bar
    }
}

/// Time left of a job of `total` parts, `done` of them done at `last`, by the time that each of those took; None where none
/// is done, and where the last one takes longer than the others did.
fn left(done: u64, total: u64, last: Duration, now: Duration) -> Option<Duration> {
    if done == 0 || done >= total {
        return None;
    }
    let part = last.as_secs_f64() / done as f64;
    let open = (total - done) as f64;
    // of the part under way at least nothing
    let seconds = (part * open - now.saturating_sub(last).as_secs_f64()).max(part * (open - 1.0));
    Duration::try_from_secs_f64(seconds).ok().filter(|d| d.as_millis() > 0)
}

/// A time in words.
fn lasting(d: Duration) -> String {
    match d.as_secs() {
        s @ 0..60 => format!("{s} s"),
        s @ 60..3600 => format!("{} min {} s", s / 60, s % 60),
        s => format!("{} h {} min", s / 3600, s % 3600 / 60),
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        drop(self.ended.take());
        if let Some(c) = self.clock.take() {
            // a clock that panicked has shown nothing: there is nothing to undo
            drop(c.join());
        }
        self.end();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_left_follows_from_the_parts_done_and_is_not_made_up() {
        let of = |done, total, last, now| {
            left(done, total, Duration::from_secs(last), Duration::from_secs(now)).map(|d| d.as_secs())
        };
        assert_eq!(of(0, 4, 0, 10), None, "nothing is done yet");
        assert_eq!(of(0, 0, 0, 10), None, "nobody knows how many parts there are");
        assert_eq!(of(1, 4, 10, 10), Some(30));
        assert_eq!(of(1, 4, 10, 14), Some(26));
        assert_eq!(of(1, 4, 10, 90), Some(20), "the part under way takes longer, two more are to come");
        assert_eq!(of(3, 4, 30, 60), None, "the last part takes longer than the others");
        assert_eq!(of(4, 4, 30, 60), None);
    }

    #[test]
    fn times_are_told_in_two_units_at_most() {
        let of = |s| lasting(Duration::from_secs(s));
        assert_eq!([of(0), of(59), of(61), of(3725)], ["0 s", "59 s", "1 min 1 s", "1 h 2 min"].map(String::from));
    }
}
