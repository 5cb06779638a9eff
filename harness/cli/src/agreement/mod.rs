//! Channels, speeds, heights and files of a campaign, compared with each other before anything is fitted.

mod ratio;

use diagnose::figure::figure;
use estimate::impact::touch;
use estimate::statistics::median;
use ratio::{weighed, Answer, Ratio, Slip, GAIN, MASS, WAY};
use record::{Campaign, Kind, Recording, GRAVITY};
use serde::Serialize;

/// Share of its peak above which a push pushes, as the search for impacts has it.
const SHARE: f64 = 0.04;
/// Share of the peak of a contact at which it is not over: no body resting on a stop presses so hard.
const PRESSING: f64 = 0.3;
/// Share of the first peak from which a later one is a second impact, not noise.
const AGAIN: f64 = 0.3;
/// Distance of the last zero and of the surface from where they should be, in depths of the contact.
const DEPTH: f64 = 1.0;
/// Share of its travel to which a bar of a contactor bounces back only where next to nothing is lost.
const BACK: f64 = 0.9;
/// Times the flight of a free body that guides may make of it.
const HELD_UP: f64 = 1.5;
/// Standard deviation of the logarithm of a sum over a contact: where it ends, and how its zero drifts meanwhile.
const SUMS: f64 = 0.02;
/// Standard deviations that leave one in a thousand outside.
const IN_A_THOUSAND: f64 = 3.29;
/// Standard deviation of a height or a travel read off a ruler: m, and as a share.
const RULER: f64 = 5e-4;
const RULED: f64 = 0.01;
/// Standard deviation of the logarithm by which guides slow a fall.
const GUIDES: f64 = 0.5;

/// A comparison that was made, over all recordings that allow it.
#[derive(Clone, Debug, Serialize)]
pub struct Compared {
    pub what: &'static str,
    pub value: f64,
    /// 95 %.
    pub interval: [f64; 2],
    /// Where it is expected, sensors being as good as they are calibrated.
    pub expected: [f64; 2],
    pub recordings: usize,
}

/// The result of all comparisons.
#[derive(Clone, Debug, Default)]
pub struct Agreement {
    pub compared: Vec<Compared>,
    /// Differences that sensors alone do not explain, but a rig may.
    pub doubts: Vec<String>,
    /// Differences that nothing but a mistake explains.
    pub contradictions: Vec<String>,
}

/// A recording's first contact, by sample.
struct Contact {
    first: usize,
    last: usize,
    /// The push on the body, N, zero before it.
    push: Vec<f64>,
    peak: f64,
}

/// Median of what a channel reads shortly before a sample.
fn before(y: &[f64], first: usize, length: usize) -> f64 {
    let (from, to) = (first.saturating_sub(length.max(8)), first.saturating_sub(length / 10 + 1));
    let quiet = if to > from + 4 { &y[from..to] } else { &y[..(y.len() / 20).max(4).min(y.len())] };
    median(quiet.to_vec())
}

fn sample_at(r: &Recording, t: f64) -> usize {
    r.time.partition_point(|u| *u < t).min(r.time.len() - 1)
}

/// The push on the body by one channel, N: force, or mass times acceleration, less what it reads before the contact.
fn push(r: &Recording, channel: usize, mass: f64, first: usize, length: usize) -> Option<Vec<f64>> {
    let y = r.channels[channel].as_ref()?;
    let zero = before(y, first, length);
    let by = if channel == 0 { 1.0 } else { -mass };
    Some(y.iter().map(|v| by * (v - zero)).collect())
}

/// The first contact of a recording; None where nothing pushes in it.
fn contact(kind: Kind, r: &Recording, mass: f64) -> Option<Contact> {
    let (at, length) = touch(kind, r, mass)?;
    let mut first = sample_at(r, at);
    let mut last = sample_at(r, at + length);
    let push = push(r, 0, mass, first, last - first).or_else(|| push(r, 1, mass, first, last - first))?;
    let most = push[first..].iter().copied().fold(0.0, f64::max);
    let pushes = |i: &usize| push[*i] > SHARE * most;
    loop {
        // ringing parts a contact
        while let Some(more) = {
            let reach = (last + (last - first) / 2 + 4).min(push.len() - 1);
            (last + 1..=reach).rev().find(pushes)
        } {
            last = more;
        }
        if push[first..=last].iter().any(|p| *p > AGAIN * most) {
            break;
        }
        // what is so weak is noise that touched, or a slam before the contact
        let next = (last + 1..push.len().saturating_sub(2)).find(|i| (*i..*i + 3).all(|k| pushes(&k)));
        first = next?;
        last = first + 2;
    }
    // a later impact may be harder
    let peak = push[first..=last].iter().copied().fold(0.0, f64::max);
    Some(Contact { first, last, push, peak })
}

