//! All that the commands print: answers on standard output, notes and errors on standard error.
//!
//! Nothing here panics where the reader has gone, as `| head` does once it has its lines.

use std::io::{ErrorKind, Write};
use std::sync::atomic::{AtomicBool, Ordering};

static QUIET: AtomicBool = AtomicBool::new(false);

/// From here on neither warnings nor progress are printed.
pub fn be_quiet() {
    QUIET.store(true, Ordering::Relaxed);
}

/// Whether [`be_quiet`] was asked for.
pub fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Exit code of a command that only prints, once its reader has gone: 128 and the number of SIGPIPE.
pub const CLOSED_CODE: u8 = 141;

/// An answer that could not be printed.
#[derive(Debug, thiserror::Error)]
#[error("standard output: {0}")]
pub struct Unprinted(#[from] std::io::Error);

impl Unprinted {
    /// Whether the reader has gone: nobody is left to tell.
    pub fn is_closed(&self) -> bool {
        self.0.kind() == ErrorKind::BrokenPipe
    }
}

/// Prints an answer that is all a command makes.
///
/// # Errors
/// Where it cannot be printed: nothing is left to do then.
pub fn answer(text: &str) -> Result<(), Unprinted> {
    let mut out = anstream::stdout().lock();
    out.write_all(text.as_bytes())?;
    Ok(out.flush()?)
}

/// Prints what a command says beside the files it writes. It goes on where nobody reads; why else nothing could be printed
/// is told.
pub fn beside(text: &str) {
    if let Err(e) = answer(text) {
        if !e.is_closed() {
            error(&e.to_string());
        }
    }
}

/// Prints a line on standard error, where somebody reads it.
pub fn line(text: &str) {
    // nobody is left to tell that nobody reads
    drop(writeln!(anstream::stderr().lock(), "{text}"));
}

/// Asks on standard error; the answer is typed on the same line.
pub fn question(text: &str) {
    let mut out = anstream::stderr().lock();
    // who cannot read the question answers with the end of the input
    drop(write!(out, "{text}").and_then(|()| out.flush()));
}

/// Tells what is wrong, each line with `error:` before it.
pub fn error(text: &str) {
    text.lines().for_each(|l| line(&format!("error: {l}")));
}

/// Tells what is to be known beside the answer, each line with `warning:` before it; nothing where quiet was asked for.
pub fn warning(text: &str) {
    if is_quiet() {
        return;
    }
    text.lines().for_each(|l| line(&format!("warning: {l}")));
}
