//! Whether a body or a transducer rings on when nothing touches any more: damped oscillations in the acceleration or the force read
//! after the impact, that follow the impact alike in every recording. Nothing of the contact makes them, whatever its law; they are
//! the class of what swings on the body or in the transducer.

use crate::learned::{Named, Size};
use crate::pulse::Pulse;
use estimate::fitted::Fitted;
use mechanisms::mechanism::{Mechanism, Origin};
use rayon::prelude::*;
use record::Channel;
use std::f64::consts::PI;

/// What rings after the contact.
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

/// What to do about what rings, its frequency known and its mass not.
const CURE: &str =
    "The contact element is right; find what swings at this frequency and fasten it, or hang a mass with this \
                        frequency on the body in the rig's model.";
/// Half of the 95 % quantile of chi squared of one degree of freedom.
const HALF_QUANTILE: f64 = 1.92;

impl Rings {
    /// That it rings at all, by numbers that laws are learned by.
    pub fn probability(&self, numbers: &learn::Numbers) -> f64 {
        let ln = numbers.class + self.ln_factor / numbers.temperature;
        1.0 / (1.0 + (-ln).exp())
    }

    /// Whether `mechanism` may ring in `channel`: in a force that is read while nothing touches, the transducer alone.
    pub fn may_be_of(mechanism: &Mechanism, channel: Channel) -> bool {
        mechanism.hints.rings && (channel == Channel::Acceleration || mechanism.origin == Origin::Chain)
    }

    /// It as `mechanism` without a form, with that one's probability and the others that it may be: after the contact it shows.
    pub fn named(&self, mechanism: &'static Mechanism, probability: f64, also_possible: Vec<&'static str>) -> Named {
        let (value, ci95) = self.modes.first().map_or((f64::NAN, None), |m| (m.frequency, Some(m.ci95)));
        let size = Size { name: "frequency", value, unit: "Hz", ci95, by: "likelihood" };
        Named { mechanism, probability, also_possible, size, cure: CURE, shares: [0.0, 0.0, 0.0, 1.0] }
    }
}

/// The reading of one flight over the impulse before it, and the time since that, in durations of the pulse.
struct Flight {
    time: Vec<f64>,
    read: Vec<f64>,
}

/// Modes that are looked for at most.
const MODES: usize = 3;
/// Length of a flight that is looked at, durations of the pulse: what rings is clearest while it is young.
const LONGEST: f64 = 12.0;
/// Fewest samples of a flight.
const LEAST: usize = 24;
/// Damping ratios of a mode that are tried.
const DAMPING: [f64; 5] = [0.005, 0.02, 0.05, 0.1, 0.2];
/// Times, in durations of the pulse, within which a reading may come back to its zero without ringing.
const TAILS: [f64; 5] = [0.25, 0.5, 1.0, 2.0, 4.0];
/// Parameters of a mode: frequency, damping, and two amplitudes; of a tail: time constant and amplitude.
const OF_MODE: f64 = 4.0;
const OF_TAIL: f64 = 2.0;

/// What rings in `channel` after the impacts that `f` simulates; None where there is no flight, or nothing that rings.
pub fn rings(f: &Fitted, channel: Channel) -> Option<Rings> {
    let mut durations = Vec::new();
    let flights: Vec<Flight> = (0..f.data.records.len())
        .filter_map(|r| {
            let (flight, duration) = flight(f, r, channel)?;
            durations.push(duration);
            Some(flight)
        })
        .collect();
    let duration = durations.iter().sum::<f64>() / durations.len() as f64;
    let (ln_factor, angular) = modes(&flights)?;
    let hertz = |w: f64| w / (2.0 * PI * duration);
    let mode = |[low, w, high]: [f64; 3]| Mode { frequency: hertz(w), ci95: [hertz(low), hertz(high)] };
    Some(Rings { ln_factor, modes: angular.into_iter().map(mode).collect() })
}

/// The flight after the first impact of recording `r`, until the simulation touches again, and the duration of the impact, s.
fn flight(f: &Fitted, r: usize, channel: Channel) -> Option<(Flight, f64)> {
    let rec = &f.data.records[r];
    let pulse = Pulse::new(rec, channel)?;
    let (trace, _) = f.predict(r);
    let (time, y) = (&rec.setup.time, rec.y[channel.index()].as_deref()?);
    let weight = &rec.weight[channel.index()];
    let flies = |i: usize| trace.position[i] < 0.0;
    let first = (pulse.end..time.len()).find(|i| flies(*i))?;
    let end = (first..time.len()).find(|i| !flies(*i) || time[*i] > pulse.middle + LONGEST * pulse.duration);
    let kept = (first..end.unwrap_or(time.len())).filter(|i| weight[*i] > 0.0 && y[*i].is_finite());
    let of = |i: usize| ((time[i] - pulse.middle) / pulse.duration, y[i] * pulse.duration / pulse.impulse);
    let (time, read): (Vec<f64>, Vec<f64>) = kept.map(of).unzip();
    (time.len() >= LEAST).then_some((Flight { time, read }, pulse.duration))
}

/// Columns over all flights, one after the other, without what a parabola of each flight explains.
struct Columns<'a> {
    flights: &'a [Flight],
    /// Orthonormal polynomials of every flight.
    smooth: Vec<[Vec<f64>; 3]>,
}

