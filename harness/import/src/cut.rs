//! The second look at a file: the samples of each recording, cut around its impact, signs and zero as the format has them.

use crate::amount::brief;
use crate::find::{contact, main_contact, Contact, Level, STANDS_OUT};
use crate::split::Track;
use crate::survey;
use instruments::Source;
use record::release::release;
use record::statistics::{median, spread};
use record::{Channel, Kind, LARGEST};
use std::ops::ControlFlow;

/// Most samples of a recording; of more, means are taken.
pub const MOST: u64 = 1_000_000;
/// Contact times kept before the touch and after the last contact, and samples there at least: the noise is learnt there.
const AROUND: u64 = 3;
const QUIET: u64 = 300;
/// Samples from the touch on within which bounces are kept: a diagnosis judges no more, for each this many samples of the
/// contact.
const BOUNCES: u64 = 4000;
const PER_CONTACT: u64 = 400;
/// Share of the depth by which penetration may miss zero at the touch: more is the zero of another place.
const ZERO: f64 = 0.25;
/// Share of the largest push up to which it counts as rising.
const RISING: f64 = 0.6;
/// Share of the range by which force may miss zero before the touch, and the samples there that show it.
const TARE: f64 = 0.01;
const LEARNT: usize = 20;

/// Which samples a recording takes.
#[derive(Clone, Debug, PartialEq)]
pub struct Span {
    /// Index of the group, and the track among those of its file.
    pub group: usize,
    pub track: usize,
    /// Rows read: the first, and the one behind the last.
    pub rows: (u64, u64),
    /// Cut at the impact more exactly than rows are; else all of them are taken.
    pub cut: Cut,
    pub level: Option<Level>,
}

/// Where a recording is cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// Around the impact.
    Around,
    /// Behind the impact: a contactor is released at the first sample.
    Behind,
    Whole,
}

/// Rows to read for a drop whose contacts are in `contacts`, out of the stretch `rows` that a search in buckets of `bucket`
/// rows went through; `between`: where the contacts of the drop before end, and where the next drop begins.
pub fn around(contacts: &[(u64, u64)], rows: (u64, u64), bucket: u64, between: (u64, u64)) -> (u64, u64) {
    let (first, length) = (contacts[0].0, contacts[0].1 - contacts[0].0);
    let within = first + bounces(length) + bucket;
    let end = contacts.iter().take_while(|c| c.0 < within).map(|c| c.1).last().unwrap_or(first);
    let pad = pad(length) + 2 * bucket;
    (first.saturating_sub(pad).max(rows.0).max(between.0).min(first), (end + pad).min(rows.1).min(between.1))
}

fn pad(contact: u64) -> u64 {
    (AROUND * contact).max(QUIET)
}

fn bounces(contact: u64) -> u64 {
    BOUNCES * (contact / PER_CONTACT).max(1)
}

/// A recording as it is written: SI, signs of the format.
#[derive(Clone, Debug, PartialEq)]
pub struct Samples {
    pub time: Vec<f64>,
    pub channels: [Option<Vec<f64>>; 3],
    /// When the first contact begins, and how long it lasts, s.
    pub touch: Option<(f64, f64)>,
    /// Channels whose sign was turned because the readings show it.
    pub turned: Vec<Channel>,
    /// How plainly the readings show that sign, by `record::Channel::index`: the way in the contact as a multiple of the
    /// noise, negative where the sign is to be turned. Zero where they do not show it, or the user says the sign.
    pub shown: [f64; 3],
    pub notes: Vec<String>,
}

/// Rows gathered, or means of them.
struct Gather<'a> {
    span: &'a Span,
    track: &'a Track,
    /// Rows in a mean.
    of: u64,
    sum: [f64; 4],
    count: u64,
    rows: Vec<[f64; 4]>,
    missing: u64,
    /// Of these, rows in which a channel holds no reading and another does.
    without: [u64; 3],
    /// Rows with a reading over the instrument's range.
    over: u64,
}

/// Whether a value in SI is one that was measured: neither missing, nor beyond what a unit can mean.
pub(crate) fn is_reading(v: f64) -> bool {
    v.abs() <= LARGEST
}

