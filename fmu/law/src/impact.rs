//! The impact of a free mass on the law F = x^p (k + mu v), exactly.
//!
//! With d = mu v0 / k, u = v / v0, q = p + 1 the phase curve is k x^q / (q m v0^2) = G(u),
//! G(u) = (d (1 - u) - ln((1 + d)/(1 + d u))) / d^2 (Hunt and Crossley 1975 and later; closed by Lambert's W).

use super::elementary::{cosh, exp, exp_m1, ln_1p, pow, sinh};

/// What an impact comes to, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Impact {
    /// Deepest penetration, m.
    pub deepest: f64,
    /// Speed of leaving over speed of touch.
    pub restitution: f64,
    /// Largest force, N.
    pub peak_force: f64,
    /// Time from touch to separation, s.
    pub duration: f64,
    /// Energy lost, J.
    pub energy_lost: f64,
    /// Impulse, N s.
    pub impulse: f64,
}

/// ln(1 + z) - z without cancellation.
fn l(z: f64) -> f64 {
    if z.abs() < 0.25 {
        // sum of -(-z)^n / n from n = 2
        let mut term = z;
        let mut sum = 0.0;
        for n in 2..60 {
            term *= -z;
            let t = term / f64::from(n);
            sum += t;
            if t.abs() < 1e-19 * f64::abs(sum) {
                break;
            }
        }
        sum
    } else {
        ln_1p(z) - z
    }
}

/// d e, and w0 = 1 - d e, from the dimensionless damping d.
fn rebound(d: f64) -> (f64, f64) {
    let target = l(d);
    if d < 1.0 {
        // l(-y) = l(d) in y = d e
        let mut y = d / (1.0 + 0.8 * d);
        for _ in 0..100 {
            let f = l(-y) - target;
            let step = f * (1.0 - y) / y;
            let next = y + step;
            let next = if next <= 0.0 {
                0.5 * y
            } else if next >= 1.0 {
                0.5 * (1.0 + y)
            } else {
                next
            };
            let done = (next - y).abs() <= 1e-16 * y;
            y = next;
            if done {
                break;
            }
        }
        (y, 1.0 - y)
    } else {
        // s - e^s = ln(1 + d) - 1 - d in s = ln w0
        let c = ln_1p(d) - 1.0 - d;
        let mut s = c;
        for _ in 0..100 {
            let e = exp(s);
            let next = s - (s - e - c) / (1.0 - e);
            let done = (next - s).abs() <= 1e-16 * s.abs();
            s = next;
            if done {
                break;
            }
        }
        let w0 = exp(s);
        (1.0 - w0, w0)
    }
}

/// 1 - e of the dimensionless damping d, without cancellation at small d.
pub(super) fn loss(d: f64) -> f64 {
    if d >= 0.5 {
        return 1.0 - rebound(d).0 / d;
    }
    if d < 1e-8 {
        // e = 1 - 2/3 d + 4/9 d^2 - ...
        return d * (2.0 / 3.0 - 4.0 / 9.0 * d);
    }
    // d + y = ln((1 + d)/(1 - y)) in w = (d - y)/(1 - d): l(w) + d w = ln((1 - d)/(1 + d)) ... = 2 (d^3/3 + d^5/5 + ...)
    let mut power = d * d * d;
    let mut right = 0.0;
    let mut n = 3.0;
    while power > 1e-18 * right {
        right += 2.0 * power / n;
        power *= d * d;
        n += 2.0;
    }
    let mut w = right / d;
    for _ in 0..50 {
        let step = (l(w) + d * w - right) / (d - w / (1.0 + w));
        w -= step;
        if step.abs() <= 1e-16 * w {
            break;
        }
    }
    w * (1.0 - d) / d
}

/// Restitution e of the dimensionless damping d = mu v0 / k >= 0: d (1 + e) = ln((1 + d)/(1 - d e));
/// independent of mass and exponent.
pub fn restitution(d: f64) -> f64 {
    1.0 - loss(d)
}

/// G at u = 1 - delta, on the way in.
fn inward(d: f64, delta: f64) -> f64 {
    let z = d * delta / (1.0 + d);
    if d < 1e-13 {
        return delta * (1.0 - 0.5 * delta);
    }
    (z * d + l(-z)) / (d * d)
}

