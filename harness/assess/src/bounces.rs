//! Impacts of a bouncing body: when it first touches, how much speed each impact leaves, how often it touches, and how
//! long it bounces until it rests.
//!
//! Contact is read off one of three signals: a position, a force or an event channel. Restitution is had in two ways:
//!
//! ```text
//! e = v after / v before        by the slope of the position at touch and at leaving, of the parabola (least squares)
//!                               through the free samples no farther away than the contact lasts, three at least;
//!                               where it is zero the body touches or leaves
//! e = T after / T before        by the times in flight, where the force that drives the body back does not change
//! ```

/// Fewest free samples through which the parabola is laid that gives a speed.
const FREE: usize = 3;

/// Standard deviations that noise reaches.
const REACH: f64 = 5.0;
/// Standard deviation over the median magnitude of normal noise.
const NORMAL: f64 = 1.4826;

/// One impact.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Impact {
    /// Time of touch, s.
    pub touch: f64,
    /// Time of leaving, s; None where the record ends in contact.
    pub separation: Option<f64>,
    /// Speed of approach, m/s; None without a position, or without three free samples before.
    pub approach: Option<f64>,
    /// Speed of leaving, m/s; None as there, after.
    pub rebound: Option<f64>,
    /// Speed of leaving over speed of approach.
    pub restitution: Option<f64>,
    /// Time in flight after over time in flight before: restitution under an even drive. None for the first impact and
    /// for the last.
    pub flight_ratio: Option<f64>,
}

/// All impacts of a record.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bounces {
    /// In order of time, one at least.
    pub impacts: Vec<Impact>,
    /// From first touch to last, s, where the body then rests: the record ends in contact, longer than any contact
    /// before. None where it does not.
    pub bounce_time: Option<f64>,
}

impl Bounces {
    /// Time of first touch, s.
    pub fn first(&self) -> f64 {
        self.impacts.first().map_or(f64::NAN, |i| i.touch)
    }

    /// Time of last touch, s.
    pub fn last(&self) -> f64 {
        self.impacts.last().map_or(f64::NAN, |i| i.touch)
    }
}

/// A change of contact between the samples `before` and `before + 1`.
struct Change {
    before: usize,
    time: f64,
    closes: bool,
}

/// Impacts by `position` (m, positive into the stop, whose surface is at zero) at `time` (s, strictly increasing). The
/// body has left when it is `hysteresis` (m, zero or more) away: so far noise may reach ([`noise_reach`]). None without
/// a touch.
pub fn by_position(time: &[f64], position: &[f64], hysteresis: f64) -> Option<Bounces> {
    let mut changes = changes(time, position, 0.0, -hysteresis);
    let mut speeds = Vec::with_capacity(changes.len());
    for i in 0..changes.len() {
        let c = &changes[i];
        let free = free_samples(time, &changes, i);
        let flight = Parabola::through(time, position, free, c.time);
        let within = time[c.before]..=time[c.before + 1];
        if let Some(t) = flight.as_ref().and_then(Parabola::root).filter(|t| within.contains(t)) {
            changes[i].time = t;
        }
        speeds.push(flight.map(|f| f.slope(changes[i].time).abs()));
    }
    let mut b = bounces(time, &changes)?;
    for (impact, v) in b.impacts.iter_mut().zip(speeds.chunks(2)) {
        impact.approach = v[0];
        impact.rebound = v.get(1).copied().flatten();
        impact.restitution = impact.rebound.zip(impact.approach).filter(|(_, v)| *v > 0.0).map(|(r, v)| r / v);
    }
    Some(b)
}

/// Impacts by `force` (N, positive in compression): contact begins when it exceeds `threshold` (N, above zero) and ends
/// when it is under half of it. None without a touch.
pub fn by_force(time: &[f64], force: &[f64], threshold: f64) -> Option<Bounces> {
    bounces(time, &changes(time, force, threshold, 0.5 * threshold))
}

