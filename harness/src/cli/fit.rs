//! `touchdown fit`.

use anyhow::{anyhow, Context, Result};
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::time::{Duration, Instant};
use touchdown::diagnose::run::ready;
use touchdown::diagnose::search::Search;
use touchdown::fit::answer::Answer;
use touchdown::fit::estimate::{estimate, Method};
use touchdown::fit::levels::{levels, readings};
use touchdown::fit::Watch;
use touchdown::record;

#[derive(Clone, Copy, clap::ValueEnum)]
enum Way {
    /// Nelder and Mead's simplex, as the paper has it
    Simplex,
    /// Levenberg-Marquardt
    Lm,
}

#[derive(clap::Args)]
pub struct Arguments {
    /// Campaign folder of format recordings/1
    campaign: PathBuf,
    /// Folder for fit.json, certificate.json and report.html
    #[arg(long)]
    out: PathBuf,
    /// How to minimise
    #[arg(long, value_enum, default_value = "lm")]
    method: Way,
    /// Seconds after which the best so far is written
    #[arg(long, default_value_t = 600.0)]
    seconds: f64,
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    if !(a.seconds > 0.0 && a.seconds < 1e9) {
        return Err(anyhow!("--seconds {} is no time to work in; give more than 0", a.seconds));
    }
    let campaign = record::load(&a.campaign)?;
    let stop = Arc::new(AtomicBool::new(false));
    let flag = stop.clone();
    ctrlc::set_handler(move || flag.store(true, Ordering::SeqCst)).ok();
    let bar = if std::io::stderr().is_terminal() {
        let style = ProgressStyle::with_template("{spinner} {elapsed} {msg}");
        ProgressBar::new_spinner().with_style(style.unwrap_or_else(|_| ProgressStyle::default_spinner()))
    } else {
        ProgressBar::hidden()
    };
    bar.enable_steady_tick(Duration::from_millis(120));
    let say = |line: &str| {
        if bar.is_hidden() {
            eprintln!("fit: {line}");
        } else {
            bar.set_message(line.to_string());
        }
    };
    let deadline = Instant::now() + Duration::from_secs_f64(a.seconds);
    let watch = Watch { stop: &stop, deadline: Some(deadline), say: &say };
    say(&format!("preparing {} recordings", campaign.recordings.len()));
    let (data, guess) = ready(&campaign).with_context(|| campaign.dir.display().to_string())?;
    let search = Search::new(&campaign, &data);
    let case = search.case(&campaign, guess);
    let method = match a.method {
        Way::Simplex => Method::Simplex,
        Way::Lm => Method::LevenbergMarquardt,
    };
    let e = estimate(&case, method, &watch).with_context(|| campaign.dir.display().to_string())?;
    say("level by level");
    let (initial, last) = (readings(&case, &e.start), readings(&case, &e.point));
    let levels = levels(&campaign, &case, &e, &last, &watch);
    let answer = Answer { campaign: &campaign, case: &case, estimate: &e, initial, last, levels };
    answer.write(&a.out).with_context(|| format!("{}: cannot be written", a.out.display()))?;
    bar.finish_and_clear();
    println!("{}: {}", campaign.folder, answer.sentence());
    println!("pictures: {}", a.out.join("report.html").display());
    Ok(if stop.load(Ordering::SeqCst) { ExitCode::from(130) } else { ExitCode::SUCCESS })
}
