//! What is judged of long recordings: a window around the impact, and means of samples where a contact holds more of them
//! than its pulse does. What takes means takes the noise above half their rate out (a boxcar as anti-aliasing filter).

use crate::impact::{pulse, push_of};
use record::statistics::means;
use record::{Campaign, Kind, Recording};

/// Samples up to which a recording is judged as it is.
const LONG: usize = 4000;
/// Samples that a contact keeps at least: values at the middle of so few are those of a smooth pulse to 1e-8 of its peak.
const CONTACT: usize = 200;
/// Parts of a mean's width at which courses of the whole recording are worked out: straight lines between them keep to a
/// smooth pulse within 2e-6 of its peak.
const PARTS: usize = 4;
/// Contact times kept before the first touch and after the last contact.
const AROUND: usize = 2;
/// Samples kept there at least, to learn the noise from.
const QUIET: usize = 200;
/// Samples, or means, from the first touch on within which contacts are judged: bounces say much of the losses, but most
/// of it is said by then.
const MOST: usize = LONG;

/// The contacts in a recording, by sample.
struct Contacts {
    first: usize,
    /// Samples of the first.
    length: usize,
    /// End of the last that is judged.
    end: usize,
}

/// Values at the middle of each `m` samples: their mean less what the curvature of a smooth course adds to it, which the
/// means on either side determine (LeVeque 2002, Finite Volume Methods, section 17: a cell's mean and the value at its middle
/// differ by h^2 y''/24).
fn middles(y: &[f64], m: usize) -> Vec<f64> {
    let mean = means(y, m);
    if m == 1 {
        return mean;
    }
    let bend = |i: usize| {
        let inside = i > 0 && i + 1 < mean.len();
        if inside {
            (mean[i - 1] - 2.0 * mean[i] + mean[i + 1]) / 24.0
        } else {
            0.0
        }
    };
    (0..mean.len()).map(|i| mean[i] - bend(i)).collect()
}

/// Every so many times that there are `PARTS` of them to `m`, from the first to the last.
fn thinned(time: &[f64], m: usize) -> Vec<f64> {
    let each = (m / PARTS).max(1);
    let mut out: Vec<f64> = time.iter().step_by(each).copied().collect();
    if !(time.len() - 1).is_multiple_of(each) {
        out.push(time[time.len() - 1]);
    }
    out
}

/// Of how many samples a mean is taken where a contact holds `length` of them.
fn means_of(length: usize) -> usize {
    (length / CONTACT).max(1)
}

/// Finds the contacts; None where there is none.
fn contacts(r: &Recording, mass: f64) -> Option<Contacts> {
    let push = push_of(r, mass)?;
    let p = pulse(&push)?;
    let length = (p.last - p.first).max(1);
    // in means of what a contact keeps, where many samples of noise would pass for a touch
    let m = means_of(length);
    let y = means(&push, m);
    let first = p.first / m;
    let within = (first + MOST).min(y.len());
    let last = (first + 1..within).rev().find(|i| y[*i] > p.level && y[i - 1] > p.level);
    Some(Contacts { first: p.first, length, end: last.map_or(p.last, |i| m * i + m - 1) + 1 })
}

/// The samples of a recording that are judged, by index.
fn window(kind: Kind, samples: usize, c: &Contacts, m: usize) -> (usize, usize) {
    if kind == Kind::Indentation || samples <= LONG {
        return (0, samples);
    }
    let around = (AROUND * c.length).max(QUIET * m);
    // what comes before the touch of a contactor is its way there
    let from = if kind == Kind::DropTest { c.first.saturating_sub(around) } else { 0 };
    (from, (c.end + around).min(samples))
}

