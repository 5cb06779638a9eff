//! A recording simulated by FMUs, with the mechanisms of our rig at their bonds.
//!
//! At every bond stands a rig of ours that foresees the motion over a step: the mass that a force there moves, the law
//! that the contact nearly follows, and whatever mechanism is tried. The FMUs are given the force that this motion takes, by
//! its impulse and its moment, and step. Where they have come is what holds: the rig is put there, and what it had
//! not foreseen is the force on the body, and the difference of the contact's force, that it reckons with over the next step
//! (a model-based corrector: Haid, Watzenig and Stettinger 2022). So a step need only
//! resolve what the rig does not know. No step is taken back, and none straddles a touch.

use crate::integrate::{Advance, Control, State, Stepper};
use crate::machine::{Extrapolated, Push, Reads, Running, Seat};
use crate::rig::motion::SURFACE;
use crate::rig::{Line, Outer, Rig};
use crate::setup::Setup;
use crate::simulate::{Local, Trace};
use anyhow::{ensure, Result};
use law::{Memory, Parameters};
use mechanisms::physics::Physics;
use record::Kind;

/// Steps a contact gets at the coarsest; a flight gets longer ones.
const CONTACT: f64 = 6.0;
const FLIGHT: f64 = 4.0;
/// Samples that a step holds at most where an output of the FMUs is read between their steps.
const SAMPLES: f64 = 2.0;
/// Share of a contact's step that the first step after the start takes, and the first after a touch where steps are halved.
const FIRST: f64 = 1.0 / 64.0;
/// Growth of the steps after a touch.
const GROWTH: f64 = 0.6;
/// Share of a contact's step over which the force on the body is averaged.
const WINDOW: f64 = 0.75;
/// Share of a contact's step below which a push is held.
const SHORT: f64 = 1e-3;
/// Steps after which a recording is given up.
const MOST_STEPS: usize = 200_000;
/// Accepted steps of a rig within one of the FMUs after which it is given up.
const MOST_WITHIN: usize = 20_000;

/// A bond and its rig.
struct Side<'a> {
    bond: usize,
    rig: Rig<'a>,
    y: State,
    /// The law of the contact as the FMUs have it, nearly.
    bare: Option<Parameters>,
    inside: bool,
    told: bool,
    mass: f64,
    gravity: f64,
    spring: (f64, f64),
    /// Factor on what the contact's force differs by.
    stiffness: f64,
    drive: Extrapolated,
    offset: Extrapolated,
    /// What another FMU gives that is no contact's, N.
    fed: Option<Extrapolated>,
    /// Impulse not foreseen since `since`, N s, and the mean of the drive reckoned with.
    gap: f64,
    reckoned: f64,
    since: f64,
    /// Drive of the last flight, N.
    in_flight: f64,
    touched: f64,
    first: f64,
}

/// What a rig foresees over a step.
struct Foreseen {
    /// Where it came to, s.
    end: f64,
    /// Force of the contact inside the FMU, its integral and first moment from the start, N s and N s^2.
    inside: (f64, f64),
}

