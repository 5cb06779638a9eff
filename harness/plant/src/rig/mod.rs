//! The rig as a system of differential equations: body, contact and whatever hangs on them.
//!
//! Where a spring-borne mass (transducer tip, stop) swings free of the contact, its swing is known in closed form and is
//! not integrated: centre of mass and swing part, and steps need not resolve the ringing.

mod driven;
pub mod motion;
mod riders;
mod system;
#[cfg(test)]
mod tests;

use crate::integrate::{Events, State, MAX};
use crate::setup::Setup;
pub(super) use driven::Driven;
use law::{Memory, BRANCHES};
use mechanisms::physics::Physics;
use mechanisms::signal::transition;
use riders::Riding;
use std::cell::RefCell;

/// State of a rig in motion; variables 0 and 1 are position and speed of the body, of the centre of mass of body and
/// tip while a swing is free.
#[derive(Clone)]
pub(super) struct Rig<'a> {
    p: &'a Physics,
    element: Option<&'a RefCell<Driven<'a>>>,
    memory: Memory,
    s: &'a Setup,
    base: usize,
    riders: [Option<Riding>; Physics::RIDERS],
    tip: usize,
    relax: usize,
    n: usize,
    scale: State,
    cracked: bool,
    /// False for the approach computed backwards: no contact there.
    pub(super) contact: bool,
    latent: bool,
    body_mass: f64,
    /// What FMUs add to it, where they simulate the recording.
    pub(super) outer: Option<Outer>,
    /// Whether the swing may be left to its closed form.
    closed: bool,
    swing: Option<Swing>,
}

/// A quantity that changes at a constant rate.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Line {
    /// Time of `at`, s.
    pub t: f64,
    pub at: f64,
    /// Its change a second.
    pub slope: f64,
}

impl Line {
    #[inline]
    pub fn of(&self, t: f64) -> f64 {
        self.at + self.slope * (t - self.t)
    }
}

/// What FMUs add to a rig over a step of theirs, N.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Outer {
    /// Force on the body along +x where it is at the surface at rest.
    pub drive: Line,
    /// Its fall with position, N/m, and speed, N s/m.
    pub spring: (f64, f64),
    /// Force of the contact beyond the law's while the faces touch.
    pub offset: Line,
}

/// A spring-borne mass swinging free of the contact: compression of its spring, and its rate, beyond what the forces in
/// flight hold it at, at an instant.
#[derive(Clone, Copy)]
struct Swing {
    since: f64,
    u: f64,
    w: f64,
    /// rad/s and damping ratio.
    omega: f64,
    zeta: f64,
}

/// Where everything is: the body, the face that touches, and the force of the transducer's spring.
struct Place {
    x: f64,
    v: f64,
    face: f64,
    face_speed: f64,
    spring: f64,
}

