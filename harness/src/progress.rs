//! Progress of what lasts, and Ctrl-C that loses nothing.
//!
//! Nothing is shown in the first second. After it a terminal shows a bar, anything else gets a plain line every
//! second; both on standard error. Safe to call from many threads.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Mutex, Once};
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

/// Time before anything is shown, and between plain lines.
const QUIET: Duration = Duration::from_secs(1);

struct Shown {
    bar: Option<ProgressBar>,
    last: Instant,
    note: String,
}

/// Progress of one job of `total` parts.
pub struct Progress {
    what: String,
    total: u64,
    done: AtomicU64,
    terminal: bool,
    shown: Mutex<Shown>,
}

impl Progress {
    /// A job that has `total` parts to do, none done; 0: nobody knows how many.
    pub fn new(what: &str, total: u64) -> Progress {
        Progress {
            what: what.into(),
            total,
            done: AtomicU64::new(0),
            terminal: std::io::stderr().is_terminal(),
            shown: Mutex::new(Shown { bar: None, last: Instant::now(), note: String::new() }),
        }
    }

    /// `n` parts more are done.
    pub fn add(&self, n: u64) {
        self.done.fetch_add(n, Ordering::Relaxed);
        self.show(None);
    }

    /// A few words on where the job stands; `text` is called only where it is shown.
    pub fn note(&self, text: &dyn Fn() -> String) {
        self.show(Some(text));
    }

    fn show(&self, note: Option<&dyn Fn() -> String>) {
        // another thread is showing already: good enough
        let Ok(mut s) = self.shown.try_lock() else { return };
        if s.bar.is_none() && s.last.elapsed() < QUIET {
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
        } else {
            let count = if self.total > 0 { format!("{done} of {}", self.total) } else { format!("{done} done") };
            eprintln!("{}", join(format!("{}: {count}", self.what)));
            s.last = Instant::now();
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
        if let Ok(s) = self.shown.get_mut() {
            if let Some(b) = s.bar.take() {
                b.finish_and_clear();
            }
        }
    }
}
