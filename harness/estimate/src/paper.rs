//! Ahn and Ryu 2005: their estimation by the simplex repeated, and their contactor with its unit corrected.

use super::simplex::{minimise, Minimum, Options};
use law::impact::{impact, Impact};
use mechanisms::physics::Physics;
use plant::simulate::{simulate, Local, Setup};

/// A law F = k x^p + mu_d x^p v: k N/m^p, p, mu_d N s/m^(p+1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Law {
    pub k: f64,
    pub p: f64,
    pub mu: f64,
}

/// Initial values of Ahn and Ryu 2005, Table 1.
pub const INITIAL: Law = Law { k: 1.85e8, p: 1.96, mu: 8.77e7 };
/// Estimated values of the same table.
pub const ESTIMATED: Law = Law { k: 3.51e10, p: 2.79, mu: 2.70e10 };
/// The drop: kg and m/s. The paper's table names neither, so one of each is taken, as for the golden impacts.
pub const MASS: f64 = 1.0;
/// Speed at touch, m/s.
pub const SPEED: f64 = 1.0;
/// Depth at which the force stands for k, m: k of two exponents cannot be compared.
pub const REFERENCE: f64 = 1.5e-3;
/// Iteration by which the paper reports agreement.
pub const AGREED: usize = 50;
/// Sampling interval and number of samples of the made recording: 7 ms.
const DT: f64 = 2e-5;
const SAMPLES: usize = 351;

impl Law {
    /// (ln F at the reference depth, p, mu_d/k s/m): what the simplex moves in.
    pub fn parameters(&self) -> [f64; 3] {
        [(self.k * REFERENCE.powf(self.p)).ln(), self.p, self.mu / self.k]
    }

    /// The way back; a negative mu_d/k counts as its magnitude.
    pub fn of(q: &[f64]) -> Law {
        let k = (q[0] - q[1] * REFERENCE.ln()).exp();
        Law { k, p: q[1], mu: q[2].abs() * k }
    }

    /// The exact impact of the paper's drop.
    pub fn impact(&self) -> Option<Impact> {
        impact(MASS, SPEED, self.k, self.p, self.mu)
    }
}

/// A drop simulated by the reduced equation M x'' + k x^p + mu_d x^p x' = 0 (eq. 6): time s, penetration m, force N.
#[derive(Clone, Debug)]
pub struct Curve {
    pub time: Vec<f64>,
    pub penetration: Vec<f64>,
    pub force: Vec<f64>,
}

/// The drop on `law`; None where it cannot be simulated.
pub fn drop(law: &Law) -> Option<Curve> {
    let time: Vec<f64> = (0..SAMPLES).map(|i| DT * i as f64).collect();
    let mut physics = Physics { mass: MASS, ..Physics::default() };
    physics.law.elastic.stiffness = law.k;
    physics.law.elastic.exponent = law.p;
    physics.law.hysteresis_damping.coefficient = law.mu;
    if !(0.5..=6.0).contains(&law.p) || !law.k.is_finite() || law.k <= 0.0 || !law.mu.is_finite() {
        return None;
    }
    let q = law.p + 1.0;
    let depth = (q * MASS * SPEED * SPEED / (2.0 * law.k)).powf(1.0 / q);
    let setup = Setup::drop_test(time.clone(), depth, SPEED, 3.0 * depth / SPEED);
    let t = simulate(&physics, &setup, &Local { start: 0.0, speed: SPEED, stiffness: 0.0, offset: 0.0 });
    t.ok.then_some(Curve { time, penetration: t.position, force: t.force })
}

/// Root mean square of the difference in force as a share of the peak of `wanted`, and the largest difference as a
/// share of the force of `wanted` at the same instant, where that force is above 1 % of the peak.
pub fn differences(wanted: &Curve, got: &Curve) -> (f64, f64) {
    let peak = wanted.force.iter().cloned().fold(0.0, f64::max);
    let (mut sum, mut most) = (0.0, 0.0f64);
    for (a, b) in wanted.force.iter().zip(&got.force) {
        sum += (a - b) * (a - b);
        if *a > 0.01 * peak {
            most = most.max((a - b).abs() / a);
        }
    }
    ((sum / wanted.force.len() as f64).sqrt() / peak, most)
}

