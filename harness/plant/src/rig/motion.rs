//! A rig followed from event to event: what a scenario simulates, and a recording whose control asks for it.
//!
//! Every state variable is integrated, ringing included, and a contact [`Element`](crate::element::Element) stands in
//! the law's place: which branch of it holds during a step is settled by the events, its memory moves with the accepted
//! steps, and how that moves its force is foreseen.

use super::riders::Riding;
use super::{Driven, Rig};
use crate::element::Element;
use crate::integrate::{After, Crossing, Events, State, System, Taken, MAX};
use crate::setup::Setup;
use anyhow::Result;
use mechanisms::physics::Physics;
use std::cell::RefCell;

/// Event: the face meets the surface, or leaves it.
pub const SURFACE: usize = 0;
/// Event: the face turns.
pub const TURN: usize = 1;
/// Event: the force is largest or smallest.
pub const FORCE_RATE: usize = 4;
/// Event: the force ends or comes back.
pub const FORCE_SIGN: usize = 5;
/// Event, of several bodies: their centre of mass turns.
pub const CENTRE: usize = 6;
/// Event, of several bodies: the body passes where it stood at touch.
pub const BODY_SURFACE: usize = 7;
/// Event, of several bodies: the body turns.
pub const BODY_TURN: usize = 8;
/// Event: the mass on a spring passes where it stood at touch.
pub const SPRUNG_SURFACE: usize = 9;
/// Event: the mass on a spring turns.
pub const SPRUNG_TURN: usize = 10;
/// Number of event functions; events of the rig's other parts stand between [`TURN`] and [`FORCE_RATE`].
pub const EVENTS: usize = 11;

/// Pieces in which a step in contact is handed to the element: its energies take position and velocity as straight
/// lines between the ends of a piece.
const PIECES: usize = 8;
/// Share of the impact's momentum by which an unforeseen change of the element's memory may be wrong, a step.
const MEMORY_TOLERANCE: f64 = 1e-10;
/// Longest step in flight, over the time from here to its top or bottom.
const FLIGHT_STEP: f64 = 0.04;
/// Least sizes errors are measured against: m, m/s.
const LEAST: [f64; 2] = [1e-9, 1e-6];

/// A contact element driven through a [`Motion`].
pub struct Contact<'e>(RefCell<Driven<'e>>);

impl<'e> Contact<'e> {
    /// An element that takes the law's place.
    pub fn new(element: &'e mut (dyn Element + 'e)) -> Contact<'e> {
        Contact(RefCell::new(Driven::new(element)))
    }

    /// As [`Element::energies`].
    ///
    /// # Errors
    /// As there.
    pub fn energies(&self) -> Result<Option<(f64, f64)>> {
        self.0.borrow_mut().element.energies()
    }
}

/// A rig in motion, followed from event to event.
pub struct Motion<'a> {
    rig: Rig<'a>,
    contact: &'a RefCell<Driven<'a>>,
    touching: &'a Physics,
    /// Whether the force of the element has a memory that the rates do not know; the law shows it without a try.
    remembers: bool,
    scale: State,
    inside: bool,
    /// Whether the next touch begins an impact; else it is the face touching once more within one.
    fresh: bool,
}

/// Bodies of a rig: mass kg, position m, velocity m/s each, as many as there are.
pub type Bodies = [Option<(f64, f64, f64)>; 3];

impl<'a> Motion<'a> {
    /// A rig as `s` describes it, at rest or in flight. `flight` holds before the first touch, `touching` from then on;
    /// they differ by gravity only, and what they hold of the law is a measure of depth, no force. `remembers`: the element's force may go on changing where position
    /// and velocity do not.
    pub fn new(
        [flight, touching]: [&'a Physics; 2],
        s: &'a Setup,
        contact: &'a Contact<'a>,
        remembers: bool,
    ) -> Motion<'a> {
        let mut rig = Rig::new(flight, s, Some(&contact.0));
        rig.closed = false;
        contact.0.borrow_mut().inside = Some(false);
        Motion { rig, contact: &contact.0, touching, remembers, scale: [1.0; MAX], inside: false, fresh: true }
    }

