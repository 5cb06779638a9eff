//! Steps a network from start to stop.

use super::implicit::STEP_SLOT;
use super::network::Network;
use super::options::{Adapt, Method, Options};
use super::step::Point;
use anyhow::{bail, ensure, Context, Result};

/// Slot of where a step began that may be taken back as a whole.
const START_SLOT: usize = STEP_SLOT + 1;
/// Most touches within one macro-step; a signal that passes its level more often is not followed.
const MOST_TOUCHES: usize = 20;
/// Safety factor, and least and largest change, of the step in one step.
const SAFETY: f64 = 0.8;
const LEAST_CHANGE: f64 = 0.2;
const LARGEST_CHANGE: f64 = 2.0;
/// Gains of the PI control over the energy residual (Sadjina et al. 2017: 0.3 and 0.4 over the order plus one).
const INTEGRAL: f64 = 0.15;
const PROPORTIONAL: f64 = 0.2;
/// Errors by energy, in units of the tolerance, beyond which a step is taken back where that can be done.
const FAR_BEYOND: f64 = 3.0;
/// Macro-steps that a run may take.
const MOST_STEPS: f64 = 1e9;
/// Share of the whole time that counts as no time: steps shorter than that are not taken.
const NO_TIME: f64 = 1e-14;
/// Steps by which a span may miss a whole number of them and count as one.
const WHOLE: f64 = 1e-6;

/// A communication point.
pub struct Moment<'a> {
    /// s.
    pub time: f64,
    /// Global outputs.
    pub y: &'a [f64],
    /// Step that led here, s; 0 at the start.
    pub step: f64,
    /// Whether it is a touch.
    pub touch: bool,
    /// Energy that each bond's coupling has created so far, J: work reported less work felt.
    pub created: &'a [f64],
    /// Macro-steps so far.
    pub steps: u64,
    /// Whether it is the last that is planned.
    pub last: bool,
}

/// How a run went.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Where it ended, s.
    pub time: f64,
    /// Macro-steps accepted.
    pub steps: u64,
    /// Macro-steps taken back as too coarse.
    pub rejected: u64,
    /// Times of the touches, s.
    pub touches: Vec<f64>,
    /// Energy that each bond's coupling created, J.
    pub created: Vec<f64>,
    /// Calls of fmi2DoStep, of all slaves, tried steps included.
    pub slave_steps: u64,
    /// Whether the run was ended before its time.
    pub interrupted: bool,
    /// Why it ended where it did, where that is not its stop: an FMU asked for the end, or takes no shorter step.
    pub ended: Option<String>,
}

struct Driver<'a> {
    network: &'a mut Network,
    options: &'a Options,
    scale: Vec<f64>,
    /// (reported, felt) of each bond at the last accepted point.
    bonds: Vec<(f64, f64)>,
    out: Outcome,
}

/// Steps `network`, initialized, with outputs `y` at the start, and hands every communication point to `each`, which
/// answers whether to go on.
///
/// # Errors
/// Where a slave cannot do what the options need (names it) or refuses; where an iteration does not agree, or a
/// signal leaves the numbers: says when, and what to do.
pub fn run(
    network: &mut Network,
    options: &Options,
    y: Vec<f64>,
    each: &mut dyn FnMut(&mut Network, &Moment) -> Result<bool>,
) -> Result<Outcome> {
    able(network, options)?;
    let scale = y.iter().map(|v| v.abs()).collect();
    let done = network.work.steps;
    let mut d = Driver { network, options, scale, bonds: Vec::new(), out: Outcome::default() };
    d.out.created = vec![0.0; options.bonds.len()];
    for i in 0..options.bonds.len() {
        let reported = d.reported(i)?;
        d.bonds.push(reported);
    }
    let p = Point::start(options.start, y);
    d.out.time = p.time;
    if d.hand_on(&p, false, false, each)? {
        let done = match options.adapt {
            None => d.fixed(p, each),
            Some(a) => d.adaptive(p, a, each),
        };
        if let Err(e) = done {
            let Some(who) = crate::end_asked(&e) else { return Err(e) };
            d.out.ended = Some(format!("{who} asked for the end at {} s, and the run ends there", d.out.time));
        }
    } else {
        d.out.interrupted = true;
    }
    let mut o = d.out;
    o.slave_steps = network.work.steps - done;
    Ok(o)
}

