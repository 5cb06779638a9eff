//! base_compliance: the stop itself moves on a spring

use crate::diagnose::mechanism::*;
use crate::record::Kind;

/// m_b x_b'' = F - k_b x_b - c_b x_b' (Den Hartog 1934).
pub const MECHANISM: Mechanism = Mechanism {
    name: "base_compliance",
    origin: Origin::Motion,
    named: true,
    equation: "m_b x_b'' = F - k_b x_b - c_b x_b'",
    source: "Den Hartog 1934",
    sentence: "the stop itself moves on a spring",
    cure: "The contact element is right; in the rig's model put the stop on the mass, spring and damper given here.",
    forms,
    acts: Acts::Push,
};

/// (stiffness N/m, mass kg, damping N s/m) from their logarithms' parameters.
fn base(t: &[f64], c: &Context) -> (f64, f64, f64) {
    let k = c.scales.force / c.scales.depth * t[0].exp();
    let w = t[1].exp() / c.scales.duration;
    let m = k / (w * w);
    (k, m, 2.0 * t[2].exp() * m * w)
}

fn forms(c: &Context) -> Vec<Form> {
    if c.kind == Kind::Indentation {
        return Vec::new();
    }
    vec![Form {
        label: "mass on a spring",
        parameters: vec![
            parameter("ln stiffness", -0.7, 8.5, 2e-2),
            parameter("ln frequency", 0.0, 4.5, 2e-2),
            parameter("ln damping", -6.0, 0.5, 5e-2),
        ],
        starts: grid(&[&[0.7, 2.0, 3.3, 4.6], &[1.1, 1.7, 2.2, 2.7, 3.4], &[-3.5, -1.5]]),
        linear: false,
        apply: |t, c, p| {
            let (k, m, d) = base(t, c);
            p.base_stiffness = k;
            p.base_mass = m;
            p.base_damping = d;
        },
        describe: |t, c| {
            let (k, m, d) = base(t, c);
            vec![("base_stiffness", k, "N/m"), ("base_mass", m, "kg"), ("base_damping", d, "N s/m")]
        },
    }]
}
