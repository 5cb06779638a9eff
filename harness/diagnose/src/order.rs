//! Whether the stiffness of a contact follows the order of the recordings: a course of any shape has the name of its class,
//! hardening or softening, whatever else the simulation lacks. No law is needed: an impact of a law k x^p at a speed v lasts
//! (m / k)^(1/(p + 1)) v^((1 - p)/(1 + p)) times a number (Hertz 1882; Johnson 1985, 11.4), so that ln of the stiffness and ln of
//! the speed add up to ln of the duration.

use crate::evidence::ln_sum;
use estimate::problem::{Data, Record};
use mechanisms::mechanism::Mechanism;
use record::Channel;
use statrs::distribution::{ContinuousCDF, StudentsT};
use statrs::function::gamma::ln_gamma;

/// The mechanism that a stiffness which follows the order is the class of.
#[derive(Clone, Copy)]
pub struct Trend {
    pub mechanism: &'static Mechanism,
    /// That the stiffness follows the order this way.
    pub probability: f64,
    /// Change of ln stiffness from the first recording to the last, of a contact k x, 1.
    pub change: f64,
}

/// One recording: its level, the recordings before it, ln of its change of momentum or speed and of its duration.
#[derive(Clone, Copy, Debug)]
struct Pulse {
    level: usize,
    before: f64,
    ln_impulse: f64,
    ln_duration: f64,
}

impl Pulse {
    /// The first impact of a recording, by the channel that reads its force or acceleration; None where none does.
    fn new(r: &Record) -> Option<Pulse> {
        let read = |channel: Channel| r.y[channel.index()].as_deref().map(|y| (y, &r.weight[channel.index()]));
        let (y, weight) = read(Channel::Force).or_else(|| read(Channel::Acceleration))?;
        let counts = |i: usize| weight[i] > 0.0 && y[i].is_finite();
        let top = (0..y.len()).filter(|i| counts(*i)).max_by(|a, b| y[*a].abs().total_cmp(&y[*b].abs()))?;
        let (sign, foot) = (y[top].signum(), FOOT * y[top].abs());
        let is_outside = |i: &usize| sign * y[*i] < foot;
        let first = (0..top).rev().find(is_outside)?;
        let last = (top..y.len()).find(is_outside).unwrap_or(y.len() - 1);
        let (mut sum, mut squares) = (0.0, 0.0);
        for i in first..last {
            let (a, b, dt) = (sign * y[i], sign * y[i + 1], r.setup.time[i + 1] - r.setup.time[i]);
            // of an interval that a straight line crosses the foot in, what is above it
            let above = if a.min(b) < foot { (a.max(b) - foot) / (a - b).abs() } else { 1.0 };
            let (a, b, dt) = (a.max(foot), b.max(foot), above * dt);
            sum += 0.5 * dt * (a + b);
            squares += dt * (a * a + a * b + b * b) / 3.0;
        }
        let (impulse, duration) = (sum, sum * sum / squares);
        let known = impulse > 0.0 && duration.is_finite();
        known.then(|| Pulse {
            level: r.level,
            before: r.setup.history.recordings,
            ln_impulse: impulse.ln(),
            ln_duration: duration.ln(),
        })
    }
}

/// Share of its largest reading below which a pulse has not begun, or is over.
const FOOT: f64 = 0.1;

/// Courses that a stiffness may follow with the count of recordings before, each as likely beforehand: in proportion, by a power
/// (Andrade 1910), by the logarithm, and towards an end (Morrow 1965).
const COURSES: [fn(f64) -> f64; 4] = [|n| n, f64::sqrt, f64::ln_1p, |n| n / (n + 3.0)];

/// The course with order that the stiffness follows, its ln prior over that of none being `ln_prior`; None where the recordings have
/// no order, or are too few.
pub fn trend(data: &Data, ln_prior: f64) -> Option<Trend> {
    let all: Option<Vec<Pulse>> = data.records.iter().map(Pulse::new).collect();
    follows(&all?, ln_prior)
}

/// The course of stiffness with order in `all`, by Bayes factors against recordings whose stiffness scatters alone; how much it
/// scatters, and how the duration goes with the speed, is taken from them. Nothing is known from one level to another.
fn follows(all: &[Pulse], ln_prior: f64) -> Option<Trend> {
    let levels = distinct(all.iter().map(|o| o.level));
    let speed = centred(all, |o| o.ln_impulse);
    let scatters = speed.as_ref().is_some_and(|z| dot(z, z) > 1e-12);
    let freedom = all.len() as f64 - levels as f64 - f64::from(u8::from(scatters));
    if freedom < 3.0 {
        return None;
    }
    let alone = |v: Vec<f64>| match &speed {
        Some(z) if scatters => {
            let share = dot(&v, z) / dot(z, z);
            v.iter().zip(z).map(|(v, z)| v - share * z).collect()
        }
        _ => v,
    };
    let y = alone(centred(all, |o| -2.0 * o.ln_duration)?);
    let whole = dot(&y, &y);
    let of = |course: &fn(f64) -> f64| {
        let x = alone(centred(all, |o| course(o.before))?);
        let (xx, xy) = (dot(&x, &x), dot(&x, &y));
        if xx <= 0.0 || whole <= 0.0 {
            return None;
        }
        let left = (1.0 - xy * xy / (xx * whole)).max(LEAST_LEFT);
        let slope = xy / xx;
        let sd = (left * whole / (freedom - 1.0) / xx).sqrt();
        let rises = StudentsT::new(0.0, 1.0, freedom - 1.0).ok()?.cdf(slope / sd);
        let (first, last) = all.iter().fold((f64::MAX, 0.0f64), |(a, b), o| (a.min(o.before), b.max(o.before)));
        Some((ln_bayes_factor(all.len() as f64, freedom, left), rises, slope * (course(last) - course(first))))
    };
    let courses: Vec<(f64, f64, f64)> = COURSES.iter().filter_map(of).collect();
    let most = courses.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0))?;
    let odds = courses.iter().map(|c| c.0.exp()).sum::<f64>() / COURSES.len() as f64 * ln_prior.exp();
    let probability = if odds.is_finite() { odds / (1.0 + odds) } else { 1.0 };
    let (name, way) = if most.1 >= 0.5 { ("cyclic_hardening", most.1) } else { ("cyclic_softening", 1.0 - most.1) };
    Some(Trend { mechanism: mechanisms::named(name)?, probability: probability * way, change: most.2 })
}

