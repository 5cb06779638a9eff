//! One recording of a campaign simulated: approach, contact, flight, and what an ideal chain reads.

use super::integrate::{integrate, Control, State};
use super::rig::{Driven, Rig};
use crate::element::Element;
use law::{Memory, Parameters};
use mechanisms::load_history::LoadHistory;
use mechanisms::physics::Physics;
use record::Kind;
use std::cell::RefCell;

/// What the model has to know of one recording, SI.
#[derive(Clone, Debug)]
pub struct Setup {
    pub kind: Kind,
    /// Sample times on the recording's own clock, s.
    pub time: Vec<f64>,
    /// What the contact had taken before.
    pub history: LoadHistory,
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
    /// Error per step, relative to depth and speed of the impact.
    pub tolerance: f64,
}

impl Setup {
    /// A drop test sampled at `time` s, of an impact of that depth m, speed m/s and duration s.
    pub fn drop_test(time: Vec<f64>, depth: f64, speed: f64, duration: f64) -> Setup {
        Setup {
            kind: Kind::DropTest,
            time,
            history: LoadHistory::default(),
            travel: 0.0,
            preload: 0.0,
            rate: 0.0,
            imposed: Vec::new(),
            imposed_rate: Vec::new(),
            depth,
            speed,
            duration,
            tolerance: TOLERANCE,
        }
    }
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
    /// Recordings taken before this one.
    pub before: f64,
    /// False when the integrator gave up.
    pub ok: bool,
}

/// Error per step, relative to depth and speed of the impact, where it counts.
pub const TOLERANCE: f64 = 1e-7;
/// The same where candidates are sifted.
pub const COARSE: f64 = 3e-6;
/// Steps after which a recording is given up.
const MOST_STEPS: usize = 20_000;

/// The physics of one recording: what earlier ones have done to the contact, and its own stiffness.
fn scaled(p: &Physics, history: &LoadHistory, local: &Local) -> Physics {
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
    match s.kind {
        Kind::Indentation => indent(&p, s, local, None),
        _ => free(&p, s, local, None),
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
    element: Box<dyn Element>,
    steps: f64,
    physics: &Physics,
    s: &Setup,
    local: &Local,
) -> anyhow::Result<Trace> {
    let p = scaled(physics, &s.history, local);
    let driven = RefCell::new(Driven { element, steps, at: (0.0, 0.0, 0.0), failed: None });
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
    let mut t = Trace { ok: true, first_speed: s.imposed_rate[0], before: s.history.recordings, ..Trace::default() };
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
    Rig::new(p, s, None).motion_force(t, x, v) + p.mass * p.gravity
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
        before: s.history.recordings,
        ..Trace::default()
    };
    let clock = local.start;
    let mut y;
    let forward_from;
    let mut rig = Rig::new(p, s, element);
    let dt = s.time[1] - s.time[0];
    let (largest, most) = match element {
        None => ((s.duration * 2.0).max(dt * 4.0), MOST_STEPS),
        Some(e) => (s.duration / e.borrow().steps, 100 * MOST_STEPS),
    };
    if s.kind == Kind::DropTest {
        y = rig.along(0.0, local.speed);
        out.touch = clock;
        rig.fall_apart((clock - s.time[0]).max(0.0), &mut y);
        forward_from = s.time.partition_point(|t| *t < clock);
        if forward_from > 0 {
            // the approach, backwards from touch: only forces in flight act
            let mut rig = Rig::new(p, s, None).approaching();
            let mut back = y;
            rig.release(0.0, &mut back, true);
            let mut i = forward_from;
            let end = s.time[0] - clock;
            out.ok = integrate(
                &mut rig,
                0.0,
                &mut back,
                end,
                &Control { tolerance: s.tolerance, first: 0.1 * s.duration, largest, most },
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
        y = rig.along(-s.travel, 0.0);
        rig.release(0.0, &mut y, false);
        forward_from = s.time.partition_point(|t| *t < clock);
        // what was sampled just before release reads as at release: the instant is uncertain by a sample
        let [f, a, ..] = rig.outputs(0.0, &y);
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
        let (x, v) = rig.face_at(0.0, &y);
        e.borrow_mut().at = (0.0, x, v);
    }
    let ok =
        integrate(&mut rig, 0.0, &mut y, end, &Control { tolerance: s.tolerance, first, largest, most }, |r, st| {
            let until = st.t0 + st.h;
            while i < n && s.time[i] - clock <= until + 1e-15 {
                let tau = s.time[i] - clock;
                let z = st.at((tau - st.t0) / st.h);
                put(&mut o, i, r, tau, &z);
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
    let [f, a, x, v] = r.outputs(t, y);
    out.force[i] = f;
    out.acceleration[i] = a;
    out.position[i] = x;
    out.velocity[i] = v;
}
