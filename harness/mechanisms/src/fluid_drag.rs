//! fluid_drag: the surrounding fluid drags on the body with the square of its speed

use crate::mechanism::*;
use crate::part::{Allowed, Key, Motion, Part};

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

pub use law::body::FluidDrag;

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
        self.on(at.v, f)
    }
}

/// Coefficient of the quadratic drag, N s^2/m^2.
fn square(t: &[f64], c: &Context) -> f64 {
    t[0] * c.scales.force / (c.scales.speed * c.scales.speed)
}

fn forms(c: &Context) -> Vec<Form> {
    if c.is_imposed() {
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
