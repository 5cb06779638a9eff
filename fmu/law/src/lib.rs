//! The contact law: pure physics, no I/O, no allocation, no clock.
//!
//! Invariant: nothing here logs, allocates or reads time; the memory of the law is explicit
//! [`Memory`], passed in and handed back.
//!
//! F = max(0, branch(x) + mu_d x^(p+o) v + c v + k2 (x - d2)^r + Maxwell forces) - adhesion, at x > 0;
//! branch(x) is k x^p, or the plastic unloading curve. Below the permanent set nothing touches, so neither
//! damping acts there. Maxwell forces vanish where the body leaves the nominal surface (x <= 0).

pub mod elementary;
mod energy;
pub mod impact;
mod parameters;
pub mod reference;
pub mod restitution;
mod step;
pub mod stiffness;
#[cfg(test)]
mod tests;

use elementary::{exp, pow};
pub use parameters::{AdhesionForm, ParameterError, Parameters, PlasticForm};

/// Share of its range over which the pull of [`AdhesionForm::Leaving`] builds up.
const LEAVING_BUILD_UP: f64 = 0.05;

/// Share of its depth below which the width of the second layer's onset counts by its middle alone: the mean of a
/// power over it is then that of the middle to 1e-10, and a difference of powers would lose more.
const LEAST_WIDTH: f64 = 1e-5;

/// 1/(1 + |v|/v_t), and d/dv of v times that; 1 where `speed`, v_t m/s, is 0.
#[inline]
fn thinning(v: f64, speed: f64) -> (f64, f64) {
    if speed > 0.0 {
        let thinned = 1.0 / (1.0 + v.abs() / speed);
        (thinned, thinned * thinned)
    } else {
        (1.0, 1.0)
    }
}

/// Number of Maxwell branches.
pub const BRANCHES: usize = 3;

/// Memory of the law. The default is a contact never touched.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Memory {
    /// Deepest penetration so far, m.
    pub deepest: f64,
    /// How much less deep than `deepest` the contact has been since the adhesive neck last broke, m.
    pub released: f64,
    /// Forces held by the Maxwell branches, N.
    pub relaxation: [f64; BRANCHES],
    /// Work done on the contact so far, J.
    pub work: f64,
    /// Energy that the contact could still give back, J; below 0 inside a reversible adhesion's reach.
    pub stored: f64,
}

impl Memory {
    /// Energy turned into heat and lasting deformation so far, J: work less what is stored.
    pub fn dissipated(&self) -> f64 {
        self.work - self.stored
    }
}

/// A plastically unloading branch.
#[derive(Clone, Copy)]
struct Unloading {
    /// Permanent set, m.
    set: f64,
    /// Deepest point, m.
    deepest: f64,
    /// Force there, N.
    top: f64,
    /// Power.
    power: f64,
    /// Whether the loading curve cuts it off.
    capped: bool,
}

impl Unloading {
    /// Force, N, at x > set.
    #[inline]
    fn force(&self, x: f64) -> f64 {
        self.top * pow((x - self.set) / (self.deepest - self.set), self.power)
    }
}

impl Parameters {
    #[inline]
    fn yields(&self) -> bool {
        self.plastic_ratio > 0.0
    }

    /// (force N, slope N/m) of the virgin loading curve at `x` > 0.
    #[inline]
    fn loading(&self, x: f64) -> (f64, f64) {
        let (k, p, y) = (self.stiffness, self.exponent, self.yield_penetration);
        if self.plastic_form == PlasticForm::Thornton as i32 && self.yields() && x > y {
            let f = k * pow(y, p);
            let slope = p * f / y;
            return (f + slope * (x - y), slope);
        }
        let f = k * pow(x, p);
        (f, p * f / x)
    }

    /// The unloading branch after a deepest penetration `d`; None while nothing has yielded.
    #[inline]
    fn unloading(&self, d: f64) -> Option<Unloading> {
        if !(self.yields() && d > self.yield_penetration) {
            return None;
        }
        let top = self.loading(d).0;
        if self.plastic_form == PlasticForm::Thornton as i32 {
            // k_u = k sqrt(k d^p/top), so (top/k_u)^2 = top^3/(k^3 d^p)
            let ratio = top / self.stiffness;
            let reach = pow(ratio * ratio * ratio / pow(d, self.exponent), 0.5 / self.exponent);
            return Some(Unloading { set: (d - reach).max(0.0), deepest: d, top, power: self.exponent, capped: false });
        }
        let set = self.plastic_ratio * (d - self.yield_penetration);
        if self.plastic_form == PlasticForm::WaltonBraun as i32 {
            return Some(Unloading { set, deepest: d, top, power: 1.0, capped: true });
        }
        let wanted =
            if self.plastic_unloading_exponent > 0.0 { self.plastic_unloading_exponent } else { self.exponent };
        // the power at which unloading returns all that loading took: never below it
        let lossless = (self.exponent + 1.0) * (1.0 - set / d) - 1.0;
        let power = if wanted > lossless { wanted } else { lossless };
        Some(Unloading { set, deepest: d, top, power, capped: false })
    }

