//! Masters that take a step back: iterated to agreement, or corrected once along derivatives.

use super::network::Network;
use super::options::{Method, Options, Shape};
use super::step::{Course, Point};
use crate::Kind;
use anyhow::{bail, Result};
use nalgebra::{DMatrix, DVector};

/// Earlier iterates that the acceleration looks back on.
const DEPTH: usize = 4;
/// Iterations after which a cubic is given up: it agrees within a few, or not at all.
const MOST_CUBIC: usize = 20;
/// Share of a signal's size by which it is moved for a tried step.
const TRY: f64 = 1e-4;
/// Slot of the step's start.
pub(super) const STEP_SLOT: usize = 0;

/// What is guessed at the step's end: values and derivatives of the torn outputs.
#[derive(Clone)]
struct Guess {
    values: Vec<f64>,
    rates: Vec<f64>,
}

/// What a pass over all parts comes to.
struct Pass {
    y: Vec<f64>,
    rates: Vec<f64>,
}

impl Network {
    /// A macro-step of [`Method::Implicit`] or [`Method::Iterated`]; `scale` holds each signal's largest value so
    /// far. None where the iteration does not agree.
    pub(super) fn implicit(&mut self, p: &Point, h: f64, o: &Options, scale: &[f64]) -> Result<Option<Vec<f64>>> {
        self.save(STEP_SLOT)?;
        let done = self.iterate(p, h, o, scale)?;
        if done.is_some() || o.method != Method::Iterated || o.shape != Shape::Cubic {
            return Ok(done);
        }
        // a derivative that jumps within the step, as where a contact ends: no cubic agrees there, a line may
        self.restore(STEP_SLOT)?;
        self.iterate(p, h, &Options { shape: Shape::Linear, ..o.clone() }, scale)
    }

    fn iterate(&mut self, p: &Point, h: f64, o: &Options, scale: &[f64]) -> Result<Option<Vec<f64>>> {
        let torn = self.torn.clone();
        let cubic = o.method == Method::Iterated && o.shape == Shape::Cubic;
        let ahead = |s: usize| if cubic { p.y[s] + h * p.rates[s] } else { p.y[s] };
        let mut guess = Guess {
            values: torn.iter().map(|&s| ahead(s)).collect(),
            rates: torn.iter().map(|&s| p.rates[s]).collect(),
        };
        let first = self.pass(p, h, o.shape, &guess, cubic, true)?;
        if torn.is_empty() {
            return Ok(Some(first.y));
        }
        if o.method == Method::Implicit {
            let correction = self.newton(p, h, o.shape, &guess, &first, scale)?;
            for (g, d) in guess.values.iter_mut().zip(correction.iter()) {
                *g += d;
            }
            return Ok(Some(self.pass(p, h, o.shape, &guess, cubic, false)?.y));
        }
        // unknowns in units of their size, rates beside values where they matter
        let size: Vec<f64> =
            torn.iter().map(|&s| scale[s].max(p.y[s].abs()).max(first.y[s].abs()).max(1e-300)).collect();
        let n = torn.len();
        let vector = |values: &dyn Fn(usize) -> f64, rates: &dyn Fn(usize) -> f64| {
            let m = if cubic { 2 * n } else { n };
            DVector::from_fn(m, |i, _| if i < n { values(i) / size[i] } else { h * rates(i - n) / size[i - n] })
        };
        let mut pass = first;
        let mut history: Vec<(DVector<f64>, DVector<f64>)> = Vec::new();
        let most = if cubic { o.iterations.min(MOST_CUBIC) } else { o.iterations };
        for _ in 0..most {
            let z = vector(&|i| guess.values[i], &|i| guess.rates[i]);
            let g = vector(&|i| pass.y[torn[i]], &|i| pass.rates[torn[i]]);
            let r = &g - &z;
            if !r.amax().is_finite() {
                return Ok(None);
            }
            if r.amax() <= o.tolerance {
                return Ok(Some(pass.y));
            }
            let next = anderson(&mut history, z, r);
            for i in 0..n {
                guess.values[i] = next[i] * size[i];
                if cubic {
                    guess.rates[i] = next[n + i] * size[i] / h;
                }
            }
            pass = self.pass(p, h, o.shape, &guess, cubic, false)?;
        }
        Ok(None)
    }

