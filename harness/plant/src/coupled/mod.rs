//! A recording simulated by FMUs, with the mechanisms of our rig at their bonds.
//!
//! At every bond stands a rig of ours that foresees the motion over a step: the mass that a force there moves, the law
//! that the contact nearly follows, and whatever mechanism is tried. The FMUs are given the force that this motion takes, by
//! its impulse and its moment, and step. Where they have come is what holds: the rig is put there, and what it had
//! not foreseen is the force on the body, and the difference of the contact's force, that it reckons with over the next step
//! (a model-based corrector: Haid, Watzenig and Stettinger 2022). So a step need only
//! resolve what the rig does not know. No step is taken back, and none straddles a touch. An acceleration that the FMU reports
//! is read at the ends of a step from the FMU, and between them as the rig has it.

mod read;
mod side;

use crate::integrate::{Control, State};
use crate::machine::{Extrapolated, Push, Reads, Running, Seat};
use crate::rig::Rig;
use crate::setup::Setup;
use crate::simulate::{Local, Trace};
use anyhow::{ensure, Result};
use law::Parameters;
use mechanisms::physics::Physics;
use read::{between, put};
use record::Kind;
use side::{earliest, Foreseen, Side};

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
/// Short steps in a row after which one passes over touches and partings: a body that lies on a stop with nothing to hold it there
/// parts and touches without end.
const CHATTER: usize = 8;
/// Steps after which a recording is given up.
const MOST_STEPS: usize = 200_000;
/// Accepted steps of a rig within one of the FMUs after which it is given up.
const MOST_WITHIN: usize = 20_000;

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
            reported: facts.reported,
            touches: facts.is_contact || facts.law.is_some(),
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
    Run { s, seat, local, running, out, sides, breaks: Vec::new(), of: physics.iter().zip(&setups).collect() }
        .go(p.bond)
}

