//! Whether the stiffness of a contact follows the order of the recordings: a course of any shape has the name of its class,
//! hardening or softening, whatever else the simulation lacks. No law is needed: an impact of a law k x^p at a speed v lasts
//! (m / k)^(1/(p + 1)) v^((1 - p)/(1 + p)) times a number (Hertz 1882; Johnson 1985, 11.4), so that ln of the stiffness and ln of
//! the speed add up to ln of the duration.

use crate::evidence::ln_sum;
use crate::learned::{Named, Size};
use crate::least_squares::residual;
use crate::pulse::Pulse;
use estimate::problem::{Data, Record};
use mechanisms::mechanism::Mechanism;
use plant::kernels::dot;
use record::Channel;
use statrs::distribution::{ContinuousCDF, StudentsT};
use statrs::function::gamma::ln_gamma;
use std::collections::BTreeSet;

/// The mechanism that a stiffness which follows the order is the class of.
#[derive(Clone, Copy)]
pub struct Trend {
    pub mechanism: &'static Mechanism,
    /// That the stiffness follows the order this way.
    pub probability: f64,
    /// Change of ln stiffness from the first recording to the last, of a contact k x, with its 95 % interval, 1.
    pub change: f64,
    pub ci95: [f64; 2],
}

impl Trend {
    /// It as a name without a form, with its probability and its share of action by phase.
    pub fn named(&self, probability: f64, shares: [f64; 4]) -> Named {
        let size = Size {
            name: "change_of_stiffness",
            value: self.change.exp_m1(),
            unit: "1",
            ci95: Some(self.ci95.map(f64::exp_m1)),
            by: "Student's t",
        };
        let mechanism = self.mechanism;
        Named { mechanism, probability, also_possible: Vec::new(), size, cure: mechanism.cure, shares }
    }
}

/// One recording: its level, the recordings before it, ln of its change of momentum or speed and of its duration.
#[derive(Clone, Copy, Debug)]
struct Impact {
    level: usize,
    before: f64,
    ln_impulse: f64,
    ln_duration: f64,
}

impl Impact {
    /// The first of a recording, by the channel that reads its force or acceleration; None where none does.
    fn new(r: &Record) -> Option<Impact> {
        let pulse = Pulse::new(r, Channel::Force).or_else(|| Pulse::new(r, Channel::Acceleration))?;
        Some(Impact {
            level: r.level,
            before: r.setup.history.recordings,
            ln_impulse: pulse.impulse.abs().ln(),
            ln_duration: pulse.duration.ln(),
        })
    }
}

/// Courses that a stiffness may follow with the count of recordings before, each as likely beforehand: in proportion, by a power
/// (Andrade 1910), by the logarithm, and towards an end (Morrow 1965).
const COURSES: [fn(f64) -> f64; 4] = [|n| n, f64::sqrt, f64::ln_1p, |n| n / (n + 3.0)];

/// The course with order that the stiffness follows, its ln prior over that of none being `ln_prior`; None where the recordings have
/// no order, or are too few.
pub fn trend(data: &Data, ln_prior: f64) -> Option<Trend> {
    let all: Option<Vec<Impact>> = data.records.iter().map(Impact::new).collect();
    follows(&all?, ln_prior)
}