/// The campaign with a window around the impacts of long recordings, and means of their samples where a contact holds
/// many; a warning says what is judged. What is short stays as it is.
pub fn windowed(mut c: Campaign) -> Campaign {
    if c.recordings.iter().all(|r| r.time.len() <= LONG) {
        return c;
    }
    let mass = c.moving_mass.unwrap_or(1.0);
    let found: Option<Vec<Contacts>> = c.recordings.iter().map(|r| contacts(r, mass)).collect();
    let Some(found) = found else { return c };
    let of = |r: &Recording, k: &Contacts| if r.time.len() > LONG { means_of(k.length) } else { 1 };
    // noise is learnt of all recordings together: means of as many in each
    let m = c.recordings.iter().zip(&found).map(|(r, k)| of(r, k)).min().unwrap_or(1);
    let (mut all, mut judged) = (0, 0);
    let (mut shortest, mut longest) = (f64::INFINITY, 0.0f64);
    for (r, k) in c.recordings.iter_mut().zip(&found) {
        let samples = r.time.len();
        let (from, to) = window(c.kind, samples, k, m);
        all += samples;
        if m > 1 || to - from < samples {
            let whole = std::mem::take(&mut r.time);
            r.time = means(&whole[from..to], m);
            for y in r.channels.iter_mut().flatten() {
                *y = middles(&y[from..to], m);
            }
            r.whole = Some(thinned(&whole, m));
        }
        judged += r.time.len();
        let length = r.time[r.time.len() - 1] - r.time[0];
        (shortest, longest) = (shortest.min(length), longest.max(length));
    }
    if judged < all {
        let of_means = if m > 1 { format!(", as means of {m}: the pulse holds no more") } else { String::new() };
        c.warnings.push(format!(
            "{} ms around each impact are judged, {judged} of {all} samples{of_means}; predictions are of every sample.",
            lengths(1e3 * shortest, 1e3 * longest)
        ));
    }
    c
}

/// One length, or from the shortest to the longest, to four digits.
fn lengths(shortest: f64, longest: f64) -> String {
    let digits = |v: f64| format!("{:.*}", (3.0 - v.log10().floor()).clamp(0.0, 9.0) as usize, v);
    let (a, b) = (digits(shortest), digits(longest));
    if a == b {
        a
    } else {
        format!("{a} to {b}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plant::recipe::{write_campaign, Recipe};

    fn campaign(samples: usize, interval: f64) -> Campaign {
        let dir = tempfile::tempdir().unwrap();
        write_campaign(dir.path(), &Recipe { samples, interval, ..Recipe::default() }).unwrap();
        record::load(dir.path(), &mechanisms::terms()).unwrap()
    }

    #[test]
    fn a_short_recording_stays_and_a_long_one_is_judged_around_its_impact() {
        let short = windowed(campaign(700, 1e-5));
        assert!(short.warnings.is_empty() && short.recordings.iter().all(|r| r.whole.is_none()));
        let read = campaign(20_000, 1e-5);
        let long = windowed(read.clone());
        assert_eq!(long.warnings.len(), 1, "{:?}", long.warnings);
        for (a, b) in long.recordings.iter().zip(&read.recordings) {
            let whole = a.whole.as_ref().unwrap();
            assert_eq!(whole.len(), 20_000);
            let from = whole.iter().position(|t| *t == a.time[0]).unwrap();
            assert!(a.time.len() < LONG + 400, "{}", a.time.len());
            // what is judged stands as it was read
            for (y, all) in a.channels.iter().flatten().zip(b.channels.iter().flatten()) {
                assert_eq!(y[..], all[from..from + y.len()]);
            }
        }
    }

    #[test]
    fn a_dense_recording_is_judged_by_means_that_keep_its_pulse() {
        let dense = windowed(campaign(35_000, 2e-7));
        let m = (dense.recordings[0].time[1] - dense.recordings[0].time[0]) / 2e-7;
        assert!(m > 4.0, "{m}");
        let (fine, coarse) = (campaign(35_000, 2e-7), &dense.recordings[3]);
        let peak = |y: &[f64]| y.iter().cloned().fold(0.0, f64::max);
        let force = |r: &Recording| peak(r.channels[0].as_ref().unwrap());
        assert!((force(coarse) / force(&fine.recordings[3]) - 1.0).abs() < 0.02);
        assert!(contacts(coarse, 0.5).unwrap().length >= CONTACT / 2);
        // every row of the file knows its place and the nearest sample judged
        let row = coarse.rows.get(12_345);
        assert!((coarse.place(&row).of(coarse.all_times()) - row.time).abs() < 1e-12);
        assert!((coarse.time[coarse.judged_sample_of(&row)] - row.time).abs() <= 0.5 * m * 2e-7 + 1e-9);
    }
}
