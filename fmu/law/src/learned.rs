//! A force of a shape of its own, learned from recordings: series over depth or speed, each with a range beyond which it stays as
//! it is there.
//!
//! A series at u from 0 to 1 is c_0 + sum of c_j sqrt(2) cos(j pi u), j up to 23 (Solin and Sarkka 2020: a Gaussian process on a
//! reduced basis). Its slope is 0 at both ends, so that the force has no kink where the range ends.

use crate::elementary::{cos_of_half_turns, exp, sin_of_half_turns};
use crate::energy::NODES;
use std::f64::consts::{PI, SQRT_2};

/// Terms of a series.
pub const TERMS: usize = 24;
/// Coefficients: the series of what does not depend on the speed, and of what does.
pub const COEFFICIENTS: usize = 2 * TERMS;
/// Depth within which a force between the faces rises from none at the touch, share of the range.
pub const RISE: f64 = 0.03;
/// Range of a series over the speed, in speeds that count as 1.
pub const SPEEDS: f64 = 2.0;
/// Speed over which a force turns with the motion, m/s.
const TURN: f64 = crate::body::SLIP_SPEED;
/// Pieces of a range for which the work of what depends on the speed is integrated, and the most of one step.
const PIECES: f64 = 64.0;
const MOST_PIECES: f64 = 1024.0;

/// How a force goes with the speed v, beside its part that does not; w is the speed over the one that counts as 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WithSpeed {
    /// Not.
    No,
    /// As w.
    Linear,
    /// As the sign of v, smoothed over 5 mm/s.
    Direction,
    /// As w |w|.
    Squared,
}

impl WithSpeed {
    /// Factor of its series at `v`, m/s, and the growth of that with v, s/m; `speed` m/s counts as 1.
    #[inline]
    fn factor(self, v: f64, speed: f64) -> (f64, f64) {
        let w = v / speed;
        match self {
            WithSpeed::No => (0.0, 0.0),
            WithSpeed::Linear => (w, 1.0 / speed),
            WithSpeed::Direction => {
                let turned = v / TURN;
                if turned.abs() < 1.0 {
                    (turned, 1.0 / TURN)
                } else {
                    (turned.signum(), 0.0)
                }
            }
            WithSpeed::Squared => (w * w.abs(), 2.0 * w.abs() / speed),
        }
    }
}

/// Waves that are computed side by side: none waits for the one before it.
const SIDE_BY_SIDE: usize = 4;

/// The first `terms` of 1, sqrt(2) cos(j pi u) at `u` held inside of 0 to 1, the others 0: by Chebyshev's recurrence, four waves on.
#[inline]
pub fn waves(u: f64, terms: usize) -> [f64; TERMS] {
    let mut all = [0.0; TERMS];
    all[0] = 1.0;
    if terms < 2 {
        return all;
    }
    let c = cos_of_half_turns(inside(u));
    let second = 2.0 * c * c - 1.0;
    let third = 2.0 * c * second - c;
    let fourth = 2.0 * second * second - 1.0;
    // cos(-x) = cos(x)
    let mut before = [third, second, c, 1.0];
    let mut now = [c, second, third, fourth];
    for four in all[1..terms].chunks_mut(SIDE_BY_SIDE) {
        four.iter_mut().zip(now.iter()).for_each(|(w, n)| *w = SQRT_2 * n);
        let mut next = [0.0; SIDE_BY_SIDE];
        for i in 0..SIDE_BY_SIDE {
            next[i] = 2.0 * fourth * now[i] - before[i];
        }
        before = now;
        now = next;
    }
    all
}

/// Terms of a series up to the last that is not 0.
#[inline]
fn terms(coefficients: &[f64]) -> usize {
    coefficients.iter().rposition(|c| *c != 0.0).map_or(0, |last| last + 1)
}

/// The sum of a series over `waves`.
#[inline]
fn sum(coefficients: &[f64], waves: &[f64; TERMS]) -> f64 {
    let mut sums = [0.0; SIDE_BY_SIDE];
    for (c, w) in coefficients.chunks(SIDE_BY_SIDE).zip(waves.chunks(SIDE_BY_SIDE)) {
        for ((s, c), w) in sums.iter_mut().zip(c).zip(w) {
            *s += c * w;
        }
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3])
}

