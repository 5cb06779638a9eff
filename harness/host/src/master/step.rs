//! One macro-step of an explicit master, and derivatives of signals.

use super::network::Network;
use super::options::Inputs;
use anyhow::Result;

/// Values of all global outputs at a communication point.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// s.
    pub time: f64,
    /// Values.
    pub y: Vec<f64>,
    /// Their derivatives, where wanted.
    pub rates: Vec<f64>,
    /// Step that led here, s; 0 at the start.
    pub step: f64,
    /// Values before that step.
    pub before: Vec<f64>,
}

impl Point {
    /// A start.
    pub fn start(time: f64, y: Vec<f64>) -> Point {
        Point { time, rates: vec![0.0; y.len()], before: y.clone(), y, step: 0.0 }
    }
}

/// What a slave is given of one input over a step: value and derivatives 1 to 3 at its start, value at its end.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Course {
    pub start: f64,
    pub derivatives: [f64; 3],
    pub end: f64,
}

impl Course {
    /// One value throughout.
    pub fn held(value: f64) -> Course {
        Course { start: value, derivatives: [0.0; 3], end: value }
    }

    /// Straight from one value to another.
    pub fn line(start: f64, end: f64, h: f64) -> Course {
        Course { start, derivatives: [(end - start) / h, 0.0, 0.0], end }
    }

    /// The cubic with values and derivatives at both ends.
    pub fn cubic((start, rate): (f64, f64), (end, end_rate): (f64, f64), h: f64) -> Course {
        let chord = (end - start) / h;
        let second = (6.0 * chord - 4.0 * rate - 2.0 * end_rate) / h;
        let third = 6.0 * (rate + end_rate - 2.0 * chord) / (h * h);
        Course { start, derivatives: [rate, second, third], end }
    }
}

impl Network {
    /// Sets a part's inputs on their courses, steps it, and reads its outputs into `y`; with `settle` inputs are set
    /// to where the courses end before that.
    pub(super) fn step_part(
        &mut self,
        k: usize,
        (time, h): (f64, f64),
        courses: &[Course],
        settle: bool,
        y: &mut [f64],
    ) -> Result<()> {
        let p = &self.parts[k];
        let inputs = p.inputs.len();
        let orders = p.slave.abilities().input_orders.min(3) as usize;
        if inputs > 0 {
            let moving = courses.iter().any(|c| c.derivatives.iter().any(|&d| d != 0.0));
            let highest = (0..orders).rev().find(|&n| courses.iter().any(|c| c.derivatives[n] != 0.0));
            self.derivative_orders[k] = self.derivative_orders[k].max(highest.map_or(0, |n| n + 1));
            // without derivatives what is new is set as reached, what is foreseen as its middle
            let starts: Vec<f64> = courses.iter().map(|c| c.start).collect();
            self.put(k, &starts)?;
            if orders > 0 && (moving || self.derivative_orders[k] > 0) {
                let mut rates = (Vec::new(), Vec::new(), Vec::new());
                for (i, c) in self.parts[k].inputs.iter().zip(courses).filter(|(i, _)| !i.held) {
                    for n in 0..orders {
                        // an order that always was zero need not be set
                        if n < self.derivative_orders[k].max(1) {
                            rates.0.push(i.reference);
                            rates.1.push(n as i32 + 1);
                            rates.2.push(c.derivatives[n]);
                        }
                    }
                }
                if !rates.0.is_empty() {
                    self.parts[k].slave.set_rates(&rates.0, &rates.1, &rates.2)?;
                }
            }
        }
        self.parts[k].slave.step(time, h)?;
        self.work.steps += 1;
        if settle && inputs > 0 {
            let ends: Vec<f64> = courses.iter().map(|c| c.end).collect();
            self.put(k, &ends)?;
        }
        self.read(k, y)
    }

    /// Whether a part takes derivatives of its inputs.
    pub(super) fn input_orders(&self, k: usize) -> u32 {
        self.parts[k].slave.abilities().input_orders
    }

    /// A macro-step of Gauss-Seidel (`sequential`) or Jacobi.
    pub(super) fn explicit(&mut self, p: &Point, h: f64, sequential: bool, inputs: Inputs) -> Result<Vec<f64>> {
        let mut y = p.y.clone();
        let mut stepped = vec![false; self.parts.len()];
        for k in self.order.clone() {
            let orders = self.input_orders(k);
            let courses: Vec<Course> = self.parts[k]
                .inputs
                .iter()
                .map(|i| {
                    let (f, s) = (i.feed, i.feed.source);
                    let now = f.of(&p.y);
                    if sequential && stepped[self.owner[s]] {
                        let end = f.of(&y);
                        if orders > 0 && !i.held {
                            Course::line(now, end, h)
                        } else {
                            Course::held(end)
                        }
                    } else if inputs == Inputs::Extrapolated && !i.held {
                        let end = now + h * f.factor * p.rates[s];
                        if orders > 0 {
                            Course::line(now, end, h)
                        } else {
                            Course { start: 0.5 * (now + end), derivatives: [0.0; 3], end }
                        }
                    } else {
                        Course::held(now)
                    }
                })
                .collect();
            self.step_part(k, (p.time, h), &courses, sequential, &mut y)?;
            stepped[k] = true;
        }
        if sequential && self.reread {
            self.propagate(&mut y)?;
        }
        Ok(y)
    }

    /// Derivatives of all outputs at a point: as reported where they are, else the difference over the last step.
    pub(super) fn rates(&mut self, p: &Point) -> Result<Vec<f64>> {
        let mut rates: Vec<f64> = if p.step > 0.0 {
            p.y.iter().zip(&p.before).map(|(a, b)| (a - b) / p.step).collect()
        } else {
            vec![0.0; p.y.len()]
        };
        for k in self.order.clone() {
            self.feed(k, &p.y)?;
            self.given_rates(k, &mut rates)?;
        }
        Ok(rates)
    }

    /// Puts the derivatives that a part gives into `rates`, its inputs changing as `rates` has it.
    pub(super) fn given_rates(&mut self, k: usize, rates: &mut [f64]) -> Result<()> {
        let first = self.first[k];
        let p = &mut self.parts[k];
        let able = p.slave.abilities();
        if !able.output_rates || p.outputs.is_empty() {
            return Ok(());
        }
        let moving = || p.inputs.iter().filter(|i| !i.held);
        if able.input_orders > 0 && moving().next().is_some() {
            let references: Vec<u32> = moving().map(|i| i.reference).collect();
            let slopes: Vec<f64> = moving().map(|i| i.feed.factor * rates[i.feed.source]).collect();
            p.slave.set_rates(&references, &vec![1; references.len()], &slopes)?;
            self.derivative_orders[k] = self.derivative_orders[k].max(1);
        }
        for (i, o) in p.outputs.iter().enumerate().filter(|(_, o)| o.kind == crate::Kind::Real) {
            let mut value = [0.0];
            // a slave may give the rates of some outputs only: the difference stands for the others
            if p.slave.rates(&[o.reference], &mut value).is_ok() && value[0].is_finite() {
                rates[first + i] = value[0];
            }
        }
        Ok(())
    }
}
