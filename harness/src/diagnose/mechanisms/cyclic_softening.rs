//! cyclic_softening: the stiffness falls with the order of the recordings

use crate::diagnose::mechanism::*;

/// k_i = k (1 - s (1 - exp(-(i - 1)/n))) (Mullins 1948; Landgraf, Morrow and Endo 1969).
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

fn forms(c: &Context) -> Vec<Form> {
    if c.scales.orders < 3.0 {
        return Vec::new();
    }
    let mut v = vec![
        Form {
            label: "saturating",
            parameters: vec![parameter("share", 0.0, 0.9, 1e-3), parameter("ln orders", -1.0, 3.5, 2e-2)],
            starts: grid(&[&[0.02], &[0.0, 0.9, 1.8]]),
            linear: true,
            extends: None,
            apply: |t, _, p| {
                p.softening = t[0];
                p.softening_orders = t[1].exp();
            },
            describe: |t, _| vec![("softening_share", t[0], "1"), ("softening_orders", t[1].exp(), "1")],
        },
        Form {
            label: "linear",
            parameters: vec![parameter("share", 0.0, 0.9, 1e-3)],
            starts: vec![vec![0.02]],
            linear: true,
            extends: None,
            apply: |t, _, p| {
                p.softening = t[0];
                p.softening_orders = 0.0;
            },
            describe: |t, _| vec![("softening_share_per_ten", t[0], "1")],
        },
        Form {
            label: "logarithmic",
            parameters: vec![parameter("share", 0.0, 0.9, 1e-3)],
            starts: vec![vec![0.02]],
            linear: true,
            extends: None,
            apply: |t, _, p| {
                p.softening = t[0];
                p.softening_orders = -1.0;
            },
            describe: |t, _| vec![("softening_share_per_decade", t[0], "1")],
        },
    ];
    if c.terms.iter().any(|t| t == "hysteresis_damping") {
        // damping may keep what stiffness loses
        v.push(Form {
            label: "saturating, stiffness alone",
            apply: |t, _, p| {
                p.softening = t[0];
                p.softening_orders = t[1].exp();
                p.softening_spares_damping = true;
            },
            ..v[0].clone()
        });
        v.push(Form {
            label: "logarithmic, stiffness alone",
            apply: |t, _, p| {
                p.softening = t[0];
                p.softening_orders = -1.0;
                p.softening_spares_damping = true;
            },
            ..v[2].clone()
        });
    }
    v
}
