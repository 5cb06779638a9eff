//! plastic_indentation: beyond a yield depth the contact unloads more stiffly, to a permanent set.

use super::Elastic;
use crate::elementary::pow;
use crate::part::{
    parameters, searched, Experiment, Form, Item, Mechanism, Origin, Part, Quantity, Range, Searched, StartsFrom,
    Strength, EVERY_EXPERIMENT, HELD,
};
use crate::{ParameterError, Parameters};

const RATIO: Range =
    Range { least: Some(0.0), most: Some(1.0), words: "0 to below 1", holds: |v| (0.0..1.0).contains(&v) };
const FORM: Range = Range {
    least: Some(0.0),
    most: Some(2.0),
    words: "permanent_set (0), walton_braun (1) or thornton (2)",
    holds: |v| PlasticForm::from_i32(v as i32).is_some(),
};
/// The numbers of [`PlasticForm`], in words.
const FORMS: &[Item] = &[
    Item {
        name: "permanent_set",
        text: "To a permanent set by a power of the depth (Lankarani and Nikravesh 1994; Oliver and Pharr 1992)",
    },
    Item { name: "walton_braun", text: "Straight to a permanent set (Walton and Braun 1986)" },
    Item { name: "thornton", text: "Stiffer by the radius that has grown (Thornton 1997)" },
];
const DAMPING_FORM: Range =
    Range { least: Some(0.0), most: Some(1.0), words: "depth (0) or branch (1)", holds: |v| v == 0.0 || v == 1.0 };
/// What the hysteresis damping multiplies while the contact unloads plastically.
const DAMPING_FORMS: &[Item] = &[
    Item { name: "depth", text: "x^p, as while loading" },
    Item { name: "branch", text: "The force of the unloading branch" },
];

parameters! {
    /// Plasticity of the faces.
    plastic_indentation: PlasticIndentation {
        /// Penetration y at first yield, m, >= 0.
        yield_penetration: f64 = 0.0, "yield_penetration", 106, "m", "mm", Range::FROM_ZERO,
            "Penetration at first yield";
        /// Permanent set per metre of deepest penetration beyond yield, 0 to below 1; 0: neutral
        /// (Lankarani and Nikravesh 1994). With [`PlasticForm::Thornton`] any value above 0 switches yielding on.
        ratio: f64 = 0.0, "plastic_ratio", 107, "1", "", RATIO,
            "Permanent set per metre beyond yield, below 1; 0 turns plasticity off";
        /// Number of a [`PlasticForm`].
        form: i32 = 0, "plastic_form", 108, "", "", FORM,
            "How a contact that has yielded unloads", FORMS;
        /// Power n of the unloading curve of [`PlasticForm::PermanentSet`], 0.5 to 5; 0: the exponent p
        /// (Oliver and Pharr 1992 found 1.2 to 1.6).
        unloading_exponent: f64 = 0.0, "plastic_unloading_exponent", 109, "1", "", Range::POWER_OR_ZERO,
            "Power of the unloading curve of plastic_form permanent_set; 0: the exponent";
        /// 0: the hysteresis damping keeps its power of x while the plastic branch is followed;
        /// 1: it multiplies that branch, F = F_branch (1 + mu_d/k x^o v). The same where nothing yielded.
        damping_form: i32 = 0, "plastic_damping_form", 110, "", "", DAMPING_FORM,
            "What the hysteresis damping multiplies while the contact unloads plastically", DAMPING_FORMS;
    }
}

/// How a contact that has yielded unloads. d is the deepest penetration, y the yield depth, r the plastic ratio,
/// x_r the permanent set; below x_r nothing touches. Where the power of an unloading curve of `PermanentSet` is so low
/// that it would give back more than loading took (just beyond yield), the power that gives back just that is taken:
/// (p + 1)(1 - x_r/d) - 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub enum PlasticForm {
    /// x_r = r (d - y), F = F(d) ((x - x_r)/(d - x_r))^n (Lankarani and Nikravesh 1994; Oliver and Pharr 1992).
    PermanentSet = 0,
    /// x_r = r (d - y), F = F(d) (x - x_r)/(d - x_r), never above the loading curve: the straight, stiffer unloading
    /// of Walton and Braun 1986. At p = 1, y = 0: k2 = k1/(1 - r) and e = sqrt(k1/k2) = sqrt(1 - r) exactly.
    WaltonBraun = 1,
    /// Beyond y the loading goes on along its tangent at y; unloading is F = k_u (x - x_r)^p through the deepest
    /// point, k_u = k sqrt(k d^p/F(d)): the radius of curvature has grown by what the load fell short of the elastic
    /// one (Thornton 1997, eq. for R_p*, at p = 1.5). Neutral at p = 1.
    Thornton = 2,
}

