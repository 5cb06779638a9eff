//! Steps a case to its end: touch, separation, turning points, the peak of the force and the photo interrupters
//! are found by shortening the step itself until it ends on them.

use super::coupled::{Coupled, CENTRE, FORCE_RATE, FORCE_SIGN, INTERRUPTERS, OTHERS, SURFACE, TURN};
use super::integrator::{State, MOST};
use super::outcome::{Balance, Bounce, Event, Moment, Outcome, Row};
use super::plan::{Case, Start};
use super::results::compare_exact;
use anyhow::{bail, Result};
use host::Element;

/// Error a step, relative to the impact's depth, speed and energy.
const TOLERANCE: f64 = 1e-11;
/// Most steps of a case.
const MOST_STEPS: usize = 2_000_000;
/// Longest motion, s.
const LONGEST: f64 = 1e4;
/// Share of the impact's momentum by which an unforeseen change of the element's memory may be wrong, a step.
const MEMORY_TOLERANCE: f64 = 1e-10;
/// Speed below which a body inside the stop rests, over its impact speed, where its acceleration says the same.
const QUIET: f64 = 1e-6;
/// Longest step in flight, over the time from here to its top or bottom.
const FLIGHT_STEP: f64 = 0.04;
/// Steps between two questions whether to go on.
const WATCHED: usize = 64;

/// `h` as far as the clock can tell it at `t`, so that rows stand apart by exactly the steps taken.
fn on_clock(t: f64, h: f64) -> f64 {
    (t + h) - t
}

/// The shortest step the clock can tell at `t` that is no shorter than `h`: an event stays behind it.
fn beyond(t: f64, h: f64) -> f64 {
    let end = t + h;
    if end - t < h {
        end.next_up() - t
    } else {
        end - t
    }
}

/// Runs a case on a contact element until its last impact is over, or it rests. `watch` is asked now and then
/// whether to go on; where it says no, what there is comes back as interrupted.
///
/// # Errors
/// Where the element refuses, or the motion never ends: too many steps, or a step too small to take.
pub fn simulate(case: &Case, element: &mut dyn Element, watch: &mut dyn FnMut(&Moment) -> bool) -> Result<Outcome> {
    let mut m = Motion::new(case, element)?;
    if m.y[0] == 0.0 {
        m.touch();
    }
    let mut ended = false;
    while !ended {
        let k0 = m.coupled.rates(m.t, &m.y)?;
        m.record(k0[case.rig.places().impulse])?;
        if m.o.rows.len().is_multiple_of(WATCHED) {
            let now = Moment { time: m.t, impacts: m.o.bounces.len(), steps: m.o.rows.len() };
            if !watch(&now) {
                m.o.interrupted = true;
                return Ok(m.o);
            }
        }
        ended = m.observe(&k0);
        if ended {
            break;
        }
        if let Some(event) = m.advance(&k0)? {
            ended = m.settle(event);
            if ended {
                let f = m.coupled.contact(m.t, m.y[0], m.y[1])?;
                m.record(f)?;
            }
        }
    }
    for b in &mut m.o.bounces {
        b.exact = compare_exact(case, b);
    }
    Ok(m.o)
}

/// A case under way.
struct Motion<'a> {
    coupled: Coupled<'a>,
    /// Whether the force of the element has a memory that the rates do not know; the law tells without a try.
    remembers: bool,
    o: Outcome,
    t: f64,
    y: State,
    /// Step to try next, s.
    h: f64,
    /// Depth m, speed m/s and energy J errors are measured against.
    scale: [f64; 3],
    /// Energy that left the books when gravity was switched off, J.
    dropped: f64,
    /// Energy at the first row, J: with what the element tells, and with the contact's work instead.
    first: Option<[f64; 2]>,
    /// Where the centre of mass last turned inside the stop, m.
    last_turn: Option<f64>,
    /// Impulse of the contact before this impact, N s.
    touch_impulse: f64,
}

