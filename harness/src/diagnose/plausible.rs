//! Whether channels and speeds agree at all: a wrong unit is no physics.

use super::prepare::Invalid;
use crate::model::estimate::Data;
use crate::record::{Campaign, Kind};

/// Factor beyond which two measurements of one thing are in different units: the smallest step between neighbouring
/// SI prefixes is 1000, g and m/s^2 differ by 9.8, mm and cm by 10.
const APART: f64 = 6.0;

fn refused(file: &str, what: String, cure: &str) -> Invalid {
    Invalid(format!("{file}: {what}; {cure}"))
}

/// Checks force against mass times acceleration, and acceleration against the speed of the impact.
///
/// # Errors
/// Names the recording, what disagrees and by what factor, and the cure.
pub fn check(c: &Campaign, data: &Data) -> Result<(), Invalid> {
    if c.kind == Kind::Indentation {
        return Ok(());
    }
    for rec in &data.records {
        let n = rec.setup.time.len();
        let quiet = (n / 20).max(4);
        let centred = |y: &[f64]| -> Vec<f64> {
            let mut start = y[..quiet].to_vec();
            start.sort_by(f64::total_cmp);
            y.iter().map(|v| v - start[quiet / 2]).collect()
        };
        if let (Some(f), Some(a)) = (&rec.y[0], &rec.y[1]) {
            let (f, a) = (centred(f), centred(a));
            let mut sorted = f.clone();
            sorted.sort_by(f64::total_cmp);
            // the middle of the ratios while the push is strong: a spike does not move it
            let strong = 0.3 * sorted[n - 1 - n / 100];
            let mut ratios: Vec<f64> = f
                .iter()
                .zip(&a)
                .filter(|(f, _)| **f > strong)
                .map(|(f, a)| f / (-data.mass * a))
                .filter(|q| q.is_finite())
                .collect();
            ratios.sort_by(f64::total_cmp);
            if ratios.len() >= 5 {
                let ratio = ratios[ratios.len() / 2];
                if ratio < 0.0 && ratios[ratios.len() * 9 / 10] < 0.0 {
                    return Err(refused(
                        &rec.file,
                        "acceleration is positive while the stop pushes back".into(),
                        "turn the sign of acceleration (negative while the stop pushes) or of force",
                    ));
                }
                if ratio > 0.0 && !(1.0 / APART..=APART).contains(&ratio) {
                    return Err(refused(
                        &rec.file,
                        format!("force is {ratio:.3e} times mass times acceleration"),
                        "correct the unit of force or acceleration in its header, or moving_mass (kg) in campaign.toml",
                    ));
                }
            }
        }
        let Some((v, _)) = rec.speed else { continue };
        if let Some(x) = &rec.y[2] {
            // from the start to 0.8 of the deepest point the body covers that distance at most at impact speed
            let deep = x.iter().cloned().fold(f64::MIN, f64::max);
            let reach = x[0] + 0.8 * (deep - x[0]);
            if let Some(i) = x.iter().position(|x| *x >= reach) {
                let t = rec.setup.time[i] - rec.setup.time[0];
                let ratio = (x[i] - x[0]) / (v * t).max(1e-300);
                if i > 4 && !(1.0 / (3.0 * APART)..=APART).contains(&ratio) {
                    return Err(refused(
                        &rec.file,
                        format!("penetration moves {ratio:.3e} times as fast as the speed given, {v} m/s"),
                        "correct the unit of penetration or time in its header, or the speed (m/s) in campaign.toml",
                    ));
                }
            }
        }
        if let Some(a) = rec.y[1].as_ref().filter(|_| rec.y[0].is_none()) {
            let a = centred(a);
            let dt = (rec.setup.time[n - 1] - rec.setup.time[0]) / (n - 1) as f64;
            let mut speed: f64 = 0.0;
            let mut most: f64 = 0.0;
            for u in &a {
                speed -= u * dt;
                most = most.max(speed);
            }
            let ratio = most / v.max(1e-300);
            if !(0.1 / APART..=2.0 * APART).contains(&ratio) {
                return Err(refused(
                    &rec.file,
                    format!("acceleration adds up to {ratio:.3e} times the speed given, {v} m/s"),
                    "correct the unit of acceleration or time in its header, or the speed (m/s) in campaign.toml",
                ));
            }
        }
    }
    Ok(())
}