    /// The state with every part at `x` m and `v` m/s, at `t` s: at touch, where `x` is zero, an impact begins.
    pub fn start(&mut self, t: f64, x: f64, v: f64) -> State {
        let y = self.rig.along(x, v);
        for j in (0..self.rig.n).step_by(2) {
            (self.scale[j], self.scale[j + 1]) = (x.abs().max(1e-6), 1e-3);
        }
        {
            let mut c = self.contact.borrow_mut();
            (c.at, c.since, c.now) = ((t, x, v), t, t);
        }
        if x == 0.0 {
            self.touch(&y);
        }
        y
    }

    /// Puts masses whose weight the body bears where a flight of `time` s has brought them by the touch.
    pub(crate) fn fall_apart(&self, time: f64, y: &mut State) {
        self.rig.fall_apart(time, y);
    }

    /// Whether the face is between touch and separation.
    pub fn inside(&self) -> bool {
        self.inside
    }

    /// Gravity along +x now, m/s^2.
    pub fn gravity(&self) -> f64 {
        self.rig.p.gravity
    }

    /// All masses, kg.
    pub fn mass(&self) -> f64 {
        self.rig.p.mass
    }

    /// Whether more than one body moves.
    pub fn several(&self) -> bool {
        self.rig.tip > 0 || self.sprung().is_some()
    }

    /// The mass that hangs on the body by a spring, such as an accelerometer's seismic mass.
    fn sprung(&self) -> Option<&Riding> {
        self.rig.riders.iter().flatten().find(|r| r.rider.seat.is_none())
    }

    /// Tip (or all as one), body and the mass that hangs on it by a spring.
    pub fn bodies(&self, y: &State) -> Bodies {
        let (p, body) = (self.rig.p, self.rig.body_mass);
        let at = |mass: f64, i: usize| Some((mass, y[i], y[i + 1]));
        let sprung = self.sprung().and_then(|r| at(r.rider.mass, r.at));
        match self.rig.tip {
            0 => [at(body, 0), None, sprung],
            tip => [at(p.sensor_resonance.mass, tip), at(body, 0), sprung],
        }
    }

    /// Position m and velocity m/s of the centre of mass.
    pub fn centre(&self, y: &State) -> (f64, f64) {
        if !self.several() {
            return (y[0], y[1]);
        }
        let bodies = self.bodies(y);
        let all = bodies.iter().flatten();
        let (m, x, v) = all.fold((0.0, 0.0, 0.0), |s, b| (s.0 + b.0, s.1 + b.0 * b.1, s.2 + b.0 * b.2));
        (x / m, v / m)
    }

    /// Position m and velocity m/s of the face that touches.
    pub fn face(&self, y: &State) -> (f64, f64) {
        self.rig.face(y)
    }

    /// Contact force at `t` s, N.
    ///
    /// # Errors
    /// Where the element refuses.
    pub fn force(&self, t: f64, y: &State) -> Result<f64> {
        self.contact.borrow_mut().now = t;
        let f = self.rig.contact_force(t, y);
        self.rig.check()?;
        Ok(f)
    }

    /// As a recording reads them at `t` s: transducer's force N, acceleration of the body less gravity m/s^2, position m
    /// and speed m/s of the body.
    ///
    /// # Errors
    /// Where the element refuses.
    pub fn outputs(&self, t: f64, y: &State) -> Result<[f64; 4]> {
        self.contact.borrow_mut().now = t;
        let out = self.rig.outputs(t, y);
        self.rig.check()?;
        Ok(out)
    }

    /// Depth to which the undamped law stops the bodies from `v` m/s, m: a measure, no result.
    pub fn depth(&self, v: f64) -> f64 {
        let law = &self.rig.p.law;
        let q = law.elastic.exponent + 1.0;
        (q * self.mass() * v * v / (2.0 * law.elastic.stiffness)).powf(1.0 / q).max(LEAST[0])
    }

