//! Two sensors on the same impacts: where a run diagnoses both their campaigns, each is held against the other. A lag
//! that bends a pulse too little to show beside an unknown law shows at once beside a second reading of that pulse.

use super::candidate::DETECT;
use estimate::flat::flat;
use estimate::simplex::{minimise, Options};
use mechanisms::lowpass_lag;
use mechanisms::signal::{between, pole};
use record::{largest, range, Campaign, Channel, Recording};
use statrs::distribution::{ContinuousCDF, StudentsT};
use statrs::statistics::Statistics;

/// A mean over recordings with its 95 % interval (Student 1908).
#[derive(Clone, Copy, Debug)]
pub struct Mean {
    pub value: f64,
    pub low: f64,
    pub high: f64,
}

/// One recording against the other sensor's.
#[derive(Clone, Debug)]
pub struct Reading {
    pub file: String,
    /// Time constant of the first-order lag behind the other sensor, s; below zero where this one leads.
    pub lag: f64,
    pub gain: f64,
    /// Root mean square misfit over the recording's range, without the lag and with it.
    pub before: f64,
    pub after: f64,
    /// Fall of chi^2 by the lag, the noise taken from what is left with it.
    pub fall: f64,
    /// Largest magnitude read, and what the other sensor says it would have been without a limit, SI.
    pub read: f64,
    pub expected: f64,
    /// Whether it ran into its limit.
    pub limited: bool,
}

/// A campaign's channel against that of another campaign, which read the same impacts.
#[derive(Clone, Debug)]
pub struct Against {
    /// The other campaign's folder.
    pub other: String,
    pub channel: Channel,
    pub lag: Mean,
    pub gain: Mean,
    pub readings: Vec<Reading>,
}

/// Share of the variance within the window that the other sensor has to account for, and the most its gain may differ
/// by, before two recordings count as of one impact.
const ALIKE: f64 = 0.995;
const GAIN: f64 = 1.25;
/// Standard deviations within which reported speeds are the same.
const SPEEDS: f64 = 3.0;
/// Share of the samples that both windows have to hold.
const OVERLAP: f64 = 0.5;
/// Median of the magnitude of normal noise to its standard deviation; places between two samples over which what an
/// interpolation keeps of noise is averaged.
const MEDIAN_TO_SIGMA: f64 = 1.4826;
const PLACES: usize = 8;
/// Share of the largest reading from which a channel that ends flat is taken to be at its limit.
const NEAR_LIMIT: f64 = 0.995;

impl Against {
    /// Mean misfit over range without the lag and with it.
    pub fn misfit(&self) -> (f64, f64) {
        let mean = |f: fn(&Reading) -> f64| self.readings.iter().map(f).sum::<f64>() / self.readings.len() as f64;
        (mean(|r| r.before), mean(|r| r.after))
    }

    /// Whether this sensor lags behind the other: beyond what recordings scatter by, and with a better fit to show for it.
    pub fn lags(&self) -> bool {
        self.lag.low > 0.0 && self.readings.iter().map(|r| r.fall).sum::<f64>() > DETECT
    }

    /// The mechanism that a lag stands for; None where this sensor does not lag.
    pub fn mechanism(&self) -> Option<&'static str> {
        self.lags().then_some(lowpass_lag::MECHANISM.name)
    }
}

/// The window of one recording, its samples on an even grid to within a sample.
struct Window<'a> {
    time: &'a [f64],
    y: &'a [f64],
    dt: f64,
}