/// Least share of what recordings differ by that a course leaves: no stiffness is known better.
const LEAST_LEFT: f64 = 1e-6;

/// A number of each recording less its level's mean; None where one is not finite.
fn centred(all: &[Pulse], of: impl Fn(&Pulse) -> f64) -> Option<Vec<f64>> {
    let mean = |level: usize| {
        let own: Vec<f64> = all.iter().filter(|o| o.level == level).map(&of).collect();
        own.iter().sum::<f64>() / own.len() as f64
    };
    let v: Vec<f64> = all.iter().map(|o| of(o) - mean(o.level)).collect();
    v.iter().all(|v| v.is_finite()).then_some(v)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn distinct(levels: impl Iterator<Item = usize>) -> usize {
    let mut v: Vec<usize> = levels.collect();
    v.sort_unstable();
    v.dedup();
    v.len()
}

/// ln Bayes factor of a straight line against none, of `n` points with so many degrees of freedom before it, which leaves the share
/// `left` of their squares (Zellner and Siow 1980; Liang et al. 2008, eq. 16: a Cauchy prior on the slope over the scatter, which is
/// integrated out).
fn ln_bayes_factor(n: f64, freedom: f64, left: f64) -> f64 {
    let ln = |u: f64| {
        let g = u.exp();
        0.5 * (freedom - 1.0) * g.ln_1p() - 0.5 * freedom * (left * g).ln_1p() - 0.5 * u - 0.5 * n / g
    };
    const STEP: f64 = 0.05;
    let each: Vec<f64> = (0..1200).map(|i| ln(-10.0 + STEP * f64::from(i))).collect();
    ln_sum(&each) + STEP.ln() + 0.5 * (0.5 * n).ln() - ln_gamma(0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};

    const PRIOR: f64 = -2.0;

    fn ten(ln_stiffness: impl FnMut(usize) -> f64) -> Vec<Pulse> {
        let own = (0..10).zip((0..10).map(ln_stiffness).collect::<Vec<_>>());
        own.map(|(i, y)| Pulse { level: 0, before: i as f64, ln_impulse: 0.0, ln_duration: -0.5 * y }).collect()
    }

    /// Noise of unit variance, or near it.
    fn noise(rng: &mut impl Rng) -> f64 {
        (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
    }

    #[test]
    fn a_line_without_a_slope_is_unlikely_and_one_that_leaves_little_is_likely() {
        assert!(ln_bayes_factor(10.0, 9.0, 1.0) < 0.0);
        assert!(ln_bayes_factor(10.0, 9.0, 0.02) > 5.0);
        // Rouder et al. 2009, the one-sample form: t = 2.24 of 80 gives 1.56 for the alternative, without its width of 1/sqrt 2
        let (t, n) = (2.24f64, 80.0f64);
        let factor = ln_bayes_factor(n, n - 1.0, 1.0 / (1.0 + t * t / (n - 2.0))).exp();
        assert!((0.5..2.0).contains(&factor), "{factor}");
    }

    #[test]
    fn a_stiffness_that_grows_with_the_order_is_hardening_and_one_that_falls_is_softening() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        for (way, name) in [(0.01, "cyclic_hardening"), (-0.01, "cyclic_softening")] {
            let t = follows(&ten(|i| way * i as f64 + 2e-3 * noise(&mut rng)), PRIOR).unwrap();
            assert_eq!(t.mechanism.name, name);
            assert!(t.probability > 0.99 && (t.change / (9.0 * way) - 1.0).abs() < 0.2, "{} {}", t.probability, t.change);
        }
    }

    #[test]
    fn of_a_hundred_campaigns_that_scatter_hardly_one_follows_the_order() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(2);
        let mut likely = 0;
        for _ in 0..100 {
            likely += usize::from(follows(&ten(|_| 0.02 * noise(&mut rng)), PRIOR).unwrap().probability > 0.5);
        }
        assert!(likely <= 3, "{likely}");
    }

    #[test]
    fn what_goes_with_the_speed_or_from_level_to_level_follows_no_order() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        let mut of_speed = ten(|i| 0.01 * i as f64 + 1e-3 * noise(&mut rng));
        of_speed.iter_mut().for_each(|o| o.ln_impulse = 0.1 * o.before + 0.01 * noise(&mut rng));
        assert!(follows(&of_speed, PRIOR).unwrap().probability < 0.5);
        let mut by_level = ten(|i| if i < 5 { 0.0 } else { 0.1 } + 1e-3 * noise(&mut rng));
        by_level.iter_mut().for_each(|o| o.level = usize::from(o.before >= 5.0));
        assert!(follows(&by_level, PRIOR).unwrap().probability < 0.5);
        assert!(follows(&by_level[..4], PRIOR).is_none());
    }
}
