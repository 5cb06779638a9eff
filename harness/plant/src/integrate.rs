//! Dormand and Prince 1980, 5(4), with Hairer's dense output (Hairer, Norsett, Wanner 1993, II.6): the one integrator of
//! every rig. A [`Control`] says how fine its steps are and how events are located: on the dense polynomial, as an
//! estimation needs it for speed, or by shortening the step itself until it ends on the event, as a scenario needs it
//! to be exact.

use crate::roots::{crossing, Narrowing};
use crate::tableau::{A, C, E};
use anyhow::Result;

/// Most state variables any rig here has.
pub const MAX: usize = 18;
/// State vector; only the first entries, as many as the system has variables, are used.
pub type State = [f64; MAX];

/// Most event functions of a system.
pub const MOST_EVENTS: usize = 24;
/// Values of the event functions; only as many as the system has are used.
pub type Events = [f64; MOST_EVENTS];

const D: [f64; 7] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

/// What an event function is like, where its event is located by shortening the step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crossing {
    /// Smooth; a change of sign within 1e-9 of the step's start is what rounding left of the event just passed.
    Smooth,
    /// Smooth, and put to zero exactly when its event is accepted: every change of sign is an event.
    Met,
    /// It knows only two values.
    Switch,
}

/// A step that is accepted.
pub struct Taken<'a> {
    /// Time before it, s.
    pub t0: f64,
    /// Its length, s; negative backwards in time.
    pub h: f64,
    /// State before it.
    pub y0: &'a State,
    /// Rates before it.
    pub dy0: &'a State,
    /// Rates at its end, memory as during the step; None where the polynomial ended it.
    pub dy1: Option<&'a State>,
    /// The event function that ended it.
    pub event: Option<usize>,
}

/// What an accepted step brought with it.
#[derive(Clone, Copy, Debug)]
pub struct After {
    /// Whether the state, or the rates at it, are other than at the step's last stage.
    pub changed: bool,
    /// Longest step to take next, s; infinite: any.
    pub next: f64,
}

/// A system of ordinary differential equations with memory that changes only between steps.
pub trait System {
    /// Number of state variables, at most [`MAX`].
    fn dimension(&self) -> usize;
    /// Number of those, from the first on, whose error counts; the others are integrated along.
    fn controlled(&self) -> usize {
        self.dimension()
    }
    /// Right-hand side: writes the first [`System::dimension`] entries of `dy`.
    ///
    /// # Errors
    /// Where a part of the system refuses; the integration ends with it.
    fn rates(&self, t: f64, y: &State, dy: &mut State) -> Result<()>;
    /// Size of each variable that counts as one in the error norm.
    fn scale(&self) -> &State;
    /// Values of the event functions whose changes of sign end a step, and their number, at most [`MOST_EVENTS`]. `dy`
    /// are the rates there; None inside a polynomial.
    ///
    /// # Errors
    /// As [`System::rates`].
    fn events(&self, t: f64, y: &State, dy: Option<&State>, out: &mut Events) -> Result<usize>;
    /// What event function `i` is like.
    fn crossing(&self, _i: usize) -> Crossing {
        Crossing::Smooth
    }
    /// Longest step from here, s; infinite: any.
    fn longest_step(&self, _t: f64, _y: &State, _dy: &State) -> f64 {
        f64::INFINITY
    }
    /// Called after each accepted step with the new state, which it may change.
    ///
    /// # Errors
    /// As [`System::rates`].
    fn accept(&mut self, taken: &Taken<'_>, y: &mut State) -> Result<After>;
}

/// One accepted step, for interpolation within it.
pub struct Step {
    /// Time at its start, s.
    pub t0: f64,
    /// Its length, s; negative backwards in time.
    pub h: f64,
    n: usize,
    r: [State; 5],
}

impl Step {
    /// State at `t0 + theta h`, theta in 0..=1.
    #[inline]
    pub fn at(&self, theta: f64) -> State {
        let mut y = [0.0; MAX];
        let w = 1.0 - theta;
        for i in 0..self.n {
            y[i] =
                self.r[0][i] + theta * (self.r[1][i] + w * (self.r[2][i] + theta * (self.r[3][i] + w * self.r[4][i])));
        }
        y
    }

