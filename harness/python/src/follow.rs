//! A task on a thread of its own, followed from the thread of Python that waits for it.
//!
//! That thread lets go of the interpreter while it waits. It calls what follows the task, and looks whether Python was
//! asked to end: Ctrl-C ends the call within a second.

use super::{error, TouchdownError};
use anyhow::Result;
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{channel, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use touchdown::tasks::Follow;
use touchdown::threads::NoThreads;

/// Time between looks at whether Python was asked to end.
const LOOK: Duration = Duration::from_millis(50);
/// Time that a task has to end by itself, once it was asked to or its time is up.
const GRACE: Duration = Duration::from_millis(500);
/// Least time between two notes.
const BETWEEN_NOTES: Duration = Duration::from_millis(100);

/// What a task reports.
enum Said {
    Begin(String, u64),
    Stage(String),
    Add(u64),
    End,
    Warning(String),
    Error(String),
    Answer(String),
    HandsOut,
    Limit(Instant, String),
    /// It is over.
    Over,
}

/// Passes on what a task reports.
struct Listener {
    said: Mutex<Sender<Said>>,
    stop: &'static AtomicBool,
    noted: Mutex<Option<Instant>>,
}

impl Listener {
    fn say(&self, what: Said) {
        let said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        // nobody listens any more where the call was interrupted
        drop(said.send(what));
    }
}

impl Follow for Listener {
    fn stop(&self) -> &'static AtomicBool {
        self.stop
    }

    // the call that would take them is over by then
    fn takes_parts(&self) -> bool {
        false
    }

    fn hands_out(&self) {
        self.say(Said::HandsOut);
    }

    fn empty_handed_at(&self, deadline: Option<Instant>, message: String) {
        if let Some(at) = deadline {
            self.say(Said::Limit(at, message));
        }
    }

    fn begin(&self, what: &str, total: u64) {
        self.say(Said::Begin(what.into(), total));
    }

    fn stage(&self, text: &str) {
        self.say(Said::Stage(text.into()));
    }

    fn note(&self, text: &dyn Fn() -> String) {
        let Ok(mut noted) = self.noted.try_lock() else { return };
        if noted.is_none_or(|at| at.elapsed() >= BETWEEN_NOTES) {
            *noted = Some(Instant::now());
            self.say(Said::Stage(text()));
        }
    }

    fn add(&self, parts: u64) {
        self.say(Said::Add(parts));
    }

    fn end(&self) {
        self.say(Said::End);
    }

    fn warning(&self, text: &str) {
        self.say(Said::Warning(text.into()));
    }

    fn error(&self, text: &str) {
        self.say(Said::Error(text.into()));
    }

    fn answer(&self, text: &str) {
        self.say(Said::Answer(text.into()));
    }
}

/// Flags that no task reads.
static FREE: Mutex<Vec<&'static AtomicBool>> = Mutex::new(Vec::new());
static LEFT_ALONE: AtomicUsize = AtomicUsize::new(0);

/// Tasks that were left alone, and are not over yet.
pub fn left_alone() -> usize {
    LEFT_ALONE.load(Ordering::SeqCst)
}

/// A flag that is not set, for one task: estimations keep it for as long as their process lives, so it is used again.
fn flag() -> &'static AtomicBool {
    let free = FREE.lock().unwrap_or_else(PoisonError::into_inner).pop();
    let flag = free.unwrap_or_else(|| Box::leak(Box::new(AtomicBool::new(false))));
    flag.store(false, Ordering::SeqCst);
    flag
}

