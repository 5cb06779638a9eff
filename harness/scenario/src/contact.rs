//! The contact of a scenario: every parameter of the law by its name, or stiffness from two faces.

use law::stiffness::{half_space, rectangular_faces};
use law::Parameters;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Key at fault, and the cure.
pub type Fault = (&'static str, String);

/// Two flat rectangular faces that meet (Ahn and Ryu 2005, eq. 7). Each pair is the two sides' material.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Faces {
    /// Half of one side, m, > 0.
    pub a: f64,
    /// Half of the other side, m, > 0.
    pub b: f64,
    /// Young's moduli, Pa, > 0.
    pub youngs_modulus: [f64; 2],
    /// Poisson's ratios, -1 to 0.5.
    pub poisson_ratio: [f64; 2],
}

impl Faces {
    /// Stiffness, N/m.
    ///
    /// # Errors
    /// The key at fault and the cure.
    pub fn stiffness(&self) -> Result<f64, Fault> {
        if !self.youngs_modulus.iter().all(|e| e.is_finite() && *e > 0.0) {
            return Err(("youngs_modulus", "two moduli above 0, in Pa".into()));
        }
        if !self.poisson_ratio.iter().all(|n| (-1.0..=0.5).contains(n)) {
            return Err(("poisson_ratio", "two ratios from -1 to 0.5".into()));
        }
        let h = |i: usize| half_space(self.youngs_modulus[i], self.poisson_ratio[i]);
        rectangular_faces(self.a, self.b, h(0), h(1)).ok_or(("a", "half sides a and b above 0, in m".into()))
    }
}

/// Names of an FMU's variables; absent: those of our own.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variables {
    /// Input, a length, positive into the stop.
    pub penetration: Option<String>,
    /// Input, a speed; empty where the FMU takes none.
    pub velocity: Option<String>,
    /// Output, a force, positive in compression.
    pub force: Option<String>,
}

