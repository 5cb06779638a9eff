//! cyclic_softening: the stiffness falls with the order of the recordings

use crate::mechanism::*;
use crate::physics::Physics;
use crate::wear::Dose;

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

/// Share lost at last, and the logarithm of the recordings it takes.
fn saturating(t: &[f64], by: Dose, p: &mut Physics) {
    p.softening = t[0];
    p.softening_orders = t[1].exp();
    p.softening_by = by;
}

/// Share lost without end: every ten recordings alike (0), or with their logarithm (-1).
fn endless(t: &[f64], course: f64, p: &mut Physics) {
    p.softening = t[0];
    p.softening_orders = course;
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
    let linear = one("linear", |t, _, p| endless(t, 0.0, p), |t, _| vec![("softening_share_per_ten", t[0], "1")]);
    let logarithmic =
        one("logarithmic", |t, _, p| endless(t, -1.0, p), |t, _| vec![("softening_share_per_decade", t[0], "1")]);
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
                p.softening_spares_damping = true;
            },
            ..plain
        });
        v.push(Form {
            label: "logarithmic, stiffness alone",
            apply: |t, _, p| {
                endless(t, -1.0, p);
                p.softening_spares_damping = true;
            },
            ..logarithmic
        });
    }
    v
}