    /// The polynomial of a step of `h` s from (`t0`, `y`) to `z` with the stages `k`.
    #[inline]
    fn new(n: usize, t0: f64, h: f64, y: &State, z: &State, k: &[State; 7]) -> Step {
        let mut step = Step { t0, h, n, r: [[0.0; MAX]; 5] };
        for j in 0..n {
            let d = z[j] - y[j];
            let b = h * k[0][j] - d;
            step.r[0][j] = y[j];
            step.r[1][j] = d;
            step.r[2][j] = b;
            step.r[3][j] = d - h * k[6][j] - b;
            let mut sum = 0.0;
            for i in 0..7 {
                sum += D[i] * k[i][j];
            }
            step.r[4][j] = h * sum;
        }
        step
    }
}

#[inline]
fn stages<S: System>(s: &S, n: usize, t: f64, y: &State, h: f64, k: &mut [State; 7]) -> Result<State> {
    let mut z = *y;
    for i in 1..7 {
        for j in 0..n {
            let mut sum = 0.0;
            for l in 0..i {
                sum += A[i][l] * k[l][j];
            }
            z[j] = y[j] + h * sum;
        }
        let (_, rest) = k.split_at_mut(i);
        s.rates(t + C[i] * h, &z, &mut rest[0])?;
    }
    Ok(z)
}

/// How events are located.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Locate {
    /// On the dense polynomial of the step that they fall in: next to no cost, exact to the polynomial's order.
    Polynomial,
    /// By shortening the step itself until it ends on the event, in steps whose lengths the clock holds exactly.
    /// Forwards in time only; backwards events are located on the polynomial.
    Step,
}

/// How an integration is controlled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Control {
    /// How events are located.
    pub locate: Locate,
    /// Error a step, relative to the system's scale: root mean square over what is controlled.
    pub tolerance: f64,
    /// First step to try, s.
    pub first: f64,
    /// Longest step, s.
    pub longest: f64,
    /// Attempts at a step after which it gives up.
    pub most: usize,
}

impl Control {
    /// Events on the polynomial, no limits of its own: what an estimation runs with.
    pub const fn dense(tolerance: f64) -> Control {
        Control {
            locate: Locate::Polynomial,
            tolerance,
            first: f64::INFINITY,
            longest: f64::INFINITY,
            most: usize::MAX,
        }
    }

    /// Events by shortening the step, from a first step of 10 microseconds on: what a scenario runs with.
    pub const fn exact(tolerance: f64) -> Control {
        Control { locate: Locate::Step, first: 1e-5, ..Control::dense(tolerance) }
    }
}

/// `h` as far as the clock can resolve it at `t`.
fn on_clock(t: f64, h: f64) -> f64 {
    (t + h) - t
}

/// The shortest step the clock can resolve at `t` that is no shorter than `h`: an event stays behind it.
fn beyond(t: f64, h: f64) -> f64 {
    let end = t + h;
    if end - t < h {
        end.next_up() - t
    } else {
        end - t
    }
}

/// Share of a step within which a smooth event is the one just passed.
const PASSED: f64 = 1e-9;

/// An integration under way, one accepted step at a time.
pub struct Stepper {
    t: f64,
    y: State,
    /// Stages of the last attempt; the first are the rates at (`t`, `y`).
    k: [State; 7],
    /// Event functions at (`t`, `y`).
    g: Events,
    h: f64,
    end: f64,
    dir: f64,
    span: f64,
    attempts: usize,
    control: Control,
}

impl Stepper {
    /// Starts at (`t` s, `y`) towards `end` s, which may lie before `t`.
    ///
    /// # Errors
    /// As [`System::rates`].
    pub fn new<S: System>(s: &S, t: f64, y: &State, end: f64, control: &Control) -> Result<Stepper> {
        let span = (end - t).abs();
        let mut new = Stepper {
            t,
            y: *y,
            k: [[0.0; MAX]; 7],
            g: [0.0; MOST_EVENTS],
            h: control.first.min(control.longest).min(span),
            end,
            dir: if end >= t { 1.0 } else { -1.0 },
            span,
            attempts: 0,
            control: *control,
        };
        s.rates(t, y, &mut new.k[0])?;
        s.events(t, y, Some(&new.k[0]), &mut new.g)?;
        Ok(new)
    }