/// Sum of a push over a contact and half its length on both sides, N s.
fn impulse(time: &[f64], push: &[f64], k: &Contact) -> f64 {
    let half = (k.last - k.first) / 2 + 2;
    let (from, to) = (k.first.saturating_sub(half), (k.last + half).min(push.len() - 1));
    (from..to).map(|i| 0.5 * (push[i] + push[i + 1]) * (time[i + 1] - time[i])).sum()
}

/// Whether the push ends in the recording.
fn ends(k: &Contact) -> bool {
    let end = &k.push[k.push.len().saturating_sub(4)..];
    median(end.to_vec()) < PRESSING * k.peak
}

const FORCE_OVER_MA: [Slip; 10] = [
    Slip { factor: 1.0 / 4.448_221_6, words: "a factor of 4.448: force looks like lbf" },
    Slip { factor: 4.448_221_6, words: "a factor of 4.448: force looks like N that is called lbf" },
    Slip {
        factor: 1.0 / 9.80665,
        words: "a factor of 9.807: force looks like kgf, or acceleration like m/s^2 called g",
    },
    Slip { factor: 9.80665, words: "a factor of 9.807: acceleration looks like g, or force like N called kgf" },
    Slip { factor: 1e-3, words: "a factor of 1000: force looks like kN, or moving_mass like g" },
    Slip {
        factor: 1e3,
        words: "a factor of 1000: acceleration looks like km/s^2, force like mN or moving_mass like t",
    },
    Slip { factor: 0.1, words: "a factor of 10: force looks like daN" },
    Slip { factor: 10.0, words: "a factor of 10: force looks like N called daN" },
    Slip { factor: 1.0 / 2.204_622_6, words: "a factor of 2.205: moving_mass looks like lb" },
    Slip { factor: 2.204_622_6, words: "a factor of 2.205: moving_mass looks like kg that was taken for lb" },
];

const PUSH_OVER_SPEED: [Slip; 7] = [
    Slip { factor: 1.0 / 31.6228, words: "a factor of 31.6, the root of 1000: drop_height looks like mm" },
    Slip {
        factor: 1e-3,
        words: "a factor of 1000: the speed looks like mm/s, moving_mass like g or the force like kN",
    },
    Slip { factor: 1e3, words: "a factor of 1000: time looks like ms" },
    Slip { factor: 1e6, words: "a factor of a million: time looks like us" },
    Slip { factor: 1.0 / 4.448_221_6, words: "a factor of 4.448: force looks like lbf" },
    Slip { factor: 1.0 / 9.80665, words: "a factor of 9.807: the force looks like kgf, or the acceleration like g" },
    Slip { factor: 9.80665, words: "a factor of 9.807: the acceleration looks like m/s^2 called g" },
];

const WAY_OVER_SPEED: [Slip; 7] = [
    Slip { factor: 1e3, words: "a factor of 1000: penetration looks like mm, or the speed like km/h or mm/s" },
    Slip { factor: 1e-3, words: "a factor of 1000: the speed looks like mm/s, or time like ms" },
    Slip { factor: 25.4, words: "a factor of 25.4: penetration looks like mm called in" },
    Slip { factor: 1.0 / 25.4, words: "a factor of 25.4: penetration looks like in called mm" },
    Slip { factor: 1.0 / 31.6228, words: "a factor of 31.6, the root of 1000: drop_height looks like mm" },
    Slip { factor: 10.0, words: "a factor of 10: penetration looks like cm called mm" },
    Slip { factor: 0.1, words: "a factor of 10: penetration looks like mm called cm" },
];

const SPEED_OVER_FALL: [Slip; 5] = [
    Slip { factor: 1.0 / 31.6228, words: "a factor of 31.6, the root of 1000: drop_height looks like mm" },
    Slip { factor: 0.1, words: "a factor of 10, the root of 100: drop_height looks like cm" },
    Slip { factor: 1e3, words: "a factor of 1000: impact_speed looks like mm/s" },
    Slip { factor: 3.6, words: "a factor of 3.6: impact_speed looks like km/h" },
    Slip { factor: 1.0 / 5.0395, words: "a factor of 5.04, the root of 25.4: drop_height looks like inches" },
];

