//! The variable table: what the modelDescription must say too.

use face::text;
pub use face::Kind;
use law::{part, parts, Parameters};

/// Name of the model, and of its shared library.
pub const MODEL: &str = "HysteresisContact";
/// Categories that are logged; the modelDescription lists the same.
pub const LOG_CATEGORIES: [&str; 4] = ["logStatusWarning", "logStatusDiscard", "logStatusError", "logContact"];
/// Number of parameters: the law's and the element's own.
pub const PARAMETERS: usize = parts::COUNT + OWN.len();

/// What a variable is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Penetration, m.
    Penetration,
    /// Velocity, m/s.
    Velocity,
    /// Force, N: feeds through.
    Force,
    /// Whether the surfaces touch: feeds through.
    Contact,
    /// Energy the contact could give back, J.
    StoredEnergy,
    /// Energy it has turned into heat and set, J.
    DissipatedEnergy,
    /// Deepest penetration so far, m.
    DeepestPenetration,
    /// Permanent set, m.
    PermanentSet,
    /// Step that resolves the contact, s.
    RecommendedStep,
    /// Force at the inputs as set, lookahead left out, N: feeds through.
    ForceNow,
    /// Whether the inputs are beyond what the learned force was learned on: feeds through.
    BeyondLearned,
    /// Parameter, by its place in [`PARAMETER_TABLE`].
    Parameter(usize),
}

/// One variable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variable {
    /// Value reference, the same space for all types.
    pub reference: u32,
    /// Name: a contract.
    pub name: &'static str,
    /// Type.
    pub kind: Kind,
    /// Unit; empty for none.
    pub unit: &'static str,
    /// What it is.
    pub role: Role,
}

/// One parameter.
#[derive(Clone, Copy)]
pub struct Parameter {
    /// Name.
    pub name: &'static str,
    /// Type in calls; one with [`Parameter::items`] is an Enumeration in the description.
    pub kind: Kind,
    /// The items to choose from, numbered from 0 on; none for a number.
    pub items: &'static [part::Item],
    /// Unit.
    pub unit: &'static str,
    /// Whether it may change between steps.
    pub tunable: bool,
    access: Access,
}

/// Where a parameter's value is.
#[derive(Clone, Copy)]
enum Access {
    Law(part::Parameter),
    Lookahead,
    LookaheadTime,
    EffectiveMass,
}

/// What the parameters set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// The law's own.
    pub law: Parameters,
    /// Macro-steps by which the law is evaluated ahead of the inputs, -10 to 10.
    pub lookahead: f64,
    /// Time by which it is evaluated ahead on top of that, s, -1e6 to 1e6: for masters that vary their step.
    pub lookahead_time: f64,
    /// Mass that recommended_step is given for, kg, > 0.
    pub effective_mass: f64,
}

impl Settings {
    /// Value of a parameter by its place in the table.
    pub fn get(&self, i: usize) -> f64 {
        PARAMETER_TABLE.get(i).map_or(0.0, |p| match p.access {
            Access::Law(q) => (q.get)(&self.law),
            Access::Lookahead => self.lookahead,
            Access::LookaheadTime => self.lookahead_time,
            Access::EffectiveMass => self.effective_mass,
        })
    }

    /// Sets a parameter by its place in the table.
    pub fn set(&mut self, i: usize, value: f64) {
        match PARAMETER_TABLE.get(i).map(|p| p.access) {
            Some(Access::Law(q)) => (q.set)(&mut self.law, value),
            Some(Access::Lookahead) => self.lookahead = value,
            Some(Access::LookaheadTime) => self.lookahead_time = value,
            Some(Access::EffectiveMass) => self.effective_mass = value,
            None => {}
        }
    }

    /// Checks every range.
    ///
    /// # Errors
    /// Names the parameter, its value and what it may be.
    pub fn validate(&self) -> Result<(), String> {
        self.law.validate().map_err(|e| text!("{}", e))?;
        let lookahead = self.lookahead;
        if lookahead.is_nan() || lookahead.abs() > 10.0 {
            return Err(text!("lookahead is {lookahead}: give -10 to 10"));
        }
        let ahead = self.lookahead_time;
        if ahead.is_nan() || ahead.abs() > 1e6 {
            return Err(text!("lookahead_time is {} s: give -1e6 to 1e6", ahead));
        }
        let mass = self.effective_mass;
        if !(mass.is_finite() && mass > 0.0) {
            return Err(text!("effective_mass is {mass}: give a finite number above 0"));
        }
        Ok(())
    }
}