    /// The face has met the surface: an impact begins, or goes on. The first step to take.
    fn touch(&mut self, y: &State) -> f64 {
        self.inside = true;
        self.contact.borrow_mut().inside = Some(true);
        self.rig.p = self.touching;
        if std::mem::take(&mut self.fresh) {
            let v = self.centre(y).1;
            for j in (0..self.rig.n).step_by(2) {
                (self.scale[j], self.scale[j + 1]) = (self.depth(v), v.abs().max(LEAST[1]));
            }
        }
        self.first_step(1e-4, y)
    }

    /// The face has left the surface. The first step to take.
    fn separate(&mut self, y: &State) -> f64 {
        self.inside = false;
        let mut c = self.contact.borrow_mut();
        c.inside = Some(false);
        c.rate = 0.0;
        drop(c);
        self.first_step(1e-3, y)
    }

    /// A share of the time in which the face passes the depth that its speed leads to, s.
    fn first_step(&self, share: f64, y: &State) -> f64 {
        let v = self.face(y).1;
        share * self.depth(v) / v.abs().max(LEAST[1])
    }

    /// Informs the element of a step to (`x1`, `v1`), in pieces where it is in contact, and foresees how its memory goes
    /// on moving the force. The longest step to take next.
    fn inform(&mut self, taken: &Taken<'_>, y: &State, a1: f64) -> f64 {
        let mut c = self.contact.borrow_mut();
        let (t1, h) = (taken.t0 + taken.h, taken.h);
        let (from, to) = (self.rig.face(taken.y0), self.rig.face(y));
        let a0 = self.rig.face(taken.dy0).1;
        let foreseen = c.rate * h;
        c.rate = 0.0;
        let watched = self.remembers && self.inside && h > 0.0;
        c.now = t1;
        c.forget();
        let before = if watched { c.force(to.0, to.1) } else { 0.0 };
        let pieces = if self.inside { PIECES } else { 1 };
        c.at = (taken.t0, from.0, from.1);
        for i in 1..=pieces {
            let to = if i == pieces { to } else { between((from, a0), (to, a1), h, i as f64 / pieces as f64) };
            c.piece(to, h / pieces as f64);
        }
        c.at.0 = t1;
        c.since = t1;
        if !watched {
            return f64::INFINITY;
        }
        let change = c.force(to.0, to.1) - before;
        c.rate = change / h;
        let wrong = (change - foreseen).abs() * h / (self.mass() * self.scale[1] * MEMORY_TOLERANCE);
        h * (0.9 * wrong.max(1e-9).powf(-1.0 / 3.0)).clamp(0.2, 4.0)
    }
}

/// Position and velocity inside a step, from both ends' position, velocity and acceleration: the polynomial of order
/// five and its slope.
fn between(from: ((f64, f64), f64), to: ((f64, f64), f64), h: f64, s: f64) -> (f64, f64) {
    let (((x0, v0), a0), ((x1, v1), a1)) = (from, to);
    let (v0, v1, b0, b1) = (h * v0, h * v1, h * h * a0, h * h * a1);
    let d = x1 - x0 - v0 - 0.5 * b0;
    let e = v1 - v0 - b0;
    let g = b1 - b0;
    let (c3, c4, c5) = (10.0 * d - 4.0 * e + 0.5 * g, -15.0 * d + 7.0 * e - g, 6.0 * d - 3.0 * e + 0.5 * g);
    let x = x0 + s * (v0 + s * (0.5 * b0 + s * (c3 + s * (c4 + s * c5))));
    let v = v0 + s * (b0 + s * (3.0 * c3 + s * (4.0 * c4 + s * 5.0 * c5)));
    (x, v / h)
}

