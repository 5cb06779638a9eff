//! The objective rating of ISO/TS 18571, "Road vehicles - Objective rating metric for non-ambiguous signals".
//!
//! A signal c (simulation) is rated against a reference t (measurement), N samples each, 0 (worst) to 1:
//!
//! | score | weight | equation | parameters |
//! |---|---|---|---|
//! | corridor Z | 0.4 | mean of 1 within `a0` max\|t\| of t, 0 beyond `b0` max\|t\|, ((b0 max\|t\| - \|t - c\|) / ((b0 - a0) max\|t\|))^kZ between | a0 = 0.05, b0 = 0.5, kZ = 2 |
//! | phase EP | 0.2 | ((eP N - n) / (eP N))^kP for the shift of n samples that correlates best | eP = 0.2, kP = 1 |
//! | magnitude EM | 0.2 | ((eM - e) / eM)^kM, e = sum\|c - t\| / sum\|t\| of the shifted signals after dynamic time warping in a band of 0.1 N | eM = 0.5, kM = 1 |
//! | slope ES | 0.2 | ((eS - e) / eS)^kS, e = sum\|c' - t'\| / sum\|t'\| of the shifted signals' slopes, means of nine samples (fewer at the ends) | eS = 2, kS = 1 |
//!
//! R = 0.4 Z + 0.2 EP + 0.2 EM + 0.2 ES. The standard wants both signals at [`RATE`], filtered alike and cut to the
//! interval of interest; [`crate::sampling::resample`] brings them there. Only the slope score knows of the rate, by
//! its means of nine samples (0.9 ms): pulses that are not longer than that are smoothed away, and a higher rate, which
//! is then no longer the standard's, serves them better. Nothing is rounded.

use crate::warp;

/// The sampling rate that the standard wants, Hz.
pub const RATE: f64 = 1e4;
/// Fewest samples that leave slopes to compare after the largest shift.
pub const FEWEST: usize = 11;
/// Most samples: the table of the warping has 0.2 N^2 cells.
pub const MOST: usize = 20_000;
/// Samples of the mean that smooths a slope.
pub const SMOOTHED: usize = 9;

const INNER: f64 = 0.05;
const OUTER: f64 = 0.5;
const SHIFT: f64 = 0.2;
const BAND: f64 = 0.1;
const MAGNITUDE: f64 = 0.5;
const SLOPE: f64 = 2.0;
const WEIGHTS: [f64; 4] = [0.4, 0.2, 0.2, 0.2];

/// Why two signals cannot be rated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RatingError {
    #[error("{0} and {1} samples cannot be rated; resample both signals to the same times")]
    Lengths(usize, usize),
    #[error("{0} samples are too few to rate; take a longer part, or a higher rate, for {FEWEST} at least")]
    TooFew(usize),
    #[error("{0} samples are too many to rate; cut the signals to the interval of interest, {MOST} samples at most")]
    TooMany(usize),
    #[error("the reference is zero throughout, so that there is no corridor about it; take another interval")]
    Zero,
    #[error("a signal holds a value that is no finite number; remove it")]
    NotFinite,
}

/// What an overall rating is called (ISO/TS 18571, table of grades).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grade {
    /// Above 0.94.
    Excellent,
    /// Above 0.80.
    Good,
    /// Above 0.58.
    Fair,
    Poor,
}

impl Grade {
    /// Of an overall rating.
    pub fn of(overall: f64) -> Grade {
        match overall {
            r if r > 0.94 => Grade::Excellent,
            r if r > 0.80 => Grade::Good,
            r if r > 0.58 => Grade::Fair,
            _ => Grade::Poor,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Grade::Excellent => "excellent",
            Grade::Good => "good",
            Grade::Fair => "fair",
            Grade::Poor => "poor",
        }
    }
}

/// A rating: scores from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rating {
    pub corridor: f64,
    pub phase: f64,
    pub magnitude: f64,
    pub slope: f64,
    pub overall: f64,
    pub grade: Grade,
    /// Samples by which the signal is late; negative where it is early.
    pub late: isize,
}

