//! The main pulse of a signal: peak, time of peak, width and impulse.

/// Share of the peak at which a pulse begins and ends.
pub const EDGE: f64 = 0.1;

/// The pulse about the largest magnitude.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulse {
    /// The value of largest magnitude, with its sign, in the signal's unit.
    pub peak: f64,
    /// When it is, s.
    pub time: f64,
    /// From where the signal last rose through [`EDGE`] of the peak before it to where it first falls through it after,
    /// s, straight between samples; None where the record begins or ends before.
    pub width: Option<f64>,
    /// Integral over that width by the trapezoidal rule, the signal's unit times s; None as there.
    pub impulse: Option<f64>,
}

/// The main pulse of `y` at `time` (s, strictly increasing); None of a record without values or of zeros throughout.
pub fn pulse(time: &[f64], y: &[f64]) -> Option<Pulse> {
    let n = time.len().min(y.len());
    let largest = (0..n).fold(0, |best, i| if y[i].abs() > y[best].abs() { i } else { best });
    let peak = *y.get(largest).filter(|v| **v != 0.0 && largest < n)?;
    let edge = EDGE * peak;
    // positive inside of the pulse, whatever its sign
    let over = |i: usize| (y[i] - edge) * peak.signum();
    let crossing = |inside: usize, outside: usize| {
        let share = over(inside) / (over(inside) - over(outside));
        time[inside] + share * (time[outside] - time[inside])
    };
    let before = (0..largest).rev().find(|i| over(*i) <= 0.0);
    let after = (largest + 1..n).find(|i| over(*i) <= 0.0);
    let ends = before.zip(after).map(|(b, a)| (b, a, crossing(b + 1, b), crossing(a - 1, a)));
    Some(Pulse {
        peak,
        time: time[largest],
        width: ends.map(|(.., from, to)| to - from),
        impulse: ends.map(|(b, a, from, to)| {
            let inside: f64 = (b + 1..a - 1).map(|i| 0.5 * (y[i] + y[i + 1]) * (time[i + 1] - time[i])).sum();
            inside + 0.5 * (edge + y[b + 1]) * (time[b + 1] - from) + 0.5 * (y[a - 1] + edge) * (to - time[a - 1])
        }),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_has_its_exact_figures() {
        let time: Vec<f64> = (0..=40).map(|i| 0.1 * f64::from(i)).collect();
        for sign in [1.0, -1.0] {
            let y: Vec<f64> = time.iter().map(|t| sign * 5.0 * (1.0 - (t - 2.0).abs()).max(0.0)).collect();
            let p = pulse(&time, &y).unwrap();
            assert_eq!((p.peak, p.time), (sign * 5.0, 2.0));
            assert!((p.width.unwrap() - 1.8).abs() < 1e-12);
            // of the area 5, twice the corner of 0.1 by 0.5 is left out
            assert!((p.impulse.unwrap() - sign * 4.95).abs() < 1e-12);
        }
    }

    #[test]
    fn a_pulse_cut_off_has_no_width() {
        let p = pulse(&[0.0, 1.0, 2.0], &[0.0, 1.0, 3.0]).unwrap();
        assert_eq!((p.peak, p.width, p.impulse), (3.0, None, None));
        assert_eq!(pulse(&[], &[]), None);
        assert_eq!(pulse(&[0.0, 1.0], &[0.0, 0.0]), None);
    }
}