    fn course(shape: Shape, cubic: bool, orders: u32, (a, ra): (f64, f64), (b, rb): (f64, f64), h: f64) -> Course {
        match shape {
            Shape::Cubic if cubic && orders >= 3 => Course::cubic((a, ra), (b, rb), h),
            Shape::Mean => Course { start: 0.5 * (a + b), derivatives: [0.0; 3], end: b },
            _ if orders >= 1 => Course::line(a, b, h),
            _ => Course { start: 0.5 * (a + b), derivatives: [0.0; 3], end: b },
        }
    }

    /// Courses of a part's inputs, given what is guessed and what parts before it have reached.
    #[allow(clippy::too_many_arguments)]
    fn courses(
        &self,
        k: usize,
        p: &Point,
        h: f64,
        shape: Shape,
        cubic: bool,
        guess: &Guess,
        reached: (&[f64], &[f64]),
        stepped: &[bool],
    ) -> Vec<Course> {
        let orders = self.input_orders(k);
        self.parts[k]
            .inputs
            .iter()
            .map(|i| {
                let (f, s) = (i.feed, i.feed.source);
                let start = (f.of(&p.y), f.factor * p.rates[s]);
                if i.held {
                    Course::held(if stepped[self.owner[s]] { f.of(reached.0) } else { start.0 })
                } else if stepped[self.owner[s]] {
                    let end = (f.of(reached.0), f.factor * reached.1[s]);
                    if orders == 0 {
                        Course::held(end.0)
                    } else {
                        let shape = if shape == Shape::Mean { Shape::Linear } else { shape };
                        Self::course(shape, cubic, orders, start, end, h)
                    }
                } else {
                    let t = self.torn.iter().position(|&o| o == s).unwrap_or(0);
                    let end = (f.factor * guess.values[t] + f.offset, f.factor * guess.rates[t]);
                    Self::course(shape, cubic, orders, start, end, h)
                }
            })
            .collect()
    }

    /// Steps all parts in order under a guess.
    fn pass(&mut self, p: &Point, h: f64, shape: Shape, guess: &Guess, cubic: bool, first: bool) -> Result<Pass> {
        if !first {
            self.restore(STEP_SLOT)?;
        }
        let mut o = Pass { y: p.y.clone(), rates: vec![0.0; p.y.len()] };
        let mut stepped = vec![false; self.parts.len()];
        for k in self.order.clone() {
            let courses = self.courses(k, p, h, shape, cubic, guess, (&o.y, &o.rates), &stepped);
            self.step_part(k, (p.time, h), &courses, true, &mut o.y)?;
            if cubic {
                let from = self.first[k];
                for i in from..from + self.parts[k].outputs.len() {
                    o.rates[i] = (o.y[i] - p.y[i]) / h;
                }
                // rates of torn inputs as guessed, so that what feeds through knows them
                let mut rates = o.rates.clone();
                for (t, &s) in self.torn.iter().enumerate() {
                    if !stepped[self.owner[s]] && self.owner[s] != k {
                        rates[s] = guess.rates[t];
                    }
                }
                self.given_rates(k, &mut rates)?;
                let n = self.parts[k].outputs.len();
                o.rates[from..from + n].copy_from_slice(&rates[from..from + n]);
            }
            stepped[k] = true;
        }
        if self.reread {
            self.propagate(&mut o.y)?;
        }
        Ok(o)
    }

    /// Correction of the guess by one Newton step on guess = answer.
    fn newton(
        &mut self,
        p: &Point,
        h: f64,
        shape: Shape,
        guess: &Guess,
        pass: &Pass,
        scale: &[f64],
    ) -> Result<DVector<f64>> {
        let torn = self.torn.clone();
        let n = torn.len();
        let r = DVector::from_fn(n, |i, _| pass.y[torn[i]] - guess.values[i]);
        let mut m = DMatrix::identity(n, n);
        for c in 0..n {
            let column = self.response(p, h, shape, guess, pass, scale, c)?;
            for (row, &s) in torn.iter().enumerate() {
                m[(row, c)] -= column[s];
            }
        }
        match m.lu().solve(&r) {
            Some(d) => Ok(d),
            None => bail!("at {} s: the interface fixes no step (its matrix is singular); take another master", p.time),
        }
    }

