//! Finds impacts in a course of samples: what stands out of the noise, and which of it is one drop with its bounces.

use crate::amount::brief;
use crate::envelope::{Bucket, Envelope};
use record::release::{falls, release};
use record::{Channel, GRAVITY};

/// Times the noise that an impact has to reach.
pub(crate) const STANDS_OUT: f64 = 8.0;
/// Share of the largest reading below which nothing is an impact: a channel's zero wanders.
const WANDERS: f64 = 0.02;
/// What an accelerometer reads without an impact, from free fall to rest and some more, m/s^2.
const NO_IMPACT: f64 = 1.5 * GRAVITY;
/// Share of gravity by which an accelerometer at rest may miss it: it is off by its zero, and tilted.
const AT_REST: f64 = 0.2;
/// Share of the buckets, at least, that are quiet; and the standard deviations that a third of a normal sample spans.
const QUIET: usize = 3;
const SPAN: f64 = 0.861;
/// Buckets below the level that part two runs.
const GAP: usize = 4;
/// Rows in a bucket from which its own scatter gives the noise.
const MANY: u64 = 8;
/// Longest time from one contact of a drop to the next, s: a body bounces half a metre up in 0.64 s.
const FLIGHT: f64 = 1.0;
/// Share of the first contact's peak from which a later one is no bounce.
const NO_BOUNCE: f64 = 0.95;
/// Factor by which an impact exceeds what its release did shortly before it.
const RELEASE: f64 = 2.0;

/// Noise and zero of the channel that shows the impacts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Level {
    pub channel: Channel,
    /// Reading without an impact, SI: at rest, or of an accelerometer that weighs in free fall.
    pub base: f64,
    /// Standard deviation of the noise, SI.
    pub noise: f64,
    /// Distance from `base` from which readings stand out, SI.
    pub level: f64,
    /// Whether it is an accelerometer that reads one g more at rest than in free fall.
    pub weighs: bool,
}

impl Level {
    /// That of samples whose rest `base` and noise are known, SI.
    pub(crate) fn of(channel: Channel, base: f64, noise: f64, y: &[f64]) -> Level {
        let peak = y.iter().map(|v| (v - base).abs()).fold(0.0, f64::max);
        Level { channel, base, noise, level: (STANDS_OUT * noise).max(WANDERS * peak), weighs: false }
    }

    /// How far a bucket, or three samples in a row, reach from the base.
    fn reach(&self, b: &Bucket) -> f64 {
        (b.high3 - self.base).max(self.base - b.low3)
    }

    /// Whether three samples in a row in a bucket, or those that end in it, are of free fall.
    fn falls(&self, b: &Bucket) -> bool {
        [b.mean, b.low3, b.high3].iter().all(|v| falls(v - self.base))
    }
}

/// A drop: its first contact, and the bounces after it.
#[derive(Clone, Debug, PartialEq)]
pub struct Drop {
    /// Rows of each contact: the first, and the one behind the last.
    pub contacts: Vec<(u64, u64)>,
    /// When the first begins, and how long it lasts, s.
    pub at: f64,
    pub length: f64,
    /// Largest distance from the base, SI.
    pub peak: f64,
    /// Row from which on something pushes that begins in no fall: a body under water, a second stop, a hand.
    pub until: Option<u64>,
}

/// What was found in a course.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// None where no channel shows an impact.
    pub level: Option<Level>,
    pub drops: Vec<Drop>,
    /// What stands out but is no drop to take, and why.
    pub left: Vec<String>,
}

/// Base and noise of buckets: the shortest interval that holds a third of their means (Grübel 1988) is quiet.
fn quiet(buckets: &[Bucket], rows: u64) -> Option<(f64, f64)> {
    let held = || buckets.iter().filter(|b| b.holds());
    let mut means: Vec<f64> = held().map(|b| b.mean).collect();
    means.sort_by(f64::total_cmp);
    let third = means.len().div_ceil(QUIET);
    if third < 4 {
        return None;
    }
    let width = |i: usize| means[i + third - 1] - means[i];
    let at = (0..=means.len() - third).min_by(|a, b| width(*a).total_cmp(&width(*b)))?;
    let base = means[at..at + third].iter().sum::<f64>() / third as f64;
    let mut noise = width(at) / SPAN;
    if rows >= MANY {
        let mut scatters: Vec<f64> = held().map(Bucket::scatter).collect();
        scatters.sort_by(f64::total_cmp);
        noise = noise.max(scatters[scatters.len() / QUIET]);
    }
    Some((base, noise))
}

