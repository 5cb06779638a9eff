//! The exact impact of a mass on the law F = k x^p + mu_d x^p v.

use anyhow::{anyhow, ensure, Result};
use law::impact::impact;
use law::restitution::{hysteresis_damping, Formula};
use serde::Serialize;

/// The impact.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// kg
    pub mass: f64,
    /// Speed at touch, m/s
    pub speed: f64,
    /// k, N/m^p
    pub stiffness: f64,
    /// p
    pub exponent: f64,
    /// mu_d, N s/m^(p+1); None: none.
    pub damping: Option<f64>,
    /// Wanted restitution in place of a damping, above 0 and up to 1.
    pub restitution: Option<f64>,
}

/// What it comes to, SI.
#[derive(Serialize)]
pub struct Figures {
    /// N s/m^(p+1)
    pub hysteresis_damping: f64,
    /// Deepest penetration, m
    pub deepest: f64,
    /// Speed after over speed before
    pub restitution: f64,
    /// N
    pub peak_force: f64,
    /// s
    pub duration: f64,
    /// J
    pub energy_lost: f64,
    /// N s
    pub impulse: f64,
}

/// The same for a terminal.
pub fn words(f: &Figures) -> String {
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

/// Works an impact out.
///
/// # Errors
/// A value out of its range.
pub fn figures(o: &Options) -> Result<Figures> {
    let mu = match o.restitution {
        Some(e) => hysteresis_damping(e, o.speed, o.stiffness, Formula::Exact)
            .ok_or_else(|| anyhow!("a restitution of {e} cannot be had; give a value above 0 and up to 1, and a positive speed and stiffness"))?,
        None => o.damping.unwrap_or(0.0),
    };
    let i = impact(o.mass, o.speed, o.stiffness, o.exponent, mu)
        .ok_or_else(|| anyhow!("mass, speed, stiffness and exponent have to be positive, the damping not negative"))?;
    let all = [mu, i.deepest, i.restitution, i.peak_force, i.duration, i.energy_lost, i.impulse];
    ensure!(
        all.iter().all(|v| v.is_finite()),
        "the impact is beyond what numbers hold; look at the units of mass, speed and stiffness"
    );
    Ok(Figures {
        hysteresis_damping: mu,
        deepest: i.deepest,
        restitution: i.restitution,
        peak_force: i.peak_force,
        duration: i.duration,
        energy_lost: i.energy_lost,
        impulse: i.impulse,
    })
}
