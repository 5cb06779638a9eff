//! Masses that ride on the body: carried along, let go, striking or swinging.

use super::{Rig, State};
use crate::setup::Setup;
use mechanisms::physics::{Physics, Rider};
use record::Kind;

/// A riding mass in the state of the rig.
#[derive(Clone, Copy)]
pub(super) struct Riding {
    pub rider: Rider,
    /// Place of its position in the state; its speed is next.
    pub at: usize,
    /// Whether it is still carried along as one with the body.
    pub carried: bool,
}

impl Riding {
    /// A mass whose state begins at `at`.
    pub fn new(rider: Rider, at: usize, s: &Setup) -> Riding {
        // a body that a spring sets in motion from rest carries what sits in it
        Riding { rider, at, carried: rider.seat.is_some() && s.kind == Kind::ContactorOpening }
    }

    /// Its force on the body along +x, N.
    #[inline]
    pub fn force(&self, p: &Physics, y: &State) -> f64 {
        (self.rider.force)(p, y[self.at] - y[0], y[self.at + 1] - y[1])
    }

    /// Its weight where the body bears it, N.
    #[inline]
    pub fn borne(&self, p: &Physics) -> f64 {
        if self.rider.borne {
            self.rider.mass * p.gravity
        } else {
            0.0
        }
    }

    /// Way to the nearest wall it may strike, m; None where it strikes none or is carried.
    pub fn play(&self, p: &Physics, y: &State) -> Option<f64> {
        let play = (self.rider.play)(p, y[self.at] - y[0]);
        (!self.carried && play.is_finite()).then_some(play)
    }
}

impl Rig<'_> {
    /// Turns the rig into that of the approach, which is computed backwards from touch: no contact there, and what
    /// hangs on a spring moves with the body.
    pub(crate) fn approaching(mut self) -> Self {
        self.contact = false;
        for r in self.riders.iter_mut().flatten() {
            r.carried |= r.rider.seat.is_none();
        }
        self
    }

    /// Puts masses whose weight the body bears where a flight of `time` s has brought them: both leave the first
    /// sample together, and the body, heavier than its inertia, falls faster.
    pub(crate) fn fall_apart(&self, time: f64, y: &mut State) {
        for r in self.riders.iter().flatten().filter(|r| r.rider.borne) {
            let a = self.p.gravity * r.rider.mass / self.body_mass;
            y[r.at] -= 0.5 * a * time * time;
            y[r.at + 1] -= a * time;
        }
    }

    /// Lets masses go that have been carried along, where the stop (face at `x` m) or whatever else slows the body: each
    /// is pressed against its seat as hard as it was carried. Whether any was let go.
    pub(super) fn let_go(&mut self, t: f64, x: f64, y: &mut State) -> bool {
        if !self.contact || !self.riders.iter().flatten().any(|r| r.carried) {
            return false;
        }
        let driving = self.motion_force(t, y[0], y[1]);
        if x < 0.0 && driving > 0.0 {
            return false;
        }
        for r in self.riders.iter_mut().flatten().filter(|r| r.carried) {
            if let Some(stiffness) = r.rider.seat {
                y[r.at] -= r.rider.mass / self.p.mass * driving.max(0.0) / stiffness;
            }
            r.carried = false;
        }
        true
    }
}
