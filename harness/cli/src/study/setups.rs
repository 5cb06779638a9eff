//! The impacts and the masters of the coupling study.

use host::master::{Inputs, Method, Shape};
use serde::Serialize;

/// An impact to repeat: k, p, mu, kg, m/s.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Case {
    /// Name.
    pub name: &'static str,
    /// k, N/m^p.
    pub stiffness: f64,
    /// p.
    pub exponent: f64,
    /// mu_d, N s/m^(p+1).
    pub damping: f64,
    /// kg.
    pub mass: f64,
    /// m/s.
    pub speed: f64,
}

/// The impacts of the study: the paper's two laws, Hertz's and a bare spring.
pub const CASES: [Case; 4] = [
    Case { name: "estimated, p = 2.79", stiffness: 3.51e10, exponent: 2.79, damping: 2.70e10, mass: 1.0, speed: 1.0 },
    Case { name: "initial, p = 1.96", stiffness: 1.85e8, exponent: 1.96, damping: 8.77e7, mass: 1.0, speed: 1.0 },
    Case { name: "Hertz, p = 1.5", stiffness: 1e9, exponent: 1.5, damping: 2e8, mass: 0.5, speed: 0.3 },
    Case { name: "spring, p = 1", stiffness: 2.27e6, exponent: 1.0, damping: 0.0, mass: 0.509, speed: 0.313 },
];

/// Phases of a macro-step on which the touch falls.
pub const PHASES: usize = 8;

/// A master as the study sets it.
#[derive(Clone, Debug)]
pub struct Setup {
    /// Name.
    pub name: &'static str,
    /// Method, inputs, shape.
    pub method: Method,
    /// For explicit masters.
    pub inputs: Inputs,
    /// For the others.
    pub shape: Shape,
    /// Lookahead in macro-steps.
    pub lookahead: f64,
    /// Whether touch is located.
    pub located: bool,
    /// Whether the step adapts, and how; the tolerance then stands in for the number of steps.
    pub adapts: Option<Adapts>,
}

/// How a step adapts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Adapts {
    /// By the bond's energy.
    Energy,
    /// By doubling.
    Doubling,
}

/// The masters of the study.
pub fn setups() -> Vec<Setup> {
    use Inputs::{Extrapolated, Held};
    use Method::{GaussSeidel, Implicit, Iterated, Jacobi};
    let explicit = |name, method, inputs, lookahead, located| Setup {
        name,
        method,
        inputs,
        shape: Shape::Linear,
        lookahead,
        located,
        adapts: None,
    };
    let solved = |name, method, shape, located| Setup {
        name,
        method,
        inputs: Held,
        shape,
        lookahead: 0.0,
        located,
        adapts: None,
    };
    vec![
        explicit("Gauss-Seidel, held", GaussSeidel, Held, 0.0, false),
        explicit("Gauss-Seidel, held, lookahead 0.5", GaussSeidel, Held, 0.5, false),
        explicit("Gauss-Seidel, held, lookahead 0.5, touch located", GaussSeidel, Held, 0.5, true),
        explicit("Gauss-Seidel, extrapolated", GaussSeidel, Extrapolated, 0.0, false),
        explicit("Gauss-Seidel, extrapolated, touch located", GaussSeidel, Extrapolated, 0.0, true),
        explicit("Jacobi, held", Jacobi, Held, 0.0, false),
        explicit("Jacobi, held, lookahead 1.5", Jacobi, Held, 1.5, false),
        explicit("Jacobi, extrapolated", Jacobi, Extrapolated, 0.0, false),
        solved("linearly implicit, mean, touch located", Implicit, Shape::Mean, true),
        solved("iterated, straight line, touch located", Iterated, Shape::Linear, true),
        solved("iterated, cubic, touch located", Iterated, Shape::Cubic, true),
        Setup {
            adapts: Some(Adapts::Energy),
            ..explicit(
                "Gauss-Seidel, lookahead 0.5, touch located, step by energy (ECCO)",
                GaussSeidel,
                Held,
                0.5,
                true,
            )
        },
        Setup {
            adapts: Some(Adapts::Doubling),
            ..solved("iterated, cubic, touch located, step by doubling", Iterated, Shape::Cubic, true)
        },
    ]
}
