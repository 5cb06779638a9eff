//! A task followed on the terminal.

use super::form::Form;
use crate::print;
use crate::progress::{catch_interrupts, end_empty_handed_at, hand_out, interruption, Progress};
use crate::tasks::Follow;
use std::sync::atomic::AtomicBool;
use std::sync::RwLock;
use std::time::Instant;

/// Shows how far a task is, prints what it reports, and ends it by the signals of the terminal.
pub struct Terminal {
    form: Form,
    progress: RwLock<Option<Progress>>,
}

impl Terminal {
    /// Of a command whose answer has this form: one JSON text leaves no words beside it.
    pub fn new(form: Form) -> Terminal {
        Terminal { form, progress: RwLock::new(None) }
    }

    /// Does something with the job under way, where there is one.
    fn of_job(&self, act: impl FnOnce(&Progress)) {
        if let Ok(Some(p)) = self.progress.read().as_deref() {
            act(p);
        }
    }

    /// Prints without a bar in the way.
    fn aside(&self, print: impl FnOnce()) {
        match self.progress.read().as_deref() {
            Ok(Some(p)) => p.aside(print),
            _ => print(),
        }
    }

    fn replace(&self, job: Option<Progress>) {
        if let Ok(mut p) = self.progress.write() {
            *p = job;
        }
    }
}

impl Follow for Terminal {
    fn stop(&self) -> &'static AtomicBool {
        interruption()
    }

    fn looks(&self) {
        catch_interrupts();
    }

    fn hands_out(&self) {
        hand_out();
    }

    fn empty_handed_at(&self, deadline: Option<Instant>, message: String) {
        end_empty_handed_at(deadline, message);
    }

    fn begin(&self, what: &str, total: u64) {
        self.replace(Some(Progress::new(what, total)));
    }

    fn stage(&self, text: &str) {
        self.of_job(|p| p.stage(text));
    }

    fn note(&self, text: &dyn Fn() -> String) {
        self.of_job(|p| p.note(text));
    }

    fn add(&self, parts: u64) {
        self.of_job(|p| p.add(parts));
    }

    fn end(&self) {
        self.replace(None);
    }

    fn warning(&self, text: &str) {
        self.aside(|| print::warning(text));
    }

    fn error(&self, text: &str) {
        self.aside(|| print::error(text));
    }

    fn answer(&self, text: &str) {
        if !self.form.json {
            self.aside(|| print::beside(&print::with_lead(text)));
        }
    }
}