impl Default for Settings {
    fn default() -> Self {
        Settings { law: Parameters::default(), lookahead: 0.0, lookahead_time: 0.0, effective_mass: 1.0 }
    }
}

const fn own(name: &'static str, unit: &'static str, access: Access) -> Parameter {
    Parameter { name, kind: Kind::Real, items: &[], unit, tunable: true, access }
}

/// Parameters that are not the law's, with their value references, ascending.
const OWN: [(u32, Parameter); 3] = [
    (121, own("lookahead", "1", Access::Lookahead)),
    (122, own("effective_mass", "kg", Access::EffectiveMass)),
    (123, own("lookahead_time", "s", Access::LookaheadTime)),
];

/// Value reference of the first parameter.
pub const FIRST_PARAMETER: u32 = 100;

/// The parameters, in the order of their value references from [`FIRST_PARAMETER`] on.
pub static PARAMETER_TABLE: [Parameter; PARAMETERS] = table();

/// The law's parameters, as their parts declare them, and [`OWN`], in order and without a gap.
const fn table() -> [Parameter; PARAMETERS] {
    let mut all = [OWN[0].1; PARAMETERS];
    let (mut i, mut law, mut own) = (0, 0, 0);
    while i < PARAMETERS {
        let reference = FIRST_PARAMETER + i as u32;
        if own < OWN.len() && OWN[own].0 == reference {
            all[i] = OWN[own].1;
            own += 1;
        } else {
            let p = parts::BY_REFERENCE[law];
            assert!(p.reference == reference, "a value reference is left out or given twice");
            let kind = match p.kind {
                part::Kind::Real => Kind::Real,
                part::Kind::Enumeration(_) => Kind::Integer,
            };
            let (tunable, items) = (false, p.kind.items());
            all[i] = Parameter { name: p.name, kind, items, unit: p.unit, tunable, access: Access::Law(p) };
            law += 1;
        }
        i += 1;
    }
    all
}

const fn variable(reference: u32, name: &'static str, kind: Kind, unit: &'static str, role: Role) -> Variable {
    Variable { reference, name, kind, unit, role }
}

/// Inputs and outputs.
pub static SIGNALS: [Variable; 11] = [
    variable(0, "penetration", Kind::Real, "m", Role::Penetration),
    variable(1, "velocity", Kind::Real, "m/s", Role::Velocity),
    variable(2, "force", Kind::Real, "N", Role::Force),
    variable(3, "contact", Kind::Boolean, "", Role::Contact),
    variable(4, "stored_energy", Kind::Real, "J", Role::StoredEnergy),
    variable(5, "dissipated_energy", Kind::Real, "J", Role::DissipatedEnergy),
    variable(6, "deepest_penetration", Kind::Real, "m", Role::DeepestPenetration),
    variable(7, "permanent_set", Kind::Real, "m", Role::PermanentSet),
    variable(8, "recommended_step", Kind::Real, "s", Role::RecommendedStep),
    variable(9, "force_at_inputs", Kind::Real, "N", Role::ForceNow),
    variable(10, "beyond_learned", Kind::Boolean, "", Role::BeyondLearned),
];

/// The variable of a value reference.
#[inline]
pub fn by_reference(reference: u32) -> Option<Variable> {
    if let Some(v) = SIGNALS.get(reference as usize) {
        return Some(*v);
    }
    let i = reference.checked_sub(FIRST_PARAMETER)? as usize;
    let p = PARAMETER_TABLE.get(i)?;
    Some(variable(reference, p.name, p.kind, p.unit, Role::Parameter(i)))
}

/// Every variable, inputs and outputs first.
pub fn all() -> impl Iterator<Item = Variable> {
    let last = FIRST_PARAMETER + PARAMETERS as u32;
    (0..SIGNALS.len() as u32).chain(FIRST_PARAMETER..last).filter_map(by_reference)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_and_names_are_unique_and_every_parameter_reads_what_was_set() {
        let all: Vec<Variable> = all().collect();
        assert_eq!(all.len(), SIGNALS.len() + PARAMETERS);
        for (i, v) in all.iter().enumerate() {
            assert_eq!(by_reference(v.reference), Some(*v));
            assert!(all.iter().skip(i + 1).all(|w| w.name != v.name && w.reference != v.reference));
        }
        let mut s = Settings::default();
        for i in 0..PARAMETERS {
            s.set(i, 40.0 + i as f64);
        }
        for i in 0..PARAMETERS {
            assert_eq!(s.get(i), 40.0 + i as f64, "{}", PARAMETER_TABLE[i].name);
        }
    }
}