impl Gather<'_> {
    fn add(&mut self, row: u64, time: f64, y: [f64; 3]) {
        if !(self.span.rows.0..self.span.rows.1).contains(&row) {
            return;
        }
        let has = self.track.channels.each_ref().map(Option::is_some);
        let holds = [0, 1, 2].map(|c| has[c] && is_reading(y[c]));
        if !is_reading(time) || holds != has {
            if is_reading(time) && holds.contains(&true) {
                self.without.iter_mut().zip(holds).zip(has).for_each(|((n, holds), h)| *n += u64::from(h && !holds));
            }
            let over = y.iter().zip(has).any(|(v, h)| h && v.is_infinite());
            *(if over { &mut self.over } else { &mut self.missing }) += 1;
            return;
        }
        for (s, v) in self.sum.iter_mut().zip([time, y[0], y[1], y[2]]) {
            *s += v;
        }
        self.count += 1;
        if self.count == self.of {
            self.rows.push(self.sum.map(|s| s / self.of as f64));
            (self.sum, self.count) = ([0.0; 4], 0);
        }
    }
}

/// Reads the recordings `spans` of one group, all at once. `tracks`: those of the file. `kind`: what was done.
///
/// # Errors
/// Where the file cannot be read. Of each recording: why it is none.
pub fn cut(
    source: &mut dyn Source,
    group: usize,
    spans: &[(&Span, &Track)],
    kind: Kind,
) -> Result<Vec<Result<Samples, String>>, String> {
    let mut gathers: Vec<Gather> = spans
        .iter()
        .map(|(span, track)| Gather {
            span,
            track,
            of: (span.rows.1 - span.rows.0).div_ceil(MOST).max(1),
            sum: [0.0; 4],
            count: 0,
            rows: Vec::new(),
            missing: 0,
            without: [0; 3],
            over: 0,
        })
        .collect();
    let last = spans.iter().map(|s| s.0.rows.1).max().unwrap_or(0);
    let mut at = 0;
    let read = source.read(group, &mut |block| {
        let count = block.first().map_or(0, |c| c.len()) as u64;
        for g in gathers.iter_mut().filter(|g| g.span.rows.0 < at + count && at < g.span.rows.1) {
            let track = g.track;
            survey::rows(track, block, at, |row, time, y| g.add(row, time, y));
        }
        at += count;
        if at < last {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    });
    read.map_err(|e| e.to_string())?;
    Ok(gathers.into_iter().map(|g| finish(g, kind)).collect())
}

/// Cuts exactly, and turns signs.
fn finish(g: Gather, kind: Kind) -> Result<Samples, String> {
    let (span, track) = (g.span, g.track);
    let mut notes = Vec::new();
    let rows = g.rows.len() as u64 * g.of + g.missing;
    if let Some(c) = Channel::ALL.into_iter().find(|c| 2 * g.without[c.index()] >= rows.max(1)) {
        return Err(format!(
            "{} holds no reading in {} of {rows} rows in which another channel does: it is read more slowly. Give this \
             recording a file of its own, where each channel keeps its clock, or leave {} out with --map",
            c.name(),
            g.without[c.index()],
            c.name()
        ));
    }
    if g.missing > 0 {
        notes.push(format!("{} samples are missing in the file", g.missing));
    }
    if g.over > 0 {
        notes.push(format!(
            "{} samples are over the range of the instrument and were left out: its range is too small for this impact",
            g.over
        ));
    }
    if g.of > 1 {
        notes.push(format!("means of {} samples are taken: it holds more than {MOST}", g.of));
    }
    let column = |i: usize| -> Vec<f64> { g.rows.iter().map(|r| r[i]).collect() };
    let mut time = column(0);
    let mut channels: [Option<Vec<f64>>; 3] = [0, 1, 2].map(|c| track.channels[c].is_some().then(|| column(c + 1)));
    if let Some(i) = (1..time.len()).find(|i| time[*i] < time[i - 1]) {
        return Err(format!(
            "time goes back from {} s to {} s; say --map time=COLUMN:s, or --rate SAMPLES_PER_SECOND",
            time[i - 1],
            time[i]
        ));
    }
    // of a drop what lies before the release is no part of the fall
    let released = channels[1].as_deref().filter(|_| span.cut == Cut::Around);
    let released = released.and_then(|a| release(&time, a, &[1.0, -1.0]));
    let begins = released.map_or(0, |r| r.first);
    let mut found = span.level.as_ref().and_then(|level| {
        let y = channels[level.channel.index()].as_ref()?;
        let k = main_contact(&y[begins..], level)?;
        Some(Contact { first: begins + k.first, last: begins + k.last })
    });
    if span.cut == Cut::Around && found.is_none() {
        return Err("what stands out is a spike of one or two samples, no impact".into());
    }
    if let (Some(k), Some(level), Cut::Around | Cut::Behind) = (&mut found, &span.level, span.cut) {
        let y = channels[level.channel.index()].as_deref().unwrap_or(&[]);
        let (from, to) = exact(y, k, level, span.cut);
        let from = from.max(begins);
        time = time[from..to].to_vec();
        channels.iter_mut().flatten().for_each(|y| *y = y[from..to].to_vec());
        (k.first, k.last) = (k.first - from, k.last - from);
    }
    let weighs = span.level.filter(|l| l.weighs && span.cut == Cut::Around).map(|l| l.base);
    if let (Some(a), Some(fall)) = (&mut channels[1], released.map(|r| r.fall).or(weighs).filter(|v| *v != 0.0)) {
        a.iter_mut().for_each(|a| *a -= fall);
        notes.push(format!(
            "acceleration was zeroed at rest, and read {} m/s^2 in the fall: that was set to zero",
            brief(fall)
        ));
    }
    let press_force = channels[0].as_deref().filter(|_| kind == Kind::Indentation);
    let pressed = press_force.and_then(press);
    // what begins within the contact does not show which way is into it
    let free = press_force.is_none_or(|force| pressed.as_ref().is_some_and(|k| begins_free(force, k)));
    found = pressed.clone().or(found);
    let (mut turned, mut shown) = (Vec::new(), [0.0; 3]);
    for c in Channel::ALL {
        let Some(said) = track.channels[c.index()].as_ref().map(|t| t.sign) else { continue };
        let sign = match said {
            Some(s) => s,
            None => {
                let way = way(kind, c, &channels, found.as_ref());
                let noise = channels[c.index()].as_deref().map_or(0.0, noise);
                shown[c.index()] = if noise > 0.0 && free { way / noise } else { 0.0 };
                if way < 0.0 {
                    -1.0
                } else {
                    1.0
                }
            }
        };
        if sign < 0.0 {
            channels[c.index()].iter_mut().flatten().for_each(|v| *v = -*v);
            if said.is_none() {
                turned.push(c);
            }
        }
    }
    if let (Some(level), Some(k)) = (&span.level, found.as_ref().filter(|_| kind != Kind::Indentation)) {
        let shows = channels[level.channel.index()].as_deref().unwrap_or(&[]);
        let rest = mean(&shows[..k.first]);
        let push: Vec<f64> = shows.iter().map(|v| (v - rest).abs()).collect();
        notes.extend(channels[2].as_mut().and_then(|x| zero(x, &push, k)));
        notes.extend(channels[0].as_mut().and_then(|f| tare(f, k)));
    }
    if let ([Some(force), _, Some(x)], Kind::Indentation) = (&mut channels, kind) {
        notes.extend(zero_of_press(x, force, pressed.as_ref()));
    }
    let touch = found.map(|k| (time[k.first], time[k.last] - time[k.first]));
    Ok(Samples { time, channels, touch, turned, shown, notes })
}

/// The samples kept around a contact and its bounces.
fn exact(y: &[f64], k: &Contact, level: &Level, cut: Cut) -> (usize, usize) {
    let length = (k.last + 1 - k.first) as u64;
    let within = (k.first + bounces(length) as usize).min(y.len());
    let mut end = k.last + 1;
    while let Some(next) = y.get(end..within).and_then(|rest| contact(rest, level)) {
        end += next.last + 1;
    }
    let pad = pad(length) as usize;
    let from = if cut == Cut::Behind { 0 } else { k.first.saturating_sub(pad) };
    (from, (end + pad).min(y.len()))
}

fn mean(y: &[f64]) -> f64 {
    y.iter().sum::<f64>() / y.len().max(1) as f64
}

/// Samples that show where a press begins.
const START: usize = 3;

/// Standard deviation of the noise of samples, in their unit: by the median of the second differences, which a slow course
/// leaves out; where more than half of these are zero, by the smallest step between samples. Zero where all are equal.
fn noise(y: &[f64]) -> f64 {
    let second: Vec<f64> = y.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).abs()).collect();
    let sd = if second.is_empty() { 0.0 } else { spread(second) / 6f64.sqrt() };
    if sd > 0.0 {
        return sd;
    }
    let step = y.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).fold(f64::INFINITY, f64::min);
    if step.is_finite() {
        step
    } else {
        0.0
    }
}