/// The level of a channel, where something stands out in it. `times`: of the buckets, s.
fn level(channel: Channel, buckets: &[Bucket], times: &[f64], rows: u64) -> Option<Level> {
    let (base, noise) = quiet(buckets, rows)?;
    // at rest an accelerometer reads one g more than while it falls: neither is an impact
    let released = || {
        let held = buckets.iter().zip(times).filter(|(b, _)| b.holds());
        let (time, means): (Vec<f64>, Vec<f64>) = held.map(|(b, t)| (*t, b.mean)).unzip();
        release(&time, &means, &[1.0, -1.0])
    };
    let fall = if channel == Channel::Acceleration {
        let weighs = || ((base.abs() / GRAVITY - 1.0).abs() < AT_REST).then_some(0.0);
        released().map(|r| r.fall).or_else(weighs)
    } else {
        None
    };
    let mut level = Level { channel, base: fall.unwrap_or(base), noise, level: 0.0, weighs: fall.is_some() };
    let peak = buckets.iter().map(|b| level.reach(b)).fold(0.0, f64::max);
    let least = match channel {
        Channel::Acceleration if level.weighs => NO_IMPACT,
        Channel::Acceleration => NO_IMPACT.min(peak / 4.0),
        _ => 0.0,
    };
    level.level = (STANDS_OUT * noise).max(WANDERS * peak).max(least);
    (peak > level.level).then_some(level)
}

/// A run of buckets above the level: first, last, largest distance.
struct Run {
    first: usize,
    last: usize,
    peak: f64,
}

fn runs(buckets: &[Bucket], level: &Level, rows: u64) -> Vec<Run> {
    let gap = if rows == 1 { GAP } else { 1 };
    let mut runs: Vec<Run> = Vec::new();
    for (i, b) in buckets.iter().enumerate() {
        let reach = level.reach(b);
        // of a bucket without samples it is minus infinity
        if reach <= level.level {
            continue;
        }
        // what is missing in a contact does not part it
        let apart = |r: &Run| buckets[r.last + 1..i].iter().filter(|b| b.holds()).count() < gap;
        match runs.last_mut() {
            Some(r) if apart(r) => (r.last, r.peak) = (i, r.peak.max(reach)),
            _ => runs.push(Run { first: i, last: i, peak: reach }),
        }
    }
    runs
}

/// Whether a run of readings that peaks at `peak` and lasts `length` is a bump right before another, the contact: that is as far harder
/// as an impact is than what comes shortly before it, longer, and begins after a `pause` shorter than it lasts itself. All lengths
/// in one unit.
fn is_bump((peak, length): (f64, f64), (next_peak, next_length): (f64, f64), pause: f64) -> bool {
    next_peak > RELEASE * peak && next_length > length && pause < next_length
}

/// Which runs begin in a fall, where an accelerometer tells that: the push rises from it no longer than the body fell, or than the
/// run lasts; or nothing was read before. All, where no run does: the body is guided or driven, and falls freely nowhere. `rows`: in
/// a bucket.
fn begin_in_a_fall(buckets: &[Bucket], level: &Level, runs: &[Run], rows: u64) -> Vec<bool> {
    // three in a row end at the third
    let ahead = if rows == 1 { 2 } else { 0 };
    let ends = std::iter::once(0).chain(runs.iter().map(|r| r.last + 1));
    let begins = |(from, r): (usize, &Run)| {
        let before = &buckets[from..r.first];
        let is_first = from == 0 && before.iter().filter(|b| b.holds()).count() < 3;
        let falls = before.iter().filter(|b| level.falls(b)).count();
        let lasts = r.last + 1 - r.first + 2 * ahead;
        let rises = before.iter().rev().position(|b| level.falls(b));
        is_first || rises.is_some_and(|rises| rises <= falls.max(lasts))
    };
    let begin: Vec<bool> = ends.zip(runs).map(begins).collect();
    if level.weighs && begin.contains(&true) {
        begin
    } else {
        vec![true; runs.len()]
    }
}

