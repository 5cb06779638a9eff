//! `touchdown fit`.

use anyhow::{anyhow, Context, Result};
use estimate::case::{Case, Method};
use estimate::course::estimate;
use estimate::levels::{levels, readings};
use estimate::prepare::Prepared;
use estimate::Watch;
use report::fit::Answer;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};
use touchdown::progress::{catch_interrupts, interrupted, interruption, Progress, INTERRUPTED_CODE};

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
    let campaign = touchdown::campaign::load(&a.campaign)?;
    if a.out.exists() && !a.out.is_dir() {
        return Err(anyhow!("{}: a file is in the way; give another --out", a.out.display()));
    }
    for w in &campaign.warnings {
        eprintln!("touchdown: {}: {w}", campaign.dir.display());
    }
    catch_interrupts();
    let progress = Progress::new(&format!("fit {}", campaign.folder), 0);
    let say = |line: &str| progress.stage(line);
    let deadline = Instant::now() + Duration::from_secs_f64(a.seconds);
    let watch = Watch { stop: interruption(), deadline: Some(deadline), say: &say };
    say(&format!("preparing {} recordings", campaign.recordings.len()));
    let case = Case::new(Prepared::new(&campaign).with_context(|| campaign.dir.display().to_string())?);
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
    drop(progress);
    println!("{}: {}", campaign.folder, answer.sentence());
    print!("{}", answer.by_level());
    println!("pictures: {}", a.out.join("report.html").display());
    Ok(if interrupted() { ExitCode::from(INTERRUPTED_CODE) } else { ExitCode::SUCCESS })
}