/// How far a channel goes in the contact the way that the format has it, in its unit: negative where its sign is to be turned,
/// so that force and penetration are positive and acceleration is negative in the contact. Zero where no contact is known.
fn way(kind: Kind, channel: Channel, channels: &[Option<Vec<f64>>; 3], found: Option<&Contact>) -> f64 {
    let Some(y) = &channels[channel.index()] else { return 0.0 };
    let ends = |y: &[f64]| {
        let few = (y.len() / 20).max(1);
        0.5 * (mean(&y[..few]) + mean(&y[y.len() - few..]))
    };
    // a press begins at rest, and may end in the contact
    let start = |y: &[f64]| mean(&y[..y.len().min(START)]);
    let at = match (kind, found, &channels[2]) {
        // the deepest tenth, whichever way deep is
        (Kind::Indentation, _, Some(x)) => {
            let rest = start(x);
            let most = x.iter().map(|v| (v - rest).abs()).fold(0.0, f64::max);
            let deep: Vec<f64> =
                x.iter().zip(y).filter(|(x, _)| (*x - rest).abs() > 0.9 * most).map(|p| *p.1).collect();
            mean(&deep)
        }
        (_, Some(k), _) => mean(&y[k.first..=k.last]),
        _ => return 0.0,
    };
    let rest = match (channel, found) {
        _ if kind == Kind::Indentation => start(y),
        (Channel::Penetration, _) | (_, None) => ends(y),
        (_, Some(k)) if k.first > 0 => mean(&y[..k.first]),
        _ => y[y.len() - 1],
    };
    let right = if channel == Channel::Acceleration { -1.0 } else { 1.0 };
    right * (at - rest)
}

