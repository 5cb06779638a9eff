//! All that the commands print: answers on standard output, notes and errors on standard error.
//!
//! Colours are for terminals: files, pipes and users who set NO_COLOR get plain text. Nothing here panics where the reader
//! has gone, as `| head` does once it has its lines.

use clap::builder::styling::{AnsiColor, Style, Styles};
use std::io::{ErrorKind, Write};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Of the words before what is wrong and what is to be known, as clap has them.
const ERROR: Style = AnsiColor::Red.on_default().bold();
const WARNING: Style = AnsiColor::Yellow.on_default().bold();
/// Of the line that sums an answer up.
const LEAD: Style = Style::new().bold();

/// Colours of the help.
pub const STYLES: Styles = Styles::styled()
    .header(AnsiColor::Green.on_default().bold())
    .usage(AnsiColor::Green.on_default().bold())
    .literal(AnsiColor::Cyan.on_default().bold())
    .placeholder(AnsiColor::Cyan.on_default())
    .error(ERROR)
    .valid(AnsiColor::Cyan.on_default().bold())
    .invalid(WARNING);

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
    /// Whether the reader has gone: nobody is left to print to.
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
    out.write_all(lines(text).as_bytes())?;
    Ok(out.flush()?)
}

/// Prints what a command says beside the files it writes. It goes on where nobody reads; why else nothing could be printed
/// is reported.
pub fn beside(text: &str) {
    if let Err(e) = answer(text) {
        if !e.is_closed() {
            UNPRINTED.store(true, Ordering::Relaxed);
            error(&cured(e.to_string(), &e.0));
        }
    }
}

/// Whether [`beside`] could not print something, for another reason than that nobody reads.
static UNPRINTED: AtomicBool = AtomicBool::new(false);

/// Whether something could not be printed though somebody reads: the command has not done all it was to do.
pub fn has_failed() -> bool {
    UNPRINTED.load(Ordering::Relaxed)
}

/// The message `said` of an error of the system, with its cure where there is one.
pub fn cured(said: String, e: &std::io::Error) -> String {
    and_cure(said, input::cure(e))
}

/// As [`cured`], of an error that may have one of the system among its causes.
pub fn cured_of(said: String, e: &anyhow::Error) -> String {
    let cure = e.chain().filter_map(|c| c.downcast_ref::<std::io::Error>()).find_map(input::cure);
    and_cure(said, cure)
}

fn and_cure(said: String, cure: Option<&str>) -> String {
    match cure.filter(|cure| !said.contains(cure)) {
        Some(cure) => format!("{said}; {cure}"),
        None => said,
    }
}

/// A text whose first line sums it up, that line set off for a terminal.
pub fn with_lead(text: &str) -> String {
    match text.split_once('\n') {
        Some((lead, rest)) => format!("{LEAD}{lead}{LEAD:#}\n{rest}"),
        None => format!("{LEAD}{text}{LEAD:#}"),
    }
}

/// Prints a line on standard error, where somebody reads it.
pub fn line(text: &str) {
    // nobody is left to hear of it
    drop(writeln!(anstream::stderr().lock(), "{text}"));
}

/// Asks on standard error; the answer is typed on the same line.
pub fn question(text: &str) {
    let mut out = anstream::stderr().lock();
    // who cannot read the question answers with the end of the input
    drop(write!(out, "{text}").and_then(|()| out.flush()));
}

/// Characters of a line of what is wrong that are printed at most.
const LONGEST: usize = 4000;

/// A line with what steers a terminal spelled out: texts come from files and from FMUs.
pub fn spelled_out(line: &str) -> String {
    let mut plain = String::with_capacity(line.len());
    for c in line.chars() {
        match c {
            '\t' => plain.push(c),
            c if c.is_control() => plain.extend(c.escape_default()),
            c => plain.push(c),
        }
    }
    plain
}

/// A path in a message: on one line, and with what steers a terminal spelled out.
pub trait Shown {
    fn shown(&self) -> String;
}

impl Shown for Path {
    fn shown(&self) -> String {
        spelled_out(&self.to_string_lossy())
    }
}

/// Lines as they are printed: what steers a terminal spelled out, but for what sets the first line off.
fn lines(text: &str) -> String {
    let (on, off) = (format!("{LEAD}"), format!("{LEAD:#}"));
    let each = |line: &str| {
        line.split(&on)
            .map(|l| l.split(&off).map(spelled_out).collect::<Vec<_>>().join(&off))
            .collect::<Vec<_>>()
            .join(&on)
    };
    text.split('\n').map(each).collect::<Vec<_>>().join("\n")
}

/// A line as it is printed: what steers a terminal spelled out, and no longer than anybody reads.
pub fn plain(line: &str) -> String {
    match line.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}... ({} bytes in all)", spelled_out(&line[..end]), line.len()),
        None => spelled_out(line),
    }
}

/// Prints what is wrong, each line with `error:` before it.
pub fn error(text: &str) {
    text.lines().for_each(|l| line(&format!("{ERROR}error:{ERROR:#} {}", plain(l))));
}

/// Prints what is to be known beside the answer, each line with `warning:` before it; nothing where quiet was asked for.
pub fn warning(text: &str) {
    if is_quiet() {
        return;
    }
    text.lines().for_each(|l| line(&format!("{WARNING}warning:{WARNING:#} {}", plain(l))));
}

/// Prints each of `notes` as a [`warning`].
pub fn warnings(notes: &[String]) {
    notes.iter().for_each(|n| warning(n));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_steers_a_terminal_is_spelled_out_and_no_line_is_endless() {
        assert_eq!(plain("a\tb \u{1b}[31mred\u{7}\u{9b}"), "a\tb \\u{1b}[31mred\\u{7}\\u{9b}");
        let name = Path::new("a\nerror: b\u{1b}[2J");
        assert_eq!(name.shown(), "a\\nerror: b\\u{1b}[2J");
        let text = with_lead("said\u{1b}[2J\nmore\r\n");
        assert_eq!(lines(&text), format!("{LEAD}said\\u{{1b}}[2J{LEAD:#}\nmore\\r\n"));
        let long = plain(&"ä".repeat(50_000));
        assert!(long.chars().count() < LONGEST + 40 && long.ends_with("... (100000 bytes in all)"));
    }
}
