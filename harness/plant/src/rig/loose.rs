//! The part loose inside the body: carried along, let go, striking.

use super::{Rig, State};

impl Rig<'_> {
    /// Weight of the loose part that the body bears, N.
    #[inline]
    pub(super) fn borne(&self) -> f64 {
        if self.p.loose_borne {
            self.p.loose_mass * self.p.gravity
        } else {
            0.0
        }
    }

    /// Puts the loose part where a flight of `time` s inside the body has brought it: both leave the first sample
    /// together, and the body, heavier than its inertia, falls faster.
    pub(crate) fn part_loose(&self, time: f64, y: &mut State) {
        if self.loose > 0 && self.p.loose_borne {
            let a = self.p.gravity * self.p.loose_mass / self.body_mass;
            y[self.loose] -= 0.5 * a * time * time;
            y[self.loose + 1] -= a * time;
        }
    }

    /// Force of the loose part on the body along +x, N: from the wall before it once the gap is closed, from the wall
    /// behind it, alike in stiffness and damping, once the play there is.
    #[inline]
    pub(super) fn loose_force(&self, y: &State) -> f64 {
        let z = y[self.loose] - y[0];
        let w = y[self.loose + 1] - y[1];
        let pushed = |e: f64, w: f64| {
            let come = if e < self.p.loose_ramp { e / self.p.loose_ramp } else { 1.0 };
            (self.p.loose_stiffness * e + come * self.p.loose_damping * w).max(0.0)
        };
        if z > self.p.loose_gap {
            pushed(z - self.p.loose_gap, w)
        } else if z < -self.p.loose_back {
            -pushed(-z - self.p.loose_back, -w)
        } else {
            0.0
        }
    }

    /// Way that the loose part has to the nearest wall, m; negative in contact with it.
    pub(super) fn loose_play(&self, y: &State) -> f64 {
        let z = y[self.loose] - y[0];
        (self.p.loose_gap - z).min(z + self.p.loose_back)
    }

    /// Lets the part go that has been carried along, where the stop (face at `x` m) or whatever else slows the body: it
    /// is pressed against the wall behind it as hard as it was carried. Whether it did.
    pub(super) fn let_loose(&mut self, t: f64, x: f64, y: &mut State) -> bool {
        let driving = self.motion_force(t, y[0], y[1]);
        if x < 0.0 && driving > 0.0 {
            return false;
        }
        y[self.loose] -= self.p.loose_mass / self.p.mass * driving.max(0.0) / self.p.loose_stiffness;
        self.carried = false;
        true
    }
}
