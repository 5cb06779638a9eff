//! Where a body that is held is let go. An accelerometer tells the two apart without a doubt: at rest it reads one g more push
//! than in free fall, whether it was zeroed or not.

use crate::statistics::{means, median, spread_of_course};
use crate::GRAVITY;

/// Push over mass from which on a body is nearer to rest than to free fall, m/s^2.
const HALF: f64 = 0.5 * GRAVITY;
/// Standard deviations of white noise that none of a recording's samples reaches: one in 1.7 million would.
const NEVER: f64 = 5.0;
/// Fewest means in which a release is looked for.
const FEWEST: usize = 32;
/// A body that bounces back as fast as it came flies up and down again: twice as long as it fell, and its impact takes twice
/// the speed of the fall.
const BOUNCED: f64 = 2.0;
/// Factor between a speed of impact that was measured and that of a free fall beyond which they are not of one drop.
const APART: f64 = 3.0;

/// A release: a body that rested falls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Release {
    /// The first sample of the fall: it is let go altogether.
    pub first: usize,
    /// Reading of the accelerometer in the fall as its zero is: 0, or one g the way of the fall where it was zeroed at rest,
    /// m/s^2.
    pub fall: f64,
}

/// Whether a body on which so much pushes, over its mass, m/s^2, falls: that is nearer to nothing than to its weight.
pub fn falls(push: f64) -> bool {
    push.abs() < HALF
}

/// The release in the readings `a`, m/s^2, of an accelerometer along the motion, as many as `time`, s; None where the recording
/// begins in the fall, as most do, or noise hides one g. `signs`: what a push may read, 1 or -1, or both where that is not known.
///
/// It is where the first fall before the hardest push begins: no later flight is longer than twice that. The impact takes the
/// speed that the body has by then; what falls too short for its impact is none.
pub fn release(time: &[f64], a: &[f64], signs: &[f64]) -> Option<Release> {
    let lengths = (0..).map(|i| 1 << i).take_while(|m| *m == 1 || a.len() / m >= FEWEST);
    let quiet = |a: &[f64]| a.len() >= 4 && NEVER * spread_of_course(a) < HALF;
    let (m, coarse) = lengths.map(|m| (m, means(a, m))).find(|(_, coarse)| quiet(coarse))?;
    let time = means(&time[..a.len()], m);
    let zeros = [0.0, 1.0];
    let found = zeros.iter().flat_map(|z| signs.iter().map(move |s| (*s, 0.0 - z * s * GRAVITY))).find_map(
        |(sign, fall)| {
            let push: Vec<f64> = coarse.iter().map(|v| sign * (v - fall)).collect();
            first_fall(&time, &push).map(|first| Release { first, fall })
        },
    )?;
    // a mean may hold some of the rest
    let begins = if m == 1 { found.first } else { found.first + 1 };
    Some(Release { first: m * begins, ..found })
}

/// The first sample of the fall that a rest comes before, and an impact behind. `push`: over mass, m/s^2.
fn first_fall(time: &[f64], push: &[f64]) -> Option<usize> {
    let top = (0..push.len()).max_by(|i, j| push[*i].total_cmp(&push[*j]))?;
    // the hardest reading is the impact's
    if push.iter().any(|p| -p > push[top]) {
        return None;
    }
    let runs = runs(&push[..top]);
    let lasts = |r: &(usize, usize)| time[r.1] - time[r.0];
    let longest = runs.iter().map(lasts).fold(0.0, f64::max);
    let (from, end) = *runs.iter().find(|r| BOUNCED * lasts(r) >= longest)?;
    let rests = from > 0 && (median(push[..from].to_vec()) - GRAVITY).abs() < HALF;
    if !rests {
        return None;
    }
    let step = |i: usize| time[i] - time[i - 1];
    let speed: f64 = (from.max(1)..end).map(|i| (GRAVITY - push[i]) * step(i)).sum();
    let (mut taken, mut most) = (0.0, 0.0f64);
    for i in end..push.len() {
        taken += (push[i] - GRAVITY) * step(i);
        most = most.max(taken);
    }
    if most <= 0.0 || most > BOUNCED * APART * speed {
        return None;
    }
    // it is let go within a few samples, in which the reading comes down to that of the fall
    (from..end - 1).find(|i| push[i + 1] >= push[*i]).or(Some(from))
}

