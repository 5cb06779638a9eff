//! plastic_indentation: the surface keeps a permanent set and unloads steeper than it loaded

use crate::mechanism::*;
use record::Kind;

/// unloading from depth d along F(d) ((x - s)/(d - s))^n, set s = r (d - y) (Lankarani and Nikravesh 1994; Oliver and Pharr 1992; Walton and Braun 1986; Thornton 1997).
pub const MECHANISM: Mechanism = Mechanism {
    name: "plastic_indentation",
    origin: Origin::Contact,
    named: true,
    equation: "unloading from depth d along F(d) ((x - s)/(d - s))^n, set s = r (d - y)",
    source: "Lankarani and Nikravesh 1994; Oliver and Pharr 1992; Walton and Braun 1986; Thornton 1997",
    sentence: "the surface keeps a permanent set and unloads steeper than it loaded",
    cure: "The element now holds it: import the FMU written beside this report.",
    forms,
    acts: Acts::Reading,
};

fn forms(c: &Context) -> Vec<Form> {
    let yields = vec![parameter("ratio", 0.0, 0.97, 1e-3), parameter("yield", 0.0, 3.0, 2e-3)];
    let mut forms = vec![Form {
        label: "permanent set",
        parameters: yields.clone(),
        starts: grid(&[&[0.03], &[0.02, 0.4, 0.8, 1.3]]),
        linear: true,
        extends: None,
        apply: |t, c, p| {
            p.law.plastic_ratio = t[0];
            p.law.yield_penetration = t[1] * c.scales.depth;
            p.law.plastic_form = 0;
        },
        describe: |t, c| vec![("plastic_ratio", t[0], "1"), ("yield_penetration", t[1] * c.scales.depth, "m")],
    }];
    forms.push(Form {
        label: "Walton-Braun",
        // a chord that is hardly shorter than the way loses nothing: no small ratio leads anywhere
        starts: grid(&[&[0.15, 0.3, 0.6], &[0.02, 0.4, 0.8]]),
        linear: false,
        apply: |t, c, p| {
            p.law.plastic_ratio = t[0];
            p.law.yield_penetration = t[1] * c.scales.depth;
            p.law.plastic_form = 1;
        },
        ..forms[0].clone()
    });
    forms.push(Form {
        label: "Thornton",
        parameters: vec![parameter("yield", 0.02, 3.0, 2e-3)],
        starts: grid(&[&[0.3, 0.6, 0.9, 1.2, 1.5]]),
        linear: false,
        extends: None,
        apply: |t, c, p| {
            p.law.plastic_ratio = 0.5;
            p.law.yield_penetration = t[0] * c.scales.depth;
            p.law.plastic_form = 2;
        },
        describe: |t, c| vec![("yield_penetration", t[0] * c.scales.depth, "m")],
    });
    if c.kind == Kind::Indentation {
        forms.push(Form {
            label: "permanent set, unloading power free",
            parameters: vec![yields[0].clone(), yields[1].clone(), parameter("power", 1.0, 4.0, 1e-3)],
            starts: grid(&[&[0.05, 0.7], &[0.02], &[1.3, 1.8]]),
            linear: false,
            extends: None,
            apply: |t, c, p| {
                p.law.plastic_ratio = t[0];
                p.law.yield_penetration = t[1] * c.scales.depth;
                p.law.plastic_form = 0;
                p.law.plastic_unloading_exponent = t[2];
            },
            describe: |t, c| {
                vec![
                    ("plastic_ratio", t[0], "1"),
                    ("yield_penetration", t[1] * c.scales.depth, "m"),
                    ("plastic_unloading_exponent", t[2], "1"),
                ]
            },
        });
    }
    forms
}
