//! How a simulated motion changes with what is learned: the variational equations along it (Hairer, Norsett, Wanner 1993, I.14), for
//! all coefficients of the learned forces in one pass, where differences take a simulation for each.
//!
//! d'' = A d + B d' + s/m: A and B are the growth of the body's acceleration with position and speed, s the force of the
//! coefficient where it is 1 N. Integrated from the touch on, forwards and backwards, by Runge and Kutta's steps of fourth order
//! from sample to sample, between which the motion is the polynomial of fifth degree through place, speed and acceleration.

use crate::setup::Setup;
use crate::simulate::{scaled, Local, Trace};
use law::learned::{COEFFICIENTS, TERMS};
use law::Memory;
use mechanisms::learned_force::{LearnedForces, SIDE_BY_SIDE};
use mechanisms::physics::Physics;
use record::Kind;
use std::f64::consts::PI;

/// Change of the coefficients of one of the learned forces with a parameter, N.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// Index of the force among those side by side.
    pub force: usize,
    /// Coefficients that change, by their indices, with their change.
    pub coefficients: Vec<(usize, f64)>,
}

impl Change {
    /// From `before` to `after`, over `h`; None where they differ in more than the coefficients of one learned force, or not at all.
    pub fn between(before: &Physics, after: &Physics, h: f64) -> Option<Change> {
        let (a, b) = (before.learned_forces.0, after.learned_forces.0);
        let differs = |k: &usize| a[*k].learned.coefficients != b[*k].learned.coefficients;
        let force = (0..SIDE_BY_SIDE).find(differs)?;
        let mut same = *after;
        same.learned_forces.0[force].learned.coefficients = a[force].learned.coefficients;
        let (from, to) = (a[force].learned.coefficients, b[force].learned.coefficients);
        let change = |(i, (a, b)): (usize, (&f64, &f64))| (a != b).then_some((i, (b - a) / h));
        let coefficients = from.iter().zip(&to).enumerate().filter_map(change).collect();
        (same == *before).then_some(Change { force, coefficients })
    }
}

/// Change of a trace with a parameter: of its signals at the sample times, and of the speed at the first sample.
#[derive(Clone, Debug)]
pub struct Tangent {
    pub force: Vec<f64>,
    pub acceleration: Vec<f64>,
    pub position: Vec<f64>,
    pub velocity: Vec<f64>,
    pub first_speed: f64,
}

impl Tangent {
    fn zero(n: usize) -> Tangent {
        let none = || vec![0.0; n];
        Tangent { force: none(), acceleration: none(), position: none(), velocity: none(), first_speed: 0.0 }
    }

    /// The trace where the parameter is `h` larger.
    pub fn moved(&self, trace: &Trace, h: f64) -> Trace {
        let of = |v: &[f64], by: &[f64]| v.iter().zip(by).map(|(v, d)| v + h * d).collect();
        Trace {
            force: of(&trace.force, &self.force),
            acceleration: of(&trace.acceleration, &self.acceleration),
            position: of(&trace.position, &self.position),
            velocity: of(&trace.velocity, &self.velocity),
            first_speed: trace.first_speed + h * self.first_speed,
            ..trace.clone()
        }
    }
}

/// Samples of a contact from which on the motion between them is known well enough.
const RESOLVED: f64 = 30.0;
/// Share of an impact's duration that a step takes at most.
const STEP: f64 = 1.0 / 60.0;
/// Part of a wave, rad, that a step takes at most.
const PART_OF_WAVE: f64 = 0.7;
/// Share of the speed over which a direction turns that a step takes at most, within it.
const PART_OF_TURN: f64 = 0.2;
/// Part of the depth over which a force between the faces rises that a step takes at most, until it has risen so often as much.
const PART_OF_RISE: f64 = 0.4;
const RISEN: f64 = 4.0;
/// Steps from one sample to the next at most.
const MOST: usize = 64;
/// Differences by which slopes are taken, shares of the depth and the speed of the impact.
const DIFFERENCE: f64 = 1e-6;
/// Share of the peak force from which a force that is there at so small a share of the depth has begun with a jump.
const JUMP: f64 = 0.02;
const BEGINS: f64 = 2e-3;

/// Place, speed and acceleration of the body at an instant.
#[derive(Clone, Copy)]
struct At {
    t: f64,
    x: f64,
    v: f64,
    a: f64,
}

