//! Flat tops: readings that end, again and again, in one and the same value, as a range makes them and no impact does.

use crate::problem::{Data, Record};
use record::{largest, Channel, Kind};

/// Samples in a row at one reading that make a flat top.
const FLAT: usize = 4;
/// Share of the largest reading within which a reading is the same as it.
const SAME: f64 = 1e-9;
/// Shares of the largest reading between which repeated readings are counted: what else repeats them (a value that is held,
/// a coarse scale) does so there too.
const ON_THE_WAY: (f64, f64) = (0.3, 0.95);
/// ln prior odds that a channel of a campaign reaches the end of its range: one in a hundred.
const LN_PRIOR: f64 = -4.6;

/// A channel that ends in a flat top.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlatTop {
    pub channel: Channel,
    /// The reading that it ends in, in the channel's SI unit.
    pub value: f64,
    /// ln of how much likelier the repeated readings are at the end of a range than by chance, and that one ends there.
    pub nats: f64,
}

impl FlatTop {
    /// Whether a reading is the one that the channel ends in.
    pub fn is_reached(&self, reading: f64) -> bool {
        is_at(reading.abs(), self.value.abs()) && reading.signum() == self.value.signum()
    }

    /// The channel's reading of a `value` that may be beyond its range.
    pub fn read(&self, value: f64) -> f64 {
        if self.value >= 0.0 {
            value.min(self.value)
        } else {
            value.max(self.value)
        }
    }
}

/// Whether readings stay at `top`, the largest of their campaign, several samples long.
pub fn flat(y: &[f64], top: f64) -> bool {
    y.windows(FLAT).any(|w| w.iter().all(|v| is_at(v.abs(), top)))
}

fn is_at(v: f64, top: f64) -> bool {
    (v - top).abs() <= SAME * top
}

/// Probability that a channel whose repeated readings have so many nats is at the end of its range; 0 without any.
pub fn probability(nats: f64) -> f64 {
    if nats > 0.0 {
        1.0 / (1.0 + (-nats - LN_PRIOR).exp())
    } else {
        0.0
    }
}

/// The readings of a recording, the right way up, and which of them were read while what is pressed moved.
struct Read {
    y: Vec<f64>,
    moves: Vec<bool>,
}

impl Read {
    /// How many readings are `top`, taken while it moved.
    fn at(&self, top: f64) -> f64 {
        self.y.iter().zip(&self.moves).filter(|(v, moves)| **moves && is_at(**v, top)).count() as f64
    }

    /// Whether a reading is `top` while it moved, neither the first nor the last: where a recording begins and ends is set by what
    /// controls it, or by whoever cut it.
    fn ends_at(&self, top: f64) -> bool {
        let inner = 1..self.y.len().saturating_sub(1);
        inner.into_iter().any(|i| self.moves[i] && is_at(self.y[i], top))
    }

    /// Whether a reading is `top`, moving or not.
    fn reaches(&self, top: f64) -> bool {
        self.y.iter().any(|v| is_at(*v, top))
    }
}

/// Share of a recording's middle rate below which what is pressed is held.
const HELD: f64 = 0.1;

/// The rate at which the middle of the way was gone, of rates at times: half of the way was gone slower. Neither holds nor single
/// fast samples (a snap into contact) change it much.
fn middle_rate(rates: &[f64], time: &[f64]) -> f64 {
    let span = |i: usize| time[(i + 1).min(time.len() - 1)] - time[i.saturating_sub(1)];
    let mut each: Vec<(f64, f64)> = (0..rates.len().min(time.len())).map(|i| (rates[i].abs(), span(i))).collect();
    each.sort_by(|a, b| a.0.total_cmp(&b.0));
    let whole: f64 = each.iter().map(|(v, h)| v * h).sum();
    let mut gone = 0.0;
    let at = each.iter().find(|(v, h)| {
        gone += v * h;
        gone >= 0.5 * whole
    });
    at.map_or(0.0, |(v, _)| *v)
}

/// The channel that ends in a flat top, where that is more likely than not: at its largest reading or at its least.
pub fn flat_top(data: &Data) -> Option<FlatTop> {
    let of = |(channel, sign): (Channel, f64)| {
        let i = channel.index();
        let turned = |r: &Record| {
            let y: Vec<f64> = r.y[i].as_ref()?.iter().map(|v| sign * v).collect();
            let rates = &r.setup.imposed_rate;
            let middle = middle_rate(rates, &r.setup.time);
            let moves = (0..y.len()).map(|k| rates.get(k).is_none_or(|v| v.abs() > HELD * middle)).collect();
            Some(Read { y, moves })
        };
        let all: Vec<Read> = data.records.iter().filter_map(turned).collect();
        let top = all.iter().flat_map(|r| &r.y).copied().fold(0.0, f64::max);
        let nats = nats(&all, top, data.noise[i].marginal(), data.kind == Kind::Indentation)?;
        Some(FlatTop { channel, value: sign * top, nats: nats + ln_share(&all, top) })
    };
    let ends = [Channel::Force, Channel::Acceleration].into_iter().flat_map(|c| [(c, 1.0), (c, -1.0)]);
    let all = ends.filter_map(of);
    all.max_by(|a, b| a.nats.total_cmp(&b.nats)).filter(|f| probability(f.nats) > 0.5)
}

