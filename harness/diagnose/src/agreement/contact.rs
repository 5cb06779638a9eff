//! The first contact of a recording as it was read: where it is, and its push.

use estimate::impact::touch;
use record::statistics::median;
use record::{Kind, Recording};

/// Share of its peak above which a push pushes, as the search for impacts has it.
pub const SHARE: f64 = 0.04;
/// Share of the peak of a contact at which it is not over: no body resting on a stop presses so hard.
pub const PRESSING: f64 = 0.3;
/// Share of the first peak from which a later one is a second impact, not noise.
pub const AGAIN: f64 = 0.3;

/// A recording's first contact, by sample.
pub struct Contact {
    pub first: usize,
    pub last: usize,
    /// The push on the body, N, zero before it.
    pub push: Vec<f64>,
    pub peak: f64,
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
pub fn push(r: &Recording, channel: usize, mass: f64, first: usize, length: usize) -> Option<Vec<f64>> {
    let y = r.channels[channel].as_ref()?;
    let zero = before(y, first, length);
    let by = if channel == 0 { 1.0 } else { -mass };
    Some(y.iter().map(|v| by * (v - zero)).collect())
}

/// The first contact of a recording; None where nothing pushes in it.
pub fn contact(kind: Kind, r: &Recording, mass: f64) -> Option<Contact> {
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
pub fn impulse(time: &[f64], push: &[f64], k: &Contact) -> f64 {
    let half = (k.last - k.first) / 2 + 2;
    let (from, to) = (k.first.saturating_sub(half), (k.last + half).min(push.len() - 1));
    (from..to).map(|i| 0.5 * (push[i] + push[i + 1]) * (time[i + 1] - time[i])).sum()
}

/// Whether the push ends in the recording.
pub fn ends(k: &Contact) -> bool {
    let end = &k.push[k.push.len().saturating_sub(4)..];
    median(end.to_vec()) < PRESSING * k.peak
}