/// Impacts by an event channel: `closed` at each sample, as a contactor's contacts or a light barrier show it. A change
/// is taken half way between its samples. None without a touch.
pub fn by_events(time: &[f64], closed: &[bool]) -> Option<Bounces> {
    let level: Vec<f64> = closed.iter().map(|c| if *c { 1.0 } else { 0.0 }).collect();
    bounces(time, &changes(time, &level, 0.5, 0.5))
}

/// How far noise may take `y` (its unit) off a smooth course at `time` (s): five standard deviations, these from how
/// far samples lie off the straight line between their neighbours, by the median. Zero of fewer than three samples.
pub fn noise_reach(time: &[f64], y: &[f64]) -> f64 {
    let mut off: Vec<f64> = time
        .windows(3)
        .zip(y.windows(3))
        .map(|(t, y)| {
            let share = (t[1] - t[0]) / (t[2] - t[0]);
            let line = y[0] + share * (y[2] - y[0]);
            (y[1] - line).abs() / (1.0 + share * share + (1.0 - share) * (1.0 - share)).sqrt()
        })
        .collect();
    if off.is_empty() {
        return 0.0;
    }
    let middle = off.len() / 2;
    let (_, median, _) = off.select_nth_unstable_by(middle, f64::total_cmp);
    REACH * NORMAL * *median
}

/// Changes of contact in turn, the first a closing: `y` rises above `close`, and falls under `open`, which is not above
/// `close`. Of a fall the last crossing of `close` counts. A record that begins closed has its first change where it
/// closes again.
fn changes(time: &[f64], y: &[f64], close: f64, open: f64) -> Vec<Change> {
    let n = time.len().min(y.len());
    let mut changes: Vec<Change> = Vec::new();
    let Some(first) = y.first() else { return changes };
    let mut closed = *first > close;
    let mut begun = !closed;
    let mut fell = 0;
    for i in 1..n {
        if y[i - 1] > close && y[i] <= close {
            fell = i - 1;
        }
        let before = match closed {
            false if y[i] > close => i - 1,
            true if y[i] < open => fell,
            _ => continue,
        };
        closed = !closed;
        if begun {
            let share = (close - y[before]) / (y[before + 1] - y[before]);
            let time = time[before] + share * (time[before + 1] - time[before]);
            changes.push(Change { before, time, closes: closed });
        }
        begun = true;
    }
    changes
}

/// The impacts that changes of contact make, without speeds.
fn bounces(time: &[f64], changes: &[Change]) -> Option<Bounces> {
    let mut impacts: Vec<Impact> = Vec::new();
    for c in changes {
        match impacts.last_mut() {
            Some(last) if !c.closes => last.separation = Some(c.time),
            _ => impacts.push(Impact { touch: c.time, ..Impact::default() }),
        }
    }
    let flights: Vec<f64> = impacts.windows(2).filter_map(|w| Some(w[1].touch - w[0].separation?)).collect();
    for (i, w) in flights.windows(2).enumerate() {
        impacts[i + 1].flight_ratio = Some(w[1] / w[0]);
    }
    let (first, last) = (impacts.first()?.touch, impacts.last()?);
    let longest = impacts.iter().filter_map(|i| Some(i.separation? - i.touch)).fold(0.0, f64::max);
    let rests = last.separation.is_none() && *time.last()? - last.touch > longest;
    let bounce_time = rests.then_some(last.touch - first);
    Some(Bounces { impacts, bounce_time })
}

/// Samples in flight next to change `i`: before a touch, after a leaving, those no farther from it in time than its
/// contact lasts, three at least where the flight has so many.
fn free_samples(time: &[f64], changes: &[Change], i: usize) -> std::ops::Range<usize> {
    let c = &changes[i];
    let other = if c.closes { changes.get(i + 1) } else { i.checked_sub(1).map(|k| &changes[k]) };
    let reach = other.map_or(0.0, |o| (o.time - c.time).abs());
    if c.closes {
        let (flight, end) = (i.checked_sub(1).map_or(0, |k| changes[k].before + 1), c.before + 1);
        let near = time.partition_point(|t| *t < c.time - reach);
        near.min(end.saturating_sub(FREE)).max(flight)..end
    } else {
        let (start, flight) = (c.before + 1, changes.get(i + 1).map_or(time.len(), |k| k.before + 1));
        let near = time.partition_point(|t| *t <= c.time + reach);
        start..near.max(start + FREE).min(flight)
    }
}

