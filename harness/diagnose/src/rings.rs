//! Whether a body or its transducer rings on when nothing touches any more: damped oscillations in the acceleration after the impact,
//! that follow the impact alike in every recording. Nothing of the contact makes them, whatever its law; they are the class of what
//! swings on the body or in the transducer. A force that is read in flight tells less: it may be of a touch that the simulation has
//! at another time.

use crate::learned::{Named, Size};
use crate::least_squares::{project_out, residual};
use crate::pulse::Pulse;
use estimate::fitted::Fitted;
use mechanisms::mechanism::Mechanism;
use plant::kernels::dot;
use rayon::prelude::*;
use record::Channel;
use std::collections::BTreeMap;
use std::f64::consts::PI;

/// Oscillations that go on after the contact.
#[derive(Clone, Debug, PartialEq)]
pub struct Rings {
    /// ln of its Bayes factor against a flight without any.
    pub ln_factor: f64,
    /// Its modes, the strongest first.
    pub modes: Vec<Mode>,
}

/// A mode that rings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// Frequency with its 95 % interval, Hz.
    pub frequency: f64,
    pub ci95: [f64; 2],
}

/// Cure of an oscillation whose frequency is known and whose mass is not.
const CURE: &str =
    "The contact element is right; find what swings at this frequency and fasten it, or hang a mass with this \
                        frequency on the body in the rig's model.";
/// Half of the 95 % quantile of chi squared of one degree of freedom, 3.841 (Wilks 1938).
const HALF_QUANTILE: f64 = 1.92;

impl Rings {
    /// That it rings at all, by numbers that laws are learned by.
    pub fn probability(&self, numbers: &learn::Numbers) -> f64 {
        let ln = numbers.class + self.ln_factor / numbers.temperature;
        1.0 / (1.0 + (-ln).exp())
    }

    /// It as `mechanism` without a form, with that one's probability and the others that it may be: after the contact it shows.
    pub fn named(&self, mechanism: &'static Mechanism, probability: f64, also_possible: Vec<&'static str>) -> Named {
        let (value, ci95) = self.modes.first().map_or((f64::NAN, None), |m| (m.frequency, Some(m.ci95)));
        let size = Size { name: "frequency", value, unit: "Hz", ci95, by: "likelihood" };
        Named { mechanism, probability, also_possible, size, cure: CURE, shares: [0.0, 0.0, 0.0, 1.0] }
    }
}

/// The reading of one flight over the impulse before it, and the time since the middle of that, in mean durations of the pulses.
struct Flight {
    level: usize,
    time: Vec<f64>,
    read: Vec<f64>,
}

/// Modes that are looked for at most: so many are told apart in twelve durations.
const MODES: usize = 3;
/// Length of a flight that is looked at, durations of the pulse: damped oscillations are clearest while young, and the slowest mode
/// of a rig that an impact excites has some periods in it.
const LONGEST: f64 = 12.0;
/// Fewest samples of a flight: twice what a parabola, a tail and three modes have parameters.
const LEAST: usize = 24;
/// Damping ratios of a mode that are tried.
const DAMPING: [f64; 5] = [0.005, 0.02, 0.05, 0.1, 0.2];
/// Times, in durations of the pulse, within which a reading may come back to its zero without ringing.
const TAILS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
/// Angular frequency up to which modes are looked for, 1 over a duration of the pulse: seven periods within it. Faster ones are
/// hardly excited by a pulse.
const HIGHEST: f64 = 45.0;
/// Standard deviations of its noise by which a force read in flight shows that the body still touches; one of 10^6 samples is so far
/// off by chance.
const PUSHES: f64 = 5.0;
/// Samples of a duration that are enough for that; of more, means are taken.
const ENOUGH: f64 = 30.0;

