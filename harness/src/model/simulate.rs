//! One recording of a campaign simulated: approach, contact, flight, and what an ideal chain reads.

use super::integrate::{integrate, Control, State, System, MAX};
use super::physics::Physics;
use crate::host::element::Element;
use crate::record::Kind;
use hysteresis_contact::law::{Memory, Parameters, BRANCHES};
use std::cell::RefCell;

/// What the model has to know of one recording, SI.
#[derive(Clone, Debug)]
pub struct Setup {
    pub kind: Kind,
    /// Sample times on the recording's own clock, s.
    pub time: Vec<f64>,
    pub order: f64,
    /// Contactor: distance from rest to the stop m, preload N, rate N/m.
    pub travel: f64,
    pub preload: f64,
    pub rate: f64,
    /// Indentation: the penetration imposed, m, and its rate, m/s.
    pub imposed: Vec<f64>,
    pub imposed_rate: Vec<f64>,
    /// Sizes for error control: depth m, speed m/s, duration of contact s.
    pub depth: f64,
    pub speed: f64,
    pub duration: f64,
}

/// What differs between recordings besides their setup.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Local {
    /// Instant of touch (drop test) or release (contactor) on the recording's clock, s.
    pub start: f64,
    /// Speed at touch, m/s (drop test).
    pub speed: f64,
    /// Natural logarithm of the factor on the contact's stiffness.
    pub stiffness: f64,
    /// True position = reading - offset for an imposed penetration, m.
    pub offset: f64,
}

/// True signals at the sample times, before the chain; phases of the first impact on the recording's clock.
#[derive(Clone, Debug, Default)]
pub struct Trace {
    pub force: Vec<f64>,
    pub acceleration: Vec<f64>,
    pub position: Vec<f64>,
    pub velocity: Vec<f64>,
    /// s: touch, deepest point, leaving the nominal surface.
    pub touch: f64,
    pub deepest: f64,
    pub leave: f64,
    /// Speed at the first sample, m/s.
    pub first_speed: f64,
    /// False when the integrator gave up.
    pub ok: bool,
}

/// A contact element that takes the law's place in a simulation.
struct Driven {
    element: Box<dyn Element>,
    /// Time, penetration and velocity up to which its memory has moved.
    at: (f64, f64, f64),
    /// The first thing it refused.
    failed: Option<anyhow::Error>,
}

impl Driven {
    fn force(&mut self, x: f64, v: f64) -> f64 {
        match self.element.force(x, v) {
            Ok(f) => f,
            Err(e) => {
                self.failed.get_or_insert(e);
                f64::NAN
            }
        }
    }
    fn advance(&mut self, t: f64, x: f64, v: f64) {
        let (t0, x0, v0) = self.at;
        if t > t0 {
            if let Err(e) = self.element.advance((x0, v0), (x, v), t - t0) {
                self.failed.get_or_insert(e);
            }
            self.at = (t, x, v);
        }
    }
}

struct Rig<'a> {
    p: &'a Physics,
    element: Option<&'a RefCell<Driven>>,
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
    contact: bool,
    body_mass: f64,
}

