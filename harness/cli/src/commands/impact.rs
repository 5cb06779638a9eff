//! `touchdown impact`.

use super::form::Form;
use crate::print;
use crate::tasks::impact::{figures, words, Options};
use anyhow::Result;
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

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let o = Options {
        mass: a.mass,
        speed: a.speed,
        stiffness: a.stiffness,
        exponent: a.exponent,
        damping: a.damping,
        restitution: a.restitution,
    };
    print::answer(&a.form.of(&figures(&o)?, words)?)?;
    Ok(ExitCode::SUCCESS)
}
