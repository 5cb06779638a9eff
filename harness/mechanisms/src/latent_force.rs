//! latent_force: a force of depth alone that no mechanism known has

use crate::constants::SLIP_SPEED;
use crate::mechanism::*;
use crate::part::Part;

/// F = d(x), or d(x) sign(v), on knots (non-parametric residual force).
pub const MECHANISM: Mechanism = Mechanism {
    name: "latent_force",
    origin: Origin::Contact,
    named: false,
    equation: "F = d(x), or d(x) sign(v), on knots",
    source: "non-parametric residual force",
    sentence: "a force of depth alone that no mechanism known has",
    cure: "No mechanism known explains it; the report shows the force it takes.",
    forms,
    acts: Acts::Reading,
    hints: Hints { is_flexible: true, ..Hints::PLAIN },
};

/// Number of knots.
pub const KNOTS: usize = 8;

/// Sign of the speed `v`, m/s, with the jump made a ramp over [`SLIP_SPEED`].
#[inline]
pub fn against(v: f64) -> f64 {
    (v / SLIP_SPEED).clamp(-1.0, 1.0)
}

/// A force of depth on knots.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LatentForce {
    /// N at the knots, evenly over 0..span; 0 at the surface.
    pub knots: [f64; KNOTS],
    /// m.
    pub span: f64,
    /// Whether it acts against the motion, rather than of position alone.
    pub dissipative: bool,
}

impl Default for LatentForce {
    fn default() -> Self {
        LatentForce { knots: [0.0; KNOTS], span: 1.0, dissipative: false }
    }
}

impl Part for LatentForce {
    #[inline]
    fn acts_on_face(&self) -> bool {
        self.knots.iter().any(|a| *a != 0.0)
    }
    #[inline]
    fn on_face(&self, x: f64, v: f64, f: f64) -> f64 {
        if x <= 0.0 || self.span <= 0.0 || !self.acts_on_face() {
            return f;
        }
        let s = (x / self.span * KNOTS as f64).min(KNOTS as f64);
        let i = s.floor() as usize;
        let at = |i: usize| if i == 0 { 0.0 } else { self.knots[(i - 1).min(KNOTS - 1)] };
        let u = s - i as f64;
        let l = at(i) * (1.0 - u) + at(i + 1) * u;
        f + if self.dissipative { l * against(v) } else { l }
    }
}

const NAMES: [&str; KNOTS] = ["knot_1", "knot_2", "knot_3", "knot_4", "knot_5", "knot_6", "knot_7", "knot_8"];

fn latent(t: &[f64], c: &Context, p: &mut crate::physics::Physics, dissipative: bool) {
    for (a, b) in p.latent_force.knots.iter_mut().zip(t) {
        *a = b * c.scales.force;
    }
    p.latent_force.span = 2.0 * c.scales.depth;
    p.latent_force.dissipative = dissipative;
}

fn forms(_: &Context) -> Vec<Form> {
    let form = |label, apply: Apply| Form {
        label,
        parameters: (0..KNOTS).map(|i| parameter(&format!("knot {}", i + 1), -2.0, 2.0, 1e-3)).collect(),
        starts: vec![vec![1e-3; KNOTS]],
        linear: false,
        extends: None,
        apply,
        describe: |t, c| NAMES.iter().zip(t).map(|(n, a)| (*n, a * c.scales.force, "N")).collect(),
    };

    vec![
        form("conservative", |t, c, p| latent(t, c, p, false)),
        form("against the motion", |t, c, p| latent(t, c, p, true)),
    ]
}
