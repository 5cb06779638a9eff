//! `touchdown demo`.

use anyhow::{Context, Result};
use std::path::PathBuf;
use std::process::ExitCode;
use touchdown::demo::{write_campaign, Recipe};
use touchdown::diagnose::{answer, run as diagnosis};
use touchdown::record;

#[derive(clap::Args)]
pub struct Arguments {
    /// Folder for the made campaign and its diagnosis
    #[arg(long)]
    out: PathBuf,
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let mut recipe = Recipe::default();
    recipe.physics.friction = 0.8;
    let dir = a.out.join("hidden-friction");
    write_campaign(&dir, &recipe).with_context(|| format!("{}: cannot be written", dir.display()))?;
    println!(
        "made a drop-test campaign whose guide rubs with {} N, which its simulation leaves out: {}",
        recipe.physics.friction,
        dir.display()
    );
    let c = record::load(&dir)?;
    let o = diagnosis::diagnose(&c)?;
    let out = a.out.join("diagnosis");
    answer::write(&c, &o, &out).with_context(|| format!("{}: cannot be written", out.display()))?;
    print!("{}", answer::summary(&o));
    println!("pictures: {}", out.join("report.html").display());
    Ok(ExitCode::SUCCESS)
}