impl PlasticForm {
    /// The form of a number; None for a number that has none.
    pub fn from_i32(n: i32) -> Option<Self> {
        match n {
            0 => Some(PlasticForm::PermanentSet),
            1 => Some(PlasticForm::WaltonBraun),
            2 => Some(PlasticForm::Thornton),
            _ => None,
        }
    }
}

const RATIO_SEARCHED: Searched = searched("ratio", 0.0, 0.97, 1e-3);
const YIELD_SEARCHED: Searched = searched("yield", 0.0, 3.0, 2e-3);
const RATIO_FOUND: Quantity = Quantity { name: "plastic_ratio", unit: "1", value: |t, _| t[0] };
const YIELD_FOUND: Quantity = Quantity { name: "yield_penetration", unit: "m", value: |t, s| t[1] * s.depth };

/// Unloading to a permanent set.
const PERMANENT_SET: Form = Form {
    label: "permanent set",
    parameters: &[RATIO_SEARCHED, YIELD_SEARCHED],
    starts: &[&[0.03], &[0.02, 0.4, 0.8, 1.3]],
    linear: true,
    extends: None,
    experiments: EVERY_EXPERIMENT,
    per_impact_speed: false,
    apply: |t, s, p| put(t[0], t[1] * s.depth, PlasticForm::PermanentSet, p),
    quantities: &[RATIO_FOUND, YIELD_FOUND],
};

impl Part for PlasticIndentation {
    const MECHANISM: Mechanism = Mechanism {
        name: "plastic_indentation",
        origin: Origin::Contact,
        sentence: "the surface keeps a permanent set and unloads steeper than it loaded",
        equation: "unloading from depth d along F(d) ((x - s)/(d - s))^n, set s = r (d - y)",
        source: "Lankarani and Nikravesh 1994; Oliver and Pharr 1992; Walton and Braun 1986; Thornton 1997",
        cure: HELD,
        parameters: PARAMETERS,
        forms: &[
            PERMANENT_SET,
            Form {
                label: "Walton-Braun",
                // a chord that is hardly shorter than the way loses nothing: no small ratio leads anywhere
                starts: &[&[0.15, 0.3, 0.6], &[0.02, 0.4, 0.8]],
                linear: false,
                apply: |t, s, p| put(t[0], t[1] * s.depth, PlasticForm::WaltonBraun, p),
                ..PERMANENT_SET
            },
            Form {
                label: "Thornton",
                parameters: &[searched("yield", 0.02, 3.0, 2e-3)],
                starts: &[&[0.3, 0.6, 0.9, 1.2, 1.5]],
                linear: false,
                apply: |t, s, p| put(0.5, t[0] * s.depth, PlasticForm::Thornton, p),
                quantities: &[Quantity { name: "yield_penetration", unit: "m", value: |t, s| t[0] * s.depth }],
                ..PERMANENT_SET
            },
            Form {
                label: "permanent set, unloading power free",
                parameters: &[RATIO_SEARCHED, YIELD_SEARCHED, searched("power", 1.0, 4.0, 1e-3)],
                starts: &[&[0.05, 0.7], &[0.02], &[1.3, 1.8]],
                linear: false,
                experiments: &[Experiment::Indentation],
                apply: |t, s, p| {
                    put(t[0], t[1] * s.depth, PlasticForm::PermanentSet, p);
                    p.plastic_indentation.unloading_exponent = t[2];
                },
                quantities: &[
                    RATIO_FOUND,
                    YIELD_FOUND,
                    Quantity { name: "plastic_unloading_exponent", unit: "1", value: |t, _| t[2] },
                ],
                ..PERMANENT_SET
            },
        ],
        collinear: &["adhesion"],
        strongly_nonlinear: false,
        starts_from: StartsFrom::Forms,
        strength: Strength::Reading,
    };

