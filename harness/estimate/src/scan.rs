//! A start without a guess: for a fixed exponent the force is linear in k and mu_d.

use crate::problem::Data;
use crate::smooth::smooth;
use mechanisms::physics::GRAVITY;
use plant::squares::TwoTerms;
use record::{Channel, Kind};

/// The exponents tried.
const FIRST: f64 = 0.9;
const LAST: f64 = 4.0;
const STEP: f64 = 0.05;

/// (k N/m^p, p, mu_d N s/m^(p+1)) by a scan over p from 0.9 to 4, with least squares on the two columns x^p and
/// x^p v at each; mu_d = 0 where `hysteresis` is false or the squares want it negative.
///
/// None where no recording holds penetration together with force or acceleration, or nothing sinks in.
pub fn scan(data: &Data, hysteresis: bool) -> Option<(f64, f64, f64)> {
    let s = data.scales;
    let mut samples: Vec<(f64, f64, f64)> = Vec::new();
    for r in &data.records {
        let (Some(x), n) = (&r.y[Channel::Penetration.index()], r.setup.time.len()) else { continue };
        let quiet = |y: &[f64]| {
            let mut v = y[..(n / 20).max(4).min(n)].to_vec();
            v.sort_by(f64::total_cmp);
            v[v.len() / 2]
        };
        let push: Vec<f64> = match (&r.y[Channel::Force.index()], &r.y[Channel::Acceleration.index()]) {
            (Some(f), _) => {
                let zero = quiet(f);
                f.iter().map(|v| v - zero).collect()
            }
            (None, Some(a)) if data.kind != Kind::Indentation => {
                let zero = quiet(a).clamp(-0.5 * GRAVITY, 0.5 * GRAVITY);
                a.iter().map(|v| data.mass * (zero - v)).collect()
            }
            _ => continue,
        };
        let (depth, speed) = if data.kind == Kind::Indentation {
            (r.setup.imposed.clone(), r.setup.imposed_rate.clone())
        } else {
            let dt = (r.setup.time[n - 1] - r.setup.time[0]) / (n - 1) as f64;
            let (d, v) = smooth(x, data.noise[Channel::Penetration.index()].low_frequency());
            (d, v.iter().map(|v| v / dt).collect())
        };
        // shallow samples say more of the zero of the scale than of the law
        let deep = depth.iter().cloned().fold(0.0, f64::max);
        for i in 0..n {
            if depth[i] > 0.15 * deep && push[i].is_finite() {
                samples.push((depth[i] / s.x_ref, speed[i] / s.v_ref, push[i]));
            }
        }
    }
    if samples.len() < 8 {
        return None;
    }
    let mut best: Option<(f64, f64, f64, f64)> = None;
    for i in 0..=((LAST - FIRST) / STEP).round() as usize {
        let p = FIRST + STEP * i as f64;
        let row = |(x, v, f): &(f64, f64, f64)| {
            let a = x.powf(p);
            (a, a * v, *f)
        };
        let sums: TwoTerms = samples.iter().map(row).collect();
        let c = sums.both(1e-9).filter(|c| hysteresis && c.1 > 0.0).unwrap_or(sums.first());
        let rest = sums.rest(c);
        if c.0 > 0.0 && best.is_none_or(|b| rest < b.0) {
            best = Some((rest, c.0, p, c.1));
        }
    }
    let (_, f, p, g) = best?;
    let unit = s.x_ref.powf(p);
    Some((f / unit, p, g / (unit * s.v_ref)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::condition::condition;
    use plant::recipe::{write_campaign, Recipe};

    #[test]
    fn the_scan_starts_near_the_law_that_was_simulated_and_needs_penetration_and_force() {
        let dir = tempfile::tempdir().unwrap();
        let recipe = Recipe::default();
        write_campaign(dir.path(), &recipe).unwrap();
        let mut data = condition(&record::load(dir.path(), &mechanisms::terms()).unwrap()).unwrap().data;
        let law = recipe.physics.law;
        let x = data.scales.x_ref;
        let (k, p, mu) = scan(&data, true).unwrap();
        assert!((p - law.elastic.exponent).abs() < 0.15, "{p}");
        assert!((k * x.powf(p) / (law.elastic.stiffness * x.powf(law.elastic.exponent)) - 1.0).abs() < 0.1, "{k}");
        assert!((mu / k * law.elastic.stiffness / law.hysteresis_damping.coefficient - 1.0).abs() < 0.3, "{mu}");
        assert_eq!(scan(&data, false).unwrap().2, 0.0);
        data.records.iter_mut().for_each(|r| r.y[Channel::Penetration.index()] = None);
        assert!(scan(&data, true).is_none());
    }
}
