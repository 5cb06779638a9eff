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
    cure: "The contact element is right; add this to the rig's model.",
    forms,
    acts: Acts::Push,
};

fn forms(c: &Context) -> Vec<Form> {
    if c.kind == Kind::Indentation {
        return Vec::new();
    }
    vec![Form {
        label: "mass on a spring",
        parameters: vec![parameter("ln stiffness", -0.5, 8.5, 2e-2), parameter("ln mass", -3.0, 3.0, 2e-2), parameter("ln damping", -6.0, 0.0, 5e-2)],
        starts: grid(&[&[0.7, 2.0, 3.3, 4.6], &[-1.5, -0.3, 1.0], &[-4.0, -2.0]]),
        linear: false,
        apply: |t, c, p| {
            p.base_stiffness = c.scales.force / c.scales.depth * t[0].exp();
            p.base_mass = c.scales.mass * t[1].exp();
            p.base_damping = 2.0 * t[2].exp() * (p.base_stiffness * p.base_mass).sqrt();
        },
        describe: |t, c| {
            let (k, m) = (c.scales.force / c.scales.depth * t[0].exp(), c.scales.mass * t[1].exp());
            vec![("base_stiffness", k, "N/m"), ("base_mass", m, "kg"), ("base_damping", 2.0 * t[2].exp() * (k * m).sqrt(), "N s/m")]
        },
    }]
}
