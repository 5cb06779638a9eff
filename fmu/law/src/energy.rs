//! Energies of the law: what is stored has a closed form, and so has the work of everything that has a
//! potential; only what has none is integrated numerically, piece by smooth piece.

use super::elementary::pow;
use super::parts::MECHANISMS;
use super::{AdhesionForm, Memory, Parameters, BRANCHES};

/// Nodes of Gauss and Legendre's two-point rule on (0, 1).
pub(crate) const NODES: [f64; 2] = [0.211_324_865_405_187_13, 0.788_675_134_594_812_9];

/// Most pieces a step is cut into: its ends, the kinks of branch and adhesion, one a part, and the turn.
const MOST_CUTS: usize = 9 + MECHANISMS.len();

impl Parameters {
    /// Work of the branch and of all springs beside it from `x0` to `x1` with deepest `d` >= `x0` before, J.
    fn push_work(&self, x0: f64, x1: f64, d: f64) -> f64 {
        let springs = self.spring_energy(x1) - self.spring_energy(x0);
        let below = if x1 < d { x1 } else { d };
        let mut w = springs + self.branch_energy(below, d) - self.branch_energy(x0, d);
        if x1 > d {
            w += self.loading_work(x1) - self.loading_work(d);
        }
        w
    }

    /// Energy, J, that the contact with memory `m`, `m.deepest` >= `x`, holds at penetration `x` m: the area under
    /// its unloading curve and of all springs beside it, the free energy of the Maxwell branches, and the (negative)
    /// potential of reversible adhesion. The neck of adhesion holds none: its work counts as lost.
    pub fn stored_energy(&self, m: &Memory, x: f64) -> f64 {
        self.branch_energy(x, m.deepest)
            + self.spring_energy(x)
            + self.adhesion.pull_energy(self.elastic.exponent, x)
            + self.viscoelastic_relaxation.energy(self.elastic.exponent, m, x)
            + self.learned_law.energy(x)
    }

    /// Memory of a contact found at rest at `x` m, loaded slowly from outside: the work of getting there is
    /// counted, the Maxwell branches are relaxed.
    pub fn start(&self, x: f64) -> Memory {
        let mut m = Memory { deepest: if x > 0.0 { x } else { 0.0 }, ..Memory::default() };
        m.work = self.loading_work(x)
            + self.spring_energy(x)
            + self.adhesion.pull_energy(self.elastic.exponent, x)
            + self.learned_law.energy(x);
        m.stored = self.stored_energy(&m, x);
        m
    }

    /// (work of a step, energy stored after it), J, for the power law with hysteresis damping alone, in contact and
    /// unclamped throughout: two powers of x. None for everything else.
    #[inline]
    pub(super) fn plain_step(&self, from: (f64, f64), to: (f64, f64)) -> Option<(f64, f64)> {
        if !(self.keeps_power_law() && self.stays_in_contact(from, to)) {
            return None;
        }
        let p = self.elastic.exponent;
        Some(self.power_law_work(from, to, (pow(from.0, p), pow(to.0, p))))
    }

    /// Whether the power law with hysteresis damping is in contact and unclamped over a step.
    #[inline]
    pub(super) fn stays_in_contact(&self, from: (f64, f64), to: (f64, f64)) -> bool {
        let (mu, k) = (self.hysteresis_damping.coefficient, self.elastic.stiffness);
        k + mu * from.1 >= 0.0 && k + mu * to.1 >= 0.0 && from.0 > 0.0 && to.0 > 0.0
    }

    /// As [`Parameters::plain_step`] where that is Some, with the `powers` x^p at both ends.
    #[inline]
    pub(super) fn power_law_work(&self, from: (f64, f64), to: (f64, f64), powers: (f64, f64)) -> (f64, f64) {
        let ((x0, v0), (x1, v1), (f0, f1)) = (from, to, powers);
        let (mu, k) = (self.hysteresis_damping.coefficient, self.elastic.stiffness);
        let (p, q) = (self.elastic.exponent, self.elastic.exponent + 1.0);
        let (s0, s1) = (f0 * x0 / q, f1 * x1 / q);
        let dx = x1 - x0;
        let stored = k * s1;
        let mut work = k * (s1 - s0);
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
        (work, stored)
    }

    /// Work done on the contact over a step of straight x and v from memory `m` to `o`, J.
    pub(super) fn work_of_step(&self, m: &Memory, o: &Memory, from: (f64, f64), to: (f64, f64)) -> f64 {
        let ((x0, v0), (x1, v1)) = (from, to);
        if x0 == x1 {
            return 0.0;
        }
        let d = if x0 > m.deepest { x0 } else { m.deepest };
        let mut w = self.push_work(x0, x1, d);
        let (adhesion, p) = (&self.adhesion, self.elastic.exponent);
        let growing = adhesion.pulls(AdhesionForm::Growing);
        let neck = adhesion.pulls(AdhesionForm::Neck) || adhesion.pulls(AdhesionForm::Leaving);
        // whether a neck binds the faces, whose break is a kink
        let bound = neck || growing;
        if !growing {
            w += adhesion.pull_energy(p, x1) - adhesion.pull_energy(p, x0);
        }
        if self.learned_law.acts() {
            w += self.learned_law.work(from, to);
        }
        if !(bound || self.damps() || self.relaxes()) {
            return w;
        }
        // where the rest has kinks along the step, in order
        let mut cuts = [1.0; MOST_CUTS];
        cuts[0] = 0.0;
        let mut n = 1;
        let mut cut = |s: f64| {
            if s > 0.0 && s < 1.0 {
                let mut i = n;
                while cuts[i - 1] > s {
                    cuts[i] = cuts[i - 1];
                    i -= 1;
                }
                cuts[i] = s;
                n += 1;
            }
        };
        let unloading = self.unloading(d);
        let kinks = [
            0.0,
            unloading.map_or(0.0, |u| u.set),
            unloading.map_or(0.0, |u| self.crossing(&u)),
            d,
            if bound { m.deepest - m.released } else { 0.0 },
            if bound { -adhesion.range } else { 0.0 },
        ];
        for k in kinks {
            cut((k - x0) / (x1 - x0));
        }
        self.kinks(|k| cut((k - x0) / (x1 - x0)));
        if self.kink_at_rest() && v0 != v1 {
            cut(v0 / (v0 - v1));
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
        let may_clamp = v0 < 0.0 || v1 < 0.0 || self.relaxes();
        for i in 0..n {
            let (a, b) = (cuts[i], cuts[i + 1]);
            if growing {
                w += adhesion.growing_work(p, m, x0 + a * (x1 - x0), x0 + b * (x1 - x0));
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
            f -= self.adhesion.pull(self.elastic.exponent, m, x).0;
        }
        (f, clamped)
    }
}
