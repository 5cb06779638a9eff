//! Shock response spectra of absolute acceleration by the ramp-invariant recursive filter (Smallwood 1981, "An improved
//! recursive formula for calculating shock response spectra"; ISO 18431-4).
//!
//! A base moves with the acceleration x; on it stand oscillators of natural frequency f and damping ratio z = 1 / (2
//! Q). The acceleration y of each follows, with the sampling interval T, w = 2 pi f, E = exp(-z w T), K = w T sqrt(1 -
//! z^2), S = E sin K / K and C = E cos K:
//!
//! ```text
//! y[i] = (1 - S) x[i] + 2 (S - C) x[i-1] + (E^2 - S) x[i-2] + 2 C y[i-1] - E^2 y[i-2]
//! ```
//!
//! which is exact for a base whose acceleration runs straight from sample to sample. It starts at rest, and after the
//! record the base stands still for one period of the lowest frequency, so that the residual response counts (primary
//! and residual: "maximax").

/// Most samples that one period of the lowest frequency may have.
const MOST: f64 = 1e7;

/// Why there is no spectrum.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SrsError {
    #[error("Q = {0} is no quality of a vibration that dies away; give a number above 0.5, as 10")]
    Quality(f64),
    #[error("a sampling rate of {0} Hz is none; give one above 0")]
    Rate(f64),
    #[error("{frequency} Hz cannot be had at {rate} samples a second; take frequencies from {} to {} Hz", rate / MOST, rate / 2.0)]
    Frequency { frequency: f64, rate: f64 },
    #[error("a spectrum from {lowest} to {highest} Hz with {each} frequencies an octave is none; give rising limits above 0 and 1 to 96 an octave")]
    Band { lowest: f64, highest: f64, each: u32 },
}

/// Largest responses by natural frequency, each in the unit of the acceleration.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Spectrum {
    /// Hz
    pub frequency: Vec<f64>,
    /// Largest response along the axis, 0 at least.
    pub positive: Vec<f64>,
    /// Magnitude of the largest response against it, 0 at least.
    pub negative: Vec<f64>,
    /// The larger of both.
    pub maximax: Vec<f64>,
}

/// Frequencies from `lowest` to `highest` (Hz), `each` in an octave.
///
/// # Errors
/// Limits that are not above zero and rising, none or more than 96 in an octave.
pub fn frequencies(lowest: f64, highest: f64, each: u32) -> Result<Vec<f64>, SrsError> {
    let sound = lowest > 0.0 && highest >= lowest && highest.is_finite() && (1..=96).contains(&each);
    if !sound {
        return Err(SrsError::Band { lowest, highest, each });
    }
    let count = ((highest / lowest).log2() * f64::from(each) + 1e-9).floor() as u32;
    Ok((0..=count).map(|i| lowest * (f64::from(i) / f64::from(each)).exp2()).collect())
}

/// The spectrum of `acceleration`, sampled `rate` times a second, at the frequencies given (Hz), for the quality
/// `q` = 1 / (2 damping ratio).
///
/// # Errors
/// A quality of 1/2 or less, a rate that is none, a frequency above half of the rate or so low that one period of it
/// has more than ten million samples.
pub fn spectrum(acceleration: &[f64], rate: f64, frequencies: &[f64], q: f64) -> Result<Spectrum, SrsError> {
    if !(q > 0.5 && q.is_finite()) {
        return Err(SrsError::Quality(q));
    }
    if !(rate > 0.0 && rate.is_finite()) {
        return Err(SrsError::Rate(rate));
    }
    if let Some(f) = frequencies.iter().find(|f| !(**f >= rate / MOST && **f <= rate / 2.0)) {
        return Err(SrsError::Frequency { frequency: *f, rate });
    }
    let lowest = frequencies.iter().copied().fold(f64::INFINITY, f64::min);
    let after = (rate / lowest).ceil() as usize;
    let mut s = Spectrum { frequency: frequencies.to_vec(), ..Spectrum::default() };
    for f in frequencies {
        let (low, high) = Oscillator::new(*f, q, rate).extremes(acceleration, after);
        s.positive.push(high);
        s.negative.push(-low);
        s.maximax.push(high.max(-low));
    }
    Ok(s)
}