/// Where a ratio is expected: within `right`, to a standard deviation `tolerance` of its logarithm by calibrations; `below`:
/// by which standard deviation a rig lowers it, where that is more than it raises it.
struct Expected {
    right: [f64; 2],
    tolerance: f64,
    below: f64,
}

impl Agreement {
    /// Adds a comparison: what it is, and what to do where it is off.
    fn ratio(
        &mut self,
        what: &'static str,
        all: &[f64],
        Expected { right, tolerance, below }: Expected,
        slips: &[Slip],
        cure: &str,
    ) {
        let Some(r) = Ratio::of(all) else { return };
        let expected = [
            right[0] * (-IN_A_THOUSAND * tolerance.hypot(r.error)).exp(),
            right[1] * (IN_A_THOUSAND * tolerance.hypot(r.error)).exp(),
        ];
        let said = format!(
            "{what} is {} ({} to {}), where sensors as they are calibrated give {} to {}",
            figure(r.value(), ""),
            figure(r.interval()[0], ""),
            figure(r.interval()[1], ""),
            figure(expected[0], ""),
            figure(expected[1], "")
        );
        match weighed(&r, right, tolerance, below, slips) {
            Answer::Sensors => {}
            Answer::Rig => self.doubts.push(format!("{said}: {cure}")),
            Answer::Unit(s) => self.contradictions.push(format!("{said}: {}; correct the unit", s.words)),
            Answer::Nothing => self.contradictions.push(format!("{said}: {cure}")),
        }
        self.compared.push(Compared { what, value: r.value(), interval: r.interval(), expected, recordings: r.count });
    }
}

/// Compares what a campaign holds, its files as they are.
pub fn agreement(c: &Campaign) -> Agreement {
    let mut a = Agreement::default();
    same_content(c, &mut a);
    if c.kind == Kind::System {
        return a;
    }
    signs(c, &mut a);
    if c.kind == Kind::Indentation {
        return a;
    }
    let mass = c.moving_mass.unwrap_or(1.0);
    let contacts: Vec<Option<Contact>> = c.recordings.iter().map(|r| contact(c.kind, r, mass)).collect();
    let whole = || c.recordings.iter().zip(&contacts).filter_map(|(r, k)| Some((r, k.as_ref()?)));
    let both = |(r, k): (&Recording, &Contact)| {
        let of = |channel| push(r, channel, mass, k.first, k.last - k.first).map(|p| impulse(&r.time, &p, k));
        Some(of(0)? / of(1)?)
    };
    let ratios: Vec<f64> = whole().filter(|(r, k)| ends(k) && !is_flat(r, k)).filter_map(both).collect();
    let before = a.contradictions.len();
    let of_both = GAIN.hypot(GAIN).hypot(MASS);
    let cure =
        "check moving_mass and the calibrations of both, and that no mass lies between the two sensors; a diagnosis \
                tells a gain from a mass that strikes apart";
    a.ratio(
        "force over mass times acceleration",
        &ratios,
        Expected { right: [1.0, 1.0], tolerance: of_both, below: 0.0 },
        &FORCE_OVER_MA,
        cure,
    );
    if a.contradictions.len() > before || ratios.is_empty() {
        swapped(c, mass, &mut a);
    }
    if c.kind == Kind::DropTest {
        speeds(&whole().collect::<Vec<_>>(), mass, &mut a);
    }
    if let (Kind::ContactorOpening, Some(travel)) = (c.kind, c.travel) {
        begins(&whole().collect::<Vec<_>>(), travel, &mut a);
    }
    files(c, &contacts, &mut a);
    a
}

/// Says so where penetration is to mass times acceleration what force should be.
fn swapped(c: &Campaign, mass: f64, a: &mut Agreement) {
    let as_force = |r: &Recording| {
        let mut one = r.clone();
        one.channels.swap(0, 2);
        let k = contact(c.kind, &one, mass)?;
        let of = |channel| push(&one, channel, mass, k.first, k.last - k.first).map(|p| impulse(&r.time, &p, &k));
        Some(of(0)? / of(1)?)
    };
    let all: Vec<f64> = c.recordings.iter().filter_map(as_force).collect();
    let Some(r) = Ratio::of(&all) else { return };
    if let Answer::Sensors | Answer::Rig = weighed(&r, [1.0, 1.0], GAIN, 0.0, &FORCE_OVER_MA) {
        a.contradictions.push(
            "penetration is what force should be, mass times acceleration: the columns force and penetration look swapped; \
             correct the header"
                .into(),
        );
    }
}