/// y = c0 + c1 u + c2 u^2 with u = (t - at) / scale.
struct Parabola {
    c: [f64; 3],
    at: f64,
    scale: f64,
}

impl Parabola {
    /// That of least squares through some samples; None of fewer than three.
    fn through(time: &[f64], y: &[f64], samples: std::ops::Range<usize>, at: f64) -> Option<Parabola> {
        let (time, y) = (time.get(samples.clone())?, y.get(samples)?);
        let scale = time.last()? - time.first()?;
        if time.len() < FREE || scale <= 0.0 {
            return None;
        }
        let (mut moments, mut right) = ([0.0; 5], [0.0; 3]);
        for (t, y) in time.iter().zip(y) {
            let u = (t - at) / scale;
            let powers = [1.0, u, u * u, u * u * u, u * u * u * u];
            moments.iter_mut().zip(powers).for_each(|(m, p)| *m += p);
            right.iter_mut().zip(powers).for_each(|(r, p)| *r += p * y);
        }
        let [m0, m1, m2, m3, m4] = moments;
        let columns = [[m0, m1, m2], [m1, m2, m3], [m2, m3, m4]];
        let all = determinant(&columns);
        let c = [0, 1, 2].map(|i| {
            let mut replaced = columns;
            replaced[i] = right;
            determinant(&replaced) / all
        });
        c.iter().all(|c| c.is_finite()).then_some(Parabola { c, at, scale })
    }

    /// Where it is zero nearest to `at`, s.
    fn root(&self) -> Option<f64> {
        let [c0, c1, c2] = self.c;
        let under = c1 * c1 - 4.0 * c0 * c2;
        let u = -2.0 * c0 / (c1 + under.sqrt().copysign(c1));
        u.is_finite().then_some(self.at + u * self.scale)
    }

    /// Its slope at a time, m/s.
    fn slope(&self, t: f64) -> f64 {
        let u = (t - self.at) / self.scale;
        (self.c[1] + 2.0 * self.c[2] * u) / self.scale
    }
}

fn determinant([a, b, c]: &[[f64; 3]; 3]) -> f64 {
    a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0])
}

#[cfg(test)]
mod tests {
    use super::*;

    const G: f64 = 9.81;
    const E: f64 = 0.5;
    const STEP: f64 = 1e-5;

