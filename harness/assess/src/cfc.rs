//! Channel frequency class filters (SAE J211-1, appendix on the digital filter; ISO 6487, annex on the same).
//!
//! A Butterworth low-pass of two poles by the bilinear transform, run forward and backward, so that four poles without
//! phase are left. Its coefficients, with the class C in Hz and the sampling interval T:
//!
//! ```text
//! w  = tan(pi C 2.0775 T)
//! a0 = w^2 / (1 + sqrt(2) w + w^2)      a1 = 2 a0      a2 = a0
//! b1 = -2 (w^2 - 1) / (1 + sqrt(2) w + w^2)      b2 = (-1 + sqrt(2) w - w^2) / (1 + sqrt(2) w + w^2)
//! y[i] = a0 x[i] + a1 x[i-1] + a2 x[i-2] + b1 y[i-1] + b2 y[i-2]
//! ```
//!
//! Both passes together have a gain of 1/2 (-6 dB) at 2.0775 C and of about -3 dB at 1.65 C, the FN of the standards.
//!
//! The standards leave the ends of a record to the user. Here they are as in `scipy.signal.sosfiltfilt`, and so in
//! `endaq.calc.filters.butterworth`: nine samples more at each end, the record turned about its end point, and each
//! pass begins as if its first value had stood for ever.

/// Classes that the standards name, Hz.
pub const CLASSES: [f64; 4] = [60.0, 180.0, 600.0, 1000.0];
/// Design frequency of one pass over the class.
const CORNER: f64 = 2.0775;
/// Least sampling rate over the class (SAE J211-1, ISO 6487).
pub const LEAST_RATE: f64 = 10.0;
/// Samples added at each end.
const ENDS: usize = 9;

/// Why a record cannot be filtered.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CfcError {
    #[error("class {0} is no frequency class; give a number above 0, as 60, 180, 600 or 1000")]
    Class(f64),
    #[error("a sampling rate of {rate:.1} Hz is too low for CFC {class}, which needs {LEAST_RATE} times its class; take a class of {:.1} at most", rate / LEAST_RATE)]
    Rate { rate: f64, class: f64 },
    #[error("{0} samples are too few for the filter; it needs more than {ENDS}")]
    TooFew(usize),
}

/// `y` through the filter of channel frequency class `class` (Hz); `rate`: samples a second, all at one interval
/// ([`crate::sampling::rate`]). As many values, in the unit of `y`.
///
/// # Errors
/// A class that is not above zero, a rate under ten times the class, fewer than ten samples.
pub fn filter(y: &[f64], rate: f64, class: f64) -> Result<Vec<f64>, CfcError> {
    if !(class > 0.0 && class.is_finite()) {
        return Err(CfcError::Class(class));
    }
    // a rate worked out from times may miss it by roundings
    if !(rate >= LEAST_RATE * class * (1.0 - 1e-9) && rate.is_finite()) {
        return Err(CfcError::Rate { rate, class });
    }
    if y.len() <= ENDS {
        return Err(CfcError::TooFew(y.len()));
    }
    let poles = TwoPoles::new(class, rate);
    let mut x = extended(y);
    poles.pass(&mut x);
    x.reverse();
    poles.pass(&mut x);
    x.reverse();
    Ok(x[ENDS..ENDS + y.len()].to_vec())
}

/// `y` with `ENDS` samples more at each end: the record turned about its end point.
fn extended(y: &[f64]) -> Vec<f64> {
    let n = y.len();
    let before = (1..=ENDS).rev().map(|i| 2.0 * y[0] - y[i]);
    let after = (1..=ENDS).map(|i| 2.0 * y[n - 1] - y[n - 1 - i]);
    before.chain(y.iter().copied()).chain(after).collect()
}

/// Coefficients of one pass, as the module's doc has them.
struct TwoPoles {
    a0: f64,
    b1: f64,
    b2: f64,
}

impl TwoPoles {
    fn new(class: f64, rate: f64) -> TwoPoles {
        let w = (std::f64::consts::PI * class * CORNER / rate).tan();
        let over = 1.0 + std::f64::consts::SQRT_2 * w + w * w;
        TwoPoles {
            a0: w * w / over,
            b1: -2.0 * (w * w - 1.0) / over,
            b2: (-1.0 + std::f64::consts::SQRT_2 * w - w * w) / over,
        }
    }

    /// One pass in place, begun as if the first value had stood for ever.
    fn pass(&self, x: &mut [f64]) {
        let (a0, a1, a2) = (self.a0, 2.0 * self.a0, self.a0);
        let mut late = (a2 + self.b2) * x[0];
        let mut soon = (1.0 - a0) * x[0];
        for v in x {
            let y = a0 * *v + soon;
            soon = a1 * *v + self.b1 * y + late;
            late = a2 * *v + self.b2 * y;
            *v = y;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_the_corner_both_passes_leave_one_half() {
        for class in CLASSES {
            let (rate, n) = (100.0 * class, 40_000);
            let w = std::f64::consts::TAU * CORNER * class / rate;
            let y: Vec<f64> = (0..n).map(|i| (w * i as f64).sin()).collect();
            let f = filter(&y, rate, class).unwrap();
            // in the middle, far from the ends: half of the sine, without phase
            let off = (n / 4..3 * n / 4).map(|i| (f[i] - 0.5 * y[i]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-9, "CFC {class}: {off}");
        }
    }

    #[test]
    fn what_stands_and_what_rises_evenly_is_left_as_it_is() {
        let y: Vec<f64> = (0..2000).map(|i| 3.0 + 0.01 * f64::from(i)).collect();
        let f = filter(&y, 1e4, 60.0).unwrap();
        let middle = (900..1100).map(|i| (f[i] - y[i]).abs()).fold(0.0, f64::max);
        assert!(middle < 1e-9, "{middle}");
        let f = filter(&[2.5; 50], 1e4, 1000.0).unwrap();
        assert!(f.iter().all(|v| (v - 2.5).abs() < 1e-12));
    }

    #[test]
    fn what_cannot_be_filtered_is_reported() {
        assert_eq!(filter(&[0.0; 20], 1e3, 180.0), Err(CfcError::Rate { rate: 1e3, class: 180.0 }));
        assert_eq!(filter(&[0.0; 9], 1e5, 180.0), Err(CfcError::TooFew(9)));
        assert_eq!(filter(&[0.0; 20], 1e5, -1.0), Err(CfcError::Class(-1.0)));
        assert!(filter(&[0.0; 20], f64::NAN, 60.0).is_err());
    }
}
