//! loose_part: a part loose inside the body strikes late

use crate::diagnose::mechanism::*;
use crate::record::Kind;

/// a mass m_l strikes inside the body after a gap (Lieber and Jensen 1945 (acceleration damper)).
pub const MECHANISM: Mechanism = Mechanism {
    name: "loose_part",
    origin: Origin::Motion,
    named: true,
    equation: "a mass m_l strikes inside the body after a gap",
    source: "Lieber and Jensen 1945 (acceleration damper)",
    sentence: "a part loose inside the body strikes late",
    cure: "The contact element is right; in the rig's model split the body as given here, or fasten the part.",
    forms,
    acts: Acts::Struck,
};

fn forms(c: &Context) -> Vec<Form> {
    if c.kind == Kind::Indentation {
        return Vec::new();
    }
    let form = |label, apply: Apply| Form {
        label,
        parameters: vec![
            // down to a thousandth of the body: a stiff part that strikes at full speed is felt even so
            parameter("ln mass", -7.0, -0.7, 2e-2),
            parameter("gap", 0.0, 6.0, 3e-3),
            // slower than the impact itself it would be no strike, but a second body on a spring
            parameter("ln frequency", 0.3, 4.0, 2e-2),
            parameter("ln damping", -6.0, 0.5, 5e-2),
        ],
        starts: grid(&[&[-5.0, -3.3, -1.8], &[0.02, 0.3, 0.8, 1.8], &[0.6, 1.2, 2.0], &[-2.0]]),
        linear: false,
        apply,
        describe: |t, c| {
            vec![
                ("loose_mass", c.scales.mass * t[0].exp(), "kg"),
                ("loose_gap", c.scales.depth * t[1], "m"),
                ("loose_stiffness", stiffness(t, c), "N/m"),
            ]
        },
    };
    let mut v = vec![form("linear inner contact", |t, c, p| part(t, c, p, false))];
    if c.kind == Kind::DropTest {
        v.push(form("linear inner contact, its weight on the body", |t, c, p| part(t, c, p, true)));
    }
    v
}

/// Stiffness of the inner contact, N/m, from the loose part's mass and frequency on it, the latter beside the root of
/// force over mass and depth of the impact.
fn stiffness(t: &[f64], c: &Context) -> f64 {
    c.scales.force / c.scales.depth * (t[0] + 2.0 * t[2]).exp()
}

fn part(t: &[f64], c: &Context, p: &mut crate::model::physics::Physics, borne: bool) {
    p.loose_mass = c.scales.mass * t[0].exp();
    p.loose_gap = c.scales.depth * t[1];
    p.loose_stiffness = stiffness(t, c);
    p.loose_damping = 2.0 * t[3].exp() * (p.loose_stiffness * p.loose_mass).sqrt();
    p.loose_borne = borne;
}