/// Pushes and ways against the speeds given, and speeds against heights.
fn speeds(all: &[(&Recording, &Contact)], mass: f64, a: &mut Agreement) {
    let share = |r: &Recording| r.impact_speed.filter(|v| v.0 > 0.0).map(|(v, std)| (v, std / v));
    let spread = |of: Vec<f64>| if of.is_empty() { 0.0 } else { median(of) };
    let known = spread(all.iter().filter_map(|(r, _)| share(r)).map(|s| s.1).collect());
    let pushed = |(r, k): &(&Recording, &Contact)| {
        let (v, _) = share(r)?;
        // of an acceleration no mass is asked
        let by_acceleration = || push(r, 1, mass, k.first, k.last - k.first);
        let pushes = by_acceleration().unwrap_or_else(|| k.push.clone());
        (ends(k) && !is_flat(r, k)).then(|| impulse(&r.time, &pushes, k) / (mass * v))
    };
    let ratios: Vec<f64> = all.iter().filter_map(pushed).collect();
    // gravity pushes as long as the contact lasts, and drives the body on until the stop bears its weight
    let weight = |(r, k): &(&Recording, &Contact)| {
        let (v, _) = share(r)?;
        Some(GRAVITY * (r.time[k.last] - r.time[k.first.saturating_sub((k.last - k.first) / 2)]) / v)
    };
    let weight = spread(all.iter().filter_map(weight).collect());
    let cure = "check moving_mass, the speed or height of the fall, and that the zero of the channel does not drift";
    let tolerance = GAIN.hypot(MASS).hypot(known).hypot(SUMS);
    let what = "the push over mass times speed of impact (1 + restitution)";
    a.ratio(what, &ratios, Expected { right: [1.0, 2.0 + weight], tolerance, below: GUIDES }, &PUSH_OVER_SPEED, cure);
    let moved = |(r, k): &(&Recording, &Contact)| {
        let (v, _) = share(r)?;
        let x = r.channels[2].as_ref()?;
        let from = k.first.saturating_sub(((k.last - k.first) / 2).max(8));
        (ends(k) && k.first >= from + 8).then(|| slope(&r.time[from..k.first], &x[from..k.first]) / v)
    };
    let ratios: Vec<f64> = all.iter().filter_map(moved).collect();
    let cure = "check the calibration of the displacement and the speed given";
    let what = "the speed of the penetration before the touch over the speed given";
    let right = [1.0 / (1.0 + weight), 1.0 + weight];
    a.ratio(what, &ratios, Expected { right, tolerance: WAY.hypot(known), below: GUIDES }, &WAY_OVER_SPEED, cure);
    let fallen = |(r, _): &(&Recording, &Contact)| {
        let ((v, _), h) = (share(r)?, r.drop_height.filter(|h| *h > 0.0)?);
        let fall = (2.0 * GRAVITY * h).sqrt();
        // a speed that was worked out of the height says nothing
        ((v / fall - 1.0).abs() > 1e-9).then_some((v / fall, h))
    };
    let falls: Vec<(f64, f64)> = all.iter().filter_map(fallen).collect();
    let ruled = spread(falls.iter().map(|(_, h)| 0.5 * (RULER / h).hypot(RULED)).collect());
    let ratios: Vec<f64> = falls.iter().map(|f| f.0).collect();
    let cure = "nothing falls faster than freely: check drop_height and impact_speed";
    let what = "the speed of impact over that of a free fall";
    a.ratio(
        what,
        &ratios,
        Expected { right: [1.0, 1.0], tolerance: ruled.hypot(known), below: GUIDES },
        &SPEED_OVER_FALL,
        cure,
    );
}

/// Slope of a straight line through samples, least squares.
fn slope(t: &[f64], x: &[f64]) -> f64 {
    let n = t.len() as f64;
    let (mt, mx) = (t.iter().sum::<f64>() / n, x.iter().sum::<f64>() / n);
    let (mut stt, mut stx) = (0.0, 0.0);
    for (t, x) in t.iter().zip(x) {
        stt += (t - mt).powi(2);
        stx += (t - mt) * (x - mx);
    }
    stx / stt
}

