//! Sampling: whether it is even, and values between samples.

/// Share of the mean interval by which one may differ in an even record: times are written with few digits.
const EVEN: f64 = 0.01;
/// Most samples that a record is brought to.
pub const MOST: usize = 5_000_000;

/// What is wrong with a record's times.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SamplingError {
    #[error("{0} samples have no sampling rate; give two at least")]
    TooFew(usize),
    #[error("the interval after {at} s is {interval} s where {mean} s is the mean: the sampling is not even; resample the record first")]
    Uneven { at: f64, interval: f64, mean: f64 },
    #[error("{from} s to {to} s at {rate} Hz cannot be had: more than {MOST} samples, or none; take a shorter part or a lower rate")]
    Grid { from: f64, to: f64, rate: f64 },
}

/// Samples a second of a record of even sampling; `time`: s, increasing. Intervals may differ by 1 % of their mean.
///
/// # Errors
/// Fewer than two samples, or an uneven interval.
pub fn rate(time: &[f64]) -> Result<f64, SamplingError> {
    let n = time.len();
    if n < 2 {
        return Err(SamplingError::TooFew(n));
    }
    let mean = (time[n - 1] - time[0]) / (n - 1) as f64;
    let uneven = |w: &&[f64]| !((w[1] - w[0] - mean).abs() <= EVEN * mean && mean > 0.0);
    match time.windows(2).find(uneven) {
        Some(w) => Err(SamplingError::Uneven { at: w[0], interval: w[1] - w[0], mean }),
        None => Ok(1.0 / mean),
    }
}

/// A rate at which a record of uneven sampling keeps what it holds, Hz: one over the interval that a tenth of its
/// intervals are under.
///
/// # Errors
/// Fewer than two samples.
pub fn fine_rate(time: &[f64]) -> Result<f64, SamplingError> {
    let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    if steps.is_empty() {
        return Err(SamplingError::TooFew(time.len()));
    }
    let tenth = steps.len() / 10;
    let (_, step, _) = steps.select_nth_unstable_by(tenth, f64::total_cmp);
    Ok(1.0 / *step)
}

/// Times from `from` on, `rate` a second, as far as `to`, s.
///
/// # Errors
/// No sample, or more than [`MOST`].
pub fn grid(from: f64, to: f64, rate: f64) -> Result<Vec<f64>, SamplingError> {
    let intervals = ((to - from) * rate * (1.0 + 1e-12) + 1e-6).floor();
    if !(intervals >= 0.0 && intervals < MOST as f64) {
        return Err(SamplingError::Grid { from, to, rate });
    }
    Ok((0..=intervals as usize).map(|i| from + i as f64 / rate).collect())
}

/// The record (`time`, s, increasing; `y`) at the times `at`, s, rising, straight from sample to sample; its first or
/// last value outside. Empty records give zeros.
pub fn resample(time: &[f64], y: &[f64], at: &[f64]) -> Vec<f64> {
    let n = time.len().min(y.len());
    let mut next = 0;
    at.iter()
        .map(|t| {
            while next < n && time[next] < *t {
                next += 1;
            }
            match next {
                _ if n == 0 => 0.0,
                0 => y[0],
                i if i == n => y[n - 1],
                i => y[i - 1] + (y[i] - y[i - 1]) * (t - time[i - 1]) / (time[i] - time[i - 1]),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_and_uneven_sampling_are_told_apart() {
        let even: Vec<f64> = (0..100).map(|i| 0.25 + 1e-4 * f64::from(i)).collect();
        assert!((rate(&even).unwrap() / 1e4 - 1.0).abs() < 1e-9);
        let mut uneven = even.clone();
        uneven[50] += 0.3e-4;
        assert!(matches!(rate(&uneven), Err(SamplingError::Uneven { .. })));
        assert_eq!(rate(&even[..1]), Err(SamplingError::TooFew(1)));
        let slow_then_fast: Vec<f64> =
            (0..50).map(f64::from).chain((1..50).map(|i| 49.0 + 0.1 * f64::from(i))).collect();
        assert!((fine_rate(&slow_then_fast).unwrap() - 10.0).abs() < 1e-6);
    }

    #[test]
    fn between_samples_a_record_runs_straight() {
        let (t, y) = ([0.0, 1.0, 3.0], [0.0, 2.0, -2.0]);
        assert_eq!(resample(&t, &y, &[-1.0, 0.0, 0.5, 1.0, 2.0, 3.0, 9.0]), [0.0, 0.0, 1.0, 2.0, 0.0, -2.0, -2.0]);
        assert_eq!(resample(&[], &[], &[1.0]), [0.0]);
    }

    #[test]
    fn a_grid_ends_where_it_should_and_is_no_longer_than_allowed() {
        assert_eq!(grid(0.1, 0.1 + 0.3, 10.0).unwrap().len(), 4);
        assert!(grid(0.0, 1.0, 1e9).is_err() && grid(1.0, 0.0, 10.0).is_err() && grid(0.0, f64::NAN, 1.0).is_err());
    }
}
