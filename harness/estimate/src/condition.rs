//! From a campaign to conditioned data: scales, noise, first guesses. Nothing is fitted yet.

use crate::budget::Budget;
use crate::impact::{impact, pulse, push_of, Impact, Pulse};
use crate::problem::{Data, Record, Scales, TILT_SHARE};
use crate::smooth::{corners, smooth_between};
use mechanisms::load_history::LoadHistory;
use plant::machine::{Impact as Impacted, Machine, Seat};
use plant::noise::{Noise, Stretch};
use plant::simulate::Setup;
use record::statistics::{median, spread, spread_of_course};
use record::{self, Campaign, Channel, Kind, Recording};
use std::ops::Range;
use std::sync::Arc;

/// Why a campaign cannot be judged.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct Invalid(pub String);

/// First guess of the law by scaling arguments.
#[derive(Clone, Copy, Debug)]
pub struct Guess {
    pub k: f64,
    pub p: f64,
}

/// Standard deviation of the stiffness between repeats, as a logarithm.
const REPEATS: f64 = 0.006;

/// Samples on either side over which the step of time at one is taken.
const STAMPS: usize = 8;

/// Share of the noise's low frequencies below which what precedes the impact is believed alone.
const CALM: f64 = 0.5;

/// Imposes on a recording's body the penetration read, smoothed between its corners; `sigma`, m: standard deviation of its
/// noise at low frequency. What is left out of the reading is taken from its neighbours. Returns the samples beside a corner:
/// their rate may be that of either side.
pub fn impose(record: &mut Record, sigma: f64) -> Vec<usize> {
    let i = Channel::Penetration.index();
    let Some(read) = &record.y[i] else { return Vec::new() };
    let mut read = read.clone();
    for k in (0..read.len()).filter(|k| record.weight[i][*k] == 0.0) {
        if let Some(v) = by_neighbours(&read, k) {
            read[k] = v;
        }
    }
    let read = &read;
    let time = &record.setup.time;
    // the step around a sample: stamps scatter, and machines change how often they read
    let step = |i: usize| {
        let (a, b) = (i.saturating_sub(STAMPS), (i + STAMPS).min(time.len() - 1));
        (time[b] - time[a]) / (b - a) as f64
    };
    let corners = corners(read, sigma);
    let (path, slope) = smooth_between(read, &corners, sigma);
    record.setup.imposed = path;
    let rate = slope.iter().enumerate().map(|(i, v)| v / step(i)).collect();
    record.setup.imposed_rate = rate;
    corners.into_iter().flat_map(|c| c - 1..=c + 1).collect()
}

/// Sample `k` of a smooth course by the cubic through the two on either side; None at its ends.
pub(crate) fn by_neighbours(y: &[f64], k: usize) -> Option<f64> {
    (k >= 2 && k + 2 < y.len()).then(|| (4.0 * (y[k - 1] + y[k + 1]) - y[k - 2] - y[k + 2]) / 6.0)
}

/// Standard deviations of white noise by which a sample and the cubic through its neighbours differ.
pub(crate) const BY_NEIGHBOURS: f64 = 1.4;
/// Standard deviations of that difference from which a sample is a spike, and steps of the course from one sample to the
/// next: a corner differs by less than one.
const SPIKE: f64 = 6.0;
const SPIKE_STEPS: f64 = 3.0;

/// One of how many samples may be a spike at most: what sticks out more often belongs to what was recorded.
const RARE: usize = 50;
/// Samples beside each other that may be spikes at most: a spike on the edge between two samples is in both, and no more.
const BESIDE: usize = 2;

/// Of the samples `found` to stick out of a course of so many those that stand alone: no more than two beside each other, and few in
/// all. A run of them is a course of its own, and what sticks out everywhere is a ringing that was sampled coarsely.
pub(crate) fn that_stand_alone(mut found: Vec<usize>, samples: usize) -> Vec<usize> {
    found.sort_unstable();
    let alone: Vec<usize> =
        found.chunk_by(|a, b| b - a == 1).filter(|run| run.len() <= BESIDE).flatten().copied().collect();
    if alone.len() > (samples / RARE).max(BESIDE) {
        return Vec::new();
    }
    alone
}

