//! A bond of FMUs and the rig of ours that foresees what moves there.

use crate::integrate::{Advance, Control, State, Step, Stepper};
use crate::machine::{Extrapolated, Push};
use crate::rig::motion::SURFACE;
use crate::rig::{Line, Outer, Rig};
use crate::setup::Setup;
use anyhow::Result;
use law::{Memory, Parameters};
use mechanisms::physics::Physics;

/// A bond and its rig.
pub(super) struct Side<'a> {
    pub bond: usize,
    pub rig: Rig<'a>,
    pub y: State,
    /// The law of the contact as the FMUs have it, nearly.
    pub bare: Option<Parameters>,
    pub inside: bool,
    pub reported: bool,
    /// Whether anything touches here: else the surface is a place like any other.
    pub touches: bool,
    pub mass: f64,
    pub gravity: f64,
    pub spring: (f64, f64),
    /// Factor on what the contact's force differs by.
    pub stiffness: f64,
    pub drive: Extrapolated,
    pub offset: Extrapolated,
    /// What another FMU gives that is no contact's, N.
    pub fed: Option<Extrapolated>,
    /// Impulse not foreseen since `since`, N s, and the mean of the drive reckoned with.
    pub gap: f64,
    pub reckoned: f64,
    pub since: f64,
    /// Drive of the last flight, N.
    pub in_flight: f64,
    pub touched: f64,
    pub first: f64,
}

/// What a rig foresees over a step.
pub(super) struct Foreseen {
    /// Where it came to, s.
    pub end: f64,
    /// Force of the contact inside the FMU, its integral and first moment from the start, N s and N s^2.
    pub inside: (f64, f64),
    /// Acceleration at its start and at its end, m/s^2.
    pub acceleration: (f64, f64),
}

/// Time from which on a step that was to end at `stop` has ended there, but for rounding, s.
pub(super) fn earliest(stop: f64) -> f64 {
    stop - 1e-14 * (1.0 + stop.abs())
}

impl<'a> Side<'a> {
    /// Begins anew at `t` s from (`x`, `v`), everything at rest on the body, once what drives it is known.
    pub fn begin(&mut self, t: f64, (x, v): (f64, f64), p: &'a Physics, s: &'a Setup) {
        self.rig = Rig::new(p, s, None);
        self.rig.outer = Some(Outer { drive: self.drive.line, spring: self.spring, offset: self.scaled_offset() });
        self.y = self.rig.along(x, v);
        self.rig.release(t, &mut self.y, false);
    }

    /// Force of the contact as the FMUs have it, nearly, N.
    fn bare_force(&self, x: f64, v: f64) -> f64 {
        self.bare.as_ref().map_or(0.0, |law| law.force(&Memory::default(), x, v))
    }

