//! What the forward model has to know of one recording.

use crate::integrate::Control;
use crate::machine::Seat;
use mechanisms::load_history::LoadHistory;
use mechanisms::part::Motion;
use mechanisms::physics::Physics;
use record::Kind;

/// Error per step, relative to depth and speed of the impact, where it counts.
pub const TOLERANCE: f64 = 1e-7;
/// The same where a body bounces: every bounce grows what the steps before it leave, and chi^2 is to be smooth.
const BOUNCING: f64 = 1e-10;
/// The same where a fit has only to come near.
pub const COARSE: f64 = 3e-6;

/// Error per step where it counts, of a recording of `kind`.
pub fn tolerance(kind: Kind) -> f64 {
    if kind.starts_driven() {
        BOUNCING
    } else {
        TOLERANCE
    }
}

/// What the model has to know of one recording, SI.
#[derive(Clone, Debug)]
pub struct Setup {
    pub kind: Kind,
    /// Sample times on the recording's own clock, s.
    pub time: Vec<f64>,
    /// When the recording began, s: where a speed at its first sample was measured. Counts where it lies before `time`.
    pub began: f64,
    /// Load the contact had taken before.
    pub history: LoadHistory,
    /// Contactor: distance from rest to the stop m, preload N, rate N/m.
    pub travel: f64,
    pub preload: f64,
    pub rate: f64,
    /// Indentation: the penetration imposed, m, and its rate, m/s.
    pub imposed: Vec<f64>,
    pub imposed_rate: Vec<f64>,
    /// Sizes for error control: depth m, speed m/s, duration of contact s.
    pub depth: f64,
    pub speed: f64,
    pub duration: f64,
    /// What simulates the recording in place of a rig of ours.
    pub machine: Option<Seat>,
    /// How the motion is integrated; errors are relative to depth and speed of the impact.
    pub control: Control,
}

impl Setup {
    /// Force of the rig's own return spring on the body along +x, N, at the position `x` m; none in a drop test.
    #[inline]
    pub fn drive(&self, x: f64) -> f64 {
        if self.kind == Kind::ContactorOpening {
            self.preload - self.rate * (x + self.travel)
        } else {
            0.0
        }
    }

    /// When the recording began, s: its first sample at the latest.
    pub fn beginning(&self) -> f64 {
        self.began.min(self.time[0])
    }

    /// Forces on the body along +x other than contact and weight, N: the rig's own and those of all parts of `p`, at `t`
    /// s after release or touch, position `x` m, speed `v` m/s.
    #[inline]
    pub fn motion_force(&self, p: &Physics, t: f64, x: f64, v: f64) -> f64 {
        p.on_body(&self.motion(t, x, v), self.drive(x))
    }

    /// Where the body is, for the parts that act on it.
    #[inline]
    pub fn motion(&self, time: f64, x: f64, v: f64) -> Motion {
        Motion { time, x, v, travel: self.travel }
    }

    /// A drop test sampled at `time` s, of an impact of that depth m, speed m/s and duration s.
    pub fn drop_test(time: Vec<f64>, depth: f64, speed: f64, duration: f64) -> Setup {
        Setup {
            kind: Kind::DropTest,
            began: time.first().copied().unwrap_or(f64::INFINITY),
            time,
            history: LoadHistory::default(),
            travel: 0.0,
            preload: 0.0,
            rate: 0.0,
            imposed: Vec::new(),
            imposed_rate: Vec::new(),
            depth,
            speed,
            duration,
            machine: None,
            control: Control::dense(TOLERANCE),
        }
    }
}
