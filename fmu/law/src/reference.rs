//! Two more impacts with exact answers, for holding integrators and unloading branches against.

use super::impact::Impact;

/// Mass `m` kg at `v0` m/s on a linear spring `k` N/m and dashpot `c` N s/m from first touch, until the force
/// would pull (Schwager and Poeschel 2007): e = exp(-zeta theta / sqrt(1 - zeta^2)) with
/// zeta = c / (2 sqrt(k m)) and theta = atan2(2 zeta sqrt(1 - zeta^2), 2 zeta^2 - 1).
///
/// Separation leaves the spring compressed; its energy is lost too. Returns None unless m, v0, k > 0 and
/// 0 <= zeta < 1.
pub fn linear_spring_dashpot(m: f64, v0: f64, k: f64, c: f64) -> Option<Impact> {
    let good = |x: f64| x.is_finite() && x > 0.0;
    if !(good(m) && good(v0) && good(k) && c.is_finite() && c >= 0.0) {
        return None;
    }
    let omega = (k / m).sqrt();
    let zeta = 0.5 * c / (m * omega);
    if zeta >= 1.0 {
        return None;
    }
    let root = ((1.0 - zeta) * (1.0 + zeta)).sqrt();
    let theta = (2.0 * zeta * root).atan2(2.0 * zeta * zeta - 1.0);
    let e = (-zeta * theta / root).exp();
    // deepest where v = 0; the force peaks where its rate k v + c a does, or at touch
    let at_rest = root.atan2(zeta);
    let deepest = v0 / omega * (-zeta * at_rest / root).exp();
    let at_peak = (root * (1.0 - 4.0 * zeta * zeta)).atan2(zeta * (3.0 - 4.0 * zeta * zeta));
    let peak_force = if at_peak > 0.0 { m * omega * v0 * (-zeta * at_peak / root).exp() } else { c * v0 };
    Some(Impact {
        deepest,
        restitution: e,
        peak_force,
        duration: theta / (omega * root),
        energy_lost: 0.5 * m * v0 * v0 * (1.0 - e) * (1.0 + e),
        impulse: m * v0 * (1.0 + e),
    })
}

/// Mass `m` kg at `v0` m/s on a spring `k` N/m that unloads along the stiffer line k2 = k/(1 - `ratio`)
/// (Walton and Braun 1986): e = sqrt(k/k2).
///
/// Returns None unless m, v0, k > 0 and 0 <= ratio < 1.
pub fn walton_braun(m: f64, v0: f64, k: f64, ratio: f64) -> Option<Impact> {
    let good = |x: f64| x.is_finite() && x > 0.0;
    if !(good(m) && good(v0) && good(k) && (0.0..1.0).contains(&ratio)) {
        return None;
    }
    let e = (1.0 - ratio).sqrt();
    let quarter = std::f64::consts::FRAC_PI_2 * (m / k).sqrt();
    let deepest = v0 * (m / k).sqrt();
    Some(Impact {
        deepest,
        restitution: e,
        peak_force: k * deepest,
        duration: quarter * (1.0 + e),
        energy_lost: 0.5 * m * v0 * v0 * ratio,
        impulse: m * v0 * (1.0 + e),
    })
}