/// Where a contactor begins against its travel.
fn begins(all: &[(&Recording, &Contact)], travel: f64, a: &mut Agreement) {
    let begin = |(r, k): &(&Recording, &Contact)| {
        let x = r.channels[2].as_ref()?;
        let early = (k.first / 50).clamp(1, 20);
        Some(-median(x[..early].to_vec()) / travel)
    };
    let ratios: Vec<f64> = all.iter().filter_map(begin).collect();
    let tolerance = WAY.hypot(RULED).hypot(RULER / travel / IN_A_THOUSAND);
    let cure = "the zero of the displacement is not at the stop, or travel is another one: set one of them right";
    let slips = [
        Slip { factor: 1e3, words: "a factor of 1000: penetration looks like mm" },
        Slip { factor: 1e-3, words: "a factor of 1000: travel looks like mm" },
        Slip { factor: 25.4, words: "a factor of 25.4: penetration looks like mm called in" },
        Slip { factor: 1.0 / 25.4, words: "a factor of 25.4: penetration looks like in called mm" },
    ];
    a.ratio(
        "the way from the first sample to the stop over travel",
        &ratios,
        Expected { right: [1.0, 1.0], tolerance, below: 0.0 },
        &slips,
        cure,
    );
    let wrong = all.iter().filter_map(begin).filter(|b| *b <= 0.0).count();
    if wrong > 0 {
        a.contradictions.push(format!(
            "in {wrong} recordings penetration begins at or behind the stop, though the bar is released {travel} m before \
             it: turn its sign, or set its zero to the stop"
        ));
    }
}

/// Names of the files for which `of` holds, a few of them.
fn named(all: &[&str]) -> String {
    match all.len() {
        0..=3 => all.join(", "),
        n => format!("{}, {} and {} more", all[0], all[1], n - 2),
    }
}

/// Doubts that single files raise: cut contacts, flat tops, a zero far off, several operations; and campaigns of one level.
fn files(c: &Campaign, contacts: &[Option<Contact>], a: &mut Agreement) {
    let mut lists: [Vec<&str>; 4] = Default::default();
    for (r, k) in c.recordings.iter().zip(contacts) {
        let Some(k) = k else { continue };
        let start = median(k.push[..4.min(k.push.len())].to_vec());
        if !ends(k) || (k.first == 0 && start > PRESSING * k.peak) {
            lists[0].push(&r.file);
        }
        if is_flat(r, k) {
            lists[1].push(&r.file);
        }
        if zero_is_off(r, k) {
            lists[2].push(&r.file);
        }
        if several(r, k, c.travel.filter(|_| c.kind == Kind::ContactorOpening)) {
            lists[3].push(&r.file);
        }
    }
    let texts = [
        "the recording begins or ends inside of the contact: what is lost in it cannot be told; record longer",
        "the peak has a flat top, as of a channel at the end of its range: choose a larger range; a diagnosis takes it for \
         clipping",
        "penetration at the touch is farther from zero than the contact is deep: set its zero to the surface of the stop",
        "a later impact is no bounce of the first one: it comes later than a body can bounce, or is harder; give each \
         operation a file",
    ];
    // a zero stays where it was set: of a few shallow contacts alone it is the noise
    let ways = c.recordings.iter().zip(contacts).filter(|(r, k)| k.is_some() && r.channels[2].is_some()).count();
    if 2 * lists[2].len() < ways {
        lists[2].clear();
    }
    for (list, text) in lists.iter().zip(texts).filter(|l| !l.0.is_empty()) {
        a.doubts.push(format!("{}: {text}", named(list)));
    }
}

/// Whether the peak of a channel reads the very same for longer than a smooth peak does at its resolution.
fn is_flat(r: &Recording, k: &Contact) -> bool {
    let flat = |all: &[f64]| {
        let y = &all[k.first..=k.last];
        let zero = y[0].min(y[y.len() - 1]);
        let top = y.iter().copied().fold(f64::MIN, f64::max);
        let run = longest_run(y, |v| v == top);
        // the curvature about the peak, by the width of the pulse at nine tenths of it, and the step of the resolution
        let wide = longest_run(y, |v| v - zero > 0.9 * (top - zero)).max(1) as f64;
        let mut steps: Vec<f64> = all.windows(2).map(|w| (w[1] - w[0]).abs()).filter(|d| *d > 0.0).collect();
        steps.sort_by(f64::total_cmp);
        let step = steps.get(steps.len() / 50).copied().unwrap_or(0.0);
        let smooth = wide * (step / (0.1 * (top - zero)).max(f64::MIN_POSITIVE)).sqrt();
        run >= 4 && run as f64 > IN_A_THOUSAND * (1.0 + smooth)
    };
    let of =
        |channel: usize, by: f64| r.channels[channel].as_ref().map(|y| y.iter().map(|v| by * v).collect::<Vec<_>>());
    [of(0, 1.0), of(1, -1.0)].iter().flatten().any(|y| flat(y))
}

