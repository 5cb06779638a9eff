//! fluid_drag: the surrounding fluid drags on the body with the square of its speed

use crate::mechanism::*;
use crate::part::{Allowed, Key, Motion, Part};
use record::Kind;

/// F = -c v |v|^(n-1), n near 2 (Newton 1687; Rayleigh 1876), c falling to a share of itself where the boundary layer
/// turns turbulent (Achenbach 1972).
pub const MECHANISM: Mechanism = Mechanism {
    name: "fluid_drag",
    origin: Origin::Motion,
    named: true,
    equation: "F = -c v |v|^(n-1), n near 2",
    source: "Newton 1687; Rayleigh 1876; Achenbach 1972 (the crisis)",
    sentence: "the surrounding fluid drags on the body with the square of its speed",
    cure: "The contact element is right; add this drag to the body's motion in the rig's model.",
    forms,
    acts: Acts::Force,
    hints: Hints::PLAIN,
};

/// Drag of the surrounding fluid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluidDrag {
    /// Drag c at 1 m/s, N.
    pub coefficient: f64,
    /// Power n of the speed.
    pub power: f64,
    /// Drag on the way back over that on the way in: the body flies through its own wake.
    pub back: f64,
    /// Speed about which the boundary layer turns turbulent, m/s; None: it does not.
    pub crisis_speed: Option<f64>,
    /// Share of the drag left beyond that speed.
    pub beyond: f64,
}

impl Default for FluidDrag {
    fn default() -> Self {
        FluidDrag { coefficient: 0.0, power: 2.0, back: 1.0, crisis_speed: None, beyond: 1.0 }
    }
}

impl FluidDrag {
    /// The share of the drag left at the speed `v`, m/s: from 1 far below the crisis to `beyond` far above it, half of
    /// the way at it.
    fn past_crisis(&self, crisis_speed: f64, v: f64) -> f64 {
        let u = (v / crisis_speed).powi(2);
        let u = u * u;
        self.beyond + (1.0 - self.beyond) / (1.0 + u * u)
    }
}

impl Part for FluidDrag {
    const KEYS: &'static [Key<Self>] = &[
        Key { name: "drag", unit: "N s^2/m^2", allowed: Allowed::FromZero, put: |p, v| p.coefficient = v },
        Key { name: "drag_power", unit: "1", allowed: Allowed::AboveZero, put: |p, v| p.power = v },
        Key { name: "drag_back", unit: "1", allowed: Allowed::FromZero, put: |p, v| p.back = v },
        Key { name: "drag_beyond", unit: "1", allowed: Allowed::FromZero, put: |p, v| p.beyond = v },
        Key {
            name: "drag_crisis_speed",
            unit: "m/s",
            allowed: Allowed::AboveZero,
            put: |p, v| p.crisis_speed = Some(v),
        },
    ];

    #[inline]
    fn on_body(&self, at: &Motion, f: f64) -> f64 {
        if self.coefficient == 0.0 {
            return f;
        }
        let v = at.v;
        let way = if v < 0.0 { self.back } else { 1.0 };
        let way = self.crisis_speed.map_or(way, |s| way * self.past_crisis(s, v));
        f - way * self.coefficient * v * if self.power == 2.0 { v.abs() } else { v.abs().powf(self.power - 1.0) }
    }
}

/// Coefficient of the quadratic drag, N s^2/m^2.
fn square(t: &[f64], c: &Context) -> f64 {
    t[0] * c.scales.force / (c.scales.speed * c.scales.speed)
}

fn forms(c: &Context) -> Vec<Form> {
    if c.kind == Kind::Indentation {
        return Vec::new();
    }
    let quadratic = Form {
        label: "quadratic",
        parameters: vec![parameter("drag", 0.0, 5.0, 2e-4)],
        starts: vec![vec![0.01]],
        linear: true,
        extends: None,
        apply: |t, c, p| p.fluid_drag.coefficient = square(t, c),
        describe: |t, c| vec![("drag", square(t, c), "N s^2/m^2")],
    };
    // between the regimes of a sphere or a plate the power lies a little off two
    let near = Form {
        label: "near two as power",
        parameters: vec![parameter("drag", 0.0, 5.0, 2e-4), parameter("power", 1.6, 2.4, 5e-3)],
        starts: grid(&[&[0.01], &[1.8, 2.2]]),
        linear: true,
        extends: None,
        apply: |t, c, p| {
            p.fluid_drag.coefficient = t[0] * c.scales.force / c.scales.speed.powf(t[1]);
            p.fluid_drag.power = t[1];
        },
        describe: |t, c| {
            vec![("drag", t[0] * c.scales.force / c.scales.speed.powf(t[1]), "N (s/m)^n"), ("drag_power", t[1], "1")]
        },
    };
    let mut wake = quadratic.extended(
        "quadratic, otherwise on the way back",
        vec![parameter("back", 0.0, 4.0, 5e-3)],
        vec![vec![1.0]],
    );
    wake.apply = |t, c, p| {
        p.fluid_drag.coefficient = square(t, c);
        p.fluid_drag.back = t[1];
    };
    wake.describe = |t, c| vec![("drag", square(t, c), "N s^2/m^2"), ("drag_back", t[1], "1")];
    let mut crisis = quadratic.extended(
        "quadratic, less beyond a speed",
        vec![parameter("beyond", 0.05, 1.0, 5e-3), parameter("ln crisis speed", -1.5, 1.0, 1e-2)],
        grid(&[&[0.5], &[-0.4, 0.0]]),
    );
    crisis.apply = |t, c, p| {
        p.fluid_drag.coefficient = square(t, c);
        (p.fluid_drag.beyond, p.fluid_drag.crisis_speed) = (t[1], Some(c.scales.speed * t[2].exp()));
    };
    crisis.describe = |t, c| {
        vec![
            ("drag", square(t, c), "N s^2/m^2"),
            ("drag_beyond", t[1], "1"),
            ("drag_crisis_speed", c.scales.speed * t[2].exp(), "m/s"),
        ]
    };
    vec![quadratic, near, wake, crisis]
}