impl<'a> Rig<'a> {
    pub(super) fn new(p: &'a Physics, s: &'a Setup, element: Option<&'a RefCell<Driven<'a>>>) -> Rig<'a> {
        let mut n = 2;
        let mut scale = [1.0; MAX];
        scale[0] = s.depth;
        scale[1] = s.speed;
        let mut pair = |on: bool, scale: &mut State| {
            if on {
                let at = n;
                scale[at] = s.depth;
                scale[at + 1] = s.speed;
                n += 2;
                at
            } else {
                0
            }
        };
        let base = pair(p.base_compliance.mass > 0.0, &mut scale);
        let mut riders = [None; Physics::RIDERS];
        for (place, rider) in riders.iter_mut().zip(p.riders()) {
            *place = Some(Riding::new(rider, pair(true, &mut scale), s));
        }
        let tip = pair(p.sensor_resonance.mass > 0.0, &mut scale);
        let mut relax = 0;
        if p.law.relaxes() && element.is_none() {
            relax = n;
            for b in 0..BRANCHES {
                scale[n + b] = p.mass * s.speed / s.duration;
            }
            n += BRANCHES;
        }
        Rig {
            p,
            element,
            memory: Memory::default(),
            s,
            base,
            riders,
            tip,
            relax,
            n,
            scale,
            cracked: false,
            contact: true,
            latent: p.acts_on_face(),
            body_mass: p.body_mass(),
            outer: None,
            closed: (base > 0) != (tip > 0) && p.law.adhesion.force == 0.0 && !p.needs_integration(),
            swing: None,
        }
    }

    /// The state at rest before the contact: every part moves with the body.
    pub(super) fn along(&self, x: f64, v: f64) -> State {
        let mut y = [0.0; MAX];
        (y[0], y[1]) = (x, v);
        for at in self.riders.iter().flatten().map(|r| r.at).chain((self.tip > 0).then_some(self.tip)) {
            (y[at], y[at + 1]) = (x, v);
        }
        y
    }

    /// Lets the swing go free at `t` from the state `y`, whose first two variables become those of the centre of mass.
    /// `settled`: it hangs where the forces in flight hold it.
    pub(super) fn release(&mut self, t: f64, y: &mut State, settled: bool) {
        if !self.closed {
            return;
        }
        let p = self.p;
        let (mass, k, c) = if self.tip > 0 {
            (
                p.sensor_resonance.mass * self.body_mass / p.mass,
                p.sensor_resonance.stiffness,
                p.sensor_resonance.damping,
            )
        } else {
            (p.base_compliance.mass, p.base_compliance.stiffness, p.base_compliance.damping)
        };
        let omega = (k / mass).sqrt();
        let mut swing = Swing { since: t, u: 0.0, w: 0.0, omega, zeta: 0.5 * c / (mass * omega) };
        if self.tip > 0 {
            let share = p.sensor_resonance.mass / p.mass;
            let (u, w) = (y[0] - y[self.tip], y[1] - y[self.tip + 1]);
            y[0] -= share * u;
            y[1] -= share * w;
            (swing.u, swing.w) = (u - self.held(t, y, omega), w);
        } else {
            (swing.u, swing.w) = (y[self.base], y[self.base + 1]);
        }
        if settled {
            (swing.u, swing.w) = (0.0, 0.0);
        }
        self.swing = Some(swing);
    }

    /// The contact begins: back to body and spring-borne mass, each with its own state.
    fn seize(&mut self, t: f64, y: &mut State) {
        let place = self.place(t, y);
        let at = self.tip.max(self.base);
        (y[at], y[at + 1]) = if self.tip > 0 {
            (place.face, place.face_speed)
        } else {
            (place.x - place.face, place.v - place.face_speed)
        };
        (y[0], y[1]) = (place.x, place.v);
        self.swing = None;
    }

    /// Compression at which the forces in flight hold the transducer's spring, m.
    fn held(&self, t: f64, y: &State, omega: f64) -> f64 {
        if self.tip > 0 {
            self.motion_force(t, y[0], y[1]) / (self.body_mass * omega * omega)
        } else {
            0.0
        }
    }

    #[inline]
    fn place(&self, t: f64, y: &State) -> Place {
        let p = self.p;
        if let Some(s) = &self.swing {
            let (a, b, c) = transition(s.zeta, s.omega * (t - s.since));
            let u = a * s.u + b * s.w / s.omega + self.held(t, y, s.omega);
            let w = -s.omega * b * s.u + c * s.w;
            return if self.tip > 0 {
                let share = p.sensor_resonance.mass / p.mass;
                let (x, v) = (y[0] + share * u, y[1] + share * w);
                Place { x, v, face: x - u, face_speed: v - w, spring: p.sensor_resonance.force(u, w) }
            } else {
                let spring = p.base_compliance.stiffness * u + p.base_compliance.damping * w;
                Place { x: y[0], v: y[1], face: y[0] - u, face_speed: y[1] - w, spring }
            };
        }
        let (face, face_speed) = self.face(y);
        let spring = if self.tip > 0 {
            p.sensor_resonance.force(y[0] - y[self.tip], y[1] - y[self.tip + 1])
        } else if self.base > 0 {
            p.base_compliance.force(y[self.base], y[self.base + 1])
        } else {
            0.0
        };
        Place { x: y[0], v: y[1], face, face_speed, spring }
    }

    /// Position and speed of the face that touches, relative to the stop, m and m/s.
    #[inline]
    pub(super) fn face_at(&self, t: f64, y: &State) -> (f64, f64) {
        if self.swing.is_none() {
            return self.face(y);
        }
        let p = self.place(t, y);
        (p.face, p.face_speed)
    }

    /// The same where nothing swings free.
    #[inline]
    fn face(&self, y: &State) -> (f64, f64) {
        let (mut x, mut v) = if self.tip > 0 { (y[self.tip], y[self.tip + 1]) } else { (y[0], y[1]) };
        if self.base > 0 {
            x -= y[self.base];
            v -= y[self.base + 1];
        }
        (x, v)
    }

    #[inline]
    fn contact_force(&self, t: f64, y: &State) -> f64 {
        if !self.contact || self.swing.is_some() {
            return 0.0;
        }
        let (x, v) = self.face(y);
        let mut f = match self.element {
            Some(e) => e.borrow_mut().force(x, v),
            None if self.relax > 0 => self.p.law.force(&self.relaxing(y), x, v),
            None => self.p.law.force(&self.memory, x, v),
        };
        if let Some(o) = self.outer.as_ref().filter(|_| x > 0.0) {
            f += o.offset.of(t);
        }
        if self.cracked {
            f *= 1.0 - self.p.fracture.drop;
        }
        if self.latent {
            f + self.p.on_face(x, v)
        } else {
            f
        }
    }

    /// The law's memory with the branch forces that the state holds.
    #[inline]
    fn relaxing(&self, y: &State) -> Memory {
        let mut m = self.memory;
        m.relaxation.copy_from_slice(&y[self.relax..self.relax + BRANCHES]);
        m
    }

    /// Forces on the body along +x other than contact and gravity, N.
    #[inline]
    pub(super) fn motion_force(&self, t: f64, x: f64, v: f64) -> f64 {
        let f = self.s.motion_force(self.p, t, x, v);
        match &self.outer {
            Some(o) => f + o.drive.of(t) - o.spring.0 * x - o.spring.1 * v,
            None => f,
        }
    }

    /// Position and speed of the body, m and m/s.
    pub(super) fn body_at(&self, t: f64, y: &State) -> (f64, f64) {
        let place = self.place(t, y);
        (place.x, place.v)
    }

    /// Moves the body, with all that rides on it, by `x` m and `v` m/s.
    pub(super) fn shift(&self, y: &mut State, x: f64, v: f64) {
        let riders = self.riders.iter().flatten().map(|r| r.at);
        for at in [0].into_iter().chain(riders).chain((self.tip > 0 && self.swing.is_none()).then_some(self.tip)) {
            y[at] += x;
            y[at + 1] += v;
        }
    }

    /// Transducer's force N, acceleration of the body less gravity m/s^2, position m and speed m/s of the body.
    pub(super) fn outputs(&self, t: f64, y: &State) -> [f64; 4] {
        let p = self.p;
        let place = self.place(t, y);
        let ft = if self.tip > 0 { place.spring } else { self.contact_force(t, y) };
        let mut f = self.motion_force(t, place.x, place.v) - ft;
        let mut mass = self.body_mass;
        for r in self.riders.iter().flatten() {
            if r.carried {
                mass += r.rider.mass;
            } else {
                f += r.force(p, y) + r.borne(p);
            }
        }
        let ft = if p.base_compliance.reads { place.spring } else { ft };
        let ft = p.on_transducer(&self.s.motion(t, place.x, place.v), ft);
        [ft, f / mass, place.x, place.v]
    }
}