    /// Time, s.
    pub fn time(&self) -> f64 {
        self.t
    }

    /// State.
    pub fn state(&self) -> &State {
        &self.y
    }

    /// Rates of the state.
    pub fn rates(&self) -> &State {
        &self.k[0]
    }

    /// Whether the end is reached.
    pub fn done(&self) -> bool {
        let left = (self.end - self.t) * self.dir;
        left.is_nan() || left <= self.span * 1e-13
    }

    /// Takes one step, to the first event in it if there is one, and calls `each` with it before it is accepted: the
    /// event that ended it. False where it gives up: a step too small, a state that is not finite, too many attempts.
    ///
    /// # Errors
    /// As [`System::rates`].
    #[inline]
    pub fn advance<S: System>(&mut self, s: &mut S, each: &mut impl FnMut(&S, &Step)) -> Result<Advance> {
        let (n, controlled) = (s.dimension(), s.controlled());
        let Control { locate, tolerance, longest, most, .. } = self.control;
        let exact = locate == Locate::Step && self.dir > 0.0;
        loop {
            self.attempts += 1;
            if self.attempts > most {
                return Ok(Advance::GaveUp);
            }
            // what is left of a step that was too long
            let shortest = 1e-16 * (1.0 + self.t.abs());
            let remaining = (self.end - self.t) * self.dir;
            let mut h = self.h.min(s.longest_step(self.t, &self.y, &self.k[0]));
            if h > remaining {
                h = remaining;
            }
            if exact {
                h = on_clock(self.t, h);
                if h <= 0.0 {
                    h = beyond(self.t, f64::MIN_POSITIVE);
                }
            }
            self.h = h;
            let z = stages(s, n, self.t, &self.y, self.dir * h, &mut self.k)?;
            let mut err = 0.0;
            for j in 0..controlled {
                let mut e = 0.0;
                for i in 0..7 {
                    e += E[i] * self.k[i][j];
                }
                let q = h * e / (s.scale()[j] * tolerance);
                err += q * q;
            }
            let err = (err / controlled as f64).sqrt();
            if !err.is_finite() {
                self.h *= 0.1;
                if self.h < if exact { shortest } else { self.span * 1e-14 } {
                    return Ok(Advance::GaveUp);
                }
                continue;
            }
            // a step that an estimation has to shorten so much is taken as it is
            if err > 1.0 && (exact || h > self.span * 1e-12) {
                self.h *= (0.9 * err.powf(-0.2)).max(0.2);
                if exact && self.h < shortest {
                    return Ok(Advance::GaveUp);
                }
                continue;
            }
            let grow = if err > 0.0 { (0.9 * err.powf(-0.2)).clamp(0.2, 4.0) } else { 4.0 };
            return if exact {
                self.h = (h * grow).min(longest);
                self.end_on_event(s, z, h, each)
            } else {
                let cut = self.on_polynomial(s, &z, each)?;
                if let Some((event, theta, end)) = cut {
                    let full = self.dir * h;
                    self.h = (full.abs() * 0.5).min(longest);
                    self.accept(s, full * theta, end, Some(event), false)?;
                    return Ok(Advance::Step(Some(event)));
                }
                self.h = (h * grow).min(longest);
                self.accept(s, self.dir * h, z, None, true)?;
                Ok(Advance::Step(None))
            };
        }
    }

