//! secondary_stiffening: a second stop or layer takes part from some depth on

use crate::mechanism::*;

/// F = k2 (x - d)^q beyond d (two springs in series of onset; Goldsmith 1960), d of one depth or spread evenly over a
/// width (rough faces, after Greenwood and Williamson 1966).
pub const MECHANISM: Mechanism = Mechanism {
    name: "secondary_stiffening",
    origin: Origin::Contact,
    named: true,
    equation: "F = k2 (x - d)^q beyond d",
    source: "two springs in series of onset; Goldsmith 1960; Greenwood and Williamson 1966 (onsets over a width)",
    sentence: "a second stop or layer takes part from some depth on",
    cure: "The element now holds it: import the FMU written beside this report.",
    forms,
    acts: Acts::Reading,
};

fn layer(t: &[f64], c: &Context, p: &mut crate::physics::Physics, power: f64) {
    p.law.secondary_stiffness = t[0] * c.scales.force / c.scales.depth.powf(power);
    p.law.secondary_depth = t[1] * c.scales.depth;
    p.law.secondary_exponent = power;
}

fn forms(_: &Context) -> Vec<Form> {
    let form = |label, apply: Apply| Form {
        label,
        parameters: vec![parameter("force", 0.0, 30.0, 2e-3), parameter("depth", 0.02, 3.0, 3e-3)],
        starts: grid(&[&[0.05], &[0.15, 0.4, 0.7, 1.0, 1.4]]),
        linear: true,
        extends: None,
        apply,
        describe: described,
    };
    let hertz = form("power 1.5", |t, c, p| layer(t, c, p, 1.5));
    let mut any = hertz.extended("any power", vec![parameter("power", 0.6, 4.0, 5e-3)], vec![vec![1.5]]);
    any.apply = |t, c, p| layer(t, c, p, t[2]);
    any.describe = |t, c| [described(t, c), vec![("secondary_exponent", t[2], "1")]].concat();
    let further = vec![parameter("power", 0.6, 4.0, 5e-3), parameter("width", 0.0, 2.0, 5e-3)];
    let mut gradual = hertz.extended("any power, over a width", further, vec![vec![1.0, 0.2], vec![1.5, 0.2]]);
    gradual.apply = |t, c, p| {
        layer(t, c, p, t[2]);
        p.law.secondary_width = t[3] * c.scales.depth;
    };
    gradual.describe = |t, c| {
        let further = vec![("secondary_exponent", t[2], "1"), ("secondary_width", t[3] * c.scales.depth, "m")];
        [described(t, c), further].concat()
    };
    vec![
        hertz,
        any,
        gradual,
        form("power 1", |t, c, p| layer(t, c, p, 1.0)),
        form("power 2.5", |t, c, p| layer(t, c, p, 2.5)),
    ]
}

fn described(t: &[f64], c: &Context) -> Vec<(&'static str, f64, &'static str)> {
    vec![("secondary_force_at_depth", t[0] * c.scales.force, "N"), ("secondary_depth", t[1] * c.scales.depth, "m")]
}