/// A series at `u`, held constant outside of 0 to 1.
#[inline]
pub fn series(coefficients: &[f64], u: f64) -> f64 {
    let n = terms(coefficients);
    sum(&coefficients[..n], &waves(u, n))
}

/// Places at which a series is summed side by side.
const PLACES: usize = 8;

/// A series at each of `places`, which it replaces: as [`series`], within rounding (Clenshaw 1955), in a fraction of the time.
pub fn series_at(coefficients: &[f64], places: &mut [f64]) {
    let n = terms(coefficients);
    if n == 0 {
        places.iter_mut().for_each(|u| *u = 0.0);
        return;
    }
    for places in places.chunks_mut(PLACES) {
        let mut twice = [0.0; PLACES];
        for (t, u) in twice.iter_mut().zip(places.iter()) {
            *t = 2.0 * cos_of_half_turns(inside(*u));
        }
        let (mut now, mut before) = ([0.0; PLACES], [0.0; PLACES]);
        for c in coefficients[1..n].iter().rev() {
            for i in 0..PLACES {
                let next = SQRT_2 * c + twice[i] * now[i] - before[i];
                before[i] = now[i];
                now[i] = next;
            }
        }
        for (i, u) in places.iter_mut().enumerate() {
            *u = coefficients[0] + 0.5 * twice[i] * now[i] - before[i];
        }
    }
}

#[inline]
fn inside(u: f64) -> f64 {
    u.clamp(0.0, 1.0)
}

/// Calls `with` on j, j pi, and the cosine and the sine of j pi u, for j from 1 on.
fn sines(u: f64, mut with: impl FnMut(usize, f64, f64, f64)) {
    let (c, s) = (cos_of_half_turns(u), sin_of_half_turns(u));
    let (mut cosine, mut sine) = (1.0, 0.0);
    for j in 1..TERMS {
        let turned = (cosine * c - sine * s, sine * c + cosine * s);
        cosine = turned.0;
        sine = turned.1;
        with(j, PI * j as f64, cosine, sine);
    }
}

/// Growth of a series with u, at `u`.
fn slope(coefficients: &[f64], u: f64) -> f64 {
    if !(0.0..=1.0).contains(&u) {
        return 0.0;
    }
    let mut sum = 0.0;
    sines(u, |j, omega, _, sine| sum -= coefficients[j] * SQRT_2 * omega * sine);
    sum
}

/// A learned force: its coefficients, the range of its series, and the speed that counts as 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Learned {
    /// Coefficients of the series, N: those of what does not depend on the speed first.
    pub coefficients: [f64; COEFFICIENTS],
    /// Range of the series over the depth, or of a force on the body over the way before the stop, m.
    pub range: f64,
    /// Speed that counts as 1, m/s.
    pub speed: f64,
}

impl Default for Learned {
    fn default() -> Self {
        Learned { coefficients: [0.0; COEFFICIENTS], range: 1.0, speed: 1.0 }
    }
}

impl Learned {
    #[inline]
    fn alone(&self) -> &[f64] {
        &self.coefficients[..TERMS]
    }

    #[inline]
    fn with(&self) -> &[f64] {
        &self.coefficients[TERMS..]
    }

    /// Both series at `u` of the range and the speed `v`, m/s: N.
    #[inline]
    fn at(&self, goes: WithSpeed, u: f64, v: f64) -> f64 {
        let (alone, with) = (terms(self.alone()), if goes == WithSpeed::No { 0 } else { terms(self.with()) });
        let waves = waves(u, if alone > with { alone } else { with });
        let f = sum(&self.alone()[..alone], &waves);
        if with == 0 {
            return f;
        }
        f + sum(&self.with()[..with], &waves) * goes.factor(v, self.speed).0
    }

