//! The measuring chain: what the instruments make of the true signals, in the order low-pass,
//! AC coupling, skew, gain, clipping.

use super::simulate::Trace;
use mechanisms::physics::{LowPass, Physics};
use record::Channel;

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
pub(super) fn transition(zeta: f64, q: f64) -> (f64, f64, f64) {
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
fn pole_pair(u: &mut [f64], w: f64, zeta: f64, dt: f64) {
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

fn low_pass(u: &mut [f64], l: &LowPass, dt: f64) {
    match l.form {
        1 => pole(u, l.corner, dt),
        2 => pole_pair(u, l.corner, std::f64::consts::FRAC_1_SQRT_2, dt),
        3 => {
            pole(u, l.corner, dt);
            pole(u, l.corner, dt);
        }
        5 if l.second_share > 0.0 => {
            let mut second = u.to_vec();
            pole_pair(&mut second, l.second_ratio * l.corner, l.damping, dt);
            pole_pair(u, l.corner, l.damping, dt);
            for (a, b) in u.iter_mut().zip(second) {
                *a += l.second_share * (b - *a);
            }
        }
        5 => pole_pair(u, l.corner, l.damping, dt),
        // Bessel of fourth order, corner of -3 dB (Thomson 1949)
        _ => {
            pole_pair(u, 1.4302 * l.corner, 0.9580, dt);
            pole_pair(u, 1.6033 * l.corner, 0.6207, dt);
        }
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

/// u <- u(t - late) by cubic interpolation on the grid.
fn shift(u: &mut [f64], late: f64, dt: f64) {
    let src = u.to_vec();
    for (i, v) in u.iter_mut().enumerate() {
        *v = between(&src, i as f64 - late / dt);
    }
}

/// Readings no larger than the level, soft or hard; hard ones stay there for the time of recovery.
fn clip(y: &mut [f64], p: &Physics, dt: f64) {
    let c = p.clip;
    if p.clip_soft {
        // linear to 0.8 c, then bent smoothly towards c
        let k = 0.8 * c;
        for v in y {
            let a = v.abs();
            if a > k {
                *v = v.signum() * (k + (c - k) * ((a - k) / (c - k)).tanh());
            }
        }
        return;
    }
    // samples that an overload still holds at the level, the last of them in part
    let held = p.clip_recovery / dt;
    let (mut left, mut level) = (0.0, c);
    for v in y {
        if v.abs() > c {
            level = c.copysign(*v);
            *v = level;
            left = held;
        } else if left > 0.0 {
            *v += left.min(1.0) * (level - *v);
            left -= 1.0;
        }
    }
}

/// The readings a chain gives of a trace: force, acceleration, penetration, without zeros' offsets.
pub fn readings(p: &Physics, trace: &Trace, time: &[f64]) -> [Vec<f64>; 3] {
    let dt = (time[time.len() - 1] - time[0]) / (time.len() - 1) as f64;
    let mut y = [trace.force.clone(), trace.acceleration.clone(), trace.position.clone()];
    if let Some(l) = &p.low_pass {
        if l.corner.is_finite() {
            low_pass(&mut y[l.channel.index()], l, dt);
        }
    }
    if p.droop > 0.0 {
        let u = &mut y[p.droop_channel.index()];
        for _ in 0..if p.droop_double { 2 } else { 1 } {
            let mut low = u.clone();
            low[0] = 0.0;
            let first = u[0];
            u[0] = 0.0;
            let mut l2 = low.clone();
            pole(&mut l2, p.droop, dt);
            u[0] = first;
            for (a, b) in u.iter_mut().zip(&l2) {
                *a -= p.droop_share * b;
            }
        }
    }
    if p.skew != 0.0 {
        shift(&mut y[p.skew_channel.index()], p.skew, dt);
    }
    if p.scale_bend != 0.0 {
        for x in &mut y[p.scale_channel.index()] {
            *x *= 1.0 + p.scale_bend * *x / p.scale_span;
        }
    }
    if p.gain_drift != 0.0 {
        let g = 1.0 + p.gain_drift * trace.before;
        y[Channel::Force.index()].iter_mut().for_each(|v| *v *= g);
    }
    for (c, u) in y.iter_mut().enumerate() {
        if p.gain[c] != 1.0 {
            u.iter_mut().for_each(|v| *v *= p.gain[c]);
        }
    }
    if p.clip.is_finite() {
        clip(&mut y[p.clip_channel.index()], p, dt);
    }
    y
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
    fn two_modes_share_what_one_reads_and_settle_where_it_does() {
        let one = LowPass { damping: 0.05, ..LowPass::new(300.0, 5, Channel::Force) };
        let two = LowPass { second_ratio: 2.0, second_share: 0.3, ..one };
        let step = |l: &LowPass| {
            let mut u = vec![1.0; 4000];
            u[0] = 0.0;
            low_pass(&mut u, l, 1e-4);
            u
        };
        let (both, other) = (step(&two), step(&LowPass { corner: 600.0, ..one }));
        let one = step(&one);
        for ((b, o), t) in both.iter().zip(&one).zip(&other) {
            assert!((b - 0.7 * o - 0.3 * t).abs() < 1e-12);
        }
        assert!((both[3999] - 1.0).abs() < 3e-3);
    }

    #[test]
    fn an_overload_holds_its_level_for_the_time_it_takes_to_recover() {
        let p = Physics { clip: 2.0, clip_recovery: 2.5e-3, ..Physics::default() };
        let mut y = vec![1.0, 3.0, -1.0, 1.0, 1.0, 1.0, -4.0, 0.0, 0.0, 0.0, 0.0];
        clip(&mut y, &p, 1e-3);
        assert_eq!(y, [1.0, 2.0, 2.0, 2.0, 1.5, 1.0, -2.0, -2.0, -2.0, -1.0, 0.0]);
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
