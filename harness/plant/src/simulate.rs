//! One recording of a campaign simulated: approach, contact, flight, and what an ideal chain reads.

use super::coupled::coupled;
use super::integrate::{integrate, Advance, Control, Locate, State, Stepper};
use super::motion::{Contact, Motion, SURFACE, TURN};
use super::rig::{Driven, Rig};
pub use super::setup::{tolerance, Setup, COARSE, TOLERANCE};
use crate::element::{Direct, Element};
use anyhow::Result;
use law::{Memory, Parameters};
use mechanisms::load_history::LoadHistory;
use mechanisms::physics::Physics;
use record::Kind;
use std::cell::RefCell;

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
    /// Recordings taken before this one.
    pub before: f64,
    /// Channels that read something else than the motion above: force, acceleration, penetration.
    pub read: [Option<Vec<f64>>; 3],
    /// False when the integrator gave up.
    pub ok: bool,
}

impl Trace {
    pub(crate) fn blank(s: &Setup) -> Trace {
        let n = s.time.len();
        Trace {
            force: vec![0.0; n],
            acceleration: vec![0.0; n],
            position: vec![0.0; n],
            velocity: vec![0.0; n],
            touch: f64::NAN,
            deepest: f64::NAN,
            leave: f64::NAN,
            before: s.history.recordings,
            ..Trace::default()
        }
    }

    pub(crate) fn put(&mut self, i: usize, [f, a, x, v]: [f64; 4]) {
        self.force[i] = f;
        self.acceleration[i] = a;
        self.position[i] = x;
        self.velocity[i] = v;
    }

    /// Phases that were not reached end with the recording.
    pub(crate) fn end_phases(&mut self, last: f64) {
        for t in [&mut self.touch, &mut self.deepest, &mut self.leave] {
            if t.is_nan() {
                *t = last;
            }
        }
    }
}

/// Steps after which a recording is given up.
const MOST_STEPS: usize = 20_000;

/// The physics of one recording: what earlier ones have done to the contact, and its own stiffness.
pub(crate) fn scaled(p: &Physics, history: &LoadHistory, local: &Local) -> Physics {
    let mut q = *p;
    let (own, wear) = (local.stiffness.exp(), p.wear(history));
    let f = own * wear.stiffness;
    if let Some(speed) = p.damping_speed.filter(|_| local.speed > 0.0) {
        q.law.hysteresis_damping.coefficient *= speed / local.speed;
    }
    q.law.scale_stiffness(f);
    q.law.hysteresis_damping.coefficient *= own * wear.damping;
    q
}

/// Simulates one recording.
pub fn simulate(physics: &Physics, s: &Setup, local: &Local) -> Trace {
    let p = scaled(physics, &s.history, local);
    // the law called directly refuses nothing
    match (s.kind, s.control.locate) {
        (Kind::Indentation, _) => indent(&p, s, local, None),
        (Kind::System, _) => {
            let stiffness = local.stiffness.exp() * physics.wear(&s.history).stiffness;
            coupled(&p, s, local, stiffness)
        }
        (_, Locate::Polynomial) => free(&p, s, local, None).unwrap_or_default(),
        (_, Locate::Step) => {
            let mut law = Direct::new(p.law);
            let remembers = p.law.relaxes();
            followed(&p, s, local, &Contact::new(&mut law), remembers, &s.control).unwrap_or_default()
        }
    }
}

/// The law a recording is simulated with: `physics` with what this recording differs by.
pub fn law_of(physics: &Physics, s: &Setup, local: &Local) -> Parameters {
    scaled(physics, &s.history, local).law
}

/// As [`simulate`], with `element` in the law's place and at least `steps` steps a contact.
///
/// # Errors
/// The first thing the element refuses.
pub fn simulate_on(
    mut element: Box<dyn Element>,
    steps: f64,
    physics: &Physics,
    s: &Setup,
    local: &Local,
) -> Result<Trace> {
    let p = scaled(physics, &s.history, local);
    if s.kind != Kind::Indentation && s.control.locate == Locate::Step {
        let control = Control { longest: s.control.longest.min(s.duration / steps), ..s.control };
        return followed(&p, s, local, &Contact::new(element.as_mut()), true, &control);
    }
    let driven = RefCell::new(Driven::new(element.as_mut()));
    let trace = match s.kind {
        Kind::Indentation => indent(&p, s, local, Some(&driven)),
        _ => free(&p, s, local, Some((&driven, steps)))?,
    };
    driven.borrow_mut().check()?;
    Ok(trace)
}

