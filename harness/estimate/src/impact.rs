//! The impact in a recording: where it is, and whether it is one at all.

use crate::statistics::{median, thirds};
use record::{Kind, Recording};

/// Share of its peak above which a pulse pushes.
const SHARE: f64 = 0.04;
/// Times the noise that a peak has to reach.
const STANDS_OUT: f64 = 8.0;
/// Samples from which the noise before a pulse can be told.
const QUIET: usize = 8;

/// The first pulse of a signal that pushes.
pub(crate) struct Pulse {
    /// Index of its first crossing of `level`, and its last sample above.
    pub first: usize,
    pub last: usize,
    /// The largest reading of all, and the share of it above which a pulse pushes.
    pub peak: f64,
    pub level: f64,
}

/// The first pulse of a signal that pushes.
pub(crate) fn pulse(y: &[f64]) -> Option<Pulse> {
    let peak = y.iter().cloned().fold(f64::MIN, f64::max);
    if peak.is_nan() || peak <= 0.0 {
        return None;
    }
    let level = SHARE * peak;
    let n = y.len();
    // three in a row, so that a spike is no touch
    let first = (0..n.saturating_sub(2)).find(|i| y[*i] > level && y[i + 1] > level && y[i + 2] > level)?;
    let mut last = first;
    let mut below = 0;
    for (i, v) in y.iter().enumerate().skip(first) {
        if *v > level {
            last = i;
            below = 0;
        } else {
            below += 1;
            if below > 4 {
                break;
            }
        }
    }
    Some(Pulse { first, last, peak, level })
}

/// Whether a channel tells the push itself, not the way alone.
fn pushes(r: &Recording) -> bool {
    r.channels[0].is_some() || r.channels[1].is_some()
}

/// What pushes on the body in a recording: force, or mass times acceleration, or at least the way. None without a
/// channel.
pub(crate) fn push_of(r: &Recording, mass: f64) -> Option<Vec<f64>> {
    let rest = |y: &[f64]| median(y[..(y.len() / 20).max(4)].to_vec());
    match (&r.channels[0], &r.channels[1], &r.channels[2]) {
        (Some(f), _, _) => {
            let zero = rest(f);
            Some(f.iter().map(|v| v - zero).collect())
        }
        (_, Some(a), _) => {
            let zero = rest(a).clamp(-2.0, 2.0);
            Some(a.iter().map(|v| mass * (zero - v)).collect())
        }
        (_, _, x) => x.clone(),
    }
}

/// What pushes in a recording, and its first pulse.
pub(crate) struct Impact {
    pub push: Vec<f64>,
    pub pulse: Pulse,
}

/// The impact in a recording of a body of `mass` kg.
///
/// # Errors
/// Why there is none.
pub(crate) fn impact(kind: Kind, r: &Recording, mass: f64) -> Result<Impact, &'static str> {
    let push = push_of(r, mass).ok_or("it holds no channel to judge")?;
    let pulse = pulse(&push).ok_or("no impact is to be seen in it")?;
    // where something pushes from the start it may be noise that does: what comes before the largest reading's own rise
    let before = if pulse.first > QUIET || kind == Kind::Indentation {
        &push[..pulse.first]
    } else {
        let top = push.iter().position(|v| *v >= pulse.peak).unwrap_or(0);
        let rise = push[..top].iter().rposition(|v| *v <= pulse.level).map_or(0, |i| i + 1);
        &push[..rise]
    };
    let noise = if before.len() <= QUIET {
        median(thirds(&push)) / 20f64.sqrt()
    } else if pushes(r) {
        median(before.iter().map(|v| v.abs()).collect())
    } else {
        // a penetration is far below zero before touch: differences of third order see its noise alone
        median(thirds(before)) / 20f64.sqrt()
    };
    if pulse.peak < STANDS_OUT * noise {
        return Err("its peak does not stand out of the noise");
    }
    Ok(Impact { push, pulse })
}

/// Where the first impact of a recording of a body of `mass` kg begins, and how long it pushes, s. None where there is
/// none.
pub fn touch(kind: Kind, r: &Recording, mass: f64) -> Option<(f64, f64)> {
    let found = impact(kind, r, mass).ok()?.pulse;
    Some((r.time[found.first], r.time[found.last] - r.time[found.first]))
}