/// Where the surface of the stop lies on the scale of the penetration: the line through it and the push^(2/3), as of a
/// sphere on a plane (Hertz 1882), while the push rises, carried on to no push.
fn surface(x: &[f64], push: &[f64], k: &Contact) -> f64 {
    let top = (k.first..=k.last).fold(k.first, |t, i| if push[i] > push[t] { i } else { t });
    let rising: Vec<(f64, f64)> =
        (k.first..top).filter(|i| push[*i] < RISING * push[top]).map(|i| (push[i].powf(2.0 / 3.0), x[i])).collect();
    let n = rising.len() as f64;
    let (mu, mx) = (rising.iter().map(|p| p.0).sum::<f64>() / n, rising.iter().map(|p| p.1).sum::<f64>() / n);
    let suu: f64 = rising.iter().map(|p| (p.0 - mu).powi(2)).sum();
    let sux: f64 = rising.iter().map(|p| (p.0 - mu) * (p.1 - mx)).sum();
    if rising.len() < 3 || suu <= 0.0 {
        return x[k.first];
    }
    mx - sux / suu * mu
}

/// Sets penetration to zero at the surface of the stop where it is far from it; says so.
fn zero(x: &mut [f64], push: &[f64], k: &Contact) -> Option<String> {
    let surface = surface(x, push, k);
    let depth = x[k.first..=k.last].iter().fold(0.0, |m: f64, v| m.max(v - surface));
    if surface.abs() <= ZERO * depth {
        return None;
    }
    x.iter_mut().for_each(|v| *v -= surface);
    Some(format!("penetration read {} m at the touch: that was set to zero", brief(surface)))
}

/// Where a press begins and ends: where its force rises from the level it has before, by its noise. The force at the start is
/// that of no contact. None where it does not stand out.
fn press(force: &[f64]) -> Option<Contact> {
    let rest = mean(&force[..force.len().min(START)]);
    let noise = noise(force);
    let k = contact(force, &Level::of(Channel::Force, rest, noise, force))?;
    let before = &force[..k.first];
    // few samples before it are a rise as likely as a level
    let (middle, scatter) = if before.len() < LEARNT {
        (force[0], noise)
    } else {
        let middle = median(before.to_vec());
        (middle, noise.max(spread(before.iter().map(|v| (v - middle).abs()).collect())))
    };
    let side = (force[k.first] - rest).signum();
    let first = before.iter().rposition(|v| side * (v - middle) <= scatter).map_or(0, |i| i + 1);
    Some(Contact { first, last: k.last })
}

