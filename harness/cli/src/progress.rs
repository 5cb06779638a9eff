//! Progress of what lasts, and Ctrl-C that loses nothing.
//!
//! Nothing is shown in the first second. After it a terminal shows a bar, anything else gets a plain line every
//! five seconds; both on standard error. Safe to call from many threads.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{channel, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, Once};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Exit code of a command that Ctrl-C ended: 128 and the number of the signal.
pub const INTERRUPTED_CODE: u8 = 130;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
static HANDLER: Once = Once::new();

/// From here on Ctrl-C only asks: [`interrupted`] answers true, and the command writes what it has. A second
/// Ctrl-C ends the process at once.
pub fn catch_interrupts() {
    HANDLER.call_once(|| {
        let set = ctrlc::set_handler(|| {
            if INTERRUPTED.swap(true, Ordering::SeqCst) {
                std::process::exit(i32::from(INTERRUPTED_CODE));
            }
            eprintln!("touchdown: interrupted; writing what there is (once more to stop at once)");
        });
        // without a handler Ctrl-C ends the process as it always did
        drop(set);
    });
}

/// Whether Ctrl-C was pressed since [`catch_interrupts`].
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

struct Shown {
    bar: Option<ProgressBar>,
    due: Instant,
    note: String,
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
        let job = Arc::new(Job {
            what: what.into(),
            total,
            done: AtomicU64::new(0),
            terminal: std::io::stderr().is_terminal(),
            began: Instant::now(),
            shown: Mutex::new(Shown { bar: None, due: Instant::now() + QUIET, note: String::new() }),
        });
        let (ended, end) = channel();
        let shows = job.clone();
        let clock = std::thread::spawn(move || {
            while end.recv_timeout(QUIET) == Err(RecvTimeoutError::Timeout) {
                shows.show(None);
            }
        });
        Progress { job, ended: Some(ended), clock: Some(clock) }
    }

    /// `n` parts more are done.
    pub fn add(&self, n: u64) {
        self.job.done.fetch_add(n, Ordering::Relaxed);
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
}

impl Job {
    fn show(&self, note: Option<&dyn Fn() -> String>) {
        // another thread is showing already: good enough
        let Ok(mut s) = self.shown.try_lock() else { return };
        if s.bar.is_none() && Instant::now() < s.due {
            return;
        }
        if let Some(text) = note {
            s.note = text();
        }
        let done = self.done.load(Ordering::Relaxed);
        let join = |head: String| if s.note.is_empty() { head } else { format!("{head}, {}", s.note) };
        if self.terminal {
            let text = join(self.what.clone());
            let bar = s.bar.get_or_insert_with(|| self.bar());
            bar.set_message(text);
            bar.set_position(done);
            bar.tick();
        } else {
            let count = if self.total > 0 { format!("{done} of {}, ", self.total) } else { String::new() };
            eprintln!("{}", join(format!("{}: {count}{} s", self.what, self.began.elapsed().as_secs())));
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

impl Drop for Progress {
    fn drop(&mut self) {
        drop(self.ended.take());
        if let Some(c) = self.clock.take() {
            // a clock that panicked has shown nothing: there is nothing to undo
            drop(c.join());
        }
        if let Some(b) = self.job.shown.lock().ok().and_then(|mut s| s.bar.take()) {
            b.finish_and_clear();
        }
    }
}
