//! The other side: a Python with fmpy, scipy and numba that answers questions, a line each.

use anyhow::{bail, Context, Result};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

/// The script that steps FMUs by fmpy.
pub const FMPY_SIDE: &str = include_str!("../../../../tests/bench/fmpy_side.py");

/// A Python process that has imported what it needs and read its file.
pub struct Python {
    child: Child,
    questions: ChildStdin,
    answers: BufReader<ChildStdout>,
    /// Its versions, in its own words.
    pub versions: String,
}

impl Drop for Python {
    fn drop(&mut self) {
        // it ends when its input does; a process that hangs is not waited for
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Python {
    /// Starts `python` with a script and the files it works on.
    ///
    /// # Errors
    /// No such program, or it lacks a module.
    pub fn start(python: &Path, script: &str, files: &[&Path]) -> Result<Python> {
        let mut child = Command::new(python)
            .args(["-c", script])
            .args(files)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| {
                format!(
                    "{}: cannot be started; give a Python with what tests/bench/requirements.txt lists",
                    python.display()
                )
            })?;
        let (Some(questions), Some(answers)) = (child.stdin.take(), child.stdout.take()) else {
            bail!("{}: its input and output cannot be had", python.display());
        };
        let mut p = Python { child, questions, answers: BufReader::new(answers), versions: String::new() };
        p.versions = p.line().with_context(|| {
            format!("{}: did not get ready; install what tests/bench/requirements.txt lists in it", python.display())
        })?;
        Ok(p)
    }

    fn line(&mut self) -> Result<String> {
        let mut line = String::new();
        if self.answers.read_line(&mut line)? == 0 {
            bail!("Python ended without an answer; its words are above");
        }
        Ok(line.trim().to_string())
    }

    /// Asks; the numbers of the answer, one at least.
    ///
    /// # Errors
    /// Where Python ends or answers no numbers.
    pub fn ask(&mut self, question: &str) -> Result<Vec<f64>> {
        writeln!(self.questions, "{question}").context("Python takes no more questions; its words are above")?;
        self.questions.flush()?;
        let line = self.line()?;
        let numbers: Vec<f64> = line
            .split_whitespace()
            .map(|w| w.parse().with_context(|| format!("Python answered {question:?} with {line:?}")))
            .collect::<Result<_>>()?;
        if numbers.is_empty() {
            bail!("Python answered {question:?} with nothing");
        }
        Ok(numbers)
    }
}
