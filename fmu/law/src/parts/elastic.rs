//! The elastic law that every contact has: F = k x^p.

use crate::elementary::pow;
use crate::part::{parameters, Mechanism, Origin, Part, Range, StartsFrom, Strength, HELD};

parameters! {
    /// The elastic law F = k x^p (Hertz 1881 at p = 1.5).
    elastic: Elastic {
        /// Stiffness k of F = k x^p, N/m^p, > 0.
        stiffness: f64 = 1e8, "stiffness", 100, "N/m^p", "", Range::POSITIVE, "k of F = k x^p, above 0";
        /// Exponent p, 0.5 to 5 (Hertz 1881: 1.5).
        exponent: f64 = 1.5, "exponent", 101, "1", "", Range::POWER, "p of F = k x^p; 1.5 for spheres (Hertz 1881)";
    }
}

impl Part for Elastic {
    const MECHANISM: Mechanism = Mechanism {
        name: "elastic",
        origin: Origin::Contact,
        sentence: "the faces push each other apart by a power of the depth",
        equation: "F = k x^p",
        source: "Hertz 1881 (p = 1.5)",
        cure: HELD,
        parameters: PARAMETERS,
        // every law has it: nothing to search beside it
        forms: &[],
        collinear: &[],
        strongly_nonlinear: false,
        starts_from: StartsFrom::Forms,
        strength: Strength::Reading,
    };

    #[inline(always)]
    fn is_neutral(&self) -> bool {
        false
    }

    #[inline(always)]
    fn keeps_power_law(&self) -> bool {
        true
    }

    #[inline(always)]
    fn scale_stiffness(&mut self, factor: f64) {
        self.stiffness *= factor;
    }
}

impl Elastic {
    /// (force N, slope N/m) at `x` > 0 m.
    #[inline(always)]
    pub fn force(&self, x: f64) -> (f64, f64) {
        if self.stiffness == 0.0 {
            // a body that meets nothing has no use for the power
            return (0.0, 0.0);
        }
        let f = self.stiffness * pow(x, self.exponent);
        (f, self.exponent * f / x)
    }
}
