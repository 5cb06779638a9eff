//! `touchdown diagnose`.

use anyhow::{anyhow, Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use touchdown::diagnose::answer;
use touchdown::diagnose::run::{self as diagnosis, Failure, Settings};
use touchdown::record;

#[derive(clap::Args)]
pub struct Arguments {
    /// Campaign folders of format recordings/1
    #[arg(required = true)]
    campaigns: Vec<PathBuf>,
    /// Folder the answers go to, one subfolder a campaign
    #[arg(long)]
    out: PathBuf,
    /// Threads (default: one a processor)
    #[arg(long)]
    jobs: Option<usize>,
    /// Judge N campaigns simulated from the base fit, to calibrate the false-alarm probability (default: theory)
    #[arg(long, value_name = "N", default_value_t = 0)]
    bootstrap: usize,
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    if let Some(n) = a.jobs {
        if n == 0 {
            return Err(anyhow!("--jobs 0 leaves no thread; give 1 or more"));
        }
        rayon::ThreadPoolBuilder::new().num_threads(n).build_global().ok();
    }
    // all input is read before any answer is written
    let mut campaigns = Vec::new();
    for dir in &a.campaigns {
        let c = record::load(dir)?;
        if campaigns.iter().any(|b: &record::Campaign| b.folder == c.folder) {
            return Err(anyhow!(
                "two campaigns are called {}; their answers would overwrite each other: rename one folder",
                c.folder
            ));
        }
        let dir = a.out.join(&c.folder);
        answer::room(&dir).with_context(|| format!("{}: cannot be written", dir.display()))?;
        campaigns.push(c);
    }
    for c in &campaigns {
        for w in &c.warnings {
            eprintln!("touchdown: {}: {w}", c.dir.display());
        }
    }
    let stop = Arc::new(AtomicBool::new(false));
    let flag = stop.clone();
    ctrlc::set_handler(move || {
        // the second one does not wait for the stage to end
        if flag.swap(true, Ordering::SeqCst) {
            std::process::exit(130);
        }
    })
    .ok();
    let count = campaigns.len();
    let bar = if std::io::stderr().is_terminal() {
        ProgressBar::new(count as u64).with_style(
            ProgressStyle::with_template("{bar:20} {pos}/{len} {elapsed} {msg}")
                .unwrap_or_else(|_| ProgressStyle::default_bar()),
        )
    } else {
        ProgressBar::hidden()
    };
    bar.enable_steady_tick(std::time::Duration::from_millis(250));
    let mut failed = false;
    for (i, c) in campaigns.iter().enumerate() {
        let stage = |text: &str| bar.set_message(format!("{}: {text}", c.folder));
        let stopped = || stop.load(Ordering::SeqCst);
        let settings = Settings { bootstrap: a.bootstrap, stage: &stage, stopped: &stopped };
        match diagnosis::diagnose_with(c, &settings) {
            Ok(o) => {
                let dir = a.out.join(&c.folder);
                answer::write(c, &o, &dir).with_context(|| format!("{}: cannot be written", dir.display()))?;
                bar.suspend(|| print!("{}", answer::summary(&o)));
            }
            Err(Failure::Stopped) => {
                bar.finish_and_clear();
                eprintln!("touchdown: stopped; the answers of {i} of {count} campaigns are whole in {}", a.out.display());
                return Ok(ExitCode::from(130));
            }
            Err(e) => {
                failed = true;
                bar.suspend(|| eprintln!("touchdown: {}: {e}", c.dir.display()));
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if !failed {
        println!("answers, each with a report.html: {}", a.out.display());
    }
    Ok(if failed { ExitCode::from(2) } else { ExitCode::SUCCESS })
}