/// ln of the share of a channel's readings, by magnitude, that `top` is: a range may end anywhere in it, so that it seldom ends
/// among readings that are next to nothing, as the noise about zero is below a pulse.
fn ln_share(all: &[Read], top: f64) -> f64 {
    let most = all.iter().map(|r| largest(&r.y)).fold(top, f64::max);
    (top / most).ln()
}

/// ln of how much likelier it is that so many readings are `top` where a range ends there than by chance; None where there are
/// none. By chance a reading repeats its neighbour as often as readings on the way do, and as often as the resolution and the
/// spread of the readings near a smooth peak with that noise have it; two recordings end in the same reading as often as they
/// share readings on the way; and where motion is imposed a recording that does not reach `top` ends in repeats of its own
/// largest reading as often as those that do, as where a force is held.
fn nats(all: &[Read], top: f64, noise: f64, is_imposed: bool) -> Option<f64> {
    if top <= 0.0 || all.is_empty() {
        return None;
    }
    let resolution = resolution(all, top);
    let (mut ties, mut spread, mut ends, mut repeated, mut on_the_way) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let (mut others, mut held) = (0.0, 0.0);
    let is_on_the_way = |v: f64| v > ON_THE_WAY.0 * top && v < ON_THE_WAY.1 * top;
    for r in all {
        let run = r.at(top);
        if r.ends_at(top) {
            ties += run - 1.0;
            ends += 1.0;
            // mean fall of a parabola as wide as the half of the peak, over as many samples
            let width = r.y.iter().filter(|v| **v > 0.5 * top).count() as f64;
            spread += run * top * (run / width).powi(2) / 6.0;
        } else if !r.reaches(top) {
            others += 1.0;
            let own = r.y.iter().copied().fold(0.0, f64::max);
            held += f64::from(u8::from(r.y.iter().filter(|v| is_at(**v, own)).count() >= FLAT));
        }
        for w in r.y.windows(2).filter(|w| is_on_the_way(w[1])) {
            on_the_way += 1.0;
            repeated += f64::from(u8::from(w[0] == w[1]));
        }
    }
    if ends == 0.0 {
        return None;
    }
    // that a second recording ends where the first does is no chance either
    let spread = spread / (ties + ends);
    let by_scale = resolution / (resolution + noise + spread);
    let by_repeats = (repeated + 1.0) / (on_the_way + 2.0);
    let by_sharing = shared(all, is_on_the_way);
    let nats = |by_another: f64| -by_scale.max(by_another).min(1.0).ln();
    let by_chance = ties * nats(by_repeats) + (ends - 1.0) * nats(by_sharing);
    // Jeffreys' rate of recordings that end in repeats of their own
    let by_holds =
        if is_imposed && others > 0.0 { -ends * ((held + 0.5) / (others + 1.0)).ln() } else { f64::INFINITY };
    Some(by_chance.min(by_holds))
}

/// Share of the readings on the way that another recording holds too, as recordings of one noise do.
fn shared(all: &[Read], is_on_the_way: impl Fn(f64) -> bool) -> f64 {
    let on_the_way = |r: &Read| -> Vec<u64> {
        let mut bits: Vec<u64> = r.y.iter().filter(|v| is_on_the_way(**v)).map(|v| v.to_bits()).collect();
        bits.sort_unstable();
        bits.dedup();
        bits
    };
    let mut each: Vec<u64> = all.iter().flat_map(on_the_way).collect();
    each.sort_unstable();
    let whole = each.len() as f64;
    let again: usize = each.chunk_by(|a, b| a == b).map(<[u64]>::len).filter(|n| *n > 1).sum();
    (again as f64 + 1.0) / (whole + 2.0)
}

/// The least step between readings.
fn resolution(all: &[Read], top: f64) -> f64 {
    let mut sorted: Vec<f64> = all.iter().flat_map(|r| r.y.iter().copied()).collect();
    sorted.sort_by(f64::total_cmp);
    let steps = sorted.windows(2).map(|w| w[1] - w[0]);
    let least = steps.filter(|s| *s > 1e-12 * top).fold(f64::INFINITY, f64::min);
    least.min(top)
}

