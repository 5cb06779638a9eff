//! loose_part: a part loose inside the body strikes late

use crate::mechanism::*;
use record::Kind;

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

/// Share of the depth to which the part would be pressed over which its damping comes in: there at once, it would jump.
const EASED: f64 = 0.05;

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
        extends: None,
        apply,
        describe: described,
    };
    let plain = form("linear inner contact", |t, c, p| part(t, c, p, false));
    // as in the contact itself, damping that is there at once would pull and jump (Hunt and Crossley 1975)
    let mut eased = plain.extended(
        "linear inner contact, its damping ramped in",
        vec![parameter("ln ramp", -7.0, 0.0, 2e-2)],
        grid(&[&[-4.0, -2.0]]),
    );
    eased.apply = |t, c, p| {
        part(t, c, p, false);
        p.loose_ramp = c.scales.depth * t[4].exp();
    };
    eased.describe = |t, c| [described(t, c), vec![("loose_ramp", c.scales.depth * t[4].exp(), "m")]].concat();
    let mut v = vec![plain, eased];
    if c.kind == Kind::DropTest {
        // thrown forward, it comes back against a wall behind it
        let mut both = v[0].extended(
            "linear inner contact on both sides",
            vec![parameter("back", 0.0, 6.0, 3e-3)],
            grid(&[&[0.1, 0.4, 1.0]]),
        );
        both.apply = |t, c, p| {
            part(t, c, p, false);
            p.loose_back = c.scales.depth * t[4];
        };
        both.describe = |t, c| [described(t, c), vec![("loose_back", c.scales.depth * t[4], "m")]].concat();
        v.push(both);
        v.push(form("linear inner contact, its weight on the body", |t, c, p| part(t, c, p, true)));
    }
    v
}

/// Stiffness of the inner contact, N/m, from the loose part's mass and frequency on it, the latter beside the root of
/// force over mass and depth of the impact.
fn stiffness(t: &[f64], c: &Context) -> f64 {
    c.scales.force / c.scales.depth * (t[0] + 2.0 * t[2]).exp()
}

fn described(t: &[f64], c: &Context) -> Vec<(&'static str, f64, &'static str)> {
    vec![
        ("loose_mass", c.scales.mass * t[0].exp(), "kg"),
        ("loose_gap", c.scales.depth * t[1], "m"),
        ("loose_stiffness", stiffness(t, c), "N/m"),
    ]
}

fn part(t: &[f64], c: &Context, p: &mut crate::physics::Physics, borne: bool) {
    p.loose_mass = c.scales.mass * t[0].exp();
    p.loose_gap = c.scales.depth * t[1];
    p.loose_stiffness = stiffness(t, c);
    p.loose_damping = 2.0 * t[3].exp() * (p.loose_stiffness * p.loose_mass).sqrt();
    p.loose_ramp = EASED * c.scales.speed * (p.loose_mass / p.loose_stiffness).sqrt();
    p.loose_borne = borne;
    if c.kind == Kind::ContactorOpening {
        // a body that a spring sets in motion from rest would leave the part where it was, were it not carried along
        p.loose_back = 0.0;
    }
}
