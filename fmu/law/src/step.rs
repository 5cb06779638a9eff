//! How finely a contact wants to be stepped.

use super::elementary::pow;
use super::Parameters;

/// Macro-steps a contact should get at least: with half a step of lookahead a held force then errs by some 1e-3 in
/// restitution.
const STEPS_PER_CONTACT: f64 = 20.0;
/// Speed below which a contact counts as at rest, m/s.
const REST: f64 = 1e-3;

impl Parameters {
    /// Step, s, that gives a contact of `mass` kg moving at `v` m/s, with `stored` J in it already, 20 steps. The
    /// duration of an undamped impact is 2 x_m/v sqrt(pi) Gamma(1+1/q)/Gamma(1/2+1/q), q = p + 1: between 3.14 x_m/v
    /// at p = 1 and 2.65 x_m/v at p = 2.79, so 3 x_m/v is taken.
    pub fn recommended_step(&self, mass: f64, v: f64, stored: f64) -> f64 {
        let q = self.elastic.exponent + 1.0;
        let kinetic = 0.5 * mass * v * v;
        let energy = (kinetic + stored.max(0.0)).max(0.5 * mass * REST * REST);
        let deepest = pow(q * energy / self.elastic.stiffness, 1.0 / q);
        let speed = (2.0 * energy / mass).sqrt();
        3.0 * deepest / speed / STEPS_PER_CONTACT
    }
}