/// Magnitude of the largest reading of each channel of a campaign, SI; 0 where there is none.
pub fn tops(data: &Data) -> [f64; 3] {
    let mut top = [0.0f64; 3];
    for r in &data.records {
        for (t, y) in top.iter_mut().zip(&r.y) {
            *t = t.max(y.as_deref().map_or(0.0, largest));
        }
    }
    top
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pulse(n: usize, peak: f64, limit: f64, step: f64) -> Vec<f64> {
        let hum = |i: usize| 2e-3 * ((i * 7919 % 101) as f64 / 50.0 - 1.0);
        let of = |i: usize| peak * (std::f64::consts::PI * i as f64 / (n - 1) as f64).sin() + hum(i);
        (0..n).map(|i| ((of(i).min(limit)) / step).round() * step).collect()
    }

    fn nats_of(all: &[Vec<f64>], is_imposed: bool) -> f64 {
        let top = all.iter().map(|y| largest(y)).fold(0.0, f64::max);
        let read = |y: &Vec<f64>| Read { y: y.clone(), moves: vec![true; y.len()] };
        nats(&all.iter().map(read).collect::<Vec<_>>(), top, 1e-3, is_imposed).unwrap()
    }

    #[test]
    fn a_range_seldom_ends_among_readings_that_are_next_to_nothing() {
        let read = |y: Vec<f64>| [Read { moves: vec![true; y.len()], y }];
        let pulse = read(vec![-0.01, 0.0, -0.01, 0.5, 1.0, 0.5, -0.01]);
        assert_eq!(ln_share(&pulse, 1.0), 0.0);
        let turned = read(pulse[0].y.iter().map(|v| -v).collect());
        assert!((ln_share(&turned, 0.01) - 0.01f64.ln()).abs() < 1e-12);
    }

    #[test]
    fn a_snap_and_a_hold_leave_the_middle_rate() {
        let time: Vec<f64> = (0..300).map(f64::from).collect();
        let rate = |i: usize| match i {
            50 => 40.0,
            0..100 => 1.0,
            100..200 => 1e-3,
            _ => -1.0,
        };
        assert_eq!(middle_rate(&(0..300).map(rate).collect::<Vec<_>>(), &time), 1.0);
        assert_eq!(middle_rate(&[], &[]), 0.0);
    }

    #[test]
    fn a_recording_that_is_at_the_top_at_rest_alone_speaks_for_no_hold() {
        let cut = |moves: bool| Read { y: pulse(200, 1.4, 1.0, 1e-6), moves: vec![moves; 200] };
        let all = [cut(true), cut(false), cut(false)];
        assert!(nats(&all, 1.0, 1e-3, true).unwrap() > 100.0);
        assert!(nats(&all[1..], 1.0, 1e-3, true).is_none());
    }

    #[test]
    fn a_reading_that_recordings_end_with_alone_is_no_end_of_a_range() {
        let until = |limit: f64| {
            let mut y = pulse(200, 1.0, 2.0, 1e-6);
            y.iter_mut().for_each(|v| *v *= 0.9);
            y.push(limit);
            Read { moves: vec![true; y.len()], y }
        };
        let all = [until(1.0), until(1.0), until(1.0)];
        assert!(nats(&all, 1.0, 1e-3, true).is_none());
    }

    #[test]
    fn a_top_that_is_cut_is_flat_and_one_that_a_coarse_scale_repeats_is_not() {
        let cut = nats_of(&[pulse(200, 1.0, 0.9, 1e-6)], false);
        assert!(cut > 100.0, "{cut}");
        // a level that only the highest recordings reach, a few samples each
        let few = nats_of(&[pulse(30, 0.8, 0.97, 1e-6), pulse(30, 1.0, 0.97, 1e-6)], false);
        assert!(few > 5.0, "{few}");
        assert!(nats_of(&[pulse(200, 1.0, 2.0, 1e-6)], false) < 1.0);
        for step in [0.005, 0.02] {
            let coarse = nats_of(&[pulse(200, 1.0, 2.0, step)], false);
            assert!(coarse + LN_PRIOR < 0.0, "{step}: {coarse}");
        }
        // forces that are held, each at its own level
        let held = [0.4, 0.6, 0.8, 1.0].map(|peak| pulse(200, 2.0 * peak, peak, 1e-6));
        assert!(nats_of(&held, true) + LN_PRIOR < 0.0, "{}", nats_of(&held, true));
        let cut = [0.4, 0.6, 1.2, 1.4, 1.6].map(|peak| pulse(200, peak, 1.0, 1e-6));
        assert!(nats_of(&cut, true) + LN_PRIOR > 0.0, "{}", nats_of(&cut, true));
        // one noise in three recordings, least readings and all
        let noise: Vec<f64> = (0..60).map(|i| 0.01 * ((i * 7919 % 101) as f64 / 101.0 - 0.4)).collect();
        let one_noise = nats_of(&[noise.clone(), noise.clone(), noise], true);
        assert!(one_noise + LN_PRIOR < 0.0, "{one_noise}");
        // every value held for five samples
        let held: Vec<f64> = pulse(60, 1.0, 2.0, 1e-6).iter().flat_map(|v| [*v; 5]).collect();
        assert!(nats_of(&[held], false) + LN_PRIOR < 0.0);
    }
}
