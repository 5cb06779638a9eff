//! viscous_damping: a damper that acts from the first touch, whatever the depth

use crate::mechanism::*;
use record::Kind;

/// F = c v, ramped in over a depth, or thinned to c v/(1 + |v|/v_t) (Kelvin-Voigt; Ahn and Ryu 2005, eq. 1; Cross 1965).
pub const MECHANISM: Mechanism = Mechanism {
    name: "viscous_damping",
    origin: Origin::Contact,
    named: true,
    equation: "F = c v/(1 + |v|/v_t), ramped in over a depth",
    source: "Kelvin-Voigt; Ahn and Ryu 2005, eq. 1; Cross 1965",
    sentence: "a damper that acts from the first touch, whatever the depth",
    cure: "The element now holds it: import the FMU written beside this report.",
    forms,
    acts: Acts::Reading,
};

/// The damper of a form's first parameter, N s/m.
fn damping(t: &[f64], c: &Context) -> f64 {
    t[0] * c.scales.force / c.scales.speed
}

fn forms(c: &Context) -> Vec<Form> {
    let mut forms = vec![
        Form {
            label: "from first touch",
            parameters: vec![parameter("c", 0.0, 5.0, 1e-3)],
            starts: vec![vec![0.02]],
            linear: true,
            extends: None,
            apply: |t, c, p| p.law.viscous_damping += damping(t, c),
            describe: |t, c| vec![("viscous_damping", damping(t, c), "N s/m")],
        },
        Form {
            label: "ramped",
            parameters: vec![parameter("c", 0.0, 5.0, 1e-3), parameter("ln ramp", -4.0, 0.3, 1e-2)],
            starts: grid(&[&[0.02], &[-2.5, -1.0]]),
            linear: true,
            extends: None,
            apply: |t, c, p| {
                p.law.viscous_damping += damping(t, c);
                p.law.viscous_ramp = c.scales.depth * t[1].exp();
            },
            describe: |t, c| {
                vec![("viscous_damping", damping(t, c), "N s/m"), ("viscous_ramp", c.scales.depth * t[1].exp(), "m")]
            },
        },
    ];
    // what thins with speed shows over impact speeds: a contactor has few, an indentation none
    if c.kind == Kind::DropTest {
        forms.push(Form {
            label: "shear-thinning",
            parameters: vec![parameter("c", 0.0, 8.0, 1e-3), parameter("ln thinning speed", -2.3, 2.3, 2e-2)],
            starts: grid(&[&[0.02], &[-0.7, 0.7]]),
            linear: true,
            extends: None,
            apply: |t, c, p| {
                p.law.viscous_damping += damping(t, c);
                p.law.viscous_thinning_speed = c.scales.speed * t[1].exp();
            },
            describe: |t, c| {
                vec![
                    ("viscous_damping", damping(t, c), "N s/m"),
                    ("viscous_thinning_speed", c.scales.speed * t[1].exp(), "m/s"),
                ]
            },
        });
    }
    forms
}