impl At {
    /// Between this and `next`, at the share `u` of the way in time: the polynomial of fifth degree through both.
    fn towards(&self, next: &At, u: f64) -> At {
        let h = next.t - self.t;
        let (v0, v1, a0, a1) = (h * self.v, h * next.v, h * h * self.a, h * h * next.a);
        let d = next.x - self.x;
        let c3 = 10.0 * d - 6.0 * v0 - 4.0 * v1 - 1.5 * a0 + 0.5 * a1;
        let c4 = -15.0 * d + 8.0 * v0 + 7.0 * v1 + 1.5 * a0 - a1;
        let c5 = 6.0 * d - 3.0 * (v0 + v1) - 0.5 * (a0 - a1);
        At {
            t: self.t + u * h,
            x: self.x + u * (v0 + u * (0.5 * a0 + u * (c3 + u * (c4 + u * c5)))),
            v: (v0 + u * (a0 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / h,
            a: (a0 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5))) / (h * h),
        }
    }
}

/// The equations at an instant: growth of the acceleration and of the force on the transducer with place and speed, and what each
/// change adds to both, by a parameter's unit.
struct Equations {
    a: [f64; 2],
    force: [f64; 2],
    acceleration_of: Vec<f64>,
    force_of: Vec<f64>,
}

/// A body that meets the stop, without anything that remembers or rides on it.
struct Body<'a> {
    p: Physics,
    s: &'a Setup,
    changes: &'a [Change],
}

impl Body<'_> {
    /// Force between the faces, N.
    fn contact(&self, x: f64, v: f64) -> f64 {
        self.p.law.force(&Memory::default(), x, v) + self.p.on_face(x, v)
    }

    /// Acceleration of the body and force on the transducer.
    fn acts(&self, touches: bool, t: f64, x: f64, v: f64) -> [f64; 2] {
        let contact = if touches { self.contact(x, v) } else { 0.0 };
        let a = (self.s.motion_force(&self.p, t, x, v) - contact) / self.p.mass + self.p.gravity;
        [a, self.p.on_transducer(&self.s.motion(t, x, v), contact)]
    }

    fn equations(&self, touches: bool, at: &At) -> Equations {
        let (dx, dv) = (DIFFERENCE * self.s.depth, DIFFERENCE * self.s.speed);
        let slope = |dx: f64, dv: f64, h: f64| {
            let [a1, f1] = self.acts(touches, at.t, at.x + dx, at.v + dv);
            let [a0, f0] = self.acts(touches, at.t, at.x - dx, at.v - dv);
            [(a1 - a0) / (2.0 * h), (f1 - f0) / (2.0 * h)]
        };
        let (by_x, by_v) = (slope(dx, 0.0, dx), slope(0.0, dv, dv));
        let LearnedForces(forces) = &self.p.learned_forces;
        let motion = self.s.motion(at.t, at.x, at.v);
        let mut shapes: [Option<[f64; COEFFICIENTS]>; SIDE_BY_SIDE] = [None; SIDE_BY_SIDE];
        let mut force_of = vec![0.0; self.changes.len()];
        let mut acceleration_of = vec![0.0; self.changes.len()];
        for (i, change) in self.changes.iter().enumerate() {
            let force = &forces[change.force];
            let on_face = force.of.is_contact();
            if on_face && !touches {
                continue;
            }
            let shapes = shapes[change.force].get_or_insert_with(|| force.shapes(&motion));
            let f: f64 = change.coefficients.iter().map(|(c, by)| by * shapes[*c]).sum();
            if on_face {
                force_of[i] = f;
            }
            acceleration_of[i] = if on_face { -f } else { f } / self.p.mass;
        }
        Equations { a: [by_x[0], by_v[0]], force: [by_x[1], by_v[1]], acceleration_of, force_of }
    }

    /// Steps that the way from one sample to the next takes.
    fn steps(&self, from: &At, to: &At) -> usize {
        let forces = &self.p.learned_forces.0;
        let finest = |change: &Change| {
            let f = &forces[change.force];
            let last = change.coefficients.iter().map(|(c, _)| c % TERMS).max().unwrap_or(0);
            let way = if f.of.is_of_speed() {
                (to.v - from.v) / (law::learned::SPEEDS * f.learned.speed)
            } else {
                (to.x - from.x) / f.learned.range
            };
            let turn = law::body::SLIP_SPEED;
            let turns = from.v.abs().min(to.v.abs()) < turn || from.v * to.v < 0.0;
            let of_turn = if f.of.turns() && turns { (to.v - from.v).abs() / (PART_OF_TURN * turn) } else { 0.0 };
            let rise = law::learned::RISE * f.learned.range;
            let rises = f.of.is_contact() && from.x.min(to.x) < RISEN * rise && from.x.max(to.x) > 0.0;
            let of_rise = if rises { (to.x - from.x).abs() / (PART_OF_RISE * rise) } else { 0.0 };
            (PI * last as f64 * way.abs() / PART_OF_WAVE).max(of_turn).max(of_rise)
        };
        let of_changes = self.changes.iter().map(finest).fold(0.0, f64::max);
        let of_contact = (to.t - from.t).abs() / (STEP * self.s.duration);
        let acts = from.x.max(to.x) > 0.0 || self.changes.iter().any(|c| !forces[c.force].of.is_contact());
        if acts {
            (of_changes.max(of_contact).ceil() as usize).clamp(1, MOST)
        } else {
            1
        }
    }

    /// Takes the changes `d` of place and speed from the instant `from`, with the equations there, to `to`; the equations there.
    fn advance(&self, touches: bool, from: &At, mut here: Equations, to: &At, d: &mut [[f64; 2]]) -> Equations {
        let steps = self.steps(from, to);
        let mut begin = *from;
        for k in 1..=steps {
            let end = if k == steps { *to } else { from.towards(to, k as f64 / steps as f64) };
            let h = end.t - begin.t;
            let half = self.equations(touches, &from.towards(to, (k as f64 - 0.5) / steps as f64));
            let there = self.equations(touches, &end);
            for (i, d) in d.iter_mut().enumerate() {
                let rate = |e: &Equations, d: [f64; 2]| [d[1], e.a[0] * d[0] + e.a[1] * d[1] + e.acceleration_of[i]];
                let on = |k: [f64; 2], h: f64| [d[0] + h * k[0], d[1] + h * k[1]];
                let k1 = rate(&here, *d);
                let k2 = rate(&half, on(k1, 0.5 * h));
                let k3 = rate(&half, on(k2, 0.5 * h));
                let k4 = rate(&there, on(k3, h));
                *d = [0, 1].map(|j| d[j] + h / 6.0 * (k1[j] + 2.0 * (k2[j] + k3[j]) + k4[j]));
            }
            (begin, here) = (end, there);
        }
        here
    }
}