/// Finds the drops in a course whose first row is `from`. `least`: share of the largest impact that another has to reach.
pub fn find(e: &Envelope, from: u64, least: f64) -> Found {
    let shows = |c: Channel| level(c, e.buckets(c.index())?, &e.times, e.rows);
    let Some(level) = [Channel::Force, Channel::Acceleration].into_iter().find_map(shows) else {
        return Found::default();
    };
    let buckets = e.buckets(level.channel.index()).unwrap_or(&[]);
    let runs = runs(buckets, &level, e.rows);
    let begin = begin_in_a_fall(buckets, &level, &runs, e.rows);
    let end = |i: usize| e.times.get(i + 1).or(e.times.last()).copied().unwrap_or(0.0);
    let mut all: Vec<Drop> = Vec::new();
    // what stands out right before a contact, and is shorter
    let mut before: Vec<Drop> = Vec::new();
    // what begins in no fall
    let mut beside: Vec<Drop> = Vec::new();
    // what a bounce of the last drop is weaker than; None once something else was done to the body
    let mut hardest: Option<f64> = None;
    let mut ended = f64::NEG_INFINITY;
    for (r, begins_in_a_fall) in runs.iter().zip(begin) {
        // three in a row end at the third
        let first = (from + e.rows * r.first as u64).saturating_sub(2).max(from);
        let rows = (first, from + e.rows * (r.last as u64 + 1));
        let at = e.times[r.first];
        let drop = Drop { contacts: vec![rows], at, length: end(r.last) - at, peak: r.peak, until: None };
        // nothing falls once more within the time that a contact lasts: another hump of the same impact
        let is_hump = |d: &Drop| at - ended < d.length.max(drop.length);
        let soon = at - ended < FLIGHT;
        let bounces = soon && hardest.is_some_and(|h| r.peak < NO_BOUNCE * h);
        match all.last_mut() {
            Some(d) if d.until.is_none() && is_bump((d.peak, d.length), (drop.peak, drop.length), at - ended) => {
                hardest = Some(drop.peak);
                before.push(std::mem::replace(d, drop));
            }
            Some(d) if d.until.is_none() && is_hump(d) => {
                d.peak = d.peak.max(r.peak);
                hardest = hardest.map(|h| h.max(r.peak));
                d.contacts.push(rows);
            }
            last if !begins_in_a_fall => {
                last.into_iter().for_each(|d| d.until = d.until.or(Some(rows.0)));
                hardest = hardest.filter(|_| soon).map(|h| h.max(r.peak));
                match beside.last_mut().filter(|o| at - o.at - o.length < FLIGHT) {
                    Some(o) => (o.length, o.peak) = (end(r.last) - o.at, o.peak.max(r.peak)),
                    None => beside.push(drop),
                }
            }
            // behind what is no part of the drop
            Some(d) if bounces && d.until.is_some() => {}
            Some(d) if bounces => d.contacts.push(rows),
            _ => {
                hardest = Some(drop.peak);
                all.push(drop);
            }
        }
        ended = end(r.last);
    }
    let largest = all.iter().map(|d| d.peak).fold(0.0, f64::max);
    let unit = level.channel.unit();
    let why = "right before a far harder one: no contact of its own";
    let mut left: Vec<String> =
        before.iter().map(|d| format!("{} {unit} at {} s, {why}", brief(d.peak), brief(d.at))).collect();
    let no_fall = beside.iter().filter(|d| d.peak >= least * largest);
    left.extend(no_fall.map(|d| {
        format!("{} {unit} from {} s on, where nothing falls before: no contact of its own", brief(d.peak), brief(d.at))
    }));
    let mut drops = Vec::new();
    for (i, d) in all.iter().enumerate() {
        let next = all.get(i + 1).filter(|n| n.at - d.at < FLIGHT && n.peak > RELEASE * d.peak);
        if next.is_some() {
            let why = "shortly before a far harder one: no drop of its own";
            left.push(format!("{} {unit} at {} s, {why}", brief(d.peak), brief(d.at)));
        } else if d.peak < least * largest {
            let share = brief(100.0 * d.peak / largest);
            left.push(format!(
                "{} {unit} at {} s, {share} % of the hardest impact: --least takes it",
                brief(d.peak),
                brief(d.at)
            ));
        } else {
            drops.push(d.clone());
        }
    }
    Found { level: Some(level), drops, left }
}