    /// Calls `each` with the step to `z`, up to the first event in it: that event's number, where in the step it is,
    /// and the state there, all on the polynomial.
    #[inline]
    fn on_polynomial<S: System>(
        &mut self,
        s: &S,
        z: &State,
        each: &mut impl FnMut(&S, &Step),
    ) -> Result<Option<(usize, f64, State)>> {
        let h = self.dir * self.h;
        let step = Step::new(s.dimension(), self.t, h, &self.y, z, &self.k);
        let mut g1 = [0.0; MOST_EVENTS];
        let m = s.events(self.t + h, z, Some(&self.k[6]), &mut g1)?;
        let mut cut = (0, 1.0);
        for e in 0..m {
            let ends = (self.g[e], g1[e]);
            if ends.0 != 0.0 && ends.0 * ends.1 < 0.0 {
                let mut g = [0.0; MOST_EVENTS];
                let at = crossing(1.0, ends, Narrowing::Cheap, |theta| {
                    s.events(step.t0 + theta * step.h, &step.at(theta), None, &mut g)?;
                    Ok::<f64, anyhow::Error>(g[e])
                })?;
                if at < cut.1 {
                    cut = (e, at);
                }
            }
        }
        if cut.1 < 1.0 - 1e-9 {
            let theta = cut.1.max(1e-9);
            let end = step.at(theta);
            each(s, &Cut { step: &step, theta }.step_until());
            return Ok(Some((cut.0, theta, end)));
        }
        each(s, &step);
        Ok(None)
    }

    /// Ends the step of `h` to `z` on the first event in it, and accepts it.
    fn end_on_event<S: System>(
        &mut self,
        s: &mut S,
        mut z: State,
        h: f64,
        each: &mut impl FnMut(&S, &Step),
    ) -> Result<Advance> {
        let (n, t) = (s.dimension(), self.t);
        let mut g1 = [0.0; MOST_EVENTS];
        let m = s.events(t + h, &z, Some(&self.k[6]), &mut g1)?;
        let mut found: Option<(usize, f64)> = None;
        let mut k = self.k;
        for e in 0..m {
            let ends = (self.g[e], g1[e]);
            if ends.0 * ends.1 >= 0.0 || ends.0.is_nan() || ends.1.is_nan() {
                continue;
            }
            let like = s.crossing(e);
            let how = if like == Crossing::Switch { Narrowing::Halving } else { Narrowing::Costly };
            let mut g = [0.0; MOST_EVENTS];
            let at = crossing(h, ends, how, |x| {
                let w = stages(s, n, t, &self.y, x, &mut k)?;
                s.events(t + x, &w, Some(&k[6]), &mut g)?;
                Ok::<f64, anyhow::Error>(g[e])
            })?;
            if (like == Crossing::Met || at > PASSED * h) && found.is_none_or(|(_, first)| at < first) {
                found = Some((e, at));
            }
        }
        let mut taken = h;
        if let Some((_, at)) = found {
            taken = beyond(t, at);
            z = stages(s, n, t, &self.y, taken, &mut self.k)?;
        }
        each(s, &Step::new(n, t, taken, &self.y, &z, &self.k));
        let event = found.map(|f| f.0);
        self.accept(s, taken, z, event, true)?;
        Ok(Advance::Step(event))
    }

    /// Accepts a step of `h` (signed) to `z`; `whole`: the last stage stands at its end.
    #[inline]
    fn accept<S: System>(&mut self, s: &mut S, h: f64, mut z: State, event: Option<usize>, whole: bool) -> Result<()> {
        let dy1 = whole.then_some(&self.k[6]);
        let taken = Taken { t0: self.t, h, y0: &self.y, dy0: &self.k[0], dy1, event };
        let after = s.accept(&taken, &mut z)?;
        self.t += h;
        self.y = z;
        self.h = self.h.min(after.next);
        if after.changed || !whole {
            s.rates(self.t, &self.y, &mut self.k[0])?;
        } else {
            self.k[0] = self.k[6];
        }
        s.events(self.t, &self.y, Some(&self.k[0]), &mut self.g)?;
        Ok(())
    }
}

/// What came of an attempt to go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Advance {
    /// A step was accepted, ended by that event if any.
    Step(Option<usize>),
    /// The step became too small, the state not finite, or the attempts too many.
    GaveUp,
}

