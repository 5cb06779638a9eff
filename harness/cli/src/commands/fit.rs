//! `touchdown fit`.

use super::form::Form;
use crate::place;
use crate::print;
use crate::progress::{
    catch_interrupts, deadline, end_empty_handed_at, hand_out, interrupted, interrupted_code, interruption, Progress,
};
use anyhow::{anyhow, Context, Result};
use estimate::case::{Case, Method};
use estimate::condition::condition;
use estimate::course::estimate;
use estimate::levels::{levels, readings};
use estimate::prepare::Prepared;
use estimate::{Budget, Watch};
use report::fit::Answer;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Clone, Copy, clap::ValueEnum)]
enum Way {
    /// Nelder and Mead's simplex, as the paper has it
    Simplex,
    /// Levenberg-Marquardt
    Lm,
}

const EXAMPLES: &str = "Examples:
  touchdown fit my_drops --out fit                       # then open fit/report.html
  touchdown fit my_drops --out fit --method simplex --seconds 60";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Campaign folder of format recordings/1
    campaign: PathBuf,
    /// Folder for fit.json, certificate.json and report.html
    #[arg(long)]
    pub out: PathBuf,
    /// How to minimise
    #[arg(long, value_enum, default_value = "lm")]
    method: Way,
    /// Seconds after which the best so far is written
    #[arg(long, default_value_t = 600.0)]
    seconds: f64,
    #[command(flatten)]
    form: Form,
}

/// What is printed of a fit: what its files hold, and where its page is.
#[derive(Serialize)]
struct Told<'a> {
    campaign: &'a str,
    fit: serde_json::Value,
    certificate: serde_json::Value,
    pictures: &'a Path,
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let budget = Budget { stop: Some(interruption()), deadline: deadline(Some(a.seconds))? };
    let cure = "nothing is written; give more";
    let up = format!("{}: the {} s given were up before the first fit; {cure}", a.campaign.display(), a.seconds);
    end_empty_handed_at(budget.deadline, up);
    let campaign = crate::campaign::load(&a.campaign)?;
    for w in &campaign.warnings {
        print::warning(&format!("{}: {w}", campaign.dir.display()));
    }
    catch_interrupts();
    let progress = Progress::new(&format!("fit {}", campaign.folder), 0);
    let say = |line: &str| progress.stage(line);
    let watch = Watch { budget, say: &say };
    say(&format!("preparing {} recordings", campaign.recordings.len()));
    let of_campaign = || campaign.dir.display().to_string();
    let mut conditioned = condition(&campaign).with_context(of_campaign)?;
    diagnose::plausible::check(&campaign, &conditioned.data)
        .map_err(|e| anyhow!(crate::campaign::of_campaign(&campaign.dir, &e)))?;
    conditioned.data.budget = budget;
    let case = Case::new(Prepared::from(&campaign, conditioned).with_context(of_campaign)?);
    // from here on there is a best so far
    hand_out();
    let method = match a.method {
        Way::Simplex => Method::Simplex,
        Way::Lm => Method::LevenbergMarquardt,
    };
    let e = estimate(&case, method, &watch).with_context(of_campaign)?;
    say("level by level");
    let (initial, last) = (readings(&case, &e.start), readings(&case, &e.point));
    let levels = levels(&campaign, &case, &e, &last, &watch);
    let answer = Answer { campaign: &campaign, case: &case, estimate: &e, initial, last, levels };
    place::tell(&a.out, &answer.write(&a.out).with_context(|| place::unwritten(&a.out))?);
    drop(progress);
    let pictures = a.out.join("report.html");
    let told =
        Told { campaign: &campaign.folder, fit: answer.json(), certificate: answer.certificate(), pictures: &pictures };
    let words = |t: &Told<'_>| {
        format!("{}: {}\n{}pictures: {}\n", t.campaign, answer.sentence(), answer.by_level(), t.pictures.display())
    };
    print::beside(&a.form.of(&told, words)?);
    Ok(if interrupted() { interrupted_code() } else { ExitCode::SUCCESS })
}