/// Runs of samples in which the body falls: the first, and the one behind.
fn runs(push: &[f64]) -> Vec<(usize, usize)> {
    let mut runs = Vec::new();
    let mut from = None;
    for (i, p) in push.iter().enumerate() {
        match (falls(*p), from) {
            (true, None) => from = Some(i),
            (false, Some(f)) => {
                runs.push((f, i));
                from = None;
            }
            _ => {}
        }
    }
    runs.extend(from.map(|f| (f, push.len())));
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A body held for 1 s, let go, and stopped after 0.3 s by half a sine of 0.02 s, that bounces and rests at last; 1 kHz.
    /// Readings as a push has it that reads `sign`, and at rest `rest` g; noise of `noise` m/s^2.
    fn drop(sign: f64, rest: f64, noise: f64) -> (Vec<f64>, Vec<f64>) {
        let time: Vec<f64> = (0..3000).map(|i| 1e-3 * f64::from(i)).collect();
        let peak = PI / 0.02 * 0.5 * 1.5 * GRAVITY * 0.3;
        let push = |t: f64| match t {
            t if t < 1.0 => GRAVITY,
            t if t < 1.3 => 0.0,
            t if t < 1.32 => peak * (PI * (t - 1.3) / 0.02).sin(),
            t if t < 1.62 => 0.0,
            t if t < 1.64 => 0.5 * peak * (PI * (t - 1.62) / 0.02).sin(),
            _ => GRAVITY,
        };
        let jitter = |i: usize| {
            let mixed = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            noise * ((mixed >> 32) as f64 / f64::from(1u32 << 31) - 1.0)
        };
        let a = time.iter().enumerate().map(|(i, t)| sign * (push(*t) + (rest - 1.0) * GRAVITY) + jitter(i)).collect();
        (time, a)
    }

    #[test]
    fn a_rest_before_the_fall_is_known_by_its_one_g_zeroed_or_not() {
        for sign in [1.0, -1.0] {
            for (rest, fall) in [(1.0, 0.0), (0.0, -sign * GRAVITY)] {
                for noise in [0.0, 1.0, 6.0] {
                    let (time, a) = drop(sign, rest, noise);
                    let r = release(&time, &a, &[1.0, -1.0]).unwrap_or_else(|| panic!("{sign} {rest} {noise}"));
                    assert_eq!(r.fall, fall);
                    let late = r.first as i64 - 1000;
                    assert!((0..if noise > 1.0 { 130 } else { 4 }).contains(&late), "{sign} {rest} {noise}: {r:?}");
                    assert_eq!(release(&time, &a, &[-sign]), None);
                }
            }
        }
    }

    #[test]
    fn a_recording_that_begins_in_the_fall_has_no_release() {
        for rest in [1.0, 0.0] {
            for from in [1001, 1200] {
                let (time, a) = drop(-1.0, rest, 0.5);
                assert_eq!(release(&time[from..], &a[from..], &[1.0, -1.0]), None, "{rest} {from}");
            }
        }
        // noise of ten g on 3000 samples
        let (time, a) = drop(-1.0, 1.0, 500.0);
        assert_eq!(release(&time, &a, &[-1.0]), None);
    }

    #[test]
    fn a_pulse_that_pulls_has_no_release_however_its_flanks_read() {
        let (time, mut a) = drop(-1.0, 1.0, 0.0);
        a[..1300].fill(0.0);
        // of a push that reads 1 and a zero at rest the flank would be a fall, and what drifts behind it an impact
        a[1320..1325].fill(-GRAVITY);
        a.iter_mut().skip(1325).for_each(|a| *a = 0.1);
        assert_eq!(release(&time, &a, &[1.0, -1.0]), None);
    }

    #[test]
    fn what_falls_too_short_for_its_impact_is_no_fall() {
        // the zero is one g off, and a filter reads the pulse a little ahead
        let (time, mut a) = drop(-1.0, 1.0, 0.0);
        a[..1300].fill(-GRAVITY);
        a[1290..1300].fill(0.0);
        assert_eq!(release(&time, &a, &[-1.0]), None);
    }
}