    /// Growth of that with u, N, and with v, N s/m.
    fn slopes(&self, goes: WithSpeed, u: f64, v: f64) -> (f64, f64) {
        let by_u = slope(self.alone(), u);
        if goes == WithSpeed::No {
            return (by_u, 0.0);
        }
        let (factor, growth) = goes.factor(v, self.speed);
        (by_u + slope(self.with(), u) * factor, series(self.with(), u) * growth)
    }

    /// Force between the faces, N, positive out of the stop, at the penetration `x` m and the speed `v` m/s: none before the touch.
    #[inline]
    pub fn between(&self, goes: WithSpeed, x: f64, v: f64) -> f64 {
        if x <= 0.0 {
            return 0.0;
        }
        let u = x / self.range;
        (1.0 - exp(-u / RISE)) * self.at(goes, u, v)
    }

    /// That force by each of the coefficients where it is 1 N: their sum with the coefficients as factors is the force.
    pub fn shapes_between(&self, goes: WithSpeed, x: f64, v: f64) -> [f64; COEFFICIENTS] {
        if x <= 0.0 {
            return [0.0; COEFFICIENTS];
        }
        let u = x / self.range;
        self.shapes(goes, 1.0 - exp(-u / RISE), u, v)
    }

    /// `share` times the shapes of both series at `u` of the range and the speed `v`, m/s.
    fn shapes(&self, goes: WithSpeed, share: f64, u: f64, v: f64) -> [f64; COEFFICIENTS] {
        let mut all = [0.0; COEFFICIENTS];
        let (alone, with) = all.split_at_mut(TERMS);
        let factor = goes.factor(v, self.speed).0;
        for ((a, b), w) in alone.iter_mut().zip(with).zip(waves(u, TERMS).iter()) {
            *a = share * w;
            *b = share * factor * w;
        }
        all
    }

    /// The part of that which depends on the speed, N.
    pub fn with_speed_between(&self, goes: WithSpeed, x: f64, v: f64) -> f64 {
        if x <= 0.0 || goes == WithSpeed::No {
            return 0.0;
        }
        let u = x / self.range;
        (1.0 - exp(-u / RISE)) * series(self.with(), u) * goes.factor(v, self.speed).0
    }

    /// Growth of that with x, N/m, and with v, N s/m.
    pub fn slopes_between(&self, goes: WithSpeed, x: f64, v: f64) -> (f64, f64) {
        if x <= 0.0 {
            return (0.0, 0.0);
        }
        let u = x / self.range;
        let left = exp(-u / RISE);
        let (by_u, by_v) = self.slopes(goes, u, v);
        (((1.0 - left) * by_u + left / RISE * self.at(goes, u, v)) / self.range, (1.0 - left) * by_v)
    }

    /// Energy, J, of the part between the faces that does not depend on the speed, at `x` m; 0 at 0 and below.
    pub fn energy_between(&self, x: f64) -> f64 {
        if x <= 0.0 {
            return 0.0;
        }
        let c = self.alone();
        let u = x / self.range;
        let within = inside(u);
        let (rate, left) = (1.0 / RISE, exp(-within / RISE));
        let mut sum = c[0] * (within - RISE * (1.0 - left));
        let mut end = c[0];
        sines(within, |j, omega, cosine, sine| {
            let risen = (rate + left * (omega * sine - rate * cosine)) / (rate * rate + omega * omega);
            sum += c[j] * SQRT_2 * (sine / omega - risen);
            end += c[j] * SQRT_2 * cosine;
        });
        let beyond = u - within;
        sum += end * (beyond - RISE * (left - exp(-u / RISE)));
        self.range * sum
    }

    /// Work, J, of the part between the faces that depends on the speed, over a step of straight x and v.
    pub fn work_between(&self, goes: WithSpeed, from: (f64, f64), to: (f64, f64)) -> f64 {
        let ((x0, v0), (x1, v1)) = (from, to);
        if goes == WithSpeed::No || x0.max(x1) <= 0.0 || x0 == x1 {
            return 0.0;
        }
        // only what is in contact
        let share = |x: f64| inside((x - x0) / (x1 - x0));
        let (a, b) = if x0 < 0.0 { (share(0.0), 1.0) } else { (0.0, if x1 < 0.0 { share(0.0) } else { 1.0 }) };
        let pieces = ((b - a) * (x1 - x0).abs() / self.range * PIECES).ceil().clamp(1.0, MOST_PIECES);
        let width = (b - a) / pieces;
        let at = |s: f64| self.with_speed_between(goes, x0 + s * (x1 - x0), v0 + s * (v1 - v0));
        let mut sum = 0.0;
        for i in 0..pieces as usize {
            let begin = a + width * i as f64;
            sum += NODES.iter().map(|node| at(begin + node * width)).sum::<f64>();
        }
        0.5 * width * (x1 - x0) * sum
    }