impl<'a> Rig<'a> {
    fn new(p: &'a Physics, s: &Setup, element: Option<&'a RefCell<Driven>>) -> Rig<'a> {
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
            body_mass,
        }
    }

    /// Position and speed of the face that touches, relative to the stop.
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
    fn contact_force(&self, y: &State) -> f64 {
        if !self.contact {
            return 0.0;
        }
        let (x, v) = self.face(y);
        let mut m = self.memory;
        if self.relax > 0 {
            m.relaxation.copy_from_slice(&y[self.relax..self.relax + BRANCHES]);
        }
        let mut f = match self.element {
            Some(e) => e.borrow_mut().force(x, v),
            None => self.p.law.force(&m, x, v),
        };
        if self.cracked {
            f *= 1.0 - self.p.fracture_drop;
        }
        f + self.p.latent_force(x, v)
    }

    /// Forces on the body along +x other than contact and gravity, N.
    #[inline]
    fn motion_force(&self, t: f64, x: f64, v: f64) -> f64 {
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
            let s = v / 0.005;
            let level = if p.stribeck_excess != 0.0 {
                let u = v / p.stribeck_speed;
                p.friction * (1.0 + p.stribeck_excess * (-u * u).exp())
            } else {
                p.friction
            };
            f -= level * s.tanh();
        }
        f -= p.friction_viscous * v + p.drag * v * v.abs();
        f -= self.film_force(x, v);
        f - p.spring_preload - p.spring_rate * x
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

    /// (transducer's force, acceleration of the body less gravity)
    fn outputs(&self, t: f64, y: &State) -> (f64, f64) {
        let fc = self.contact_force(y);
        let ft = if self.tip > 0 {
            self.p.tip_stiffness * (y[0] - y[self.tip]) + self.p.tip_damping * (y[1] - y[self.tip + 1])
        } else {
            fc
        };
        let mut f = self.motion_force(t, y[0], y[1]) - ft;
        if self.loose > 0 {
            f += self.loose_force(y);
        }
        // the film pushes on the transducer as well: it lies between body and stop
        (ft + self.film_force(y[0], y[1]), f / self.body_mass)
    }

    #[inline]
    fn loose_force(&self, y: &State) -> f64 {
        let z = y[self.loose] - y[0];
        let w = y[self.loose + 1] - y[1];
        let (k, c) = (self.p.loose_stiffness, self.p.loose_damping);
        if z > self.p.loose_gap {
            (k * (z - self.p.loose_gap) + c * w).max(0.0)
        } else {
            0.0
        }
    }
}

impl System for Rig<'_> {
    fn dimension(&self) -> usize {
        self.n
    }
    fn scale(&self) -> &State {
        &self.scale
    }
    fn rates(&self, t: f64, y: &State, dy: &mut State) {
        let p = self.p;
        let fc = self.contact_force(y);
        dy[0] = y[1];
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
            dy[self.base + 1] =
                (fc - p.base_stiffness * y[self.base] - p.base_damping * y[self.base + 1]) / p.base_mass;
        }
        if self.loose > 0 {
            let fl = self.loose_force(y);
            f += fl;
            dy[self.loose] = y[self.loose + 1];
            dy[self.loose + 1] = -fl / p.loose_mass + p.gravity;
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
    fn events(&self, y: &State, out: &mut [f64; 4]) -> usize {
        let (x, v) = self.face(y);
        out[0] = x;
        out[1] = v;
        let mut n = 2;
        if self.loose > 0 {
            out[n] = y[self.loose] - y[0] - self.p.loose_gap;
            n += 1;
        }
        if self.p.fracture_load.is_finite() && !self.cracked {
            out[n] = self.contact_force(y) - self.p.fracture_load;
            n += 1;
        }
        n
    }
    fn accept(&mut self, t: f64, y: &mut State) {
        let (x, v) = self.face(y);
        if let Some(e) = self.element.filter(|_| self.contact) {
            e.borrow_mut().advance(t, x, v);
        }
        if self.p.law.adhesion_force > 0.0 {
            self.memory = self.p.law.advance(&self.memory, x, v, x, v, 0.0);
        } else if x > self.memory.deepest {
            self.memory.deepest = x;
        }
        if !self.cracked
            && self.p.fracture_load.is_finite()
            && self.contact_force(y) >= self.p.fracture_load * (1.0 - 1e-9)
        {
            self.cracked = true;
        }
        if self.relax > 0 && x <= 0.0 {
            y[self.relax..self.relax + BRANCHES].fill(0.0);
        }
    }
}

/// Error per step, relative to depth and speed of the impact.
pub const TOLERANCE: f64 = 1e-7;
/// Steps a contact gets at least where an element takes the law's place.
const ELEMENT_STEPS: f64 = 400.0;
/// Steps after which a recording is given up.
const MOST_STEPS: usize = 20_000;

