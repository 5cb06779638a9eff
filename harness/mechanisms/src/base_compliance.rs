//! base_compliance: the stop itself moves on a spring

use crate::mechanism::*;
use crate::part::Part;

/// m_b x_b'' = F - k_b x_b (1 + h x_b^2) - c_b x_b' (Den Hartog 1934); softening, k_b x_b/sqrt(1 + 2 |h| x_b^2), which
/// begins alike and never turns back.
pub const MECHANISM: Mechanism = Mechanism {
    name: "base_compliance",
    origin: Origin::Motion,
    named: true,
    equation: "m_b x_b'' = F - k_b x_b (1 + h x_b^2) - c_b x_b'",
    source: "Den Hartog 1934",
    sentence: "the stop itself moves on a spring",
    cure: "The contact element is right; in the rig's model put the stop on the mass, spring and damper given here.",
    forms,
    acts: Acts::Push,
    hints: Hints { strongly_nonlinear: true, ..Hints::PLAIN },
};

/// The stop on a spring.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BaseCompliance {
    /// Mass of the stop, kg; 0: rigid.
    pub mass: f64,
    /// Stiffness of its spring, N/m.
    pub stiffness: f64,
    /// Damping, N s/m.
    pub damping: f64,
    /// Hardening h, 1/m^2: the stiffness grows by 1 + h u^2; where h is negative it falls by 1/sqrt(1 - 2 h u^2).
    pub hardening: f64,
    /// Whether the force channel reads that spring: the transducer is what the stop stands on.
    pub reads: bool,
}

impl BaseCompliance {
    /// Force of spring and damper, N, at a deflection of `u` m that grows by `w` m/s.
    #[inline]
    pub fn force(&self, u: f64, w: f64) -> f64 {
        let h = self.hardening * u * u;
        let growth = if h < 0.0 { 1.0 / (1.0 - 2.0 * h).sqrt() } else { 1.0 + h };
        self.stiffness * growth * u + self.damping * w
    }

    /// Share of an approach of `depth`, m, that a stop standing on the transducer's far side takes of a contact of `force`,
    /// N, and `duration`, s; held by its spring, and by its inertia for as long as the contact lasts. None where the stop is
    /// rigid, or its spring is what the force channel reads.
    pub fn share_of_approach(&self, force: f64, depth: f64, duration: f64) -> Option<f64> {
        let held = self.stiffness + self.mass * (std::f64::consts::PI / duration).powi(2);
        (self.stiffness > 0.0 && !self.reads).then_some(force / held / depth)
    }
}

impl Part for BaseCompliance {
    #[inline]
    fn needs_integration(&self) -> bool {
        self.hardening != 0.0
    }
}

/// Logarithm of the damping ratio up to which a hardening spring is distinguished from damping in the contact: a stop that does
/// not swing only gives way and takes energy.
const MOST_DAMPED: f64 = -1.2;

/// (stiffness N/m, mass kg, damping N s/m) from their logarithms' parameters.
fn base(t: &[f64], c: &Context) -> (f64, f64, f64) {
    let k = c.scales.force / c.scales.depth * t[0].exp();
    let w = t[1].exp() / c.scales.duration;
    let m = k / (w * w);
    (k, m, 2.0 * t[2].exp() * m * w)
}

fn forms(c: &Context) -> Vec<Form> {
    if c.is_imposed() {
        return Vec::new();
    }
    let mass_on_spring = Form {
        label: "mass on a spring",
        parameters: vec![
            parameter("ln stiffness", -0.7, 8.5, 2e-2),
            parameter("ln frequency", 0.0, 4.5, 2e-2),
            parameter("ln damping", -6.0, 0.5, 5e-2),
        ],
        starts: grid(&[&[0.0, 0.7, 2.0, 3.3, 4.6], &[1.1, 1.7, 2.2, 2.7, 3.4], &[-3.5, -1.5]]),
        linear: false,
        extends: None,
        apply: on_spring,
        describe: described,
    };
    let mut hardening = mass_on_spring.clone();
    hardening.label = "mass on a hardening spring";
    hardening.parameters[2].upper = MOST_DAMPED;
    // the share by which the spring has stiffened where the impact's force holds it
    hardening.parameters.push(parameter("hardening", 0.0, 10.0, 1e-2));
    hardening.starts = grid(&[&[0.0, 1.0, 2.0], &[0.7, 1.5, 2.3], &[-2.5], &[0.5]]);
    hardening.apply = |t, c, p| {
        on_spring(t, c, p);
        p.base_compliance.hardening = growth(t, c);
    };
    hardening.describe = |t, c| [described(t, c), vec![("base_hardening", growth(t, c), "1/m^2")]].concat();
    let mut softening = mass_on_spring.extended(
        "mass on a softening spring",
        vec![parameter("softening", 0.0, 3.0, 1e-2)],
        grid(&[&[0.1, 0.4]]),
    );
    softening.apply = |t, c, p| {
        on_spring(t, c, p);
        p.base_compliance.hardening = -growth(t, c);
    };
    softening.describe = |t, c| [described(t, c), vec![("base_hardening", -growth(t, c), "1/m^2")]].concat();
    vec![mass_on_spring, hardening, softening]
}

/// |h|, 1/m^2, of the share by which the spring has hardened or softened, to first order, where the impact's force
/// holds it.
fn growth(t: &[f64], c: &Context) -> f64 {
    let held = c.scales.depth / t[0].exp();
    t[3] / (held * held)
}

fn on_spring(t: &[f64], c: &Context, p: &mut crate::physics::Physics) {
    let (k, m, d) = base(t, c);
    p.base_compliance.stiffness = k;
    p.base_compliance.mass = m;
    p.base_compliance.damping = d;
}

fn described(t: &[f64], c: &Context) -> Vec<(&'static str, f64, &'static str)> {
    let (k, m, d) = base(t, c);
    vec![("base_stiffness", k, "N/m"), ("base_mass", m, "kg"), ("base_damping", d, "N s/m")]
}
