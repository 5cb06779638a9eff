//! jam: the motion is resisted at one place

use crate::mechanism::*;

/// F = a sign(v) exp(-((x - x0)/w)^2/2) (a tight place in the guide).
pub const MECHANISM: Mechanism = Mechanism {
    name: "jam",
    origin: Origin::Motion,
    named: false,
    equation: "F = a sign(v) exp(-((x - x0)/w)^2/2)",
    source: "a tight place in the guide",
    sentence: "the motion is resisted at one place",
    cure: "No mechanism known explains it; the report shows the force it takes.",
    forms,
    acts: Acts::Reading,
};

fn forms(_: &Context) -> Vec<Form> {
    vec![Form {
        label: "bump of resistance",
        parameters: vec![
            parameter("force", 0.0, 1.0, 1e-3),
            parameter("position", -2.0, 2.0, 5e-3),
            parameter("ln width", -3.5, 0.0, 2e-2),
        ],
        starts: grid(&[&[0.02], &[-0.5, 0.1, 0.35, 0.6, 0.9, 1.2], &[-2.0]]),
        linear: true,
        extends: None,
        apply: |t, c, p| {
            p.jam_force = t[0] * c.scales.force;
            p.jam_position = t[1] * c.scales.depth;
            p.jam_width = c.scales.depth * t[2].exp();
        },
        describe: |t, c| {
            vec![
                ("jam_force", t[0] * c.scales.force, "N"),
                ("jam_position", t[1] * c.scales.depth, "m"),
                ("jam_width", c.scales.depth * t[2].exp(), "m"),
            ]
        },
    }]
}