/// Samples of a smooth course that stand alone, far outside its noise of standard deviation `sigma`.
pub fn spikes_of_course(y: &[f64], sigma: f64) -> Vec<usize> {
    let mut y = y.to_vec();
    let mut found = Vec::new();
    // the largest first: beside it others look large as well
    while found.len() < y.len() / RARE {
        let off = |k: usize| by_neighbours(&y, k).map(|v| (k, v, (y[k] - v).abs()));
        let Some((k, v, off)) = (0..y.len()).filter_map(off).max_by(|a, b| a.2.total_cmp(&b.2)) else { break };
        let near = k.saturating_sub(8)..(k + 8).min(y.len() - 1);
        let step = median(near.map(|j| (y[j + 1] - y[j]).abs()).collect());
        if off <= (SPIKE * BY_NEIGHBOURS * sigma).max(SPIKE_STEPS * step) {
            break;
        }
        y[k] = v;
        found.push(k);
    }
    that_stand_alone(found, y.len())
}

/// The largest of these.
fn highest(y: &[f64]) -> f64 {
    y.iter().copied().fold(f64::MIN, f64::max)
}

/// The power of `x` that `y` grows with, by a straight line of their logarithms; None where `x` hardly differs.
fn power(x: &[f64], y: &[f64]) -> Option<f64> {
    let ln = |v: &[f64]| v.iter().map(|v| v.max(1e-12).ln()).collect::<Vec<f64>>();
    let (x, y) = (ln(x), ln(y));
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (mx, my) = (mean(&x), mean(&y));
    let sxx: f64 = x.iter().map(|v| (v - mx).powi(2)).sum();
    let sxy: f64 = x.iter().zip(&y).map(|(a, b)| (a - mx) * (b - my)).sum();
    (sxx > 1e-3).then(|| sxy / sxx)
}

/// A campaign's recordings with their scales and noise, and a first guess of the law.
#[derive(Clone)]
pub struct Conditioned {
    pub data: Data,
    pub guess: Guess,
    /// Channels whose noise could not be estimated from stretches in which nothing touches, which are too short: it is taken for
    /// white, and may be wider and slower.
    pub unsure: [bool; 3],
}

/// Conditions a campaign's recordings.
///
/// # Errors
/// When the recordings hold no impact, or the noise cannot be estimated.
pub fn condition(c: &Campaign) -> Result<Conditioned, Invalid> {
    condition_on(c, None)
}

