//! secondary_stiffening: a second layer or stop, F = k2 (x - d2)^r beyond its depth.

use crate::elementary::pow;
use crate::part::{
    parameters, searched, Form, Mechanism, Origin, Part, Quantity, Range, Scales, Searched, StartsFrom, Strength,
    EVERY_EXPERIMENT, HELD,
};
use crate::Parameters;

/// Share of its depth below which the width of the onset counts by its middle alone: the mean of a power over it is
/// then that of the middle to 1e-10, and a difference of powers would lose more.
const LEAST_WIDTH: f64 = 1e-5;

parameters! {
    /// A second layer (Goldsmith 1960).
    secondary_stiffening: SecondaryStiffening {
        /// Stiffness k2 of the second layer, N/m^r, >= 0.
        stiffness: f64 = 0.0, "secondary_stiffness", 118, "N/m^r", "", Range::FROM_ZERO,
            "Stiffness of the second layer; 0 turns it off";
        /// Depth from which it acts, m, >= 0.
        depth: f64 = 0.0, "secondary_depth", 119, "m", "mm", Range::FROM_ZERO,
            "Depth from which the second layer acts";
        /// Its power r, 0.5 to 5.
        exponent: f64 = 1.5, "secondary_exponent", 120, "1", "", Range::POWER, "Power r of the second layer";
        /// Depth w over which it comes to act, m, >= 0: its onsets are spread evenly over it (rough faces, after
        /// Greenwood and Williamson 1966), k2 (z^(r+1) - max(0, z - w)^(r+1))/((r+1) w) at z beyond its depth; 0: at once.
        width: f64 = 0.0, "secondary_width", 127, "m", "mm", Range::FROM_ZERO,
            "Depth over which the second layer comes to act, its onsets spread evenly over it (Greenwood and Williamson 1966); 0: at once";
    }
}

const FORCE: Searched = searched("force", 0.0, 30.0, 2e-3);
const DEPTH: Searched = searched("depth", 0.02, 3.0, 3e-3);
const POWER: Searched = searched("power", 0.6, 4.0, 5e-3);
const FORCE_FOUND: Quantity = Quantity { name: "secondary_force_at_depth", unit: "N", value: |t, s| t[0] * s.force };
const DEPTH_FOUND: Quantity = Quantity { name: "secondary_depth", unit: "m", value: |t, s| t[1] * s.depth };
const POWER_FOUND: Quantity = Quantity { name: "secondary_exponent", unit: "1", value: |t, _| t[2] };
const WIDTH_FOUND: Quantity = Quantity { name: "secondary_width", unit: "m", value: |t, s| t[3] * s.depth };

/// A layer of Hertz's power.
const HERTZ: Form = Form {
    label: "power 1.5",
    parameters: &[FORCE, DEPTH],
    starts: &[&[0.05], &[0.15, 0.4, 0.7, 1.0, 1.4]],
    linear: true,
    extends: None,
    experiments: EVERY_EXPERIMENT,
    per_impact_speed: false,
    apply: |t, s, p| put(t, s, p, 1.5),
    quantities: &[FORCE_FOUND, DEPTH_FOUND],
};