fn able(network: &Network, o: &Options) -> Result<()> {
    ensure!(o.step.is_finite() && o.step > 0.0, "a macro-step of {} s; give one above 0", o.step);
    ensure!(o.stop.is_finite() && o.stop >= o.start, "stop at {} s, start at {} s; give a later stop", o.stop, o.start);
    let steps = (o.stop - o.start) / o.step;
    ensure!(
        steps <= MOST_STEPS && o.step > 2.0 * NO_TIME * (o.stop.abs() + o.start.abs()),
        "from {} s to {} s in macro-steps of {} s are {steps:.1e} steps, and a run takes at most {MOST_STEPS:e}: give an \
         earlier stop or a longer step",
        o.start,
        o.stop,
        o.step
    );
    for p in &network.parts {
        let a = p.slave.abilities();
        ensure!(
            a.rollback || !o.needs_rollback(),
            "{}: declares no canGetAndSetFMUstate, so no step can be taken back; take gauss-seidel or jacobi without \
             [[touch]] and without adapting by doubling",
            p.name
        );
        ensure!(
            a.variable_step || !o.needs_variable_step(),
            "{}: declares no canHandleVariableCommunicationStepSize; leave out [[touch]] and adapt",
            p.name
        );
    }
    Ok(())
}

type Each<'a> = dyn FnMut(&mut Network, &Moment) -> Result<bool> + 'a;

