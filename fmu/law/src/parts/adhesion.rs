//! adhesion: the faces pull on each other, both ways or while a neck between them holds.

use crate::elementary::{exp, pow};
use crate::part::{
    parameters, searched, Experiment, Form, Item, Mechanism, Origin, Part, Quantity, Range, Scales, Searched,
    StartsFrom, Step, Strength, EVERY_EXPERIMENT, HELD,
};
use crate::{Memory, Parameters};

/// Share of its range over which the pull of [`AdhesionForm::Leaving`] builds up.
const LEAVING_BUILD_UP: f64 = 0.05;

const FORM: Range = Range {
    least: Some(0.0),
    most: Some(4.0),
    words: "contact (0), neck (1), reach (2), leaving (3) or growing (4)",
    holds: |v| AdhesionForm::from_i32(v as i32).is_some(),
};
/// The numbers of [`AdhesionForm`], in words.
const FORMS: &[Item] = &[
    Item { name: "contact", text: "In contact, both ways (after Derjaguin, Muller and Toporov 1975)" },
    Item { name: "neck", text: "A neck while leaving (after Johnson, Kendall and Roberts 1971)" },
    Item { name: "reach", text: "Reaching out, both ways (after Derjaguin, Muller and Toporov 1975)" },
    Item { name: "leaving", text: "A neck, full at once while leaving" },
    Item { name: "growing", text: "Growing with the contact, and a neck (after Johnson, Kendall and Roberts 1971)" },
];

parameters! {
    /// Pull between the faces.
    adhesion: Adhesion {
        /// Pull-off force, N, >= 0.
        force: f64 = 0.0, "adhesion_force", 111, "N", "kN", Range::FROM_ZERO, "Pull-off force; 0 turns adhesion off";
        /// Range of the pull, m, > 0.
        range: f64 = 1e-5, "adhesion_range", 112, "m", "um", Range::POSITIVE, "Range of the adhesive pull, above 0";
        /// Number of an [`AdhesionForm`].
        form: i32 = 0, "adhesion_form", 113, "", "", FORM,
            "How the faces pull on each other", FORMS;
        /// Depth below the surface over which the pull of `Neck` and `Leaving` fades, m, >= 0; 0: it does not.
        depth: f64 = 0.0, "adhesion_depth", 125, "m", "um", Range::FROM_ZERO,
            "Depth below the surface over which the pull of adhesion_form neck and leaving fades; 0: it does not";
    }
}

/// How adhesion pulls. Fa is the pull-off force, R the range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(i32)]
pub enum AdhesionForm {
    /// Fa (1 - exp(-x/R)) at x > 0, both ways, nothing before touch (smoothed after Derjaguin, Muller and Toporov 1975).
    Contact = 0,
    /// Fa (1 - exp(-(a - x)/R)) where x is less than a, the deepest point since the last separation; outside
    /// the surface it fades linearly to zero at x = -R, where the neck breaks (after Johnson, Kendall and Roberts 1971).
    Neck = 1,
    /// Fa at x > 0, fading linearly to zero at x = -R, both ways, so it acts before touch too (after Derjaguin,
    /// Muller and Toporov 1975).
    Reach = 2,
    /// As `Neck`, but the pull is there as soon as the contact leaves its deepest point (built up over R/20), and
    /// R is how far it reaches out.
    Leaving = 3,
    /// Fa ((x + e)/R)^(p/2): the pull grows with the contact; e is how far the neck draws the faces together, none
    /// where x is at its deepest since the last separation, rising evenly to R at the surface; it breaks at x = -R
    /// (after Johnson, Kendall and Roberts 1971, whose pull goes with the contact radius to 3/2).
    Growing = 4,
}

impl AdhesionForm {
    /// The form of a number; None for a number that has none.
    pub fn from_i32(n: i32) -> Option<Self> {
        match n {
            0 => Some(AdhesionForm::Contact),
            1 => Some(AdhesionForm::Neck),
            3 => Some(AdhesionForm::Leaving),
            2 => Some(AdhesionForm::Reach),
            4 => Some(AdhesionForm::Growing),
            _ => None,
        }
    }
}

const FORCE: Searched = searched("force", 0.0, 3.0, 1e-3);
/// A pull that reaches farther than the contact is deep is a force in flight; an indentation has no flight.
const RANGE: Searched =
    Searched { upper_in: Some((Experiment::Indentation, 1.5)), ..searched("ln range", -6.0, 0.0, 1e-2) };
