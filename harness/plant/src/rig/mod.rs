//! The rig as a system of differential equations: body, contact and whatever hangs on them.
//!
//! Where a spring-borne mass (transducer tip, stop) swings free of the contact, its swing is known in closed form and is
//! not integrated: centre of mass and swing part, and steps need not resolve the ringing.

mod driven;
mod loose;
pub mod motion;
mod system;
#[cfg(test)]
mod tests;

use super::chain::transition;
use super::integrate::{Events, State, MAX};
use super::simulate::Setup;
pub(super) use driven::Driven;
use law::{Memory, BRANCHES};
use mechanisms::physics::{Physics, SLIP_SPEED};
use record::Kind;
use std::cell::RefCell;

/// State of a rig in motion; variables 0 and 1 are position and speed of the body, of the centre of mass of body and
/// tip while a swing is free.
pub(super) struct Rig<'a> {
    p: &'a Physics,
    element: Option<&'a RefCell<Driven<'a>>>,
    memory: Memory,
    kind: Kind,
    travel: f64,
    preload: f64,
    rate: f64,
    base: usize,
    loose: usize,
    tip: usize,
    relax: usize,
    n: usize,
    scale: State,
    cracked: bool,
    /// False for the approach computed backwards: no contact there.
    pub(super) contact: bool,
    latent: bool,
    body_mass: f64,
    /// Whether the loose part is still carried along as one with the body, for as long as nothing slows that down.
    carried: bool,
    /// Whether the swing may be left to its closed form.
    closed: bool,
    swing: Option<Swing>,
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
    pub(super) fn new(p: &'a Physics, s: &Setup, element: Option<&'a RefCell<Driven<'a>>>) -> Rig<'a> {
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
        let base = pair(p.base_mass > 0.0, &mut scale);
        let loose = pair(p.loose_mass > 0.0, &mut scale);
        let tip = pair(p.tip_mass > 0.0, &mut scale);
        let mut relax = 0;
        if p.law.relaxation_stiffness > 0.0 && element.is_none() {
            relax = n;
            for b in 0..BRANCHES {
                scale[n + b] = p.mass * s.speed / s.duration;
            }
            n += BRANCHES;
        }
        let body_mass = p.mass - p.tip_mass - p.loose_mass;
        Rig {
            p,
            element,
            memory: Memory::default(),
            kind: s.kind,
            travel: s.travel,
            preload: s.preload,
            rate: s.rate,
            base,
            loose,
            tip,
            relax,
            n,
            scale,
            cracked: false,
            contact: true,
            latent: p.has_latent(),
            body_mass,
            carried: loose > 0 && s.kind == Kind::ContactorOpening,
            closed: (base > 0) != (tip > 0)
                && loose == 0
                && p.law.adhesion_force == 0.0
                && p.jam_force == 0.0
                && p.squeeze == 0.0
                && p.base_hardening == 0.0,
            swing: None,
        }
    }

    /// The state at rest before the contact: every part moves with the body.
    pub(super) fn along(&self, x: f64, v: f64) -> State {
        let mut y = [0.0; MAX];
        (y[0], y[1]) = (x, v);
        for at in [self.tip, self.loose] {
            if at > 0 {
                (y[at], y[at + 1]) = (x, v);
            }
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
            (p.tip_mass * self.body_mass / p.mass, p.tip_stiffness, p.tip_damping)
        } else {
            (p.base_mass, p.base_stiffness, p.base_damping)
        };
        let omega = (k / mass).sqrt();
        let mut swing = Swing { since: t, u: 0.0, w: 0.0, omega, zeta: 0.5 * c / (mass * omega) };
        if self.tip > 0 {
            let share = p.tip_mass / p.mass;
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
                let share = p.tip_mass / p.mass;
                let (x, v) = (y[0] + share * u, y[1] + share * w);
                Place { x, v, face: x - u, face_speed: v - w, spring: p.tip_stiffness * u + p.tip_damping * w }
            } else {
                let spring = p.base_stiffness * u + p.base_damping * w;
                Place { x: y[0], v: y[1], face: y[0] - u, face_speed: y[1] - w, spring }
            };
        }
        let (face, face_speed) = self.face(y);
        let spring = if self.tip > 0 {
            p.tip_stiffness * (y[0] - y[self.tip]) + p.tip_damping * (y[1] - y[self.tip + 1])
        } else if self.base > 0 {
            self.base_spring(y)
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

    /// Force of the stop's spring and damper, N.
    #[inline]
    fn base_spring(&self, y: &State) -> f64 {
        let (p, u) = (self.p, y[self.base]);
        let h = p.base_hardening * u * u;
        let growth = if h < 0.0 { 1.0 / (1.0 - 2.0 * h).sqrt() } else { 1.0 + h };
        p.base_stiffness * growth * u + p.base_damping * y[self.base + 1]
    }

    #[inline]
    fn contact_force(&self, y: &State) -> f64 {
        if !self.contact || self.swing.is_some() {
            return 0.0;
        }
        let (x, v) = self.face(y);
        if self.relax == 0 {
            let mut f = match self.element {
                Some(e) => e.borrow_mut().force(x, v),
                None => self.p.law.force(&self.memory, x, v),
            };
            if self.cracked {
                f *= 1.0 - self.p.fracture_drop;
            }
            return if self.latent { f + self.p.latent_force(x, v) } else { f };
        }
        let mut m = self.memory;
        if self.relax > 0 {
            m.relaxation.copy_from_slice(&y[self.relax..self.relax + BRANCHES]);
        }
        let mut f = self.p.law.force(&m, x, v);
        if self.cracked {
            f *= 1.0 - self.p.fracture_drop;
        }
        f + self.p.latent_force(x, v)
    }

    /// Forces on the body along +x other than contact and gravity, N.
    #[inline]
    pub(super) fn motion_force(&self, t: f64, x: f64, v: f64) -> f64 {
        let p = self.p;
        let mut f = 0.0;
        if self.kind == Kind::ContactorOpening {
            f += self.preload - self.rate * (x + self.travel);
            if p.magnet_force != 0.0 {
                let z = (x + self.travel).max(0.0) / p.magnet_gap;
                f -= p.magnet_force * (-t / p.magnet_time).exp() / ((1.0 + z) * (1.0 + z));
            }
        }
        if p.friction != 0.0 {
            let s = v / SLIP_SPEED;
            let level = if p.stribeck_excess != 0.0 {
                let u = v / p.stribeck_speed;
                p.friction * (1.0 + p.stribeck_excess * (-u * u).exp())
            } else {
                p.friction
            };
            f -= level * s.tanh();
        }
        f -= p.friction_viscous * v;
        if p.drag != 0.0 {
            let way = if v < 0.0 { p.drag_back } else { 1.0 };
            let way = if p.drag_crisis > 0.0 { way * p.past_crisis(v) } else { way };
            f -= way * p.drag * v * if p.drag_power == 2.0 { v.abs() } else { v.abs().powf(p.drag_power - 1.0) };
        }
        f -= self.film_force(x, v);
        f - p.spring_preload - (p.spring_rate + p.spring_cubic * x * x) * x
    }

    /// Force of the film between body and stop against the motion into it, N.
    #[inline]
    fn film_force(&self, x: f64, v: f64) -> f64 {
        let p = self.p;
        if p.squeeze == 0.0 {
            return 0.0;
        }
        let w = p.squeeze_gap / ((-x).max(0.0) + p.squeeze_gap);
        p.squeeze * v * if p.squeeze_power == 1.0 { w } else { w.powf(p.squeeze_power) }
    }

    /// Transducer's force N, acceleration of the body less gravity m/s^2, position m and speed m/s of the body.
    pub(super) fn outputs(&self, t: f64, y: &State) -> [f64; 4] {
        let p = self.p;
        let place = self.place(t, y);
        let ft = if self.tip > 0 { place.spring } else { self.contact_force(y) };
        let mut f = self.motion_force(t, place.x, place.v) - ft;
        let mut mass = self.body_mass;
        if self.carried {
            mass += p.loose_mass;
        } else if self.loose > 0 {
            f += self.loose_force(y) + self.borne();
        }
        let ft = if p.base_reads { place.spring } else { ft };
        // the film lies between body and stop, and pushes on a transducer under the stop
        let film = if p.squeeze_reads { self.film_force(place.x, place.v) } else { 0.0 };
        [ft + film, f / mass, place.x, place.v]
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
            dy[1] = self.motion_force(t, y[0], y[1]) / (self.body_mass + p.tip_mass) + p.gravity;
            if self.relax > 0 {
                dy[self.relax..self.relax + BRANCHES].fill(0.0);
            }
            return;
        }
        let fc = self.contact_force(y);
        let mut f = self.motion_force(t, y[0], y[1]) + self.body_mass * p.gravity;
        if self.tip > 0 {
            let ft = p.tip_stiffness * (y[0] - y[self.tip]) + p.tip_damping * (y[1] - y[self.tip + 1]);
            f -= ft;
            dy[self.tip] = y[self.tip + 1];
            dy[self.tip + 1] = (ft - fc) / p.tip_mass + p.gravity;
        } else {
            f -= fc;
        }
        if self.base > 0 {
            dy[self.base] = y[self.base + 1];
            dy[self.base + 1] = (fc - self.base_spring(y)) / p.base_mass;
        }
        if self.carried {
            let mass = self.body_mass + p.loose_mass;
            dy[1] = f / mass + p.gravity * p.loose_mass / mass;
            (dy[self.loose], dy[self.loose + 1]) = (dy[0], dy[1]);
            if self.relax > 0 {
                dy[self.relax..self.relax + BRANCHES].fill(0.0);
            }
            return;
        }
        if self.loose > 0 {
            let fl = self.loose_force(y);
            let borne = self.borne();
            f += fl + borne;
            dy[self.loose] = y[self.loose + 1];
            dy[self.loose + 1] = p.gravity - fl / p.loose_mass;
        }
        dy[1] = f / self.body_mass;
        if self.relax > 0 {
            let (x, v) = self.face(y);
            let mut m = self.memory;
            m.relaxation.copy_from_slice(&y[self.relax..self.relax + BRANCHES]);
            let r = p.law.relaxation_rates(&m, x, v);
            dy[self.relax..self.relax + BRANCHES].copy_from_slice(&r);
        }
    }
    fn events(&self, t: f64, y: &State, out: &mut Events) -> usize {
        let (x, v) = self.face_at(t, y);
        out[0] = x;
        out[1] = v;
        let mut n = 2;
        if self.loose > 0 && !self.carried {
            out[n] = self.loose_play(y);
            n += 1;
        }
        if self.p.fracture_load.is_finite() && !self.cracked {
            out[n] = self.contact_force(y) - self.p.fracture_load;
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
        if self.carried && self.let_loose(t, x, y) {
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
        if self.p.law.adhesion_force > 0.0 {
            self.memory = self.p.law.advance(&self.memory, x, v, x, v, 0.0);
            changed = true;
        } else if x > self.memory.deepest {
            self.memory.deepest = x;
        }
        if !self.cracked
            && self.p.fracture_load.is_finite()
            && self.contact_force(y) >= self.p.fracture_load * (1.0 - 1e-9)
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