/// Integral of `f` over (0, 1) by the double-exponential rule (Takahasi and Mori 1974).
fn quadrature(f: impl Fn(f64) -> f64) -> f64 {
    let h = 1.0 / 64.0;
    let mut sum = 0.0;
    for i in -280..=280 {
        let t = h * f64::from(i);
        let a = std::f64::consts::PI * sinh(t);
        // position, precise near 0
        let x = 1.0 / (1.0 + exp(-a));
        let w = std::f64::consts::PI * cosh(t) * x / (1.0 + exp(a));
        if w > 1e-300 && x > 0.0 && w.is_finite() {
            sum += w * f(x);
        }
    }
    sum * h
}

/// The impact of mass `m` kg at `v0` m/s on k N/m^p, p, mu N s/m^(p+1).
///
/// Returns None unless all are finite, m, v0, k, p > 0 and mu >= 0.
pub fn impact(m: f64, v0: f64, k: f64, p: f64, mu: f64) -> Option<Impact> {
    let good = |x: f64| x.is_finite() && x > 0.0;
    if !(good(m) && good(v0) && good(k) && good(p) && mu.is_finite() && mu >= 0.0) {
        return None;
    }
    let d = mu * v0 / k;
    let q = p + 1.0;
    let unit = q * m * v0 * v0 / k;
    let xm = pow(unit * inward(d, 1.0), 1.0 / q);
    let lost = loss(d);
    let e = 1.0 - lost;
    // in: u from 1 to 0, delta = 1 - u = s^q takes the root of x^p away
    let time_in = quadrature(|s| {
        let delta = pow(s, q);
        if delta == 0.0 {
            return 0.0;
        }
        let x = pow(unit * inward(d, delta), p / q);
        q * pow(s, p) / (x * (1.0 + d * (1.0 - delta)))
    });
    // out: u from 0 to -e
    let time_out = if d < 1e-13 {
        time_in
    } else {
        let (y, _) = rebound(d);
        let s0 = if d < 1.0 { -ln_1p(-y) } else { -(y_log(d)) };
        // w = 1 + d u = w0 e^lambda, lambda from 0 to s0 = -ln w0
        quadrature(|s| {
            let lam = s0 * pow(s, q);
            if lam == 0.0 {
                return 0.0;
            }
            let w0 = exp(-s0);
            // G = (ln(w/w0) - (w - w0)) / d^2
            let g = if lam < 0.5 {
                // lambda - w0 (e^lambda - 1) = lambda y - w0 (e^lambda - 1 - lambda)
                lam * y - w0 * exp_rest(lam)
            } else {
                lam - w0 * exp_m1(lam)
            } / (d * d);
            let x = pow(unit * g.max(1e-300), p / q);
            s0 * q * pow(s, p) / (d * x)
        })
    };
    let duration = m * v0 / k * (time_in + time_out);
    // peak: p u = q d G(u)
    let (mut lo, mut hi) = (0.0, 1.0);
    for _ in 0..200 {
        let u = 0.5 * (lo + hi);
        if p * u < q * d * inward(d, 1.0 - u) {
            lo = u;
        } else {
            hi = u;
        }
    }
    let u = 0.5 * (lo + hi);
    let peak_force = k * pow(unit * inward(d, 1.0 - u), p / q) * (1.0 + d * u);
    Some(Impact {
        deepest: xm,
        restitution: e,
        peak_force,
        duration,
        energy_lost: 0.5 * m * v0 * v0 * lost * (1.0 + e),
        impulse: m * v0 * (1.0 + e),
    })
}

/// ln w0 for d >= 1.
fn y_log(d: f64) -> f64 {
    let c = ln_1p(d) - 1.0 - d;
    let mut s = c;
    for _ in 0..100 {
        let e = exp(s);
        let next = s - (s - e - c) / (1.0 - e);
        if (next - s).abs() <= 1e-16 * s.abs() {
            return next;
        }
        s = next;
    }
    s
}