    /// How all outputs at the step's end answer to one unit of the torn output number `c` there.
    #[allow(clippy::too_many_arguments)]
    fn response(
        &mut self,
        p: &Point,
        h: f64,
        shape: Shape,
        guess: &Guess,
        pass: &Pass,
        scale: &[f64],
        c: usize,
    ) -> Result<Vec<f64>> {
        let mut dy = vec![0.0; pass.y.len()];
        let mut stepped = vec![false; self.parts.len()];
        for k in self.order.clone() {
            let torn = self.torn[c];
            let seeds: Vec<f64> = self.parts[k]
                .inputs
                .iter()
                .map(|i| {
                    let s = i.feed.source;
                    if i.held {
                        return 0.0;
                    }
                    let own = if s == torn && !stepped[self.owner[s]] { 1.0 } else { dy[s] };
                    i.feed.factor * own
                })
                .collect();
            let was = stepped.clone();
            stepped[k] = true;
            if seeds.iter().all(|&s| s == 0.0) {
                continue;
            }
            let (first, count) = (self.first[k], self.parts[k].outputs.len());
            let through = self.parts[k].outputs.iter().any(|o| o.depends.iter().any(|&i| seeds[i] != 0.0));
            if through && self.parts[k].slave.abilities().directional {
                let part = &mut self.parts[k];
                let real = |o: &&super::network::Output| o.kind == Kind::Real;
                let unknowns: Vec<u32> = part.outputs.iter().filter(real).map(|o| o.reference).collect();
                let moving = || part.inputs.iter().zip(&seeds).filter(|(i, _)| !i.held);
                let knowns: Vec<u32> = moving().map(|(i, _)| i.reference).collect();
                let seeds: Vec<f64> = moving().map(|(_, s)| *s).collect();
                let mut answer = vec![0.0; unknowns.len()];
                part.slave.directional(&unknowns, &knowns, &seeds, &mut answer)?;
                let places = (first..first + count).filter(|i| self.real[*i]);
                places.zip(answer).for_each(|(i, d)| dy[i] = d);
                continue;
            }
            // a tried step, with what is fed moved a little
            let size = scale[torn].max(pass.y[torn].abs()).max(1e-6);
            let d = TRY * size;
            self.parts[k].slave.restore(STEP_SLOT)?;
            let mut courses = self.courses(k, p, h, shape, false, guess, (&pass.y, &pass.rates), &was);
            let orders = self.input_orders(k);
            for (course, seed) in courses.iter_mut().zip(&seeds) {
                let end = course.end + d * seed;
                *course = if course.derivatives[0] != 0.0 || (shape != Shape::Mean && orders > 0) {
                    Course::line(course.start, end, h)
                } else {
                    Course { start: course.start + 0.5 * d * seed, derivatives: [0.0; 3], end }
                };
            }
            let mut moved = pass.y.clone();
            self.step_part(k, (p.time, h), &courses, true, &mut moved)?;
            for i in first..first + count {
                dy[i] = (moved[i] - pass.y[i]) / d;
            }
        }
        Ok(dy)
    }
}

/// The next iterate of z = z + r (Anderson 1965, in the form of Walker and Ni 2011): the least residual that
/// combinations of the last iterates give.
fn anderson(history: &mut Vec<(DVector<f64>, DVector<f64>)>, z: DVector<f64>, r: DVector<f64>) -> DVector<f64> {
    let mut next = &z + &r;
    let m = history.len();
    if m > 0 {
        let dr = DMatrix::from_columns(&history.iter().map(|(_, old)| &r - old).collect::<Vec<_>>());
        let dz = DMatrix::from_columns(&history.iter().map(|(old, _)| &z - old).collect::<Vec<_>>());
        let svd = dr.clone().svd(true, true);
        let cut = 1e-12 * svd.singular_values.amax();
        if let Ok(gamma) = svd.solve(&r, cut) {
            let accelerated = &next - (dz + dr) * gamma;
            if accelerated.iter().all(|v| v.is_finite()) {
                next = accelerated;
            }
        }
    }
    history.push((z, r));
    if history.len() > DEPTH {
        history.remove(0);
    }
    next
}
