//! `touchdown diagnose`.

use super::form::Form;
use crate::campaign::of_campaign;
use crate::print;
use crate::progress::{catch_interrupts, deadline, interrupted, interruption, Progress, INTERRUPTED_CODE};
use anyhow::{anyhow, Context, Result};
use diagnose::run::{self as diagnosis, Failure, Outcome, Settings};
use diagnose::verdict::Verdict;
use estimate::Budget;
use record::Campaign;
use report::diagnosis as answer;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::mpsc::{channel, RecvTimeoutError};
use std::sync::Arc;
use std::time::Duration;

const EXAMPLES: &str = "Examples:
  touchdown diagnose my_drops --out answer               # then open answer/my_drops/report.html
  touchdown diagnose drops_a drops_b --out answers --jobs 2
  touchdown diagnose my_drops --out answer --bootstrap 99  # the false-alarm probability by 99 simulated campaigns";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Campaign folders of format recordings/1
    #[arg(required = true)]
    campaigns: Vec<PathBuf>,
    /// Folder the answers go to, one subfolder a campaign
    #[arg(long)]
    pub out: PathBuf,
    /// Folder of the element's libraries for other platforms, DIR/PLATFORM/LIBRARY as in an FMU's binaries/ (default:
    /// lib/platforms beside the command, or those that pack --all-platforms has left)
    #[arg(long, value_name = "DIR")]
    platforms: Option<PathBuf>,
    /// Threads (default: one a processor)
    #[arg(long)]
    jobs: Option<usize>,
    /// Simulate and judge N whole campaigns without the effect for the false-alarm probability, some seconds each
    /// (default: nulls made of the residual)
    #[arg(long, value_name = "N", default_value_t = 0)]
    bootstrap: usize,
    /// Seconds that a campaign may take; one that is not judged by then is answered as not judged (default: any number)
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    #[command(flatten)]
    form: Form,
}

/// Time between looks at whether the user has ended the command.
const LOOK: Duration = Duration::from_millis(50);
/// Time that a diagnosis has to end by itself, then.
const GRACE: Duration = Duration::from_millis(500);

/// The campaign in `dir`, to be answered below `out` beside the answers of `others`.
fn taken_in(dir: &Path, out: &Path, others: &[Campaign]) -> Result<Campaign> {
    let c = crate::campaign::load(dir)?;
    if let Some(other) = others.iter().find(|o| o.folder == c.folder) {
        return Err(anyhow!(
            "{}: {} is called {} as well, and their answers would overwrite each other; rename one folder",
            dir.display(),
            other.dir.display(),
            c.folder
        ));
    }
    let answer = out.join(&c.folder);
    answer::check_folder(&answer).with_context(|| format!("{}: cannot be written", answer.display()))?;
    Ok(c)
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    if let Some(n) = a.jobs {
        if n == 0 {
            return Err(anyhow!("--jobs 0 leaves no thread; give 1 or more"));
        }
        rayon::ThreadPoolBuilder::new().num_threads(n).build_global().ok();
    }
    // wrong seconds are told before anything is read
    deadline(a.seconds)?;
    // all input is read before any answer is written; a bad campaign does not stop the others
    let mut campaigns: Vec<Campaign> = Vec::new();
    let mut failed = false;
    for dir in &a.campaigns {
        match taken_in(dir, &a.out, &campaigns) {
            Ok(c) => campaigns.push(c),
            Err(e) => {
                failed = true;
                print::error(&format!("{e:#}"));
            }
        }
    }
    if campaigns.is_empty() {
        return Ok(ExitCode::from(2));
    }
    for c in &campaigns {
        for w in &c.warnings {
            print::warning(&format!("{}: {w}", c.dir.display()));
        }
    }
    catch_interrupts();
    let campaigns = Arc::new(campaigns);
    let progress = Arc::new(Progress::new("diagnose", campaigns.len() as u64));
    let mut answers: Vec<Answer> = Vec::new();
    for (i, c) in campaigns.iter().enumerate() {
        match alone(&campaigns, i, a, &progress) {
            Ok(o) => {
                let dir = a.out.join(&c.folder);
                answer::write(c, &o, &dir).with_context(|| format!("{}: cannot be written", dir.display()))?;
                // what is to be one JSON text is printed at the end
                if !a.form.json {
                    progress.aside(|| print::beside(&print::with_lead(&answer::summary(&o))));
                }
                answers.push(Answer { campaign: c.dir.clone(), answer: dir, verdict: o.verdict });
            }
            Err(Failure::Interrupted) => {
                let left: Vec<&str> = campaigns[i..].iter().map(|c| c.folder.as_str()).collect();
                progress.end();
                print::error(&unfinished(&left, answers.len(), &a.out));
                finish(a, &answers)?;
                return Ok(ExitCode::from(INTERRUPTED_CODE));
            }
            Err(e) => {
                failed = true;
                progress.aside(|| print::error(&of_campaign(&c.dir, &e)));
            }
        }
        progress.add(1);
    }
    progress.end();
    finish(a, &answers)?;
    Ok(if failed { ExitCode::from(2) } else { ExitCode::SUCCESS })
}