impl<'a> Motion<'a> {
    fn new(case: &'a Case, element: &'a mut dyn Element) -> Result<Motion<'a>> {
        let rig = &case.rig;
        let (mut t, mut y) = (0.0, [0.0; MOST]);
        let (x, v) = match (case.start, rig.spring) {
            (Start::Held, Some(s)) => {
                // the bar leaves when the holding force has faded to what the rest overcomes
                let free = s.preload - rig.friction + rig.mass() * rig.gravity_before;
                if s.holding_force > free {
                    t = s.holding_time * (s.holding_force / free).ln();
                }
                (-s.travel, 0.0)
            }
            (Start::Touch(v), _) => (0.0, v),
            (Start::Fall(h), _) => (-h, 0.0),
            (Start::Held, None) => bail!("a bar is held, but there is no spring to drive it"),
        };
        for i in 0..rig.count() {
            (y[2 * i], y[2 * i + 1]) = (x, v);
        }
        let mut scale = [x.abs().max(1e-6), 1e-3, rig.mass() * rig.gravity_before * x.abs()];
        if let Some(s) = rig.spring {
            scale[2] += s.preload * s.travel;
        }
        Ok(Motion {
            coupled: Coupled {
                case,
                element,
                n: rig.dimension(),
                inside: false,
                gravity: rig.gravity_before,
                rate: 0.0,
                since: t,
            },
            remembers: case.law.relaxes() || case.fmu.is_some(),
            o: Outcome {
                rows: Vec::new(),
                bounces: Vec::new(),
                events: Vec::new(),
                balance: Balance::default(),
                passages: Vec::new(),
                at_rest: false,
                interrupted: false,
            },
            t,
            y,
            h: 1e-5,
            scale,
            dropped: 0.0,
            first: None,
            last_turn: None,
            touch_impulse: 0.0,
        })
    }

    /// Depth to which the undamped law stops the bodies from `v`, m: a measure, no result.
    fn depth(&self, v: f64) -> f64 {
        let (law, mass) = (&self.coupled.case.law, self.coupled.case.rig.mass());
        let q = law.elastic.exponent + 1.0;
        (q * mass * v * v / (2.0 * law.elastic.stiffness)).powf(1.0 / q).max(1e-9)
    }

    /// The tip has met the surface: an impact begins, or goes on.
    fn touch(&mut self) {
        let rig = &self.coupled.case.rig;
        self.coupled.inside = true;
        let before = rig.potential(self.coupled.gravity, &self.y);
        self.coupled.gravity = rig.gravity_after;
        self.dropped += before - rig.potential(self.coupled.gravity, &self.y);
        match self.o.bounces.last_mut().filter(|b| b.rebound_height.is_none()) {
            Some(b) => b.touches += 1,
            None => {
                let v = rig.centre(&self.y).1;
                let b = Bounce { touch: self.t, impact_speed: v, touches: 1, peak_time: self.t, ..Bounce::default() };
                self.o.bounces.push(b);
                self.touch_impulse = self.y[rig.places().impulse];
                self.scale = [self.depth(v), v.abs().max(1e-6), 0.5 * rig.mass() * v * v];
            }
        }
        self.last_turn = None;
        self.h = 1e-4 * self.depth(self.y[1]) / self.y[1].abs().max(1e-6);
    }

    /// Looks at the state: the impact's deepest point and peak so far, and whether all is over.
    fn observe(&mut self, k0: &State) -> bool {
        let case = self.coupled.case;
        let rig = &case.rig;
        let force = k0[rig.places().impulse];
        let (place, speed) = rig.centre(&self.y);
        let Some(v) = self.o.bounces.last().map(|b| b.impact_speed) else { return false };
        let pushed = (k0[1] * self.depth(v) / v).abs();
        let Some(b) = self.o.bounces.last_mut() else { return false };
        if !self.coupled.inside {
            return case.impacts == 1 && b.separation.is_some() && speed <= 0.0 && place <= -rig.reach(&self.y);
        }
        b.deepest = b.deepest.max(self.y[0]);
        if force > b.peak_force {
            (b.peak_force, b.peak_time) = (force, self.t);
        }
        b.impulse = self.y[rig.places().impulse] - self.touch_impulse;
        let quiet = speed.abs() < v * QUIET && pushed < v * QUIET && self.t > b.touch;
        self.o.at_rest |= quiet;
        quiet
    }

    /// Takes one step, to the first event in it if there is one: that event's number.
    fn advance(&mut self, k0: &State) -> Result<Option<usize>> {
        if self.o.rows.len() >= MOST_STEPS || self.t > LONGEST {
            bail!(
                "the motion has not ended after {:.3e} s, {} impacts and {} steps: ask for fewer impacts or a higher \
                 rest_height, and look at the units of masses, stiffnesses and lengths",
                self.t,
                self.o.bounces.len(),
                self.o.rows.len()
            );
        }
        let rig = &self.coupled.case.rig;
        let (mut z, grow) = self.attempt(k0)?;
        let (t, h) = (self.t, self.h);
        let active = self.active();
        let event = self.coupled.first(&active, (t, &self.y, k0), h, &z)?;
        let taken = event.map_or(h, |e| beyond(t, e.1));
        if let Some((i, _)) = event {
            z = self.coupled.step(t, &self.y, taken, k0)?.0;
            match i {
                SURFACE => z[0] = 0.0,
                TURN => z[1] = 0.0,
                i if (OTHERS..INTERRUPTERS).contains(&i) => z[i - OTHERS + 2] = 0.0,
                _ => {}
            }
        }
        self.h *= grow;
        self.accept(k0, &z, taken)?;
        self.t += taken;
        self.coupled.since = self.t;
        self.y = z;
        for j in 0..2 * rig.count() {
            self.scale[j % 2] = self.scale[j % 2].max(z[j].abs());
        }
        Ok(event.map(|e| e.0))
    }

    /// A step within the tolerance, of `self.h`: the state after it, and by what the next one may grow.
    fn attempt(&mut self, k0: &State) -> Result<(State, f64)> {
        let rig = &self.coupled.case.rig;
        if let Some(most) = self.coupled.element.longest_step() {
            self.h = self.h.min(most);
        }
        if !self.coupled.inside {
            // a flight is smooth enough to cross in a few steps: take enough to draw it
            let (place, speed) = rig.centre(&self.y);
            let a = if rig.count() == 1 { k0[1].abs() } else { self.coupled.gravity };
            let time = speed.abs() / a + (2.0 * place.abs() / a).sqrt();
            self.h = self.h.min((FLIGHT_STEP * time).max(1e-9));
        }
        let impulse = rig.places().impulse;
        loop {
            self.h = on_clock(self.t, self.h);
            let (z, e) = self.coupled.step(self.t, &self.y, self.h, k0)?;
            let mut err: f64 = 0.0;
            for (j, e) in e.iter().enumerate().take(self.coupled.n) {
                let s = match j {
                    j if j < 2 * rig.count() => self.scale[j % 2],
                    j if j == impulse => rig.mass() * self.scale[1],
                    _ => self.scale[2],
                };
                let part = (e / (TOLERANCE * s)).abs();
                err = if part.is_nan() { f64::NAN } else { err.max(part) };
            }
            let grow = (0.9 * err.max(1e-10).powf(-0.2)).clamp(0.2, 4.0);
            if err <= 1.0 {
                return Ok((z, grow));
            }
            self.h *= if err.is_nan() { 0.2 } else { grow };
            if self.h < 1e-16 * (1.0 + self.t) {
                bail!(
                    "at {:.6e} s the step has become too small: the contact is too stiff for this mass and speed; \
                     look at the units of stiffness, exponent and mass",
                    self.t
                );
            }
        }
    }

    /// Events to look for now.
    fn active(&self) -> Vec<usize> {
        let case = self.coupled.case;
        let mut active = vec![SURFACE, TURN, FORCE_RATE, FORCE_SIGN];
        if case.rig.count() == 3 {
            active.extend(CENTRE..INTERRUPTERS);
        }
        if self.o.bounces.is_empty() {
            active.extend((0..case.interrupters.map_or(0, |p| p.count)).map(|j| INTERRUPTERS + j));
        }
        active
    }

    /// Tells the element of a step of `taken` to `z`, and foresees how its memory goes on moving the force.
    fn accept(&mut self, k0: &State, z: &State, taken: f64) -> Result<()> {
        let c = &mut self.coupled;
        let a1 = c.rates(self.t + taken, z)?[1];
        let foreseen = c.rate * taken;
        c.rate = 0.0;
        let watched = self.remembers && c.inside && taken > 0.0;
        let before = if watched { c.contact(self.t, z[0], z[1])? } else { 0.0 };
        c.accept(&self.y, k0[1], z, a1, taken)?;
        if watched {
            let change = c.contact(self.t, z[0], z[1])? - before;
            c.rate = change / taken;
            let momentum = c.case.rig.mass() * self.scale[1];
            let wrong = (change - foreseen).abs() * taken / (momentum * MEMORY_TOLERANCE);
            self.h = self.h.min(taken * (0.9 * wrong.max(1e-9).powf(-1.0 / 3.0)).clamp(0.2, 4.0));
        }
        Ok(())
    }

    /// What an event means: whether it ends all.
    fn settle(&mut self, event: usize) -> bool {
        let case = self.coupled.case;
        let rig = &case.rig;
        let (place, speed) = rig.centre(&self.y);
        note(&mut self.o, event, self.t, &self.y, (place, speed));
        match event {
            SURFACE if self.y[1] > 0.0 => {
                let last = case.interrupters.map_or(0, |p| p.count);
                if self.o.bounces.is_empty() && last > self.o.passages.len() && self.coupled.position(last - 1) == 0.0 {
                    self.o.passages.push((self.t, 0.0));
                }
                self.touch();
            }
            SURFACE => self.separate(speed),
            FORCE_SIGN => {
                if let Some(b) = self.o.bounces.last_mut() {
                    b.force_ends = (self.y[1] < 0.0).then_some(self.t);
                }
            }
            i if i >= INTERRUPTERS => self.o.passages.push((self.t, self.y[0])),
            _ => {}
        }
        let turns = if rig.count() == 1 { TURN } else { CENTRE };
        if event != turns {
            return false;
        }
        if self.coupled.inside {
            self.deepest(place)
        } else {
            self.top(-place)
        }
    }

    /// The tip has left the surface.
    fn separate(&mut self, speed: f64) {
        let rig = &self.coupled.case.rig;
        self.coupled.inside = false;
        self.coupled.rate = 0.0;
        self.last_turn = None;
        self.h = (1e-3 * self.depth(self.y[1]) / self.y[1].abs().max(1e-6)).min(self.h);
        if let Some(b) = self.o.bounces.last_mut() {
            b.separation = Some(self.t);
            b.impulse = self.y[rig.places().impulse] - self.touch_impulse;
            b.duration = self.t - b.touch;
            b.restitution = -speed / b.impact_speed;
            b.energy_lost = 0.5 * rig.mass() * (b.impact_speed * b.impact_speed - speed * speed);
        }
    }

    /// A rebound is at its top: whether it was the last, or so low that the body rests.
    fn top(&mut self, height: f64) -> bool {
        let case = self.coupled.case;
        let impacts = self.o.bounces.len();
        let Some(b) = self.o.bounces.last_mut() else { return false };
        b.rebound_height = Some(height);
        self.o.at_rest = height < case.rest_height;
        self.o.at_rest || impacts >= case.impacts
    }

    /// The bodies turn inside the stop: whether they turned there before, and so rest.
    fn deepest(&mut self, place: f64) -> bool {
        let least = self.coupled.case.rest_height.max(1e-12);
        self.o.at_rest = self.last_turn.is_some_and(|x| (place - x).abs() < least);
        self.last_turn = Some(place);
        self.o.at_rest
    }

    /// Puts the state on record, with the contact's force, N, and the energies.
    fn record(&mut self, force: f64) -> Result<()> {
        let (rig, y) = (&self.coupled.case.rig, &self.y);
        let at = rig.places();
        let (kinetic, potential) = (rig.kinetic(y), rig.potential(self.coupled.gravity, y) + rig.in_sensors(y));
        let told = self.coupled.element.energies()?;
        let (stored, dissipated) = told.unwrap_or((f64::NAN, f64::NAN));
        let rest = kinetic + potential + y[at.heat] + y[at.holding] + self.dropped;
        let now = [rest + stored + dissipated, rest + y[at.work]];
        let then = *self.first.get_or_insert(now);
        let b = &mut self.o.balance;
        b.scale = b.scale.max(kinetic).max(y[at.work].abs());
        // absolute until the end, where the scale is known
        b.residual = told.map(|_| b.residual.unwrap_or(0.0).max((now[0] - then[0]).abs()));
        b.residual_of_motion = b.residual_of_motion.max((now[1] - then[1]).abs());
        (b.heat_outside_contact, b.work_against_holding) = (y[at.heat], y[at.holding]);
        self.o.rows.push(Row { time: self.t, state: *y, force, stored, dissipated, kinetic, potential });
        Ok(())
    }
}

