//! A user's own simulation of a machine, as the forward model drives it: what there is to know of it, and how it steps.

use crate::rig::Line;
use anyhow::Result;
use law::Parameters;
use mechanisms::physics::FREE;
use std::fmt::Debug;
use std::sync::Arc;

/// A quantity that changes straight with the free variables.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Along {
    /// Where the system file has them.
    pub at: f64,
    /// Its change with each.
    pub slopes: [f64; FREE],
}

impl Along {
    /// Its value where the free variables are `free` away.
    pub fn of(&self, free: &[f64; FREE]) -> f64 {
        self.at + self.slopes.iter().zip(free).map(|(s, f)| s * f).sum::<f64>()
    }
}

/// Range of exponents of a law that a contact of FMUs nearly follows.
const EXPONENTS: (f64, f64) = (0.2, 6.0);

/// The law that a contact of FMUs nearly follows: F = k x^p (1 + r v).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NearLaw {
    /// ln k, k in N/m^p.
    pub stiffness: Along,
    /// p, which every variable changes by a factor.
    pub exponent: Along,
    /// r, s/m; where it is above zero, every variable changes it by a factor.
    pub damping: Along,
    /// Which of the variables are measured straight; the others by their logarithm.
    pub straight: [bool; FREE],
}

impl NearLaw {
    /// The law where the free variables are `free` away.
    pub fn of(&self, free: &[f64; FREE]) -> Parameters {
        let k = self.stiffness.of(free).exp();
        let at = self.damping.at;
        // a coefficient k r that stays, and a ratio r that does, are both straight in ln
        let r = if at > 0.0 {
            at * (0..FREE).map(|i| self.damped(i, free[i])).product::<f64>()
        } else {
            self.damping.of(free).max(0.0)
        };
        let p = self.exponent.at * (0..FREE).map(|i| self.bent(i, free[i])).product::<f64>();
        Parameters::power_law(k, p.clamp(EXPONENTS.0, EXPONENTS.1), k * r)
    }

    /// Factor by which variable `i`, `away` from where the system file has it, changes p.
    pub fn bent(&self, i: usize, away: f64) -> f64 {
        self.factor(&self.exponent, i, away)
    }

    /// How far variable `i` has to be away to change p by `factor`.
    pub fn bent_by(&self, i: usize, factor: f64) -> f64 {
        self.away(&self.exponent, i, factor)
    }

    /// Factor by which variable `i`, `away` from where the system file has it, changes r, which is above zero there.
    pub fn damped(&self, i: usize, away: f64) -> f64 {
        self.factor(&self.damping, i, away)
    }

    /// How far variable `i` has to be away to change r, which is above zero, by `factor`.
    pub fn damped_by(&self, i: usize, factor: f64) -> f64 {
        self.away(&self.damping, i, factor)
    }

    fn factor(&self, of: &Along, i: usize, away: f64) -> f64 {
        let change = of.slopes[i] / of.at * away;
        if self.straight[i] {
            (1.0 + change).max(0.0)
        } else {
            change.exp()
        }
    }

    fn away(&self, of: &Along, i: usize, factor: f64) -> f64 {
        let change = if self.straight[i] { factor - 1.0 } else { factor.ln() };
        change * of.at / of.slopes[i]
    }
}

/// A bond: a force, and the motion that it acts on.
#[derive(Clone, Debug, PartialEq)]
pub struct BondFacts {
    pub name: String,
    /// Whether physics of a contact may be missing here; else that of a body alone.
    pub is_contact: bool,
    /// Whether the model takes a force here.
    pub takes_force: bool,
    /// Whether the input takes forces into the stop; else those out of it.
    pub turned: bool,
    /// Whether the contact acts inside the FMU; else the force it is given is all there is.
    pub inside: bool,
    /// Whether the force of that contact is reported.
    pub reported: bool,
    /// Whether another FMU gives a force here that is no contact's.
    pub fed: bool,
    /// ln of the mass that a force here moves at once, kg.
    pub mass: Along,
    /// How the force on the body in flight falls with its position, N/m, and its speed, N s/m, nearly.
    pub spring: (f64, f64),
    /// The law of its contact; None where nothing touches.
    pub law: Option<NearLaw>,
}

/// What a recorded channel reads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reads {
    /// The same quantity of that bond: its contact's force, its acceleration, its penetration.
    Bond(usize),
    /// Something else that the FMUs report.
    Output,
}

/// How a variable that calibration may move is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeFacts {
    /// `fmu.variable`.
    pub name: String,
    pub unit: String,
    /// Where the system file has it.
    pub nominal: f64,
    /// Whether it goes by its logarithm; else straight, in parts of `size`.
    pub by_logarithm: bool,
    pub size: f64,
    /// Least and largest value.
    pub bounds: (f64, f64),
    /// Relative standard deviation, where it has a tolerance.
    pub tolerance: Option<f64>,
}

impl FreeFacts {
    /// Its value, in its unit, where it is `away`.
    pub fn value(&self, away: f64) -> f64 {
        let v = if self.by_logarithm { self.nominal * away.exp() } else { self.nominal + self.size * away };
        v.clamp(self.bounds.0, self.bounds.1)
    }