impl Driver<'_> {
    fn hand_on(&mut self, p: &Point, touch: bool, last: bool, each: &mut Each) -> Result<bool> {
        let (created, steps) = (&self.out.created, self.out.steps);
        let m = Moment { time: p.time, y: &p.y, step: p.step, touch, created, steps, last };
        each(self.network, &m)
    }

    /// One macro-step from `p` to `to` s; None where an iteration does not agree.
    fn try_step(&mut self, p: &Point, to: f64) -> Result<Option<Point>> {
        let h = to - p.time;
        let mut p = p.clone();
        for l in &self.options.lookaheads {
            self.network.parts[l.part].slave.set(&[l.reference], &[l.steps * h])?;
            self.network.read(l.part, &mut p.y)?;
        }
        if self.options.needs_rates() {
            p.rates = self.network.rates(&p)?;
        }
        let o = self.options;
        let y = match o.method {
            Method::GaussSeidel => Some(self.network.explicit(&p, h, true, o.inputs)?),
            Method::Jacobi => Some(self.network.explicit(&p, h, false, o.inputs)?),
            Method::Implicit | Method::Iterated => self.network.implicit(&p, h, o, &self.scale)?,
        };
        let Some(y) = y else { return Ok(None) };
        if let Some(i) = y.iter().position(|v| !v.is_finite()) {
            bail!(
                "{} is {} at {to} s: the FMU gives no number there, or the coupling is unstable at a step of {h} s; look at \
                 what the FMU is given, and make the step smaller",
                self.network.output_name(i),
                y[i]
            );
        }
        let rates = vec![0.0; y.len()];
        Ok(Some(Point { time: to, y, rates, step: h, before: p.y }))
    }

    /// As [`Driver::try_step`]; an iteration that does not agree is an error.
    fn step(&mut self, p: &Point, to: f64) -> Result<Point> {
        let h = to - p.time;
        self.try_step(p, to)?.with_context(|| {
            format!(
                "at {} s: {} iterations over a step of {h} s do not agree; make the step smaller, or take shape = \"mean\"",
                p.time, self.options.iterations
            )
        })
    }

    fn crossed(&self, p: &Point, q: &Point) -> Option<usize> {
        self.options.touches.iter().position(|t| (p.y[t.output] > t.level) != (q.y[t.output] > t.level))
    }

    /// Times, s, shortly before and after the first touch on the way from `p`, whose state is in the start slot, to
    /// `q`; the network is left somewhere between.
    fn locate(&mut self, p: &Point, q: &Point, touch: usize) -> Result<(f64, f64)> {
        let t = self.options.touches[touch];
        let tolerance = (self.options.touch_tolerance * self.options.step).max(4.0 * f64::EPSILON * q.time.abs());
        let (mut low, mut high) = (p.time, q.time);
        let (mut below, mut above) = (p.y[t.output] - t.level, q.y[t.output] - t.level);
        for _ in 0..200 {
            let width = high - low;
            if width <= tolerance {
                break;
            }
            let secant = low + width * (below / (below - above)).clamp(0.0, 1.0);
            // from the secant's point a hair towards the end that is farther: it closes the bracket
            let hair = 0.4 * tolerance;
            let aim = if secant - low < high - secant { secant + hair } else { secant - hair };
            for guess in [aim, 0.5 * (low + high)] {
                if high - low <= tolerance || (guess != aim && high - low <= 0.5 * width) {
                    continue;
                }
                let guess = guess.clamp(low + 0.3 * tolerance, high - 0.3 * tolerance);
                self.network.restore(START_SLOT)?;
                let m = self.step(p, guess)?;
                let value = m.y[t.output] - t.level;
                if self.crossed(p, &m).is_some() {
                    (high, above) = (guess, value);
                } else {
                    (low, below) = (guess, value);
                }
            }
        }
        Ok((low, high))
    }

    /// Accepts the step from `p` to `q`, the network being there.
    fn accept(&mut self, p: &Point, q: &Point, steps: u64) -> Result<()> {
        self.out.steps += steps;
        self.out.time = q.time;
        for (s, v) in self.scale.iter_mut().zip(&q.y) {
            *s = s.max(v.abs());
        }
        for (i, (made, reported)) in self.created(p, q)?.into_iter().enumerate() {
            self.out.created[i] += made;
            self.bonds[i] = reported;
        }
        Ok(())
    }

    /// What each bond's coupling creates on the step from `p` to `q`, where the network is, J; and what is reported there.
    fn created(&mut self, p: &Point, q: &Point) -> Result<Vec<(f64, (f64, f64))>> {
        let mut all = Vec::new();
        for i in 0..self.options.bonds.len() {
            let (reported, felt) = self.reported(i)?;
            let (reported_before, felt_before) = self.bonds[i];
            let b = &self.options.bonds[i];
            let mean = |a: f64, b: f64| 0.5 * (a + b) * q.step;
            let (f, v) = (b.force, b.velocity);
            let taken =
                if b.energy.is_empty() { mean(p.y[f] * p.y[v], q.y[f] * q.y[v]) } else { reported - reported_before };
            let given = match b.work {
                Some(_) => felt - felt_before,
                None => q.before[f] * mean(p.y[v], q.y[v]),
            };
            all.push((taken - given, (reported, felt)));
        }
        Ok(all)
    }

    /// (energy reported, work felt) of a bond by the slaves themselves, J; 0 where they do not report it.
    fn reported(&mut self, bond: usize) -> Result<(f64, f64)> {
        let b = &self.options.bonds[bond];
        let mut reported = 0.0;
        for (part, reference) in &b.energy {
            reported += self.network.parts[*part].slave.read(crate::Kind::Real, *reference)?;
        }
        let felt = match b.work {
            Some((part, reference)) => self.network.parts[part].slave.read(crate::Kind::Real, reference)?,
            None => 0.0,
        };
        Ok((reported, felt))
    }

    /// Goes from `p`, whose state is in the start slot, over the first touch before `q`. The point after it, and
    /// whether to go on.
    fn over_touch(&mut self, p: &Point, q: &Point, touch: usize, each: &mut Each) -> Result<(Point, bool)> {
        let (before, after) = self.locate(p, q, touch)?;
        self.network.restore(START_SLOT)?;
        let mut p = p.clone();
        if before > p.time {
            let m = self.step(&p, before)?;
            self.accept(&p, &m, 1)?;
            p = m;
        }
        let m = self.step(&p, after)?;
        self.accept(&p, &m, 0)?;
        self.out.touches.push(m.time);
        let on = self.hand_on(&m, true, false, each)?;
        Ok((m, on))
    }

    fn fixed(&mut self, mut p: Point, each: &mut Each) -> Result<()> {
        let o = self.options;
        let whole = (o.stop - o.start) / o.step;
        let stiff = self.network.parts.iter().find(|p| !p.slave.abilities().variable_step).map(|p| p.name.clone());
        let mut n = whole.round();
        if (whole - n).abs() > WHOLE || n < 1.0 {
            n = if stiff.is_none() { whole.ceil() } else { whole.floor() };
            if let Some(name) = &stiff {
                let only = format!("{name} takes no step of another length (canHandleVariableCommunicationStepSize)");
                ensure!(
                    n >= 1.0,
                    "a step of {} s is longer than the whole run, and {only}; give a shorter one",
                    o.step
                );
                let end = o.start + n * o.step;
                let why = format!("ends at {end} s, short of {} s, which is no multiple of the step; {only}", o.stop);
                self.out.ended = Some(why);
            }
        }
        let none = NO_TIME * (o.stop.abs() + o.start.abs());
        for i in 1..=n as u64 {
            let last = i == n as u64;
            // from the start each time: a running sum would drift
            let to = if last && stiff.is_none() { o.stop } else { o.start + i as f64 * o.step };
            let mut found = 0;
            while to - p.time > none {
                if !o.touches.is_empty() {
                    self.network.save(START_SLOT)?;
                }
                let q = self.step(&p, to)?;
                let touch = self.crossed(&p, &q).filter(|_| found < MOST_TOUCHES);
                let Some(touch) = touch else {
                    self.accept(&p, &q, 1)?;
                    p = q;
                    break;
                };
                found += 1;
                let (m, on) = self.over_touch(&p, &q, touch, each)?;
                p = m;
                if !on {
                    self.out.interrupted = true;
                    return Ok(());
                }
            }
            p.time = to;
            if !self.hand_on(&p, false, last, each)? {
                self.out.interrupted = !last;
                return Ok(());
            }
        }
        Ok(())
    }

    fn adaptive(&mut self, mut p: Point, adapt: Adapt, each: &mut Each) -> Result<()> {
        let o = self.options;
        let mut h = o.step.min(o.longest);
        let none = NO_TIME * (o.stop.abs() + o.start.abs());
        let mut error_before = 1.0f64;
        // what the running sum of the time has lost to rounding (Neumaier 1974)
        let mut lost = 0.0;
        while o.stop - p.time > none.max(1e-9 * o.shortest) {
            let left = o.stop - p.time;
            // no crumb at the end
            let try_h = if h >= left {
                left
            } else if 2.0 * h > left {
                0.5 * left
            } else {
                h
            };
            let wanted = try_h + lost;
            let to = if try_h == left { o.stop } else { p.time + wanted };
            if o.needs_rollback() {
                self.network.save(START_SLOT)?;
            }
            let (q, error) = match adapt {
                Adapt::Energy { tolerance, floor } => self.weighed(&p, to, tolerance, floor)?,
                Adapt::Doubling { tolerance } => self.doubled(&p, to, tolerance)?,
            };
            let by_energy = matches!(adapt, Adapt::Energy { .. });
            let reject = match (&q, error) {
                (None, _) => Some(0.25),
                (_, Some(e)) if by_energy && e > FAR_BEYOND && o.needs_rollback() => {
                    Some(SAFETY * e.powf(-1.0 / 3.0).max(LEAST_CHANGE))
                }
                (_, Some(e)) if !by_energy && e > 1.0 => Some(self.change(e)),
                _ => None,
            };
            if let Some(change) = reject {
                ensure!(o.needs_rollback(), "at {} s: the step of {try_h} s fails and cannot be taken back", p.time);
                self.out.rejected += 1;
                self.network.restore(START_SLOT)?;
                h = try_h * change.min(0.9);
                ensure!(
                    h > o.shortest.max(none),
                    "at {} s: steps down to {h} s do not meet the tolerance; raise it, or lower shortest",
                    p.time
                );
                continue;
            }
            let Some(q) = q else { continue };
            if let Some(touch) = self.crossed(&p, &q) {
                lost = 0.0;
                let (before, after) = self.locate(&p, &q, touch)?;
                self.network.restore(START_SLOT)?;
                if before - p.time > none {
                    // the way to the touch has to meet the tolerance too
                    let (m, error) = match adapt {
                        Adapt::Energy { tolerance, floor } => self.weighed(&p, before, tolerance, floor)?,
                        Adapt::Doubling { tolerance } => self.doubled(&p, before, tolerance)?,
                    };
                    let limit = if by_energy { FAR_BEYOND } else { 1.0 };
                    let Some(m) = m.filter(|_| error.is_none_or(|e| e <= limit)) else {
                        self.out.rejected += 1;
                        self.network.restore(START_SLOT)?;
                        h = 0.5 * (before - p.time);
                        ensure!(
                            h > o.shortest.max(none),
                            "at {} s: steps down to {h} s do not meet the tolerance; raise it, or lower shortest",
                            p.time
                        );
                        continue;
                    };
                    self.accept(&p, &m, if by_energy { 1 } else { 2 })?;
                    p = m;
                }
                let m = self.step(&p, after)?;
                self.accept(&p, &m, 0)?;
                let there = self.crossed(&p, &m).is_some();
                if there {
                    self.out.touches.push(m.time);
                }
                p = m;
                if !self.hand_on(&p, there, false, each)? {
                    self.out.interrupted = true;
                    return Ok(());
                }
                continue;
            }
            lost = wanted - (to - p.time);
            let from = std::mem::replace(&mut p, q);
            self.accept(&from, &p, if by_energy { 1 } else { 2 })?;
            let e = error.unwrap_or(1.0);
            h = if by_energy {
                let e = e.max(1e-6);
                let change = SAFETY * e.powf(-(INTEGRAL + PROPORTIONAL)) * error_before.powf(PROPORTIONAL);
                error_before = e;
                h.min(2.0 * try_h) * change.clamp(LEAST_CHANGE, LARGEST_CHANGE)
            } else {
                h.max(try_h) * self.change(e)
            };
            h = h.min(o.longest).max(o.shortest);
            let last = o.stop - p.time <= none;
            if !self.hand_on(&p, false, last, each)? {
                self.out.interrupted = !last;
                return Ok(());
            }
        }
        Ok(())
    }

    /// Factor of the next step for an error in units of the tolerance.
    fn change(&self, error: f64) -> f64 {
        (SAFETY * error.max(1e-10).powf(-1.0 / (self.options.order() + 1.0))).clamp(LEAST_CHANGE, LARGEST_CHANGE)
    }

    /// A step from `p` to `to` s, and what the bonds create on it in units of the tolerance.
    fn weighed(&mut self, p: &Point, to: f64, tolerance: f64, floor: f64) -> Result<(Option<Point>, Option<f64>)> {
        let Some(q) = self.try_step(p, to)? else { return Ok((None, None)) };
        let all = self.created(p, &q)?;
        let residual: f64 = all.iter().map(|(e, _)| e.abs()).sum();
        let mut energy = floor;
        for (reported, felt) in all.iter().map(|(_, reported)| reported).chain(&self.bonds) {
            energy = energy.max(reported.abs()).max(felt.abs());
        }
        let error = residual / (tolerance * energy).max(f64::MIN_POSITIVE);
        Ok((Some(q), Some(error)))
    }

    /// Two half steps from `p` to `to` s, and their difference from one whole step in units of the tolerance.
    fn doubled(&mut self, p: &Point, to: f64, tolerance: f64) -> Result<(Option<Point>, Option<f64>)> {
        let Some(whole) = self.try_step(p, to)? else { return Ok((None, None)) };
        self.network.restore(START_SLOT)?;
        let Some(half) = self.try_step(p, p.time + 0.5 * (to - p.time))? else { return Ok((None, None)) };
        let Some(q) = self.try_step(&half, to)? else { return Ok((None, None)) };
        let mut error = 0.0f64;
        for i in (0..q.y.len()).filter(|i| self.network.real[*i]) {
            let size = self.scale[i].max(q.y[i].abs()).max(whole.y[i].abs());
            if size > 0.0 {
                error = error.max((q.y[i] - whole.y[i]).abs() / (tolerance * size));
            }
        }
        Ok((Some(q), Some(error)))
    }
}
