//! viscoelastic_relaxation: Maxwell branches beside the contact, whose forces decay.

use crate::elementary::{exp, pow};
use crate::part::{
    parameters, searched, Form, Mechanism, Origin, Part, Quantity, Range, Scales, StartsFrom, Step, Strength,
    EVERY_EXPERIMENT, HELD,
};
use crate::{Memory, Parameters, BRANCHES};

const SPREAD: Range = Range { least: Some(0.0), most: Some(6.0), words: "0 to 6", holds: |v| (0.0..=6.0).contains(&v) };

parameters! {
    /// Maxwell branches (Maxwell 1867; Wiechert 1893).
    viscoelastic_relaxation: ViscoelasticRelaxation {
        /// Stiffness of the branches together, N/m^q, >= 0.
        stiffness: f64 = 0.0, "relaxation_stiffness", 114, "N/m^q", "", Range::FROM_ZERO,
            "Stiffness of the Maxwell branches together; 0 turns relaxation off";
        /// Middle relaxation time, s, > 0.
        time: f64 = 1e-3, "relaxation_time", 115, "s", "ms", Range::POSITIVE, "Middle relaxation time, above 0";
        /// Decades between the relaxation times of the three branches, 0 to 6; 0: one time.
        spread: f64 = 0.0, "relaxation_spread", 116, "1", "", SPREAD,
            "Decades between the three relaxation times; 0: one time";
        /// Power q of x that the branches hang on, 0.5 to 5; 0: the exponent p.
        exponent: f64 = 0.0, "relaxation_exponent", 117, "1", "", Range::POWER_OR_ZERO,
            "Power q of x that the Maxwell branches hang on; 0: the exponent";
    }
}

/// All branches of one time.
const ONE: Form = Form {
    label: "one branch",
    parameters: &[searched("share", 0.0, 20.0, 2e-3), searched("ln tau", -4.5, 4.0, 2e-2)],
    starts: &[&[0.05], &[-2.5, -1.0, 0.5]],
    linear: true,
    extends: None,
    experiments: EVERY_EXPERIMENT,
    per_impact_speed: false,
    apply: |t, s, p| put(t, s, p, 0.0),
    quantities: &[
        Quantity { name: "relaxation_share", unit: "1", value: |t, _| t[0] },
        Quantity { name: "relaxation_time", unit: "s", value: time },
    ],
};

impl Part for ViscoelasticRelaxation {
    const MECHANISM: Mechanism = Mechanism {
        name: "viscoelastic_relaxation",
        origin: Origin::Contact,
        sentence: "the contact remembers: part of its force relaxes with a time constant",
        equation: "Maxwell branches: dF_i/dt = k_r d(x^p)/dt / n - F_i / tau_i",
        source: "Maxwell 1867; Wiechert 1893",
        cure: HELD,
        parameters: PARAMETERS,
        forms: &[
            ONE,
            Form { label: "three branches", apply: |t, s, p| put(t, s, p, 0.7), ..ONE },
            Form {
                label: "one branch on a linear spring",
                apply: |t, s, p| {
                    put(t, s, p, 0.0);
                    p.viscoelastic_relaxation.exponent = 1.0;
                    p.viscoelastic_relaxation.stiffness = t[0] * s.force / s.depth;
                },
                ..ONE
            },
        ],
        collinear: &["hysteresis_damping"],
        strongly_nonlinear: false,
        starts_from: StartsFrom::Forms,
        strength: Strength::Reading,
    };

    #[inline(always)]
    fn is_neutral(&self) -> bool {
        self.stiffness == 0.0
    }

    #[inline(always)]
    fn remember(&self, step: &Step<'_>, after: &mut Memory) {
        if self.stiffness > 0.0 {
            self.relax(step.law.elastic.exponent, step.before, (step.x0, step.x1), step.dt, after);
        }
    }

    #[inline(always)]
    fn scale_stiffness(&mut self, factor: f64) {
        self.stiffness *= factor;
    }
}

fn put(t: &[f64], s: &Scales, p: &mut Parameters, spread: f64) {
    p.viscoelastic_relaxation.stiffness = t[0] * p.elastic.stiffness;
    p.viscoelastic_relaxation.time = time(t, s);
    p.viscoelastic_relaxation.spread = spread;
}

fn time(t: &[f64], s: &Scales) -> f64 {
    s.duration * t[1].exp()
}

impl ViscoelasticRelaxation {
    /// Power of x that the branches hang on, on an elastic law of exponent `p`.
    #[inline]
    fn power(&self, p: f64) -> f64 {
        if self.exponent > 0.0 {
            self.exponent
        } else {
            p
        }
    }

