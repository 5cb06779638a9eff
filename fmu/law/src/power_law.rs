//! The power law with hysteresis damping alone, stepped with every power of x worked out once: what
//! [`Parameters::advance`] and [`Parameters::force`] have in common there, and what a step has in common with the next.

use super::elementary::pow;
use super::{Memory, Parameters};

/// A point in contact: where, how fast, and the power of the depth that force and energies hang on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// Penetration, m, above 0.
    pub x: f64,
    /// Speed, m/s.
    pub v: f64,
    /// x^p, m^p.
    pub power: f64,
}

impl Parameters {
    /// (`x` m above 0, `v` m/s) with the power of its depth.
    #[inline]
    pub fn reached(&self, x: f64, v: f64) -> Reached {
        Reached { x, v, power: pow(x, self.elastic.exponent) }
    }

    /// For a law that [`Parameters::keeps_power_law`]: the force, N, that [`Parameters::force`] has there, to the last
    /// bit.
    #[inline]
    pub fn force_power_law(&self, at: &Reached) -> f64 {
        let k = self.elastic.stiffness;
        let branch = k * at.power;
        let f = branch + self.hysteresis_damping.of_branch(k, branch) * at.v;
        if f < 0.0 {
            0.0
        } else {
            f
        }
    }

    /// For a law that [`Parameters::keeps_power_law`]: moves the memory as [`Parameters::advance`] does and gives the
    /// force, N, that [`Parameters::force`] has at the end, both to the last bit. None, the memory as it was, where the
    /// contact opens or is clamped on the way or something is not finite.
    #[inline]
    pub fn advance_power_law(&self, m: &mut Memory, from: &Reached, to: &Reached) -> Option<f64> {
        let ends = ((from.x, from.v), (to.x, to.v));
        if !self.stays_in_contact(ends.0, ends.1) {
            return None;
        }
        let (work, stored) = self.power_law_work(ends.0, ends.1, (from.power, to.power));
        let work = m.work + work;
        let f = self.force_power_law(to);
        if !(f.is_finite() && work.is_finite() && stored.is_finite()) {
            return None;
        }
        if to.x > m.deepest {
            m.deepest = to.x;
        }
        m.work = work;
        m.stored = stored;
        Some(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_that_of_the_whole_law_to_the_last_bit() {
        let mut state = 1u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / 9_007_199_254_740_992.0
        };
        let mut stepped = 0;
        for (p, mu) in [(1.5, 3e7), (2.79, 2.7e10), (1.0, 0.0), (2.0, 1e9), (0.7, 1e5)] {
            let law = Parameters::power_law(1e8, p, mu);
            assert!(law.keeps_power_law());
            let mut m = law.start(1e-5);
            let mut from = law.reached(1e-5, 0.1);
            for n in 0..2000 {
                // long steps and short ones, to and fro, out of contact, too fast for the damping
                let far = if n % 3 == 0 { 1e-4 } else { 1e-8 };
                let x = from.x + far * (random() - 0.5);
                let v = if n % 50 == 0 { -20.0 * random() } else { random() - 0.5 };
                let whole = law.advance(&m, from.x, from.v, x, v, 1e-5);
                let force = law.force(&whole, x, v);
                let (mut fast, to) = (m, law.reached(x.max(0.0), v));
                match law.advance_power_law(&mut fast, &from, &to) {
                    Some(f) => {
                        assert_eq!(f.to_bits(), force.to_bits(), "p {} step {}", p, n);
                        assert_eq!(law.force_power_law(&to).to_bits(), force.to_bits(), "p {} step {}", p, n);
                        assert_eq!(fast, whole, "p {} step {}", p, n);
                        stepped += 1;
                    }
                    None => assert_eq!(fast, m),
                }
                m = whole;
                from = if x > 0.0 { to } else { law.reached(1e-5, 0.1) };
            }
        }
        assert!(stepped > 5000, "{}", stepped);
    }

    #[test]
    fn other_laws_do_not_keep_the_power_law() {
        let plain = Parameters::power_law(1e8, 1.5, 3e7);
        let values = [
            ("viscous_damping", 1.0),
            ("adhesion_force", 1.0),
            ("relaxation_stiffness", 1.0),
            ("secondary_stiffness", 1.0),
            ("hysteresis_thinning_speed", 1.0),
            ("damping_exponent_offset", 0.1),
            ("plastic_ratio", 0.1),
        ];
        for (name, value) in values {
            let mut law = plain;
            (crate::parts::parameter(name).unwrap().set)(&mut law, value);
            assert!(!law.keeps_power_law(), "{}", name);
        }
    }
}