    #[inline(always)]
    fn is_neutral(&self) -> bool {
        !self.yields()
    }

    fn check(&self, law: &Parameters) -> Result<(), ParameterError> {
        if self.form == PlasticForm::Thornton as i32 && self.ratio > 0.0 {
            let (y, p) = (self.yield_penetration, law.elastic.exponent);
            if y <= 0.0 {
                let expected = "a finite number above 0 with plastic_form thornton";
                return Err(ParameterError { name: "yield_penetration", value: y, expected });
            }
            if p < 1.0 {
                return Err(ParameterError {
                    name: "exponent",
                    value: p,
                    expected: "1 to 5 with plastic_form thornton",
                });
            }
        }
        Ok(())
    }
}

fn put(ratio: f64, depth: f64, form: PlasticForm, p: &mut Parameters) {
    p.plastic_indentation.ratio = ratio;
    p.plastic_indentation.yield_penetration = depth;
    p.plastic_indentation.form = form as i32;
}

/// A plastically unloading branch.
#[derive(Clone, Copy)]
pub(crate) struct Unloading {
    /// Permanent set, m.
    pub set: f64,
    /// Deepest point, m.
    deepest: f64,
    /// Force there, N.
    top: f64,
    /// Power.
    pub power: f64,
    /// Whether the loading curve cuts it off.
    capped: bool,
}

impl Unloading {
    /// Force, N, at x > set.
    #[inline]
    pub fn force(&self, x: f64) -> f64 {
        self.top * pow((x - self.set) / (self.deepest - self.set), self.power)
    }
}

impl PlasticIndentation {
    /// Whether the faces yield at all.
    #[inline(always)]
    pub fn yields(&self) -> bool {
        self.ratio > 0.0
    }
}

impl Parameters {
    /// Whether the loading curve goes on along its tangent at `x` m.
    #[inline(always)]
    fn on_tangent(&self, x: f64) -> bool {
        let plastic = &self.plastic_indentation;
        plastic.form == PlasticForm::Thornton as i32 && plastic.yields() && x > plastic.yield_penetration
    }

    /// (force N, slope N/m) of the virgin loading curve at `x` > 0.
    #[inline]
    fn loading(&self, x: f64) -> (f64, f64) {
        if self.on_tangent(x) {
            let y = self.plastic_indentation.yield_penetration;
            let (f, slope) = self.elastic.force(y);
            return (f + slope * (x - y), slope);
        }
        self.elastic.force(x)
    }

    /// The unloading branch after a deepest penetration `d`; None while nothing has yielded.
    #[inline]
    pub(crate) fn unloading(&self, d: f64) -> Option<Unloading> {
        let plastic = &self.plastic_indentation;
        if !(plastic.yields() && d > plastic.yield_penetration) {
            return None;
        }
        let Elastic { stiffness, exponent } = self.elastic;
        let top = self.loading(d).0;
        if plastic.form == PlasticForm::Thornton as i32 {
            // k_u = k sqrt(k d^p/top), so (top/k_u)^2 = top^3/(k^3 d^p)
            let ratio = top / stiffness;
            let reach = pow(ratio * ratio * ratio / pow(d, exponent), 0.5 / exponent);
            return Some(Unloading { set: (d - reach).max(0.0), deepest: d, top, power: exponent, capped: false });
        }
        let set = plastic.ratio * (d - plastic.yield_penetration);
        if plastic.form == PlasticForm::WaltonBraun as i32 {
            return Some(Unloading { set, deepest: d, top, power: 1.0, capped: true });
        }
        let wanted = if plastic.unloading_exponent > 0.0 { plastic.unloading_exponent } else { exponent };
        // the power at which unloading returns all that loading took: never below it
        let lossless = (exponent + 1.0) * (1.0 - set / d) - 1.0;
        let power = if wanted > lossless { wanted } else { lossless };
        Some(Unloading { set, deepest: d, top, power, capped: false })
    }

