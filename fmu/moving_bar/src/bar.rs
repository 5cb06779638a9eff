//! The bar's motion: m x'' = P - c (x + s) - b x' - H exp(-t/tau) + m g - F(t), x > 0 into the stop, s the travel.
//!
//! F is a cubic over a step (its value and input derivatives), so every term has a Taylor series with a closed
//! recursion, and the motion is had to rounding: substeps of half the shortest time constant, 24 terms (Barrio, Blesa
//! and Lara 2005, on Taylor methods). The seat at x = -s is hit without rebound and left when the drive exceeds the
//! hold.

use face::text;
use law::elementary::exp;
use variables::Settings;

/// Terms of the series: 0.5^24 / 24! is far below rounding.
const TERMS: usize = 24;
/// Most substeps of one step.
const MOST_SUBSTEPS: f64 = 1e6;
/// Places at which it is looked whether the bar leaves its seat within a step.
const LOOKS: usize = 16;
/// Halvings that bring an interval down to rounding.
const HALVINGS: usize = 60;

/// Position, speed, seat and what passed through the port.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct Motion {
    /// Penetration, m.
    pub x: f64,
    /// Its rate, m/s.
    pub v: f64,
    /// Whether the bar sits on its seat.
    pub seated: bool,
    /// Work done against the input force so far, J.
    pub work: f64,
}

/// Input force and its derivatives over a step: N, N/s, N/s^2, N/s^3.
pub type Push = [f64; 4];

fn push_at(f: &Push, s: f64) -> f64 {
    f[0] + s * (f[1] + s * (f[2] / 2.0 + s * f[3] / 6.0))
}

/// The push as seen from `s` later.
fn shifted(f: &Push, s: f64) -> Push {
    [push_at(f, s), f[1] + s * (f[2] + s * f[3] / 2.0), f[2] + s * f[3], f[3]]
}

/// A bar of these parameters.
#[derive(Clone, Copy, Debug)]
pub struct Bar<'s>(pub &'s Settings);

impl std::ops::Deref for Bar<'_> {
    type Target = Settings;

    fn deref(&self) -> &Settings {
        self.0
    }
}