/// Integrates from (`t`, `y`) to `end` (which may lie before `t`), calling `each` with every accepted step, before it
/// is accepted. False when the step became too small or the state not finite, or [`Control::most`] attempts did not do.
///
/// # Errors
/// As [`System::rates`].
pub fn integrate<S: System>(
    s: &mut S,
    t: f64,
    y: &mut State,
    end: f64,
    control: &Control,
    mut each: impl FnMut(&S, &Step),
) -> Result<bool> {
    if t == end || control.first == 0.0 {
        return Ok(true);
    }
    let mut stepper = Stepper::new(s, t, y, end, control)?;
    while !stepper.done() {
        let ok = stepper.advance(s, &mut each)? != Advance::GaveUp;
        *y = stepper.y;
        if !ok {
            return Ok(false);
        }
    }
    Ok(true)
}

struct Cut<'a> {
    step: &'a Step,
    theta: f64,
}

impl Cut<'_> {
    /// The same polynomial re-expressed on the shortened interval, by its four interior values and slopes:
    /// the quartic in theta is rescaled exactly.
    fn step_until(&self) -> Step {
        // Step::at is y = r0 + th (r1 + w (r2 + th (r3 + w r4))), w = 1 - th: expand in powers of th,
        // scale, and collect again.
        let c = self.theta;
        let mut r = [[0.0; MAX]; 5];
        for i in 0..self.step.n {
            let [r0, r1, r2, r3, r4] =
                [self.step.r[0][i], self.step.r[1][i], self.step.r[2][i], self.step.r[3][i], self.step.r[4][i]];
            // th(1-th)th(1-th) r4 = th^2 - 2 th^3 + th^4
            let p1 = (r1 + r2) * c;
            let p2 = (-r2 + r3 + r4) * c * c;
            let p3 = (-r3 - 2.0 * r4) * c * c * c;
            let p4 = r4 * c * c * c * c;
            let q4 = p4;
            let q3 = -p3 - 2.0 * q4;
            let q2 = -(p2 - q3 - q4);
            let q1 = p1 - q2;
            r[0][i] = r0;
            r[1][i] = q1;
            r[2][i] = q2;
            r[3][i] = q3;
            r[4][i] = q4;
        }
        Step { t0: self.step.t0, h: self.step.h * c, n: self.step.n, r }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Oscillator(State);
    impl System for Oscillator {
        fn dimension(&self) -> usize {
            2
        }
        fn rates(&self, _: f64, y: &State, dy: &mut State) -> Result<()> {
            dy[0] = y[1];
            dy[1] = -y[0];
            Ok(())
        }
        fn scale(&self) -> &State {
            &self.0
        }
        fn events(&self, _: f64, y: &State, _: Option<&State>, out: &mut Events) -> Result<usize> {
            out[0] = y[0];
            Ok(1)
        }
        fn accept(&mut self, _: &Taken<'_>, _: &mut State) -> Result<After> {
            Ok(After { changed: false, next: f64::INFINITY })
        }
    }

    #[test]
    fn oscillator_and_its_dense_output_follow_the_sine_across_events() {
        let mut y = [0.0; MAX];
        y[1] = 1.0;
        let mut worst: f64 = 0.0;
        let control = Control { first: 0.01, longest: 1.0, most: 10_000, ..Control::dense(1e-10) };
        let ok = integrate(&mut Oscillator([1.0; MAX]), 0.0, &mut y, 10.0, &control, |_, s| {
            for i in 0..=10 {
                let th = i as f64 / 10.0;
                worst = worst.max((s.at(th)[0] - (s.t0 + th * s.h).sin()).abs());
            }
        })
        .unwrap();
        assert!(ok && worst < 1e-8, "{worst}");
        assert!((y[0] - 10f64.sin()).abs() < 1e-8);
    }

    #[test]
    fn an_event_is_never_put_before_its_instant() {
        for t in [0.0, 1e-9, 0.1, 0.219_162_4, 3.0, 1e4] {
            for h in [1e-30, 1e-18, 1e-17, 3.3e-13, 1e-7, 0.02] {
                let taken = beyond(t, h);
                assert!(taken >= h && t + taken > t, "{t} {h}: {taken}");
                assert!(t + taken - t == taken, "the clock holds it exactly");
                assert!(taken <= h + 4.0 * f64::EPSILON * (t + h), "{t} {h}: {taken}");
            }
        }
    }
}