/// Conditions a campaign's recordings, which `machine` simulates where no rig of ours does.
///
/// # Errors
/// As [`condition`]; or there is no machine.
pub fn condition_on(c: &Campaign, machine: Option<&Arc<dyn Machine>>) -> Result<Conditioned, Invalid> {
    if c.kind == Kind::System && machine.is_none() {
        return Err(Invalid("this command simulates no systems of FMUs; `touchdown diagnose` does".into()));
    }
    let impacts: Vec<_> = (0..c.recordings.len()).map(|r| machine.and_then(|m| m.facts().impacts[r])).collect();
    let mass = c.moving_mass.unwrap_or(1.0);
    let mut records = Vec::new();
    let mut range = [0.0f64; 3];
    let mut lasts = Vec::new();
    let mut quiet = Vec::new();
    let mut peaks = Vec::new();
    let mut depths: Vec<f64> = Vec::new();
    for (at, r) in c.recordings.iter().enumerate() {
        for (k, ch) in r.channels.iter().enumerate() {
            if let Some(y) = ch {
                range[k] = range[k].max(record::range(y));
            }
        }
        let Impact { push, pulse: pu } =
            impact(c.kind, r, mass).map_err(|why| Invalid(format!("{}: {why}", r.file)))?;
        // a pull is contact as well where nothing but contact makes force
        let touching: Vec<f64> =
            if c.kind == Kind::Indentation { push.iter().map(|v| v.abs()).collect() } else { push };
        quiet.push(quiet_stretches(&touching, pu.level, &pu));
        lasts.push((pu.first, pu.last));
        peaks.push(if r.channels[0].is_some() || r.channels[1].is_some() { pu.peak } else { f64::NAN });
        let n = r.time.len();
        records.push(Record {
            setup: Setup {
                kind: c.kind,
                time: r.time.clone(),
                began: r.all_times()[0],
                history: LoadHistory::default(),
                travel: c.travel.unwrap_or(0.0),
                preload: r.spring_preload.unwrap_or(0.0),
                rate: c.return_spring_rate.unwrap_or(0.0),
                imposed: Vec::new(),
                imposed_rate: Vec::new(),
                depth: 1.0,
                speed: 1.0,
                duration: 1.0,
                machine: machine.map(|m| Seat { machine: m.clone(), set: at, level: 0 }),
                control: plant::integrate::Control::dense(plant::simulate::tolerance(c.kind)),
            },
            file: r.file.clone(),
            whole: r.whole.clone(),
            level: r.level,
            y: r.channels.clone(),
            off_path: Vec::new(),
            beside_corners: Vec::new(),
            weight: [vec![1.0; n], vec![1.0; n], vec![1.0; n]],
            speed: if c.kind == Kind::DropTest { r.impact_speed.or(r.start_speed) } else { None },
            at_first: r.impact_speed.is_none() && r.start_speed.is_some(),
            start: match c.kind {
                Kind::ContactorOpening => r.begins(),
                Kind::System => began(r, r.time[pu.first], impacts[at].as_ref()),
                _ => r.time[pu.first],
            },
        });
    }
    let readings: Vec<_> = c.recordings.iter().map(|r| r.channels.clone()).collect();
    let (noise, unsure) = noise_of(c.kind, &readings, &quiet, &range);
    if c.kind == Kind::Indentation {
        let sigma = noise[2].low_frequency();
        for (r, rec) in c.recordings.iter().zip(&mut records) {
            if r.channels[2].is_none() {
                return Err(Invalid(format!("{}: no penetration", r.file)));
            }
            impose(rec, sigma);
            depths.push(rec.setup.imposed.iter().cloned().fold(f64::MIN, f64::max));
        }
    }
    let count = records.len() as f64;
    let length = median(c.recordings.iter().map(|r| r.time[r.time.len() - 1] - r.time[0]).collect());
    let dt = median(
        c.recordings.iter().map(|r| (r.time[r.time.len() - 1] - r.time[0]) / (r.time.len() - 1) as f64).collect(),
    );
    let duration =
        median(c.recordings.iter().zip(&lasts).map(|(r, (a, b))| (r.time[*b] - r.time[*a]).max(3.0 * dt)).collect());
    let speeds: Vec<f64> = c
        .recordings
        .iter()
        .zip(&records)
        .zip(&impacts)
        .map(|((r, d), impact)| match c.kind {
            Kind::System => impact.map_or(1.0, |i| i.speed).max(1e-6),
            Kind::DropTest => d.speed.map_or(1.0, |s| s.0).max(1e-6),
            Kind::ContactorOpening => {
                let travel = c.travel.unwrap_or(1e-3);
                let s = r.spring_preload.unwrap_or(1.0) * travel
                    - 0.5 * c.return_spring_rate.unwrap_or(0.0) * travel * travel;
                (2.0 * s.max(1e-9) / mass).sqrt()
            }
            Kind::Indentation => {
                let top = d.setup.imposed_rate.iter().map(|v| v.abs()).fold(0.0, f64::max);
                if top > 0.0 {
                    top
                } else {
                    1.0
                }
            }
        })
        .collect();
    // of a body that is caught its way alone is read: the deepest reading takes the place of the largest force
    let ways: Option<Vec<f64>> = c
        .recordings
        .iter()
        .map(|r| match &r.channels {
            [None, None, Some(x)] if c.kind == Kind::DropTest => Some(highest(x)).filter(|x| *x > 0.0),
            _ => None,
        })
        .collect();
    let exponent_by_way = |x: &[f64]| power(&speeds, x).map_or(1.2, |slope| 2.0 / slope.clamp(0.4, 2.0) - 1.0);
    let forces: Vec<f64> = match &ways {
        // m v^2 / 2 = F x / (p + 1)
        Some(x) => {
            let p = exponent_by_way(x).clamp(1.0, 3.5);
            speeds.iter().zip(x).map(|(v, x)| 0.5 * mass * v * v * (p + 1.0) / x).collect()
        }
        None => {
            let force = |p: &f64| if p.is_finite() && *p > 0.0 { *p } else { mass * speeds[0] / duration };
            peaks.iter().map(force).collect()
        }
    };
    let peak = forces.iter().cloned().fold(0.0, f64::max);
    // p from how the peak grows with speed (or depth), or how depth grows with speed; k from energy (or depth)
    let is_indentation = c.kind == Kind::Indentation;
    let p = match &ways {
        Some(x) => exponent_by_way(x),
        None if is_indentation => power(&depths, &forces).unwrap_or(1.5),
        None => {
            let slope = power(&speeds, &forces).unwrap_or(1.2);
            slope / (2.0 - slope).max(0.2)
        }
    }
    .clamp(1.0, 3.5);
    let mid = forces.len() / 2;
    let mut order: Vec<usize> = (0..forces.len()).collect();
    order.sort_by(|a, b| forces[*a].total_cmp(&forces[*b]));
    let m = order[mid];
    let depth_of = |i: usize| match is_indentation {
        true => depths[i],
        // m v^2 / 2 = F x / (p + 1)
        false => 0.5 * mass * speeds[i] * speeds[i] * (p + 1.0) / forces[i],
    };
    let depth = depth_of(m);
    if !(depth > 0.0 && depth.is_finite() && forces[m] > 0.0) {
        return Err(Invalid("the recordings hold no impact whose depth could be estimated".into()));
    }
    let k = forces[m] / depth.powf(p);
    let orders: Vec<f64> = c.recordings.iter().map(|r| r.order).collect();
    let histories = LoadHistory::before(&orders, if is_indentation { &depths } else { &speeds });
    for (i, r) in records.iter_mut().enumerate() {
        r.setup.history = histories[i];
        r.setup.depth = depth * (forces[i] / forces[m]).max(0.2);
        r.setup.speed = speeds[i];
        r.setup.duration = duration;
    }
    // as read, or where no depth is, as the energy has it
    let deepest_of = |r: &Recording| r.channels[Channel::Penetration.index()].as_deref().map_or(0.0, highest);
    let read = c.recordings.iter().map(deepest_of).fold(0.0, f64::max);
    let deepest = if read > 0.0 { read } else { (0..forces.len()).map(depth_of).fold(0.0, f64::max) };
    let scales = Scales {
        force: forces[m],
        depth,
        speed: speeds[m],
        duration,
        mass,
        length,
        dt,
        x_ref: 0.6 * depth,
        v_ref: speeds[m],
        orders: count,
        peak,
        deepest: if deepest.is_finite() { deepest.max(depth) } else { depth },
    };
    let data = Data {
        kind: c.kind,
        mass,
        records,
        noise,
        scales,
        range,
        repeat_scatter: REPEATS,
        tilt_share: TILT_SHARE,
        budget: Budget::default(),
    };
    Ok(Conditioned { data, guess: Guess { k, p }, unsure })
}

