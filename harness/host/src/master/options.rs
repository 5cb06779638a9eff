//! How a network is stepped.

/// Who steps when, and how often.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// One after another in dependency order; those later see what those before have reached.
    GaussSeidel,
    /// All from the values of the last communication point.
    Jacobi,
    /// One Newton correction of what runs against the order, by directional derivatives where they are provided and by
    /// a tried step where not (Schweizer and Lu 2014, linearly implicit predictor-corrector).
    Implicit,
    /// Steps repeated from the saved state until what runs against the order agrees (Anderson 1965 accelerates).
    Iterated,
}

/// What an explicit master gives of inputs within a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inputs {
    /// The value at the step's start.
    Held,
    /// Along their derivative: as input derivatives where they are taken, else the value at mid-step.
    Extrapolated,
}

/// What [`Method::Implicit`] and [`Method::Iterated`] give of inputs within a step, from both its ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// Their mean, held: stable however stiff.
    Mean,
    /// The straight line, as an input derivative.
    Linear,
    /// The cubic through values and derivatives at both ends (Hermite), as derivatives up to the third; the straight
    /// line for a slave that takes less.
    Cubic,
}

/// How the step is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Adapt {
    /// By the energy that the power bonds create, PI-controlled (ECCO: Sadjina, Kyllingstad,
    /// Skjong and Pedersen 2017, Engineering with Computers 33, 607). Steps far
    /// beyond the tolerance are taken back where every slave can. Tolerance: share of the energy so far, a step.
    Energy {
        /// > 0.
        tolerance: f64,
        /// Energy, J, below which the bonds' own does not count as less, >= 0.
        floor: f64,
    },
    /// By the difference between a step and two of half its size, taken back where it is too large (Hairer, Norsett
    /// and Wanner 1993, II.4). Tolerance: share of each signal's largest value.
    Doubling {
        /// > 0.
        tolerance: f64,
    },
}

/// A signal whose passage through a level no step may straddle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Touch {
    /// Global output.
    pub output: usize,
    /// Level.
    pub level: f64,
}

/// A tunable time in s by which a slave looks ahead, kept at so many of the coming steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lookahead {
    /// Part.
    pub part: usize,
    /// Reference of the tunable.
    pub reference: u32,
    /// Steps.
    pub steps: f64,
}

/// A power bond: a force one way, a velocity the other.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Bond {
    /// Global output: the force.
    pub force: usize,
    /// Global output: the velocity, of the sign that force times velocity flows to the force's owner.
    pub velocity: usize,
    /// Where the other side reports the work done against the force: (part, reference).
    pub work: Option<(usize, u32)>,
    /// What of that work the force's owner reports as stored and dissipated: (part, reference) each.
    pub energy: Vec<(usize, u32)>,
}

/// How to step.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Master.
    pub method: Method,
    /// For the explicit masters.
    pub inputs: Inputs,
    /// For the others.
    pub shape: Shape,
    /// Start time, s.
    pub start: f64,
    /// End time, s.
    pub stop: f64,
    /// Macro-step, s, > 0; the first one where it adapts.
    pub step: f64,
    /// None: the step stays.
    pub adapt: Option<Adapt>,
    /// Least step an adaptive master goes down to, s.
    pub shortest: f64,
    /// Longest step an adaptive master goes up to, s.
    pub longest: f64,
    /// Touches to land on.
    pub touches: Vec<Touch>,
    /// Share of a step to which touches are found.
    pub touch_tolerance: f64,
    /// Lookaheads to keep.
    pub lookaheads: Vec<Lookahead>,
    /// Bonds to watch.
    pub bonds: Vec<Bond>,
    /// Share of each signal's largest value to which an iteration has to agree.
    pub tolerance: f64,
    /// Most iterations of a step.
    pub iterations: usize,
}

impl Default for Options {
    fn default() -> Self {
        Options {
            method: Method::GaussSeidel,
            inputs: Inputs::Held,
            shape: Shape::Cubic,
            start: 0.0,
            stop: 1.0,
            step: 1e-3,
            adapt: None,
            shortest: 0.0,
            longest: f64::INFINITY,
            touches: Vec::new(),
            touch_tolerance: 1e-10,
            lookaheads: Vec::new(),
            bonds: Vec::new(),
            tolerance: 1e-11,
            iterations: 60,
        }
    }
}

impl Options {
    /// Whether steps are taken back.
    pub fn needs_rollback(&self) -> bool {
        matches!(self.method, Method::Implicit | Method::Iterated)
            || matches!(self.adapt, Some(Adapt::Doubling { .. }))
            || !self.touches.is_empty()
    }

    /// Whether steps differ in size.
    pub fn needs_variable_step(&self) -> bool {
        self.adapt.is_some() || !self.touches.is_empty()
    }

    /// Whether derivatives of outputs are wanted.
    pub(super) fn needs_rates(&self) -> bool {
        match self.method {
            Method::GaussSeidel | Method::Jacobi => self.inputs == Inputs::Extrapolated,
            Method::Implicit => false,
            Method::Iterated => self.shape == Shape::Cubic,
        }
    }

    /// Order to which a step's error falls, for the control of the step.
    pub(super) fn order(&self) -> f64 {
        match self.method {
            Method::GaussSeidel | Method::Jacobi => {
                if self.inputs == Inputs::Extrapolated || !self.lookaheads.is_empty() {
                    2.0
                } else {
                    1.0
                }
            }
            Method::Implicit => 2.0,
            Method::Iterated => {
                if self.shape == Shape::Cubic {
                    4.0
                } else {
                    2.0
                }
            }
        }
    }
}