fn indent(p: &Physics, s: &Setup, local: &Local, element: Option<&RefCell<Driven<'_>>>) -> Trace {
    let n = s.time.len();
    let mut t = Trace { ok: true, first_speed: s.imposed_rate[0], before: s.history.recordings, ..Trace::default() };
    let mut m = Memory::default();
    let mut cracked = false;
    for i in 0..n {
        let (x, v) = (s.imposed[i] - local.offset, s.imposed_rate[i]);
        let x0 = if i > 0 { s.imposed[i - 1] - local.offset } else { x };
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
                    m = p.law.remembered(&m, x0, x, s.time[i] - s.time[i - 1]);
                }
                p.law.force(&m, x, v)
            }
        };
        if f > p.fracture.load {
            cracked = true;
        }
        if cracked {
            f *= 1.0 - p.fracture.drop;
        }
        f += p.on_face(x, v);
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

/// Forces on the body along +x other than contact, N: at `t` s after release or touch, position `x` m, speed `v` m/s.
pub fn force_on_body(p: &Physics, s: &Setup, t: f64, x: f64, v: f64) -> f64 {
    s.motion_force(p, t, x, v) + p.mass * p.gravity
}

/// `element`: what takes the law's place, and steps a contact gets at least: the memory moves at accepted steps only, so
/// what the element remembers is right to first order in their length.
fn free<'a>(
    p: &'a Physics,
    s: &'a Setup,
    local: &Local,
    element: Option<(&'a RefCell<Driven<'a>>, f64)>,
) -> Result<Trace> {
    let n = s.time.len();
    let mut out = Trace::blank(s);
    let clock = local.start;
    let mut y;
    let forward_from;
    let mut rig = Rig::new(p, s, element.map(|e| e.0));
    let dt = s.time[1] - s.time[0];
    let (longest, most) = match element {
        None => ((s.duration * 2.0).max(dt * 4.0), MOST_STEPS),
        Some((_, steps)) => (s.duration / steps, 100 * MOST_STEPS),
    };
    let within = |first: f64| Control {
        first: s.control.first.min(first),
        longest: s.control.longest.min(longest),
        most: s.control.most.min(most),
        ..s.control
    };
    if s.kind == Kind::DropTest {
        y = rig.along(0.0, local.speed);
        out.touch = clock;
        rig.fall_apart((clock - s.beginning()).max(0.0), &mut y);
        forward_from = s.time.partition_point(|t| *t < clock);
        out.ok = approach(p, s, local, y, &within(0.1 * s.duration), &mut out)?;
        if !out.ok {
            return Ok(out);
        }
        // a pull that reaches out before touch acts from the surface on; leaving it needs the full law
    } else {
        y = rig.along(-s.travel, 0.0);
        rig.release(0.0, &mut y, false);
        forward_from = s.time.partition_point(|t| *t < clock);
        // what was sampled just before release reads as at release: the instant is uncertain by a sample
        let [f, a, ..] = rig.outputs(0.0, &y);
        (0..forward_from).for_each(|i| out.put(i, [f, a, -s.travel, 0.0]));
    }
    let end = s.time[n - 1] - clock;
    if end <= 0.0 {
        out.ok = false;
        return Ok(out);
    }
    let mut i = forward_from;
    let (mut touch, mut deepest, mut leave) = (out.touch, f64::NAN, f64::NAN);
    let first = if s.kind == Kind::DropTest { 0.02 * s.duration } else { 0.5 * s.duration };
    let mut o = std::mem::take(&mut out);
    if let Some((e, _)) = element {
        let (x, v) = rig.face_at(0.0, &y);
        e.borrow_mut().at = (0.0, x, v);
    }
    let ok = integrate(&mut rig, 0.0, &mut y, end, &within(first), |r, st| {
        let until = st.t0 + st.h;
        while i < n && s.time[i] - clock <= until + 1e-15 {
            let tau = s.time[i] - clock;
            let z = st.at((tau - st.t0) / st.h);
            o.put(i, r.outputs(tau, &z));
            i += 1;
        }
        let z = st.at(1.0);
        let (x, v) = r.face_at(until, &z);
        if touch.is_nan() && x >= -1e-12 * s.depth {
            touch = until + clock;
        } else if !touch.is_nan() && deepest.is_nan() && v <= 0.0 {
            deepest = until + clock;
        } else if !deepest.is_nan() && leave.is_nan() && x <= 1e-9 * s.depth {
            leave = until + clock;
        }
    })?;
    out = o;
    out.ok = ok && i == n;
    (out.touch, out.deepest, out.leave) = (touch, deepest, leave);
    out.end_phases(s.time[n - 1]);
    Ok(out)
}

