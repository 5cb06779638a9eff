//! `touchdown impact`.

use anyhow::{anyhow, Result};
use law::impact::impact;
use law::restitution::{hysteresis_damping, Formula};
use std::process::ExitCode;

#[derive(clap::Args)]
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
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let mu = match a.restitution {
        Some(e) => hysteresis_damping(e, a.speed, a.stiffness, Formula::Exact)
            .ok_or_else(|| anyhow!("a restitution of {e} cannot be had; give a value above 0 and up to 1, and a positive speed and stiffness"))?,
        None => a.damping.unwrap_or(0.0),
    };
    let i = impact(a.mass, a.speed, a.stiffness, a.exponent, mu)
        .ok_or_else(|| anyhow!("mass, speed, stiffness and exponent have to be positive, the damping not negative"))?;
    println!("hysteresis damping  {mu:.15e} N s/m^(p+1)");
    println!("deepest penetration {:.15e} m", i.deepest);
    println!("restitution         {:.15}", i.restitution);
    println!("peak force          {:.15e} N", i.peak_force);
    println!("duration            {:.15e} s", i.duration);
    println!("energy lost         {:.15e} J", i.energy_lost);
    println!("impulse             {:.15e} N s", i.impulse);
    Ok(ExitCode::SUCCESS)
}
