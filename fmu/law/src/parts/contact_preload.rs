//! contact_preload: a contact spring held compressed by F0, which takes part as soon as the faces touch.

use crate::elementary::{exp, exp_m1};
use crate::part::{
    parameters, searched, Form, Mechanism, Origin, Part, Quantity, Range, Scales, StartsFrom, Strength,
    EVERY_EXPERIMENT, HELD,
};

parameters! {
    /// A contact spring under preload, as in a contactor's overtravel.
    contact_preload: ContactPreload {
        /// Preload F0, N, >= 0: the force of the spring as soon as the faces touch.
        force: f64 = 0.0, "contact_preload", 128, "N", "kN", Range::FROM_ZERO,
            "Preload of a contact spring: force as soon as the faces touch; 0 turns it off";
        /// Depth d over which it builds up, m, > 0: F0 (1 - exp(-x/d)).
        ramp: f64 = 1e-6, "contact_preload_ramp", 129, "m", "um", Range::POSITIVE,
            "Depth over which the preload builds up, F0 (1 - exp(-x/d)), above 0";
    }
}

/// Share of the campaign's depth over which a search lets the preload build up.
const RAMP: f64 = 0.02;

impl Part for ContactPreload {
    const MECHANISM: Mechanism = Mechanism {
        name: "contact_preload",
        origin: Origin::Contact,
        sentence: "a contact spring under preload pushes with its full force as soon as the faces touch",
        equation: "F = F0 (1 - exp(-x/d))",
        source: "Holm 1967 (contact force of switches); Slade 2014 (contact springs of contactors)",
        cure: HELD,
        parameters: PARAMETERS,
        forms: &[Form {
            label: "preload",
            parameters: &[searched("force", 0.0, 3.0, 1e-3)],
            starts: &[&[0.02, 0.2]],
            linear: true,
            extends: None,
            experiments: EVERY_EXPERIMENT,
            per_impact_speed: false,
            apply: |t, s, p| p.contact_preload = ContactPreload { force: force(t, s), ramp: ramp(t, s) },
            quantities: &[
                Quantity { name: "contact_preload", unit: "N", value: force },
                Quantity { name: "contact_preload_ramp", unit: "m", value: ramp },
            ],
        }],
        collinear: &["return_spring", "guide_friction"],
        strongly_nonlinear: false,
        starts_from: StartsFrom::Forms,
        strength: Strength::Reading,
    };

    #[inline(always)]
    fn is_neutral(&self) -> bool {
        self.force == 0.0
    }

    #[inline(always)]
    fn spring(&self, x: f64) -> Option<(f64, f64)> {
        if self.force > 0.0 {
            Some(self.built_up(x))
        } else {
            None
        }
    }

    #[inline]
    fn spring_energy(&self, x: f64) -> Option<f64> {
        if self.force > 0.0 && x > 0.0 {
            // d (z - 1 + exp(-z)), by its series where that cancels
            let z = x / self.ramp;
            let built = if z < 1e-2 {
                z * z * (0.5 - z * (1.0 / 6.0 - z * (1.0 / 24.0 - z * (1.0 / 120.0 - z / 720.0))))
            } else {
                z + exp_m1(-z)
            };
            Some(self.force * self.ramp * built)
        } else {
            None
        }
    }
}

impl ContactPreload {
    /// (force N, slope N/m) at `x` m, > 0; a function of its own, so that a law without preload only passes it by.
    #[inline(never)]
    fn built_up(&self, x: f64) -> (f64, f64) {
        let z = x / self.ramp;
        (-self.force * exp_m1(-z), self.force / self.ramp * exp(-z))
    }
}

fn force(t: &[f64], s: &Scales) -> f64 {
    t[0] * s.force
}

fn ramp(_: &[f64], s: &Scales) -> f64 {
    RAMP * s.depth
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Memory, Parameters};

    fn law() -> Parameters {
        let mut p = Parameters::power_law(2e6, 1.5, 0.0);
        p.contact_preload = ContactPreload { force: 80.0, ramp: 2e-6 };
        p
    }

    #[test]
    fn the_force_is_the_preload_once_the_ramp_is_passed_and_nothing_before_touch() {
        let (p, m) = (law(), Memory::default());
        assert_eq!(p.force(&m, -1e-9, 1.0), 0.0);
        assert!((p.force(&m, 2e-6, 0.0) - 2e6 * 2e-6f64.powf(1.5) - 80.0 * (1.0 - (-1f64).exp())).abs() < 1e-12);
        assert!((p.force(&m, 1e-4, 0.0) - 2e6 * 1e-6 - 80.0).abs() < 1e-9);
        for x in [1e-9, 1e-6, 3e-6, 4e-5] {
            let h = 1e-4 * x;
            let slope = (p.force(&m, x + h, 0.0) - p.force(&m, x - h, 0.0)) / (2.0 * h);
            assert!((p.derivatives(&m, x, 0.0).0 / slope - 1.0).abs() < 1e-6, "{x}");
        }
    }

    #[test]
    fn the_energy_is_the_integral_of_the_force_and_comes_back_whole() {
        let preload = law().contact_preload;
        for x in [1e-12, 1.9e-8, 2.1e-8, 1e-6, 3e-5, 1e-3] {
            let n = 4000;
            let at = |i: i32| preload.spring(x * (f64::from(i) + 0.5) / f64::from(n)).unwrap().0;
            let integral: f64 = (0..n).map(|i| at(i) * x / f64::from(n)).sum();
            assert!((preload.spring_energy(x).unwrap() / integral - 1.0).abs() < 1e-3, "{x}");
        }
        let (below, above) =
            (preload.spring_energy(1.9999999e-8).unwrap(), preload.spring_energy(2.0000001e-8).unwrap());
        assert!((above / below - 1.0).abs() < 1e-6, "the series does not meet the closed form");
        // in and out in steps far longer than the ramp: nothing is lost, and work is that of both springs
        let (p, d) = (law(), 1e-3);
        let mut m = Memory::default();
        let at = |i: i32| d * (1.0 - (f64::from(i) / 20.0 - 1.0).abs()) - 1e-5;
        for i in 0..40 {
            m = p.advance(&m, at(i), 0.5, at(i + 1), 0.5, 1e-4);
            if i == 19 {
                let x = d - 1e-5;
                let wanted = 2e6 * x.powf(2.5) / 2.5 + 80.0 * (x - 2e-6);
                assert!((m.work / wanted - 1.0).abs() < 1e-12 && (m.stored / wanted - 1.0).abs() < 1e-12);
            }
        }
        assert!(m.stored == 0.0 && m.dissipated().abs() < 1e-12, "{m:?}");
    }
}
