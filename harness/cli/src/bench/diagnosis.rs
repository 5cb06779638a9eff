//! Time and memory of a whole diagnosis.

use super::clock::{taken, Taken};
use anyhow::{Context, Result};
use std::path::Path;
use std::process::{Command, Stdio};

/// Threads the target speaks of.
pub const JOBS: usize = 2;
/// Wall seconds wanted.
pub const SECONDS: f64 = 10.0;
/// Bytes wanted.
pub const BYTES: f64 = 500e6;
/// Times longer, reading apart, that dense recordings may take, and bytes.
pub const DENSE: f64 = 1.5;
pub const DENSE_BYTES: f64 = 1e9;

/// `touchdown diagnose` of a campaign on two threads, as a process of its own, answers written to `out`.
///
/// # Errors
/// Where it fails.
pub fn diagnose(campaign: &Path, out: &Path) -> Result<Taken> {
    let program = std::env::current_exe().context("the program's own path is not known")?;
    taken(
        Command::new(program)
            .arg("diagnose")
            .arg(campaign)
            .args(["--jobs", &JOBS.to_string(), "--out"])
            .arg(out)
            .stdout(Stdio::null()),
    )
}