fn scaled(p: &Physics, order: f64, local: &Local) -> Physics {
    let mut q = *p;
    let f = local.stiffness.exp() * p.softening_factor(order);
    q.law.stiffness *= f;
    q.law.hysteresis_damping *= f;
    q.law.secondary_stiffness *= f;
    q.law.relaxation_stiffness *= f;
    q
}

/// Simulates one recording.
pub fn simulate(physics: &Physics, s: &Setup, local: &Local) -> Trace {
    let p = scaled(physics, s.order, local);
    match s.kind {
        Kind::Indentation => indent(&p, s, local, None),
        _ => free(&p, s, local, None),
    }
}

/// The law a recording is simulated with: `physics` with what this recording differs by.
pub fn law_of(physics: &Physics, s: &Setup, local: &Local) -> Parameters {
    scaled(physics, s.order, local).law
}

/// As [`simulate`], with `element` in the law's place. Its memory moves at accepted steps only, so steps are short.
///
/// # Errors
/// The first thing the element refuses.
pub fn simulate_on(element: Box<dyn Element>, physics: &Physics, s: &Setup, local: &Local) -> anyhow::Result<Trace> {
    let p = scaled(physics, s.order, local);
    let driven = RefCell::new(Driven { element, at: (0.0, 0.0, 0.0), failed: None });
    let trace = match s.kind {
        Kind::Indentation => indent(&p, s, local, Some(&driven)),
        _ => free(&p, s, local, Some(&driven)),
    };
    match driven.into_inner().failed {
        Some(e) => Err(e),
        None => Ok(trace),
    }
}

fn indent(p: &Physics, s: &Setup, local: &Local, element: Option<&RefCell<Driven>>) -> Trace {
    let n = s.time.len();
    let mut t = Trace { ok: true, first_speed: s.imposed_rate[0], ..Trace::default() };
    let mut m = Memory::default();
    let mut cracked = false;
    for i in 0..n {
        let (x, v) = (s.imposed[i] - local.offset, s.imposed_rate[i]);
        let (x0, v0) = if i > 0 { (s.imposed[i - 1] - local.offset, s.imposed_rate[i - 1]) } else { (x, v) };
        let mut f = match element {
            Some(e) => {
                let mut e = e.borrow_mut();
                if i == 0 {
                    e.at = (s.time[0], x, v);
                }
                e.advance(s.time[i], x, v);
                e.force(x, v)
            }
            None => {
                if i > 0 {
                    m = p.law.advance(&m, x0, v0, x, v, s.time[i] - s.time[i - 1]);
                }
                p.law.force(&m, x, v)
            }
        };
        if f > p.fracture_load {
            cracked = true;
        }
        if cracked {
            f *= 1.0 - p.fracture_drop;
        }
        f += p.latent_force(x, v);
        t.force.push(f);
        t.position.push(x);
        t.velocity.push(v);
        t.acceleration.push(0.0);
    }
    let deep = (0..n).max_by(|a, b| t.position[*a].total_cmp(&t.position[*b])).unwrap_or(0);
    let touch = (0..deep).rev().find(|i| t.position[*i] <= 0.0).unwrap_or(0);
    let leave = (deep..n).find(|i| t.position[*i] <= 0.0).unwrap_or(n - 1);
    (t.touch, t.deepest, t.leave) = (s.time[touch], s.time[deep], s.time[leave]);
    t
}

