//! hysteresis_damping: F = mu_d x^(p+o) v, thinned by the speed or not.

use crate::elementary::pow;
use crate::part::{
    parameters, searched, Experiment, Form, Mechanism, Origin, Part, Point, Quantity, Range, Scales, Searched,
    StartsFrom, Strength, EVERY_EXPERIMENT, HELD,
};
use crate::{thinning, ParameterError, Parameters};

const OFFSET: Range =
    Range { least: Some(-5.0), most: Some(5.0), words: "-exponent to 5", holds: |v| (-5.0..=5.0).contains(&v) };

parameters! {
    /// Damping that grows with the depth.
    hysteresis_damping: HysteresisDamping {
        /// mu_d of mu_d x^(p+o) v, N s/m^(p+o+1), >= 0 (Hunt and Crossley 1975; Lankarani and Nikravesh 1990).
        coefficient: f64 = 0.0, "hysteresis_damping", 102, "N.s/m^(p+1)", "", Range::FROM_ZERO,
            "mu_d of mu_d x^p v (Lankarani and Nikravesh 1990); 0 turns it off";
        /// Offset o of the damping's power of x from p, -p to 5: 0 Hunt and Crossley 1975; -1 Kuwabara and
        /// Kono 1987 (damping on the tangent stiffness); -(p+1)/2 Tsuji, Tanaka and Ishida 1992 (x^(1/4) at p = 1.5).
        exponent_offset: f64 = 0.0, "damping_exponent_offset", 103, "1", "", OFFSET,
            "Added to p in the power of x in the damping: 0 Hunt and Crossley 1975, -1 Kuwabara and Kono 1987";
        /// Speed at which shear thinning has halved the damping, m/s, >= 0: mu_d x^(p+o) v/(1 + |v|/v_h)
        /// (Cross 1965); 0: in proportion to v.
        thinning_speed: f64 = 0.0, "hysteresis_thinning_speed", 126, "m/s", "", Range::FROM_ZERO,
            "Speed at which shear thinning has halved the hysteresis damping, mu_d x^p v/(1 + |v|/v_h) (Cross 1965); 0: in proportion to v";
    }
}

const RATIO: Searched = searched("ratio", 0.0, 20.0, 1e-3);
const DAMPING_RATIO: Quantity = Quantity { name: "damping_ratio", unit: "1", value: |t, _| t[0] };
const REFERENCE_SPEED: Quantity = Quantity { name: "reference_speed", unit: "m/s", value: |_, s| s.v_ref };
const THINNING_SPEED: Quantity = Quantity { name: "hysteresis_thinning_speed", unit: "m/s", value: thinning_speed };

/// Damping as its first authors had it.
const PLAIN: Form = Form {
    label: "Hunt-Crossley",
    parameters: &[RATIO],
    starts: &[&[0.05]],
    linear: true,
    extends: None,
    experiments: EVERY_EXPERIMENT,
    per_impact_speed: false,
    apply: |t, s, p| damp(t[0], 0.0, s, p),
    quantities: &[DAMPING_RATIO, REFERENCE_SPEED],
};

impl HysteresisDamping {
    /// mu_d x^p, N s/m, where k x^p is the force `branch`, N, and k the `stiffness`, N/m^p; 0 where it damps nothing.
    #[inline(always)]
    pub(crate) fn of_branch(&self, stiffness: f64, branch: f64) -> f64 {
        if self.coefficient > 0.0 {
            self.coefficient * (branch / stiffness)
        } else {
            0.0
        }
    }
}

impl Part for HysteresisDamping {
    const MECHANISM: Mechanism = Mechanism {
        name: "hysteresis_damping",
        origin: Origin::Contact,
        sentence: "the contact loses energy in proportion to a power of depth times speed",
        equation: "F = mu_d x^(p+o) v/(1 + |v|/v_h)",
        source: "Hunt and Crossley 1975; Lankarani and Nikravesh 1990; Kuwabara and Kono 1987 (o = -1); Tsuji, Tanaka and Ishida 1992; Cross 1965",
        cure: HELD,
        parameters: PARAMETERS,
        forms: &[
            PLAIN,
            Form { label: "Kuwabara-Kono", apply: |t, s, p| damp(t[0], -1.0, s, p), ..PLAIN },
            Form { label: "half power", apply: |t, s, p| damp(t[0], -0.5, s, p), ..PLAIN },
            Form {
                label: "power free",
                parameters: &[RATIO, searched("power", 0.25, 3.0, 1e-2)],
                starts: &[&[0.05], &[0.5, 1.25]],
                apply: |t, s, p| damp(t[0], t[1] - p.elastic.exponent, s, p),
                quantities: &[
                    DAMPING_RATIO,
                    REFERENCE_SPEED,
                    Quantity { name: "power", unit: "1", value: |t, _| t[1] },
                ],
                ..PLAIN
            },
            // what thins with speed shows over impact speeds: a contactor has few, an indentation none
            Form {
                label: "shear-thinning",
                parameters: &[RATIO, searched("ln thinning speed", -2.3, 2.3, 2e-2)],
                starts: &[&[0.05], &[-0.7, 0.7]],
                experiments: &[Experiment::DropTest],
                apply: |t, s, p| {
                    damp(t[0], 0.0, s, p);
                    p.hysteresis_damping.thinning_speed = thinning_speed(t, s);
                },
                quantities: &[DAMPING_RATIO, REFERENCE_SPEED, THINNING_SPEED],
                ..PLAIN
            },
            Form {
                label: "Lankarani-Nikravesh",
                experiments: &[Experiment::DropTest],
                per_impact_speed: true,
                ..PLAIN
            },
        ],
        collinear: &["viscous_damping", "viscoelastic_relaxation"],
        strongly_nonlinear: false,
        starts_from: StartsFrom::Forms,
        strength: Strength::Reading,
    };