    /// Force on the body along +x, N, at the position `x` m and the speed `v` m/s: of a place before the stop.
    #[inline]
    pub fn of_place(&self, goes: WithSpeed, x: f64, v: f64) -> f64 {
        -self.at(goes, -x / self.range, v)
    }

    /// That force by each of the coefficients where it is 1 N.
    pub fn shapes_of_place(&self, goes: WithSpeed, x: f64, v: f64) -> [f64; COEFFICIENTS] {
        self.shapes(goes, -1.0, -x / self.range, v)
    }

    /// Growth of that with x, N/m, and with v, N s/m.
    pub fn slopes_of_place(&self, goes: WithSpeed, x: f64, v: f64) -> (f64, f64) {
        let (by_u, by_v) = self.slopes(goes, -x / self.range, v);
        (by_u / self.range, -by_v)
    }

    /// Whether the way `x`, m, into the range is farther than it was learned.
    pub fn is_farther(&self, x: f64) -> bool {
        x > self.range
    }

    /// Whether the speed `v`, m/s, is higher than it was learned.
    pub fn is_faster(&self, v: f64) -> bool {
        v.abs() > SPEEDS * self.speed
    }
}

/// Force on a body along +x, N, that depends on its speed `v` m/s alone, by a series; `speed` m/s counts as 1.
#[inline]
pub fn of_speed(coefficients: &[f64], speed: f64, v: f64) -> f64 {
    let w = v / speed;
    -w * series(coefficients, w.abs() / SPEEDS)
}

/// That force by each of the coefficients where it is 1 N.
pub fn shapes_of_speed(speed: f64, v: f64) -> [f64; TERMS] {
    let w = v / speed;
    let mut all = waves(w.abs() / SPEEDS, TERMS);
    all.iter_mut().for_each(|a| *a *= -w);
    all
}