    /// Depth from which on the loading curve cuts off an unloading branch, m: its deepest point where it never does.
    fn crossing(&self, u: &Unloading) -> f64 {
        let line = u.top / (u.deepest - u.set);
        if !u.capped || self.loading(u.deepest).1 <= line {
            return u.deepest;
        }
        // the loading curve less the line is convex and falls from the set to the root: Newton from the left
        let mut x = u.set;
        if x <= 0.0 {
            return 0.0;
        }
        for _ in 0..60 {
            let (f, slope) = self.loading(x);
            let step = (f - u.force(x)) / (line - slope);
            x += step;
            if step.abs() <= 1e-15 * u.deepest {
                break;
            }
        }
        x
    }

    /// Permanent set after a deepest penetration `d`, m.
    #[inline]
    pub fn permanent_set(&self, d: f64) -> f64 {
        self.unloading(d).map_or(0.0, |u| u.set)
    }

    /// (force, slope) of the branch at `x` > 0 with deepest `d` >= x; None below the permanent set.
    #[inline]
    fn branch(&self, x: f64, d: f64) -> Option<(f64, f64)> {
        if x < d {
            if let Some(u) = self.unloading(d) {
                if x <= u.set {
                    return None;
                }
                let f = u.force(x);
                if u.capped {
                    let l = self.loading(x);
                    if l.0 < f {
                        return Some(l);
                    }
                }
                return Some((f, u.power * f / (x - u.set)));
            }
        }
        Some(self.loading(x))
    }

    /// (force, slope) of the second layer.
    #[inline]
    fn second_layer(&self, x: f64) -> (f64, f64) {
        if self.secondary_stiffness > 0.0 && x > self.secondary_depth {
            let (z, r) = (x - self.secondary_depth, self.secondary_exponent);
            if self.secondary_width > 0.0 {
                return (
                    self.secondary_stiffness * self.spread(z, r),
                    self.secondary_stiffness * r * self.spread(z, r - 1.0),
                );
            }
            let s = self.secondary_stiffness * pow(z, r);
            (s, r * s / z)
        } else {
            (0.0, 0.0)
        }
    }

    /// Mean of (z - o)^q, m^q, over the onsets o of the second layer, spread evenly over its width, at `z` > 0 m.
    fn spread(&self, z: f64, q: f64) -> f64 {
        let w = self.secondary_width;
        if w <= LEAST_WIDTH * z {
            return pow(z - 0.5 * w, q);
        }
        let past = if z > w { pow(z - w, q + 1.0) } else { 0.0 };
        (pow(z, q + 1.0) - past) / ((q + 1.0) * w)
    }

    /// ((force, slope) that has a potential, (force, d/dx, d/dv) that has none) of everything but adhesion,
    /// not clamped, at `x` > 0.
    #[inline]
    fn push(&self, m: &Memory, x: f64, v: f64, d: f64) -> ((f64, f64), (f64, f64, f64)) {
        let branch = self.branch(x, d);
        let (mut g, mut gx, mut gv) = (0.0, 0.0, 0.0);
        if let Some((b, bx)) = branch {
            if self.hysteresis_damping > 0.0 {
                let (p, o, mu) = (self.exponent, self.damping_exponent_offset, self.hysteresis_damping);
                let on_branch = self.plastic_damping_form == 1 && self.yields();
                let (c, cx) = if on_branch {
                    let w = mu / self.stiffness * pow(x, o);
                    (w * b, w * (bx + o * b / x))
                } else if o == 0.0 && !self.yields() {
                    let c = mu * (b / self.stiffness);
                    (c, p * c / x)
                } else {
                    let c = mu * pow(x, p + o);
                    (c, (p + o) * c / x)
                };
                let (thinned, steep) = thinning(v, self.hysteresis_thinning_speed);
                g += c * thinned * v;
                gx += cx * thinned * v;
                gv += c * steep;
            }
            if self.viscous_damping > 0.0 {
                let mut c = self.viscous_damping;
                let (thinned, steep) = thinning(v, self.viscous_thinning_speed);
                if x < self.viscous_ramp {
                    c *= x / self.viscous_ramp;
                    gx += self.viscous_damping / self.viscous_ramp * thinned * v;
                }
                g += c * thinned * v;
                gv += c * steep;
            }
        }
        if self.relaxation_stiffness > 0.0 {
            g += m.relaxation[0] + m.relaxation[1] + m.relaxation[2];
        }
        let (b, bx) = branch.unwrap_or((0.0, 0.0));
        let (s, sx) = self.second_layer(x);
        ((b + s, bx + sx), (g, gx, gv))
    }