/// The approach before a drop test's touch, backwards from the state `y` at touch: only forces in flight act. Whether
/// the integration reached the first sample.
fn approach(p: &Physics, s: &Setup, local: &Local, y: State, control: &Control, out: &mut Trace) -> Result<bool> {
    let clock = local.start;
    let mut i = s.time.partition_point(|t| *t < clock);
    if i == 0 && s.beginning() >= clock {
        out.first_speed = local.speed;
        return Ok(true);
    }
    let mut rig = Rig::new(p, s, None).approaching();
    let mut back = y;
    rig.release(0.0, &mut back, true);
    let ok = integrate(&mut rig, 0.0, &mut back, s.beginning() - clock, control, |r, st| {
        let until = st.t0 + st.h;
        while i > 0 && s.time[i - 1] - clock >= until - 1e-15 {
            let tau = s.time[i - 1] - clock;
            let z = st.at((tau - st.t0) / st.h);
            out.put(i - 1, r.outputs(tau, &z));
            i -= 1;
        }
    })?;
    if ok {
        out.first_speed = back[1];
    }
    Ok(ok)
}

/// A recording whose motion is followed from event to event, as a scenario's is: a sample at the end of a step reads
/// what holds once the step is accepted.
fn followed<'a>(
    p: &'a Physics,
    s: &'a Setup,
    local: &Local,
    contact: &'a Contact<'a>,
    remembers: bool,
    control: &Control,
) -> Result<Trace> {
    let (n, clock) = (s.time.len(), local.start);
    let mut out = Trace::blank(s);
    let mut motion = Motion::new([p, p], s, contact, remembers);
    let mut i = s.time.partition_point(|t| *t < clock);
    let y = if s.kind == Kind::DropTest {
        let mut y = motion.start(0.0, 0.0, local.speed);
        motion.fall_apart((clock - s.beginning()).max(0.0), &mut y);
        out.touch = clock;
        let first = Control { first: control.first.min(0.1 * s.duration), ..*control };
        out.ok = approach(p, s, local, y, &first, &mut out)?;
        if !out.ok {
            return Ok(out);
        }
        y
    } else {
        let y = motion.start(0.0, -s.travel, 0.0);
        let [f, a, ..] = motion.outputs(0.0, &y)?;
        (0..i).for_each(|i| out.put(i, [f, a, -s.travel, 0.0]));
        y
    };
    let end = s.time[n - 1] - clock;
    if end <= 0.0 {
        out.ok = false;
        return Ok(out);
    }
    let mut stepper = Stepper::new(&motion, 0.0, &y, end, control)?;
    out.ok = true;
    loop {
        let now = stepper.time();
        while i < n && s.time[i] - clock <= now {
            out.put(i, motion.outputs(now, stepper.state())?);
            i += 1;
        }
        if stepper.done() {
            break;
        }
        let mut refused = None;
        let step = stepper.advance(&mut motion, &mut |m: &Motion<'_>, st| {
            while i < n && refused.is_none() && s.time[i] - clock < st.t0 + st.h {
                let tau = s.time[i] - clock;
                match m.outputs(tau, &st.at((tau - st.t0) / st.h)) {
                    Ok(o) => out.put(i, o),
                    Err(e) => refused = Some(e),
                }
                i += 1;
            }
        })?;
        if let Some(e) = refused {
            return Err(e);
        }
        let now = stepper.time() + clock;
        match step {
            Advance::GaveUp => {
                out.ok = false;
                break;
            }
            Advance::Step(Some(SURFACE)) if motion.inside() => out.touch = first(out.touch, now),
            Advance::Step(Some(SURFACE)) => out.leave = first(out.leave, now),
            Advance::Step(Some(TURN)) if motion.inside() => out.deepest = first(out.deepest, now),
            Advance::Step(_) => {}
        }
    }
    // rounding may leave the end a hair before the last sample
    while out.ok && i < n {
        out.put(i, motion.outputs(end, stepper.state())?);
        i += 1;
    }
    out.end_phases(s.time[n - 1]);
    Ok(out)
}

/// An instant that is known already, or else this one.
fn first(known: f64, now: f64) -> f64 {
    if known.is_nan() {
        now
    } else {
        known
    }
}