/// The change of `trace`, which a simulation of `physics` gave, with each of `changes`. None where the motion is not that of a body
/// alone against a contact that remembers nothing and begins without a jump, or is sampled too coarsely to follow.
pub fn tangents(
    physics: &Physics,
    s: &Setup,
    local: &Local,
    trace: &Trace,
    changes: &[Change],
) -> Option<Vec<Tangent>> {
    let p = scaled(physics, &s.history, local);
    let body = Body { p, s, changes };
    let (n, clock) = (s.time.len(), local.start);
    let dt = (s.time[n - 1] - s.time[0]) / (n.max(2) - 1) as f64;
    let acts_in_flight = changes.iter().any(|c| !p.learned_forces.0[c.force].of.is_contact());
    let is_plain = s.kind == Kind::DropTest
        && s.machine.is_none()
        && trace.ok
        && trace.read.iter().all(Option::is_none)
        && p.is_one_body()
        && !p.law.remembers()
        && !p.fracture.load.is_finite()
        && dt * RESOLVED < s.duration
        && !(acts_in_flight && s.beginning() < s.time[0]);
    let peak = record::largest(&trace.force);
    let jumps = |v: f64| body.contact(BEGINS * s.depth, v).abs() > JUMP * peak;
    if !is_plain || jumps(s.speed) || jumps(-s.speed) {
        return None;
    }
    let at = |i: usize| At {
        t: s.time[i] - clock,
        x: trace.position[i],
        v: trace.velocity[i],
        a: trace.acceleration[i] + p.gravity,
    };
    let touch = |touches: bool| At { t: 0.0, x: 0.0, v: local.speed, a: body.acts(touches, 0.0, 0.0, local.speed)[0] };
    let mut all = vec![Tangent::zero(n); changes.len()];
    let first = s.time.partition_point(|t| *t < clock);
    let backwards: Vec<usize> = (0..first).rev().collect();
    let forwards: Vec<usize> = (first..n).collect();
    for (touches, indices) in [(false, backwards), (true, forwards)] {
        if !touches && !acts_in_flight {
            continue;
        }
        let mut d = vec![[0.0; 2]; changes.len()];
        let mut from = touch(touches);
        let mut here = body.equations(touches, &from);
        for i in indices {
            let to = at(i);
            if to.t != from.t {
                here = body.advance(touches, &from, here, &to, &mut d);
            }
            for (k, (of, d)) in all.iter_mut().zip(&d).enumerate() {
                (of.position[i], of.velocity[i]) = (d[0], d[1]);
                of.force[i] = here.force[0] * d[0] + here.force[1] * d[1] + here.force_of[k];
                of.acceleration[i] = here.a[0] * d[0] + here.a[1] * d[1] + here.acceleration_of[k];
            }
            from = to;
        }
    }
    if first > 0 {
        all.iter_mut().for_each(|of| of.first_speed = of.velocity[0]);
    }
    Some(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrate::Control;
    use crate::simulate::simulate;
    use law::learned::Learned;
    use mechanisms::learned_force::{Dependence, LearnedForce};

    /// A body of 1 kg that meets a stop of 1e8 N/m^1.5 at 1 m/s, sampled so often in the impact; what is learned beside it.
    fn impact(samples: f64, of: Dependence) -> (Physics, Setup, Local) {
        let duration = 1.5e-3;
        let n = (3.0 * samples) as usize;
        let time = (0..n).map(|i| (i as f64 - samples) * duration / samples).collect();
        let mut physics = Physics::default();
        physics.law.elastic.stiffness = 1e8;
        physics.law.elastic.exponent = 1.5;
        physics.law.hysteresis_damping.coefficient = 1e7;
        physics.gravity = 9.81;
        let mut learned = Learned { range: 5e-4, speed: 1.0, ..Learned::default() };
        (learned.coefficients[0], learned.coefficients[2], learned.coefficients[TERMS + 1]) = (30.0, 20.0, 15.0);
        physics.learned_forces.0[0] = LearnedForce { of, learned };
        let local = Local { start: 1.3e-5, speed: 1.0, stiffness: 0.1, offset: 0.0 };
        // finer than an estimation: differences of simulations shall err less than what is tested
        let setup = Setup::drop_test(time, 4e-4, 1.0, duration);
        (physics, Setup { control: Control::dense(1e-11), ..setup }, local)
    }

    #[test]
    fn a_trace_changes_with_every_coefficient_as_simulations_of_both_sides_differ() {
        use Dependence::*;
        let all = [Depth, DepthAndSpeed, DepthAndDirection, DepthAndSpeedSquared, DepthTimesSpeed];
        for of in all.into_iter().chain([Place, PlaceAndSpeed, PlaceAndDirection, Speed]) {
            let (p, s, local) = impact(150.0, of);
            let trace = simulate(&p, &s, &local);
            assert!(trace.ok);
            let with = |c: usize, by: f64| {
                let mut q = p;
                q.learned_forces.0[0].learned.coefficients[c] += by;
                q
            };
            let h = 0.1;
            let is_of_it = |c: &usize| of.series() == 2 || (*c < TERMS) == (of != DepthTimesSpeed);
            let some = [0, 1, 5, 11, TERMS, TERMS + 3, TERMS + 11];
            let coefficients: Vec<usize> = some.into_iter().filter(is_of_it).collect();
            let changes: Vec<Change> =
                coefficients.iter().map(|c| Change::between(&p, &with(*c, h), h).unwrap()).collect();
            let found = tangents(&p, &s, &local, &trace, &changes).unwrap();
            for (c, found) in coefficients.iter().zip(&found) {
                let (more, less) = (simulate(&with(*c, h), &s, &local), simulate(&with(*c, -h), &s, &local));
                let differs = |more: &[f64], less: &[f64], found: &[f64], what: &str| {
                    let size = more.iter().zip(less).map(|(a, b)| ((a - b) / (2.0 * h)).powi(2)).sum::<f64>().sqrt();
                    let pairs = more.iter().zip(less).zip(found);
                    let off = pairs.map(|((a, b), t)| ((a - b) / (2.0 * h) - t).powi(2)).sum::<f64>().sqrt();
                    assert!(off <= 0.01 * size, "{of:?} {c} {what}: {off} of {size}");
                };
                differs(&more.position, &less.position, &found.position, "position");
                differs(&more.velocity, &less.velocity, &found.velocity, "velocity");
                differs(&more.force, &less.force, &found.force, "force");
                differs(&more.acceleration, &less.acceleration, &found.acceleration, "acceleration");
                let first = (more.first_speed - less.first_speed) / (2.0 * h);
                assert!((found.first_speed - first).abs() <= 0.01 * first.abs() + 1e-9, "{of:?} {c}: {first}");
            }
        }
    }

    #[test]
    fn what_cannot_be_followed_so_is_left_to_simulations() {
        let (p, s, local) = impact(150.0, Dependence::Depth);
        let mut q = p;
        q.learned_forces.0[0].learned.coefficients[1] += 1.0;
        let change = [Change::between(&p, &q, 1.0).unwrap()];
        let follows = |p: &Physics, s: &Setup| tangents(p, s, &local, &simulate(p, s, &local), &change).is_some();
        assert!(follows(&p, &s));
        let mut remembers = p;
        remembers.law.adhesion.force = 10.0;
        assert!(!follows(&remembers, &s));
        let mut jumps = p;
        jumps.law.contact_preload.force = 100.0;
        assert!(!follows(&jumps, &s));
        let mut rings = p;
        (rings.sensor_resonance.mass, rings.sensor_resonance.stiffness) = (0.01, 1e8);
        assert!(!follows(&rings, &s));
        assert!(!follows(&p, &impact(20.0, Dependence::Depth).1));
        // more than the coefficients of one force is no change of them
        q.mass = 2.0;
        assert_eq!(Change::between(&p, &q, 1.0), None);
        assert_eq!(Change::between(&p, &p, 1.0), None);
    }
}