    /// (x + e)/R of [`AdhesionForm::Growing`], below zero where no neck holds, and its d/dx, 1/m.
    #[inline]
    fn nearness(&self, m: &Memory, x: f64) -> (f64, f64) {
        let (anchor, r) = (m.deepest - m.released, self.adhesion_range);
        if x >= anchor || anchor <= 0.0 {
            (x / r, 1.0 / r)
        } else if x >= 0.0 {
            (x / r + 1.0 - x / anchor, 1.0 / r - 1.0 / anchor)
        } else {
            (x / r + 1.0, 1.0 / r)
        }
    }

    /// (pull >= 0, its d/dx) of adhesion.
    #[inline]
    fn pull(&self, m: &Memory, x: f64) -> (f64, f64) {
        let (fa, r) = (self.adhesion_force, self.adhesion_range);
        let leaving = self.adhesion_form == AdhesionForm::Leaving as i32;
        if leaving || self.adhesion_form == AdhesionForm::Neck as i32 {
            let anchor = m.deepest - m.released;
            if anchor <= 0.0 || x >= anchor || x <= -r {
                return (0.0, 0.0);
            }
            let build_up = if leaving { LEAVING_BUILD_UP * r } else { r };
            let e = exp(-(anchor - x) / build_up);
            let (f, fx) = (fa * (1.0 - e), -fa * e / build_up);
            if x >= 0.0 {
                if self.adhesion_depth > 0.0 {
                    let w = exp(-x / self.adhesion_depth);
                    (f * w, (fx - f / self.adhesion_depth) * w)
                } else {
                    (f, fx)
                }
            } else {
                let w = 1.0 + x / r;
                (f * w, fx * w + f / r)
            }
        } else if self.adhesion_form == AdhesionForm::Growing as i32 {
            let (near, slope) = self.nearness(m, x);
            if near <= 0.0 {
                return (0.0, 0.0);
            }
            let f = fa * pow(near, 0.5 * self.exponent);
            (f, 0.5 * self.exponent * f / near * slope)
        } else if self.adhesion_form == AdhesionForm::Reach as i32 {
            if x >= 0.0 {
                (fa, 0.0)
            } else if x > -r {
                (fa * (1.0 + x / r), fa / r)
            } else {
                (0.0, 0.0)
            }
        } else if x > 0.0 {
            let e = exp(-x / r);
            (fa * (1.0 - e), fa * e / r)
        } else {
            (0.0, 0.0)
        }
    }

    /// Contact force, N, at penetration `x` m and speed `v` m/s with the memory as of before this point:
    /// never tensile without adhesion.
    #[inline]
    pub fn force(&self, m: &Memory, x: f64, v: f64) -> f64 {
        let mut f = 0.0;
        if x > 0.0 {
            let (a, b) = self.push(m, x, v, if x > m.deepest { x } else { m.deepest });
            f = a.0 + b.0;
            if f < 0.0 {
                f = 0.0;
            }
        }
        if self.adhesion_force > 0.0 {
            f -= self.pull(m, x).0;
        }
        f
    }

    /// (dF/dx N/m, dF/dv N s/m) with the memory held; zero where the force is clamped.
    #[inline]
    pub fn derivatives(&self, m: &Memory, x: f64, v: f64) -> (f64, f64) {
        let (mut fx, mut fv) = (0.0, 0.0);
        if x > 0.0 {
            let (a, b) = self.push(m, x, v, if x > m.deepest { x } else { m.deepest });
            if a.0 + b.0 > 0.0 {
                fx = a.1 + b.1;
                fv = b.2;
            }
        }
        if self.adhesion_force > 0.0 {
            fx -= self.pull(m, x).1;
        }
        (fx, fv)
    }

    /// Power of x that the Maxwell branches hang on.
    #[inline]
    fn branch_power(&self) -> f64 {
        if self.relaxation_exponent > 0.0 {
            self.relaxation_exponent
        } else {
            self.exponent
        }
    }

