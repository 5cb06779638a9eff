//! hysteresis_damping: the contact loses energy in proportion to a power of depth times speed

use crate::mechanism::*;
use record::Kind;

/// F = mu_d x^(p+o) v (Hunt and Crossley 1975; Lankarani and Nikravesh 1990 (mu_d over the impact speed);
/// Kuwabara and Kono 1987 (o = -1); Tsuji, Tanaka and Ishida 1992 (another power); Cross 1965 (thinned by speed)).
pub const MECHANISM: Mechanism = Mechanism {
    name: "hysteresis_damping",
    origin: Origin::Contact,
    named: true,
    equation: "F = mu_d x^(p+o) v/(1 + |v|/v_h)",
    source: "Hunt and Crossley 1975; Lankarani and Nikravesh 1990; Kuwabara and Kono 1987 (o = -1); Tsuji, Tanaka and Ishida 1992; Cross 1965",
    sentence: "the contact loses energy in proportion to a power of depth times speed",
    cure: "The element now holds it: import the FMU written beside this report.",
    forms,
    acts: Acts::Reading,
};

/// mu_d such that the damping at the reference depth and speed is `ratio` of the elastic force.
fn damp(ratio: f64, offset: f64, c: &Context, p: &mut crate::physics::Physics) {
    p.law.damping_exponent_offset = offset;
    p.law.hysteresis_damping = ratio * p.law.stiffness * c.scales.x_ref.powf(-offset) / c.scales.v_ref;
}

fn thinning_speed(t: &[f64], c: &Context) -> f64 {
    c.scales.speed * t[1].exp()
}

fn forms(c: &Context) -> Vec<Form> {
    if c.terms.iter().any(|t| t == "hysteresis_damping") {
        return Vec::new();
    }
    let form = |label, apply: Apply| Form {
        label,
        parameters: vec![parameter("ratio", 0.0, 20.0, 1e-3)],
        starts: vec![vec![0.05]],
        linear: true,
        extends: None,
        apply,
        describe: |t, c| vec![("damping_ratio", t[0], "1"), ("reference_speed", c.scales.v_ref, "m/s")],
    };
    let mut forms = vec![
        form("Hunt-Crossley", |t, c, p| damp(t[0], 0.0, c, p)),
        form("Kuwabara-Kono", |t, c, p| damp(t[0], -1.0, c, p)),
        form("half power", |t, c, p| damp(t[0], -0.5, c, p)),
        Form {
            label: "power free",
            parameters: vec![parameter("ratio", 0.0, 20.0, 1e-3), parameter("power", 0.25, 3.0, 1e-2)],
            starts: grid(&[&[0.05], &[0.5, 1.25]]),
            linear: true,
            extends: None,
            apply: |t, c, p| damp(t[0], t[1] - p.law.exponent, c, p),
            describe: |t, c| {
                vec![("damping_ratio", t[0], "1"), ("reference_speed", c.scales.v_ref, "m/s"), ("power", t[1], "1")]
            },
        },
    ];
    // what thins with speed shows over impact speeds: a contactor has few, an indentation none
    if c.kind == Kind::DropTest {
        forms.push(Form {
            label: "shear-thinning",
            parameters: vec![parameter("ratio", 0.0, 20.0, 1e-3), parameter("ln thinning speed", -2.3, 2.3, 2e-2)],
            starts: grid(&[&[0.05], &[-0.7, 0.7]]),
            linear: true,
            extends: None,
            apply: |t, c, p| {
                damp(t[0], 0.0, c, p);
                p.law.hysteresis_thinning_speed = thinning_speed(t, c);
            },
            describe: |t, c| {
                vec![
                    ("damping_ratio", t[0], "1"),
                    ("reference_speed", c.scales.v_ref, "m/s"),
                    ("hysteresis_thinning_speed", thinning_speed(t, c), "m/s"),
                ]
            },
        });
        forms.push(form("Lankarani-Nikravesh", |t, c, p| {
            damp(t[0], 0.0, c, p);
            p.damping_speed = Some(c.scales.v_ref);
        }));
    }
    forms
}
