//! The impact in a recording: where it is, and whether it is one at all.

use plant::noise::Stretch;
use record::statistics::{means, median, spread_of_course, thirds};
use record::{Kind, Recording};
use statrs::function::erf::erfc;

/// Share of its peak above which a pulse pushes.
const SHARE: f64 = 0.04;
/// Times the noise that a peak has to reach.
const STANDS_OUT: f64 = 8.0;
/// Samples from which the noise before a pulse can be estimated.
const QUIET: usize = 8;
/// Samples in a row that make a touch, so that a spike is none.
const IN_A_ROW: i32 = 3;
/// Touches that noise alone may be expected to make in a recording.
const FALSE_TOUCHES: f64 = 0.01;
/// Samples beyond which a pulse is looked for in means: where a force rises by less than its noise from one sample to the
/// next, it crosses a level many times.
const MANY: usize = 4000;
/// Fewest means that a pulse is looked for in.
const FEWEST_MEANS: usize = 32;

/// The first pulse of a signal that pushes.
pub(crate) struct Pulse {
    /// Index of its first crossing of `level`, and its last sample above.
    pub first: usize,
    pub last: usize,
    /// The largest reading of all, and the share of it above which a pulse pushes.
    pub peak: f64,
    pub level: f64,
}

/// The first pulse of a signal that pushes: in means where there are many samples, and in ever longer ones where noise alone
/// would touch.
pub(crate) fn pulse(y: &[f64]) -> Option<Pulse> {
    let found = |m: usize| {
        let coarse = means(y, m);
        let p = pulse_in(&coarse)?;
        let safe = is_safe(&coarse, p.level);
        Some((Pulse { first: m * p.first, last: m * p.last + m - 1, ..p }, safe))
    };
    let longer = (0..).map(|i| 1 << i).take_while(|m| *m == 1 || y.len() / m >= FEWEST_MEANS);
    // a contact may be too short to be seen in the means of many samples
    let lengths = std::iter::once(y.len().div_ceil(MANY)).filter(|m| *m > 1).chain(longer);
    let safe = lengths.filter_map(found).find(|(_, safe)| *safe).map(|(p, _)| p);
    safe.or_else(|| found(1).map(|(p, _)| p))
}

/// Whether white noise of the size of that in `y` leaves a touch above `level` unlikely.
fn is_safe(y: &[f64], level: f64) -> bool {
    if y.len() < 4 {
        return true;
    }
    let sigma = spread_of_course(y);
    let above = 0.5 * erfc(level / (sigma.max(f64::MIN_POSITIVE) * std::f64::consts::SQRT_2));
    y.len() as f64 * above.powi(IN_A_ROW) < FALSE_TOUCHES
}

/// The first pulse in samples as they are.
fn pulse_in(y: &[f64]) -> Option<Pulse> {
    let peak = y.iter().cloned().fold(f64::MIN, f64::max);
    if peak.is_nan() || peak <= 0.0 {
        return None;
    }
    let level = SHARE * peak;
    let touch = IN_A_ROW as usize;
    let first = y.windows(touch).position(|w| w.iter().all(|v| *v > level))?;
    let mut last = first;
    let mut below = 0;
    for (i, v) in y.iter().enumerate().skip(first) {
        if *v > level {
            last = i;
            below = 0;
        } else {
            below += 1;
            if below > 4 {
                break;
            }
        }
    }
    Some(Pulse { first, last, peak, level })
}

/// Whether a channel reads the push itself, not the way alone.
fn pushes(r: &Recording) -> bool {
    r.channels[0].is_some() || r.channels[1].is_some()
}

/// What pushes on the body in a recording: force, or mass times acceleration, or at least the way. None without a
/// channel.
pub(crate) fn push_of(r: &Recording, mass: f64) -> Option<Vec<f64>> {
    let rest = |y: &[f64]| median(y[..(y.len() / 20).max(4)].to_vec());
    match (&r.channels[0], &r.channels[1], &r.channels[2]) {
        (Some(f), _, _) => {
            let zero = rest(f);
            Some(f.iter().map(|v| v - zero).collect())
        }
        (_, Some(a), _) => {
            let zero = rest(a).clamp(-2.0, 2.0);
            Some(a.iter().map(|v| mass * (zero - v)).collect())
        }
        (_, _, x) => x.clone(),
    }
}

/// What pushes in a recording, and its first pulse.
pub(crate) struct Impact {
    pub push: Vec<f64>,
    pub pulse: Pulse,
}

