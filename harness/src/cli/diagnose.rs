//! `touchdown diagnose`.

use anyhow::{anyhow, Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use touchdown::diagnose::{answer, run as diagnosis};
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
        campaigns.push(c);
    }
    let stop = Arc::new(AtomicBool::new(false));
    let flag = stop.clone();
    ctrlc::set_handler(move || flag.store(true, Ordering::SeqCst)).ok();
    let terminal = std::io::stderr().is_terminal();
    let bar = if terminal && campaigns.len() > 1 {
        ProgressBar::new(campaigns.len() as u64).with_style(
            ProgressStyle::with_template("{bar:30} {pos}/{len} {msg} {eta}")
                .unwrap_or_else(|_| ProgressStyle::default_bar()),
        )
    } else {
        ProgressBar::hidden()
    };
    let mut failed = false;
    let count = campaigns.len();
    for (i, c) in campaigns.iter().enumerate() {
        if stop.load(Ordering::SeqCst) {
            eprintln!("stopped; the answers of {i} of {count} campaigns are complete in {}", a.out.display());
            return Ok(ExitCode::from(130));
        }
        bar.set_message(c.folder.clone());
        match diagnosis::diagnose(c) {
            Ok(o) => {
                let dir = a.out.join(&c.folder);
                answer::write(c, &o, &dir).with_context(|| format!("{}: cannot be written", dir.display()))?;
                bar.suspend(|| println!("{}: {}", c.folder, answer::sentence(&o)));
            }
            Err(e) => {
                failed = true;
                bar.suspend(|| eprintln!("touchdown: {}: {e}", c.dir.display()));
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(if failed { ExitCode::from(2) } else { ExitCode::SUCCESS })
}