/// The course of stiffness with order in `all`, by Bayes factors against recordings whose stiffness scatters alone; how much it
/// scatters, and how the duration goes with the speed, is taken from them. Nothing is known from one level to another.
fn follows(all: &[Impact], ln_prior: f64) -> Option<Trend> {
    let levels: BTreeSet<usize> = all.iter().map(|o| o.level).collect();
    let speed: Vec<Vec<f64>> = centred(all, |o| o.ln_impulse).filter(|z| dot(z, z) > ONE_SPEED).into_iter().collect();
    let freedom = all.len() as f64 - levels.len() as f64 - speed.len() as f64;
    if freedom < 3.0 {
        return None;
    }
    let y = residual(&centred(all, |o| -2.0 * o.ln_duration)?, &speed);
    let whole = dot(&y, &y);
    let of = |course: &fn(f64) -> f64| {
        let x = residual(&centred(all, |o| course(o.before))?, &speed);
        let (xx, xy) = (dot(&x, &x), dot(&x, &y));
        if xx <= 0.0 || whole <= 0.0 {
            return None;
        }
        let left = (1.0 - xy * xy / (xx * whole)).max(LEAST_LEFT);
        let slope = xy / xx;
        let sd = (left * whole / (freedom - 1.0) / xx).sqrt();
        let student = StudentsT::new(0.0, 1.0, freedom - 1.0).ok()?;
        let (first, last) = all.iter().fold((f64::MAX, 0.0f64), |(a, b), o| (a.min(o.before), b.max(o.before)));
        let whole_course = course(last) - course(first);
        let change = |t: f64| (slope + t * sd) * whole_course;
        let t = student.inverse_cdf(0.975);
        Some(Along {
            ln_factor: ln_bayes_factor(all.len() as f64, freedom, left),
            rises: student.cdf(slope / sd),
            change: change(0.0),
            ci95: [change(-t), change(t)],
        })
    };
    let courses: Vec<Along> = COURSES.iter().filter_map(of).collect();
    let most = courses.iter().max_by(|a, b| a.ln_factor.total_cmp(&b.ln_factor))?;
    let factors: Vec<f64> = courses.iter().map(|c| c.ln_factor).collect();
    let ln_odds = ln_sum(&factors) - (COURSES.len() as f64).ln() + ln_prior;
    let (name, way) =
        if most.rises >= 0.5 { ("cyclic_hardening", most.rises) } else { ("cyclic_softening", 1.0 - most.rises) };
    let probability = way / (1.0 + (-ln_odds).exp());
    Some(Trend { mechanism: mechanisms::named(name)?, probability, change: most.change, ci95: most.ci95 })
}

/// A course along which the stiffness may go.
struct Along {
    /// ln of its Bayes factor against none.
    ln_factor: f64,
    /// That the stiffness rises along it, given that it goes along it.
    rises: f64,
    /// Change of ln stiffness from the first recording to the last, and its 95 % interval.
    change: f64,
    ci95: [f64; 2],
}

/// Least share of the squares of a course's residual, where recordings without any noise would leave none.
const LEAST_LEFT: f64 = 1e-6;
/// Sum of squares of ln of the impulses up to which all count as one: rounding alone.
const ONE_SPEED: f64 = 1e-12;

/// A number of each recording less its level's mean; None where one is not finite.
fn centred(all: &[Impact], of: impl Fn(&Impact) -> f64) -> Option<Vec<f64>> {
    let mean = |level: usize| {
        let own: Vec<f64> = all.iter().filter(|o| o.level == level).map(&of).collect();
        own.iter().sum::<f64>() / own.len() as f64
    };
    let v: Vec<f64> = all.iter().map(|o| of(o) - mean(o.level)).collect();
    v.iter().all(|v| v.is_finite()).then_some(v)
}