/// Rates `signal` against `reference`, sampled at the same times, [`RATE`] a second where the standard is to hold; in
/// one unit, any.
///
/// # Errors
/// Lengths that differ, fewer than [`FEWEST`] samples or more than [`MOST`], values that are not finite, a reference
/// that is zero throughout.
pub fn rate(reference: &[f64], signal: &[f64]) -> Result<Rating, RatingError> {
    let n = reference.len();
    if n != signal.len() {
        return Err(RatingError::Lengths(n, signal.len()));
    }
    if n < FEWEST {
        return Err(RatingError::TooFew(n));
    }
    if n > MOST {
        return Err(RatingError::TooMany(n));
    }
    if reference.iter().chain(signal).any(|v| !v.is_finite()) {
        return Err(RatingError::NotFinite);
    }
    if reference.iter().all(|v| *v == 0.0) {
        return Err(RatingError::Zero);
    }
    let late = lateness(reference, signal);
    let (t, c) = shifted(reference, signal, late);
    let corridor = corridor(reference, signal);
    let phase = ((SHIFT * n as f64 - late.unsigned_abs() as f64) / (SHIFT * n as f64)).max(0.0);
    let (magnitude, slope) = (magnitude(t, c), slope(t, c));
    let overall = WEIGHTS.iter().zip([corridor, phase, magnitude, slope]).map(|(w, s)| w * s).sum();
    Ok(Rating { corridor, phase, magnitude, slope, overall, grade: Grade::of(overall), late })
}

fn corridor(t: &[f64], c: &[f64]) -> f64 {
    let norm = t.iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let (inner, outer) = (INNER * norm, OUTER * norm);
    let score = |(t, c): (&f64, &f64)| match (t - c).abs() {
        d if d < inner => 1.0,
        d if d > outer => 0.0,
        d => ((outer - d) / (outer - inner)).powi(2),
    };
    t.iter().zip(c).map(score).sum::<f64>() / t.len() as f64
}

/// Both signals where they overlap with the signal moved back by `late` samples.
fn shifted<'a>(t: &'a [f64], c: &'a [f64], late: isize) -> (&'a [f64], &'a [f64]) {
    let (n, m) = (t.len(), late.unsigned_abs());
    if late >= 0 {
        (&t[..n - m], &c[m..])
    } else {
        (&t[m..], &c[..n - m])
    }
}

/// The shift of best correlation, in samples; of equally good ones the smallest, and of those the signal's being late.
fn lateness(t: &[f64], c: &[f64]) -> isize {
    let most = (t.len() as f64 * SHIFT).floor() as isize;
    let (t, c) = (centred(t), centred(c));
    let mut best = (0, correlation(&t, &c));
    for late in (1..=most).flat_map(|i| [i, -i]) {
        let (t, c) = shifted(&t, &c, late);
        let r = correlation(t, c);
        if r > best.1 {
            best = (late, r);
        }
    }
    best.0
}

/// Less its mean: sums of what remains lose no digits.
fn centred(y: &[f64]) -> Vec<f64> {
    let mean = y.iter().sum::<f64>() / y.len() as f64;
    y.iter().map(|v| v - mean).collect()
}

/// Share of a mean under which deviations from it are roundings.
const ROUNDING: f64 = 1e-14;

/// Correlation of two signals; not a number where one is constant.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let (ma, mb) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (a, b) in a.iter().zip(b) {
        let (a, b) = (a - ma, b - mb);
        aa += a * a;
        bb += b * b;
        ab += a * b;
    }
    let constant = |square: f64, mean: f64| square <= n * (ROUNDING * mean).powi(2);
    if constant(aa, ma) || constant(bb, mb) {
        return f64::NAN;
    }
    ab / (aa.sqrt() * bb.sqrt())
}

/// Sum of differences over the sum of the reference, both of magnitudes; equal signals have 0, whatever the reference.
fn relative(pairs: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (off, all) = pairs.fold((0.0, 0.0), |(off, all), (t, c)| (off + (c - t).abs(), all + t.abs()));
    if off == 0.0 {
        0.0
    } else {
        off / all
    }
}