/// What `system` hands to the integrator.
impl Rig<'_> {
    fn dimension(&self) -> usize {
        self.n
    }
    fn scale(&self) -> &State {
        &self.scale
    }
    fn rates(&self, t: f64, y: &State, dy: &mut State) {
        let p = self.p;
        dy[0] = y[1];
        if self.swing.is_some() {
            let at = self.tip.max(self.base);
            (dy[at], dy[at + 1]) = (0.0, 0.0);
            dy[1] = self.motion_force(t, y[0], y[1]) / (self.body_mass + p.sensor_resonance.mass) + p.gravity;
            if self.relax > 0 {
                dy[self.relax..self.relax + BRANCHES].fill(0.0);
            }
            return;
        }
        let fc = self.contact_force(t, y);
        let mut f = self.motion_force(t, y[0], y[1]) + self.body_mass * p.gravity;
        if self.tip > 0 {
            let ft = p.sensor_resonance.force(y[0] - y[self.tip], y[1] - y[self.tip + 1]);
            f -= ft;
            dy[self.tip] = y[self.tip + 1];
            dy[self.tip + 1] = (ft - fc) / p.sensor_resonance.mass + p.gravity;
        } else {
            f -= fc;
        }
        if self.base > 0 {
            dy[self.base] = y[self.base + 1];
            dy[self.base + 1] = (fc - p.base_compliance.force(y[self.base], y[self.base + 1])) / p.base_compliance.mass;
        }
        let mut carried = 0.0;
        for r in self.riders.iter().flatten() {
            if r.carried {
                carried += r.rider.mass;
                continue;
            }
            let fr = r.force(p, y);
            f += fr + r.borne(p);
            dy[r.at] = y[r.at + 1];
            dy[r.at + 1] = p.gravity - fr / r.rider.mass;
        }
        dy[1] = f / self.body_mass;
        if carried > 0.0 {
            let mass = self.body_mass + carried;
            dy[1] = f / mass + p.gravity * carried / mass;
            for r in self.riders.iter().flatten().filter(|r| r.carried) {
                (dy[r.at], dy[r.at + 1]) = (dy[0], dy[1]);
            }
        }
        if self.relax > 0 {
            let (x, v) = self.face(y);
            let r = p.law.relaxation_rates(&self.relaxing(y), x, v);
            dy[self.relax..self.relax + BRANCHES].copy_from_slice(&r);
        }
    }
    fn events(&self, t: f64, y: &State, out: &mut Events) -> usize {
        let (x, v) = self.face_at(t, y);
        out[0] = x;
        out[1] = v;
        let mut n = 2;
        for play in self.riders.iter().flatten().filter_map(|r| r.play(self.p, y)) {
            out[n] = play;
            n += 1;
        }
        if self.p.fracture.load.is_finite() && !self.cracked {
            out[n] = self.contact_force(t, y) - self.p.fracture.load;
            n += 1;
        }
        n
    }
    fn accept(&mut self, t: f64, y: &mut State) -> bool {
        let (x, v) = self.face_at(t, y);
        let mut changed = self.relax > 0;
        if let Some(e) = self.element.filter(|_| self.contact) {
            e.borrow_mut().advance(t, x, v);
            changed = true;
        }
        if self.let_go(t, x, y) {
            changed = true;
        }
        if self.closed && self.contact {
            if self.swing.is_some() && x >= 0.0 {
                self.seize(t, y);
                changed = true;
            } else if self.swing.is_none() && x <= 0.0 && v < 0.0 {
                self.release(t, y, false);
                changed = true;
            }
        }
        if self.p.law.adhesion.force > 0.0 {
            self.memory = self.p.law.remembered(&self.memory, x, x, 0.0);
            changed = true;
        } else if x > self.memory.deepest {
            self.memory.deepest = x;
        }
        if !self.cracked
            && self.p.fracture.load.is_finite()
            && self.contact_force(t, y) >= self.p.fracture.load * (1.0 - 1e-9)
        {
            self.cracked = true;
            changed = true;
        }
        if self.relax > 0 && x <= 0.0 {
            y[self.relax..self.relax + BRANCHES].fill(0.0);
        }
        changed
    }
}