impl<'a> Window<'a> {
    fn of(r: &'a Recording, channel: Channel) -> Option<Window<'a>> {
        let (y, time) = (r.channels[channel.index()].as_ref()?, &r.time);
        let dt = (time[time.len() - 1] - time[0]) / (time.len() - 1) as f64;
        Some(Window { time, y, dt })
    }

    /// The samples behind a first-order lag of `tau` s; a lead adds the slope instead.
    fn lagged(&self, tau: f64) -> Vec<f64> {
        let mut y = self.y.to_vec();
        if tau > 1e-3 * self.dt {
            pole(&mut y, 1.0 / tau, self.dt);
        } else if tau < 0.0 {
            let n = y.len();
            for i in 0..n {
                let (a, b) = (i.saturating_sub(1), (i + 1).min(n - 1));
                y[i] -= tau * (self.y[b] - self.y[a]) / ((b - a) as f64 * self.dt);
            }
        }
        y
    }
}

/// Standard deviation of the noise from one sample to the next, from third differences (of white noise they have 20 times
/// its variance) by their median, which a pulse's edges do not move.
fn sample_noise(y: &[f64]) -> f64 {
    let mut d: Vec<f64> = y.windows(4).map(|w| (w[3] - 3.0 * w[2] + 3.0 * w[1] - w[0]).abs()).collect();
    d.sort_by(f64::total_cmp);
    d.get(d.len() / 2).map_or(0.0, |m| MEDIAN_TO_SIGMA * m / 20f64.sqrt())
}

/// Mean square that unit white noise of the samples of a window keeps behind a lag of `tau` samples, read between them:
/// a lag smooths the other sensor's noise, and must not be believed for that.
fn kept_noise(tau: f64) -> f64 {
    let before = 4;
    let mut impulse = vec![0.0; 2 * before + (20.0 * tau.abs()).min(4000.0) as usize];
    impulse[before] = 1.0;
    let time: Vec<f64> = (0..impulse.len()).map(|i| i as f64).collect();
    let y = Window { time: &time, y: &impulse, dt: 1.0 }.lagged(tau);
    let squares = (0..PLACES).flat_map(|f| {
        let y = &y;
        (0..y.len()).map(move |i| between(y, i as f64 + f as f64 / PLACES as f64).powi(2))
    });
    squares.sum::<f64>() / PLACES as f64
}

/// How far `from`, behind a lag and a delay, scaled and shifted, accounts for `to`.
struct Match {
    gain: f64,
    zero: f64,
    /// Samples compared, mean square left, and the share of the variance that is.
    samples: f64,
    left: f64,
    share: f64,
}

/// Least squares of gain and zero over the samples of `to` with `weight` that lie within the window of `from`, whose
/// samples `y` come `delay` s late. None where the windows hardly meet.
fn matched(from: &Window<'_>, y: &[f64], to: &Window<'_>, weight: &[bool], delay: f64) -> Option<Match> {
    let (mut n, mut su, mut sv, mut suu, mut suv, mut svv) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for ((t, v), used) in to.time.iter().zip(to.y).zip(weight) {
        let place = (t - delay - from.time[0]) / from.dt;
        if !used || !(0.0..=(y.len() - 1) as f64).contains(&place) {
            continue;
        }
        let u = between(y, place);
        n += 1.0;
        su += u;
        sv += v;
        suu += u * u;
        suv += u * v;
        svv += v * v;
    }
    if n < OVERLAP * weight.iter().filter(|w| **w).count() as f64 || n < 4.0 {
        return None;
    }
    let (vu, vv, c) = (suu - su * su / n, svv - sv * sv / n, suv - su * sv / n);
    let gain = c / vu;
    let left = ((vv - gain * c) / n).max(0.0);
    let whole = vv / n;
    (vu > 0.0 && whole > 0.0).then(|| Match { gain, zero: (sv - gain * su) / n, samples: n, left, share: left / whole })
}

/// One recording of `c` against the same impact's recording by the other sensor; None where they are not alike.
fn reading(from: &Recording, to: &Recording, channel: Channel, top: f64, limited: bool) -> Option<Reading> {
    let (a, b) = (Window::of(from, channel)?, Window::of(to, channel)?);
    let weight: Vec<bool> = b.y.iter().map(|v| !limited || v.abs() < NEAR_LIMIT * top).collect();
    let worst = f64::INFINITY;
    let noise = sample_noise(a.y).powi(2);
    let share_of = |y: &[f64], kept: f64, delay: f64| match matched(&a, y, &b, &weight, delay) {
        Some(m) if m.gain > 0.0 => m.share * (1.0 - m.gain * m.gain * noise * kept / m.left.max(1e-300)),
        _ => worst,
    };
    let share = |tau: f64, delay: f64| share_of(&a.lagged(tau), kept_noise(tau / a.dt), delay);
    let kept = kept_noise(0.0);
    let plainly = |delay: f64| share_of(a.y, kept, delay);
    // every delay that leaves enough of both windows
    let step = 0.5 * a.dt.min(b.dt);
    let most = 0.5 * (b.time[b.time.len() - 1] - b.time[0]);
    let count = (2.0 * most / step) as usize;
    let at = |i: usize| i as f64 * step - most;
    let delay = (0..=count).map(at).min_by(|x, y| plainly(*x).total_cmp(&plainly(*y)))?;
    let options = Options { iterations: 400, spread: 1e-12, size: 1e-4 };
    let plain = minimise(&mut |x| plainly(x[0]), &[delay], &[step], &options, &mut |_, _| false);
    let start = [0.5 * b.dt, plain.x[0] - 0.5 * b.dt];
    let bent = minimise(&mut |x| share(x[0], x[1]), &start, &[0.25 * b.dt, 0.25 * b.dt], &options, &mut |_, _| false);
    let (tau, delay) = if bent.value < plain.value { (bent.x[0], bent.x[1]) } else { (0.0, plain.x[0]) };
    let y = a.lagged(tau);
    let m = matched(&a, &y, &b, &weight, delay)?;
    let without = matched(&a, a.y, &b, &weight, plain.x[0])?;
    if m.share > 1.0 - ALIKE || !(1.0 / GAIN..=GAIN).contains(&m.gain) {
        return None;
    }
    let (range, read) = (range(b.y), largest(b.y));
    let scaled: Vec<f64> = y.iter().map(|v| m.gain * v + m.zero).collect();
    Some(Reading {
        file: to.file.clone(),
        lag: tau,
        gain: m.gain,
        before: without.left.sqrt() / range,
        after: m.left.sqrt() / range,
        fall: m.samples * (without.left / m.left.max(1e-300)).ln().min(1e3),
        read,
        expected: largest(&scaled),
        limited: limited && read >= NEAR_LIMIT * top,
    })
}

/// Whether two recordings may be of one impact, by what is reported of them.
fn same_impact(c: &Campaign, a: &Recording, other: &Campaign, b: &Recording) -> bool {
    let speeds = |x: Option<(f64, f64)>, y: Option<(f64, f64)>| match (x, y) {
        (Some((x, s)), Some((y, t))) => (x - y).abs() <= SPEEDS * s.hypot(t) + 1e-9 * x.abs(),
        _ => x.is_none() && y.is_none(),
    };
    let level = |c: &Campaign, r: &Recording| c.levels.get(r.level).map(|l| l.1.clone());
    a.file == b.file
        && level(c, a) == level(other, b)
        && speeds(a.impact_speed, b.impact_speed)
        && speeds(a.start_speed, b.start_speed)
}

/// Mean and interval; None of fewer than two.
fn mean(v: &[f64]) -> Option<Mean> {
    let n = v.len() as f64;
    let t = StudentsT::new(0.0, 1.0, n - 1.0).ok().filter(|_| v.len() > 1)?.inverse_cdf(0.975);
    let value = v.mean();
    let half = t * v.std_dev() / n.sqrt();
    Some(Mean { value, low: value - half, high: value + half })
}

/// The recordings of `other` and `c` that are of the same impacts, in pairs; None unless all of both are.
fn same_impacts<'a>(c: &'a Campaign, other: &'a Campaign) -> Option<Vec<(&'a Recording, &'a Recording)>> {
    if other.folder == c.folder || other.kind != c.kind || other.moving_mass != c.moving_mass {
        return None;
    }
    let of = |r| other.recordings.iter().find(|o| same_impact(c, r, other, o));
    let pairs: Vec<_> = c.recordings.iter().filter_map(|r| Some((of(r)?, r))).collect();
    (pairs.len() == c.recordings.len() && pairs.len() == other.recordings.len()).then_some(pairs)
}

