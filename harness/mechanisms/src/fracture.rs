//! fracture: the contact loses part of its force once a load is passed

use crate::mechanism::*;
use crate::part::Part;

/// F -> (1 - q) F once the load has passed F_c (brittle damage; Griffith 1921).
pub const MECHANISM: Mechanism = Mechanism {
    name: "fracture",
    origin: Origin::Contact,
    named: false,
    equation: "F -> (1 - q) F once the load has passed F_c",
    source: "brittle damage; Griffith 1921",
    sentence: "the contact loses part of its force once a load is passed",
    cure: "No mechanism known explains it; the report shows the force it takes.",
    forms,
    acts: Acts::Reading,
    hints: Hints::PLAIN,
};

/// A crack that opens at a load.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fracture {
    /// Load F_c, N; infinite: none.
    pub load: f64,
    /// Share q of the contact force lost then.
    pub drop: f64,
}

impl Default for Fracture {
    fn default() -> Self {
        Fracture { load: f64::INFINITY, drop: 0.0 }
    }
}

impl Part for Fracture {}

fn forms(_: &Context) -> Vec<Form> {
    vec![Form {
        label: "drop past a load",
        parameters: vec![parameter("drop", 0.0, 0.9, 2e-3), parameter("load", 0.02, 4.0, 5e-3)],
        starts: grid(&[&[0.05], &[0.3, 0.6, 1.0, 1.5]]),
        linear: true,
        extends: None,
        apply: |t, c, p| {
            p.fracture.drop = t[0];
            p.fracture.load = t[1] * c.scales.force;
        },
        describe: |t, c| vec![("fracture_drop", t[0], "1"), ("fracture_load", t[1] * c.scales.force, "N")],
    }]
}