impl Bar<'_> {
    /// Force that drives the bar at `x` m, `v` m/s, `t` s, N: spring, magnet, damper and weight, without the input.
    pub fn drive(&self, t: f64, x: f64, v: f64) -> f64 {
        let spring = self.spring_preload() - self.return_spring_rate() * (x + self.travel());
        spring - self.hold(t) - self.damping() * v + self.mass() * self.gravity()
    }

    fn hold(&self, t: f64) -> f64 {
        if self.holding_force() == 0.0 {
            0.0
        } else {
            self.holding_force() * exp(-t / self.holding_time())
        }
    }

    /// Motion at the start.
    pub fn begin(&self) -> Motion {
        let (x, s) = (self.start_penetration(), self.travel());
        let seated = s > 0.0 && x <= -s && self.start_velocity() <= 0.0;
        Motion {
            x: if seated { -s } else { x },
            v: if seated { 0.0 } else { self.start_velocity() },
            seated,
            work: 0.0,
        }
    }

    /// Acceleration, m/s^2, under the input force `f` N; 0 on the seat.
    pub fn acceleration(&self, m: &Motion, t: f64, f: f64) -> f64 {
        let net = self.drive(t, m.x, m.v) - f;
        if m.seated && net <= 0.0 {
            0.0
        } else {
            net / self.mass()
        }
    }

    /// Fastest rate of change that the motion has of itself, 1/s.
    fn pace(&self) -> f64 {
        let fade = if self.holding_force() == 0.0 { 0.0 } else { 1.0 / self.holding_time() };
        (self.return_spring_rate() / self.mass()).sqrt().max(self.damping() / self.mass()).max(fade)
    }

    /// Taylor coefficients of the position about (`t`, `m`).
    fn series(&self, t: f64, m: &Motion, f: &Push) -> [f64; TERMS] {
        let mut a = [0.0; TERMS];
        a[0] = m.x;
        a[1] = m.v;
        let mut hold = self.hold(t);
        let mut factorial = 1.0;
        for k in 0..TERMS - 2 {
            let n = k as f64;
            if k > 0 {
                factorial *= n;
                hold /= -self.holding_time() * n;
            }
            let mut r = -hold;
            if k < 4 {
                r -= f[k] / factorial;
            }
            if k == 0 {
                r += self.spring_preload() - self.return_spring_rate() * self.travel() + self.mass() * self.gravity();
            }
            r -= self.damping() * (n + 1.0) * a[k + 1] + self.return_spring_rate() * a[k];
            a[k + 2] = r / (self.mass() * (n + 1.0) * (n + 2.0));
        }
        a
    }

    /// Motion after `h` s under the push `f`, from `t` s.
    ///
    /// # Errors
    /// A step so long that a million substeps do not resolve it.
    pub fn advance(&self, m: &Motion, t: f64, h: f64, f: &Push) -> Result<Motion, String> {
        let substeps = (2.0 * h * self.pace()).ceil().max(1.0);
        if substeps.is_nan() || substeps > MOST_SUBSTEPS {
            return Err(text!("a step of {} s is too long for a bar that moves at {} 1/s", h, self.pace()));
        }
        let d = h / substeps;
        let mut m = *m;
        for i in 0..substeps as u64 {
            let s = i as f64 * d;
            m = self.substep(&m, t + s, d, &shifted(f, s));
        }
        Ok(m)
    }

    fn substep(&self, m: &Motion, t: f64, h: f64, f: &Push) -> Motion {
        if m.seated {
            let net = |s: f64| self.drive(t + s, m.x, 0.0) - push_at(f, s);
            let found = (0..=LOOKS).map(|i| h * i as f64 / LOOKS as f64).find(|s| net(*s) > 0.0);
            let (mut low, mut high) = match found {
                None => return *m,
                Some(s) => ((s - h / LOOKS as f64).max(0.0), s),
            };
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if net(middle) > 0.0 {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            let free = Motion { seated: false, ..*m };
            return self.fly(&free, t + high, h - high, &shifted(f, high));
        }
        self.fly(m, t, h, f)
    }

    fn fly(&self, m: &Motion, t: f64, h: f64, f: &Push) -> Motion {
        let a = self.series(t, m, f);
        let at = |s: f64| {
            let (mut x, mut v) = (0.0, 0.0);
            for k in (0..TERMS).rev() {
                v = v * s + x;
                x = x * s + a[k];
            }
            (x, v)
        };
        let coefficients = [f[0], f[1], f[2] / 2.0, f[3] / 6.0];
        let work = |s: f64| {
            if coefficients == [0.0; 4] {
                return 0.0;
            }
            // the integral of push times speed, term by term from the highest power on
            let mut sum = 0.0;
            for power in (1..TERMS + 3).rev() {
                let of = |(i, c): (usize, &f64)| match power.checked_sub(i) {
                    Some(k) if (1..TERMS).contains(&k) => c * a[k] * k as f64,
                    _ => 0.0,
                };
                let terms: f64 = coefficients.iter().enumerate().map(of).sum();
                sum = (sum + terms / power as f64) * s;
            }
            sum
        };
        let (x, v) = at(h);
        let seat = -self.travel();
        if self.travel() > 0.0 && x < seat {
            let (mut low, mut high) = (0.0, h);
            for _ in 0..HALVINGS {
                let middle = 0.5 * (low + high);
                if at(middle).0 < seat {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            let sat = Motion { x: seat, v: 0.0, seated: true, work: m.work + work(high) };
            // back on the seat it stays for the rest of the substep, unless it is driven off again at the next
            return sat;
        }
        Motion { x, v, seated: false, work: m.work + work(h) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar(pairs: &[(&str, f64)]) -> Settings {
        let mut s = Settings::default();
        for (name, value) in pairs {
            let i = variables::PARAMETER_TABLE.iter().position(|p| p.name == *name).unwrap();
            s.set(i, *value);
        }
        s
    }

    #[test]
    fn a_spring_swings_as_its_sine_and_a_long_step_is_as_good_as_short_ones() {
        let s = bar(&[("mass", 2.0), ("return_spring_rate", 800.0), ("travel", 0.0), ("spring_preload", 0.0)]);
        let w = 20.0;
        let m = Motion { x: 0.01, v: 0.3, ..Motion::default() };
        let t = 0.7f64;
        let long = Bar(&s).advance(&m, 0.0, t, &[0.0; 4]).unwrap();
        let x = 0.01 * (w * t).cos() + 0.3 / w * (w * t).sin();
        assert!((long.x - x).abs() < 1e-15, "{} {}", long.x, x);
        let mut short = m;
        for i in 0..100 {
            short = Bar(&s).advance(&short, f64::from(i) * t / 100.0, t / 100.0, &[0.0; 4]).unwrap();
        }
        assert!((short.x - x).abs() < 1e-14 && (short.v - long.v).abs() < 1e-13);
    }

    #[test]
    fn a_cubic_push_moves_a_free_mass_as_integrated_by_hand_and_its_work_is_the_energy_lost() {
        let s = bar(&[("mass", 0.5), ("return_spring_rate", 0.0), ("travel", 0.0), ("spring_preload", 0.0)]);
        let f = [3.0, -40.0, 900.0, -5e4];
        let h = 0.01f64;
        let m = Bar(&s).advance(&Motion { v: 1.0, ..Motion::default() }, 0.0, h, &f).unwrap();
        let v = 1.0 - (f[0] * h + f[1] * h * h / 2.0 + f[2] * h.powi(3) / 6.0 + f[3] * h.powi(4) / 24.0) / 0.5;
        let x = h
            - (f[0] * h * h / 2.0 + f[1] * h.powi(3) / 6.0 + f[2] * h.powi(4) / 24.0 + f[3] * h.powi(5) / 120.0) / 0.5;
        assert!((m.v - v).abs() < 1e-15 && (m.x - x).abs() < 1e-17);
        assert!((m.work - 0.25 * (1.0 - v * v)).abs() < 1e-15, "{}", m.work);
    }

    #[test]
    fn the_bar_leaves_its_seat_when_the_hold_falls_below_the_spring_and_sits_down_dead() {
        let s = bar(&[
            ("mass", 0.5),
            ("travel", 0.004),
            ("spring_preload", 12.3),
            ("return_spring_rate", 0.0),
            ("holding_force", 30.0),
            ("holding_time", 0.002),
            ("start_penetration", -0.004),
        ]);
        let free = 0.002 * (30.0f64 / 12.3).ln();
        let m = Bar(&s).begin();
        assert!(m.seated);
        let before = Bar(&s).advance(&m, 0.0, free * 0.999, &[0.0; 4]).unwrap();
        assert!(before.seated && before.x == -0.004);
        let after = Bar(&s).advance(&m, 0.0, free + 1e-3, &[0.0; 4]).unwrap();
        // m v = integral of P - H exp(-t/tau) since the release
        let v = (12.3 * 1e-3 - 12.3 * 0.002 * (1.0 - (-0.5f64).exp())) / 0.5;
        assert!(!after.seated && (after.v - v).abs() < 1e-12, "{} {}", after.v, v);
        // thrown back: onto the seat, at rest there while the push holds it
        let back = Bar(&s).advance(&Motion { x: -0.003, v: -5.0, ..after }, 1.0, 1e-3, &[20.0, 0.0, 0.0, 0.0]).unwrap();
        assert!(back.seated && back.x == -0.004 && back.v == 0.0);
        assert!(Bar(&s).advance(&m, 0.0, 1e9, &[0.0; 4]).is_err());
    }
}