/// When the simulation of a system of FMUs begins on a recording's clock, s: its touch is the recording's, `touch`, or else
/// its largest reading is.
fn began(r: &Recording, touch: f64, impact: Option<&Impacted>) -> f64 {
    let Some(impact) = impact else { return r.begins() };
    if impact.touch.is_finite() {
        return touch - impact.touch;
    }
    let of = |c: &Channel| {
        let (y, at) = (r.channels[c.index()].as_ref()?, impact.peaks[c.index()]);
        let top = (0..y.len()).max_by(|a, b| y[*a].abs().total_cmp(&y[*b].abs()))?;
        at.is_finite().then(|| r.time[top] - at)
    };
    Channel::ALL.iter().find_map(of).unwrap_or(r.begins())
}

/// Stretches in which nothing touches: before the first pulse, and between and after pulses.
fn quiet_stretches(push: &[f64], level: f64, first: &Pulse) -> Vec<(usize, usize, bool)> {
    let n = push.len();
    let margin = ((first.last - first.first) / 3).max(3);
    let busy: Vec<bool> = (0..n).map(|i| (0..3).all(|j| push[(i + j).min(n - 1)] > level)).collect();
    let mut out = Vec::new();
    let mut start = 0;
    let mut i = 0;
    while i <= n {
        if i == n || busy[i] {
            let end = if i == n { n } else { i.saturating_sub((margin / 3).max(2)) };
            if end > start + LEAST_QUIET {
                out.push((start, end, start == 0));
            }
            while i < n && busy[i] {
                i += 1;
            }
            start = i + margin;
            if i >= n {
                break;
            }
        }
        i += 1;
    }
    out
}

