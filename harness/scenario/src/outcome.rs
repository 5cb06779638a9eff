//! What a simulation comes to: rows, impacts, events, energy balance.

use super::rig::State;
use serde::Serialize;

/// One accepted step.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Time, s.
    pub time: f64,
    /// State: position m and velocity m/s of tip, body, accelerometer (one body: the first pair), then
    /// [`super::Places`].
    pub state: State,
    /// Contact force, N, positive in compression.
    pub force: f64,
    /// Energy stored in the contact, J; NaN where the element does not report it.
    pub stored: f64,
    /// Energy the contact has turned into heat, J; NaN where the element does not report it.
    pub dissipated: f64,
    /// Kinetic energy, J.
    pub kinetic: f64,
    /// Energy in weight, return spring and sensors' springs, J, zero with every position at zero.
    pub potential: f64,
}

/// One impact. With three bodies speeds are those of the centre of mass, and the tip may touch several times.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Bounce {
    /// Time of touch, s.
    pub touch: f64,
    /// Speed at touch, m/s.
    pub impact_speed: f64,
    /// Deepest penetration, m.
    pub deepest: f64,
    /// Largest contact force, N.
    pub peak_force: f64,
    /// Time of it, s.
    pub peak_time: f64,
    /// Time at which the body last left the nominal surface, s; absent where it has not.
    pub separation: Option<f64>,
    /// Time at which the force last fell to nothing with the body still inside, s; absent where it did not.
    pub force_ends: Option<f64>,
    /// From touch to separation, s.
    pub duration: f64,
    /// Speed of leaving over speed of touch.
    pub restitution: f64,
    /// Kinetic energy lost (of the centre of mass), J.
    pub energy_lost: f64,
    /// Impulse of the contact force, N s.
    pub impulse: f64,
    /// How often the tip touched.
    pub touches: usize,
    /// Height of the rebound after it, m; absent where the simulation ended before.
    pub rebound_height: Option<f64>,
    /// The exact impact, and how far this one is from it; absent where the exact one is not known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exact: Option<Exact>,
}

/// Something that happened.
#[derive(Clone, Debug, Serialize)]
pub struct Event {
    /// Time, s.
    pub time: f64,
    /// Which mass: tip, body, accelerometer or centre (of mass).
    pub mass: &'static str,
    /// touch and separation (of a mass other than the tip: it passes where it stood at touch), deepest, top,
    /// peak_force, force_ends, force_returns, interrupter.
    pub what: &'static str,
    /// Position of that mass, m.
    pub position: f64,
    /// Its velocity, m/s.
    pub velocity: f64,
}

/// How well energy is kept: the largest departure of kinetic + potential + stored + dissipated + heat elsewhere
/// from its first value, over the largest kinetic energy or contact work.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Balance {
    /// That largest energy, J.
    pub scale: f64,
    /// With the energies the element reports; absent where it reports none.
    pub residual: Option<f64>,
    /// With the contact's work integrated along the motion instead.
    pub residual_of_motion: f64,
    /// Work against guide friction and what else acts on the way, and heat in sensors' dampers, at the end, J.
    pub heat_outside_contact: f64,
    /// Work done against the holding force at the end, J.
    pub work_against_holding: f64,
}

/// Where a simulation stands, for its progress.
pub struct Moment {
    /// Time, s.
    pub time: f64,
    /// Impacts so far.
    pub impacts: usize,
    /// Accepted steps so far.
    pub steps: usize,
}

/// What a case came to.
pub struct Outcome {
    /// Accepted steps.
    pub rows: Vec<Row>,
    /// Impacts in order.
    pub bounces: Vec<Bounce>,
    /// What happened, in order.
    pub events: Vec<Event>,
    /// Energy balance.
    pub balance: Balance,
    /// (time s, position m) of each photo interrupter passed on the way down.
    pub passages: Vec<(f64, f64)>,
    /// Whether it came to rest on the stop.
    pub at_rest: bool,
    /// Whether it was interrupted.
    pub interrupted: bool,
}

impl Balance {
    /// The balance with its residuals relative to its scale.
    pub fn relative(&self) -> Balance {
        let s = if self.scale > 0.0 { self.scale } else { 1.0 };
        Balance { residual: self.residual.map(|r| r / s), residual_of_motion: self.residual_of_motion / s, ..*self }
    }
}

/// The exact impact (law::impact), and the relative differences of the simulated one from it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Exact {
    /// Deepest penetration, m.
    pub deepest: f64,
    /// Restitution.
    pub restitution: f64,
    /// Largest force, N.
    pub peak_force: f64,
    /// Duration, s.
    pub duration: f64,
    /// Energy lost, J.
    pub energy_lost: f64,
    /// Impulse, N s.
    pub impulse: f64,
    /// Simulated over exact less one, in the order above; energy lost relative to the kinetic energy at touch.
    pub differences: [f64; 6],
}

impl Exact {
    /// The largest difference.
    pub fn worst(&self) -> f64 {
        self.differences.iter().fold(0.0, |a, d| a.max(d.abs()))
    }
}
