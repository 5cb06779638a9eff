//! Bodies and contact element stepped together, and where in a step something happens.

use super::integrator::{root, step, State};
use super::plan::Case;
use anyhow::Result;
use host::Element;

/// A penetration that is contact but no depth, m.
const TINY: f64 = 1e-300;
/// Pieces in which a step in contact is told to the element: its energies take position and velocity as straight
/// lines between the ends of a piece.
const PIECES: usize = 8;

/// Event: the tip meets the surface, or leaves it.
pub(super) const SURFACE: usize = 0;
/// Event: the tip turns.
pub(super) const TURN: usize = 1;
/// Event: the force is largest or smallest.
pub(super) const FORCE_RATE: usize = 2;
/// Event: the force ends or comes back.
pub(super) const FORCE_SIGN: usize = 3;
/// Event: the centre of mass turns.
pub(super) const CENTRE: usize = 4;
/// Events: body at the surface, body turns, accelerometer at the surface, accelerometer turns.
pub(super) const OTHERS: usize = 5;
/// Events: the photo interrupters, from the top.
pub(super) const INTERRUPTERS: usize = 9;

/// A case's bodies and its contact element, stepped together.
pub(super) struct Coupled<'a> {
    /// The case.
    pub(super) case: &'a Case,
    /// Its contact.
    pub(super) element: &'a mut dyn Element,
    /// State variables.
    pub(super) n: usize,
    /// Between touch and separation.
    pub(super) inside: bool,
    /// Gravity along +x now, m/s^2.
    pub(super) gravity: f64,
    /// Foreseen rate of the force by the element's memory alone, N/s, from time `since` on.
    pub(super) rate: f64,
    /// See `rate`.
    pub(super) since: f64,
}

impl Coupled<'_> {
    /// Contact force at `t`, N.
    pub(super) fn contact(&mut self, t: f64, x: f64, v: f64) -> Result<f64> {
        // one smooth branch a step: which one is settled by the events
        let x = if self.inside { x.max(TINY) } else { x.min(0.0) };
        let f = self.element.force(x, v)?;
        Ok(if self.rate != 0.0 && f > 0.0 { (f + self.rate * (t - self.since)).max(0.0) } else { f })
    }

    /// Rates of the state.
    pub(super) fn rates(&mut self, t: f64, y: &State) -> Result<State> {
        let f = self.contact(t, y[0], y[1])?;
        Ok(self.case.rig.rates(self.gravity, t, y, f))
    }

    /// A step of `h` and its error.
    pub(super) fn step(&mut self, t: f64, y: &State, h: f64, k0: &State) -> Result<(State, State)> {
        step(self.n, t, y, h, k0, &mut |t, z| self.rates(t, z))
    }

    /// Event function `i`: it changes sign where the event is.
    fn event(&mut self, i: usize, t: f64, y: &State) -> Result<f64> {
        let touching = self.inside && y[0] > 0.0;
        Ok(match i {
            SURFACE => y[0],
            TURN => y[1],
            FORCE_RATE if touching => {
                let (fx, fv) = self.element.derivatives(y[0], y[1])?;
                fx * y[1] + fv * self.rates(t, y)?[1] + self.rate
            }
            FORCE_SIGN if touching => {
                if self.contact(t, y[0], y[1])? > 0.0 {
                    1.0
                } else {
                    -1.0
                }
            }
            FORCE_RATE | FORCE_SIGN => 0.0,
            CENTRE => self.case.rig.centre(y).1,
            i if i < INTERRUPTERS => y[i - OTHERS + 2],
            i => y[0] - self.position(i - INTERRUPTERS),
        })
    }

    /// Position of interrupter `j` from the top, m.
    pub(super) fn position(&self, j: usize) -> f64 {
        self.case
            .interrupters
            .map_or(f64::INFINITY, |p| -(p.last_to_touch + (p.count - 1).saturating_sub(j) as f64 * p.spacing))
    }

    /// The first event in the step of `h` from (`t`, `y`) to `z`.
    pub(super) fn first(
        &mut self,
        active: &[usize],
        (t, y, k0): (f64, &State, &State),
        h: f64,
        z: &State,
    ) -> Result<Option<(usize, f64)>> {
        let mut found: Option<(usize, f64)> = None;
        for &i in active {
            let ends = (self.event(i, t, y)?, self.event(i, t + h, z)?);
            if ends.0 * ends.1 >= 0.0 {
                continue;
            }
            let at = root(h, ends, i == FORCE_SIGN, &mut |s| {
                let w = self.step(t, y, s, k0)?.0;
                self.event(i, t + s, &w)
            })?;
            // only rounding of an event just passed, unless it is the surface, which is met exactly
            if (i == SURFACE || at > 1e-9 * h) && found.is_none_or(|(_, first)| at < first) {
                found = Some((i, at));
            }
        }
        Ok(found)
    }

    /// Tells the element of an accepted step.
    pub(super) fn accept(&mut self, y: &State, a0: f64, z: &State, a1: f64, h: f64) -> Result<()> {
        let pieces = if self.inside { PIECES } else { 1 };
        let mut from = (y[0], y[1]);
        for i in 1..=pieces {
            let to = if i == pieces { (z[0], z[1]) } else { between(y, a0, z, a1, h, i as f64 / pieces as f64) };
            self.element.advance(from, to, h / pieces as f64)?;
            from = to;
        }
        Ok(())
    }
}

/// Position and velocity of the tip inside a step, from both ends' position, velocity and acceleration: the
/// polynomial of order five and its slope.
fn between(y: &State, a0: f64, z: &State, a1: f64, h: f64, s: f64) -> (f64, f64) {
    let (v0, v1, b0, b1) = (h * y[1], h * z[1], h * h * a0, h * h * a1);
    let d = z[0] - y[0] - v0 - 0.5 * b0;
    let e = v1 - v0 - b0;
    let g = b1 - b0;
    let (c3, c4, c5) = (10.0 * d - 4.0 * e + 0.5 * g, -15.0 * d + 7.0 * e - g, 6.0 * d - 3.0 * e + 0.5 * g);
    let x = y[0] + s * (v0 + s * (0.5 * b0 + s * (c3 + s * (c4 + s * c5))));
    let v = v0 + s * (b0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)));
    (x, v / h)
}