/// The oscillations in the acceleration read after the impacts that `f` simulates; None where there is no flight, or no oscillation.
pub fn rings(f: &Fitted) -> Option<Rings> {
    let (mut flights, mut durations) = (Vec::new(), Vec::new());
    for (flight, duration) in (0..f.data.records.len()).filter_map(|r| flight(f, r)) {
        flights.push(flight);
        durations.push(duration);
    }
    let mean = durations.iter().sum::<f64>() / durations.len() as f64;
    flights.iter_mut().flat_map(|f| &mut f.time).for_each(|t| *t /= mean);
    let (ln_factor, angular) = modes(&flights)?;
    let hertz = |w: f64| w / (2.0 * PI * mean);
    let mode = |[low, w, high]: [f64; 3]| Mode { frequency: hertz(w), ci95: [hertz(low), hertz(high)] };
    Some(Rings { ln_factor, modes: angular.into_iter().map(mode).collect() })
}

/// The flight after the first impact of recording `r`, until the simulation touches again, its time in s; with the duration of the
/// impact, s. Where the force is read, nothing counts as flight before it is over: a simulation may leave sooner than the body.
fn flight(f: &Fitted, r: usize) -> Option<(Flight, f64)> {
    let channel = Channel::Acceleration;
    let rec = &f.data.records[r];
    let pulse = Pulse::new(rec, channel)?;
    let (trace, simulated) = f.predict(r);
    let (time, y) = (&rec.setup.time, rec.y[channel.index()].as_deref()?);
    let weight = &rec.weight[channel.index()];
    // half of the impact once more is another one, wherever the simulation has it
    let again = |i: usize| y[i] * pulse.impulse.signum() > 0.5 * pulse.largest;
    let flies = |i: usize| trace.position[i] < 0.0 && !again(i);
    let first = (pulse.end..time.len()).find(|i| flies(*i))?;
    let end = (first..time.len()).find(|i| !flies(*i) || time[*i] > pulse.middle + LONGEST * pulse.duration);
    let end = end.unwrap_or(time.len());
    let at = Channel::Force.index();
    let noise = f.data.noise[at].marginal();
    let first = rec.y[at].as_deref().map_or(first, |force| {
        let pushes = |i: &usize| rec.weight[at][*i] > 0.0 && (force[*i] - simulated[at][*i]).abs() > PUSHES * noise;
        (first..end).rev().find(pushes).map_or(first, |last| last + 1)
    });
    let kept = (first..end).filter(|i| weight[*i] > 0.0 && y[*i].is_finite());
    let of = |i: usize| (time[i] - pulse.middle, y[i] * pulse.duration / pulse.impulse);
    let all: Vec<(f64, f64)> = kept.map(of).collect();
    let block = (pulse.duration / (ENOUGH * f.data.scales.dt)).max(1.0) as usize;
    let mean = |b: &[(f64, f64)]| {
        let n = b.len() as f64;
        (b.iter().map(|s| s.0).sum::<f64>() / n, b.iter().map(|s| s.1).sum::<f64>() / n)
    };
    let (time, read): (Vec<f64>, Vec<f64>) = all.chunks_exact(block).map(mean).unzip();
    (time.len() >= LEAST).then_some((Flight { level: rec.level, time, read }, pulse.duration))
}

/// Flights of one level: impacts alike, which what swings answers alike.
struct Alike<'a> {
    flights: Vec<&'a Flight>,
    /// Orthonormal polynomials of every flight.
    smooth: Vec<[Vec<f64>; 3]>,
}

