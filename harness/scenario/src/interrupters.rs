//! Photo interrupters above the stop, and the impact speed given by the times a flag passes three of them.

use serde::Serialize;

/// What three times give.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Recovered {
    /// Speed at touch, m/s.
    pub impact_speed: f64,
    /// Acceleration between the interrupters, m/s^2.
    pub acceleration: f64,
}

/// The speed at touch, by constant acceleration through three passages (Ahn and Ryu 2005, section 3): the parabola
/// through the three points, followed to x = 0. `passages` are (time s, position m, negative above the stop), in
/// order. None unless times and positions rise and the parabola reaches the stop.
pub fn recover(passages: &[(f64, f64); 3]) -> Option<Recovered> {
    let [(t1, x1), (t2, x2), (t3, x3)] = *passages;
    if !(t1 < t2 && t2 < t3 && x1 < x2 && x2 < x3 && x3 <= 0.0) {
        return None;
    }
    let (s12, s23) = ((x2 - x1) / (t2 - t1), (x3 - x2) / (t3 - t2));
    let half = (s23 - s12) / (t3 - t1);
    let speed = s23 + half * (t3 - t2);
    let square = speed * speed - 4.0 * half * x3;
    (square >= 0.0).then(|| Recovered { impact_speed: square.sqrt(), acceleration: 2.0 * half })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_acceleration_is_recovered_exactly() {
        let (g, h): (f64, f64) = (9.81, 0.05);
        let at = |x: f64| ((2.0 * (h + x) / g).sqrt(), x);
        let r = recover(&[at(-0.014), at(-0.008), at(-0.002)]).unwrap();
        assert!((r.impact_speed - (2.0 * g * h).sqrt()).abs() < 1e-12, "{r:?}");
        assert!((r.acceleration - g).abs() < 1e-9);
        assert!(recover(&[at(-0.008), at(-0.014), at(-0.002)]).is_none());
    }
}
