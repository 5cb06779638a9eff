//! `touchdown diagnose`.

use anyhow::{anyhow, Context, Result};
use diagnose::run::{self as diagnosis, Failure, Settings};
use record::Campaign;
use report::diagnosis as answer;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use touchdown::campaign::{of_campaign, tell};
use touchdown::progress::{catch_interrupts, interrupted, Progress, INTERRUPTED_CODE};

#[derive(clap::Args)]
pub struct Arguments {
    /// Campaign folders of format recordings/1
    #[arg(required = true)]
    campaigns: Vec<PathBuf>,
    /// Folder the answers go to, one subfolder a campaign
    #[arg(long)]
    out: PathBuf,
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
}

/// The campaign in `dir`, to be answered below `out` beside the answers of `others`.
fn taken_in(dir: &Path, out: &Path, others: &[Campaign]) -> Result<Campaign> {
    let c = touchdown::campaign::load(dir)?;
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
    // all input is read before any answer is written; a bad campaign does not stop the others
    let mut campaigns: Vec<Campaign> = Vec::new();
    let mut failed = false;
    for dir in &a.campaigns {
        match taken_in(dir, &a.out, &campaigns) {
            Ok(c) => campaigns.push(c),
            Err(e) => {
                failed = true;
                tell(&format!("{e:#}"));
            }
        }
    }
    if campaigns.is_empty() {
        return Ok(ExitCode::from(2));
    }
    for c in &campaigns {
        for w in &c.warnings {
            eprintln!("touchdown: {}: {w}", c.dir.display());
        }
    }
    catch_interrupts();
    let count = campaigns.len();
    let progress = Progress::new("diagnose", count as u64);
    let mut written = 0;
    for c in &campaigns {
        let stage = |text: &str| progress.stage(&format!("{}: {text}", c.folder));
        let settings = Settings {
            bootstrap: a.bootstrap,
            element: true,
            platforms: a.platforms.as_deref(),
            others: &campaigns,
            stage: &stage,
            stopped: &interrupted,
        };
        match diagnosis::diagnose_with(c, &settings) {
            Ok(o) => {
                let dir = a.out.join(&c.folder);
                answer::write(c, &o, &dir).with_context(|| format!("{}: cannot be written", dir.display()))?;
                written += 1;
                progress.aside(|| print!("{}", answer::summary(&o)));
            }
            Err(Failure::Stopped) => {
                drop(progress);
                eprintln!(
                    "touchdown: stopped; the answers of {written} of {count} campaigns are whole in {}",
                    a.out.display()
                );
                return Ok(ExitCode::from(INTERRUPTED_CODE));
            }
            Err(e) => {
                failed = true;
                progress.aside(|| tell(&of_campaign(&c.dir, &e)));
            }
        }
        progress.add(1);
    }
    drop(progress);
    if written > 0 {
        match answer::write_index(&a.out) {
            Ok(()) => println!("answers: {}", a.out.join("index.html").display()),
            Err(e) => {
                eprintln!("touchdown: {}: {e}", a.out.join("index.html").display());
                println!("answers, each with a report.html: {}", a.out.display());
            }
        }
    }
    Ok(if failed { ExitCode::from(2) } else { ExitCode::SUCCESS })
}
