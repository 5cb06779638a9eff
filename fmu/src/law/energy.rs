//! Energies of the law: what is stored has a closed form, and so has the work of everything that has a
//! potential; only what has none is integrated numerically, piece by smooth piece.

use super::elementary::{exp, pow};
use super::{AdhesionForm, Memory, Parameters, PlasticForm, BRANCHES};

/// Nodes of Gauss and Legendre's two-point rule on (0, 1).
const NODES: [f64; 2] = [0.211_324_865_405_187_13, 0.788_675_134_594_812_9];

impl Parameters {
    /// Work along the virgin loading curve from 0 to `x`, J.
    fn loading_work(&self, x: f64) -> f64 {
        if x <= 0.0 {
            return 0.0;
        }
        let q = self.exponent + 1.0;
        let y = self.yield_penetration;
        if self.plastic_form == PlasticForm::Thornton as i32 && self.yields() && x > y {
            let f = self.stiffness * pow(y, self.exponent);
            let z = x - y;
            return f * y / q + z * (f + 0.5 * self.exponent * f / y * z);
        }
        self.stiffness * pow(x, self.exponent) * x / q
    }

    /// Energy that the elastic or unloading branch gives back from `x` with deepest `d` >= x, J.
    fn branch_energy(&self, x: f64, d: f64) -> f64 {
        if x <= 0.0 {
            return 0.0;
        }
        match self.unloading(d) {
            None => self.loading_work(x),
            Some(u) if x > u.set => u.force(x) * (x - u.set) / (u.power + 1.0),
            Some(_) => 0.0,
        }
    }

    /// Potential of the second layer and of reversible adhesion, J, zero far outside.
    fn reversible_energy(&self, x: f64) -> f64 {
        let mut e = 0.0;
        if self.secondary_stiffness > 0.0 && x > self.secondary_depth {
            let z = x - self.secondary_depth;
            e += self.secondary_stiffness * pow(z, self.secondary_exponent) * z
                / (self.secondary_exponent + 1.0);
        }
        if self.adhesion_force > 0.0 {
            let (fa, r) = (self.adhesion_force, self.adhesion_range);
            if self.adhesion_form == AdhesionForm::Contact as i32 {
                if x > 0.0 {
                    e -= fa * (x + r * (exp(-x / r) - 1.0));
                }
            } else if self.adhesion_form == AdhesionForm::Reach as i32 {
                if x >= 0.0 {
                    e -= fa * (0.5 * r + x);
                } else if x > -r {
                    e -= 0.5 * fa * (x + r) * (x + r) / r;
                }
            }
        }
        e
    }

    /// Free energy of the Maxwell branches, J, >= 0: that of a spring whose own zero x_d creeps after x,
    /// kr x_d^q = kr x^q - f. What it loses is f (x - x_d)/tau >= 0.
    fn relaxation_energy(&self, m: &Memory, x: f64) -> f64 {
        if x <= 0.0 || self.relaxation_stiffness <= 0.0 {
            return 0.0;
        }
        let q = self.branch_power();
        let k = self.relaxation_stiffness / BRANCHES as f64;
        let z = pow(x, q);
        let mut e = 0.0;
        for f in m.relaxation {
            let zd = (z - f / k).max(0.0);
            let xd = pow(zd, 1.0 / q);
            e += k * ((z * x - zd * xd) / (q + 1.0) - zd * (x - xd));
        }
        e
    }

    /// Energy, J, that the contact with memory `m`, `m.deepest` >= `x`, holds at penetration `x` m: the area under
    /// its unloading curve and the second layer, the free energy of the Maxwell branches, and the (negative)
    /// potential of reversible adhesion. The neck of adhesion holds none: its work counts as lost.
    pub fn stored_energy(&self, m: &Memory, x: f64) -> f64 {
        self.branch_energy(x, m.deepest) + self.reversible_energy(x) + self.relaxation_energy(m, x)
    }

    /// Memory of a contact found at rest at `x` m, loaded slowly from outside: the work of getting there is
    /// counted, the Maxwell branches are relaxed.
    pub fn start(&self, x: f64) -> Memory {
        let mut m = Memory {
            deepest: if x > 0.0 { x } else { 0.0 },
            ..Memory::default()
        };
        m.work = self.loading_work(x) + self.reversible_energy(x);
        m.stored = self.stored_energy(&m, x);
        m
    }

    /// Work done on the contact over a step of straight x and v from memory `m` to `o`, J.
    pub(super) fn work_of_step(
        &self,
        m: &Memory,
        o: &Memory,
        from: (f64, f64),
        to: (f64, f64),
    ) -> f64 {
        let ((x0, v0), (x1, v1)) = (from, to);
        if x0 == x1 {
            return 0.0;
        }
        let d = if x0 > m.deepest { x0 } else { m.deepest };
        let branch = if x1 <= d {
            self.branch_energy(x1, d) - self.branch_energy(x0, d)
        } else {
            self.branch_energy(d, d) - self.branch_energy(x0, d) + self.loading_work(x1)
                - self.loading_work(d)
        };
        let mut w = branch + self.reversible_energy(x1) - self.reversible_energy(x0);
        let neck = self.adhesion_force > 0.0 && self.adhesion_form == AdhesionForm::Neck as i32;
        if !(neck
            || self.hysteresis_damping > 0.0
            || self.viscous_damping > 0.0
            || self.relaxation_stiffness > 0.0)
        {
            return w;
        }
        // where the rest has kinks along the step, in order
        let mut cuts = [0.0, 1.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0];
        let kinks = [
            0.0,
            self.viscous_ramp,
            self.permanent_set(d),
            d,
            if neck { m.deepest - m.released } else { 0.0 },
            if neck { -self.adhesion_range } else { 0.0 },
        ];
        let mut n = 1;
        for k in kinks {
            let s = (k - x0) / (x1 - x0);
            if s > 0.0 && s < 1.0 {
                let mut i = n;
                while cuts[i - 1] > s {
                    cuts[i] = cuts[i - 1];
                    i -= 1;
                }
                cuts[i] = s;
                n += 1;
            }
        }
        cuts[n] = 1.0;
        // branch forces begin where the surface is crossed
        let touch = if x0 < 0.0 && x1 > 0.0 {
            x0 / (x0 - x1)
        } else {
            0.0
        };
        for i in 0..n {
            let len = cuts[i + 1] - cuts[i];
            for node in NODES {
                let s = cuts[i] + node * len;
                let (x, v) = (x0 + s * (x1 - x0), v0 + s * (v1 - v0));
                let mut here = *m;
                let share = if s > touch {
                    (s - touch) / (1.0 - touch)
                } else {
                    0.0
                };
                for b in 0..BRANCHES {
                    here.relaxation[b] += share * (o.relaxation[b] - m.relaxation[b]);
                }
                w += 0.5 * len * (x1 - x0) * self.without_potential(&here, x, v, neck);
            }
        }
        w
    }

    /// Force less what has a potential, N.
    fn without_potential(&self, m: &Memory, x: f64, v: f64, neck: bool) -> f64 {
        let mut f = 0.0;
        if x > 0.0 {
            let (a, b) = self.push(m, x, v, if x > m.deepest { x } else { m.deepest });
            f = if a.0 + b.0 > 0.0 { b.0 } else { -a.0 };
        }
        if neck {
            f -= self.pull(m, x).0;
        }
        f
    }
}