/// Force of a press before it rises, N; and whether that is none.
fn at_rest(force: &[f64], k: &Contact) -> (f64, bool) {
    let rest = mean(&force[..k.first.max(1)]);
    let most = force.iter().fold(0.0, |m: f64, v| m.max((v - rest).abs()));
    (rest, rest.abs() <= (TARE * most).max(noise(force)))
}

/// Whether a press begins outside the contact: its force stays before it rises, or is none at the start.
fn begins_free(force: &[f64], k: &Contact) -> bool {
    k.first >= LEARNT || at_rest(force, k).1
}

/// Sets the penetration of a press to zero where its contact begins, where it is far from it there, as that of a gap or a
/// position is; says so, or why it was not.
fn zero_of_press(x: &mut [f64], force: &[f64], pressed: Option<&Contact>) -> Option<String> {
    let cure = "record from before the contact on, or subtract what it reads at the touch from the column";
    let range = |x: &[f64], from: f64| x.iter().fold(0.0, |m: f64, v| m.max(v - from));
    let Some(k) = pressed else {
        let far = x.first().is_some_and(|begin| begin.abs() > ZERO * range(x, *begin));
        return far.then(|| {
            format!(
                "penetration reads {} m at the start, and the force does not stand out of its noise: the zero was left as it \
                 is; {cure}",
                brief(x[0])
            )
        });
    };
    let surface = x[k.first];
    if surface.abs() <= ZERO * range(&x[k.first..=k.last], surface) {
        return None;
    }
    // it nears the stop while the force stays; else the force has to be none before it rises
    let nears = k.first >= LEARNT && (surface - x[0]).abs() > STANDS_OUT * noise(x);
    let (rest, is_none) = at_rest(force, k);
    if !nears && !is_none {
        return Some(format!(
            "penetration reads {} m and force {} N at the start, which may lie in the contact: the zero was left as it is; \
             {cure}",
            brief(surface),
            brief(rest)
        ));
    }
    x.iter_mut().for_each(|v| *v -= surface);
    Some(format!("penetration read {} m where the force begins to rise: that was set to zero", brief(surface)))
}