fn magnitude(t: &[f64], c: &[f64]) -> f64 {
    // in floating point, as 0.1 N is taken by others: 0.1 * 70 lies above 7
    let band = (BAND * t.len() as f64).ceil() as usize;
    let path = warp::path(c, t, band - 1);
    let e = relative(path.into_iter().map(|(i, j)| (t[j], c[i])));
    ((MAGNITUDE - e) / MAGNITUDE).max(0.0)
}

fn slope(t: &[f64], c: &[f64]) -> f64 {
    let e = relative(smoothed(&differences(t)).into_iter().zip(smoothed(&differences(c))));
    ((SLOPE - e) / SLOPE).max(0.0)
}

/// Slope at each sample in units a sample: central differences, one-sided ones at the ends.
fn differences(y: &[f64]) -> Vec<f64> {
    let last = y.len() - 1;
    (0..=last)
        .map(|i| {
            let (from, to) = (i.saturating_sub(1), (i + 1).min(last));
            (y[to] - y[from]) / (to - from) as f64
        })
        .collect()
}

/// Means of nine values, of 1, 3, 5 and 7 at the ends.
fn smoothed(y: &[f64]) -> Vec<f64> {
    let n = y.len();
    (0..n)
        .map(|i| {
            let half = (SMOOTHED / 2).min(i).min(n - 1 - i);
            y[i - half..=i + half].iter().sum::<f64>() / (2 * half + 1) as f64
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn half_sine(n: usize, from: usize, width: usize) -> Vec<f64> {
        let at = |i: usize| (i as f64 - from as f64) / width as f64;
        (0..n).map(|i| if (0.0..=1.0).contains(&at(i)) { (std::f64::consts::PI * at(i)).sin() } else { 0.0 }).collect()
    }

    #[test]
    fn identical_signals_rate_one() {
        for y in [half_sine(200, 50, 60), vec![2.5; 40], (0..30).map(f64::from).collect()] {
            let r = rate(&y, &y).unwrap();
            assert_eq!((r.corridor, r.phase, r.magnitude, r.slope, r.late), (1.0, 1.0, 1.0, 1.0, 0));
            assert!((r.overall - 1.0).abs() < 1e-15 && r.grade == Grade::Excellent);
        }
    }

    #[test]
    fn a_delay_costs_phase_alone_but_for_the_corridor() {
        let (t, c) = (half_sine(200, 50, 60), half_sine(200, 60, 60));
        let r = rate(&t, &c).unwrap();
        assert_eq!((r.late, rate(&c, &t).unwrap().late), (10, -10));
        // 10 of the 40 samples allowed
        assert!((r.phase - 0.75).abs() < 1e-12);
        assert!(r.magnitude > 1.0 - 1e-12 && r.slope > 1.0 - 1e-12 && r.corridor < 1.0);
    }

    #[test]
    fn a_scaled_constant_has_the_scores_of_the_equations() {
        let r = rate(&[1.0; 50], &[1.2; 50]).unwrap();
        assert!((r.corridor - (0.3f64 / 0.45).powi(2)).abs() < 1e-12);
        assert!((r.magnitude - 0.6).abs() < 1e-12);
        assert_eq!((r.phase, r.slope), (1.0, 1.0));
        let opposite = rate(&[1.0; 50], &[-1.0; 50]).unwrap();
        assert_eq!((opposite.corridor, opposite.magnitude), (0.0, 0.0));
        assert_eq!(opposite.grade, Grade::Poor);
    }

    #[test]
    fn what_cannot_be_rated_is_reported() {
        assert_eq!(rate(&[1.0; 20], &[1.0; 21]), Err(RatingError::Lengths(20, 21)));
        assert_eq!(rate(&[1.0; 10], &[1.0; 10]), Err(RatingError::TooFew(10)));
        assert_eq!(rate(&[0.0; 20], &[1.0; 20]), Err(RatingError::Zero));
        assert_eq!(rate(&[1.0; 20], &[f64::NAN; 20]), Err(RatingError::NotFinite));
        let long = vec![1.0; MOST + 1];
        assert_eq!(rate(&long, &long), Err(RatingError::TooMany(MOST + 1)));
    }
}