/// ln Bayes factor of a straight line against none, of `n` points with so many degrees of freedom before it, which leaves the share
/// `left` of their squares (Zellner and Siow 1980; Liang et al. 2008, eq. 16: a Cauchy prior on the slope over the scatter, which is
/// integrated out).
fn ln_bayes_factor(n: f64, freedom: f64, left: f64) -> f64 {
    let ln = |u: f64| {
        let g = u.exp();
        0.5 * (freedom - 1.0) * g.ln_1p() - 0.5 * freedom * (left * g).ln_1p() - 0.5 * u - 0.5 * n / g
    };
    // steps of the integral over ln g: the integrand changes over one or two
    const STEP: f64 = 0.05;
    let each: Vec<f64> = (0..1200).map(|i| ln(-10.0 + STEP * f64::from(i))).collect();
    ln_sum(&each) + STEP.ln() + 0.5 * (0.5 * n).ln() - ln_gamma(0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// As the calibrated table has it.
    const PRIOR: f64 = -2.0;

    fn ten(ln_stiffness: impl FnMut(usize) -> f64) -> Vec<Impact> {
        let own = (0..10).zip((0..10).map(ln_stiffness).collect::<Vec<_>>());
        own.map(|(i, y)| Impact { level: 0, before: i as f64, ln_impulse: 0.0, ln_duration: -0.5 * y }).collect()
    }

    /// Noise of unit variance, or near it.
    fn noise(rng: &mut ChaCha8Rng) -> f64 {
        (0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0
    }

    #[test]
    fn a_line_without_a_slope_is_unlikely_and_one_that_leaves_little_is_likely() {
        assert!(ln_bayes_factor(10.0, 9.0, 1.0) < 0.0);
        assert!(ln_bayes_factor(10.0, 9.0, 0.02) > 5.0);
        // Rouder et al. 2009: t = 2.03 of 80 observations makes the null 1.56 times as likely
        let (t, n) = (2.03f64, 80.0f64);
        let factor = ln_bayes_factor(n, n, 1.0 / (1.0 + t * t / (n - 1.0))).exp();
        assert!((1.0 / factor - 1.56).abs() < 0.01, "{factor}");
    }

    #[test]
    fn a_stiffness_that_grows_with_the_order_is_hardening_and_one_that_falls_is_softening() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for (way, name) in [(0.01, "cyclic_hardening"), (-0.01, "cyclic_softening")] {
            let t = follows(&ten(|i| way * i as f64 + 2e-3 * noise(&mut rng)), PRIOR).unwrap();
            assert_eq!(t.mechanism.name, name);
            assert!(
                t.probability > 0.99 && (t.change / (9.0 * way) - 1.0).abs() < 0.2,
                "{} {}",
                t.probability,
                t.change
            );
        }
    }

    #[test]
    fn of_a_hundred_campaigns_that_scatter_hardly_one_follows_the_order() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut likely = 0;
        for _ in 0..100 {
            likely += usize::from(follows(&ten(|_| 0.02 * noise(&mut rng)), PRIOR).unwrap().probability > 0.5);
        }
        assert!(likely <= 3, "{likely}");
    }

    #[test]
    fn what_goes_with_the_speed_or_from_level_to_level_follows_no_order() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut of_speed = ten(|i| 0.01 * i as f64 + 1e-3 * noise(&mut rng));
        of_speed.iter_mut().for_each(|o| o.ln_impulse = 0.1 * o.before + 0.01 * noise(&mut rng));
        assert!(follows(&of_speed, PRIOR).unwrap().probability < 0.5);
        let mut by_level = ten(|i| if i < 5 { 0.0 } else { 0.1 } + 1e-3 * noise(&mut rng));
        by_level.iter_mut().for_each(|o| o.level = usize::from(o.before >= 5.0));
        assert!(follows(&by_level, PRIOR).unwrap().probability < 0.5);
        assert!(follows(&by_level[..3], PRIOR).is_none());
    }

    #[test]
    fn a_campaign_whose_contact_hardens_says_so_by_its_pulses_and_one_whose_contact_stays_does_not() {
        let of = |share: f64| {
            let dir = tempfile::tempdir().unwrap();
            let mut recipe = plant::recipe::Recipe::default();
            let course = mechanisms::wear::Course::Linear;
            recipe.physics.cyclic_hardening.0 =
                mechanisms::wear::CyclicChange { share, course, ..mechanisms::wear::CyclicChange::default() };
            plant::recipe::write_campaign(dir.path(), &recipe).unwrap();
            // of one level, so that the durations at all speeds are held against each other
            let listed = dir.path().join("campaign.toml");
            let text = std::fs::read_to_string(&listed).unwrap();
            std::fs::write(&listed, text.replace("[[recording]]\n", "[[recording]]\nlevel = 1\n")).unwrap();
            let campaign = record::load(dir.path(), &mechanisms::terms()).unwrap();
            trend(&estimate::prepare::Prepared::new(&campaign).unwrap().data, PRIOR).unwrap()
        };
        let found = of(0.5);
        assert_eq!(found.mechanism.name, "cyclic_hardening");
        assert!(found.probability > 0.8 && found.ci95[0] > 0.0, "{} {:?}", found.probability, found.ci95);
        assert!(of(0.0).probability < 0.5, "{}", of(0.0).probability);
    }
}
