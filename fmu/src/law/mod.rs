//! The contact law: pure physics, no I/O, no allocation, no clock.
//!
//! Invariant: nothing here logs, allocates or reads time; memory of the law is explicit
//! [`Memory`], passed in and handed back.

pub mod elementary;

/// Parameters of the contact law, plain SI. [`Parameters::default`] holds a purely elastic
/// element with every further mechanism neutral.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Stiffness k of F = k x^p, N/m^p, > 0.
    pub stiffness: f64,
    /// Exponent p, 1..=4.
    pub exponent: f64,
    /// Hysteresis damping mu_d of mu_d x^(p+o) v, N s/m^(p+o+1), >= 0 (Lankarani and Nikravesh 1990).
    pub hysteresis_damping: f64,
    /// Offset o of the damping's power of x from p: 0 Hunt and Crossley 1975; -1 Kuwabara and Kono 1987; -p/2-ish Tsuji 1992.
    pub damping_exponent_offset: f64,
    /// Kelvin-Voigt damping c, N s/m (Ahn and Ryu 2005, eq. 1).
    pub viscous_damping: f64,
    /// Depth over which the viscous damping ramps in linearly, m; 0: from first touch.
    pub viscous_ramp: f64,
    /// Plastic indentation: penetration at first yield, m; 0 or infinite: never.
    pub yield_penetration: f64,
    /// Permanent set per metre of deepest penetration beyond yield, 0..1; 0: neutral. The unloading
    /// curve is steeper so that it meets the loading curve at the deepest point.
    pub plastic_ratio: f64,
    /// Pull-off force of adhesion, N, >= 0.
    pub adhesion_force: f64,
    /// Range of the adhesive pull, m.
    pub adhesion_range: f64,
    /// Stiffness of the Maxwell branch, N/m^p, >= 0.
    pub relaxation_stiffness: f64,
    /// Relaxation time of the Maxwell branch, s.
    pub relaxation_time: f64,
    /// Stiffness of the second layer, N/m^p2, >= 0.
    pub secondary_stiffness: f64,
    /// Depth from which the second layer acts, m.
    pub secondary_depth: f64,
    /// Exponent of the second layer.
    pub secondary_exponent: f64,
}

/// Memory of the law.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Memory {
    /// Deepest penetration so far, m.
    pub deepest: f64,
    /// Force held by the Maxwell branch, N.
    pub relaxation_force: f64,
}