/// Length of the longest run of samples for which `holds`.
fn longest_run(y: &[f64], holds: impl Fn(f64) -> bool) -> usize {
    let (mut run, mut longest) = (0, 0);
    for v in y {
        run = if holds(*v) { run + 1 } else { 0 };
        longest = longest.max(run);
    }
    longest
}

/// Whether penetration misses zero at the touch by more than the contact's depth.
fn zero_is_off(r: &Recording, k: &Contact) -> bool {
    let Some(x) = &r.channels[2] else { return false };
    let deepest = x[k.first..=k.last].iter().copied().fold(f64::MIN, f64::max);
    let depth = deepest - x[k.first];
    depth > 0.0 && x[k.first].abs() > DEPTH * depth
}

/// Whether an impact follows the first that is none of its bounces: a body that leaves at most as fast as it came is back
/// within twice its speed over gravity, and no harder; and a bar of a contactor does not bounce as far as its travel.
fn several(r: &Recording, k: &Contact, travel: Option<f64>) -> bool {
    if let (Some(travel), Some(x)) = (travel, &r.channels[2]) {
        let back = x[k.last..].iter().position(|x| *x < -BACK * travel);
        if back.is_some_and(|b| x[k.last + b..].iter().any(|x| *x > -(1.0 - BACK) * travel)) {
            return true;
        }
    }
    let gap = ((k.last - k.first) / 2 + 4).min(k.push.len());
    let later = &k.push[(k.last + gap).min(k.push.len())..];
    let from = k.last + gap;
    let noise = 1.4826 * median(k.push[..k.first.max(8).min(k.push.len())].iter().map(|v| v.abs()).collect());
    let level = (AGAIN * k.peak).max(IN_A_THOUSAND * noise);
    let hard = |w: &[f64]| w.iter().copied().fold(f64::INFINITY, f64::min);
    // a flight parts two impacts; a slam and what follows it in one contact are none
    let flight = |n: usize| longest_run(&later[..n], |v| v.abs() < SHARE * k.peak + IN_A_THOUSAND * noise);
    let length = k.last - k.first;
    let mut pulses = later.windows(3).enumerate().filter(|(_, w)| hard(w) > level);
    let Some((next, _)) = pulses.find(|(n, _)| flight(*n) + gap > 2 * length) else { return false };
    let peak = later[next..].windows(3).map(hard).fold(0.0, f64::max);
    let harder = peak > k.peak * (1.0 + IN_A_THOUSAND * GAIN) + IN_A_THOUSAND * noise;
    let late = |n: usize| {
        let (v, std) = r.impact_speed?;
        let back = 2.0 * (v + IN_A_THOUSAND * std) / GRAVITY;
        // the next contact rises as long as the first at most, and guides hold a body up
        let rising = r.time[k.last] - r.time[k.first];
        Some(r.time[from + n] - r.time[k.last] > HELD_UP * back + rising)
    };
    harder || late(next).unwrap_or(false)
}

/// Recordings of the same content.
fn same_content(c: &Campaign, a: &mut Agreement) {
    for (i, r) in c.recordings.iter().enumerate() {
        let same = |o: &&Recording| o.channels == r.channels && o.channels.iter().any(Option::is_some);
        if let Some(o) = c.recordings[..i].iter().find(same) {
            a.contradictions.push(format!(
                "{} holds the same readings as {}: two impacts never do; take one of them out",
                r.file, o.file
            ));
        }
    }
}