/// Sets force to zero before the touch where it is far from it; says so.
fn tare(f: &mut [f64], k: &Contact) -> Option<String> {
    let rest = mean(&f[..k.first]);
    let most = f.iter().fold(0.0, |m: f64, v| m.max((v - rest).abs()));
    if k.first < LEARNT || rest.abs() <= TARE * most {
        return None;
    }
    f.iter_mut().for_each(|v| *v -= rest);
    Some(format!("force read {} N before the touch: that was set to zero", brief(rest)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::find::tests::noise;
    use crate::guess::{columns, tests::group};
    use crate::map::parse;
    use crate::split::tracks;
    use instruments::Memory;

    /// Force in kN pulling, acceleration in g, a distance in mm that shrinks as the body nears: a contact at row 5000.
    fn file(offset: f64) -> Memory {
        let n = 20_000u64;
        let pulse = |i: u64| {
            if (5000..5100).contains(&i) {
                (std::f64::consts::PI * (i - 5000) as f64 / 100.0).sin()
            } else {
                0.0
            }
        };
        let time = (0..n).map(|i| 0.02 * i as f64).collect();
        let force = (0..n).map(|i| offset - 2.0 * pulse(i) + 1e-3 * noise(i)).collect();
        let acceleration = (0..n).map(|i| 400.0 * pulse(i) + 0.1 * noise(i)).collect();
        let way = |i: u64| 30.0 + 0.02 * (i.abs_diff(5050) as f64 - 50.0);
        let samples = vec![time, force, acceleration, (0..n).map(way).collect()];
        let groups = vec![group(&[("t", "ms"), ("F", "kN"), ("a", "g"), ("Distance", "mm")])];
        Memory { groups, samples: vec![samples], notes: Vec::new() }
    }

    fn taken(map: &str, cut_at: Cut) -> Samples {
        taken_of(file(0.0), map, cut_at, 0.0)
    }

    fn taken_of(mut m: Memory, map: &str, cut_at: Cut, base: f64) -> Samples {
        let map = if map.is_empty() { Vec::new() } else { parse(map).unwrap() };
        let t = tracks(&m.groups[0], &columns(&m.groups[0], &map).unwrap(), None, false).unwrap();
        let level = Level { channel: Channel::Force, base, noise: 1.0, level: 8.0, weighs: false };
        let rows = around(&[(4998, 5110)], (0, 20_000), 1, (0, 20_000));
        assert_eq!(rows, (4998 - 336 - 2, 5110 + 336 + 2));
        let rows = if cut_at == Cut::Around { rows } else { (0, 20_000) };
        let span = Span { group: 0, track: 0, rows, cut: cut_at, level: Some(level) };
        cut(&mut m, 0, &[(&span, &t[0])], Kind::DropTest).unwrap().remove(0).unwrap()
    }

    #[test]
    fn a_channel_that_most_rows_lack_is_no_reason_to_drop_them_without_a_word() {
        let n = 400usize;
        let force: Vec<f64> =
            (0..n).map(|i| if (200..240).contains(&i) { 50.0 } else { 0.1 * noise(i as u64) }).collect();
        let slow: Vec<f64> = (0..n).map(|i| if i % 4 == 0 { 1e-3 } else { f64::NAN }).collect();
        let time: Vec<f64> = (0..n).map(|i| 1e-3 * i as f64).collect();
        let g = group(&[("Time", "s"), ("Force", "N"), ("Position", "m")]);
        let found = columns(&g, &[]).unwrap();
        let track = tracks(&g, &found, None, false).unwrap().remove(0);
        let mut m = Memory { groups: vec![g], samples: vec![vec![time, force, slow]], notes: Vec::new() };
        let span = Span { group: 0, track: 0, rows: (0, n as u64), cut: Cut::Whole, level: None };
        let e = cut(&mut m, 0, &[(&span, &track)], Kind::DropTest).unwrap().remove(0).unwrap_err();
        assert!(e.contains("penetration holds no reading in 300 of 400 rows"), "{e}");
    }

    #[test]
    fn signs_and_zero_are_those_of_the_format() {
        let s = taken("", Cut::Around);
        assert_eq!(s.turned, Channel::ALL);
        let (at, contact) = s.touch.unwrap();
        assert!((at - 0.1).abs() < 1e-4 && (contact - 2e-3).abs() < 2e-4, "{at} {contact}");
        assert_eq!(s.time.len(), s.channels[0].as_ref().unwrap().len());
        assert!((600..800).contains(&s.time.len()), "{}", s.time.len());
        let middle = s.time.partition_point(|t| *t < 0.101);
        let at = |c: usize| s.channels[c].as_ref().unwrap()[middle];
        assert!((at(0) - 2000.0).abs() < 10.0 && (at(1) + 400.0 * 9.80665).abs() < 20.0);
        // the way from the touch to the deepest point, 50 rows of 0.02 mm, as far as a law of another power gives it
        assert!((at(2) - 1e-3).abs() < 2e-4, "{}", at(2));
        assert!(s.notes.iter().any(|n| n.contains("set to zero")), "{:?}", s.notes);
    }

    #[test]
    fn a_press_that_ends_in_the_contact_keeps_its_signs_and_a_pull_is_turned() {
        let n = 101usize;
        let time: Vec<f64> = (0..n).map(|i| 0.1 * i as f64).collect();
        let ramp = |way: f64| (0..n).map(|i| way * (i as f64 + noise(i as u64))).collect::<Vec<f64>>();
        for (way, turned) in [(1.0, vec![]), (-1.0, vec![Channel::Force, Channel::Penetration])] {
            let g = group(&[("Time", "s"), ("Force", "N"), ("Penetration", "m")]);
            let track = tracks(&g, &columns(&g, &[]).unwrap(), None, false).unwrap().remove(0);
            let samples = vec![vec![time.clone(), ramp(way), ramp(1e-3 * way)]];
            let mut m = Memory { groups: vec![g], samples, notes: Vec::new() };
            let span = Span { group: 0, track: 0, rows: (0, n as u64), cut: Cut::Whole, level: None };
            let s = cut(&mut m, 0, &[(&span, &track)], Kind::Indentation).unwrap().remove(0).unwrap();
            assert_eq!(s.turned, turned);
        }
    }

    /// A press in which a gap in mm closes by 0.05 mm a row, held at last; the touch is at a gap of 6 mm, the spring has
    /// 2 N/mm. `from`: the first row, `offset`: N.
    fn gap_closes(from: usize, offset: f64) -> Samples {
        let gap = |i: usize| 16.0 - 0.05 * i.min(240) as f64;
        let n = 900usize;
        let time: Vec<f64> = (from..n).map(|i| 0.05 * i as f64).collect();
        let force = (from..n).map(|i| offset + 2.0 * (6.0 - gap(i)).max(0.0) + 0.002 * noise(i as u64)).collect();
        let g = group(&[("Time", "s"), ("Normal force", "N"), ("Gap", "mm")]);
        let map = parse("force=Normal force,penetration=Gap").unwrap();
        let track = tracks(&g, &columns(&g, &map).unwrap(), None, false).unwrap().remove(0);
        let samples = vec![vec![time, force, (from..n).map(gap).collect()]];
        let mut m = Memory { groups: vec![g], samples, notes: Vec::new() };
        let span = Span { group: 0, track: 0, rows: (0, (n - from) as u64), cut: Cut::Whole, level: None };
        cut(&mut m, 0, &[(&span, &track)], Kind::Indentation).unwrap().remove(0).unwrap()
    }

    #[test]
    fn a_gap_that_closes_is_zero_where_the_force_begins_to_rise() {
        for offset in [0.0, 0.3] {
            let s = gap_closes(0, offset);
            assert_eq!(s.turned, [Channel::Penetration]);
            let (touch, _) = s.touch.unwrap();
            assert!((touch - 10.0).abs() <= 0.1, "{touch}");
            let x = s.channels[2].as_ref().unwrap();
            assert!(x[200].abs() <= 1e-4 && (x[899] - 2e-3).abs() <= 1e-4, "{} {}", x[200], x[899]);
            assert!(s.notes.iter().any(|n| n.contains("begins to rise: that was set to zero")), "{:?}", s.notes);
        }
        // it begins at the touch, untouched
        let x = gap_closes(200, 0.0).channels[2].clone().unwrap();
        assert!(x[0].abs() <= 1e-4, "{}", x[0]);
        // it begins within the contact
        let s = gap_closes(220, 0.0);
        assert!((s.channels[2].as_ref().unwrap()[0] + 5e-3).abs() < 1e-9);
        assert!(s.notes.iter().any(|n| n.contains("the zero was left") && n.contains("subtract")), "{:?}", s.notes);
    }

    #[test]
    fn a_press_that_begins_within_the_contact_shows_no_sign() {
        assert!(gap_closes(0, 0.0).shown[0] > 100.0 && gap_closes(0, 0.0).shown[2] < 0.0);
        assert_eq!(gap_closes(220, 0.0).shown, [0.0; 3]);
    }

    #[test]
    fn a_force_that_is_not_tared_is() {
        let s = taken_of(file(0.3), "", Cut::Around, 300.0);
        let f = s.channels[0].as_ref().unwrap();
        assert!(mean(&f[..100]).abs() < 1.0 && f.iter().any(|f| *f > 1990.0));
        assert!(s.notes.iter().any(|n| n.contains("before the touch")), "{:?}", s.notes);
        assert!(!taken("", Cut::Around).notes.iter().any(|n| n.contains("before the touch")));
    }

    #[test]
    fn what_the_user_says_of_signs_holds() {
        let s = taken("force=F:positive,acceleration=a:negative", Cut::Around);
        assert_eq!(s.turned, [Channel::Penetration]);
        assert!(s.channels[0].as_ref().unwrap().iter().any(|f| *f < -1900.0));
        assert!(s.channels[1].as_ref().unwrap().iter().any(|a| *a < -3900.0));
    }

    #[test]
    fn a_contactor_is_cut_behind_and_a_whole_one_not_at_all() {
        let s = taken("", Cut::Behind);
        assert!(s.time[0] == 0.0 && s.time.len() < 5500);
        assert_eq!(taken("", Cut::Whole).time.len(), 20_000);
    }
}