    /// Goes on from `t` to `stop` s, or to the first touch or parting; rows of outputs at `samples` (s) on the way.
    /// None where it gives up.
    pub fn foresee(
        &mut self,
        t: f64,
        stop: f64,
        samples: &[f64],
        control: &Control,
        rows: &mut Vec<[f64; 4]>,
    ) -> Result<Option<Foreseen>> {
        rows.clear();
        let outer = Outer { drive: self.drive.line, spring: self.spring, offset: self.scaled_offset() };
        self.rig.outer = Some(outer);
        let control = Control { first: self.first.min(stop - t), ..*control };
        let mut stepper = Stepper::new(&self.rig, t, &self.y, stop, &control)?;
        let (bare, reported) = (self.bare.filter(|_| self.inside), self.reported);
        let offset = self.offset.line;
        let (mut impulse, mut moment) = (0.0, 0.0);
        let mut i = 0;
        let mut at_start = None;
        while !stepper.done() {
            let mut each = |r: &Rig<'_>, st: &Step| {
                let until = st.t0 + st.h;
                at_start.get_or_insert_with(|| r.outputs(st.t0, &st.at(0.0))[1]);
                while i < samples.len() && samples[i] <= until {
                    let z = st.at((samples[i] - st.t0) / st.h);
                    rows.push(r.outputs(samples[i], &z));
                    i += 1;
                }
                let Some(law) = &bare else { return };
                for (node, weight) in GAUSS {
                    let z = st.at(node);
                    let at = st.t0 + node * st.h;
                    let (x, v) = r.body_at(at, &z);
                    if x > 0.0 {
                        let more = if reported { offset.of(at) } else { 0.0 };
                        let f = weight * st.h * (law.force(&Memory::default(), x, v) + more);
                        impulse += f;
                        moment += f * (at - t);
                    }
                }
            };
            match stepper.advance(&mut self.rig, &mut each)? {
                Advance::GaveUp => return Ok(None),
                Advance::Step(Some(SURFACE)) if self.touches && stepper.time() > t => break,
                Advance::Step(_) => {}
            }
        }
        self.y = *stepper.state();
        self.first = (stepper.time() - t).max(1e-3 * (stop - t));
        let end = stepper.time();
        let [_, at_end, ..] = self.rig.outputs(end, &self.y);
        let acceleration = (at_start.unwrap_or(at_end), at_end);
        Ok(Some(Foreseen { end, inside: (impulse, moment), acceleration }))
    }

    /// The same over every touch and parting until `stop`, for FMUs that end no step there.
    pub fn foresee_over(
        &mut self,
        t: f64,
        stop: f64,
        samples: &[f64],
        control: &Control,
        rows: &mut Vec<[f64; 4]>,
    ) -> Result<Option<Foreseen>> {
        let mut whole = Foreseen { end: t, inside: (0.0, 0.0), acceleration: (f64::NAN, f64::NAN) };
        let (mut done, mut piece) = (Vec::new(), Vec::new());
        while whole.end < earliest(stop) {
            let left = &samples[done.len().min(samples.len())..];
            let Some(f) = self.foresee(whole.end, stop, left, control, &mut piece)? else { return Ok(None) };
            let (impulse, moment) = f.inside;
            whole.inside = (whole.inside.0 + impulse, whole.inside.1 + moment + impulse * (whole.end - t));
            done.append(&mut piece);
            let from = if whole.end == t { f.acceleration.0 } else { whole.acceleration.0 };
            whole.acceleration = (from, f.acceleration.1);
            whole.end = f.end;
        }
        *rows = done;
        Ok(Some(Foreseen { end: stop, ..whole }))
    }

    fn scaled_offset(&self) -> Line {
        let l = self.offset.line;
        Line { at: self.stiffness * l.at, slope: self.stiffness * l.slope, ..l }
    }

    /// The push that gives the FMU's body, from (`x`, `v`) at `t`, the motion foreseen. `held`: as one value.
    pub fn push(&self, t: f64, (x, v): (f64, f64), f: &Foreseen, held: bool) -> Push {
        let h = f.end - t;
        let (x1, v1) = self.rig.body_at(f.end, &self.y);
        let (a, b) = (self.drive.line.of(t) + self.mass * self.gravity, self.drive.line.slope);
        let (inside, first) = f.inside;
        // integrals of the position and of its first moment on the cubic between the ends (Hermite)
        let of_x = 0.5 * h * (x + x1) + h * h / 12.0 * (v - v1);
        let moment_of_x = h * h * ((3.0 * x + 7.0 * x1) / 20.0 + h * (v / 30.0 - v1 / 20.0));
        let (rate, damping) = self.spring;
        let sprung = rate * of_x + damping * (x1 - x);
        let sprung_moment = rate * (h * of_x - moment_of_x) + damping * (of_x - h * x);
        let impulse = h * (a + 0.5 * b * h) - sprung - inside - self.mass * (v1 - v);
        let moment =
            h * h * (0.5 * a + b * h / 6.0) - sprung_moment - (h * inside - first) - self.mass * (x1 - x - v * h);
        let touching = self.inside && x1 > 0.0;
        let of_contact = if touching { self.bare_force(x1, v1) + self.offset_inside(f.end) } else { 0.0 };
        let drive = self.drive.line.of(f.end) - rate * x1 - damping * v1;
        let end = drive - self.mass * f.acceleration.1 - of_contact;
        let slope = if held { 0.0 } else { (6.0 * impulse * h - 12.0 * moment) / (h * h * h) };
        let fed = self.fed.map_or(Line::default(), |f| f.line);
        Push { start: impulse / h - 0.5 * slope * h + fed.of(t), slope: slope + fed.slope, end: end + fed.of(f.end) }
    }

    fn offset_inside(&self, t: f64) -> f64 {
        if self.reported {
            self.offset.line.of(t)
        } else {
            0.0
        }
    }

    /// Puts the rig where the FMU has come: (`x`, `v`) at `t`, after a step of `h`; and keeps what it had not foreseen.
    pub fn put(&mut self, t: f64, h: f64, to: (f64, f64), window: f64) -> (f64, f64) {
        let (x, v) = self.rig.body_at(t, &self.y);
        let off = (to.0 - x, to.1 - v);
        self.rig.shift(&mut self.y, off.0, off.1);
        self.gap += self.mass * off.1;
        self.reckoned += h * self.drive.line.of(t - 0.5 * h);
        let long = t - self.since;
        if long >= window || self.drive.line.t == 0.0 && self.drive.line.at == 0.0 {
            self.drive.take(t - 0.5 * long, (self.reckoned + self.gap) / long);
            (self.gap, self.reckoned, self.since) = (0.0, 0.0, t);
        }
        off
    }

    /// Keeps what the contact's force differs by at `t`, where the face is at (`x`, `v`) and the contact reported `force`.
    pub fn compare(&mut self, t: f64, (x, v): (f64, f64), force: f64) {
        if let Some(fed) = &mut self.fed {
            fed.take(t, force);
        }
        if !self.reported {
            return;
        }
        if x <= 0.0 {
            self.offset.anew(t, 0.0);
        } else {
            self.offset.take(t, force - self.bare_force(x, v));
        }
    }
}

/// Nodes and weights of Gauss and Legendre's rule on 0..1.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];