/// A recording under way.
struct Run<'a, 'b> {
    s: &'a Setup,
    seat: &'a Seat,
    local: &'a Local,
    running: &'a mut dyn Running,
    out: &'a mut Trace,
    sides: Vec<Side<'b>>,
    /// When contacts have begun and ended, s.
    breaks: Vec<f64>,
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
            if !side.touches {
                // what pushes a body pushes it wherever it is
                h = h.min(in_contact);
            } else if side.rig.face_at(t, &side.y).0 >= 0.0 {
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
        let (mut t, mut steps, mut in_a_row) = (0.0, 0, 0);
        while t < end - 1e-12 * end.abs() {
            steps += 1;
            ensure!(steps < MOST_STEPS, "{steps} steps do not reach the end of the recording");
            let whole = facts.fixed_step.is_some();
            let mut stop = if whole { t + self.step(t) } else { (t + self.step(t)).min(end) };
            let ahead = times[i..].partition_point(|u| *u <= stop) + i;
            let before: Vec<(f64, f64)> = self.sides.iter().map(|d| self.running.motion(d.bond)).collect();
            let kept: Vec<(Rig<'_>, State)> = if self.sides.len() > 1 {
                self.sides.iter().map(|d| (d.rig.clone(), d.y)).collect()
            } else {
                Vec::new()
            };
            let over = whole || in_a_row >= CHATTER;
            let mut foreseen: Vec<Foreseen> = Vec::new();
            let mut k = 0;
            while k < self.sides.len() {
                let (side, rows) = (&mut self.sides[k], &mut rows[k]);
                let samples = &times[i..ahead];
                let f = if over {
                    side.foresee_over(t, stop, samples, &control, rows)?
                } else {
                    side.foresee(t, stop, samples, &control, rows)?
                };
                let Some(f) = f else { return Ok(()) };
                if f.end < earliest(stop) && k > 0 {
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
            in_a_row = if short { in_a_row + 1 } else { 0 };
            let mut pushes = vec![Push::default(); facts.bonds.len()];
            for ((side, f), from) in self.sides.iter().zip(&foreseen).zip(&before) {
                pushes[side.bond] = side.push(t, *from, f, short);
            }
            let accelerated = self.running.output(1);
            self.running.advance(h, &pushes)?;
            let mut faces = vec![(0.0, 0.0); facts.bonds.len()];
            for (b, face) in faces.iter_mut().enumerate() {
                *face = self.running.motion(b);
            }
            let done = times[i..].partition_point(|u| *u <= stop) + i;
            // before the first step nothing is known of what drives the body
            let reads_at_ends = |side: &Side<'_>| steps > 1 && reads[1] == Some(Reads::Bond(side.bond));
            let share_at = |u: f64| ((u - t) / h).clamp(0.0, 1.0);
            for (k, side) in self.sides.iter_mut().enumerate() {
                let off = side.put(stop, h, faces[side.bond], window);
                faces[side.bond] = side.rig.face_at(stop, &side.y);
                for (j, row) in rows[k].iter().take(done - i).enumerate() {
                    let share = share_at(times[i + j]);
                    let [f, a, x, v] = *row;
                    let a = if reads_at_ends(side) { a } else { a + off.1 / h };
                    let row = [f, a, x + off.0 * share * share, v + off.1 * share];
                    put(self.out, &mut other, reads, (side.bond, watched), i + j, row);
                }
            }
            if steps == 1 {
                for ((side, (p, s)), start) in self.sides.iter_mut().zip(&self.of).zip(&before) {
                    side.begin(stop, self.running.motion(side.bond), p, s);
                    faces[side.bond] = side.rig.face_at(stop, &side.y);
                    // what was sampled before the start reads as at the start, which is uncertain by a sample; what acts
                    // there is known from the first step
                    let [f, a, ..] = side.rig.outputs(stop, &side.y);
                    let row = [f, a, start.0, start.1];
                    for j in 0..early {
                        put(self.out, &mut other, reads, (side.bond, watched), j, row);
                    }
                }
            }
            self.running.follow(&faces)?;
            for side in &mut self.sides {
                side.compare(stop, faces[side.bond], self.running.contact(side.bond));
            }
            if let Some((side, f)) = self.sides.iter().zip(&foreseen).find(|(d, _)| reads_at_ends(d)) {
                // what the FMU reports at either end is exact; the rig says how it went between
                let (from, to) = (accelerated - f.acceleration.0, self.running.output(1) - f.acceleration.1);
                let accelerations =
                    if side.bond == watched { Some(&mut self.out.acceleration) } else { other[1].as_mut() };
                for (y, u) in accelerations.into_iter().flat_map(|y| &mut y[i..done]).zip(&times[i..done]) {
                    *y += from + (to - from) * share_at(*u);
                }
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

    /// The outputs at `t`.
    fn note(&self, t: f64, points: &mut [Vec<(f64, f64)>; 3]) {
        for (c, points) in points.iter_mut().enumerate() {
            if self.seat.machine.facts().channels[c] == Some(Reads::Output) {
                points.push((t, self.running.output(c)));
            }
        }
    }

    /// Touches and partings between the positions before the step and now.
    fn touches(&mut self, t: f64, before: impl Iterator<Item = f64>) {
        for (side, x0) in self.sides.iter_mut().zip(before).filter(|(s, _)| s.touches) {
            let x = side.rig.face_at(t, &side.y).0;
            let near = 1e-9 * self.s.depth;
            let (touches, parts) = (x >= -near && x0 < -near, x <= near && x0 > near);
            if touches || parts {
                self.breaks.push(t);
            }
            if touches {
                side.touched = t;
                side.in_flight = side.drive.line.of(t);
            } else if parts && side.inside && !side.reported {
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
                out.read[c] = Some(times.iter().map(|t| between(&points[c], &self.breaks, *t)).collect());
            }
        }
        if path.len() > 1 {
            let of = |pick: fn(&(f64, f64)) -> f64| path.iter().map(|(t, m)| (*t, pick(m))).collect::<Vec<_>>();
            let (x, v) = (of(|m| m.0), of(|m| m.1));
            out.position = times.iter().map(|t| between(&x, &[], *t)).collect();
            out.velocity = times.iter().map(|t| between(&v, &[], *t)).collect();
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
