//! Steps a case to its end: touch, separation, turning points, the peak of the force and the photo interrupters
//! are found by shortening the step itself until it ends on them.

use super::integrator::{root, step, State, MOST};
use super::outcome::{Balance, Bounce, Event, Moment, Outcome, Row};
use super::plan::{Case, Start};
use super::results::compare_exact;
use crate::host::Element;
use anyhow::{bail, Result};

/// Error a step, relative to the impact's depth, speed and energy.
const TOLERANCE: f64 = 1e-11;
/// Most steps of a case.
const MOST_STEPS: usize = 2_000_000;
/// Longest motion, s.
const LONGEST: f64 = 1e4;
/// A penetration that is contact but no depth, m.
const TINY: f64 = 1e-300;
/// Pieces in which a step in contact is told to the element: its energies take position and velocity as straight
/// lines between the ends of a piece.
const PIECES: usize = 8;
/// Share of the impact's momentum by which an unforeseen change of the element's memory may be wrong, a step.
const MEMORY_TOLERANCE: f64 = 1e-10;

/// Speed below which a body inside the stop rests, over its impact speed, where its acceleration says the same.
const QUIET: f64 = 1e-6;
/// Longest step in flight, over the time from here to its top or bottom.
const FLIGHT_STEP: f64 = 0.04;

const SURFACE: usize = 0;
const TURN: usize = 1;
const FORCE_RATE: usize = 2;
const FORCE_SIGN: usize = 3;
const CENTRE: usize = 4;
/// Body's position, velocity, accelerometer's position, velocity.
const OTHERS: usize = 5;
const INTERRUPTERS: usize = 9;

struct Run<'a> {
    case: &'a Case,
    element: &'a mut dyn Element,
    n: usize,
    /// Between touch and separation.
    inside: bool,
    gravity: f64,
    /// Foreseen rate of the force by the element's memory alone, N/s, from time `since` on.
    rate: f64,
    since: f64,
}