    /// A ball dropped from 0.1 m that bounces with restitution 1/2 and contacts of 1 ms, five times, then rests 10 mm
    /// deep.
    fn ball() -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let fall = (2.0 * 0.1 / G).sqrt();
        let (mut from, mut v) = (fall, G * fall);
        let mut spans = vec![(0.0, fall, 0.0, -0.1, G)];
        let mut touches = vec![fall];
        for _ in 0..4 {
            // contact: half a sine's arc, as a parabola that leaves at E v
            spans.push((from, from + 1e-3, v, 0.0, -(1.0 + E) * v / 1e-3));
            v *= E;
            let flight = 2.0 * v / G;
            spans.push((from + 1e-3, from + 1e-3 + flight, -v, 0.0, G));
            from += 1e-3 + flight;
            touches.push(from);
        }
        let mut time = Vec::new();
        let mut y = Vec::new();
        for i in 0..((from + 0.01) / STEP) as usize {
            let t = STEP * i as f64;
            let at = |s: &&(f64, f64, f64, f64, f64)| t >= s.0 && t < s.1;
            time.push(t);
            y.push(spans.iter().find(at).map_or(1e-2, |(t0, _, v, x, a)| {
                let u = t - t0;
                x + v * u + 0.5 * a * u * u
            }));
        }
        (time, y, touches)
    }

    #[test]
    fn the_impacts_of_a_ball_are_found_with_their_restitution() {
        let (time, y, touches) = ball();
        let b = by_position(&time, &y, 1e-9).unwrap();
        assert_eq!(b.impacts.len(), 5);
        for (i, t) in b.impacts.iter().zip(&touches) {
            assert!((i.touch - t).abs() < 1e-10, "{} {t}", i.touch);
        }
        let v = G * touches[0];
        assert!((b.impacts[0].approach.unwrap() / v - 1.0).abs() < 1e-8);
        for i in &b.impacts[..4] {
            assert!((i.restitution.unwrap() / E - 1.0).abs() < 1e-6, "{i:?}");
        }
        for i in &b.impacts[1..4] {
            assert!((i.flight_ratio.unwrap() / E - 1.0).abs() < 1e-6, "{i:?}");
        }
        assert!((b.bounce_time.unwrap() - (touches[4] - touches[0])).abs() < 1e-9);
    }

    #[test]
    fn events_and_forces_tell_the_same_touches() {
        let (time, y, touches) = ball();
        let closed: Vec<bool> = y.iter().map(|y| *y > 0.0).collect();
        let force: Vec<f64> = y.iter().map(|y| 1e6 * y.max(0.0)).collect();
        for b in [by_events(&time, &closed).unwrap(), by_force(&time, &force, 1.0).unwrap()] {
            assert_eq!(b.impacts.len(), 5);
            assert!((b.first() - touches[0]).abs() < STEP);
            assert!((b.bounce_time.unwrap() - (touches[4] - touches[0])).abs() < 2.0 * STEP);
            assert!(b.impacts[1..4].iter().all(|i| (i.flight_ratio.unwrap() / E - 1.0).abs() < 3e-3));
            assert!(b.impacts.iter().all(|i| i.approach.is_none() && i.restitution.is_none()));
        }
    }

    #[test]
    fn noise_within_the_hysteresis_is_no_bounce() {
        let time: Vec<f64> = (0..40).map(f64::from).collect();
        let y: Vec<f64> = (0..40).map(|i| if i < 5 { f64::from(i - 5) } else { 0.1 * f64::from(i % 3 - 1) }).collect();
        let b = by_position(&time, &y, 0.2).unwrap();
        assert_eq!((b.impacts.len(), b.bounce_time), (1, Some(0.0)));
        assert!(by_position(&time, &y, 0.0).unwrap().impacts.len() > 5);
    }

    #[test]
    fn noise_reaches_five_standard_deviations() {
        let time: Vec<f64> = (0..4000).map(|i| f64::from(i) + if i % 2 == 0 { 0.0 } else { 0.3 }).collect();
        // evenly spread numbers, of standard deviation 1 / sqrt(12), about a line
        let spread = |i: usize| (i as f64 * 0.754_877_666).fract();
        let y: Vec<f64> = time.iter().enumerate().map(|(i, t)| 7.0 * t + spread(i * i % 3989)).collect();
        let reach = noise_reach(&time, &y);
        assert!((reach * 12f64.sqrt() / 5.0 - 1.0).abs() < 0.15, "{reach}");
        assert_eq!(noise_reach(&time[..2], &y[..2]), 0.0);
    }

    #[test]
    fn a_record_that_ends_in_the_air_has_no_rest_and_one_without_a_touch_no_impacts() {
        let time: Vec<f64> = (0..6).map(f64::from).collect();
        let b = by_events(&time, &[false, true, true, false, false, false]).unwrap();
        assert_eq!((b.impacts.len(), b.bounce_time, b.impacts[0].separation), (1, None, Some(2.5)));
        assert_eq!(by_events(&time, &[false; 6]), None);
        assert_eq!(by_events(&[], &[]), None);
        // what begins closed opens first: its first touch is the one after
        let b = by_events(&time, &[true, false, false, true, true, true]).unwrap();
        assert_eq!((b.impacts.len(), b.first()), (1, 2.5));
    }
}