/// Noise of every channel learned once more from what a fit leaves of the readings where nothing touches: a motion that
/// no polynomial follows (a release, a fall with friction) is no noise. `left`: readings less the fit's, by recording and
/// channel. A channel keeps its noise where this would not lessen it.
pub fn renewed_noise(c: &Campaign, data: &Data, left: &[[Option<Vec<f64>>; 3]]) -> [Noise; 3] {
    let mass = c.moving_mass.unwrap_or(1.0);
    let quiet: Vec<Vec<(usize, usize, bool)>> = c
        .recordings
        .iter()
        .map(|r| {
            let push = push_of(r, mass).unwrap_or_default();
            pulse(&push).map_or_else(Vec::new, |pu| quiet_stretches(&push, pu.level, &pu))
        })
        .collect();
    let (mut noise, _) = noise_of(c.kind, left, &quiet, &data.range);
    for (n, old) in noise.iter_mut().zip(&data.noise) {
        if n.low_frequency() > old.low_frequency() || n.marginal() > old.marginal() {
            *n = *old;
        }
    }
    noise
}

/// Noise of an indentation learned once more from where its fit has nothing touching: before that fit the place of the touch is
/// not known, and what is certainly free of it is short. `unsure`: channels for which it was too short; `left`: readings of
/// force less the fit's, `depth`: the simulated penetration, m, by recording. Where a fit is bad, what it leaves is no noise: a
/// line through each stretch takes most of that away, and then the noise known before stays. A channel keeps its noise where
/// there are too few samples.
pub fn noise_out_of_contact(
    data: &Data,
    unsure: [bool; 3],
    left: &[Option<Vec<f64>>],
    depth: &[Vec<f64>],
) -> [Noise; 3] {
    let free: Vec<Vec<Range<usize>>> = depth.iter().map(|d| out_of_contact(d)).collect();
    let (force, path) = (Channel::Force.index(), Channel::Penetration.index());
    let of = |read: &[Option<&[f64]>], i: usize, degree: &dyn Fn(usize) -> Option<usize>| {
        let mut stretches = Vec::new();
        for (read, free) in read.iter().zip(&free) {
            for y in read.iter().flat_map(|read| free.iter().map(move |f| &read[f.clone()])) {
                stretches.push(despiked(match degree(y.len()) {
                    Some(degree) => Stretch::less_polynomial(y, degree),
                    // the fit has taken a zero out of each
                    None => Stretch::less_level(y.to_vec(), y.len()),
                }));
            }
        }
        learnt(&stretches, data.range[i])
    };
    let mut noise = data.noise;
    let of_force: Vec<_> = left.iter().map(Option::as_deref).collect();
    if let Some(n) = of(&of_force, force, &|_| None) {
        let straight = of(&of_force, force, &|_| Some(1)).unwrap_or(n);
        if n.marginal() <= STRAIGHT * straight.marginal() {
            noise[force] = n;
        } else if unsure[force] {
            noise[force] = straight;
        }
    }
    if unsure[path] {
        let of_path: Vec<_> = data.records.iter().map(|r| r.y[path].as_deref()).collect();
        // a path is a cubic over a short stretch
        let degree = |samples: usize| Some((samples / SAMPLES_A_DEGREE).clamp(1, 3));
        noise[path] = of(&of_path, path, &degree).unwrap_or(noise[path]);
    }
    noise
}