impl<'a> Side<'a> {
    /// Begins anew at `t` s from (`x`, `v`), everything at rest on the body, once what drives it is known.
    fn begin(&mut self, t: f64, (x, v): (f64, f64), p: &'a Physics, s: &'a Setup) {
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
    fn foresee(
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
        let (bare, told) = (self.bare.filter(|_| self.inside), self.told);
        let offset = self.offset.line;
        let (mut impulse, mut moment) = (0.0, 0.0);
        let mut i = 0;
        while !stepper.done() {
            let mut each = |r: &Rig<'_>, st: &crate::integrate::Step| {
                let until = st.t0 + st.h;
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
                        let more = if told { offset.of(at) } else { 0.0 };
                        let f = weight * st.h * (law.force(&Memory::default(), x, v) + more);
                        impulse += f;
                        moment += f * (at - t);
                    }
                }
            };
            match stepper.advance(&mut self.rig, &mut each)? {
                Advance::GaveUp => return Ok(None),
                Advance::Step(Some(SURFACE)) if stepper.time() > t => break,
                Advance::Step(_) => {}
            }
        }
        self.y = *stepper.state();
        self.first = (stepper.time() - t).max(1e-3 * (stop - t));
        Ok(Some(Foreseen { end: stepper.time(), inside: (impulse, moment) }))
    }

    fn scaled_offset(&self) -> Line {
        let l = self.offset.line;
        Line { at: self.stiffness * l.at, slope: self.stiffness * l.slope, ..l }
    }

    /// The push that gives the FMU's body, from (`x`, `v`) at `t`, the motion foreseen. `held`: as one value.
    fn push(&self, t: f64, (x, v): (f64, f64), f: &Foreseen, held: bool) -> Push {
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
        let [_, acceleration, ..] = self.rig.outputs(f.end, &self.y);
        let touching = self.inside && x1 > 0.0;
        let of_contact = if touching { self.bare_force(x1, v1) + self.offset_inside(f.end) } else { 0.0 };
        let drive = self.drive.line.of(f.end) - rate * x1 - damping * v1;
        let end = drive - self.mass * acceleration - of_contact;
        let slope = if held { 0.0 } else { (6.0 * impulse * h - 12.0 * moment) / (h * h * h) };
        let fed = self.fed.map_or(Line::default(), |f| f.line);
        Push { start: impulse / h - 0.5 * slope * h + fed.of(t), slope: slope + fed.slope, end: end + fed.of(f.end) }
    }

    fn offset_inside(&self, t: f64) -> f64 {
        if self.told {
            self.offset.line.of(t)
        } else {
            0.0
        }
    }

    /// Puts the rig where the FMU has come: (`x`, `v`) at `t`, after a step of `h`; and keeps what it had not foreseen.
    fn put(&mut self, t: f64, h: f64, to: (f64, f64), window: f64) -> (f64, f64) {
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

    /// Keeps what the contact's force differs by at `t`, where the face is at (`x`, `v`) and the contact told `force`.
    fn compare(&mut self, t: f64, (x, v): (f64, f64), force: f64) {
        if let Some(fed) = &mut self.fed {
            fed.take(t, force);
        }
        if !self.told {
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

/// Simulates a recording of FMUs; a trace that is not ok where they refuse, which the machine then keeps. `stiffness`:
/// factor on the stiffness of the contact.
pub(super) fn coupled(p: &Physics, s: &Setup, local: &Local, stiffness: f64) -> Trace {
    let mut out = Trace::blank(s);
    let Some(seat) = &s.machine else { return out };
    let done = seat.machine.run(seat.set, &p.free, &mut |running| {
        out = Trace::blank(s);
        follow(p, s, seat, local, stiffness, running, &mut out)
    });
    if let Err(e) = done {
        out.ok = false;
        seat.machine.keep_trouble(&e);
    }
    out
}

/// What a rig at a bond has to know: sizes for its errors, and no samples.
fn setup_of(s: &Setup, travel: f64) -> Setup {
    Setup {
        kind: Kind::System,
        travel,
        history: s.history,
        control: s.control,
        ..Setup::drop_test(Vec::new(), s.depth, s.speed, s.duration)
    }
}

fn follow(
    p: &Physics,
    s: &Setup,
    seat: &Seat,
    local: &Local,
    stiffness: f64,
    running: &mut dyn Running,
    out: &mut Trace,
) -> Result<()> {
    let facts = seat.machine.facts();
    let bonds: Vec<usize> = (0..facts.bonds.len()).filter(|b| facts.bonds[*b].takes_force).collect();
    let setups: Vec<Setup> = bonds.iter().map(|b| setup_of(s, (-running.motion(*b).0).max(0.0))).collect();
    let physics: Vec<Physics> = bonds
        .iter()
        .map(|b| {
            let of = &facts.bonds[*b];
            let bare = of.law.map(|l| l.of(&p.free)).unwrap_or_else(|| Parameters::power_law(0.0, 1.0, 0.0));
            let plain = Physics { law: bare, gravity: facts.gravity, ..Physics::default() };
            let at = if *b == p.bond { Physics { gravity: facts.gravity, ..*p } } else { plain };
            Physics { mass: of.mass.of(&p.free).exp(), ..at }
        })
        .collect();
    let mut sides: Vec<Side<'_>> = Vec::new();
    for ((b, setup), of) in bonds.iter().zip(&setups).zip(&physics) {
        let mut rig = Rig::new(of, setup, None);
        let (x, v) = running.motion(*b);
        let mut y = rig.along(x, v);
        rig.release(0.0, &mut y, false);
        let facts = &facts.bonds[*b];
        sides.push(Side {
            bond: *b,
            rig,
            y,
            bare: facts.law.map(|l| l.of(&p.free)),
            inside: facts.inside,
            told: facts.told,
            mass: of.mass,
            gravity: of.gravity,
            spring: facts.spring,
            stiffness: if *b == p.bond { stiffness } else { 1.0 },
            drive: Extrapolated::default(),
            offset: Extrapolated::default(),
            fed: facts.fed.then(|| {
                let mut fed = Extrapolated::default();
                fed.anew(0.0, running.contact(*b));
                fed
            }),
            gap: 0.0,
            reckoned: 0.0,
            since: 0.0,
            in_flight: 0.0,
            touched: f64::NAN,
            first: f64::INFINITY,
        });
    }
    Run { s, seat, local, running, out, sides, of: physics.iter().zip(&setups).collect() }.go(p.bond)
}

/// A recording under way.
struct Run<'a, 'b> {
    s: &'a Setup,
    seat: &'a Seat,
    local: &'a Local,
    running: &'a mut dyn Running,
    out: &'a mut Trace,
    sides: Vec<Side<'b>>,
    /// What the rigs of the sides are made of.
    of: Vec<(&'b Physics, &'b Setup)>,
}

impl Run<'_, '_> {
    /// Length of the next step at `t`, s.
    fn step(&self, t: f64) -> f64 {
        let facts = self.seat.machine.facts();
        let finer = f64::from(1u32 << self.seat.level);
        if let Some(h) = facts.fixed_step {
            return h;
        }
        let in_contact = self.s.duration / (CONTACT * finer);
        if t == 0.0 {
            return FIRST * in_contact;
        }
        let mut h = FLIGHT * in_contact;
        for side in &self.sides {
            if side.rig.face_at(t, &side.y).0 >= 0.0 {
                let since = t - side.touched;
                let graded = if self.seat.level > 0 && since.is_finite() {
                    (GROWTH * since).max(FIRST * in_contact)
                } else {
                    in_contact
                };
                h = h.min(in_contact.min(graded));
            }
        }
        if self.sides.is_empty() || facts.channels.contains(&Some(Reads::Output)) {
            let n = self.s.time.len();
            let dt = (self.s.time[n - 1] - self.s.time[0]) / (n - 1) as f64;
            h = h.min(SAMPLES * dt / finer);
        }
        h
    }

    fn go(mut self, watched: usize) -> Result<()> {
        let (s, clock) = (self.s, self.local.start);
        let n = s.time.len();
        let end = s.time[n - 1] - clock;
        let times: Vec<f64> = s.time.iter().map(|t| t - clock).collect();
        let mut i = times.partition_point(|t| *t < 0.0);
        let control = Control {
            longest: s.control.longest.min(2.0 * s.duration),
            most: s.control.most.min(MOST_WITHIN),
            ..s.control
        };
        let window = WINDOW * s.duration / CONTACT;
        let facts = self.seat.machine.facts();
        let reads = facts.channels;
        let mut points: [Vec<(f64, f64)>; 3] = Default::default();
        let mut other: [Option<Vec<f64>>; 3] = [0, 1, 2].map(|c| match reads[c] {
            Some(Reads::Bond(b)) if b != watched => Some(vec![0.0; n]),
            _ => None,
        });
        let watch = self.sides.iter().position(|d| d.bond == watched);
        let mut rows: Vec<Vec<[f64; 4]>> = vec![Vec::new(); self.sides.len()];
        let mut paths = vec![(0.0, self.running.motion(watched.min(facts.bonds.len().max(1) - 1)))];
        let early = i;
        self.note(0.0, &mut points);
        let (mut t, mut steps) = (0.0, 0);
        while t < end - 1e-12 * end.abs() {
            steps += 1;
            ensure!(steps < MOST_STEPS, "{steps} steps do not reach the end of the recording");
            let whole = facts.fixed_step.is_some();
            let mut stop = if whole { t + self.step(t) } else { (t + self.step(t)).min(end) };
            let ahead = times[i..].partition_point(|u| *u <= stop) + i;
            let before: Vec<(f64, f64)> = self.sides.iter().map(|d| self.running.motion(d.bond)).collect();
            let kept: Vec<(Rig<'_>, State)> = if self.sides.len() > 1 || whole {
                self.sides.iter().map(|d| (d.rig.clone(), d.y)).collect()
            } else {
                Vec::new()
            };
            let mut foreseen: Vec<Foreseen> = Vec::new();
            let mut k = 0;
            while k < self.sides.len() {
                let Some(f) = self.sides[k].foresee(t, stop, &times[i..ahead], &control, &mut rows[k])? else {
                    return Ok(());
                };
                let earlier = f.end < stop - 1e-14 * (1.0 + stop.abs());
                if earlier && whole {
                    // its FMUs end no step at a touch: on over it
                    let done = std::mem::take(&mut rows[k]);
                    let from = f.end;
                    let rest = &times[(i + done.len()).min(ahead)..ahead];
                    let mut more = Vec::new();
                    let mut inside = f.inside;
                    let mut at = from;
                    while at < stop - 1e-14 * (1.0 + stop.abs()) {
                        let left = &rest[more.len().min(rest.len())..];
                        let mut piece = Vec::new();
                        let Some(g) = self.sides[k].foresee(at, stop, left, &control, &mut piece)? else {
                            return Ok(());
                        };
                        inside = (inside.0 + g.inside.0, inside.1 + g.inside.1 + g.inside.0 * (at - t));
                        more.extend(piece);
                        at = g.end;
                    }
                    rows[k] = done;
                    rows[k].extend(more);
                    foreseen.push(Foreseen { end: stop, inside });
                    k += 1;
                    continue;
                }
                if earlier && !kept.is_empty() && k > 0 {
                    // all of them have to end there
                    stop = f.end;
                    for (side, (rig, y)) in self.sides.iter_mut().zip(&kept) {
                        (side.rig, side.y) = (rig.clone(), *y);
                    }
                    foreseen.clear();
                    k = 0;
                    continue;
                }
                stop = f.end;
                foreseen.push(f);
                k += 1;
            }
            let h = stop - t;
            let short = h < SHORT * s.duration / CONTACT;
            let mut pushes = vec![Push::default(); facts.bonds.len()];
            for ((side, f), from) in self.sides.iter().zip(&foreseen).zip(&before) {
                pushes[side.bond] = side.push(t, *from, f, short);
            }
            self.running.advance(h, &pushes)?;
            let mut faces = vec![(0.0, 0.0); facts.bonds.len()];
            for (b, face) in faces.iter_mut().enumerate() {
                *face = self.running.motion(b);
            }
            let done = times[i..].partition_point(|u| *u <= stop) + i;
            for (k, side) in self.sides.iter_mut().enumerate() {
                let off = side.put(stop, h, faces[side.bond], window);
                faces[side.bond] = side.rig.face_at(stop, &side.y);
                for (j, row) in rows[k].iter().take(done - i).enumerate() {
                    let share = ((times[i + j] - t) / h).clamp(0.0, 1.0);
                    let [f, a, x, v] = *row;
                    let row = [f, a + off.1 / h, x + off.0 * share * share, v + off.1 * share];
                    put(self.out, &mut other, reads, (side.bond, watched), i + j, row);
                }
            }
            if steps == 1 {
                for (side, (p, s)) in self.sides.iter_mut().zip(&self.of) {
                    side.begin(stop, self.running.motion(side.bond), p, s);
                    faces[side.bond] = side.rig.face_at(stop, &side.y);
                    // what was sampled before the start reads as at the start, which is uncertain by a sample
                    let row = side.rig.outputs(stop, &side.y);
                    for j in 0..early {
                        put(self.out, &mut other, reads, (side.bond, watched), j, row);
                    }
                }
            }
            self.running.follow(&faces)?;
            for side in &mut self.sides {
                side.compare(stop, faces[side.bond], self.running.contact(side.bond));
            }
            if let Some(w) = watch {
                self.phase(w, stop + clock);
            } else if !facts.bonds.is_empty() {
                paths.push((stop, self.running.motion(watched.min(facts.bonds.len() - 1))));
            }
            self.touches(stop, before.iter().map(|b| b.0));
            self.note(stop, &mut points);
            (t, i) = (stop, done);
        }
        self.finish(&times, i, reads, &points, other, if watch.is_none() { &paths } else { &[] });
        Ok(())
    }

    /// What the outputs tell at `t`.
    fn note(&self, t: f64, points: &mut [Vec<(f64, f64)>; 3]) {
        for (c, points) in points.iter_mut().enumerate() {
            if self.seat.machine.facts().channels[c] == Some(Reads::Output) {
                points.push((t, self.running.output(c)));
            }
        }
    }

    /// Touches and partings between the positions before the step and now.
    fn touches(&mut self, t: f64, before: impl Iterator<Item = f64>) {
        for (side, x0) in self.sides.iter_mut().zip(before) {
            let x = side.rig.face_at(t, &side.y).0;
            let near = 1e-9 * self.s.depth;
            if x >= -near && x0 < -near {
                side.touched = t;
                side.in_flight = side.drive.line.of(t);
            } else if x <= near && x0 > near && side.inside && !side.told {
                // what the contact's law was off by is over
                side.drive.anew(t, side.in_flight);
                (side.gap, side.reckoned, side.since) = (0.0, 0.0, t);
            }
        }
    }

    /// Phases of the first impact at the side watched, at `now` on the recording's clock.
    fn phase(&mut self, watch: usize, now: f64) {
        let side = &self.sides[watch];
        let (x, v) = side.rig.face_at(now - self.local.start, &side.y);
        let depth = self.s.depth;
        let out = &mut *self.out;
        if out.touch.is_nan() && x >= -1e-9 * depth {
            out.touch = now;
        } else if !out.touch.is_nan() && out.deepest.is_nan() && v <= 0.0 {
            out.deepest = now;
        } else if !out.deepest.is_nan() && out.leave.is_nan() && x <= 1e-9 * depth {
            out.leave = now;
        }
    }

    /// Ends the trace: what is read between the FMUs' steps, and a motion that no rig has followed.
    fn finish(
        self,
        times: &[f64],
        i: usize,
        reads: [Option<Reads>; 3],
        points: &[Vec<(f64, f64)>; 3],
        other: [Option<Vec<f64>>; 3],
        path: &[(f64, (f64, f64))],
    ) {
        let out = self.out;
        out.read = other;
        for (c, read) in reads.iter().enumerate() {
            if *read == Some(Reads::Output) {
                out.read[c] = Some(times.iter().map(|t| between(&points[c], *t)).collect());
            }
        }
        if path.len() > 1 {
            let of = |pick: fn(&(f64, f64)) -> f64| path.iter().map(|(t, m)| (*t, pick(m))).collect::<Vec<_>>();
            let (x, v) = (of(|m| m.0), of(|m| m.1));
            out.position = times.iter().map(|t| between(&x, *t)).collect();
            out.velocity = times.iter().map(|t| between(&v, *t)).collect();
            if let Some(f) = &out.read[0] {
                out.force.clone_from(f);
            }
            let at = |k: Option<usize>| k.map_or(f64::NAN, |k| self.s.time[k]);
            let touch = out.position.iter().position(|x| *x > 0.0);
            let deepest = touch.and_then(|k| (k..times.len()).find(|k| out.velocity[*k] <= 0.0));
            let leave = deepest.and_then(|k| (k..times.len()).find(|k| out.position[*k] <= 0.0));
            (out.touch, out.deepest, out.leave) = (at(touch), at(deepest), at(leave));
        }
        let n = times.len();
        out.first_speed = out.velocity.first().copied().unwrap_or(0.0);
        let finite = out.read.iter().flatten().all(|y| y.iter().all(|v| v.is_finite()));
        out.ok = (self.sides.is_empty() || i == n) && finite && out.position.iter().all(|x| x.is_finite());
        out.end_phases(self.s.time[n - 1]);
    }
}

/// Puts a bond's row of force N, acceleration m/s^2, position m and speed m/s where they are read.
fn put(
    out: &mut Trace,
    other: &mut [Option<Vec<f64>>; 3],
    reads: [Option<Reads>; 3],
    (bond, watched): (usize, usize),
    i: usize,
    row: [f64; 4],
) {
    if bond == watched {
        out.put(i, row);
    }
    for c in 0..3 {
        if let (Some(Reads::Bond(b)), Some(y)) = (reads[c], &mut other[c]) {
            if b == bond {
                y[i] = row[c];
            }
        }
    }
}

/// Value at `t` on the cubic through the four points about it (Lagrange); on the nearest ones at the ends.
fn between(points: &[(f64, f64)], t: f64) -> f64 {
    let n = points.len();
    if n < 4 || t <= points[0].0 {
        return points.first().map_or(f64::NAN, |p| p.1);
    }
    let next = points.partition_point(|p| p.0 <= t).min(n - 1);
    let from = next.saturating_sub(2).min(n - 4);
    let near = &points[from..from + 4];
    let mut sum = 0.0;
    for (j, (tj, yj)) in near.iter().enumerate() {
        let mut w = 1.0;
        for (k, (tk, _)) in near.iter().enumerate() {
            if k != j && tj != tk {
                w *= (t - tk) / (tj - tk);
            }
        }
        sum += w * yj;
    }
    sum
}