/// Whether two campaigns read the same impacts: then the answer of each depends on the other.
pub fn are_of_same_impacts(c: &Campaign, other: &Campaign) -> bool {
    same_impacts(c, other).is_some()
}

/// `c` against every campaign of `others` that read the same impacts on the same channel.
pub fn against(c: &Campaign, others: &[Campaign]) -> Vec<Against> {
    let mut found = Vec::new();
    for other in others {
        let Some(pairs) = same_impacts(c, other) else { continue };
        for channel in [Channel::Force, Channel::Acceleration] {
            let own: Vec<&Vec<f64>> =
                c.recordings.iter().filter_map(|r| r.channels[channel.index()].as_ref()).collect();
            let top = own.iter().map(|y| largest(y)).fold(0.0, f64::max);
            let limited = own.iter().any(|y| flat(y, top));
            let readings: Option<Vec<Reading>> =
                pairs.iter().map(|(a, b)| reading(a, b, channel, top, limited)).collect();
            let Some(readings) = readings else { continue };
            let of = |f: fn(&Reading) -> f64| mean(&readings.iter().map(f).collect::<Vec<_>>());
            if let (Some(lag), Some(gain)) = (of(|r| r.lag), of(|r| r.gain)) {
                found.push(Against { other: other.folder.clone(), channel, lag, gain, readings });
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use record::Kind;

    /// Steps simulated between two samples.
    const FINE: usize = 16;

    /// Half sines of three heights and of `duration` s, seen for 10 ms by a sensor behind a lag of `tau` s with a limit,
    /// every `dt` s.
    fn campaign(folder: &str, duration: f64, tau: f64, dt: f64, limit: f64) -> Campaign {
        let recordings = [200.0, 300.0, 400.0].iter().enumerate().map(|(i, peak)| {
            let fine = dt / FINE as f64;
            let at = |k: usize| {
                let t = (k as f64 * fine - 1e-3 - 3e-4 * i as f64) / duration;
                peak * (std::f64::consts::PI * t.clamp(0.0, 1.0)).sin()
            };
            let mut y: Vec<f64> = (0..(0.01 / fine) as usize).map(at).collect();
            if tau > 0.0 {
                pole(&mut y, 1.0 / tau, fine);
            }
            let y: Vec<f64> = y.chunks(FINE).map(|c| c[0].clamp(-limit, limit)).collect();
            let time = (0..y.len()).map(|k| k as f64 * dt).collect();
            Recording {
                order: i as f64 + 1.0,
                level: i,
                impact_speed: Some((1.0, 0.01)),
                rows: record::Rows::alike(Vec::new()),
                ..Recording::of(&format!("r{i}.csv"), time, [None, Some(y), None])
            }
        });
        Campaign { moving_mass: Some(1.0), ..Campaign::of(folder, Kind::DropTest, recordings.collect()) }
    }

    const NONE: f64 = f64::INFINITY;

    #[test]
    fn a_lag_behind_the_other_sensor_is_found_and_the_peaks_beyond_the_limit_with_it() {
        let plain = campaign("plain", 4e-3, 0.0, 1e-4, NONE);
        let slow = campaign("slow", 4e-3, 3e-4, 1e-4, 250.0);
        let found = against(&slow, std::slice::from_ref(&plain));
        assert_eq!(found.len(), 1);
        let a = &found[0];
        assert!(a.lags() && (a.lag.value - 3e-4).abs() < 1e-5, "{a:?}");
        assert!((a.gain.value - 1.0).abs() < 1e-3, "{a:?}");
        assert_eq!(a.readings.iter().map(|r| r.limited).collect::<Vec<_>>(), [false, true, true]);
        let free = campaign("free", 4e-3, 3e-4, 1e-4, NONE);
        for (r, unlimited) in a.readings.iter().zip(&free.recordings) {
            let peak = unlimited.channels[1].as_ref().unwrap().iter().cloned().fold(0.0, f64::max);
            assert!((r.expected / peak - 1.0).abs() < 2e-3, "{r:?} {peak}");
        }
    }

    #[test]
    fn sensors_alike_lag_behind_neither_however_finely_they_sample() {
        for dt in [1e-4, 2e-4, 2.5e-4] {
            let both = [campaign("a", 4e-3, 0.0, 1e-4, NONE), campaign("b", 4e-3, 0.0, dt, NONE)];
            let found: Vec<Against> = both.iter().flat_map(|c| against(c, &both)).collect();
            assert!(found.len() == 2 && found.iter().all(|f| !f.lags()), "{dt}: {found:?}");
        }
    }

    #[test]
    fn noise_of_the_other_sensor_is_not_taken_for_a_lag() {
        let noisy = |folder: &str, tau: f64, seed: f64| {
            let mut c = campaign(folder, 4e-3, tau, 1e-4, NONE);
            for (r, k) in c.recordings.iter_mut().zip([1.0, 2.0, 3.0]) {
                let y = r.channels[1].as_mut().unwrap();
                // sines of phases far apart: as good as white
                y.iter_mut().enumerate().for_each(|(i, v)| *v += 3.0 * (seed * (i * i) as f64 + k).sin());
            }
            c
        };
        let plain = noisy("plain", 0.0, 0.7);
        let alike = against(&noisy("alike", 0.0, 1.9), std::slice::from_ref(&plain));
        assert!(alike.len() == 1 && !alike[0].lags() && alike[0].lag.low < 0.0, "{alike:?}");
        let slow = against(&noisy("slow", 3e-4, 1.9), std::slice::from_ref(&plain));
        assert!(slow[0].lags() && (slow[0].lag.value - 3e-4).abs() < 5e-5, "{slow:?}");
    }

    #[test]
    fn other_impacts_are_not_compared() {
        let a = campaign("a", 4e-3, 0.0, 1e-4, NONE);
        // a pulse a quarter longer is another impact, whatever its file is called
        assert!(against(&a, &[campaign("b", 5e-3, 0.0, 1e-4, NONE)]).is_empty());
        let mut faster = campaign("c", 4e-3, 0.0, 1e-4, NONE);
        faster.recordings[1].impact_speed = Some((1.1, 0.01));
        assert!(against(&a, &[faster]).is_empty());
    }
}