fn free(p: &Physics, s: &Setup, local: &Local, element: Option<&RefCell<Driven>>) -> Trace {
    let n = s.time.len();
    let mut out = Trace {
        force: vec![0.0; n],
        acceleration: vec![0.0; n],
        position: vec![0.0; n],
        velocity: vec![0.0; n],
        touch: f64::NAN,
        deepest: f64::NAN,
        leave: f64::NAN,
        ..Trace::default()
    };
    let clock = local.start;
    let mut y = [0.0; MAX];
    let forward_from;
    let mut rig = Rig::new(p, s, element);
    let dt = s.time[1] - s.time[0];
    let (largest, most) = match element {
        None => ((s.duration * 2.0).max(dt * 4.0), MOST_STEPS),
        Some(_) => (s.duration / ELEMENT_STEPS, 100 * MOST_STEPS),
    };
    if s.kind == Kind::DropTest {
        y[1] = local.speed;
        if rig.tip > 0 {
            y[rig.tip + 1] = local.speed;
        }
        if rig.loose > 0 {
            y[rig.loose + 1] = local.speed;
        }
        out.touch = clock;
        forward_from = s.time.partition_point(|t| *t < clock);
        if forward_from > 0 {
            // the approach, backwards from touch: only forces in flight act
            let mut rig = Rig::new(p, s, None);
            rig.contact = false;
            let mut back = y;
            let mut i = forward_from;
            let end = s.time[0] - clock;
            out.ok = integrate(
                &mut rig,
                0.0,
                &mut back,
                end,
                &Control { tolerance: TOLERANCE, first: 0.1 * s.duration, largest, most },
                |r, st| {
                    let until = st.t0 + st.h;
                    while i > 0 && s.time[i - 1] - clock >= until - 1e-15 {
                        let tau = s.time[i - 1] - clock;
                        let z = st.at((tau - st.t0) / st.h);
                        put(&mut out, i - 1, r, tau, &z);
                        i -= 1;
                    }
                },
            );
            if !out.ok {
                return out;
            }
            out.first_speed = back[1];
        } else {
            out.first_speed = local.speed;
        }
        // a pull that reaches out before touch acts from the surface on; leaving it needs the full law
    } else {
        y[0] = -s.travel;
        if rig.tip > 0 {
            y[rig.tip] = -s.travel;
        }
        if rig.loose > 0 {
            y[rig.loose] = -s.travel;
        }
        forward_from = s.time.partition_point(|t| *t < clock);
        // what was sampled just before release reads as at release: the instant is uncertain by a sample
        let (f, a) = rig.outputs(0.0, &y);
        for i in 0..forward_from {
            out.position[i] = -s.travel;
            out.force[i] = f;
            out.acceleration[i] = a;
        }
    }
    let end = s.time[n - 1] - clock;
    if end <= 0.0 {
        out.ok = false;
        return out;
    }
    let mut i = forward_from;
    let (mut touch, mut deepest, mut leave) = (out.touch, f64::NAN, f64::NAN);
    let first = if s.kind == Kind::DropTest { 0.02 * s.duration } else { 0.5 * s.duration };
    let mut o = std::mem::take(&mut out);
    if let Some(e) = element {
        let (x, v) = rig.face(&y);
        e.borrow_mut().at = (0.0, x, v);
    }
    let ok = integrate(&mut rig, 0.0, &mut y, end, &Control { tolerance: TOLERANCE, first, largest, most }, |r, st| {
        let until = st.t0 + st.h;
        while i < n && s.time[i] - clock <= until + 1e-15 {
            let tau = s.time[i] - clock;
            let z = st.at((tau - st.t0) / st.h);
            put(&mut o, i, r, tau, &z);
            i += 1;
        }
        let z = st.at(1.0);
        let (x, v) = r.face(&z);
        if touch.is_nan() && x >= -1e-12 * s.depth {
            touch = until + clock;
        } else if !touch.is_nan() && deepest.is_nan() && v <= 0.0 {
            deepest = until + clock;
        } else if !deepest.is_nan() && leave.is_nan() && x <= 1e-9 * s.depth {
            leave = until + clock;
        }
    });
    out = o;
    out.ok = ok && i == n;
    let last = s.time[n - 1];
    out.touch = if touch.is_nan() { last } else { touch };
    out.deepest = if deepest.is_nan() { last } else { deepest };
    out.leave = if leave.is_nan() { last } else { leave };
    out
}

#[inline]
fn put(out: &mut Trace, i: usize, r: &Rig<'_>, t: f64, y: &State) {
    let (f, a) = r.outputs(t, y);
    out.force[i] = f;
    out.acceleration[i] = a;
    out.position[i] = y[0];
    out.velocity[i] = y[1];
}
