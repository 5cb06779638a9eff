//! From a wanted restitution to the damping that gives it: exactly, or as published closed forms have it.

use super::elementary::exp;
use super::impact::loss;

/// How the damping ratio d = mu v0 / k is chosen from a restitution e.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Formula {
    /// Exact inversion of the impact.
    Exact,
    /// d = 1.5 (1 - e), Hunt and Crossley 1975.
    HuntCrossley,
    /// d = 6 (1 - e)/((2e - 1)^2 + 3), Herbert and McWhannell 1977.
    HerbertMcWhannell,
    /// d = 0.75 (1 - e), Lee and Wang 1983.
    LeeWang,
    /// d = 0.75 (1 - e^2), Lankarani and Nikravesh 1990.
    LankaraniNikravesh,
    /// d = 0.75 (1 - e^2) exp(2 (1 - e)), Zhiying and Qishao 2006.
    ZhiyingQishao,
    /// d = (1 - e^2)/e, Gonthier, McPhee, Lange and Piedboeuf 2004.
    Gonthier,
    /// d = 8 (1 - e)/(5 e), Flores, Machado, Silva and Martins 2011.
    Flores,
    /// d = 1.5 (1 - e)/e, Hu and Guo 2015.
    HuGuo,
    /// d = 5 (1 - e)/(4 e), Safaeifar and Farshidianfar 2020.
    SafaeifarFarshidianfar,
}

/// Every formula with the name it has in a scenario file, the exact one first.
pub const FORMULAS: [(&str, Formula); 10] = [
    ("exact", Formula::Exact),
    ("hunt-crossley", Formula::HuntCrossley),
    ("herbert-mcwhannell", Formula::HerbertMcWhannell),
    ("lee-wang", Formula::LeeWang),
    ("lankarani-nikravesh", Formula::LankaraniNikravesh),
    ("zhiying-qishao", Formula::ZhiyingQishao),
    ("gonthier", Formula::Gonthier),
    ("flores", Formula::Flores),
    ("hu-guo", Formula::HuGuo),
    ("safaeifar-farshidianfar", Formula::SafaeifarFarshidianfar),
];

impl Formula {
    /// The formula of a name in [`FORMULAS`]; None for any other.
    pub fn from_name(name: &str) -> Option<Self> {
        FORMULAS.iter().find(|(n, _)| *n == name).map(|(_, f)| *f)
    }
}

/// The damping ratio d = mu v0 / k that `formula` gives for a wanted restitution `e`.
///
/// Returns None unless 0 < e <= 1, or where d overflows.
pub fn damping_ratio(e: f64, formula: Formula) -> Option<f64> {
    if !(e > 0.0 && e <= 1.0) {
        return None;
    }
    let d = match formula {
        Formula::HuntCrossley => 1.5 * (1.0 - e),
        Formula::HerbertMcWhannell => 6.0 * (1.0 - e) / ((2.0 * e - 1.0) * (2.0 * e - 1.0) + 3.0),
        Formula::ZhiyingQishao => 0.75 * (1.0 - e * e) * exp(2.0 * (1.0 - e)),
        Formula::SafaeifarFarshidianfar => 1.25 * (1.0 - e) / e,
        Formula::LeeWang => 0.75 * (1.0 - e),
        Formula::LankaraniNikravesh => 0.75 * (1.0 - e * e),
        Formula::Gonthier => (1.0 - e * e) / e,
        Formula::Flores => 1.6 * (1.0 - e) / e,
        Formula::HuGuo => 1.5 * (1.0 - e) / e,
        Formula::Exact => {
            if e == 1.0 {
                return Some(0.0);
            }
            // e < 1/d, and e falls with d
            let (mut lo, mut hi) = (0.0, 1.0 / e);
            for _ in 0..200 {
                let d = 0.5 * (lo + hi);
                if loss(d) < 1.0 - e {
                    lo = d;
                } else {
                    hi = d;
                }
            }
            0.5 * (lo + hi)
        }
    };
    Some(d).filter(|d| d.is_finite())
}

/// Hysteresis damping mu_d, N s/m^(p+1), for restitution `e` at speed `v0` m/s on stiffness `k` N/m^p.
pub fn hysteresis_damping(e: f64, v0: f64, k: f64, formula: Formula) -> Option<f64> {
    if !(v0 > 0.0 && k > 0.0) {
        return None;
    }
    damping_ratio(e, formula).map(|d| d * k / v0)
}

#[cfg(test)]
mod tests {
    use super::super::impact::restitution;
    use super::*;

    #[test]
    fn exact_inversion_gives_the_known_ratios_and_the_wanted_restitution() {
        for (e, d) in [(0.3, 3.08708198), (0.5, 1.43275053), (0.7, 0.63482828), (0.9, 0.16648195)] {
            let x = damping_ratio(e, Formula::Exact).unwrap();
            assert!((x - d).abs() < 1e-8, "{x}");
            assert!((restitution(x) - e).abs() < 1e-13);
        }
    }

    #[test]
    fn exact_inversion_keeps_its_digits_near_1_and_near_0() {
        for loss in [1e-12, 1e-9, 1e-6, 1e-3] {
            let d = damping_ratio(1.0 - loss, Formula::Exact).unwrap();
            let back = super::super::impact::loss(d);
            let wanted = 1.0 - (1.0 - loss);
            assert!((back / wanted - 1.0).abs() < 1e-13, "{loss}: {back}");
        }
        let d = damping_ratio(1e-3, Formula::Exact).unwrap();
        assert!((d - 1000.0).abs() < 1e-9);
        assert_eq!(damping_ratio(1.0, Formula::Exact), Some(0.0));
    }

    #[test]
    fn published_forms_give_their_authors_figures_at_one_half() {
        let figures = [0.75, 1.0, 0.375, 0.5625, 0.5625 * 1f64.exp(), 1.5, 1.6, 1.5, 1.25];
        for ((name, f), d) in FORMULAS[1..].iter().zip(figures) {
            let got = damping_ratio(0.5, *f).unwrap();
            assert!((got - d).abs() < 1e-15, "{name}: {got}");
            assert_eq!(Formula::from_name(name), Some(*f));
        }
        assert_eq!(Formula::from_name("none such"), None);
    }

    #[test]
    fn published_forms_miss_at_a_half_what_they_nearly_meet_at_0_98() {
        let miss = |f, e: f64| (restitution(damping_ratio(e, f).unwrap()) - e).abs();
        for (name, f) in &FORMULAS[1..] {
            assert!(miss(*f, 0.5) > 0.01, "{name}");
            assert!(miss(*f, 0.98) < 0.011, "{name}");
        }
        for e in [1.2, 0.0, -0.5, f64::NAN, 1e-310] {
            assert!(damping_ratio(e, Formula::Exact).is_none(), "{e}");
        }
    }
}