/// e^x - 1 - x for small x.
fn exp_rest(x: f64) -> f64 {
    let mut t = x;
    let mut sum = 0.0;
    for n in 2..40 {
        t *= x / f64::from(n);
        sum += t;
        if t.abs() < 1e-19 * f64::abs(sum) {
            break;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    fn close(a: f64, b: f64, tol: f64) {
        assert!((a - b).abs() <= tol * b.abs(), "{a:.17e} against {b:.17e}: {:.1e}", (a - b).abs() / b.abs());
    }

    #[test]
    #[allow(clippy::excessive_precision)]
    fn golden_impacts_of_the_paper_to_1e_12() {
        let a = impact(1.0, 1.0, 3.51e10, 2.79, 2.70e10).unwrap();
        close(a.deepest, 1.7588165601242512e-3, 1e-12);
        close(a.restitution, 0.65712174496578164, 1e-12);
        close(a.duration, 5.8181339632048352e-3, 1e-12);
        close(a.peak_force, 813.04615987599714, 1e-12);
        let b = impact(1.0, 1.0, 1.85e8, 1.96, 8.77e7).unwrap();
        close(b.deepest, 1.6803097731131710e-3, 1e-12);
        close(b.restitution, 0.75847045292087518, 1e-12);
        close(b.duration, 5.4497898388347824e-3, 1e-12);
        close(b.peak_force, 716.04884002798315, 1e-12);
    }

    #[test]
    fn undamped_durations_have_the_known_coefficients() {
        for (p, c) in [(1.0, std::f64::consts::PI), (1.5, 2.9432751843), (2.0, 2.8043642107), (2.79, 2.6530845349)] {
            let i = impact(2.0, 0.7, 5e7, p, 0.0).unwrap();
            close(i.duration * 0.7 / i.deepest, c, 2e-10);
            close(i.restitution, 1.0, 1e-15);
        }
    }

    #[test]
    fn a_linear_spring_needs_no_more_than_trigonometry() {
        let i = impact(3.0, 2.0, 7e4, 1.0, 0.0).unwrap();
        close(i.deepest, 2.0 * (3.0f64 / 7e4).sqrt(), 1e-14);
        close(i.peak_force, 2.0 * (3.0f64 * 7e4).sqrt(), 1e-13);
        close(i.duration, std::f64::consts::PI * (3.0f64 / 7e4).sqrt(), 1e-12);
    }

    #[test]
    fn the_equation_of_the_restitution_holds_for_all_damping() {
        for d in [1e-10, 1e-5, 1e-3, 0.1, 0.9, 1.1, 3.0, 10.0, 50.0] {
            let (y, w0) = rebound(d);
            // d + y = ln(1 + d) - ln(w0)
            let lw = if d < 1.0 { (-y).ln_1p() } else { y_log(d) };
            close(d + y, d.ln_1p() - lw, 1e-14);
            assert!(y < 1.0 && w0 > 0.0 || d > 30.0);
        }
    }

    #[test]
    fn small_and_large_damping_pass_smoothly_through_the_switches() {
        for (a, b) in [(0.999_999_99, 1.000_000_01), (2e-13, 0.5e-13)] {
            let (x, y) = (impact(1.0, 1.0, 1e8, 1.5, a * 1e8).unwrap(), impact(1.0, 1.0, 1e8, 1.5, b * 1e8).unwrap());
            close(x.duration, y.duration, 1e-7);
            close(x.restitution, y.restitution, 1e-7);
        }
    }

    #[test]
    fn a_fine_integration_agrees() {
        // classical Runge-Kutta on the equation of motion itself, in time
        for (d, p) in [(0.3, 1.5), (2.0, 1.0), (8.0, 2.5)] {
            let (m, v0, k) = (0.7, 1.3, 4e6);
            let mu = d * k / v0;
            let exact = impact(m, v0, k, p, mu).unwrap();
            let f = |x: f64, v: f64| -(if x > 0.0 { x.powf(p) } else { 0.0 }) * (k + mu * v) / m;
            let h = exact.duration / 40_000.0;
            let (mut x, mut v, mut t, mut deepest) = (0.0f64, v0, 0.0, 0.0f64);
            loop {
                let (a1, b1) = (v, f(x, v));
                let (a2, b2) = (v + 0.5 * h * b1, f(x + 0.5 * h * a1, v + 0.5 * h * b1));
                let (a3, b3) = (v + 0.5 * h * b2, f(x + 0.5 * h * a2, v + 0.5 * h * b2));
                let (a4, b4) = (v + h * b3, f(x + h * a3, v + h * b3));
                let (nx, nv) =
                    (x + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4), v + h / 6.0 * (b1 + 2.0 * b2 + 2.0 * b3 + b4));
                if nx <= 0.0 {
                    close(t + h * x / (x - nx), exact.duration, 1e-3);
                    close(-nv / v0, exact.restitution, 1e-5);
                    break;
                }
                x = nx;
                v = nv;
                t += h;
                deepest = deepest.max(x);
            }
            close(deepest, exact.deepest, 1e-7);
        }
    }

    #[test]
    fn nonsense_gets_none() {
        assert!(impact(0.0, 1.0, 1.0, 1.0, 0.0).is_none());
        assert!(impact(1.0, f64::NAN, 1.0, 1.0, 0.0).is_none());
        assert!(impact(1.0, 1.0, 1.0, 1.0, -1.0).is_none());
    }
}
