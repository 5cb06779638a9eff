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
            Some(u) if x > u.set => {
                let end = self.crossing(&u).min(x);
                let capped = self.loading_work(x) - self.loading_work(end);
                u.force(end) * (end - u.set) / (u.power + 1.0) + capped
            }
            Some(_) => 0.0,
        }
    }

    /// Energy of the second layer, J.
    fn second_layer_energy(&self, x: f64) -> f64 {
        if self.secondary_stiffness > 0.0 && x > self.secondary_depth {
            let (z, r) = (x - self.secondary_depth, self.secondary_exponent);
            if self.secondary_width > 0.0 {
                return self.secondary_stiffness * self.spread(z, r + 1.0) / (r + 1.0);
            }
            self.second_layer(x).0 * z / (r + 1.0)
        } else {
            0.0
        }
    }

    /// Potential of reversible adhesion, J, <= 0 and zero far outside.
    fn pull_energy(&self, x: f64) -> f64 {
        let (fa, r) = (self.adhesion_force, self.adhesion_range);
        if fa <= 0.0 {
            0.0
        } else if self.adhesion_form == AdhesionForm::Contact as i32 && x > 0.0 {
            -fa * (x + r * (exp(-x / r) - 1.0))
        } else if self.adhesion_form == AdhesionForm::Reach as i32 && x > -r {
            if x >= 0.0 {
                -fa * (0.5 * r + x)
            } else {
                -0.5 * fa * (x + r) * (x + r) / r
            }
        } else if self.adhesion_form == AdhesionForm::Growing as i32 && x > 0.0 {
            // of the pull going in; what the neck adds while leaving has none
            let q = 0.5 * self.exponent;
            -fa * pow(x / r, q) * x / (q + 1.0)
        } else {
            0.0
        }
    }

    /// Work against the pull of [`AdhesionForm::Growing`] from `a` to `b`, no kink between, J.
    fn growing_work(&self, m: &Memory, a: f64, b: f64) -> f64 {
        let (middle, slope) = self.nearness(m, 0.5 * (a + b));
        if middle <= 0.0 {
            return 0.0;
        }
        let (q, change) = (0.5 * self.exponent, 0.5 * slope * (b - a));
        let mean = if change.abs() < 1e-6 * middle {
            pow(middle, q)
        } else {
            let end = |z: f64| if z > 0.0 { pow(z, q + 1.0) } else { 0.0 };
            (end(middle + change) - end(middle - change)) / (2.0 * change * (q + 1.0))
        };
        -self.adhesion_force * mean * (b - a)
    }

    /// Work of the branch and the second layer from `x0` to `x1` with deepest `d` >= `x0` before, J.
    fn push_work(&self, x0: f64, x1: f64, d: f64) -> f64 {
        let layer = self.second_layer_energy(x1) - self.second_layer_energy(x0);
        let below = if x1 < d { x1 } else { d };
        let mut w = layer + self.branch_energy(below, d) - self.branch_energy(x0, d);
        if x1 > d {
            w += self.loading_work(x1) - self.loading_work(d);
        }
        w
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
        self.branch_energy(x, m.deepest)
            + self.second_layer_energy(x)
            + self.pull_energy(x)
            + self.relaxation_energy(m, x)
    }

    /// Memory of a contact found at rest at `x` m, loaded slowly from outside: the work of getting there is
    /// counted, the Maxwell branches are relaxed.
    pub fn start(&self, x: f64) -> Memory {
        let mut m = Memory { deepest: if x > 0.0 { x } else { 0.0 }, ..Memory::default() };
        m.work = self.loading_work(x) + self.second_layer_energy(x) + self.pull_energy(x);
        m.stored = self.stored_energy(&m, x);
        m
    }

    /// (work of a step, energy stored after it), J, for the power law with hysteresis damping alone, in contact and
    /// unclamped throughout: two powers of x. None for everything else.
    #[inline]
    pub(super) fn plain_step(&self, from: (f64, f64), to: (f64, f64)) -> Option<(f64, f64)> {
        let ((x0, v0), (x1, v1)) = (from, to);
        let mu = self.hysteresis_damping;
        let alone = self.viscous_damping == 0.0
            && self.relaxation_stiffness == 0.0
            && self.adhesion_force == 0.0
            && self.secondary_stiffness == 0.0
            && self.damping_exponent_offset == 0.0
            && self.hysteresis_thinning_speed == 0.0
            && !self.yields();
        let pushes = self.stiffness + mu * v0 >= 0.0 && self.stiffness + mu * v1 >= 0.0;
        if !(alone && pushes && x0 > 0.0 && x1 > 0.0) {
            return None;
        }
        let (p, q) = (self.exponent, self.exponent + 1.0);
        let (f0, f1) = (pow(x0, p), pow(x1, p));
        let (s0, s1) = (f0 * x0 / q, f1 * x1 / q);
        let dx = x1 - x0;
        let stored = self.stiffness * s1;
        let mut work = self.stiffness * (s1 - s0);
        if mu > 0.0 && dx != 0.0 {
            let dv = v1 - v0;
            work += mu
                * if dx.abs() < 3e-3 * x0 {
                    // trapezium with its end correction, of x^p v over x
                    let (g0, g1) = (p * f0 / x0 * v0 * dx + f0 * dv, p * f1 / x1 * v1 * dx + f1 * dv);
                    dx * (0.5 * (f0 * v0 + f1 * v1) + (g0 - g1) / 12.0)
                } else {
                    let second = (s1 * x1 - s0 * x0) * q / (q + 1.0);
                    v0 * (s1 - s0) + dv / dx * (second - x0 * (s1 - s0))
                };
        }
        Some((work, stored))
    }

    /// Work done on the contact over a step of straight x and v from memory `m` to `o`, J.
    pub(super) fn work_of_step(&self, m: &Memory, o: &Memory, from: (f64, f64), to: (f64, f64)) -> f64 {
        let ((x0, v0), (x1, v1)) = (from, to);
        if x0 == x1 {
            return 0.0;
        }
        let d = if x0 > m.deepest { x0 } else { m.deepest };
        let mut w = self.push_work(x0, x1, d);
        let pulls = |form: AdhesionForm| self.adhesion_force > 0.0 && self.adhesion_form == form as i32;
        let growing = pulls(AdhesionForm::Growing);
        let neck = pulls(AdhesionForm::Neck) || pulls(AdhesionForm::Leaving);
        // whether a neck binds the faces, whose break is a kink
        let bound = neck || growing;
        if !growing {
            w += self.pull_energy(x1) - self.pull_energy(x0);
        }
        if !(bound || self.hysteresis_damping > 0.0 || self.viscous_damping > 0.0 || self.relaxation_stiffness > 0.0) {
            return w;
        }
        // where the rest has kinks along the step, in order
        let mut cuts = [1.0; 10];
        cuts[0] = 0.0;
        let unloading = self.unloading(d);
        let kinks = [
            0.0,
            self.viscous_ramp,
            unloading.map_or(0.0, |u| u.set),
            unloading.map_or(0.0, |u| self.crossing(&u)),
            d,
            if bound { m.deepest - m.released } else { 0.0 },
            if bound { -self.adhesion_range } else { 0.0 },
        ];
        let thins = self.viscous_thinning_speed > 0.0 || self.hysteresis_thinning_speed > 0.0;
        let turn = if thins && v0 != v1 { v0 / (v0 - v1) } else { 0.0 };
        let mut n = 1;
        for s in kinks.map(|k| (k - x0) / (x1 - x0)).into_iter().chain([turn]) {
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
        let touch = if x0 < 0.0 && x1 > 0.0 { x0 / (x0 - x1) } else { 0.0 };
        let at = |s: f64| {
            let mut here = *m;
            let share = if s > touch { (s - touch) / (1.0 - touch) } else { 0.0 };
            for b in 0..BRANCHES {
                here.relaxation[b] += share * (o.relaxation[b] - m.relaxation[b]);
            }
            self.without_potential(&here, x0 + s * (x1 - x0), v0 + s * (v1 - v0), neck)
        };
        let may_clamp = v0 < 0.0 || v1 < 0.0 || self.relaxation_stiffness > 0.0;
        for i in 0..n {
            let (a, b) = (cuts[i], cuts[i + 1]);
            if growing {
                w += self.growing_work(m, x0 + a * (x1 - x0), x0 + b * (x1 - x0));
            }
            let mut split = b;
            if may_clamp {
                let eps = 1e-12 * (b - a);
                let first = at(a + eps).1;
                if first != at(b - eps).1 {
                    let (mut lo, mut hi) = (a, b);
                    for _ in 0..40 {
                        let mid = 0.5 * (lo + hi);
                        if at(mid).1 == first {
                            lo = mid;
                        } else {
                            hi = mid;
                        }
                    }
                    split = lo;
                }
            }
            for (from, to) in [(a, split), (split, b)] {
                if to > from {
                    let (xa, xb) = (x0 + from * (x1 - x0), x0 + to * (x1 - x0));
                    let mut clamped = false;
                    for node in NODES {
                        let (f, c) = at(from + node * (to - from));
                        w += 0.5 * (xb - xa) * f;
                        clamped = c;
                    }
                    if clamped {
                        // what was counted above is not felt; d may be passed on the way
                        w -= self.push_work(xa, xb, if xa > d { xa } else { d });
                    }
                }
            }
        }
        w
    }

    /// Force less what has a potential, N, and whether the contact is clamped at no force.
    fn without_potential(&self, m: &Memory, x: f64, v: f64, neck: bool) -> (f64, bool) {
        let (mut f, mut clamped) = (0.0, false);
        if x > 0.0 {
            let (a, b) = self.push(m, x, v, if x > m.deepest { x } else { m.deepest });
            clamped = a.0 + b.0 < 0.0;
            f = if clamped { 0.0 } else { b.0 };
        }
        if neck {
            f -= self.pull(m, x).0;
        }
        (f, clamped)
    }
}
