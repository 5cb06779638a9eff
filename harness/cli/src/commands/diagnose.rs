//! `touchdown diagnose`.

use super::fmus::Fmus;
use super::form::Form;
use super::terminal::Terminal;
use crate::print;
use crate::tasks::diagnose::{diagnose, Answer, Options};
use crate::tasks::Follow;
use anyhow::Result;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

const EXAMPLES: &str = "Examples:
  touchdown diagnose my_drops --out answer               # then open answer/my_drops/report.html
  touchdown diagnose drops_a drops_b --out answers --jobs 2
  touchdown diagnose drops_* --out answers --resume      # only those that have no answer yet, or were changed
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
    /// Leave campaigns alone whose answer is there, whole, and of the same recordings, campaign.toml, options and version
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    fmus: Fmus,
    #[command(flatten)]
    form: Form,
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let o = Options {
        campaigns: a.campaigns.clone(),
        out: a.out.clone(),
        platforms: a.platforms.clone(),
        jobs: a.jobs,
        bootstrap: a.bootstrap,
        seconds: a.seconds,
        resume: a.resume,
        isolation: a.fmus.isolation()?,
    };
    let follow: Arc<dyn Follow> = Arc::new(Terminal::new(a.form));
    let done = diagnose(&o, &follow)?;
    let batch = &done.batch;
    if done.unread {
        return Ok(batch.exit_code());
    }
    if !batch.left.is_empty() {
        print::error(&batch.unfinished(&a.out));
    }
    if let Some(Err(e)) = &done.page {
        print::warning(&format!("{}: {e}", a.out.join("index.html").display()));
    }
    let words = |_: &Vec<Answer>| {
        let place = match &done.page {
            None => String::new(),
            Some(Ok(page)) => format!("answers: {}\n", page.display()),
            Some(Err(_)) => format!("answers, each with a report.html: {}\n", a.out.display()),
        };
        batch.summary() + &place
    };
    print::beside(&a.form.of(&done.answers, words)?);
    Ok(batch.exit_code())
}
