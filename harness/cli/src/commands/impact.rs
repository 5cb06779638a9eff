//! `touchdown impact`.

use super::form::Form;
use crate::print;
use anyhow::{anyhow, Result};
use law::impact::impact;
use law::restitution::{hysteresis_damping, Formula};
use serde::Serialize;
use std::process::ExitCode;

const EXAMPLES: &str = "Examples:
  touchdown impact --mass 0.5 --speed 0.8 --stiffness 2e7 --restitution 0.7
  touchdown impact --mass 1 --speed 1 --stiffness 1.85e8 --exponent 1.96 --damping 8.77e7
  touchdown impact --mass 0.5 --speed 0.8 --stiffness 2e7 --json";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Mass, kg
    #[arg(long)]
    mass: f64,
    /// Speed at touch, m/s
    #[arg(long)]
    speed: f64,
    /// Stiffness k, N/m^p
    #[arg(long)]
    stiffness: f64,
    /// Exponent p
    #[arg(long, default_value_t = 1.5)]
    exponent: f64,
    /// Hysteresis damping mu_d, N s/m^(p+1)
    #[arg(long, conflicts_with = "restitution")]
    damping: Option<f64>,
    /// Wanted restitution instead of a damping, inverted exactly
    #[arg(long)]
    restitution: Option<f64>,
    #[command(flatten)]
    form: Form,
}

/// What is printed of an impact, SI.
#[derive(Serialize)]
struct Figures {
    hysteresis_damping: f64,
    deepest: f64,
    restitution: f64,
    peak_force: f64,
    duration: f64,
    energy_lost: f64,
    impulse: f64,
}

fn words(f: &Figures) -> String {
    format!(
        "hysteresis damping  {:.15e} N s/m^(p+1)\n\
         deepest penetration {:.15e} m\n\
         restitution         {:.15}\n\
         peak force          {:.15e} N\n\
         duration            {:.15e} s\n\
         energy lost         {:.15e} J\n\
         impulse             {:.15e} N s\n",
        f.hysteresis_damping, f.deepest, f.restitution, f.peak_force, f.duration, f.energy_lost, f.impulse
    )
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let mu = match a.restitution {
        Some(e) => hysteresis_damping(e, a.speed, a.stiffness, Formula::Exact)
            .ok_or_else(|| anyhow!("a restitution of {e} cannot be had; give a value above 0 and up to 1, and a positive speed and stiffness"))?,
        None => a.damping.unwrap_or(0.0),
    };
    let i = impact(a.mass, a.speed, a.stiffness, a.exponent, mu)
        .ok_or_else(|| anyhow!("mass, speed, stiffness and exponent have to be positive, the damping not negative"))?;
    let figures = Figures {
        hysteresis_damping: mu,
        deepest: i.deepest,
        restitution: i.restitution,
        peak_force: i.peak_force,
        duration: i.duration,
        energy_lost: i.energy_lost,
        impulse: i.impulse,
    };
    print::answer(&a.form.of(&figures, words)?)?;
    Ok(ExitCode::SUCCESS)
}