    #[inline(always)]
    fn is_neutral(&self) -> bool {
        self.coefficient == 0.0
    }

    #[inline(always)]
    fn keeps_power_law(&self) -> bool {
        self.exponent_offset == 0.0 && self.thinning_speed == 0.0
    }

    fn check(&self, law: &Parameters) -> Result<(), ParameterError> {
        if self.exponent_offset + law.elastic.exponent >= 0.0 {
            Ok(())
        } else {
            Err(ParameterError { name: "damping_exponent_offset", value: self.exponent_offset, expected: OFFSET.words })
        }
    }

    #[inline(always)]
    fn damper(&self, at: &Point<'_>) -> Option<(f64, f64, f64)> {
        if self.coefficient > 0.0 {
            let (x, v, (b, bx)) = (at.x, at.v, at.branch);
            let (k, p) = (at.law.elastic.stiffness, at.law.elastic.exponent);
            let (o, mu) = (self.exponent_offset, self.coefficient);
            let plastic = &at.law.plastic_indentation;
            let on_branch = plastic.damping_form == 1 && plastic.yields();
            let (c, cx) = if on_branch {
                let w = mu / k * pow(x, o);
                (w * b, w * (bx + o * b / x))
            } else if o == 0.0 && !plastic.yields() {
                let c = self.of_branch(k, b);
                (c, p * c / x)
            } else {
                let c = mu * pow(x, p + o);
                (c, (p + o) * c / x)
            };
            let (thinned, steep) = thinning(v, self.thinning_speed);
            Some((c * thinned * v, cx * thinned * v, c * steep))
        } else {
            None
        }
    }

    #[inline(always)]
    fn damps(&self) -> bool {
        self.coefficient > 0.0
    }

    #[inline(always)]
    fn kink_at_rest(&self) -> bool {
        self.thinning_speed > 0.0
    }
}

/// mu_d such that the damping at the reference depth and speed is `ratio` of the elastic force.
fn damp(ratio: f64, offset: f64, s: &Scales, p: &mut Parameters) {
    p.hysteresis_damping.exponent_offset = offset;
    p.hysteresis_damping.coefficient = ratio * p.elastic.stiffness * s.x_ref.powf(-offset) / s.v_ref;
}

fn thinning_speed(t: &[f64], s: &Scales) -> f64 {
    s.speed * t[1].exp()
}

#[cfg(test)]
mod tests {
    use crate::{Memory, Parameters};

    #[test]
    fn the_damping_is_mu_x_to_the_power_times_v_and_halved_at_its_thinning_speed() {
        let mut p = Parameters::power_law(3.0, 2.0, 5.0);
        let elastic = 3.0 * 0.25;
        let damping = |p: &Parameters, v| p.force(&Memory::default(), 0.5, v) - elastic;
        assert_eq!(damping(&p, 2.0), 5.0 * 0.25 * 2.0);
        p.hysteresis_damping.thinning_speed = 2.0;
        assert_eq!(damping(&p, 2.0), 5.0 * 0.25 * 2.0 / 2.0);
        p.hysteresis_damping.exponent_offset = -1.0;
        assert!((damping(&p, 2.0) - 5.0 * 0.5).abs() < 1e-15);
    }

    #[test]
    fn a_power_of_the_depth_below_zero_is_refused() {
        let mut p = Parameters::power_law(1e8, 1.5, 0.0);
        p.hysteresis_damping.exponent_offset = -1.5;
        assert!(p.validate().is_ok());
        p.hysteresis_damping.exponent_offset = -1.6;
        assert_eq!(p.validate().unwrap_err().name, "damping_exponent_offset");
    }
}
