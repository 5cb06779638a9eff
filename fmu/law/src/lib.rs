//! The contact law: pure physics, no I/O, no allocation, no clock.
//!
//! Invariant: nothing here logs, allocates or reads time; the memory of the law is explicit
//! [`Memory`], passed in and handed back.
//!
//! F = max(0, branch(x) + dampers(x, v) + springs(x) + Maxwell forces) - adhesion + learned(x, v), at x > 0;
//! branch(x) is k x^p, or the plastic unloading curve. What was learned may pull. Below the permanent set nothing
//! touches, so no damper acts there. Maxwell forces vanish where the body leaves the nominal surface (x <= 0).
//! Dampers and springs are those of the [`parts`], each a file that declares (see [`part`]) all that the FMU,
//! scenarios and the diagnosis have to know of it.

pub mod body;
pub mod elementary;
mod energy;
pub mod impact;
pub mod learned;
pub mod part;
pub mod parts;
mod power_law;
pub mod reference;
pub mod restitution;
mod step;
pub mod stiffness;
#[cfg(test)]
mod tests;

use part::{Point, Step};
pub use parts::{AdhesionForm, ParameterError, Parameters, PlasticForm};
pub use power_law::Reached;

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

    /// Whether every number in it is finite.
    pub fn is_finite(&self) -> bool {
        let energies = self.work.is_finite() && self.stored.is_finite() && self.dissipated().is_finite();
        energies
            && self.deepest.is_finite()
            && self.released.is_finite()
            && self.relaxation.iter().all(|f| f.is_finite())
    }
}

impl Parameters {
    /// ((force, slope) that has a potential, (force, d/dx, d/dv) that has none) of everything but adhesion,
    /// not clamped, at `x` > 0.
    #[inline]
    fn push(&self, m: &Memory, x: f64, v: f64, d: f64) -> ((f64, f64), (f64, f64, f64)) {
        let branch = self.branch(x, d);
        let mut damping = match branch {
            Some(branch) => self.dampers(&Point { law: self, x, v, branch }),
            None => (0.0, 0.0, 0.0),
        };
        if self.relaxes() {
            damping.0 += m.relaxation[0] + m.relaxation[1] + m.relaxation[2];
        }
        (self.springs(branch.unwrap_or((0.0, 0.0)), x), damping)
    }

    /// Whether the force depends on more than where the contact is and how fast: on what came before.
    pub fn remembers(&self) -> bool {
        self.relaxes() || self.plastic_indentation.yields() || self.adhesion.force > 0.0
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
        if self.adhesion.force > 0.0 {
            f -= self.adhesion.pull(self.elastic.exponent, m, x).0;
        }
        if self.learned_law.acts() {
            f += self.learned_law.force(x, v);
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
        if self.adhesion.force > 0.0 {
            fx -= self.adhesion.pull(self.elastic.exponent, m, x).1;
        }
        if self.learned_law.acts() {
            let (by_x, by_v) = self.learned_law.slopes(x, v);
            fx += by_x;
            fv += by_v;
        }
        (fx, fv)
    }

    /// Whether anything pushes at (`x` m, `v` m/s): the surfaces meet and the force is not clamped.
    #[inline]
    pub fn pushes(&self, m: &Memory, x: f64, v: f64) -> bool {
        if x <= 0.0 {
            return false;
        }
        if self.learned_law.acts() {
            return true;
        }
        let (a, b) = self.push(m, x, v, if x > m.deepest { x } else { m.deepest });
        a.0 + b.0 > 0.0
    }

    /// As [`Parameters::advance`], without the energies: as much as the force goes by.
    pub fn remembered(&self, m: &Memory, x0: f64, x1: f64, dt: f64) -> Memory {
        let mut o = *m;
        if x1 > o.deepest {
            o.deepest = x1;
        }
        self.remember(&Step { law: self, before: m, x0, x1, dt }, &mut o);
        o
    }

    /// The memory after moving from (`x0`, `v0`) to (`x1`, `v1`) in `dt` seconds, x m and v m/s along straight
    /// lines. Branch forces follow the exact exponential of a drive that rises evenly from touch to the end of
    /// the step. Work counts the force along the way; see [`Parameters::stored_energy`] for what is stored.
    pub fn advance(&self, m: &Memory, x0: f64, v0: f64, x1: f64, v1: f64, dt: f64) -> Memory {
        let mut o = self.remembered(m, x0, x1, dt);
        if let Some((work, stored)) = self.plain_step((x0, v0), (x1, v1)) {
            o.work += work;
            o.stored = stored;
            return o;
        }
        o.work += self.work_of_step(m, &o, (x0, v0), (x1, v1));
        o.stored = self.stored_energy(&o, x1);
        o
    }
}