/// Times by which a line through each stretch narrows what a fit leaves of it, from which that is taken for no noise.
const STRAIGHT: f64 = 1.5;

/// Stretches of a simulated penetration before touch and after leaving that keep their distance from both: a ninth of the
/// contact before, where the touch is not quite where it was fitted, a third of it after, where what sticks lets go; a third
/// of the stretch at most.
fn out_of_contact(depth: &[f64]) -> Vec<Range<usize>> {
    let n = depth.len();
    let (Some(first), Some(last)) = (depth.iter().position(|x| *x > 0.0), depth.iter().rposition(|x| *x > 0.0)) else {
        return Vec::new();
    };
    let contact = last - first;
    let before = 0..first - (contact / 9).min(first / 3);
    let after = (last + 1 + (contact / 3).min((n - last) / 3)).min(n)..n;
    [before, after].into_iter().filter(|f| f.len() >= LEAST_FREE).collect()
}

/// Least sigma believed, as a share of the channel's range.
const FLOOR: f64 = 1e-5;
/// Samples of a stretch up to which it shows nothing about noise.
const LEAST_QUIET: usize = 16;
/// Samples from which a stretch that is known to be free shows something, and for each degree of the path taken out of it.
const LEAST_FREE: usize = 8;
const SAMPLES_A_DEGREE: usize = 8;

/// Noise of every channel, from the stretches in which nothing touches; and whether these were too short to show it.
fn noise_of(
    kind: Kind,
    readings: &[[Option<Vec<f64>>; 3]],
    quiet: &[Vec<(usize, usize, bool)>],
    range: &[f64; 3],
) -> ([Noise; 3], [bool; 3]) {
    let (mut noise, mut unsure) = ([Noise::white(1.0); 3], [false; 3]);
    for ch in Channel::ALL {
        let i = ch.index();
        if range[i] == 0.0 {
            continue;
        }
        let (mut stretches, mut before) = (Vec::new(), Vec::new());
        let mut fallback = Vec::new();
        for (r, q) in readings.iter().zip(quiet) {
            let Some(y) = &r[i] else { continue };
            fallback.push(spread_of_course(y));
            // force and acceleration rest at one level wherever nothing touches
            let flat = kind != Kind::Indentation && ch != Channel::Penetration;
            let rest: Vec<f64> = q.iter().flat_map(|(a, b, _)| y[*a..*b].iter().cloned()).collect();
            let level = if rest.is_empty() { 0.0 } else { rest.iter().sum::<f64>() / rest.len() as f64 };
            if flat && kind == Kind::DropTest {
                for (a, b, first) in q {
                    let left = y[*a..*b].iter().map(|v| v - level).collect();
                    stretches.push(despiked(Stretch::less_level(left, rest.len())));
                    if *first {
                        before.push(despiked(Stretch::less_polynomial(&y[*a..*b], 0)));
                    }
                }
                continue;
            }
            for (a, b, _) in q {
                // the polynomial that the signal follows where nothing touches
                let degree = match (kind, ch) {
                    (Kind::Indentation, Channel::Force) => 1,
                    (_, Channel::Force) => 0,
                    (_, Channel::Acceleration) => 1,
                    (_, Channel::Penetration) => 3,
                };
                stretches.push(despiked(Stretch::less_polynomial(&y[*a..*b], degree)));
            }
        }
        let known = learnt(&stretches, range[i]);
        unsure[i] = known.is_none();
        noise[i] = known.unwrap_or_else(|| Noise::white(median(fallback).max(FLOOR * range[i])));
        // what is slow after the impact alone is no noise: the impact has left it behind
        if let Some(n) = learnt(&before, range[i]) {
            if n.low_frequency() < CALM * noise[i].low_frequency() {
                noise[i] = n;
            }
        }
    }
    (noise, unsure)
}