/// The paper's estimation repeated.
pub struct Repeat {
    /// The drop on the estimated values: what the simplex is given.
    pub data: Curve,
    /// The drop on the initial values.
    pub first: Curve,
    pub minimum: Minimum,
    /// Largest difference by iteration, as a share of the force at that instant (see [`differences`]).
    pub largest: Vec<f64>,
    /// First iteration from which on the force is within 1 % everywhere on the curve.
    pub within: Option<usize>,
}

/// Runs the simplex from the initial values on data made from the estimated ones.
///
/// None where the data cannot be made.
pub fn repeat() -> Option<Repeat> {
    let (data, first) = (drop(&ESTIMATED)?, drop(&INITIAL)?);
    let mut f = |q: &[f64]| drop(&Law::of(q)).map_or(f64::INFINITY, |c| differences(&data, &c).0);
    let options = Options { iterations: 400, spread: 1e-7, size: 1e-4 };
    let minimum = minimise(&mut f, &INITIAL.parameters(), &[0.2, 0.4, 0.2], &options, &mut |_, _| false);
    let largest: Vec<f64> = minimum
        .path
        .iter()
        .map(|(q, _)| drop(&Law::of(q)).map_or(f64::INFINITY, |c| differences(&data, &c).1))
        .collect();
    let within = match largest.iter().rposition(|d| *d > 0.01) {
        Some(i) if i + 1 == largest.len() => None,
        Some(i) => Some(i + 1),
        None => Some(0),
    };
    Some(Repeat { data, first, minimum, largest, within })
}

impl Repeat {
    /// The law after `iteration` iterations, or the last one.
    pub fn law(&self, iteration: usize) -> Law {
        Law::of(&self.minimum.path[iteration.min(self.minimum.iterations)].0)
    }

    /// Paper and ours side by side, as a markdown table.
    pub fn table(&self) -> String {
        let at = AGREED.min(self.minimum.iterations);
        let laws = [INITIAL, ESTIMATED, self.law(at), self.law(self.minimum.iterations)];
        let mut out = format!(
            "| | paper, initial | paper, estimated | ours, iteration {at} | ours, iteration {} |\n|---|---|---|---|---|\n",
            self.minimum.iterations
        );
        let mut row = |name: &str, cell: &dyn Fn(&Law) -> String| {
            out += &format!("| {name} |{}\n", laws.iter().map(|l| format!(" {} |", cell(l))).collect::<String>());
        };
        row("k [N/m^p]", &|l| format!("{:.2e}", l.k));
        row("p", &|l| format!("{:.2}", l.p));
        row("mu_d [N s/m^(p+1)]", &|l| format!("{:.2e}", l.mu));
        row("force at 1.5 mm at rest [N]", &|l| format!("{:.0}", l.k * REFERENCE.powf(l.p)));
        let figure = |l: &Law, f: fn(&Impact) -> f64, digits: usize| {
            l.impact().map_or(String::from("-"), |i| format!("{:.digits$}", f(&i)))
        };
        row("deepest [mm]", &|l| figure(l, |i| 1e3 * i.deepest, 3));
        row("peak force [N]", &|l| figure(l, |i| i.peak_force, 1));
        row("duration [ms]", &|l| figure(l, |i| 1e3 * i.duration, 2));
        row("restitution", &|l| figure(l, |i| i.restitution, 3));
        row("largest difference in force [% of the force there]", &|l| {
            drop(l).map_or(String::from("-"), |c| format!("{:.2}", 100.0 * differences(&self.data, &c).1))
        });
        row("within 1 % from iteration", &|l| match (*l == ESTIMATED, *l == INITIAL, self.within) {
            (true, _, _) => format!("{AGREED} or so"),
            (_, true, _) | (_, _, None) => "-".into(),
            (_, _, Some(i)) => i.to_string(),
        });
        out
    }
}

