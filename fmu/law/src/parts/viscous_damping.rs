//! viscous_damping: F = c v from the first touch on, ramped in over a depth or not, thinned by the speed or not.

use crate::part::{
    parameters, searched, Experiment, Form, Mechanism, Origin, Part, Point, Quantity, Range, Scales, StartsFrom,
    Strength, EVERY_EXPERIMENT, HELD,
};
use crate::thinning;

parameters! {
    /// A damper beside the contact.
    viscous_damping: ViscousDamping {
        /// Kelvin-Voigt damping c, N s/m, >= 0 (Ahn and Ryu 2005, eq. 1).
        coefficient: f64 = 0.0, "viscous_damping", 104, "N.s/m", "", Range::FROM_ZERO,
            "c of c v (Kelvin-Voigt; Ahn and Ryu 2005, eq. 1); 0 turns it off";
        /// Depth over which the damping ramps in, m, >= 0; 0: from first touch.
        ramp: f64 = 0.0, "viscous_ramp", 105, "m", "mm", Range::FROM_ZERO,
            "Depth over which viscous damping ramps in; 0: from first touch";
        /// Speed at which shear thinning has halved the damping, m/s, >= 0: c/(1 + |v|/v_t) (Cross 1965); 0: Newtonian.
        thinning_speed: f64 = 0.0, "viscous_thinning_speed", 124, "m/s", "", Range::FROM_ZERO,
            "Speed at which shear thinning has halved the viscous damping, c/(1 + |v|/v_t) (Cross 1965); 0: Newtonian";
    }
}

const COEFFICIENT: Quantity = Quantity { name: "viscous_damping", unit: "N s/m", value: coefficient };
const RAMP: Quantity = Quantity { name: "viscous_ramp", unit: "m", value: ramp };
const THINNING_SPEED: Quantity = Quantity { name: "viscous_thinning_speed", unit: "m/s", value: thinning_speed };

/// A damper that acts at once.
const PLAIN: Form = Form {
    label: "from first touch",
    parameters: &[searched("c", 0.0, 5.0, 1e-3)],
    starts: &[&[0.02]],
    linear: true,
    extends: None,
    experiments: EVERY_EXPERIMENT,
    per_impact_speed: false,
    apply: |t, s, p| p.viscous_damping.coefficient += coefficient(t, s),
    quantities: &[COEFFICIENT],
};

impl Part for ViscousDamping {
    const MECHANISM: Mechanism = Mechanism {
        name: "viscous_damping",
        origin: Origin::Contact,
        sentence: "a damper that acts from the first touch, whatever the depth",
        equation: "F = c v/(1 + |v|/v_t), ramped in over a depth",
        source: "Kelvin-Voigt; Ahn and Ryu 2005, eq. 1; Cross 1965",
        cure: HELD,
        parameters: PARAMETERS,
        forms: &[
            PLAIN,
            Form {
                label: "ramped",
                parameters: &[searched("c", 0.0, 5.0, 1e-3), searched("ln ramp", -4.0, 0.3, 1e-2)],
                starts: &[&[0.02], &[-2.5, -1.0]],
                apply: |t, s, p| {
                    p.viscous_damping.coefficient += coefficient(t, s);
                    p.viscous_damping.ramp = ramp(t, s);
                },
                quantities: &[COEFFICIENT, RAMP],
                ..PLAIN
            },
            // what thins with speed shows over impact speeds: a contactor has few, an indentation none
            Form {
                label: "shear-thinning",
                parameters: &[searched("c", 0.0, 8.0, 1e-3), searched("ln thinning speed", -2.3, 2.3, 2e-2)],
                starts: &[&[0.02], &[-0.7, 0.7]],
                experiments: &[Experiment::DropTest],
                apply: |t, s, p| {
                    p.viscous_damping.coefficient += coefficient(t, s);
                    p.viscous_damping.thinning_speed = thinning_speed(t, s);
                },
                quantities: &[COEFFICIENT, THINNING_SPEED],
                ..PLAIN
            },
        ],
        collinear: &["hysteresis_damping", "squeeze_film"],
        strongly_nonlinear: false,
        starts_from: StartsFrom::Forms,
        strength: Strength::Reading,
    };

    #[inline(always)]
    fn is_neutral(&self) -> bool {
        self.coefficient == 0.0
    }

    #[inline(always)]
    fn damper(&self, at: &Point<'_>) -> Option<(f64, f64, f64)> {
        if self.coefficient > 0.0 {
            let (mut c, mut gx) = (self.coefficient, 0.0);
            let (thinned, steep) = thinning(at.v, self.thinning_speed);
            if at.x < self.ramp {
                c *= at.x / self.ramp;
                gx = self.coefficient / self.ramp * thinned * at.v;
            }
            Some((c * thinned * at.v, gx, c * steep))
        } else {
            None
        }
    }

    #[inline(always)]
    fn damps(&self) -> bool {
        self.coefficient > 0.0
    }

    #[inline(always)]
    fn kink(&self) -> Option<f64> {
        Some(self.ramp)
    }

    #[inline(always)]
    fn kink_at_rest(&self) -> bool {
        self.thinning_speed > 0.0
    }
}

fn coefficient(t: &[f64], s: &Scales) -> f64 {
    t[0] * s.force / s.speed
}

fn ramp(t: &[f64], s: &Scales) -> f64 {
    s.depth * t[1].exp()
}

fn thinning_speed(t: &[f64], s: &Scales) -> f64 {
    s.speed * t[1].exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Memory, Parameters};

    #[test]
    fn the_damper_ramps_in_linearly_and_is_halved_at_its_thinning_speed() {
        let mut p = Parameters::power_law(1e3, 1.0, 0.0);
        p.viscous_damping = ViscousDamping { coefficient: 20.0, ramp: 0.1, thinning_speed: 0.0 };
        let damping = |p: &Parameters, x: f64, v| p.force(&Memory::default(), x, v) - 1e3 * x;
        assert!((damping(&p, 0.025, 0.5) - 0.25 * 20.0 * 0.5).abs() < 1e-12);
        assert!((damping(&p, 0.2, 0.5) - 20.0 * 0.5).abs() < 1e-12);
        p.viscous_damping.thinning_speed = 0.5;
        assert!((damping(&p, 0.2, 0.5) - 20.0 * 0.25).abs() < 1e-12);
    }
}