impl Part for SecondaryStiffening {
    const MECHANISM: Mechanism = Mechanism {
        name: "secondary_stiffening",
        origin: Origin::Contact,
        sentence: "a second stop or layer takes part from some depth on",
        equation: "F = k2 (x - d)^q beyond d",
        source: "two springs in series of onset; Goldsmith 1960; Greenwood and Williamson 1966 (onsets over a width)",
        cure: HELD,
        parameters: PARAMETERS,
        forms: &[
            HERTZ,
            Form {
                label: "any power",
                parameters: &[FORCE, DEPTH, POWER],
                starts: &[&[1.5]],
                extends: Some(HERTZ.label),
                apply: |t, s, p| put(t, s, p, t[2]),
                quantities: &[FORCE_FOUND, DEPTH_FOUND, POWER_FOUND],
                ..HERTZ
            },
            Form {
                label: "any power, over a width",
                parameters: &[FORCE, DEPTH, POWER, searched("width", 0.0, 2.0, 5e-3)],
                starts: &[&[1.0, 1.5], &[0.2]],
                extends: Some(HERTZ.label),
                apply: |t, s, p| {
                    put(t, s, p, t[2]);
                    p.secondary_stiffening.width = t[3] * s.depth;
                },
                quantities: &[FORCE_FOUND, DEPTH_FOUND, POWER_FOUND, WIDTH_FOUND],
                ..HERTZ
            },
            Form { label: "power 1", apply: |t, s, p| put(t, s, p, 1.0), ..HERTZ },
            Form { label: "power 2.5", apply: |t, s, p| put(t, s, p, 2.5), ..HERTZ },
        ],
        collinear: &["bent_scale"],
        strongly_nonlinear: true,
        starts_from: StartsFrom::Shallow,
        strength: Strength::Reading,
    };

    #[inline(always)]
    fn is_neutral(&self) -> bool {
        self.stiffness == 0.0
    }

    #[inline(always)]
    fn spring(&self, x: f64) -> Option<(f64, f64)> {
        if self.stiffness > 0.0 && x > self.depth {
            Some(self.layer(x))
        } else {
            None
        }
    }

    #[inline]
    fn spring_energy(&self, x: f64) -> Option<f64> {
        if self.stiffness > 0.0 && x > self.depth {
            let (z, r) = (x - self.depth, self.exponent);
            if self.width > 0.0 {
                return Some(self.stiffness * self.mean_power(z, r + 1.0) / (r + 1.0));
            }
            Some(self.layer(x).0 * z / (r + 1.0))
        } else {
            None
        }
    }

    #[inline(always)]
    fn scale_stiffness(&mut self, factor: f64) {
        self.stiffness *= factor;
    }
}

fn put(t: &[f64], s: &Scales, p: &mut Parameters, power: f64) {
    p.secondary_stiffening.stiffness = t[0] * s.force / s.depth.powf(power);
    p.secondary_stiffening.depth = t[1] * s.depth;
    p.secondary_stiffening.exponent = power;
}

impl SecondaryStiffening {
    /// (force, slope), N and N/m, beyond its depth.
    #[inline]
    fn layer(&self, x: f64) -> (f64, f64) {
        let (z, r) = (x - self.depth, self.exponent);
        if self.width > 0.0 {
            return (self.stiffness * self.mean_power(z, r), self.stiffness * r * self.mean_power(z, r - 1.0));
        }
        let s = self.stiffness * pow(z, r);
        (s, r * s / z)
    }

    /// Mean of (z - o)^q, m^q, over the onsets o, spread evenly over the width, at `z` > 0 m.
    fn mean_power(&self, z: f64, q: f64) -> f64 {
        let w = self.width;
        if w <= LEAST_WIDTH * z {
            return pow(z - 0.5 * w, q);
        }
        let past = if z > w { pow(z - w, q + 1.0) } else { 0.0 };
        (pow(z, q + 1.0) - past) / ((q + 1.0) * w)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slope_and_energy_are_those_of_the_force_with_and_without_a_width() {
        for width in [0.0, 1e-10, 2e-4] {
            let layer = SecondaryStiffening { stiffness: 1e7, depth: 4e-4, exponent: 1.7, width };
            assert_eq!(layer.spring(4e-4), None);
            for x in [4.5e-4, 7e-4, 1.1e-3] {
                let force = |x| layer.spring(x).unwrap();
                let energy = |x| layer.spring_energy(x).unwrap();
                let h = 1e-8;
                let slope = (force(x + h).0 - force(x - h).0) / (2.0 * h);
                assert!((force(x).1 / slope - 1.0).abs() < 1e-5, "{width} {x}");
                let f = (energy(x + h) - energy(x - h)) / (2.0 * h);
                assert!((force(x).0 / f - 1.0).abs() < 1e-5, "{width} {x}: {f}");
            }
        }
    }
}