/// A body of `m` kg that falls from `height` m on a linear spring `k` N/m, its weight acting throughout:
/// (deepest m, peak force N, duration s), from x = g/w^2 (1 - cos w t) + v/w sin w t with w^2 = k/m.
pub fn fall_on_spring(m: f64, height: f64, k: f64, g: f64) -> (f64, f64, f64) {
    let w = (k / m).sqrt();
    let v = (2.0 * g * height).sqrt();
    let sag = g / (w * w);
    let deepest = sag + sag.hypot(v / w);
    (deepest, k * deepest, 2.0 * (std::f64::consts::PI - (v * w).atan2(g)) / w)
}

/// The paper's contactor: moving mass kg, height m, stiffness as printed, estimated and calculated.
pub const CONTACTOR_MASS: f64 = 0.509;
/// Height of the fall, m.
pub const CONTACTOR_HEIGHT: f64 = 5e-3;
/// The figure printed for the estimated stiffness, whatever its unit.
pub const CONTACTOR_PRINTED: f64 = 2270.0;
/// The calculated stiffness, N/mm.
pub const CONTACTOR_CALCULATED: f64 = 19300.0;

/// The contactor's impact for each reading of the printed stiffness, as a markdown table.
pub fn contactor_table() -> String {
    let mut out =
        String::from("| stiffness | deepest [mm] | peak force [N] | duration [ms] | peak over estimated | the same without weight |\n|---|---|---|---|---|---|\n");
    let of = |k: f64| fall_on_spring(CONTACTOR_MASS, CONTACTOR_HEIGHT, k, mechanisms::physics::GRAVITY);
    let estimated = of(1e3 * CONTACTOR_PRINTED);
    for (name, k) in [
        (format!("estimated, as printed: {CONTACTOR_PRINTED} N/m"), CONTACTOR_PRINTED),
        (format!("estimated, in N/mm: {CONTACTOR_PRINTED} N/mm"), 1e3 * CONTACTOR_PRINTED),
        (format!("calculated: {CONTACTOR_CALCULATED} N/mm"), 1e3 * CONTACTOR_CALCULATED),
    ] {
        let (x, f, t) = of(k);
        // without weight the peak is v sqrt(k m)
        let bare = (k / (1e3 * CONTACTOR_PRINTED)).sqrt();
        out += &format!("| {name} | {:.3} | {f:.1} | {:.2} | {:.2} | {bare:.2} |\n", 1e3 * x, 1e3 * t, f / estimated.1);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_simplex_finds_the_papers_values_by_the_papers_iteration() {
        let r = repeat().unwrap();
        assert!(r.minimum.converged);
        assert!(r.largest[0] > 0.1, "the initial values miss the curve: {}", r.largest[0]);
        assert!(r.within.unwrap() <= AGREED + 5, "{:?}", r.within);
        let l = r.law(r.minimum.iterations);
        assert!((l.p / ESTIMATED.p - 1.0).abs() < 1e-3 && (l.k / ESTIMATED.k - 1.0).abs() < 1e-2, "{l:?}");
        assert!((l.mu / ESTIMATED.mu - 1.0).abs() < 1e-2, "{l:?}");
        assert_eq!(Law::of(&ESTIMATED.parameters()).p, ESTIMATED.p);
    }

    #[test]
    fn the_simulated_drop_is_the_exact_impact() {
        let c = drop(&ESTIMATED).unwrap();
        let i = ESTIMATED.impact().unwrap();
        let peak = c.force.iter().cloned().fold(0.0, f64::max);
        assert!((peak / i.peak_force - 1.0).abs() < 1e-4, "{peak}");
        assert!(c.time.iter().zip(&c.force).all(|(t, f)| (*f > 0.0) == (*t > 0.0 && *t < i.duration)));
    }

    #[test]
    fn a_fall_without_weight_to_speak_of_is_the_exact_impact() {
        let (m, h, k) = (0.509, 5e-3, 2.27e12);
        let (x, f, t) = fall_on_spring(m, h, k, 9.81);
        let i = impact(m, (2.0 * 9.81 * h).sqrt(), k, 1.0, 0.0).unwrap();
        for (a, b) in [(x, i.deepest), (f, i.peak_force), (t, i.duration)] {
            assert!((a / b - 1.0).abs() < 1e-4, "{a} {b}");
        }
    }
}