const FORCE_FOUND: Quantity = Quantity { name: "adhesion_force", unit: "N", value: |t, s| t[0] * s.force };
const RANGE_FOUND: Quantity = Quantity { name: "adhesion_range", unit: "m", value: |t, s| s.depth * t[1].exp() };
const DEPTH_FOUND: Quantity = Quantity { name: "adhesion_depth", unit: "m", value: fade };

/// A neck that holds the faces while they leave.
const NECK: Form = Form {
    label: "neck, while leaving",
    parameters: &[FORCE, RANGE],
    starts: &[&[0.02], &[-4.0, -2.3, -0.7]],
    linear: true,
    extends: None,
    experiments: EVERY_EXPERIMENT,
    per_impact_speed: false,
    apply: |t, s, p| put(t, s, p, AdhesionForm::Neck),
    quantities: &[FORCE_FOUND, RANGE_FOUND],
};

impl Part for Adhesion {
    const MECHANISM: Mechanism = Mechanism {
        name: "adhesion",
        origin: Origin::Contact,
        sentence: "the faces pull on each other, above all while leaving",
        equation: "a pull of at most F_a over a range",
        source: "Johnson, Kendall and Roberts 1971; Derjaguin, Muller and Toporov 1975",
        cure: HELD,
        parameters: PARAMETERS,
        forms: &[
            Form { label: "reversible, in contact", apply: |t, s, p| put(t, s, p, AdhesionForm::Contact), ..NECK },
            NECK,
            // the neck is where the faces are near each other, not as deep as the contact has been
            Form {
                label: "neck near the surface, while leaving",
                parameters: &[FORCE, RANGE, searched("ln depth", -6.0, 1.0, 1e-2)],
                starts: &[&[-2.5, -1.0]],
                extends: Some(NECK.label),
                apply: |t, s, p| {
                    put(t, s, p, AdhesionForm::Leaving);
                    p.adhesion.depth = fade(t, s);
                },
                quantities: &[FORCE_FOUND, RANGE_FOUND, DEPTH_FOUND],
                ..NECK
            },
            // growing with the contact: the pull at the surface is what is given
            Form {
                label: "growing with the contact, and a neck",
                starts: &[],
                extends: Some(NECK.label),
                apply: |t, s, p| put(t, s, p, AdhesionForm::Growing),
                ..NECK
            },
            Form { label: "while leaving, reaching out", apply: |t, s, p| put(t, s, p, AdhesionForm::Leaving), ..NECK },
            Form { label: "reaching out, reversible", apply: |t, s, p| put(t, s, p, AdhesionForm::Reach), ..NECK },
        ],
        collinear: &["plastic_indentation", "residual_magnetism"],
        strongly_nonlinear: false,
        starts_from: StartsFrom::Forms,
        strength: Strength::Reading,
    };

    #[inline(always)]
    fn is_neutral(&self) -> bool {
        self.force == 0.0
    }

    #[inline(always)]
    fn remember(&self, step: &Step<'_>, after: &mut Memory) {
        if self.force > 0.0 {
            let mut anchor = step.before.deepest - step.before.released;
            if step.x1 <= -self.range {
                anchor = 0.0;
            } else if step.x1 > anchor {
                anchor = step.x1;
            }
            after.released = after.deepest - anchor;
        }
    }
}

fn put(t: &[f64], s: &Scales, p: &mut Parameters, form: AdhesionForm) {
    p.adhesion.force = t[0] * s.force;
    p.adhesion.range = s.depth * t[1].exp();
    p.adhesion.form = form as i32;
}

fn fade(t: &[f64], s: &Scales) -> f64 {
    s.depth * t[2].exp()
}

impl Adhesion {
    /// Whether it pulls, and that in this form.
    #[inline]
    pub(crate) fn pulls(&self, form: AdhesionForm) -> bool {
        self.force > 0.0 && self.form == form as i32
    }

    /// (x + e)/R of [`AdhesionForm::Growing`], below zero where no neck holds, and its d/dx, 1/m.
    #[inline]
    fn nearness(&self, m: &Memory, x: f64) -> (f64, f64) {
        let (anchor, r) = (m.deepest - m.released, self.range);
        if x >= anchor || anchor <= 0.0 {
            (x / r, 1.0 / r)
        } else if x >= 0.0 {
            (x / r + 1.0 - x / anchor, 1.0 / r - 1.0 / anchor)
        } else {
            (x / r + 1.0, 1.0 / r)
        }
    }