/// Growth of that with v, N s/m.
pub fn slope_of_speed(coefficients: &[f64], speed: f64, v: f64) -> f64 {
    let w = (v / speed).abs();
    -(series(coefficients, w / SPEEDS) + w / SPEEDS * slope(coefficients, w / SPEEDS)) / speed
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some() -> Learned {
        let mut l = Learned { range: 2e-3, speed: 0.7, ..Learned::default() };
        for (i, c) in l.coefficients.iter_mut().enumerate() {
            *c = 10.0 * (1.3 * i as f64).sin() / (1.0 + i as f64);
        }
        l
    }

    const ALL: [WithSpeed; 4] = [WithSpeed::No, WithSpeed::Linear, WithSpeed::Direction, WithSpeed::Squared];

    fn near(a: f64, b: f64, within: f64) {
        assert!((a - b).abs() <= within * (1.0 + b.abs()), "{} {}", a, b);
    }

    #[test]
    fn a_series_is_its_sum_of_cosines_and_stays_beyond_its_ends() {
        let l = some();
        for u in [0.0, 0.13, 0.5, 0.9, 1.0] {
            let cosines = |(j, c): (usize, &f64)| c * SQRT_2 * (PI * (j + 1) as f64 * u).cos();
            let want = l.coefficients[0] + l.coefficients[1..TERMS].iter().enumerate().map(cosines).sum::<f64>();
            near(series(&l.coefficients[..TERMS], u), want, 1e-13);
        }
        assert_eq!(series(&l.coefficients[..TERMS], 1.5), series(&l.coefficients[..TERMS], 1.0));
        for n in [0, 1, 2, 9, TERMS] {
            let places: Vec<f64> = (-3..30).map(|i| i as f64 * 0.04).collect();
            let mut all = places.clone();
            series_at(&l.coefficients[..n], &mut all);
            places.iter().zip(&all).for_each(|(u, sum)| near(*sum, series(&l.coefficients[..n], *u), 1e-13));
        }
        assert_eq!(series(&l.coefficients[..TERMS], -0.5), series(&l.coefficients[..TERMS], 0.0));
    }

    #[test]
    fn every_slope_is_that_of_its_force() {
        let l = some();
        let difference = |f: &dyn Fn(f64) -> f64, x: f64, h: f64| (f(x + h) - f(x - h)) / (2.0 * h);
        for v in [-1.1, -0.003, 0.002, 0.4, 1.7] {
            for x in [1e-5, 4e-4, 1.7e-3, 2.5e-3] {
                for goes in ALL.iter().copied() {
                    let (by_x, by_v) = l.slopes_between(goes, x, v);
                    near(by_x, difference(&|x| l.between(goes, x, v), x, 1e-9), 1e-5);
                    near(by_v, difference(&|v| l.between(goes, x, v), v, 1e-7), 1e-5);
                    let (by_x, by_v) = l.slopes_of_place(goes, -x, v);
                    near(by_x, difference(&|x| l.of_place(goes, x, v), -x, 1e-9), 1e-5);
                    near(by_v, difference(&|v| l.of_place(goes, -x, v), v, 1e-7), 1e-5);
                }
            }
            let (c, speed) = (&l.coefficients[..TERMS], l.speed);
            near(slope_of_speed(c, speed, v), difference(&|v| of_speed(c, speed, v), v, 1e-7), 1e-5);
        }
    }

    #[test]
    fn the_shapes_of_the_coefficients_make_up_the_force() {
        let l = some();
        let whole = |shapes: &[f64]| shapes.iter().zip(l.coefficients.iter()).map(|(s, c)| s * c).sum::<f64>();
        for v in [-1.1, -0.003, 0.002, 0.4, 1.7] {
            for x in [-1e-3, 1e-5, 4e-4, 2.5e-3] {
                for goes in ALL.iter().copied() {
                    near(whole(&l.shapes_between(goes, x, v)), l.between(goes, x, v), 1e-12);
                    near(whole(&l.shapes_of_place(goes, x, v)), l.of_place(goes, x, v), 1e-12);
                }
            }
            let (c, speed) = (&l.coefficients[..TERMS], l.speed);
            near(whole(&shapes_of_speed(speed, v)), of_speed(c, speed, v), 1e-12);
        }
    }

    #[test]
    fn the_energy_is_the_integral_of_the_force_at_rest_and_the_work_that_of_the_rest() {
        let l = some();
        for x in [1e-6, 5e-5, 8e-4, 2e-3, 3e-3] {
            let n = 20_000;
            let mid = |i: usize| (i as f64 + 0.5) / n as f64;
            let sum: f64 = (0..n).map(|i| l.between(WithSpeed::No, x * mid(i), 0.0)).sum();
            near(l.energy_between(x), sum * x / n as f64, 1e-9);
            for goes in [WithSpeed::Linear, WithSpeed::Squared].iter().copied() {
                let (from, to) = ((-2e-4, 1.0), (x, 0.2));
                let part = |s: f64| {
                    let (x, v) = (from.0 + s * (to.0 - from.0), from.1 + s * (to.1 - from.1));
                    l.between(goes, x, v) - l.between(WithSpeed::No, x, v)
                };
                let sum: f64 = (0..n).map(|i| part(mid(i))).sum();
                near(l.work_between(goes, from, to), sum * (to.0 - from.0) / n as f64, 1e-8);
            }
        }
        assert_eq!(l.energy_between(-1.0), 0.0);
        assert_eq!(l.work_between(WithSpeed::Linear, (-1.0, 1.0), (-0.5, 1.0)), 0.0);
    }

    #[test]
    fn beyond_what_was_learned_is_told() {
        let l = some();
        assert!(!l.is_farther(2e-3) && !l.is_faster(1.4) && l.is_farther(2.1e-3) && l.is_faster(-1.5));
    }
}