/// What `work` comes to. `notify(kind, text, number)` is called with what it reports: begin (of so many parts, 0 where nobody
/// knows), stage, add (so many parts), end, warning, error, answer.
///
/// # Errors
/// What `work` ends with, as `TouchdownError`; what `notify` raises; what Python was asked to end with.
pub fn followed<T: Send + 'static>(
    py: Python<'_>,
    notify: &Py<PyAny>,
    work: impl FnOnce(Arc<dyn Follow>) -> Result<T> + Send + 'static,
) -> PyResult<T> {
    let (say, said) = channel();
    let stop = flag();
    let listener = Arc::new(Listener { said: Mutex::new(say), stop, noted: Mutex::new(None) });
    touchdown::threads::get_ready(false).map_err(|e| TouchdownError::new_err(e.to_string()))?;
    let task = move || {
        let over = Over(listener.clone());
        let done = work(listener);
        drop(over);
        done
    };
    let task = std::thread::Builder::new().spawn(task);
    let task = task.map_err(|_| TouchdownError::new_err(NoThreads::Given.to_string()))?;
    let said = Mutex::new(said);
    match listen(py, notify, &said) {
        Ok(()) => {
            let done = py.detach(|| task.join());
            FREE.lock().unwrap_or_else(PoisonError::into_inner).push(stop);
            let fault = "the work ended by a fault of the program, which is printed above; please report it";
            done.map_err(|_| TouchdownError::new_err(fault))?.map_err(error)
        }
        Err(e) => {
            stop.store(true, Ordering::SeqCst);
            if !py.detach(|| ends(&said, GRACE)) {
                LEFT_ALONE.fetch_add(1, Ordering::SeqCst);
                let wait = move || {
                    // what it comes to is nobody's any more
                    drop(task.join());
                    LEFT_ALONE.fetch_sub(1, Ordering::SeqCst);
                };
                // without a thread it counts as left alone until the process ends
                drop(std::thread::Builder::new().spawn(wait));
            }
            Err(e)
        }
    }
}

/// Says that the task is over, however it ends.
struct Over(Arc<Listener>);

impl Drop for Over {
    fn drop(&mut self) {
        self.0.say(Said::Over);
    }
}

/// What is reported next, waited for so long.
fn next(said: &Mutex<Receiver<Said>>, longest: Duration) -> Result<Said, RecvTimeoutError> {
    said.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(longest)
}

/// Whether the task ends within so long.
fn ends(said: &Mutex<Receiver<Said>>, longest: Duration) -> bool {
    let until = Instant::now() + longest;
    loop {
        match next(said, until.saturating_duration_since(Instant::now())) {
            Ok(Said::Over) | Err(RecvTimeoutError::Disconnected) => return true,
            Ok(_) => {}
            Err(RecvTimeoutError::Timeout) => return false,
        }
    }
}

/// Passes on what the task reports until it is over.
fn listen(py: Python<'_>, notify: &Py<PyAny>, said: &Mutex<Receiver<Said>>) -> PyResult<()> {
    let mut limit: Option<(Instant, String)> = None;
    let mut looked = Instant::now();
    loop {
        let heard = py.detach(|| next(said, LOOK));
        if looked.elapsed() >= LOOK {
            py.check_signals()?;
            looked = Instant::now();
            if let Some((_, message)) = limit.take_if(|(at, _)| Instant::now() >= *at + GRACE) {
                return Err(TouchdownError::new_err(message));
            }
        }
        let (kind, text, number) = match heard {
            Err(RecvTimeoutError::Timeout) => continue,
            Err(RecvTimeoutError::Disconnected) | Ok(Said::Over) => return Ok(()),
            Ok(Said::HandsOut) => {
                limit = None;
                continue;
            }
            Ok(Said::Limit(at, message)) => {
                limit = Some((at, message));
                continue;
            }
            Ok(Said::Begin(text, total)) => ("begin", text, total),
            Ok(Said::Stage(text)) => ("stage", text, 0),
            Ok(Said::Add(parts)) => ("add", String::new(), parts),
            Ok(Said::End) => ("end", String::new(), 0),
            Ok(Said::Warning(text)) => ("warning", text, 0),
            Ok(Said::Error(text)) => ("error", text, 0),
            Ok(Said::Answer(text)) => ("answer", text, 0),
        };
        notify.call1(py, (kind, text, number))?;
    }
}