/// Diagnoses campaign `i` on a thread of its own and waits for it. Where the user ends the command the thread is given
/// [`GRACE`] to come to the end of its stage, which puts its temporary files away, and is left alone then: what it works out is
/// written by nobody, and it ends with the process.
fn alone(
    campaigns: &Arc<Vec<Campaign>>,
    i: usize,
    a: &Arguments,
    progress: &Arc<Progress>,
) -> Result<Outcome, Failure> {
    let (campaigns, progress) = (campaigns.clone(), progress.clone());
    let (bootstrap, platforms) = (a.bootstrap, a.platforms.clone());
    let budget = Budget { stop: Some(interruption()), deadline: deadline(a.seconds).unwrap_or_default() };
    let (done, outcome) = channel();
    let thread = std::thread::spawn(move || {
        let c = &campaigns[i];
        let stage = |text: &str| progress.stage(&format!("{}: {text}", c.folder));
        let others = &campaigns[..];
        let platforms = platforms.as_deref();
        let settings = Settings { bootstrap, element: true, platforms, others, stage: &stage, budget };
        // nobody listens any more where the user has ended the command
        drop(done.send(diagnosis::diagnose_with(c, &settings)));
    });
    let mut left = GRACE;
    loop {
        match outcome.recv_timeout(LOOK) {
            // what was finished while the user ended the command is finished
            Ok(o) => return o,
            Err(RecvTimeoutError::Timeout) if interrupted() && left.is_zero() => return Err(Failure::Interrupted),
            Err(RecvTimeoutError::Timeout) if interrupted() => left = left.saturating_sub(LOOK),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => match thread.join() {
                Err(panic) => std::panic::resume_unwind(panic),
                Ok(()) => unreachable!("a diagnosis sends its outcome before it ends"),
            },
        }
    }
}

/// A campaign answered.
#[derive(Serialize)]
struct Answer {
    campaign: PathBuf,
    /// Folder of the answer.
    answer: PathBuf,
    verdict: Verdict,
}

/// What a command that was ended leaves.
fn unfinished(left: &[&str], written: usize, out: &Path) -> String {
    let first = format!("interrupted: {} is not finished, nothing of it is written", left[0]);
    let others = if left.len() > 1 { format!("\nnot begun: {}", left[1..].join(", ")) } else { String::new() };
    let there = match written {
        0 => String::new(),
        1 => format!("\nfinished and whole in {}: 1 campaign", out.display()),
        n => format!("\nfinished and whole in {}: {n} campaigns", out.display()),
    };
    first + &others + &there
}

/// Writes the page that lists the answers, and says where it is, or what all of them are.
fn finish(a: &Arguments, answers: &[Answer]) -> Result<()> {
    let page = a.out.join("index.html");
    let listed = if answers.is_empty() { Ok(()) } else { answer::write_index(&a.out) };
    if let Err(e) = &listed {
        print::warning(&format!("{}: {e}", page.display()));
    }
    let words = |all: &&[Answer]| match &listed {
        _ if all.is_empty() => String::new(),
        Ok(()) => format!("answers: {}\n", page.display()),
        Err(_) => format!("answers, each with a report.html: {}\n", a.out.display()),
    };
    print::beside(&a.form.of(&answers, words)?);
    Ok(())
}
