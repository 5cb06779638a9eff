//! A case's motion, with what a scenario integrates along with it and the photo interrupters it passes.

use super::plan::Case;
use super::rig::{Bodies, State as RowState};
use anyhow::Result;
use mechanisms::part::Part;
use mechanisms::physics::Physics;
use plant::integrate::{After, Crossing, Events, State, System, Taken, MAX};
use plant::motion::{Motion, EVENTS, SURFACE};
use plant::simulate::Setup;

/// Events from this number on: the photo interrupters, from the top.
pub(super) const INTERRUPTERS: usize = EVENTS;

/// A case's motion, observed: beside it work on the contact, work against the guide and what else acts on the way with
/// the heat in sensors, work against the holding force and impulse are integrated along, in this order; their error does
/// not count.
pub(super) struct Observed<'a> {
    case: &'a Case,
    /// The motion.
    pub(super) motion: Motion<'a>,
    setup: &'a Setup,
    /// What takes energy from the bodies on the way.
    physics: &'a Physics,
    /// Positions of the photo interrupters still looked for, m, from the top.
    marks: Vec<f64>,
}

impl<'a> Observed<'a> {
    pub(super) fn new(case: &'a Case, motion: Motion<'a>, setup: &'a Setup, physics: &'a Physics) -> Observed<'a> {
        let marks = case.interrupters.map_or(Vec::new(), |p| {
            (0..p.count).map(|j| -(p.last_to_touch + (p.count - 1 - j) as f64 * p.spacing)).collect()
        });
        Observed { case, motion, setup, physics, marks }
    }

    /// The state as a row has it.
    pub(super) fn row(&self, y: &State) -> RowState {
        let mut row = RowState::default();
        let mut i = 0;
        for (_, x, v) in self.motion.bodies(y).into_iter().flatten() {
            (row[i], row[i + 1]) = (x, v);
            i += 2;
        }
        let n = self.motion.dimension();
        row[i..i + 4].copy_from_slice(&y[n..n + 4]);
        row
    }

    /// Contact force at the rates of a state, N.
    pub(super) fn force(&self, dy: &State) -> f64 {
        dy[self.motion.dimension() + 3]
    }

    /// Power lost in the sensors' dampers, W.
    fn damped(&self, y: &State) -> f64 {
        let (Bodies::Three { accelerometer_spring: a, transducer: b, .. }, [Some(t), Some(m), Some(s)]) =
            (&self.case.rig.bodies, self.motion.bodies(y))
        else {
            return 0.0;
        };
        b.damping * (m.2 - t.2).powi(2) + a.damping * (m.2 - s.2).powi(2)
    }
}

impl System for Observed<'_> {
    fn dimension(&self) -> usize {
        self.motion.dimension() + 4
    }

    fn controlled(&self) -> usize {
        self.motion.controlled()
    }

    fn rates(&self, t: f64, y: &State, dy: &mut State) -> Result<()> {
        self.motion.rates(t, y, dy)?;
        let n = self.motion.dimension();
        let f = self.motion.force(t, y)?;
        let at = self.setup.motion(t, y[0], y[1]);
        dy[n] = f * self.motion.face(y).1;
        let held = self.physics.residual_magnetism.on_body(&at, 0.0);
        dy[n + 1] = (held - self.physics.on_body(&at, 0.0)) * at.v + self.damped(y);
        dy[n + 2] = -held * at.v;
        dy[n + 3] = f;
        Ok(())
    }

    fn scale(&self) -> &State {
        self.motion.scale()
    }

    fn events(&self, t: f64, y: &State, dy: Option<&State>, out: &mut Events) -> Result<usize> {
        let n = self.motion.events(t, y, dy, out)?;
        let x = self.motion.face(y).0;
        for (g, mark) in out[n..].iter_mut().zip(&self.marks) {
            *g = x - mark;
        }
        Ok(n + self.marks.len())
    }

    fn crossing(&self, i: usize) -> Crossing {
        self.motion.crossing(i)
    }

    fn longest_step(&self, t: f64, y: &State, dy: &State) -> f64 {
        self.motion.longest_step(t, y, dy)
    }

    fn accept(&mut self, taken: &Taken<'_>, y: &mut State) -> Result<After> {
        let after = self.motion.accept(taken, y)?;
        if taken.event == Some(SURFACE) {
            // they time the first fall
            self.marks.clear();
        }
        Ok(after)
    }
}

/// Quadratures, their number included, fit beside any rig a scenario has.
const _: () = assert!(6 + 4 <= MAX);