/// Noise of `stretches` in which nothing touches, of a channel of that range, as wide as their slow part asks for. None with
/// too few samples.
fn learnt(stretches: &[Stretch], range: f64) -> Option<Noise> {
    let n = Noise::estimate(stretches, FLOOR * range)?;
    Some(n.widened(overdispersion(&n, stretches)))
}

/// Variance of batch means of the whitened noise over that of white noise, at least 1 (batch means: Conway 1963): slow
/// noise that no autoregression of low order holds.
fn overdispersion(noise: &Noise, stretches: &[Stretch]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for Stretch { left: e, .. } in stretches {
        let mut w = vec![0.0; e.len()];
        noise.whiten(e, &mut w);
        for b in w.chunks_exact(BATCH) {
            let m: f64 = b.iter().sum();
            sum += m * m / BATCH as f64;
            count += 1.0;
        }
    }
    if count < 8.0 {
        return 1.0;
    }
    // believed only beyond its own scatter
    let ratio = sum / count;
    if ratio > 1.0 + 2.5 * (2.0f64 / count).sqrt() {
        ratio
    } else {
        1.0
    }
}

/// Samples of a batch.
const BATCH: usize = 24;

/// A stretch without the samples far outside its spread, which are noise of another kind: they become zero.
fn despiked(mut stretch: Stretch) -> Stretch {
    let spread = spread(stretch.left.iter().map(|v| v.abs()).collect());
    for v in &mut stretch.left {
        if v.abs() > 6.0 * spread {
            *v = 0.0;
        }
    }
    stretch
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn a_spike_of_a_course_is_found_and_a_corner_is_none() {
        let corner: Vec<f64> = (0..200).map(|i| if i < 100 { i as f64 } else { 200.0 - i as f64 }).collect();
        assert!(spikes_of_course(&corner, 0.01).is_empty());
        let mut spiked = corner.clone();
        spiked[40] += 12.0;
        spiked[43] -= 9.0;
        spiked[150] -= 5.0;
        assert_eq!(spikes_of_course(&spiked, 0.1), [40, 43, 150]);
    }

    #[test]
    fn a_run_that_sticks_out_and_what_sticks_out_everywhere_are_no_spikes() {
        assert_eq!(that_stand_alone(vec![9, 4, 20, 8], 200), [4, 8, 9, 20]);
        assert_eq!(that_stand_alone(vec![9, 10, 20, 8], 200), [20]);
        assert_eq!(that_stand_alone((0..40).map(|k| 5 * k).collect(), 200), [0usize; 0]);
        // of a short recording two are not too many
        assert_eq!(that_stand_alone(vec![3, 7], 20), [3, 7]);
    }

    #[test]
    fn a_release_passes_for_noise_until_the_motion_is_taken_out() {
        let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(8);
        let sigma = 1e-6;
        let mut draw = || sigma * ((0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0);
        // at rest, then let go: half a parabola
        let moving: Vec<f64> = (0..600).map(|i| 1e-8 * f64::from(i - 300).max(0.0).powi(2) + draw()).collect();
        let left: Vec<f64> = (0..600).map(|_| draw()).collect();
        let quiet = vec![vec![(0, 600, true)]; 4];
        let of = |y: &[f64]| {
            let readings = vec![[None, None, Some(y.to_vec())]; 4];
            noise_of(Kind::ContactorOpening, &readings, &quiet, &[0.0, 0.0, 1e-3]).0[2].marginal()
        };
        assert!(of(&moving) > 5.0 * sigma, "{}", of(&moving));
        assert!((of(&left) / sigma - 1.0).abs() < 0.1, "{}", of(&left));
    }
}