    /// (pull >= 0, its d/dx), N and N/m, on an elastic law of exponent `p`.
    #[inline]
    pub(crate) fn pull(&self, p: f64, m: &Memory, x: f64) -> (f64, f64) {
        let (fa, r) = (self.force, self.range);
        let leaving = self.form == AdhesionForm::Leaving as i32;
        if leaving || self.form == AdhesionForm::Neck as i32 {
            let anchor = m.deepest - m.released;
            if anchor <= 0.0 || x >= anchor || x <= -r {
                return (0.0, 0.0);
            }
            let build_up = if leaving { LEAVING_BUILD_UP * r } else { r };
            let e = exp(-(anchor - x) / build_up);
            let (f, fx) = (fa * (1.0 - e), -fa * e / build_up);
            if x >= 0.0 {
                if self.depth > 0.0 {
                    let w = exp(-x / self.depth);
                    (f * w, (fx - f / self.depth) * w)
                } else {
                    (f, fx)
                }
            } else {
                let w = 1.0 + x / r;
                (f * w, fx * w + f / r)
            }
        } else if self.form == AdhesionForm::Growing as i32 {
            let (near, slope) = self.nearness(m, x);
            if near <= 0.0 {
                return (0.0, 0.0);
            }
            let f = fa * pow(near, 0.5 * p);
            (f, 0.5 * p * f / near * slope)
        } else if self.form == AdhesionForm::Reach as i32 {
            if x >= 0.0 {
                (fa, 0.0)
            } else if x > -r {
                (fa * (1.0 + x / r), fa / r)
            } else {
                (0.0, 0.0)
            }
        } else if x > 0.0 {
            let e = exp(-x / r);
            (fa * (1.0 - e), fa * e / r)
        } else {
            (0.0, 0.0)
        }
    }

    /// Potential of reversible adhesion on an elastic law of exponent `p`, J, <= 0 and zero far outside.
    pub(crate) fn pull_energy(&self, p: f64, x: f64) -> f64 {
        let (fa, r) = (self.force, self.range);
        if fa <= 0.0 {
            0.0
        } else if self.form == AdhesionForm::Contact as i32 && x > 0.0 {
            -fa * (x + r * (exp(-x / r) - 1.0))
        } else if self.form == AdhesionForm::Reach as i32 && x > -r {
            if x >= 0.0 {
                -fa * (0.5 * r + x)
            } else {
                -0.5 * fa * (x + r) * (x + r) / r
            }
        } else if self.form == AdhesionForm::Growing as i32 && x > 0.0 {
            // of the pull going in; what the neck adds while leaving has none
            let q = 0.5 * p;
            -fa * pow(x / r, q) * x / (q + 1.0)
        } else {
            0.0
        }
    }

    /// Work against the pull of [`AdhesionForm::Growing`] from `a` to `b`, no kink between, J, on an elastic law of
    /// exponent `p`.
    pub(crate) fn growing_work(&self, p: f64, m: &Memory, a: f64, b: f64) -> f64 {
        let (middle, slope) = self.nearness(m, 0.5 * (a + b));
        if middle <= 0.0 {
            return 0.0;
        }
        let (q, change) = (0.5 * p, 0.5 * slope * (b - a));
        let mean = if change.abs() < 1e-6 * middle {
            pow(middle, q)
        } else {
            let end = |z: f64| if z > 0.0 { pow(z, q + 1.0) } else { 0.0 };
            (end(middle + change) - end(middle - change)) / (2.0 * change * (q + 1.0))
        };
        -self.force * mean * (b - a)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_neck_pulls_outside_the_surface_until_it_breaks_at_its_range() {
        let mut p = Parameters::power_law(1e6, 1.5, 0.0);
        p.adhesion = Adhesion { force: 3.0, range: 5e-5, form: 1, depth: 0.0 };
        let m = Memory { deepest: 9e-4, ..Memory::default() };
        assert!(p.force(&m, -1e-5, -0.1) < -2.0);
        assert_eq!(p.force(&m, -5e-5, -0.1), 0.0);
        let broken = p.advance(&m, 1e-5, -0.1, -6e-5, -0.1, 1e-3);
        assert_eq!(p.force(&broken, -1e-5, -0.1), 0.0);
    }
}