impl Columns<'_> {
    fn new(flights: &[Flight]) -> Columns<'_> {
        let smooth = |f: &Flight| {
            let mut all: [Vec<f64>; 3] = std::array::from_fn(|p| f.time.iter().map(|t| t.powi(p as i32)).collect());
            for p in 0..3 {
                let (before, from) = all.split_at_mut(p);
                before.iter().for_each(|q| project_out(&mut from[0], q));
                let norm = dot(&from[0], &from[0]).sqrt();
                from[0].iter_mut().for_each(|v| *v /= norm);
            }
            all
        };
        Columns { flights, smooth: flights.iter().map(smooth).collect() }
    }

    /// A column whose values in a flight are those of `of`.
    fn column(&self, of: impl Fn(&Flight) -> Vec<f64>) -> Vec<f64> {
        let alone = |(f, smooth): (&Flight, &[Vec<f64>; 3])| {
            let mut v = of(f);
            smooth.iter().for_each(|q| project_out(&mut v, q));
            v
        };
        self.flights.iter().zip(&self.smooth).flat_map(alone).collect()
    }

    /// The two columns of a mode of angular frequency `w` and damping ratio `zeta`.
    fn mode(&self, w: f64, zeta: f64) -> Vec<Vec<f64>> {
        let of = |phase: f64| {
            self.column(|f| f.time.iter().map(|t| (-zeta * w * t).exp() * (w * t - phase).cos()).collect())
        };
        vec![of(0.0), of(PI / 2.0)]
    }
}

/// ln Bayes factor (Schwarz 1978) of the modes that `flights` hold, in durations of the pulse, against none, and their angular
/// frequencies between the ends of their 95 % intervals (by likelihood: Wilks 1938), the strongest first; None where they are too few or hold nothing.
fn modes(flights: &[Flight]) -> Option<(f64, Vec<[f64; 3]>)> {
    let longest = flights.iter().map(|f| f.time[f.time.len() - 1] - f.time[0]).fold(0.0, f64::max);
    let step = flights.iter().map(|f| (f.time[1] - f.time[0]).abs()).fold(f64::MAX, f64::min);
    if flights.is_empty() || longest <= 0.0 || step <= 0.0 {
        return None;
    }
    let columns = Columns::new(flights);
    let mut left = columns.column(|f| f.read.clone());
    let n = left.len() as f64;
    let whole = dot(&left, &left);
    if whole <= 0.0 {
        return None;
    }
    // a zero that comes back is no ringing
    let tail = |of: &f64| columns.column(|f| f.time.iter().map(|t| (-t / of).exp()).collect());
    let tails = TAILS.iter().map(|of| without(&left, &[tail(of)]));
    let best = tails.min_by(|a, b| dot(a, a).total_cmp(&dot(b, b)));
    if let Some(best) = best.filter(|b| n * (whole / dot(b, b)).ln() > OF_TAIL * n.ln()) {
        left = best;
    }
    let smooth = dot(&left, &left);
    // from two periods a flight to a little below the highest frequency sampled, two steps a natural width
    let (low, high, by) = (4.0 * PI / longest, 0.8 * PI / step, PI / (2.0 * longest));
    let tried: Vec<(f64, f64)> = (0..)
        .map(|i| low + by * f64::from(i))
        .take_while(|w| *w < high)
        .flat_map(|w| DAMPING.map(|z| (w, z)))
        .collect();
    let (mut found, mut used): (Vec<(f64, [f64; 3])>, f64) = (Vec::new(), smooth);
    let mut factor = 0.0f64;
    for _ in 0..MODES {
        let rest = |(w, zeta): &(f64, f64)| {
            let better = without(&left, &columns.mode(*w, *zeta));
            (*w, *zeta, dot(&better, &better))
        };
        let rests: Vec<(f64, f64, f64)> = tried.par_iter().map(rest).collect();
        let Some((w, zeta, rest)) = rests.iter().copied().min_by(|a, b| a.2.total_cmp(&b.2)) else { break };
        let better = without(&left, &columns.mode(w, zeta));
        let independent = independent(&better, flights);
        let more = 0.5 * independent * (used / rest).ln() - 0.5 * OF_MODE * n.ln();
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
fn independent(left: &[f64], flights: &[Flight]) -> f64 {
    let (mut at, mut products) = (0, 0.0);
    for f in flights {
        products += left[at..at + f.time.len()].windows(2).map(|w| w[0] * w[1]).sum::<f64>();
        at += f.time.len();
    }
    let alike = (products / dot(left, left)).clamp(0.0, 0.999);
    left.len() as f64 * (1.0 - alike) / (1.0 + alike)
}

/// What least squares by `columns` leave of `y`.
fn without(y: &[f64], columns: &[Vec<f64>]) -> Vec<f64> {
    let mut left = y.to_vec();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for c in columns {
        let mut c = c.clone();
        let size = dot(&c, &c);
        basis.iter().for_each(|q| project_out(&mut c, q));
        let norm = dot(&c, &c);
        if norm <= 1e-12 * size || norm <= 0.0 {
            continue;
        }
        c.iter_mut().for_each(|v| *v /= norm.sqrt());
        project_out(&mut left, &c);
        basis.push(c);
    }
    left
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Takes the part along the unit vector `q` out of `v`.
fn project_out(v: &mut [f64], q: &[f64]) {
    let share = dot(v, q);
    v.iter_mut().zip(q).for_each(|(v, q)| *v -= share * q);
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
            Flight { time, read }
        };
        (0..5).map(&mut flight).collect()
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
    fn what_least_squares_leave_is_orthogonal_to_the_columns() {
        let y = [1.0, 2.0, 0.5, -1.0];
        let columns = [vec![1.0, 1.0, 1.0, 1.0], vec![0.0, 1.0, 2.0, 3.0], vec![2.0, 2.0, 2.0, 2.0]];
        let left = without(&y, &columns);
        assert!(columns.iter().all(|c| dot(c, &left).abs() < 1e-12));
    }
}
