//! Dormand and Prince 1980, 5(4), with Hairer's dense output (Hairer, Norsett, Wanner 1993, II.6)
//! and events located on it.

use crate::tableau::{A, C, E};

/// Most state variables any rig here has.
pub const MAX: usize = 14;
/// Most event functions.
pub const EVENTS: usize = 5;
/// State vector; only the first `n` entries are used.
pub type State = [f64; MAX];

const D: [f64; 7] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

/// A system of ordinary differential equations with memory that changes only between steps.
pub trait System {
    /// Number of state variables, at most [`MAX`].
    fn dimension(&self) -> usize;
    /// Right-hand side.
    fn rates(&self, t: f64, y: &State, dy: &mut State);
    /// Size of each variable that counts as one in the error norm.
    fn scale(&self) -> &State;
    /// Event functions whose sign changes end a step.
    fn events(&self, t: f64, y: &State, out: &mut [f64; EVENTS]) -> usize;
    /// Called after each accepted step with the new state; true where it changed the state or the rates at it.
    fn accept(&mut self, t: f64, y: &mut State) -> bool;
}

/// One accepted step, for interpolation within it.
pub struct Step {
    pub t0: f64,
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
}

fn stages<S: System>(s: &S, n: usize, t: f64, y: &State, h: f64, k: &mut [State; 7]) -> State {
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
        s.rates(t + C[i] * h, &z, &mut rest[0]);
    }
    z
}

/// How an integration is controlled.
#[derive(Clone, Copy, Debug)]
pub struct Control {
    /// Error a step, relative to the system's scale.
    pub tolerance: f64,
    /// First and largest step, s.
    pub first: f64,
    pub largest: f64,
    /// Steps after which it gives up.
    pub most: usize,
}

/// Integrates from (`t`, `y`) to `end` (which may lie before `t`), calling `each` with every accepted step.
/// Returns false when the step became too small or the state not finite, or `most` steps did not do.
pub fn integrate<S: System>(
    s: &mut S,
    mut t: f64,
    y: &mut State,
    end: f64,
    control: &Control,
    mut each: impl FnMut(&S, &Step),
) -> bool {
    let Control { tolerance, first, largest, most } = *control;
    let n = s.dimension();
    let dir = if end >= t { 1.0 } else { -1.0 };
    let mut h = first.min(largest).min((end - t).abs());
    if h == 0.0 {
        return true;
    }
    let mut k = [[0.0; MAX]; 7];
    s.rates(t, y, &mut k[0]);
    let span = (end - t).abs();
    let mut count = 0;
    while (end - t) * dir > span * 1e-13 {
        count += 1;
        if count > most {
            return false;
        }
        let remaining = (end - t) * dir;
        if h > remaining {
            h = remaining;
        }
        let z = stages(s, n, t, y, dir * h, &mut k);
        let mut err = 0.0;
        for j in 0..n {
            let mut e = 0.0;
            for i in 0..7 {
                e += E[i] * k[i][j];
            }
            let q = h * e / (s.scale()[j] * tolerance);
            err += q * q;
        }
        let err = (err / n as f64).sqrt();
        if !err.is_finite() {
            h *= 0.1;
            if h < span * 1e-14 {
                return false;
            }
            continue;
        }
        if err > 1.0 && h > span * 1e-12 {
            h *= (0.9 * err.powf(-0.2)).max(0.2);
            continue;
        }
        let mut step = Step { t0: t, h: dir * h, n, r: [[0.0; MAX]; 5] };
        for j in 0..n {
            let d = z[j] - y[j];
            let b = dir * h * k[0][j] - d;
            step.r[0][j] = y[j];
            step.r[1][j] = d;
            step.r[2][j] = b;
            step.r[3][j] = d - dir * h * k[6][j] - b;
            let mut sum = 0.0;
            for i in 0..7 {
                sum += D[i] * k[i][j];
            }
            step.r[4][j] = dir * h * sum;
        }
        // an event inside: shorten the step to end just past it
        let (mut g0, mut g1) = ([0.0; EVENTS], [0.0; EVENTS]);
        let m = s.events(t, y, &mut g0);
        s.events(t + dir * h, &z, &mut g1);
        let mut cut = 1.0;
        for e in 0..m {
            if g0[e] != 0.0 && g0[e] * g1[e] < 0.0 {
                let (mut lo, mut hi) = (0.0, 1.0);
                let (mut flo, mut fhi) = (g0[e], g1[e]);
                let mut side = 0;
                for _ in 0..60 {
                    let mid = if hi - lo < 1e-3 { 0.5 * (lo + hi) } else { (lo * fhi - hi * flo) / (fhi - flo) };
                    let mut g = [0.0; EVENTS];
                    s.events(step.t0 + mid * step.h, &step.at(mid), &mut g);
                    if g[e] * g0[e] > 0.0 {
                        lo = mid;
                        flo = g[e];
                        if side == -1 {
                            fhi *= 0.5;
                        }
                        side = -1;
                    } else {
                        hi = mid;
                        fhi = g[e];
                        if side == 1 {
                            flo *= 0.5;
                        }
                        side = 1;
                    }
                    if hi - lo < 1e-12 {
                        break;
                    }
                }
                if hi < cut {
                    cut = hi;
                }
            }
        }
        if cut < 1.0 - 1e-9 {
            // the polynomial located it; end the step there, on the polynomial
            let theta = cut.max(1e-9);
            let mut znew = step.at(theta);
            let full = step.h;
            let part = Cut { step: &step, theta };
            let sub = part.step_until();
            each(s, &sub);
            t += full * theta;
            s.accept(t, &mut znew);
            *y = znew;
            s.rates(t, y, &mut k[0]);
            h = (full.abs() * 0.5).min(largest);
            continue;
        }
        each(s, &step);
        t += dir * h;
        *y = z;
        if s.accept(t, y) {
            s.rates(t, y, &mut k[0]);
        } else {
            k[0] = k[6];
        }
        let grow = if err > 0.0 { (0.9 * err.powf(-0.2)).clamp(0.2, 4.0) } else { 4.0 };
        h = (h * grow).min(largest);
    }
    true
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
        fn rates(&self, _: f64, y: &State, dy: &mut State) {
            dy[0] = y[1];
            dy[1] = -y[0];
        }
        fn scale(&self) -> &State {
            &self.0
        }
        fn events(&self, _: f64, y: &State, out: &mut [f64; EVENTS]) -> usize {
            out[0] = y[0];
            1
        }
        fn accept(&mut self, _: f64, _: &mut State) -> bool {
            false
        }
    }

    #[test]
    fn oscillator_and_its_dense_output_follow_the_sine_across_events() {
        let mut y = [0.0; MAX];
        y[1] = 1.0;
        let mut worst: f64 = 0.0;
        let control = Control { tolerance: 1e-10, first: 0.01, largest: 1.0, most: 10_000 };
        let ok = integrate(&mut Oscillator([1.0; MAX]), 0.0, &mut y, 10.0, &control, |_, s| {
            for i in 0..=10 {
                let th = i as f64 / 10.0;
                worst = worst.max((s.at(th)[0] - (s.t0 + th * s.h).sin()).abs());
            }
        });
        assert!(ok && worst < 1e-8, "{worst}");
        assert!((y[0] - 10f64.sin()).abs() < 1e-8);
    }
}
