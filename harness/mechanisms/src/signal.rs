//! Linear filters on sampled signals.

/// One pole y' = w (u - y) with u linear between samples, exactly; in place. `w` in rad/s, `dt` in s.
pub fn pole(u: &mut [f64], w: f64, dt: f64) {
    let a = (-w * dt).exp();
    let q = w * dt;
    // response to a ramp over one step: y1 = a y0 + b0 u0 + b1 u1
    let b1 = if q > 1e-4 { 1.0 - (1.0 - a) / q } else { 0.5 * q };
    let b0 = 1.0 - a - b1;
    let (mut y, mut last) = (u[0], u[0]);
    for v in u.iter_mut() {
        y = a * y + b0 * last + b1 * *v;
        last = *v;
        *v = y;
    }
}

/// Transition of a free oscillator of damping ratio `zeta` over the angle `q` = w t: state (y, y'/w) goes over to
/// (a y + b y'/w, -b y + c y'/w); gives (a, b, c).
pub fn transition(zeta: f64, q: f64) -> (f64, f64, f64) {
    // cosine-like and sine-like part, damped
    let d2 = zeta * zeta - 1.0;
    let (c, s) = if d2 < -1e-12 {
        let d = (-d2).sqrt();
        let e = (-zeta * q).exp();
        (e * (d * q).cos(), e * (d * q).sin() / d)
    } else if d2 > 1e-12 {
        let d = d2.sqrt();
        let (a, b) = ((-(zeta - d) * q).exp(), (-(zeta + d) * q).exp());
        (0.5 * (a + b), 0.5 * (a - b) / d)
    } else {
        let e = (-zeta * q).exp();
        (e, e * q)
    };
    (c + zeta * s, s, c - zeta * s)
}

/// Two poles of natural frequency w and damping ratio zeta, u linear between samples, exactly: the straight
/// input's own answer, and the transition matrix on what is left; in place.
pub fn pole_pair(u: &mut [f64], w: f64, zeta: f64, dt: f64) {
    let q = w * dt;
    let (yy, yz, zz) = transition(zeta, q);
    let (mut y, mut z) = (u[0], 0.0);
    let mut last = u[0];
    for v in u.iter_mut() {
        // rise over one unit of w t: the straight input is followed at 2 zeta r below it, at speed r
        let r = (*v - last) / q;
        let (a, b) = (y - (last - 2.0 * zeta * r), z - r);
        y = *v - 2.0 * zeta * r + yy * a + yz * b;
        z = r - yz * a + zz * b;
        last = *v;
        *v = y;
    }
}

/// The even samples `u` at `place` (0: the first of them), by the cubic of Catmull and Rom 1974; beyond the ends they
/// stay as they are.
pub fn between(u: &[f64], place: f64) -> f64 {
    let k = place.floor();
    let w = place - k;
    let k = if k.abs() < 1e9 { k as isize } else { 0 };
    let at = |i: isize| u[i.clamp(0, u.len() as isize - 1) as usize];
    let (a, b, c, d) = (at(k - 1), at(k), at(k + 1), at(k + 2));
    b + 0.5 * w * (c - a + w * (2.0 * a - 5.0 * b + 4.0 * c - d + w * (3.0 * (b - c) + d - a)))
}

/// u <- u(t - late), s, by cubic interpolation on the grid.
pub fn shift(u: &mut [f64], late: f64, dt: f64) {
    let src = u.to_vec();
    for (i, v) in u.iter_mut().enumerate() {
        *v = between(&src, i as f64 - late / dt);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pole_answers_a_step_as_the_exponential_says() {
        let mut u = vec![1.0; 100];
        u[0] = 0.0;
        pole(&mut u, 200.0, 1e-3);
        // from the ramp's end on the distance to 1 falls by exp(-0.2) a sample
        for i in 2..20 {
            assert!(((1.0 - u[i]) / (1.0 - u[i - 1]) - (-0.2f64).exp()).abs() < 1e-12);
        }
    }

    #[test]
    fn a_pole_pair_settles_at_the_input_and_overshoots_as_butterworth_does() {
        let mut u = vec![1.0; 4000];
        u[0] = 0.0;
        pole_pair(&mut u, 100.0, std::f64::consts::FRAC_1_SQRT_2, 1e-4);
        let peak = u.iter().cloned().fold(0.0, f64::max);
        assert!((peak - 1.0432).abs() < 1e-3, "{peak}");
        assert!((u[3999] - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_pole_pair_rings_as_its_closed_form_says() {
        for zeta in [0.02, 0.6, 1.0, 1.7] {
            let (w, dt) = (300.0, 1e-3);
            let mut u: Vec<f64> = (0..400).map(|i| i as f64 * dt).collect();
            pole_pair(&mut u, w, zeta, dt);
            // answer to a ramp, by small steps
            let (mut y, mut z, n) = (0.0, 0.0, 2000);
            for i in 1..200 {
                for k in 0..n {
                    let h = dt / n as f64;
                    let t = (i - 1) as f64 * dt + (k as f64 + 0.5) * h;
                    let (ym, zm) = (y + 0.5 * h * z, z + 0.5 * h * (w * w * (t - y) - 2.0 * zeta * w * z));
                    y += h * zm;
                    z += h * (w * w * (t - ym) - 2.0 * zeta * w * zm);
                }
                assert!((u[i] - y).abs() < 1e-8, "{zeta} {i} {} {y}", u[i]);
            }
        }
    }

    #[test]
    fn a_shift_by_whole_samples_is_exact() {
        let mut u: Vec<f64> = (0..20).map(|i| (i as f64 * 0.3).sin()).collect();
        let v = u.clone();
        shift(&mut u, 2e-3, 1e-3);
        for i in 2..20 {
            assert!((u[i] - v[i - 2]).abs() < 1e-12);
        }
    }
}