impl System for Motion<'_> {
    fn dimension(&self) -> usize {
        self.rig.n
    }

    fn rates(&self, t: f64, y: &State, dy: &mut State) -> Result<()> {
        self.contact.borrow_mut().now = t;
        self.rig.rates(t, y, dy);
        self.rig.check()
    }

    fn scale(&self) -> &State {
        &self.scale
    }

    fn events(&self, t: f64, y: &State, dy: Option<&State>, out: &mut Events) -> Result<usize> {
        self.contact.borrow_mut().now = t;
        let (x, v) = self.rig.face(y);
        (out[FORCE_RATE], out[FORCE_SIGN]) = (0.0, 0.0);
        if self.inside && x > 0.0 {
            let a = match dy {
                Some(dy) => self.rig.face(dy).1,
                None => {
                    let mut dy = [0.0; MAX];
                    self.rates(t, y, &mut dy)?;
                    self.rig.face(&dy).1
                }
            };
            out[FORCE_SIGN] = if self.rig.contact_force(t, y) > 0.0 { 1.0 } else { -1.0 };
            let mut c = self.contact.borrow_mut();
            let (fx, fv) = c.derivatives(x, v);
            out[FORCE_RATE] = fx * v + fv * a + c.rate;
        }
        let own = self.rig.events(t, y, out);
        out[own..FORCE_RATE].fill(0.0);
        out[CENTRE..EVENTS].fill(0.0);
        if self.several() {
            out[CENTRE] = self.centre(y).1;
            (out[BODY_SURFACE], out[BODY_TURN]) = (y[0], y[1]);
        }
        if let Some(r) = self.sprung() {
            (out[SPRUNG_SURFACE], out[SPRUNG_TURN]) = (y[r.at], y[r.at + 1]);
        }
        self.rig.check()?;
        Ok(EVENTS)
    }

    fn crossing(&self, i: usize) -> Crossing {
        match i {
            SURFACE => Crossing::Met,
            FORCE_SIGN => Crossing::Switch,
            _ => Crossing::Smooth,
        }
    }

    fn longest_step(&self, _: f64, y: &State, dy: &State) -> f64 {
        let own = self.contact.borrow().element.longest_step().unwrap_or(f64::INFINITY);
        if self.inside {
            return own;
        }
        // a flight is smooth enough to cross in a few steps: take enough to draw it
        let (place, speed) = self.centre(y);
        let a = if self.several() { self.rig.p.gravity } else { dy[1].abs() };
        if a == 0.0 {
            return own;
        }
        let time = speed.abs() / a + (2.0 * place.abs() / a).sqrt();
        own.min((FLIGHT_STEP * time).max(1e-9))
    }

    fn accept(&mut self, taken: &Taken<'_>, y: &mut State) -> Result<After> {
        let t1 = taken.t0 + taken.h;
        // what the event is about is met exactly
        let face = if self.rig.tip > 0 { self.rig.tip } else { 0 };
        match taken.event {
            Some(SURFACE) if self.rig.base == 0 => y[face] = 0.0,
            Some(TURN) if self.rig.base == 0 => y[face + 1] = 0.0,
            Some(BODY_SURFACE) => y[0] = 0.0,
            Some(BODY_TURN) => y[1] = 0.0,
            Some(event @ (SPRUNG_SURFACE | SPRUNG_TURN)) => {
                if let Some(r) = self.sprung() {
                    y[r.at + usize::from(event == SPRUNG_TURN)] = 0.0;
                }
            }
            _ => {}
        }
        let a1 = match taken.dy1 {
            Some(dy) => self.rig.face(dy).1,
            None => {
                let mut dy = [0.0; MAX];
                self.rates(t1, y, &mut dy)?;
                self.rig.face(&dy).1
            }
        };
        let mut next = self.inform(taken, y, a1);
        self.rig.accept(t1, y);
        for j in (0..self.rig.n).step_by(2) {
            for i in 0..2 {
                self.scale[i] = self.scale[i].max(y[j + i].abs());
            }
        }
        for j in (2..self.rig.n).step_by(2) {
            (self.scale[j], self.scale[j + 1]) = (self.scale[0], self.scale[1]);
        }
        match taken.event {
            Some(SURFACE) if self.rig.face(y).1 > 0.0 => next = next.min(self.touch(y)),
            Some(SURFACE) => next = next.min(self.separate(y)),
            Some(CENTRE) if !self.inside => self.fresh = true,
            Some(TURN) if !self.inside && !self.several() => self.fresh = true,
            _ => {}
        }
        self.rig.check()?;
        Ok(After { changed: true, next })
    }
}