/// Puts an event on record.
fn note(o: &mut Outcome, i: usize, t: f64, y: &State, (place, speed): (f64, f64)) {
    let (mass, position, velocity) = match i {
        CENTRE => ("centre", place, speed),
        5 | 6 => ("body", y[2], y[3]),
        7 | 8 => ("accelerometer", y[4], y[5]),
        _ => ("tip", y[0], y[1]),
    };
    let turn = if position > 0.0 { "deepest" } else { "top" };
    let pass = if velocity > 0.0 { "touch" } else { "separation" };
    let what = match i {
        SURFACE | 5 | 7 => pass,
        TURN | CENTRE | 6 | 8 => turn,
        FORCE_RATE => "peak_force",
        FORCE_SIGN if y[1] < 0.0 => "force_ends",
        FORCE_SIGN => "force_returns",
        _ => "interrupter",
    };
    o.events.push(Event { time: t, mass, what, position, velocity });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_event_is_never_put_before_its_instant() {
        for t in [0.0, 1e-9, 0.1, 0.219_162_4, 3.0, 1e4] {
            for h in [1e-30, 1e-18, 1e-17, 3.3e-13, 1e-7, 0.02] {
                let taken = beyond(t, h);
                assert!(taken >= h && t + taken > t, "{t} {h}: {taken}");
                assert!(t + taken - t == taken, "the clock tells it exactly");
                assert!(taken <= h + 4.0 * f64::EPSILON * (t + h), "{t} {h}: {taken}");
            }
        }
    }
}
