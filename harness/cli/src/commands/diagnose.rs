//! `touchdown diagnose`.

use super::fmus::Fmus;
use super::form::Form;
use super::terminal::Terminal;
use crate::place;
use crate::print::{self, Shown};
use crate::progress::deadline;
use crate::tasks::diagnose::{diagnose, Answer, Options};
use crate::tasks::shard::{self, Share};
use crate::tasks::Follow;
use crate::typed;
use anyhow::{ensure, Result};
use fleet::shard::Shard;
use std::ffi::{OsStr, OsString};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

const EXAMPLES: &str = "Examples:
  touchdown diagnose my_drops --out answer               # then open answer/my_drops/report.html
  touchdown diagnose drops_a drops_b --out answers --jobs 2
  touchdown diagnose drops_* --out answers --resume      # only those that have no answer yet, or were changed
  touchdown diagnose my_drops --out answer --bootstrap 99  # the false-alarm probability by 99 simulated campaigns
  touchdown diagnose fleet --out answers --shard 3/40    # the third of forty shares; then touchdown merge answers";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Campaign folders of format recordings/1
    #[arg(required_unless_present = "list")]
    campaigns: Vec<PathBuf>,
    /// Read further campaign folders from a file, a path a line
    #[arg(long, value_name = "FILE")]
    list: Option<PathBuf>,
    /// Folder the answers go to, one subfolder a campaign
    #[arg(long)]
    pub out: PathBuf,
    /// Folder of the element's libraries for other platforms, DIR/PLATFORM/LIBRARY as in an FMU's binaries/ (default:
    /// lib/platforms beside the command, or those that pack --all-platforms has left)
    #[arg(long, value_name = "DIR")]
    platforms: Option<PathBuf>,
    /// Diagnose a share of a fleet: of all campaigns, sorted by name, every N-th from the I-th on, each in a process of its own
    /// and as with --alone --resume. What ends a process loses its campaign alone, and is written down for `touchdown merge`.
    /// A folder without campaign.toml stands for the campaigns directly below it
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Diagnose each campaign as if it were the only one: hold no sensors against those of another, and write no page of all
    #[arg(long)]
    alone: bool,
    /// Threads, of which 256 at most are taken; with --shard processes at once, of a thread each (default: one a processor)
    #[arg(long)]
    jobs: Option<usize>,
    /// Simulate and judge N whole campaigns without the effect for the false-alarm probability, some seconds each
    /// (default: nulls made of the residual)
    #[arg(long, value_name = "N", default_value_t = 0)]
    bootstrap: usize,
    /// Judge a share of the bootstrap's campaigns, and leave them in --out for the others; the process that finds all shares
    /// there writes the answer, to the bit that of one process
    #[arg(long, value_name = "I/M", requires = "bootstrap")]
    replicates: Option<Shard>,
    /// Seconds that a campaign may take; one that is not judged by then is answered as not judged (default: any number)
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seconds: Option<f64>,
    /// Leave campaigns alone whose answer is there, whole, and of the same recordings, campaign.toml, options and version
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    fmus: Fmus,
    #[command(flatten)]
    form: Form,
}

/// Variable by which a share gives a process of its own its number: the process ends with it.
const SHARE: &str = "TOUCHDOWN_SHARE";

/// Ends this process with the share that has started it, where one has.
fn end_with_share() {
    #[cfg(target_os = "linux")]
    if let Some(share) = std::env::var(SHARE).ok().and_then(|s| s.parse::<i32>().ok()) {
        use rustix::process::{getppid, set_parent_process_death_signal, Signal};
        let is_above = || getppid().map(|p| p.as_raw_nonzero().get()) == Some(share);
        // another program may stand between
        if is_above() {
            // a kernel that refuses leaves it to run on, which does no harm
            let _ = set_parent_process_death_signal(Some(Signal::KILL));
            if !is_above() {
                // it was ended before it could be reported
                std::process::exit(2);
            }
        }
    }
}