    /// The memory as it is while (`x`, `v`) is tried, m and m/s, from (`x0`, `v0`), no time having gone by: the
    /// Maxwell branches carry the move as the springs they are at that instant.
    #[inline]
    pub fn tried(&self, m: &Memory, from: (f64, f64), to: (f64, f64)) -> Memory {
        if self.relaxation_stiffness > 0.0 {
            self.advance(m, from.0, from.1, to.0, to.1, 0.0)
        } else {
            *m
        }
    }

    /// Whether anything pushes at (`x` m, `v` m/s): the surfaces meet and the force is not clamped.
    #[inline]
    pub fn pushes(&self, m: &Memory, x: f64, v: f64) -> bool {
        if x <= 0.0 {
            return false;
        }
        let (a, b) = self.push(m, x, v, if x > m.deepest { x } else { m.deepest });
        a.0 + b.0 > 0.0
    }

    /// Slope of the Maxwell branches at that instant, N/m.
    #[inline]
    pub fn relaxation_slope(&self, x: f64) -> f64 {
        if self.relaxation_stiffness > 0.0 {
            self.relaxation_rates(&Memory::default(), x, 1.0).iter().sum()
        } else {
            0.0
        }
    }

    /// Relaxation times of the branches, s.
    #[inline]
    pub fn relaxation_times(&self) -> [f64; BRANCHES] {
        if self.relaxation_spread > 0.0 {
            let q = pow(10.0, self.relaxation_spread);
            [self.relaxation_time / q, self.relaxation_time, self.relaxation_time * q]
        } else {
            [self.relaxation_time; BRANCHES]
        }
    }

    /// Rates of the branch forces, N/s, for a host that carries them as states: f' = (kr/3) d(x^q)/dt - f/tau.
    #[inline]
    pub fn relaxation_rates(&self, m: &Memory, x: f64, v: f64) -> [f64; BRANCHES] {
        let q = self.branch_power();
        let g = if x > 0.0 { self.relaxation_stiffness / BRANCHES as f64 * q * pow(x, q - 1.0) * v } else { 0.0 };
        let t = self.relaxation_times();
        let mut r = [0.0; BRANCHES];
        for b in 0..BRANCHES {
            r[b] = g - m.relaxation[b] / t[b];
        }
        r
    }

    /// The memory after moving from (`x0`, `v0`) to (`x1`, `v1`) in `dt` seconds, x m and v m/s along straight
    /// lines. Branch forces follow the exact exponential of a drive that rises evenly from touch to the end of
    /// the step. Work counts the force along the way; see [`Parameters::stored_energy`] for what is stored.
    pub fn advance(&self, m: &Memory, x0: f64, v0: f64, x1: f64, v1: f64, dt: f64) -> Memory {
        let mut o = *m;
        if x1 > o.deepest {
            o.deepest = x1;
        }
        if self.relaxation_stiffness > 0.0 {
            self.relax(m, &mut o, x0, x1, dt);
        }
        if self.adhesion_force > 0.0 {
            let mut anchor = m.deepest - m.released;
            if x1 <= -self.adhesion_range {
                anchor = 0.0;
            } else if x1 > anchor {
                anchor = x1;
            }
            o.released = o.deepest - anchor;
        }
        if let Some((work, stored)) = self.plain_step((x0, v0), (x1, v1)) {
            o.work += work;
            o.stored = stored;
            return o;
        }
        o.work += self.work_of_step(m, &o, (x0, v0), (x1, v1));
        o.stored = self.stored_energy(&o, x1);
        o
    }

    /// Updates the branch forces over a step.
    fn relax(&self, m: &Memory, o: &mut Memory, x0: f64, x1: f64, dt: f64) {
        if x1 <= 0.0 {
            o.relaxation = [0.0; BRANCHES];
            return;
        }
        let q = self.branch_power();
        // in contact only from where the surface is crossed
        let (z0, t, held) =
            if x0 > 0.0 { (pow(x0, q), dt, m.relaxation) } else { (0.0, dt * x1 / (x1 - x0), [0.0; 3]) };
        let df = self.relaxation_stiffness / BRANCHES as f64 * (pow(x1, q) - z0);
        let times = self.relaxation_times();
        for b in 0..BRANCHES {
            let z = if t > 0.0 { t / times[b] } else { 0.0 };
            let a = exp(-z);
            // mean of the exponential over the step; its series where 1 - a cancels
            let mean = if z > 1e-3 { (1.0 - a) / z } else { 1.0 - z * (0.5 - z * (1.0 / 6.0 - z / 24.0)) };
            o.relaxation[b] = held[b] * a + df * mean;
        }
    }
}