/// The impact in a recording of a body of `mass` kg.
///
/// # Errors
/// Why there is none.
pub(crate) fn impact(kind: Kind, r: &Recording, mass: f64) -> Result<Impact, &'static str> {
    let push = push_of(r, mass).ok_or("it holds no channel to judge")?;
    let found = impact_in(kind, r, push);
    match &r.channels[0] {
        // a press that begins at the surface, under a preload, has no rest: its first readings are no zero of the force
        Some(force) if found.is_err() && kind == Kind::Indentation => impact_in(kind, r, force.clone()).or(found),
        _ => found,
    }
}

/// The impact in what pushes in a recording.
fn impact_in(kind: Kind, r: &Recording, push: Vec<f64>) -> Result<Impact, &'static str> {
    let pulse = pulse(&push).ok_or("no impact is to be seen in it")?;
    // where something pushes from the start it may be noise that does: what comes before the largest reading's own rise
    let before = if pulse.first > QUIET || kind == Kind::Indentation {
        &push[..pulse.first]
    } else {
        let top = push.iter().position(|v| *v >= pulse.peak).unwrap_or(0);
        let rise = push[..top].iter().rposition(|v| *v <= pulse.level).map_or(0, |i| i + 1);
        &push[..rise]
    };
    let noise = if before.len() <= QUIET {
        median(thirds(&push)) / 20f64.sqrt()
    } else if kind == Kind::Indentation && pushes(r) {
        // a press that begins at the surface has a ramp there from the first sample on, which is no noise
        median(Stretch::less_polynomial(before, 2).left.iter().map(|v| v.abs()).collect())
    } else if pushes(r) {
        median(before.iter().map(|v| v.abs()).collect())
    } else {
        // a penetration is far below zero before touch: differences of third order see its noise alone
        median(thirds(before)) / 20f64.sqrt()
    };
    if pulse.peak < STANDS_OUT * noise {
        return Err("its peak does not stand out of the noise");
    }
    Ok(Impact { push, pulse })
}

/// Where the first impact of a recording of a body of `mass` kg begins, and how long it pushes, s. None where there is
/// none.
pub fn touch(kind: Kind, r: &Recording, mass: f64) -> Option<(f64, f64)> {
    let found = impact(kind, r, mass).ok()?.pulse;
    Some((r.time[found.first], r.time[found.last] - r.time[found.first]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn a_press_that_begins_at_the_surface_stands_out_of_its_own_ramp() {
        // a third of the recording lies below the share of its peak from which on it pushes
        let y: Vec<f64> = (0..400).map(|i| (f64::from(i) / 30.0).exp() * 1e-6 + 1e-9 * f64::from(i % 7)).collect();
        let time: Vec<f64> = (0..400).map(f64::from).collect();
        let press = |y: Vec<f64>| Recording::of("r.csv", time.clone(), [Some(y), None, Some(time.clone())]);
        assert!(impact(Kind::Indentation, &press(y), 1.0).is_ok());
        // a ramp to half of the level and a step beyond it: the median of what is before is no noise either
        // under a preload that is at once nearly all of its force
        let preload = (0..400).map(|i| 6.0 + 1e-3 * f64::from(i.min(400 - i)) + 1e-4 * f64::from(i % 7)).collect();
        assert!(impact(Kind::Indentation, &press(preload), 1.0).is_ok());
        let ramp = (0..400).map(|i| if i < 200 { 0.2 * f64::from(i) } else { 100.0 + f64::from(i) }).collect();
        assert!(impact(Kind::Indentation, &press(ramp), 1.0).is_ok());
    }

    #[test]
    fn a_pulse_is_found_in_any_number_of_noisy_samples() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(3);
        for n in [500, 20_000, 500_000] {
            // half a sine in the last fifth; noise of 5 % of its peak
            let mut y: Vec<f64> = (0..n)
                .map(|i| {
                    let u = (i as f64 / n as f64 - 0.8) / 0.1;
                    let push = if (0.0..1.0).contains(&u) { (std::f64::consts::PI * u).sin() } else { 0.0 };
                    push + 0.05 * ((0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0)
                })
                .collect();
            let p = pulse(&y).unwrap();
            let at = |i: usize| i as f64 / n as f64;
            assert!((at(p.first) - 0.8).abs() < 0.02 && (at(p.last) - 0.9).abs() < 0.02, "{n}: {} {}", p.first, p.last);
            // without the pulse its noise is taken to be nothing else
            y.truncate(n * 7 / 10);
            let time: Vec<f64> = (0..y.len()).map(|i| 1e-5 * i as f64).collect();
            let noise = Recording::of("r.csv", time, [Some(y), None, None]);
            assert!(impact(Kind::DropTest, &noise, 1.0).is_err(), "{n}");
        }
    }
}