macro_rules! contact {
    ($($(#[$doc:meta])* $name:ident: $type:ty,)*) => {
        /// The contact's parameters by the names of the FMU's contract; what is absent is neutral.
        #[derive(Clone, Debug, Default, Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct Contact {
            /// What to call it where it stands beside others.
            pub name: Option<String>,
            /// FMU to use, a path from the scenario's folder; absent: our own. It gets the parameters given here,
            /// no others; `stiffness` and `exponent` may then be absent.
            pub fmu: Option<PathBuf>,
            /// Names of that FMU's variables.
            #[serde(default)]
            pub variables: Variables,
            /// Further parameters of that FMU by its own names.
            #[serde(default)]
            pub parameters: BTreeMap<String, f64>,
            /// Hold that FMU's force over macro-steps of this length, s, > 0; absent: it answers at once, or its
            /// steps are tried out and taken back.
            pub macro_step: Option<f64>,
            /// Faces whose theoretical stiffness is taken, p = 1, instead of `stiffness` and `exponent`.
            pub faces: Option<Faces>,
            $($(#[$doc])* pub $name: Option<$type>,)*
        }

        impl Contact {
            /// Names of the law's parameters.
            pub const NAMES: &'static [&'static str] = &[$(stringify!($name)),*];

            fn over(&self, mut p: Parameters) -> Parameters {
                $(if let Some(v) = self.$name { p.$name = v; })*
                p
            }

            /// Parameters of the law that are given, by name.
            pub fn given(&self) -> Vec<(String, f64)> {
                let mut all = Vec::new();
                $(if let Some(v) = self.$name { all.push((stringify!($name).to_string(), f64::from(v))); })*
                all
            }
        }

        /// Every parameter of a law, by name.
        pub fn named(p: &Parameters) -> Vec<(String, f64)> {
            vec![$((stringify!($name).to_string(), f64::from(p.$name))),*]
        }
    };
}

contact! {
    /// k, N/m^p.
    stiffness: f64,
    /// p.
    exponent: f64,
    /// mu_d, N s/m^(p+o+1).
    hysteresis_damping: f64,
    /// Offset o of the damping's power of x from p.
    damping_exponent_offset: f64,
    /// Speed at which shear thinning has halved mu_d, m/s.
    hysteresis_thinning_speed: f64,
    /// c, N s/m.
    viscous_damping: f64,
    /// Depth over which c ramps in, m.
    viscous_ramp: f64,
    /// Speed at which shear thinning has halved c, m/s.
    viscous_thinning_speed: f64,
    /// Penetration at first yield, m.
    yield_penetration: f64,
    /// Permanent set per metre beyond yield.
    plastic_ratio: f64,
    /// 0 permanent set, 1 Walton and Braun, 2 Thornton.
    plastic_form: i32,
    /// Power of the unloading curve.
    plastic_unloading_exponent: f64,
    /// 0 the damping keeps its power, 1 it follows the plastic branch.
    plastic_damping_form: i32,
    /// Pull-off force, N.
    adhesion_force: f64,
    /// Range of the pull, m.
    adhesion_range: f64,
    /// 0 contact, 1 neck, 2 reach, 3 leaving, 4 growing.
    adhesion_form: i32,
    /// Depth over which the pull of forms 1 and 3 fades, m.
    adhesion_depth: f64,
    /// Stiffness of the Maxwell branches, N/m^q.
    relaxation_stiffness: f64,
    /// Middle relaxation time, s.
    relaxation_time: f64,
    /// Decades between the relaxation times.
    relaxation_spread: f64,
    /// Power q the branches hang on.
    relaxation_exponent: f64,
    /// Stiffness of the second layer, N/m^r.
    secondary_stiffness: f64,
    /// Depth of the second layer, m.
    secondary_depth: f64,
    /// Power of the second layer.
    secondary_exponent: f64,
    /// Depth over which the second layer comes to act, m.
    secondary_width: f64,
}

impl Contact {
    /// The law's parameters.
    ///
    /// # Errors
    /// The key at fault and the cure.
    pub fn parameters(&self) -> Result<Parameters, Fault> {
        let mut p = self.over(Parameters::default());
        if self.fmu.is_none() {
            let alone = |key, empty: bool| if empty { Ok(()) } else { Err((key, "it with fmu only".to_string())) };
            alone("variables", self.variables == Variables::default())?;
            alone("parameters", self.parameters.is_empty())?;
        }
        if self.macro_step.is_some_and(|h| !(h.is_finite() && h > 0.0)) {
            return Err(("macro_step", "a time above 0, in s, or leave it out".into()));
        }
        match (&self.faces, self.stiffness, self.exponent) {
            (Some(_), Some(_), _) => return Err(("faces", "either stiffness or faces, not both".into())),
            (Some(f), None, e) => {
                if e.is_some_and(|e| e != 1.0) {
                    return Err(("exponent", "1, or leave it out: two flat faces are a linear spring".into()));
                }
                p.stiffness = f.stiffness()?;
                p.exponent = 1.0;
            }
            (None, _, _) if self.fmu.is_some() => {}
            (None, None, _) => return Err(("stiffness", "k in N/m^p, or faces = { a, b, .. }".into())),
            (None, _, None) => return Err(("exponent", "p, 0.5 to 5".into())),
            _ => {}
        }
        p.validate().map_err(|e| (e.name, e.expected.to_string()))?;
        Ok(p)
    }
}

/// Whether a law is F = k x^p + mu_d x^p v alone, whose free impact is known exactly.
pub fn is_plain(law: &Parameters) -> bool {
    law.viscous_damping == 0.0
        && law.plastic_ratio == 0.0
        && law.adhesion_force == 0.0
        && law.relaxation_stiffness == 0.0
        && law.secondary_stiffness == 0.0
        && (law.damping_exponent_offset == 0.0 && law.hysteresis_thinning_speed == 0.0 || law.hysteresis_damping == 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_of_the_law_can_be_given() {
        let shown = format!("{:?}", Parameters::default());
        let inner = shown.trim_start_matches("Parameters { ").trim_end_matches(" }");
        let fields: Vec<&str> = inner.split(", ").filter_map(|f| f.split(':').next()).collect();
        assert_eq!(fields, Contact::NAMES);
    }

    #[test]
    fn faces_give_equation_7_and_exclude_a_stiffness() {
        let f = Faces { a: 2e-3, b: 2e-3, youngs_modulus: [200e9; 2], poisson_ratio: [0.3; 2] };
        let mut c = Contact { faces: Some(f.clone()), ..Contact::default() };
        let p = c.parameters().unwrap();
        assert_eq!(p.exponent, 1.0);
        assert!((p.stiffness - f.stiffness().unwrap()).abs() == 0.0 && p.stiffness > 4e8);
        c.stiffness = Some(1.0);
        assert_eq!(c.parameters().unwrap_err().0, "faces");
    }
}
