//! squeeze_film: a cushion of fluid builds up as the gap closes

use crate::mechanism::*;
use crate::part::{Allowed, Key, Motion, Part};

/// F = -c v (g/(gap + g))^n (Reynolds 1886; Stefan 1874).
pub const MECHANISM: Mechanism = Mechanism {
    name: "squeeze_film",
    origin: Origin::Motion,
    named: true,
    equation: "F = -c v (g/(gap + g))^n",
    source: "Reynolds 1886; Stefan 1874",
    sentence: "a cushion of fluid builds up as the gap closes",
    cure: "The contact element is right; add this film's force before touch to the rig's model.",
    forms,
    acts: Acts::Force,
    hints: Hints::PLAIN,
};

pub use law::body::SqueezeFilm;

impl Part for SqueezeFilm {
    const KEYS: &'static [Key<Self>] = &[
        Key { name: "squeeze_film", unit: "N s/m", allowed: Allowed::FromZero, put: |p, v| p.coefficient = v },
        Key { name: "squeeze_gap", unit: "m", allowed: Allowed::AboveZero, put: |p, v| p.gap = v },
        Key { name: "squeeze_power", unit: "1", allowed: Allowed::AboveZero, put: |p, v| p.power = v },
    ];

    #[inline]
    fn on_body(&self, at: &Motion, f: f64) -> f64 {
        self.on(at.x, at.v, f)
    }
    #[inline]
    fn needs_integration(&self) -> bool {
        self.coefficient != 0.0
    }
    #[inline]
    fn on_transducer(&self, at: &Motion, f: f64) -> f64 {
        f + if self.reads { self.force(at.x, at.v) } else { 0.0 }
    }
}

fn film(t: &[f64], c: &Context, p: &mut crate::physics::Physics, power: f64) {
    p.squeeze_film.coefficient = t[0] * c.scales.force / c.scales.speed;
    p.squeeze_film.gap = c.scales.depth * t[1].exp();
    p.squeeze_film.power = power;
}

fn beside(t: &[f64], c: &Context, p: &mut crate::physics::Physics, power: f64) {
    film(t, c, p, power);
    p.squeeze_film.reads = false;
}

fn forms(c: &Context) -> Vec<Form> {
    if c.is_imposed() {
        return Vec::new();
    }
    let form = |label, apply: Apply| Form {
        label,
        parameters: vec![parameter("c", 0.0, 5.0, 5e-4), parameter("ln gap", -3.5, 3.0, 2e-2)],
        starts: grid(&[&[0.02], &[-1.5, 0.0, 1.2]]),
        linear: true,
        extends: None,
        apply,
        describe: |t, c| {
            vec![
                ("squeeze_film", t[0] * c.scales.force / c.scales.speed, "N s/m"),
                ("squeeze_gap", c.scales.depth * t[1].exp(), "m"),
            ]
        },
    };
    vec![
        Form {
            label: "free power",
            parameters: vec![
                parameter("c", 0.0, 5.0, 5e-4),
                parameter("ln gap", -3.5, 3.0, 2e-2),
                parameter("power", 0.3, 12.0, 2e-2),
            ],
            starts: grid(&[&[0.02], &[-0.5, 0.8], &[2.0]]),
            linear: true,
            extends: None,
            apply: |t, c, p| film(t, c, p, t[2]),
            describe: |t, c| {
                vec![
                    ("squeeze_film", t[0] * c.scales.force / c.scales.speed, "N s/m"),
                    ("squeeze_gap", c.scales.depth * t[1].exp(), "m"),
                    ("squeeze_power", t[2], "1"),
                ]
            },
        },
        form("first power", |t, c, p| film(t, c, p, 1.0)),
        form("second power", |t, c, p| film(t, c, p, 2.0)),
        form("third power", |t, c, p| film(t, c, p, 3.0)),
        // a transducer on the body's side of the film, or under a part of the stop only, feels none of it
        form("first power, beside the transducer", |t, c, p| beside(t, c, p, 1.0)),
        form("second power, beside the transducer", |t, c, p| beside(t, c, p, 2.0)),
        form("third power, beside the transducer", |t, c, p| beside(t, c, p, 3.0)),
    ]
}