impl Run<'_> {
    fn contact(&mut self, t: f64, x: f64, v: f64) -> Result<f64> {
        // one smooth branch a step: which one is settled by the events
        let x = if self.inside { x.max(TINY) } else { x.min(0.0) };
        let f = self.element.force(x, v)?;
        Ok(if self.rate != 0.0 && f > 0.0 { (f + self.rate * (t - self.since)).max(0.0) } else { f })
    }

    fn rates(&mut self, t: f64, y: &State) -> Result<State> {
        let f = self.contact(t, y[0], y[1])?;
        Ok(self.case.rig.rates(self.gravity, t, y, f))
    }

    fn step(&mut self, t: f64, y: &State, h: f64, k0: &State) -> Result<(State, State)> {
        step(self.n, t, y, h, k0, &mut |t, z| self.rates(t, z))
    }

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
    fn position(&self, j: usize) -> f64 {
        self.case
            .interrupters
            .map_or(f64::INFINITY, |p| -(p.last_to_touch + (p.count - 1).saturating_sub(j) as f64 * p.spacing))
    }

    /// The first event in the step of `h` from (`t`, `y`) to `z`.
    fn first(
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
    fn accept(&mut self, y: &State, a0: f64, z: &State, a1: f64, h: f64) -> Result<()> {
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

/// Runs a case on a contact element until its last impact is over, or it rests. `watch` is asked now and then
/// whether to go on; where it says no, what there is comes back as interrupted.
///
/// # Errors
/// Where the element refuses, or the motion never ends: too many steps, or a step too small to take.
pub fn simulate(case: &Case, element: &mut dyn Element, watch: &mut dyn FnMut(&Moment) -> bool) -> Result<Outcome> {
    let rig = &case.rig;
    let places = rig.places();
    let (mut t, mut y) = (0.0, [0.0; MOST]);
    let started = |y: &mut State, x: f64, v: f64| {
        for i in 0..rig.count() {
            (y[2 * i], y[2 * i + 1]) = (x, v);
        }
    };
    match (case.start, rig.spring) {
        (Start::Held, Some(s)) => {
            // the bar leaves when the holding force has faded to what the rest overcomes
            let free = s.preload - rig.friction + rig.mass() * rig.gravity_before;
            if s.holding_force > free {
                t = s.holding_time * (s.holding_force / free).ln();
            }
            started(&mut y, -s.travel, 0.0);
        }
        (Start::Touch(v), _) => started(&mut y, 0.0, v),
        (Start::Fall(h), _) => started(&mut y, -h, 0.0),
        (Start::Held, None) => bail!("a bar is held, but there is no spring to drive it"),
    }
    let q = case.law.exponent + 1.0;
    let depth = |v: f64| (q * rig.mass() * v * v / (2.0 * case.law.stiffness)).powf(1.0 / q).max(1e-9);
    let mut run =
        Run { case, element, n: rig.dimension(), inside: false, gravity: rig.gravity_before, rate: 0.0, since: t };
    // an element with memory in its force is foreseen; the law tells without asking whether it has any
    let remembers = case.law.relaxation_stiffness > 0.0 || case.fmu.is_some();
    let mut o = Outcome {
        rows: Vec::new(),
        bounces: Vec::new(),
        events: Vec::new(),
        balance: Balance::default(),
        passages: Vec::new(),
        at_rest: false,
        interrupted: false,
    };
    let mut h = 1e-5;
    let mut scale = [y[0].abs().max(1e-6), 1e-3, rig.mass() * run.gravity * y[0].abs()];
    if let Some(s) = rig.spring {
        scale[2] += s.preload * s.travel;
    }
    // energy that left the books when gravity was switched off, J
    let mut dropped = 0.0;
    let mut first_energies: Option<[f64; 2]> = None;
    let mut last_turn: Option<f64> = None;
    let mut touch_impulse = 0.0;
    let mut just_touched = y[0] == 0.0;
    loop {
        if just_touched {
            just_touched = false;
            run.inside = true;
            let before = rig.potential(run.gravity, &y);
            run.gravity = rig.gravity_after;
            dropped += before - rig.potential(run.gravity, &y);
            let v = rig.centre(&y).1;
            let open = o.bounces.last().is_some_and(|b: &Bounce| b.rebound_height.is_none());
            if let (true, Some(b)) = (open, o.bounces.last_mut()) {
                b.touches += 1;
            } else {
                o.bounces.push(Bounce { touch: t, impact_speed: v, touches: 1, peak_time: t, ..Bounce::default() });
                touch_impulse = y[places.impulse];
                let d = depth(v);
                scale = [d, v.abs().max(1e-6), 0.5 * rig.mass() * v * v];
            }
            last_turn = None;
            h = 1e-4 * depth(y[1]) / y[1].abs().max(1e-6);
        }
        let k0 = run.rates(t, &y)?;
        let force = k0[places.impulse];
        record(&mut o, &mut run, (t, &y), force, dropped, &mut first_energies)?;
        if o.rows.len().is_multiple_of(64) {
            let m = Moment { time: t, impacts: o.bounces.len(), steps: o.rows.len() };
            if !watch(&m) {
                o.interrupted = true;
                return Ok(o);
            }
        }
        let (place, speed) = rig.centre(&y);
        if let Some(b) = o.bounces.last_mut() {
            if run.inside {
                if y[0] > b.deepest {
                    b.deepest = y[0];
                }
                if force > b.peak_force {
                    (b.peak_force, b.peak_time) = (force, t);
                }
                b.impulse = y[places.impulse] - touch_impulse;
                let d = b.impact_speed * QUIET;
                let quiet = speed.abs() < d && (k0[1] * depth(b.impact_speed) / b.impact_speed).abs() < d;
                if quiet && t > b.touch {
                    o.at_rest = true;
                    return finish(case, o);
                }
            } else if case.impacts == 1 && b.separation.is_some() && speed <= 0.0 && place <= -rig.reach(&y) {
                return finish(case, o);
            }
        }
        if o.rows.len() >= MOST_STEPS || t > LONGEST {
            bail!(
                "the motion has not ended after {t:.3e} s, {} impacts and {} steps: ask for fewer impacts or a higher \
                 rest_height, and look at the units of masses, stiffnesses and lengths",
                o.bounces.len(),
                o.rows.len()
            );
        }
        // one accepted step
        let mut active = vec![SURFACE, TURN, FORCE_RATE, FORCE_SIGN];
        if rig.count() == 3 {
            active.extend(CENTRE..OTHERS + 4);
        }
        if o.bounces.is_empty() {
            active.extend((0..case.interrupters.map_or(0, |p| p.count)).map(|j| INTERRUPTERS + j));
        }
        if let Some(most) = run.element.longest_step() {
            h = h.min(most);
        }
        if !run.inside {
            // a flight is smooth enough to cross in a few steps: take enough to draw it
            let a = if rig.count() == 1 { k0[1].abs() } else { run.gravity };
            h = h.min((FLIGHT_STEP * (speed.abs() / a + (2.0 * place.abs() / a).sqrt())).max(1e-9));
        }
        let (mut z, grow) = loop {
            h = on_clock(t, h);
            let (z, e) = run.step(t, &y, h, &k0)?;
            let mut err: f64 = 0.0;
            for j in 0..run.n {
                let s = if j >= 2 * rig.count() {
                    if j == places.impulse {
                        rig.mass() * scale[1]
                    } else {
                        scale[2]
                    }
                } else {
                    scale[j % 2]
                };
                let part = (e[j] / (TOLERANCE * s)).abs();
                err = if part.is_nan() { f64::NAN } else { err.max(part) };
            }
            let grow = (0.9 * err.max(1e-10).powf(-0.2)).clamp(0.2, 4.0);
            if err <= 1.0 {
                break (z, grow);
            }
            h *= if err.is_nan() { 0.2 } else { grow };
            if h < 1e-16 * (1.0 + t) {
                bail!(
                    "at {t:.6e} s the step has become too small: the contact is too stiff for this mass and speed; \
                     look at the units of stiffness, exponent and mass"
                );
            }
        };
        let event = run.first(&active, (t, &y, &k0), h, &z)?;
        let taken = event.map_or(h, |e| beyond(t, e.1));
        if let Some((i, _)) = event {
            z = run.step(t, &y, taken, &k0)?.0;
            match i {
                SURFACE => z[0] = 0.0,
                TURN => z[1] = 0.0,
                i if (OTHERS..INTERRUPTERS).contains(&i) => z[i - OTHERS + 2] = 0.0,
                _ => {}
            }
        }
        let a1 = run.rates(t + taken, &z)?[1];
        let foreseen = run.rate * taken;
        run.rate = 0.0;
        let before = if remembers && run.inside { run.contact(t, z[0], z[1])? } else { 0.0 };
        run.accept(&y, k0[1], &z, a1, taken)?;
        h *= grow;
        if remembers && run.inside && taken > 0.0 {
            let change = run.contact(t, z[0], z[1])? - before;
            run.rate = change / taken;
            let wrong = (change - foreseen).abs() * taken / (rig.mass() * scale[1] * MEMORY_TOLERANCE);
            h = h.min(taken * (0.9 * wrong.max(1e-9).powf(-1.0 / 3.0)).clamp(0.2, 4.0));
        }
        t += taken;
        run.since = t;
        y = z;
        for j in 0..2 * rig.count() {
            scale[j % 2] = scale[j % 2].max(y[j].abs());
        }
        let Some((i, _)) = event else { continue };
        note(&mut o, i, t, &y, rig.centre(&y));
        let (place, speed) = rig.centre(&y);
        let top = if rig.count() == 1 { i == TURN } else { i == CENTRE };
        match i {
            SURFACE if y[1] > 0.0 => {
                let last = case.interrupters.map_or(0, |p| p.count);
                if o.bounces.is_empty() && last > o.passages.len() && run.position(last - 1) == 0.0 {
                    o.passages.push((t, 0.0));
                }
                just_touched = true;
            }
            SURFACE => {
                run.inside = false;
                run.rate = 0.0;
                last_turn = None;
                h = (1e-3 * depth(y[1]) / y[1].abs().max(1e-6)).min(h);
                if let Some(b) = o.bounces.last_mut() {
                    b.separation = Some(t);
                    b.impulse = y[places.impulse] - touch_impulse;
                    b.duration = t - b.touch;
                    b.restitution = -speed / b.impact_speed;
                    b.energy_lost = 0.5 * rig.mass() * (b.impact_speed * b.impact_speed - speed * speed);
                }
            }
            FORCE_SIGN => {
                if let Some(b) = o.bounces.last_mut() {
                    b.force_ends = (y[1] < 0.0).then_some(t);
                }
            }
            i if i >= INTERRUPTERS => {
                o.passages.push((t, y[0]));
            }
            _ => {}
        }
        if top && !run.inside {
            let impacts = o.bounces.len();
            if let Some(b) = o.bounces.last_mut() {
                b.rebound_height = Some(-place);
                if impacts >= case.impacts || -place < case.rest_height {
                    o.at_rest = -place < case.rest_height;
                    last_row(&mut o, &mut run, (t, &y), dropped, &mut first_energies)?;
                    return finish(case, o);
                }
            }
        }
        if top && run.inside {
            let still = last_turn.is_some_and(|x| (place - x).abs() < case.rest_height.max(1e-12));
            if still {
                o.at_rest = true;
                last_row(&mut o, &mut run, (t, &y), dropped, &mut first_energies)?;
                return finish(case, o);
            }
            last_turn = Some(place);
        }
    }
}

fn last_row(
    o: &mut Outcome,
    run: &mut Run,
    at: (f64, &State),
    dropped: f64,
    first: &mut Option<[f64; 2]>,
) -> Result<()> {
    let f = run.contact(at.0, at.1[0], at.1[1])?;
    record(o, run, at, f, dropped, first)
}

fn record(
    o: &mut Outcome,
    run: &mut Run,
    (t, y): (f64, &State),
    force: f64,
    dropped: f64,
    first: &mut Option<[f64; 2]>,
) -> Result<()> {
    let rig = &run.case.rig;
    let at = rig.places();
    let (kinetic, potential) = (rig.kinetic(y), rig.potential(run.gravity, y) + rig.in_sensors(y));
    let told = run.element.energies()?;
    let (stored, dissipated) = told.unwrap_or((f64::NAN, f64::NAN));
    let rest = kinetic + potential + y[at.heat] + y[at.holding] + dropped;
    let now = [rest + stored + dissipated, rest + y[at.work]];
    let then = *first.get_or_insert(now);
    let b = &mut o.balance;
    b.scale = b.scale.max(kinetic).max(y[at.work].abs());
    // absolute until the end, where the scale is known
    b.residual = told.map(|_| b.residual.unwrap_or(0.0).max((now[0] - then[0]).abs()));
    b.residual_of_motion = b.residual_of_motion.max((now[1] - then[1]).abs());
    (b.heat_outside_contact, b.work_against_holding) = (y[at.heat], y[at.holding]);
    o.rows.push(Row { time: t, state: *y, force, stored, dissipated, kinetic, potential });
    Ok(())
}

fn finish(case: &Case, mut o: Outcome) -> Result<Outcome> {
    for b in &mut o.bounces {
        b.exact = compare_exact(case, b);
    }
    Ok(o)
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
