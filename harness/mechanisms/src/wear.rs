//! Stiffness that changes with the load taken before: the course, the part and the forms that softening and hardening
//! share.

use crate::load_history::{Dose, LoadHistory};
use crate::mechanism::*;
use crate::part::Wear;
use crate::physics::Physics;

/// Course of what changes with the load taken, from 0 for a new contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Course {
    /// 1 - exp(-n/n_0), over so many mean recordings n_0.
    Saturating(f64),
    /// n/10.
    Linear,
    /// Decades of 1 + n.
    Logarithmic,
    /// (n/10)^q of a power q: quick at first and never at rest, as creep is (Andrade 1910, q = 1/3).
    Power(f64),
}

impl Course {
    /// The course after a load of `n` mean recordings.
    pub fn after(self, n: f64) -> f64 {
        match self {
            Course::Saturating(orders) => 1.0 - (-n / orders).exp(),
            Course::Linear => n / 10.0,
            Course::Logarithmic => (1.0 + n).ln() / 10f64.ln(),
            Course::Power(q) => (n / 10.0).powf(q),
        }
    }
}

/// Stiffness that changes by a share with the load taken before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CyclicChange {
    /// Share, >= 0; 0: none.
    pub share: f64,
    pub course: Course,
    /// What of the recordings before counts.
    pub by: Dose,
    /// Whether the damping stays as it was.
    pub spares_damping: bool,
}

impl Default for CyclicChange {
    fn default() -> Self {
        CyclicChange { share: 0.0, course: Course::Linear, by: Dose::Recordings, spares_damping: false }
    }
}

impl CyclicChange {
    /// The factors of a change in the direction of `sign`, `least` at least.
    pub fn wear(&self, sign: f64, least: f64, history: &LoadHistory) -> Wear {
        let stiffness = (1.0 + sign * self.share * self.course.after(history.by(self.by))).max(least);
        Wear { stiffness, damping: if self.spares_damping { 1.0 } else { stiffness } }
    }
}

/// Which way the stiffness goes, and what its quantities are called.
pub trait Direction {
    /// Largest share.
    const MOST: f64;
    /// Names of the share of a course that saturates, and of the recordings it takes.
    const SHARE: &'static str;
    const ORDERS: &'static str;
    /// Names of the share of ten recordings, of the power of their count, and of the share of a decade.
    const PER_TEN: &'static str;
    const POWER: &'static str;
    const PER_DECADE: &'static str;
    /// The part that is to change.
    fn part(p: &mut Physics) -> &mut CyclicChange;
}

fn saturating<D: Direction>(t: &[f64], by: Dose, p: &mut Physics) {
    *D::part(p) = CyclicChange { share: t[0], course: Course::Saturating(t[1].exp()), by, spares_damping: false };
}

fn endless<D: Direction>(t: &[f64], course: Course, p: &mut Physics) {
    *D::part(p) = CyclicChange { share: t[0], course, ..CyclicChange::default() };
}

/// The forms of a change with the load taken; none for fewer than three recordings.
pub fn forms<D: Direction>(c: &Context) -> Vec<Form> {
    if c.scales.orders < 3.0 {
        return Vec::new();
    }
    let plain = Form {
        label: "saturating",
        parameters: vec![parameter("share", 0.0, D::MOST, 1e-3), parameter("ln orders", -1.0, 3.5, 2e-2)],
        starts: grid(&[&[0.02], &[0.0, 0.9, 1.8]]),
        linear: true,
        extends: None,
        apply: |t, _, p| saturating::<D>(t, Dose::Recordings, p),
        describe: |t, _| vec![(D::SHARE, t[0], "1"), (D::ORDERS, t[1].exp(), "1")],
    };
    let one = |label, apply: Apply, describe: Describe| Form {
        label,
        parameters: plain.parameters[..1].to_vec(),
        starts: vec![vec![0.02]],
        apply,
        describe,
        ..plain.clone()
    };
    let linear = one("linear", |t, _, p| endless::<D>(t, Course::Linear, p), |t, _| vec![(D::PER_TEN, t[0], "1")]);
    let logarithmic =
        one("logarithmic", |t, _, p| endless::<D>(t, Course::Logarithmic, p), |t, _| vec![(D::PER_DECADE, t[0], "1")]);
    let power = Form {
        label: "power of the count",
        parameters: vec![plain.parameters[0].clone(), parameter("power", 0.1, 2.0, 1e-2)],
        starts: grid(&[&[0.02], &[0.35, 0.7]]),
        apply: |t, _, p| endless::<D>(t, Course::Power(t[1]), p),
        describe: |t, _| vec![(D::PER_TEN, t[0], "1"), (D::POWER, t[1], "1")],
        ..plain.clone()
    };
    let mut v = vec![plain.clone(), linear, logarithmic.clone(), power];
    // severe recordings may count more than gentle ones; in units of the mean recording
    v.push(Form {
        label: "saturating, by the impulse taken",
        apply: |t, _, p| saturating::<D>(t, Dose::Impulse, p),
        ..plain.clone()
    });
    v.push(Form {
        label: "saturating, by the energy taken",
        apply: |t, _, p| saturating::<D>(t, Dose::Energy, p),
        ..plain.clone()
    });
    if c.terms.iter().any(|t| t == "hysteresis_damping") {
        v.push(Form {
            label: "saturating, stiffness alone",
            apply: |t, _, p| {
                saturating::<D>(t, Dose::Recordings, p);
                D::part(p).spares_damping = true;
            },
            ..plain
        });
        v.push(Form {
            label: "logarithmic, stiffness alone",
            apply: |t, _, p| {
                endless::<D>(t, Course::Logarithmic, p);
                D::part(p).spares_damping = true;
            },
            ..logarithmic
        });
    }
    v
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_course_starts_from_a_new_contact_and_has_its_share_where_it_is_counted_from() {
        for course in [Course::Saturating(2.0), Course::Linear, Course::Logarithmic, Course::Power(0.4)] {
            assert_eq!(course.after(0.0), 0.0, "{course:?}");
            assert!(course.after(1.0) < course.after(5.0), "{course:?}");
        }
        assert_eq!([Course::Linear, Course::Power(0.4), Course::Power(1.7)].map(|c| c.after(10.0)), [1.0; 3]);
        assert_eq!(Course::Power(1.0).after(3.0), Course::Linear.after(3.0));
        // a half power has half its share after a quarter of the way
        assert!((Course::Power(0.5).after(2.5) - 0.5).abs() < 1e-15);
    }
}