/// Forces and accelerations whose sign is turned.
fn signs(c: &Campaign, a: &mut Agreement) {
    let mass = c.moving_mass.unwrap_or(1.0);
    let mut turned: [Vec<&str>; 2] = Default::default();
    for r in &c.recordings {
        for channel in [0, 1] {
            let Some(y) = &r.channels[channel] else { continue };
            // an indentation may be pulled harder than it is pushed, and a ringing force with it
            let zero = median(y[..(y.len() / 20).max(4).min(y.len())].to_vec());
            let by = if channel == 0 { 1.0 } else { -1.0 };
            let three = |w: &[f64], up: f64| w.iter().map(|v| up * by * (v - zero)).fold(f64::INFINITY, f64::min);
            let away = |up: f64| y.windows(3).map(|w| three(w, up)).fold(0.0, f64::max);
            let (right, wrong) = (away(1.0), away(-1.0));
            let alone = |y: Vec<f64>| {
                let mut one = r.clone();
                one.channels = [None, None, None];
                one.channels[channel] = Some(y);
                touch(c.kind, &one, mass)
            };
            let only_turned = || alone(y.clone()).is_none() && alone(y.iter().map(|v| -v).collect()).is_some();
            if c.kind != Kind::Indentation && wrong > right && (wrong > 2.0 * right || only_turned()) {
                turned[channel].push(&r.file);
            }
        }
    }
    // an acceleration beside a force that is right is judged by that
    let beside = |file: &&str| c.recordings.iter().any(|r| r.file == *file && r.channels[0].is_some());
    let force_right = |file: &&str| beside(file) && !turned[0].contains(file);
    turned[1] = turned[1].iter().copied().filter(|f| !force_right(f)).collect();
    let texts = [
        "force falls in the impact: its sign is turned; it is positive while the stop is pressed",
        "acceleration rises in the impact: its sign is turned; it is negative while the stop pushes back",
    ];
    if !turned[0].is_empty() && turned[0] == turned[1] {
        a.contradictions.push(format!(
            "{}: force falls and acceleration rises in the impact: the columns force and acceleration look swapped, or both \
             signs are turned; correct the header",
            named(&turned[0])
        ));
        return;
    }
    for (list, text) in turned.iter().zip(texts).filter(|l| !l.0.is_empty()) {
        a.contradictions.push(format!("{}: {text}", named(list)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half sines of 2 ms at 10 ms in force and acceleration, a way before it, of a body of 1 kg.
    fn campaign(gain: f64) -> Campaign {
        let n = 3000;
        let noise = |i: usize, k: usize| {
            let z = ((i * 31 + k * 1_000_003 + 7) as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        let time: Vec<f64> = (0..n).map(|i| 1e-5 * i as f64).collect();
        let shape = |t: f64| {
            if (0.010..0.012).contains(&t) {
                (std::f64::consts::PI * (t - 0.010) / 0.002).sin()
            } else {
                0.0
            }
        };
        let recordings = (0..6)
            .map(|k| {
                let peak = 500.0 + 100.0 * k as f64;
                // 2 peak T / pi = m v (1 + e), e 0.7
                let v = 2.0 * peak * 2e-3 / std::f64::consts::PI / 1.7;
                let force = (0..n).map(|i| gain * (peak * shape(time[i]) + noise(i, k))).collect();
                let acceleration = (0..n).map(|i| -peak * shape(time[i]) + noise(i, k + 50)).collect();
                let way = (0..n).map(|i| v * (time[i].min(0.011) - 0.010) + 1e-6 * noise(i, k + 90)).collect();
                Recording {
                    order: k as f64,
                    level: k,
                    drop_height: Some(v * v / (2.0 * GRAVITY)),
                    impact_speed: Some((1.0001 * v, 0.003 * v)),
                    ..Recording::of(&format!("r{k:02}.csv"), time.clone(), [Some(force), Some(acceleration), Some(way)])
                }
            })
            .collect();
        Campaign { moving_mass: Some(1.0), ..Campaign::of("c", Kind::DropTest, recordings) }
    }

    fn said(c: &Campaign) -> (String, String) {
        let a = agreement(c);
        (a.doubts.join("\n"), a.contradictions.join("\n"))
    }

    #[test]
    fn what_agrees_is_compared_and_nothing_is_said() {
        let a = agreement(&campaign(1.0));
        assert_eq!((a.doubts, a.contradictions), (Vec::new(), Vec::new()));
        assert_eq!(a.compared.len(), 4);
        assert!(
            (a.compared[0].value - 1.0).abs() < 5e-3 && (a.compared[1].value - 1.7).abs() < 0.02,
            "{:?}",
            a.compared
        );
    }

    #[test]
    fn a_force_in_lbf_is_named() {
        let (_, c) = said(&campaign(1.0 / 4.448));
        assert!(c.contains("force looks like lbf"), "{c}");
    }

    #[test]
    fn a_mass_ten_per_cent_off_is_a_doubt() {
        let mut c = campaign(1.0);
        c.moving_mass = Some(1.1);
        let (doubts, contradictions) = said(&c);
        assert!(doubts.contains("force over mass times acceleration is 0.9") && contradictions.is_empty(), "{doubts}");
    }

    #[test]
    fn a_height_in_mm_is_named() {
        let mut c = campaign(1.0);
        for r in &mut c.recordings {
            let h = 1e3 * r.drop_height.unwrap();
            (r.drop_height, r.impact_speed) = (Some(h), Some(((2.0 * GRAVITY * h).sqrt(), 0.01)));
        }
        assert!(said(&c).1.contains("drop_height looks like mm"), "{:?}", said(&c));
    }

    #[test]
    fn a_turned_force_is_named_though_the_others_of_its_files_go_on() {
        let mut c = campaign(1.0);
        for r in &mut c.recordings[1..] {
            r.channels[0].iter_mut().flatten().for_each(|f| *f = -*f);
        }
        assert!(said(&c).1.contains("r01.csv, r02.csv and 3 more: force falls in the impact"), "{:?}", said(&c));
    }

    #[test]
    fn the_same_content_twice_is_no_two_impacts() {
        let mut c = campaign(1.0);
        c.recordings[4].channels = c.recordings[1].channels.clone();
        assert!(said(&c).1.contains("r04.csv holds the same readings as r01.csv"));
    }

    #[test]
    fn swapped_columns_are_named() {
        let mut c = campaign(1.0);
        c.recordings.iter_mut().for_each(|r| r.channels.swap(0, 2));
        assert!(said(&c).1.contains("force and penetration look swapped"), "{:?}", said(&c));
        let mut c = campaign(1.0);
        c.recordings.iter_mut().for_each(|r| r.channels.swap(0, 1));
        assert!(said(&c).1.contains("force and acceleration look swapped"), "{:?}", said(&c));
    }

    #[test]
    fn a_contactor_that_begins_where_its_travel_says_is_right_and_another_is_not() {
        let mut c = campaign(1.0);
        (c.kind, c.travel) = (Kind::ContactorOpening, Some(0.004));
        for r in &mut c.recordings {
            for (x, t) in r.channels[2].as_mut().unwrap().iter_mut().zip(&r.time) {
                *x = -0.004 * (1.0 - (t / 0.010).min(1.0).powi(2));
            }
        }
        assert_eq!(said(&c), (String::new(), String::new()));
        let shift = |c: &mut Campaign, by: &dyn Fn(f64) -> f64| {
            c.recordings.iter_mut().for_each(|r| r.channels[2].iter_mut().flatten().for_each(|x| *x = by(*x)));
        };
        let mut twice = c.clone();
        let x = twice.recordings[0].channels[2].as_mut().unwrap();
        let (first, n) = (x[..1000].to_vec(), x.len());
        x[n - 1000..].copy_from_slice(&first);
        assert!(said(&twice).0.contains("give each operation a file"), "{:?}", said(&twice));
        shift(&mut c, &|x| x - 0.0008);
        assert!(said(&c).0.contains("the way from the first sample to the stop over travel is 1.2"), "{:?}", said(&c));
        shift(&mut c, &|x| x + 0.0058);
        assert!(said(&c).1.contains("begins at or behind the stop"), "{:?}", said(&c));
    }

    #[test]
    fn a_flat_top_a_cut_contact_a_far_zero_and_a_second_drop_are_doubts() {
        let mut c = campaign(1.0);
        c.recordings[0].channels[0].iter_mut().flatten().for_each(|f| *f = f.min(400.0));
        let cut = &mut c.recordings[1];
        cut.time.truncate(1100);
        cut.channels.iter_mut().flatten().for_each(|y| y.truncate(1100));
        for r in &mut c.recordings[2..] {
            r.channels[2].iter_mut().flatten().for_each(|x| *x -= 0.01);
        }
        // the same pulse again, 16 ms later: no bounce is as hard
        let again = c.recordings[3].channels.clone();
        for (y, first) in c.recordings[3].channels.iter_mut().zip(again).take(2) {
            for (i, v) in first.unwrap()[900..1300].iter().enumerate() {
                y.as_mut().unwrap()[2500 + i] = 1.2 * v;
            }
        }
        let (doubts, _) = said(&c);
        for (file, words) in [
            ("r00.csv", "flat top"),
            ("r01.csv", "inside of the contact"),
            ("r02.csv", "farther from zero"),
            ("r03.csv", "no bounce"),
        ] {
            assert!(doubts.lines().any(|l| l.starts_with(file) && l.contains(words)), "{file}: {doubts}");
        }
    }
}