/// Coefficients of one oscillator's filter.
struct Oscillator {
    x: [f64; 3],
    y: [f64; 2],
}

impl Oscillator {
    fn new(frequency: f64, q: f64, rate: f64) -> Oscillator {
        let (z, w) = (0.5 / q, std::f64::consts::TAU * frequency / rate);
        let e = (-z * w).exp();
        let k = w * (1.0 - z * z).sqrt();
        let (s, c) = (e * k.sin() / k, e * k.cos());
        Oscillator { x: [1.0 - s, 2.0 * (s - c), e * e - s], y: [2.0 * c, -e * e] }
    }

    /// Least and largest response, to the record and to `after` samples of rest behind it; rest itself counts.
    fn extremes(&self, base: &[f64], after: usize) -> (f64, f64) {
        let (mut low, mut high) = (0.0f64, 0.0f64);
        let (mut x, mut y) = ([0.0; 2], [0.0; 2]);
        for v in base.iter().copied().chain(std::iter::repeat_n(0.0, after)) {
            let r = self.x[0] * v + self.x[1] * x[0] + self.x[2] * x[1] + self.y[0] * y[0] + self.y[1] * y[1];
            x = [v, x[0]];
            y = [r, y[0]];
            low = low.min(r);
            high = high.max(r);
        }
        (low, high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_sine_at_resonance_is_amplified_by_nearly_q() {
        let (f, rate, q) = (50.0, 20_000.0, 10.0f64);
        let y: Vec<f64> = (0..60_000).map(|i| (std::f64::consts::TAU * f * f64::from(i) / rate).sin()).collect();
        let s = spectrum(&y, rate, &[f], q).unwrap();
        // steady state: sqrt(1 + Q^2), transmissibility at the natural frequency
        let exact = (1.0 + q * q).sqrt();
        assert!((s.maximax[0] / exact - 1.0).abs() < 1e-4, "{} {exact}", s.maximax[0]);
    }

    #[test]
    fn a_step_without_losses_is_answered_twice() {
        let s = spectrum(&[1.0; 4000], 20_000.0, &[50.0], 1e9).unwrap();
        // the filter takes the step as a ramp over one sample: 2 but for (pi f T)^2 / 6
        assert!((s.positive[0] - 2.0).abs() < 1e-4, "{}", s.positive[0]);
        // after the step ends it may swing the other way, by no more
        assert!(s.negative[0] <= 2.0 && s.maximax[0] >= s.positive[0]);
    }

    #[test]
    fn a_constant_is_followed_by_stiff_oscillators() {
        let s = spectrum(&[-3.0; 5000], 10_000.0, &[900.0], 0.51).unwrap();
        assert!(s.negative[0] >= 3.0 && s.negative[0] < 3.0 * 1.4, "{}", s.negative[0]);
        assert_eq!(spectrum(&[0.0; 10], 1e3, &[10.0, 20.0], 10.0).unwrap().maximax, [0.0, 0.0]);
    }

    #[test]
    fn an_octave_holds_as_many_frequencies_as_asked() {
        let f = frequencies(10.0, 80.0, 6).unwrap();
        assert_eq!(f.len(), 19);
        assert!((f[6] - 20.0).abs() < 1e-12 && (f[18] - 80.0).abs() < 1e-11);
        assert!(frequencies(10.0, 5.0, 6).is_err() && frequencies(0.0, 5.0, 6).is_err());
        assert!(frequencies(1.0, 5.0, 0).is_err() && frequencies(1.0, f64::INFINITY, 3).is_err());
    }

    #[test]
    fn what_has_no_spectrum_is_reported() {
        assert_eq!(spectrum(&[1.0], 1e3, &[10.0], 0.5), Err(SrsError::Quality(0.5)));
        assert_eq!(spectrum(&[1.0], 0.0, &[10.0], 10.0), Err(SrsError::Rate(0.0)));
        for frequency in [501.0, 1e-6, -1.0] {
            assert_eq!(spectrum(&[1.0], 1e3, &[frequency], 10.0), Err(SrsError::Frequency { frequency, rate: 1e3 }));
        }
    }
}