    /// Depth from which on the loading curve cuts off an unloading branch, m: its deepest point where it never does.
    pub(crate) fn crossing(&self, u: &Unloading) -> f64 {
        let line = u.top / (u.deepest - u.set);
        if !u.capped || self.loading(u.deepest).1 <= line {
            return u.deepest;
        }
        // the loading curve less the line is convex and falls from the set to the root: Newton from the left
        let mut x = u.set;
        if x <= 0.0 {
            return 0.0;
        }
        for _ in 0..60 {
            let (f, slope) = self.loading(x);
            let step = (f - u.force(x)) / (line - slope);
            x += step;
            if step.abs() <= 1e-15 * u.deepest {
                break;
            }
        }
        x
    }

    /// Permanent set after a deepest penetration `d`, m.
    #[inline]
    pub fn permanent_set(&self, d: f64) -> f64 {
        self.unloading(d).map_or(0.0, |u| u.set)
    }

    /// (force, slope) of the branch at `x` > 0 with deepest `d` >= x; None below the permanent set.
    #[inline]
    pub(crate) fn branch(&self, x: f64, d: f64) -> Option<(f64, f64)> {
        if x < d {
            if let Some(u) = self.unloading(d) {
                if x <= u.set {
                    return None;
                }
                let f = u.force(x);
                if u.capped {
                    let l = self.loading(x);
                    if l.0 < f {
                        return Some(l);
                    }
                }
                return Some((f, u.power * f / (x - u.set)));
            }
        }
        Some(self.loading(x))
    }

    /// Work along the virgin loading curve from 0 to `x`, J.
    pub(crate) fn loading_work(&self, x: f64) -> f64 {
        if x <= 0.0 {
            return 0.0;
        }
        let Elastic { stiffness, exponent } = self.elastic;
        let q = exponent + 1.0;
        if self.on_tangent(x) {
            let y = self.plastic_indentation.yield_penetration;
            let f = stiffness * pow(y, exponent);
            let z = x - y;
            return f * y / q + z * (f + 0.5 * exponent * f / y * z);
        }
        stiffness * pow(x, exponent) * x / q
    }

    /// Energy that the elastic or unloading branch gives back from `x` with deepest `d` >= x, J.
    pub(crate) fn branch_energy(&self, x: f64, d: f64) -> f64 {
        if x <= 0.0 {
            return 0.0;
        }
        match self.unloading(d) {
            None => self.loading_work(x),
            Some(u) if x > u.set => {
                let end = self.crossing(&u).min(x);
                let capped = self.loading_work(x) - self.loading_work(end);
                u.force(end) * (end - u.set) / (u.power + 1.0) + capped
            }
            Some(_) => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Memory;

    #[test]
    fn walton_and_braun_unload_along_the_stiffer_line_to_the_set() {
        let mut p = Parameters::power_law(1e5, 1.0, 0.0);
        p.plastic_indentation = PlasticIndentation { ratio: 0.36, form: 1, ..PlasticIndentation::default() };
        let m = Memory { deepest: 1e-3, ..Memory::default() };
        assert!((p.permanent_set(1e-3) - 0.36e-3).abs() < 1e-18);
        assert!((p.force(&m, 0.68e-3, 0.0) - 1e5 / 0.64 * 0.32e-3).abs() < 1e-9);
        assert_eq!(p.force(&m, 0.3e-3, 0.0), 0.0);
    }

    #[test]
    fn thornton_asks_for_a_yield_depth_and_an_exponent_of_1() {
        let mut p = Parameters::power_law(1e5, 1.5, 0.0);
        p.plastic_indentation = PlasticIndentation { ratio: 0.5, form: 2, ..PlasticIndentation::default() };
        assert_eq!(p.validate().unwrap_err().name, "yield_penetration");
        p.plastic_indentation.yield_penetration = 1e-4;
        assert!(p.validate().is_ok());
        p.elastic.exponent = 0.9;
        assert_eq!(p.validate().unwrap_err().name, "exponent");
    }
}