/// Contacts in samples as they are.
#[derive(Clone, Debug, PartialEq)]
pub struct Contact {
    /// First sample, and the last, of the first contact.
    pub first: usize,
    pub last: usize,
}

/// The first contact among samples of the channel of `level`; None where no three in a row reach it.
pub fn contact(y: &[f64], level: &Level) -> Option<Contact> {
    let far = |v: f64| (v - level.base).abs() > level.level;
    let sides = |w: &[f64]| w.iter().all(|v| far(*v) && (*v > level.base) == (w[0] > level.base));
    let first = y.windows(3).position(sides)?;
    let mut last = first;
    for (i, v) in y.iter().enumerate().skip(first) {
        if far(*v) {
            last = i;
        } else if i - last > GAP {
            break;
        }
    }
    Some(Contact { first, last })
}

/// The contact that is the main event among samples of the channel of `level`: the first that is no bump right before another. None
/// where no three samples in a row reach the level.
pub fn main_contact(y: &[f64], level: &Level) -> Option<Contact> {
    let mut all: Vec<(Contact, f64)> = Vec::new();
    let mut from = 0;
    while let Some(k) = contact(&y[from..], level) {
        let k = Contact { first: from + k.first, last: from + k.last };
        from = k.last + 1;
        let peak = y[k.first..=k.last].iter().map(|v| (v - level.base).abs()).fold(0.0, f64::max);
        all.push((k, peak));
    }
    let of = |(k, peak): &(Contact, f64)| (*peak, (k.last - k.first) as f64);
    let bump = |(i, k): (usize, &(Contact, f64))| {
        all[i + 1..].iter().any(|next| is_bump(of(k), of(next), (next.0.first - k.0.last) as f64))
    };
    let main = all.iter().enumerate().position(|k| !bump(k))?;
    Some(all.swap_remove(main).0)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Noise of standard deviation 1 or so, the same every time.
    pub(crate) fn noise(i: u64) -> f64 {
        let mut z = (i + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        3.46 * ((z >> 11) as f64 / (1u64 << 53) as f64 - 0.5)
    }

    /// Sum of half sines, each (row, rows, peak), in row `i`.
    fn half_sines(i: u64, pulses: &[(u64, u64, f64)]) -> f64 {
        let at = pulses.iter().filter(|p| (p.0..p.0 + p.1).contains(&i));
        at.map(|p| p.2 * (std::f64::consts::PI * (i - p.0) as f64 / p.1 as f64).sin()).sum()
    }

    /// A course of one channel: noise and half sines, each (row, rows, peak).
    fn course(channel: Channel, n: u64, step: f64, base: f64, pulses: &[(u64, u64, f64)]) -> Found {
        let mut has = [false; 3];
        has[channel.index()] = true;
        let mut e = Envelope::new(has);
        for i in 0..n {
            let mut row = [f64::NAN; 3];
            row[channel.index()] = base + noise(i) + half_sines(i, pulses);
            e.add(step * i as f64, row);
        }
        find(&e, 0, 0.05)
    }

    #[test]
    fn a_release_from_rest_is_no_touch() {
        // at rest it reads gravity, in the fall nothing, and then the impact
        let n = 4000u64;
        let mut e = Envelope::new([false, true, false]);
        for i in 0..n {
            let y = match i {
                2000..2400 => 0.3 * noise(i),
                2400..2410 => -150.0,
                _ => -9.8 + 0.01 * noise(i),
            };
            e.add(1e-3 * i as f64, [f64::NAN, y, f64::NAN]);
        }
        let f = find(&e, 0, 0.2);
        assert_eq!(f.drops.len(), 1, "{f:?}");
        assert!((f.drops[0].at - 2.4).abs() < 5e-3 && f.drops[0].length < 0.02, "{f:?}");
    }

    /// A body at rest, let go at row 2000, that touches at 2300, and what pushes on it from there on, m/s^2, by row; 1 kHz. The
    /// accelerometer reads `rest` g at rest.
    fn fallen(rest: f64, push: impl Fn(u64) -> f64) -> Found {
        let mut e = Envelope::new([false, true, false]);
        for i in 0..5000u64 {
            let push = match i {
                0..2000 => 9.81,
                2000..2300 => 0.0,
                _ => push(i - 2300),
            };
            e.add(1e-3 * i as f64, [f64::NAN, push + 9.81 * (rest - 1.0) + 0.05 * noise(i), f64::NAN]);
        }
        find(&e, 0, 0.05)
    }

    #[test]
    fn a_soft_touch_is_found_with_its_bounces_where_the_rest_reads_one_g_and_where_it_is_zero() {
        let half = |i: u64, from: u64, rows: u64, peak: f64| half_sines(i, &[(from, rows, peak)]);
        for rest in [1.0, 0.0] {
            let f = fallen(rest, |i| match i {
                0..100 => half(i, 0, 100, 60.0),
                100..200 => 0.0,
                200..260 => half(i, 200, 60, 40.0),
                260..360 => 0.0,
                // soft: most of its push is less than stands out
                360..430 => half(i, 360, 70, 15.5),
                _ => 9.81,
            });
            assert_eq!((f.drops.len(), f.left.len()), (1, 0), "{rest}: {f:?}");
            assert!((f.drops[0].at - 2.3).abs() < 0.02 && (f.drops[0].peak - 60.0).abs() < 1.0, "{rest}: {f:?}");
            assert_eq!((f.drops[0].contacts.len(), f.drops[0].until), (3, None), "{rest}: {f:?}");
        }
    }

    #[test]
    fn what_slows_a_body_that_does_not_fall_is_no_contact_of_its_own() {
        for rest in [1.0, 0.0] {
            // it dives, is slowed unevenly, and hits the bottom, where it rings; later a hand takes it
            let f = fallen(rest, |i| match i {
                0..10 => 26.0,
                200..210 => 25.0,
                500..510 => 250.0,
                510..515 => 0.0,
                515..520 => 100.0,
                2000..2200 => 17.0,
                _ => 12.0,
            });
            assert_eq!(f.drops.len(), 1, "{rest}: {f:?}");
            let d = &f.drops[0];
            assert!((d.at - 2.3).abs() < 5e-3 && (d.peak - 26.0).abs() < 1.0, "{rest}: {f:?}");
            assert_eq!((d.contacts.len(), d.until), (1, Some(2500)), "{rest}: {f:?}");
            assert!(f.left[0].starts_with("250") && f.left[0].contains("nothing falls before"), "{rest}: {f:?}");
        }
        // guided so that it never falls freely: every contact stands
        let f = fallen(1.0, |i| if (100..110).contains(&i) { 100.0 } else { 9.81 });
        assert_eq!(f.drops.len(), 1, "{f:?}");
    }

    #[test]
    fn a_second_hump_of_an_impact_is_no_drop_of_its_own() {
        // as hard as the first, and within the time that it lasts
        let f = course(Channel::Force, 20_000, 1e-4, 0.0, &[(5_000, 60, 300.0), (5_090, 60, 320.0)]);
        assert_eq!((f.drops.len(), f.drops[0].contacts.len()), (1, 2), "{:?}", f.drops);
        assert!(f.drops[0].peak > 310.0);
    }

    #[test]
    fn a_bump_right_before_the_contact_is_not_the_contact() {
        let pulses = [(5_000, 6, 20.0), (5_012, 120, 600.0), (9_000, 120, 80.0)];
        let f = course(Channel::Force, 20_000, 1e-5, 0.0, &pulses);
        assert_eq!((f.drops.len(), f.drops[0].contacts.len()), (1, 2), "{f:?}");
        assert!(f.drops[0].at > 0.0501 && f.drops[0].length > 1e-3, "{f:?}");
        assert!(f.left[0].contains("no contact of its own"), "{:?}", f.left);
        let y: Vec<f64> = (0..20_000).map(|i| noise(i) + half_sines(i, &pulses)).collect();
        let level = f.level.unwrap();
        assert!(contact(&y, &level).unwrap().first < 5_010);
        let k = main_contact(&y, &level).unwrap();
        assert!(k.first >= 5_012 && k.last > 5_120, "{k:?}");
    }

    #[test]
    fn a_long_contact_is_no_bump_before_a_shorter_and_harder_one() {
        // a body that dives, and is caught
        let pulses = [(5_000, 900, 60.0), (6_500, 200, 300.0)];
        let f = course(Channel::Force, 20_000, 1e-5, 0.0, &pulses);
        assert!(f.drops.len() == 1 && f.drops[0].at < 0.051 && f.left.is_empty(), "{f:?}");
        let y: Vec<f64> = (0..20_000).map(|i| noise(i) + half_sines(i, &pulses)).collect();
        let k = main_contact(&y, &f.level.unwrap()).unwrap();
        assert!(k.first < 5_100 && k.last < 6_000, "{k:?}");
    }

    #[test]
    fn drops_are_parted_and_bounces_stay_with_theirs() {
        let pulses = [(20_000, 60, 500.0), (29_000, 70, 200.0), (120_000, 60, -80.0), (200_000, 50, 510.0)];
        let f = course(Channel::Force, 300_000, 2e-5, 7.0, &pulses);
        let level = f.level.unwrap();
        assert!((level.base - 7.0).abs() < 0.5 && (0.8..1.3).contains(&level.noise), "{level:?}");
        assert_eq!(f.drops.len(), 3, "{:?}", f.drops);
        assert_eq!(f.drops[0].contacts.len(), 2);
        for (d, p) in f.drops.iter().zip([pulses[0], pulses[2], pulses[3]]) {
            assert!(d.contacts[0].0 <= p.0 + 8 && d.contacts[0].0 + 16 > p.0, "{d:?}");
            assert!((d.at - 2e-5 * p.0 as f64).abs() < 4e-4 && d.length < 2e-3);
        }
    }

    #[test]
    fn what_is_small_or_comes_before_is_left_out_and_said() {
        let pulses = [(10_000, 80, 40.0), (70_000, 60, 300.0), (80_000, 60, 900.0)];
        let f = course(Channel::Force, 200_000, 2e-5, 0.0, &pulses);
        assert_eq!((f.drops.len(), f.left.len()), (1, 2), "{f:?}");
        assert!(f.left[0].contains("% of the hardest") && f.left[1].contains("far harder"), "{:?}", f.left);
        // noise alone, and one spike in it
        assert_eq!(course(Channel::Force, 100_000, 2e-5, 0.0, &[]).level, None);
        assert_eq!(course(Channel::Force, 100_000, 2e-5, 0.0, &[(500, 2, 900.0)]).level, None);
    }

    #[test]
    fn samples_missing_in_a_contact_make_no_two_impacts_of_it() {
        let mut e = Envelope::new([true, false, false]);
        for i in 0..20_000u64 {
            let pulse =
                if (9000..9100).contains(&i) { (std::f64::consts::PI * (i - 9000) as f64 / 100.0).sin() } else { 0.0 };
            let y = if (9045..9060).contains(&i) { f64::NAN } else { 500.0 * pulse + noise(i) };
            e.add(2e-5 * i as f64, [y, f64::NAN, f64::NAN]);
        }
        let f = find(&e, 0, 0.05);
        assert_eq!((f.drops.len(), f.drops[0].contacts.len()), (1, 1), "{:?}", f.drops);
    }

    #[test]
    fn rest_and_free_fall_are_no_impact() {
        let mut e = Envelope::new([false, true, false]);
        for i in 0..200_000u64 {
            let base = if (100_000..110_000).contains(&i) { 0.0 } else { -9.81 };
            let pulse = if (110_000..110_050).contains(&i) { -600.0 } else { 0.0 };
            e.add(2e-5 * i as f64, [f64::NAN, base + pulse + 0.05 * noise(i), f64::NAN]);
        }
        let f = find(&e, 0, 0.05);
        assert_eq!(f.drops.len(), 1);
        assert!((f.drops[0].at - 2.2).abs() < 1e-3 && f.drops[0].length < 2e-3, "{:?}", f.drops);
    }

    #[test]
    fn a_contact_among_samples_is_exact() {
        let y: Vec<f64> = (0..1000u64).map(|i| noise(i) + if (400..450).contains(&i) { -60.0 } else { 0.0 }).collect();
        let level = Level { channel: Channel::Force, base: 0.0, noise: 1.0, level: 8.0, weighs: false };
        assert_eq!(contact(&y, &level), Some(Contact { first: 400, last: 449 }));
        assert_eq!(contact(&y[..402], &level), None);
    }
}
