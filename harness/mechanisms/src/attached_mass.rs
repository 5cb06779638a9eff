//! attached_mass: a sprung mass rides on the body

use crate::mechanism::*;
use crate::part::Part;
use crate::physics::Physics;

/// m_a z'' = -k_a z (1 + h z^2) - c_a z' - m_a x'' for its place z before the body (Den Hartog 1934; Harris and Piersol
/// 2002, chapter 6, on equipment that rides on a table).
pub const MECHANISM: Mechanism = Mechanism {
    name: "attached_mass",
    origin: Origin::Motion,
    named: true,
    equation: "m_a z'' = -k_a z (1 + h z^2) - c_a z' - m_a x''",
    source: "Den Hartog 1934; Harris and Piersol 2002, chapter 6",
    sentence: "a mass rides on the body on a spring of its own",
    cure: "The contact element is right; in the rig's model hang the mass given here on the body by its spring and damper.",
    forms,
    acts: Acts::Rider,
    hints: Hints { strongly_nonlinear: true, rings: true, ..Hints::PLAIN },
};

/// A mass on a spring and a damper on the body, taken out of the moving mass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AttachedMass {
    /// kg; 0: none.
    pub mass: f64,
    /// Stiffness k_a of its spring, N/m.
    pub stiffness: f64,
    /// Damping c_a, N s/m.
    pub damping: f64,
    /// Hardening h of the spring, 1/m^2, >= 0.
    pub hardening: f64,
}

impl Part for AttachedMass {
    const RIDES: bool = true;

    #[inline]
    fn riding_mass(&self) -> f64 {
        self.mass
    }
    #[inline]
    fn riding_force(&self, z: f64, w: f64) -> f64 {
        self.stiffness * (1.0 + self.hardening * z * z) * z + self.damping * w
    }
}

/// The mass, its spring and damper from their logarithms: mass over the moving mass, frequency times the contact's
/// duration, damping ratio.
fn attached(t: &[f64], c: &Context) -> AttachedMass {
    let (mass, w) = (c.scales.mass * t[0].exp(), t[1].exp() / c.scales.duration);
    AttachedMass { mass, stiffness: mass * w * w, damping: 2.0 * t[2].exp() * mass * w, hardening: 0.0 }
}

/// h of the share by which the spring has hardened, to first order, where the body's deceleration holds the mass.
fn hardening(t: &[f64], c: &Context) -> f64 {
    let a = attached(t, c);
    let held = c.scales.force / c.scales.mass * a.mass / a.stiffness;
    t[3] / (held * held)
}

fn described(t: &[f64], c: &Context) -> Vec<(&'static str, f64, &'static str)> {
    let a = attached(t, c);
    vec![
        ("attached_mass", a.mass, "kg"),
        ("attached_stiffness", a.stiffness, "N/m"),
        ("attached_damping", a.damping, "N s/m"),
    ]
}

fn put(t: &[f64], c: &Context, p: &mut Physics) {
    p.attached_mass = attached(t, c);
}

fn forms(c: &Context) -> Vec<Form> {
    if c.is_imposed() {
        return Vec::new();
    }
    let linear = Form {
        label: "linear spring",
        parameters: vec![
            parameter("ln mass", -6.0, -0.35, 2e-2),
            // softer than this it would not be felt during the contact, stiffer it would be one with the body
            parameter("ln frequency", -0.5, 4.5, 2e-2),
            parameter("ln damping", -6.0, 0.5, 5e-2),
        ],
        starts: grid(&[&[-3.5, -1.8], &[0.5, 1.2, 1.8, 2.4, 3.1, 3.8], &[-2.5]]),
        linear: false,
        extends: None,
        apply: put,
        describe: described,
    };
    let mut hard = linear.extended("hardening spring", vec![parameter("hardening", 0.0, 10.0, 1e-2)], vec![vec![0.3]]);
    hard.apply = |t, c, p| {
        put(t, c, p);
        p.attached_mass.hardening = hardening(t, c);
    };
    hard.describe = |t, c| [described(t, c), vec![("attached_hardening", hardening(t, c), "1/m^2")]].concat();
    vec![linear, hard]
}