impl<'a> Alike<'a> {
    fn new(flights: Vec<&'a Flight>) -> Alike<'a> {
        let smooth = |f: &&Flight| {
            let mut all: [Vec<f64>; 3] = std::array::from_fn(|p| f.time.iter().map(|t| t.powi(p as i32)).collect());
            for p in 0..3 {
                let (before, from) = all.split_at_mut(p);
                before.iter().for_each(|q| project_out(&mut from[0], q));
                let norm = dot(&from[0], &from[0]).sqrt();
                from[0].iter_mut().for_each(|v| *v /= norm);
            }
            all
        };
        Alike { smooth: flights.iter().map(smooth).collect(), flights }
    }

    /// A column over the flights, one after the other, whose values in a flight are those of `of`, without what a parabola of each
    /// flight explains.
    fn column(&self, of: impl Fn(&Flight) -> Vec<f64>) -> Vec<f64> {
        let alone = |(f, smooth): (&&Flight, &[Vec<f64>; 3])| {
            let mut v = of(f);
            smooth.iter().for_each(|q| project_out(&mut v, q));
            v
        };
        self.flights.iter().zip(&self.smooth).flat_map(alone).collect()
    }

    /// `y` of all flights as that of each.
    fn parted(&self, y: &[f64]) -> Vec<Vec<f64>> {
        let mut rest = y;
        let of = |f: &&Flight| {
            let (own, further) = rest.split_at(f.time.len());
            rest = further;
            own.to_vec()
        };
        self.flights.iter().map(of).collect()
    }

    /// Residual of the readings `y` after a mode of angular frequency `w` and damping ratio `zeta`.
    fn without_mode(&self, y: &[f64], w: f64, zeta: f64) -> Vec<f64> {
        let of = |phase: f64| {
            self.column(|f| f.time.iter().map(|t| (-zeta * w * t).exp() * (w * t - phase).cos()).collect())
        };
        residual(y, &[of(0.0), of(PI / 2.0)])
    }

    /// Residual of the readings `y` after a zero that comes back within `time`.
    fn without_tail(&self, y: &[f64], time: f64) -> Vec<f64> {
        residual(y, &[self.column(|f| f.time.iter().map(|t| (-t / time).exp()).collect())])
    }
}

/// ln Bayes factor (Schwarz 1978) of the modes that `flights` hold against none, and their angular frequencies between the ends of
/// their 95 % intervals (by likelihood: Wilks 1938), the strongest first, in their unit of time; None where they are too few or hold
/// nothing. A mode has one frequency and one damping, and at every level an amplitude and a phase.
fn modes(flights: &[Flight]) -> Option<(f64, Vec<[f64; 3]>)> {
    let longest = flights.iter().map(|f| f.time[f.time.len() - 1] - f.time[0]).fold(0.0, f64::max);
    let step = flights.iter().map(|f| (f.time[1] - f.time[0]).abs()).fold(f64::MAX, f64::min);
    if flights.is_empty() || longest <= 0.0 || step <= 0.0 {
        return None;
    }
    let mut levels: BTreeMap<usize, Vec<&Flight>> = BTreeMap::new();
    flights.iter().for_each(|f| levels.entry(f.level).or_default().push(f));
    let levels: Vec<Alike<'_>> = levels.into_values().map(Alike::new).collect();
    let mut left: Vec<Vec<f64>> = levels.iter().map(|l| l.column(|f| f.read.clone())).collect();
    let n = left.iter().map(Vec::len).sum::<usize>() as f64;
    let each = |left: &[Vec<f64>], of: &dyn Fn(&Alike<'_>, &[f64]) -> Vec<f64>| -> Vec<Vec<f64>> {
        levels.iter().zip(left).map(|(l, y)| of(l, y)).collect()
    };
    let whole = squares(&left);
    if whole <= 0.0 {
        return None;
    }
    let penalty = |parameters: usize| 0.5 * (parameters * levels.len()) as f64 * n.ln();
    // a zero that comes back is no ringing
    let tails = TAILS.iter().map(|time| each(&left, &|l, y| l.without_tail(y, *time)));
    let best = tails.min_by(|a, b| squares(a).total_cmp(&squares(b)));
    if let Some(best) = best.filter(|b| 0.5 * n * (whole / squares(b)).ln() > 0.5 * n.ln() + penalty(1)) {
        left = best;
    }
    // from two periods a flight up, below the highest frequency sampled, two steps a natural width
    let (low, high, by) = (4.0 * PI / longest, HIGHEST.min(0.8 * PI / step), PI / (2.0 * longest));
    let grid: Vec<f64> = (0..).map(|i| low + by * f64::from(i)).take_while(|w| *w < high).collect();
    let tried: Vec<(f64, f64)> = grid.iter().flat_map(|w| DAMPING.map(|zeta| (*w, zeta))).collect();
    let alone: Vec<Alike<'_>> = levels.iter().flat_map(|l| &l.flights).map(|f| Alike::new(vec![*f])).collect();
    let (mut found, mut used): (Vec<(f64, [f64; 3])>, f64) = (Vec::new(), squares(&left));
    let mut factor = 0.0f64;
    for _ in 0..MODES {
        let rest = |(w, zeta): &(f64, f64)| (*w, *zeta, squares(&each(&left, &|l, y| l.without_mode(y, *w, *zeta))));
        let rests: Vec<(f64, f64, f64)> = tried.par_iter().map(rest).collect();
        let Some((w, zeta, rest)) = rests.iter().copied().min_by(|a, b| a.2.total_cmp(&b.2)) else { break };
        let better = each(&left, &|l, y| l.without_mode(y, w, zeta));
        let independent = independent(&better, &levels);
        // hum has been there before the impact: it dies out in no flight, and has a phase of its own in each
        let each_alone: Vec<Vec<f64>> = levels.iter().zip(&left).flat_map(|(l, y)| l.parted(y)).collect();
        let hum = |w: &f64| -> f64 {
            let of = |(a, y): (&Alike<'_>, &Vec<f64>)| a.without_mode(y, *w, 0.0);
            alone.iter().zip(&each_alone).map(of).map(|y| dot(&y, &y)).sum()
        };
        let least = grid.par_iter().map(hum).reduce(|| f64::INFINITY, f64::min);
        let hums = 0.5 * independent * (used / least).ln() - (0.5 + alone.len() as f64) * n.ln();
        let more = 0.5 * independent * (used / rest).ln() - n.ln() - penalty(2) - hums.max(0.0);
        if !more.is_finite() || more <= 0.0 {
            break;
        }
        factor += more;
        // an interval is known to half a step of the frequencies tried
        let near = rests.iter().filter(|(_, _, r)| 0.5 * independent * (r / rest).ln() < HALF_QUANTILE);
        let (low, high) = near.fold((w, w), |(low, high), (w, _, _)| (low.min(*w), high.max(*w)));
        found.push((used - rest, [low - 0.5 * by, w, high + 0.5 * by]));
        (left, used) = (better, rest);
    }
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    (!found.is_empty()).then(|| (factor, found.into_iter().map(|f| f.1).collect()))
}

/// Samples that are independent, of residuals whose neighbours are alike (an autoregression of first order; Bartlett 1935).
fn independent(left: &[Vec<f64>], levels: &[Alike<'_>]) -> f64 {
    let mut products = 0.0;
    for (y, l) in left.iter().zip(levels) {
        let mut at = 0;
        for f in &l.flights {
            products += y[at..at + f.time.len()].windows(2).map(|w| w[0] * w[1]).sum::<f64>();
            at += f.time.len();
        }
    }
    let alike = (products / squares(left)).clamp(0.0, 0.999);
    left.iter().map(Vec::len).sum::<usize>() as f64 * (1.0 - alike) / (1.0 + alike)
}

fn squares(of: &[Vec<f64>]) -> f64 {
    of.iter().map(|v| dot(v, v)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Five flights of 120 samples over twelve durations: `of` the time, and noise of this size.
    fn five(seed: u64, noise: f64, of: impl Fn(usize, f64) -> f64) -> Vec<Flight> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut flight = |r: usize| {
            let time: Vec<f64> = (0..120).map(|i| 1.0 + 0.1 * f64::from(i)).collect();
            let read = time.iter().map(|t| of(r, *t) + noise * (rng.random::<f64>() - 0.5)).collect();
            Flight { level: r / 3, time, read }
        };
        (0..5).map(&mut flight).collect()
    }

    /// The simulation as given, fitted to a campaign of the recipe.
    fn simulation_of(recipe: &plant::recipe::Recipe) -> Fitted {
        let dir = tempfile::tempdir().unwrap();
        plant::recipe::write_campaign(dir.path(), recipe).unwrap();
        let campaign = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let prepared = estimate::prepare::Prepared::new(&campaign).unwrap();
        Fitted::base(&prepared.data, &prepared.structure, &prepared.guess)
    }

    #[test]
    fn modes_that_follow_the_impact_alike_are_found_with_their_frequencies() {
        let two = |_: usize, t: f64| {
            0.1 * (-0.02 * 6.0 * t).exp() * (6.0 * t).cos() + 0.05 * (-0.02 * 11.0 * t).exp() * (11.0 * t).sin()
        };
        let (factor, w) = modes(&five(1, 0.05, two)).unwrap();
        assert!(factor > 50.0, "{factor}");
        for (found, [low, w, high]) in [6.0, 11.0].iter().zip(w) {
            assert!((w / found - 1.0).abs() < 0.03 && low < *found && *found < high, "{low} {w} {high}");
        }
    }

    #[test]
    fn noise_a_drift_a_zero_that_comes_back_and_hum_that_follows_no_impact_are_no_ringing() {
        for seed in 0..10 {
            assert!(modes(&five(seed, 0.05, |_, _| 0.0)).is_none(), "{seed}");
            let drift = |r: usize, t: f64| 0.02 * r as f64 + 0.01 * t - 0.001 * t * t + 0.3 * (-t / 0.7).exp();
            assert!(modes(&five(seed, 0.05, drift)).is_none_or(|m| m.0 < 3.0), "{seed}");
            let hum = |r: usize, t: f64| 0.05 * (3.0 * t + 1.9 * (r * r) as f64).cos();
            assert!(modes(&five(seed, 0.05, hum)).is_none_or(|m| m.0 < 6.0), "{seed}");
        }
    }

    #[test]
    fn a_mass_that_rides_on_the_body_rings_at_the_frequency_of_the_pair_and_a_body_alone_does_not() {
        let of = |ride: f64, w: f64| {
            let mut recipe = plant::recipe::Recipe::default();
            // as short as rings show best
            recipe.physics.law.scale_stiffness(30.0);
            recipe.physics.law.hysteresis_damping.coefficient *= 30.0;
            let riding = &mut recipe.physics.attached_mass;
            (riding.mass, riding.stiffness, riding.damping) = (ride, ride * w * w, 0.02 * ride * w);
            (rings(&simulation_of(&recipe)), recipe.physics.mass)
        };
        let (ride, w) = (0.1, 1.2e4);
        let (found, mass) = of(ride, w);
        let found = found.unwrap();
        let numbers = crate::table::Table::calibrated().learned;
        assert!(found.probability(&numbers) > 0.9, "{found:?}");
        let frequency = w * (mass / (mass - ride)).sqrt() / (2.0 * PI);
        assert!((found.modes[0].frequency / frequency - 1.0).abs() < 0.03, "{found:?} {frequency}");
        assert!(of(0.0, w).0.is_none_or(|r| r.probability(&numbers) < 0.5));
    }

    #[test]
    fn a_contact_that_lasts_longer_than_the_simulation_has_it_does_not_ring() {
        use law::learned::Learned;
        use mechanisms::learned_force::{Dependence, LearnedForce};
        let mut recipe = plant::recipe::Recipe::default();
        let force = &mut recipe.physics.learned_forces.0[0];
        *force = LearnedForce { of: Dependence::Depth, learned: Learned { range: 4e-4, ..Learned::default() } };
        (force.learned.coefficients[2], force.learned.coefficients[5]) = (60.0, -45.0);
        let found = rings(&simulation_of(&recipe));
        let numbers = crate::table::Table::calibrated().learned;
        assert!(found.as_ref().is_none_or(|r| r.probability(&numbers) < 0.5), "{found:?}");
    }
}