    /// Relaxation times of the branches, s.
    #[inline]
    pub fn times(&self) -> [f64; BRANCHES] {
        if self.spread > 0.0 {
            let q = pow(10.0, self.spread);
            [self.time / q, self.time, self.time * q]
        } else {
            [self.time; BRANCHES]
        }
    }

    /// Updates the branch forces over a step of `dt` s from x0 to x1, on an elastic law of exponent `p`: the exact
    /// exponential of a drive that rises evenly from touch to the end of the step.
    fn relax(&self, p: f64, before: &Memory, (x0, x1): (f64, f64), dt: f64, after: &mut Memory) {
        if x1 <= 0.0 {
            after.relaxation = [0.0; BRANCHES];
            return;
        }
        let q = self.power(p);
        // in contact only from where the surface is crossed
        let (z0, t, held) =
            if x0 > 0.0 { (pow(x0, q), dt, before.relaxation) } else { (0.0, dt * x1 / (x1 - x0), [0.0; 3]) };
        let df = self.stiffness / BRANCHES as f64 * (pow(x1, q) - z0);
        let times = self.times();
        for b in 0..BRANCHES {
            let z = if t > 0.0 { t / times[b] } else { 0.0 };
            let a = exp(-z);
            // mean of the exponential over the step; its series where 1 - a cancels
            let mean = if z > 1e-3 { (1.0 - a) / z } else { 1.0 - z * (0.5 - z * (1.0 / 6.0 - z / 24.0)) };
            after.relaxation[b] = held[b] * a + df * mean;
        }
    }

    /// Free energy of the branches, J, >= 0: that of a spring whose own zero x_d creeps after x,
    /// kr x_d^q = kr x^q - f. What it loses is f (x - x_d)/tau >= 0. `p` is the exponent of the elastic law.
    pub(crate) fn energy(&self, p: f64, m: &Memory, x: f64) -> f64 {
        if x <= 0.0 || self.stiffness <= 0.0 {
            return 0.0;
        }
        let q = self.power(p);
        let k = self.stiffness / BRANCHES as f64;
        let z = pow(x, q);
        let mut e = 0.0;
        for f in m.relaxation {
            let zd = (z - f / k).max(0.0);
            let xd = pow(zd, 1.0 / q);
            e += k * ((z * x - zd * xd) / (q + 1.0) - zd * (x - xd));
        }
        e
    }
}

impl Parameters {
    /// Whether the force depends on time, not on the path alone.
    #[inline(always)]
    pub fn relaxes(&self) -> bool {
        self.viscoelastic_relaxation.stiffness > 0.0
    }

    /// The memory as it is while (`x`, `v`) is tried, m and m/s, from (`x0`, `v0`), no time having gone by: the
    /// Maxwell branches carry the move as the springs they are at that instant.
    #[inline]
    pub fn tried(&self, m: &Memory, from: (f64, f64), to: (f64, f64)) -> Memory {
        if self.relaxes() {
            self.advance(m, from.0, from.1, to.0, to.1, 0.0)
        } else {
            *m
        }
    }

    /// Slope of the Maxwell branches at that instant, N/m.
    #[inline]
    pub fn relaxation_slope(&self, x: f64) -> f64 {
        if self.relaxes() {
            self.relaxation_rates(&Memory::default(), x, 1.0).iter().sum()
        } else {
            0.0
        }
    }

    /// Rates of the branch forces, N/s, for a host that carries them as states: f' = (kr/3) d(x^q)/dt - f/tau.
    #[inline]
    pub fn relaxation_rates(&self, m: &Memory, x: f64, v: f64) -> [f64; BRANCHES] {
        let branches = &self.viscoelastic_relaxation;
        let q = branches.power(self.elastic.exponent);
        let g = if x > 0.0 { branches.stiffness / BRANCHES as f64 * q * pow(x, q - 1.0) * v } else { 0.0 };
        let t = branches.times();
        let mut r = [0.0; BRANCHES];
        for b in 0..BRANCHES {
            r[b] = g - m.relaxation[b] / t[b];
        }
        r
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_held_branch_decays_by_its_exponential() {
        let mut p = Parameters::default();
        p.viscoelastic_relaxation.stiffness = 1e8;
        p.viscoelastic_relaxation.time = 0.01;
        let mut m = p.advance(&Memory::default(), 0.0, 0.0, 1e-3, 0.0, 1e-9);
        let first = m.relaxation[0];
        for _ in 0..10 {
            m = p.advance(&m, 1e-3, 0.0, 1e-3, 0.0, 1e-3);
        }
        assert!((m.relaxation[0] / first - (-1.0f64).exp()).abs() < 1e-12);
    }
}