    /// How far `value` is away.
    pub fn away(&self, value: f64) -> f64 {
        if self.by_logarithm {
            (value / self.nominal).ln()
        } else {
            (value - self.nominal) / self.size
        }
    }
}

/// The first impact of a recording as the FMUs have it where nothing is changed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Impact {
    /// s from the start of the simulation to the touch.
    pub touch: f64,
    /// m/s.
    pub speed: f64,
    /// m.
    pub depth: f64,
    /// s to the first largest reading of each channel from the start; NaN where it has none.
    pub peaks: [f64; 3],
}

/// What there is to know of a machine.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    pub bonds: Vec<BondFacts>,
    pub free: Vec<FreeFacts>,
    /// By channel, where it is recorded.
    pub channels: [Option<Reads>; 3],
    /// Gravity along the motion, m/s^2.
    pub gravity: f64,
    /// First impacts, by recording.
    pub impacts: Vec<Option<Impact>>,
    /// The step that its FMUs need, s, where they take no other.
    pub fixed_step: Option<f64>,
    /// What was noticed.
    pub notes: Vec<String>,
}

impl Facts {
    /// Whether any bond takes a force.
    pub fn takes_force(&self) -> bool {
        self.bonds.iter().any(|b| b.takes_force)
    }
}

/// Force into a bond over a step, against the motion into the stop.
#[derive(Clone, Copy, Debug, Default)]
pub struct Push {
    /// N at the start of the step, with the impulse and the moment that it has to have over it.
    pub start: f64,
    /// N/s.
    pub slope: f64,
    /// N that acts at the end of the step.
    pub end: f64,
}

/// A machine under way in one recording.
pub trait Running {
    /// Steps what moves over `h` s, with a push into every bond.
    ///
    /// # Errors
    /// What an FMU refuses: its name, the call, and why.
    fn advance(&mut self, h: f64, pushes: &[Push]) -> Result<()>;

    /// Penetration m and its rate m/s at a bond.
    fn motion(&self, bond: usize) -> (f64, f64);

    /// Steps what follows the motion over the same time, the faces of the bonds at these penetrations m and rates m/s.
    ///
    /// # Errors
    /// As [`Running::advance`].
    fn follow(&mut self, faces: &[(f64, f64)]) -> Result<()>;

    /// Force that the contact of a bond is reported to have, N.
    fn contact(&self, bond: usize) -> f64;

    /// The output of a channel, SI; NaN where the channel has none.
    fn output(&self, channel: usize) -> f64;
}

/// A user's simulation of a machine. Threads run it each for themselves.
pub trait Machine: Send + Sync + Debug {
    /// What there is to know of it.
    fn facts(&self) -> &Facts;

    /// Starts recording `set` with the free variables `free` away, and hands it to `with`.
    ///
    /// # Errors
    /// What an FMU refuses, or what `with` does.
    fn run(&self, set: usize, free: &[f64; FREE], with: &mut dyn FnMut(&mut dyn Running) -> Result<()>) -> Result<()>;

    /// Keeps what an FMU has refused in the middle of a fit.
    fn keep_trouble(&self, what: &anyhow::Error);

    /// What FMUs have refused so far, each once.
    fn troubles(&self) -> Vec<String>;
}

/// A machine in one recording.
#[derive(Clone, Debug)]
pub struct Seat {
    pub machine: Arc<dyn Machine>,
    /// The recording, in the machine's order.
    pub set: usize,
    /// How often the steps of the coupling are halved.
    pub level: u32,
}

/// A mean over a stretch of time that is extrapolated along the last two.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Extrapolated {
    last: Option<(f64, f64)>,
    pub line: Line,
}

impl Extrapolated {
    /// Takes the mean `at` over a stretch about `t` s.
    pub fn take(&mut self, t: f64, at: f64) {
        let slope = match self.last {
            Some((u, before)) if t > u => (at - before) / (t - u),
            _ => 0.0,
        };
        self.last = Some((t, at));
        self.line = Line { t, at, slope };
    }

    /// Begins anew at `t` s from `at`.
    pub fn anew(&mut self, t: f64, at: f64) {
        self.last = None;
        self.line = Line { t, at, slope: 0.0 };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_damping_coefficient_measured_straight_falls_to_nothing_and_a_stiffness_takes_its_ratio_along() {
        let mut law = NearLaw { damping: Along { at: 0.25, ..Along::default() }, ..NearLaw::default() };
        law.stiffness = Along { at: 16.0, ..Along::default() };
        law.exponent = Along { at: 1.3, ..Along::default() };
        // variable 0: stiffness by its logarithm, the coefficient staying; 1: the coefficient, straight
        (law.stiffness.slopes[0], law.damping.slopes[0]) = (1.0, -0.25);
        (law.damping.slopes[1], law.straight[1]) = (0.25, true);
        let mut free = [0.0; FREE];
        (free[0], free[1]) = (-2.0, -0.9);
        let p = law.of(&free);
        let mu = 0.25 * 16f64.exp();
        assert!((p.hysteresis_damping.coefficient / (0.1 * mu) - 1.0).abs() < 1e-12, "{p:?}");
        free[1] = -1.5;
        assert_eq!(law.of(&free).hysteresis_damping.coefficient, 0.0);
    }
}
