//! The bar's variable table: what its modelDescription must say too.

use face::text;
pub use face::Kind;

/// Name of the model, and of its shared library.
pub const MODEL: &str = "MovingBar";
/// Categories that are logged; the modelDescription lists the same.
pub const LOG_CATEGORIES: [&str; 4] = ["logStatusWarning", "logStatusDiscard", "logStatusError", "logSeat"];
/// Number of parameters.
pub const PARAMETERS: usize = 10;

/// One variable; parameters have value references from [`FIRST_PARAMETER`] on, signals their place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variable {
    /// Name: a contract.
    pub name: &'static str,
    /// Type.
    pub kind: Kind,
    /// Unit; empty for none.
    pub unit: &'static str,
}

/// A parameter, all of them Real and fixed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Start value.
    pub start: f64,
    /// Least value, and whether it is excluded.
    pub least: (f64, bool),
}

const fn parameter(name: &'static str, unit: &'static str, start: f64, least: f64, excluded: bool) -> Parameter {
    Parameter { name, unit, start, least: (least, excluded) }
}

const ANY: f64 = f64::NEG_INFINITY;

/// The parameters, in the order of their value references.
pub static PARAMETER_TABLE: [Parameter; PARAMETERS] = [
    parameter("mass", "kg", 1.0, 0.0, true),
    parameter("travel", "m", 0.0, 0.0, false),
    parameter("spring_preload", "N", 0.0, ANY, false),
    parameter("return_spring_rate", "N/m", 0.0, 0.0, false),
    parameter("holding_force", "N", 0.0, 0.0, false),
    parameter("holding_time", "s", 1e-3, 0.0, true),
    parameter("damping", "N.s/m", 0.0, 0.0, false),
    parameter("gravity", "m/s2", 0.0, ANY, false),
    parameter("start_penetration", "m", 0.0, ANY, false),
    parameter("start_velocity", "m/s", 0.0, ANY, false),
];

/// Value reference of the first parameter.
pub const FIRST_PARAMETER: u32 = 100;

const fn signal(name: &'static str, kind: Kind, unit: &'static str) -> Variable {
    Variable { name, kind, unit }
}

/// Input and outputs; the value reference is the place.
pub static SIGNALS: [Variable; 8] = [
    signal("force", Kind::Real, "N"),
    signal("penetration", Kind::Real, "m"),
    signal("velocity", Kind::Real, "m/s"),
    signal("acceleration", Kind::Real, "m/s2"),
    signal("drive_force", Kind::Real, "N"),
    signal("kinetic_energy", Kind::Real, "J"),
    signal("work_on_contact", Kind::Real, "J"),
    signal("seated", Kind::Boolean, ""),
];

/// The variable of a value reference.
pub fn by_reference(reference: u32) -> Option<Variable> {
    if let Some(v) = SIGNALS.get(reference as usize) {
        return Some(*v);
    }
    let p = PARAMETER_TABLE.get(reference.checked_sub(FIRST_PARAMETER)? as usize)?;
    Some(signal(p.name, Kind::Real, p.unit))
}

/// What the parameters set.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings([f64; PARAMETERS]);

impl Default for Settings {
    fn default() -> Self {
        let mut s = Settings([0.0; PARAMETERS]);
        for (value, p) in s.0.iter_mut().zip(&PARAMETER_TABLE) {
            *value = p.start;
        }
        s
    }
}

macro_rules! named {
    ($($(#[$doc:meta])* $name:ident = $i:literal,)*) => {
        impl Settings {
            $($(#[$doc])* #[inline] pub fn $name(&self) -> f64 { self.0[$i] })*
        }
    };
}

named! {
    /// kg, > 0.
    mass = 0,
    /// From the seat to the stop, m; 0: no seat.
    travel = 1,
    /// Spring force on the seat, N.
    spring_preload = 2,
    /// N/m.
    return_spring_rate = 3,
    /// Hold of the magnet at time 0, N.
    holding_force = 4,
    /// Time constant with which it fades, s, > 0.
    holding_time = 5,
    /// N s/m.
    damping = 6,
    /// Along +x, m/s^2.
    gravity = 7,
    /// m.
    start_penetration = 8,
    /// m/s.
    start_velocity = 9,
}

impl Settings {
    /// Value of a parameter by its place in the table; 0 beyond it.
    pub fn get(&self, i: usize) -> f64 {
        self.0.get(i).copied().unwrap_or(0.0)
    }

    /// Sets a parameter by its place in the table.
    pub fn set(&mut self, i: usize, value: f64) {
        if let Some(v) = self.0.get_mut(i) {
            *v = value;
        }
    }

    /// Checks every range.
    ///
    /// # Errors
    /// Names the parameter, its value and what it may be.
    pub fn validate(&self) -> Result<(), String> {
        for (value, p) in self.0.iter().zip(&PARAMETER_TABLE) {
            let (least, excluded) = p.least;
            if !value.is_finite() || *value < least || (excluded && *value == least) {
                let from = if excluded { "above" } else { "not below" };
                return Err(text!("{} is {}: give a finite number {} {}", p.name, value, from, least));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_named_getters_read_the_parameters_of_their_names() {
        let mut s = Settings::default();
        for i in 0..PARAMETERS {
            s.set(i, 40.0 + i as f64);
        }
        let read = [s.mass(), s.travel(), s.spring_preload(), s.return_spring_rate(), s.holding_force()];
        assert_eq!(read, [40.0, 41.0, 42.0, 43.0, 44.0]);
        let read = [s.holding_time(), s.damping(), s.gravity(), s.start_penetration(), s.start_velocity()];
        assert_eq!(read, [45.0, 46.0, 47.0, 48.0, 49.0]);
        s.set(0, 0.0);
        assert!(s.validate().unwrap_err().contains("mass is 0"));
        assert_eq!(by_reference(109).unwrap().name, "start_velocity");
        assert_eq!(by_reference(110), None);
        assert_eq!(by_reference(8), None);
    }
}