impl Arguments {
    fn campaigns(&self) -> Result<Vec<PathBuf>> {
        let mut all = self.campaigns.clone();
        all.extend(self.list.as_deref().map(shard::listed).transpose()?.into_iter().flatten());
        Ok(all)
    }

    /// Options of every process of a share.
    fn with(&self) -> Vec<OsString> {
        let mut with: Vec<OsString> = self.fmus.arguments().into_iter().map(OsString::from).collect();
        let mut add = |name: &str, value: &dyn AsRef<OsStr>| with.extend([name.into(), value.as_ref().to_os_string()]);
        if let Some(p) = &self.platforms {
            add("--platforms", p);
        }
        if self.bootstrap > 0 {
            add("--bootstrap", &self.bootstrap.to_string());
        }
        if let Some(r) = self.replicates {
            add("--replicates", &r.to_string());
        }
        with
    }
}

/// The share of a fleet.
fn share(a: &Arguments, of: Shard) -> Result<ExitCode> {
    ensure!(a.jobs != Some(0), "--jobs 0 leaves no process; give 1 or more");
    deadline(a.seconds)?;
    let o = shard::Options {
        campaigns: a.campaigns()?,
        shard: of,
        out: a.out.clone(),
        processes: a.jobs.or_else(|| std::thread::available_parallelism().ok().map(usize::from)).unwrap_or(1),
        program: shard::program()?,
        with: a.with(),
        environment: vec![(SHARE.into(), std::process::id().to_string().into())],
        seconds: a.seconds,
    };
    let follow: Arc<dyn Follow> = Arc::new(Terminal::new(a.form));
    let done = shard::diagnose(&o, &follow)?;
    if done.batch.is_interrupted() {
        print::error(&done.batch.unfinished(&a.out));
    }
    let words = |s: &Share| {
        let mut text = format!("shard {of} of {} campaigns\n{}", s.fleet, s.batch.summary());
        if s.worked > 0 {
            let an_hour = 3600.0 * s.worked as f64 / s.seconds;
            let memory = s.memory.map_or(String::new(), |m| format!(", {:.0} MB a process at most", m / 1e6));
            text += &format!("{an_hour:.0} campaigns an hour by {} at once{memory}\n", o.processes);
        }
        text + &format!("answers: {}; touchdown merge puts them together\n", a.out.shown())
    };
    print::beside(&a.form.of(&done, words)?);
    Ok(done.batch.exit_code())
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    end_with_share();
    if let Some(of) = a.shard {
        return share(a, of);
    }
    ensure!(a.replicates.is_none() || a.bootstrap > 0, "--replicates shares the campaigns of --bootstrap N; give that");
    let o = Options {
        campaigns: a.campaigns()?,
        out: a.out.clone(),
        platforms: a.platforms.clone(),
        jobs: a.jobs,
        bootstrap: a.bootstrap,
        replicates: a.replicates,
        alone: a.alone,
        seconds: a.seconds,
        resume: a.resume,
        isolation: a.fmus.isolation()?,
        command: typed::line(),
    };
    let follow: Arc<dyn Follow> = Arc::new(Terminal::new(a.form));
    let done = diagnose(&o, &follow)?;
    let batch = &done.batch;
    if done.unread {
        return Ok(batch.exit_code());
    }
    if batch.is_interrupted() {
        print::error(&batch.unfinished(&a.out));
    }
    if let Some(Err(e)) = &done.page {
        print::error(&print::cured_of(format!("{}: {e:#}", place::unwritten(&a.out.join("index.html"))), e));
    }
    let words = |_: &Vec<Answer>| {
        let place = match &done.page {
            None => {
                done.answers.iter().map(|a| format!("report: {}\n", a.answer.join("report.html").shown())).collect()
            }
            Some(Ok(page)) => format!("answers: {}\n", page.shown()),
            Some(Err(_)) => format!("answers, each with a report.html: {}\n", a.out.shown()),
        };
        batch.summary() + &place
    };
    print::beside(&a.form.of(&done.answers, words)?);
    Ok(batch.exit_code())
}
