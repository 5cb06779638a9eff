//! cyclic_softening: the stiffness falls with the order of the recordings

use crate::load_history::{Dose, LoadHistory};
use crate::mechanism::*;
use crate::part::{Part, Wear};
use crate::physics::Physics;

/// k_i = k (1 - s (1 - exp(-(i - 1)/n))) (Mullins 1948; Landgraf, Morrow and Endo 1969), or with the
/// impulse or the energy taken before in place of the count (a linear sum of damage: Miner 1945).
pub const MECHANISM: Mechanism = Mechanism {
    name: "cyclic_softening",
    origin: Origin::Contact,
    named: true,
    equation: "k_i = k (1 - s (1 - exp(-(i - 1)/n)))",
    source: "Mullins 1948; Landgraf, Morrow and Endo 1969",
    sentence: "the stiffness falls with the order of the recordings",
    cure: "The element holds the contact as it was when new; condition the contact first, or lower its stiffness from recording to recording as given here.",
    forms,
    acts: Acts::Reading,
};

/// Course of what wears with the load taken, from 0 for a new contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Course {
    /// 1 - exp(-n/n_0), over so many mean recordings n_0.
    Saturating(f64),
    /// n/10.
    Linear,
    /// Decades of 1 + n.
    Logarithmic,
}

impl Course {
    /// The course after a load of `n` mean recordings.
    pub fn after(self, n: f64) -> f64 {
        match self {
            Course::Saturating(orders) => 1.0 - (-n / orders).exp(),
            Course::Linear => n / 10.0,
            Course::Logarithmic => (1.0 + n).ln() / 10f64.ln(),
        }
    }
}

/// Stiffness lost with the load taken before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CyclicSoftening {
    /// Share s.
    pub share: f64,
    pub course: Course,
    /// What of the recordings before counts.
    pub by: Dose,
    /// Whether damping keeps what stiffness loses.
    pub spares_damping: bool,
}

impl Default for CyclicSoftening {
    fn default() -> Self {
        CyclicSoftening { share: 0.0, course: Course::Linear, by: Dose::Recordings, spares_damping: false }
    }
}

/// Share of the stiffness that is left at least.
const LEAST: f64 = 0.05;

impl Part for CyclicSoftening {
    fn wear(&self, history: &LoadHistory) -> Wear {
        let stiffness = (1.0 - self.share * self.course.after(history.by(self.by))).max(LEAST);
        Wear { stiffness, damping: if self.spares_damping { 1.0 } else { stiffness } }
    }
}

/// Share lost at last, and the logarithm of the recordings it takes.
fn saturating(t: &[f64], by: Dose, p: &mut Physics) {
    p.cyclic_softening.share = t[0];
    p.cyclic_softening.course = Course::Saturating(t[1].exp());
    p.cyclic_softening.by = by;
}

/// Share lost without end.
fn endless(t: &[f64], course: Course, p: &mut Physics) {
    p.cyclic_softening.share = t[0];
    p.cyclic_softening.course = course;
}

fn forms(c: &Context) -> Vec<Form> {
    if c.scales.orders < 3.0 {
        return Vec::new();
    }
    let plain = Form {
        label: "saturating",
        parameters: vec![parameter("share", 0.0, 0.9, 1e-3), parameter("ln orders", -1.0, 3.5, 2e-2)],
        starts: grid(&[&[0.02], &[0.0, 0.9, 1.8]]),
        linear: true,
        extends: None,
        apply: |t, _, p| saturating(t, Dose::Recordings, p),
        describe: |t, _| vec![("softening_share", t[0], "1"), ("softening_orders", t[1].exp(), "1")],
    };
    let one = |label, apply: Apply, describe: Describe| Form {
        label,
        parameters: plain.parameters[..1].to_vec(),
        starts: vec![vec![0.02]],
        apply,
        describe,
        ..plain.clone()
    };
    let linear =
        one("linear", |t, _, p| endless(t, Course::Linear, p), |t, _| vec![("softening_share_per_ten", t[0], "1")]);
    let logarithmic = one(
        "logarithmic",
        |t, _, p| endless(t, Course::Logarithmic, p),
        |t, _| vec![("softening_share_per_decade", t[0], "1")],
    );
    let mut v = vec![plain.clone(), linear, logarithmic.clone()];
    // severe recordings may wear more than gentle ones; in units of the mean recording
    v.push(Form {
        label: "saturating, by the impulse taken",
        apply: |t, _, p| saturating(t, Dose::Impulse, p),
        ..plain.clone()
    });
    v.push(Form {
        label: "saturating, by the energy taken",
        apply: |t, _, p| saturating(t, Dose::Energy, p),
        ..plain.clone()
    });
    if c.terms.iter().any(|t| t == "hysteresis_damping") {
        // damping may keep what stiffness loses
        v.push(Form {
            label: "saturating, stiffness alone",
            apply: |t, _, p| {
                saturating(t, Dose::Recordings, p);
                p.cyclic_softening.spares_damping = true;
            },
            ..plain
        });
        v.push(Form {
            label: "logarithmic, stiffness alone",
            apply: |t, _, p| {
                endless(t, Course::Logarithmic, p);
                p.cyclic_softening.spares_damping = true;
            },
            ..logarithmic
        });
    }
    v
}
