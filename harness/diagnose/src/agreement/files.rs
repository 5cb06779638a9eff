//! Doubts that single files raise: cut contacts, flat tops, a zero far off, several operations.

use super::contact::{ends, Contact, AGAIN, PRESSING, SHARE};
use super::ratio::GAIN;
use super::{named, Agreement, IN_A_THOUSAND};
use record::statistics::median;
use record::{Campaign, Kind, Recording, GRAVITY};

/// Distance of the last zero and of the surface from where they should be, in depths of the contact.
const DEPTH: f64 = 1.0;
/// Share of its travel to which a bar of a contactor bounces back only where next to nothing is lost.
const BACK: f64 = 0.9;
/// Times the flight of a free body that guides may make of it.
const HELD_UP: f64 = 1.5;

/// Doubts that single files raise: cut contacts, flat tops, a zero far off, several operations; and campaigns of one level.
pub fn files(c: &Campaign, contacts: &[Option<Contact>], a: &mut Agreement) {
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
pub fn is_flat(r: &Recording, k: &Contact) -> bool {
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
