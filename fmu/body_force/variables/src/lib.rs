//! The variable table: what the modelDescription must say too; and the forces that the parameters set.

use face::text;
pub use face::Kind;
use law::body::{FluidDrag, GuideFriction, LearnedForce, ResidualMagnetism, ReturnSpring, SqueezeFilm};
use law::learned::{COEFFICIENTS, TERMS};

/// Name of the model, and of its shared library.
pub const MODEL: &str = "BodyForce";
/// Categories that are logged; the modelDescription lists the same.
pub const LOG_CATEGORIES: [&str; 4] = ["logStatusWarning", "logStatusDiscard", "logStatusError", "logTurn"];
/// Number of parameters.
pub const PARAMETERS: usize = OWN + OF_SHAPE + COEFFICIENTS + TERMS;
/// Number of those of the forces that have an equation; the learned force's follow.
const OWN: usize = 20;
/// Number of those that say how the learned force's series are read; their coefficients follow.
const OF_SHAPE: usize = 3;
/// Number of inputs; their value references are the first ones.
pub const INPUTS: usize = 3;

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

/// What values a parameter may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Range {
    /// Any finite number.
    Any,
    /// 0 or more.
    FromZero,
    /// More than 0.
    AboveZero,
}

/// A parameter, all of them Real and fixed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// Name; that of the quantity in a verdict and in a scenario.
    pub name: &'static str,
    /// Unit.
    pub unit: &'static str,
    /// Start value.
    pub start: f64,
    /// What it may be.
    pub range: Range,
}

const fn parameter(name: &'static str, unit: &'static str, start: f64, range: Range) -> Parameter {
    Parameter { name, unit, start, range }
}

use Range::{AboveZero, Any, FromZero};

/// The parameters, in the order of their value references.
pub static PARAMETER_TABLE: [Parameter; PARAMETERS] = [
    parameter("friction", "N", 0.0, FromZero),
    parameter("friction_viscous", "N.s/m", 0.0, FromZero),
    parameter("stribeck_excess", "", 0.0, FromZero),
    parameter("stribeck_speed", "m/s", 0.05, AboveZero),
    parameter("drag", "N", 0.0, FromZero),
    parameter("drag_power", "", 2.0, AboveZero),
    parameter("drag_back", "", 1.0, FromZero),
    parameter("drag_beyond", "", 1.0, FromZero),
    parameter("drag_crisis_speed", "m/s", 0.0, FromZero),
    parameter("spring_preload", "N", 0.0, Any),
    parameter("spring_rate", "N/m", 0.0, FromZero),
    parameter("spring_growth", "N/m3", 0.0, FromZero),
    parameter("magnet_force", "N", 0.0, FromZero),
    parameter("magnet_gap", "m", 0.0, FromZero),
    parameter("magnet_time", "s", 0.0, FromZero),
    parameter("travel", "m", 0.0, FromZero),
    parameter("squeeze_film", "N.s/m", 0.0, FromZero),
    parameter("squeeze_gap", "m", 1.0, AboveZero),
    parameter("squeeze_power", "", 1.0, AboveZero),
    parameter("weight", "N", 0.0, Any),
    parameter("learned_range", "m", 0.0, FromZero),
    parameter("learned_speed", "m/s", 0.0, FromZero),
    parameter("learned_direction", "", 0.0, FromZero),
    parameter("learned_place_1", "N", 0.0, Any),
    parameter("learned_place_2", "N", 0.0, Any),
    parameter("learned_place_3", "N", 0.0, Any),
    parameter("learned_place_4", "N", 0.0, Any),
    parameter("learned_place_5", "N", 0.0, Any),
    parameter("learned_place_6", "N", 0.0, Any),
    parameter("learned_place_7", "N", 0.0, Any),
    parameter("learned_place_8", "N", 0.0, Any),
    parameter("learned_place_9", "N", 0.0, Any),
    parameter("learned_place_10", "N", 0.0, Any),
    parameter("learned_place_11", "N", 0.0, Any),
    parameter("learned_place_12", "N", 0.0, Any),
    parameter("learned_place_13", "N", 0.0, Any),
    parameter("learned_place_14", "N", 0.0, Any),
    parameter("learned_place_15", "N", 0.0, Any),
    parameter("learned_place_16", "N", 0.0, Any),
    parameter("learned_place_17", "N", 0.0, Any),
    parameter("learned_place_18", "N", 0.0, Any),
    parameter("learned_place_19", "N", 0.0, Any),
    parameter("learned_place_20", "N", 0.0, Any),
    parameter("learned_place_21", "N", 0.0, Any),
    parameter("learned_place_22", "N", 0.0, Any),
    parameter("learned_place_23", "N", 0.0, Any),
    parameter("learned_place_24", "N", 0.0, Any),
    parameter("learned_place_speed_1", "N", 0.0, Any),
    parameter("learned_place_speed_2", "N", 0.0, Any),
    parameter("learned_place_speed_3", "N", 0.0, Any),
    parameter("learned_place_speed_4", "N", 0.0, Any),
    parameter("learned_place_speed_5", "N", 0.0, Any),
    parameter("learned_place_speed_6", "N", 0.0, Any),
    parameter("learned_place_speed_7", "N", 0.0, Any),
    parameter("learned_place_speed_8", "N", 0.0, Any),
    parameter("learned_place_speed_9", "N", 0.0, Any),
    parameter("learned_place_speed_10", "N", 0.0, Any),
    parameter("learned_place_speed_11", "N", 0.0, Any),
    parameter("learned_place_speed_12", "N", 0.0, Any),
    parameter("learned_place_speed_13", "N", 0.0, Any),
    parameter("learned_place_speed_14", "N", 0.0, Any),
    parameter("learned_place_speed_15", "N", 0.0, Any),
    parameter("learned_place_speed_16", "N", 0.0, Any),
    parameter("learned_place_speed_17", "N", 0.0, Any),
    parameter("learned_place_speed_18", "N", 0.0, Any),
    parameter("learned_place_speed_19", "N", 0.0, Any),
    parameter("learned_place_speed_20", "N", 0.0, Any),
    parameter("learned_place_speed_21", "N", 0.0, Any),
    parameter("learned_place_speed_22", "N", 0.0, Any),
    parameter("learned_place_speed_23", "N", 0.0, Any),
    parameter("learned_place_speed_24", "N", 0.0, Any),
    parameter("learned_speed_1", "N", 0.0, Any),
    parameter("learned_speed_2", "N", 0.0, Any),
    parameter("learned_speed_3", "N", 0.0, Any),
    parameter("learned_speed_4", "N", 0.0, Any),
    parameter("learned_speed_5", "N", 0.0, Any),
    parameter("learned_speed_6", "N", 0.0, Any),
    parameter("learned_speed_7", "N", 0.0, Any),
    parameter("learned_speed_8", "N", 0.0, Any),
    parameter("learned_speed_9", "N", 0.0, Any),
    parameter("learned_speed_10", "N", 0.0, Any),
    parameter("learned_speed_11", "N", 0.0, Any),
    parameter("learned_speed_12", "N", 0.0, Any),
    parameter("learned_speed_13", "N", 0.0, Any),
    parameter("learned_speed_14", "N", 0.0, Any),
    parameter("learned_speed_15", "N", 0.0, Any),
    parameter("learned_speed_16", "N", 0.0, Any),
    parameter("learned_speed_17", "N", 0.0, Any),
    parameter("learned_speed_18", "N", 0.0, Any),
    parameter("learned_speed_19", "N", 0.0, Any),
    parameter("learned_speed_20", "N", 0.0, Any),
    parameter("learned_speed_21", "N", 0.0, Any),
    parameter("learned_speed_22", "N", 0.0, Any),
    parameter("learned_speed_23", "N", 0.0, Any),
    parameter("learned_speed_24", "N", 0.0, Any),
];

/// Value reference of the first parameter.
pub const FIRST_PARAMETER: u32 = 100;

const fn signal(name: &'static str, unit: &'static str) -> Variable {
    Variable { name, kind: Kind::Real, unit }
}

/// Inputs and outputs; the value reference is the place.
pub static SIGNALS: [Variable; 6] = [
    signal("penetration", "m"),
    signal("velocity", "m/s"),
    signal("other_force", "N"),
    signal("force", "N"),
    signal("added_force", "N"),
    Variable { name: "beyond_learned", kind: Kind::Boolean, unit: "" },
];

/// The variable of a value reference.
pub fn by_reference(reference: u32) -> Option<Variable> {
    if let Some(v) = SIGNALS.get(reference as usize) {
        return Some(*v);
    }
    let p = PARAMETER_TABLE.get(reference.checked_sub(FIRST_PARAMETER)? as usize)?;
    Some(signal(p.name, p.unit))
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

/// Forces on a body: each part, the way from the place of rest to the stop (m) and the weight along +x (N).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Forces {
    /// Friction of the guide.
    pub friction: GuideFriction,
    /// Drag of the fluid around.
    pub drag: FluidDrag,
    /// Spring against +x.
    pub spring: ReturnSpring,
    /// Pull towards the place of rest.
    pub magnet: ResidualMagnetism,
    /// From the place of rest to the stop, m.
    pub travel: f64,
    /// Film between body and stop.
    pub film: SqueezeFilm,
    /// Weight along +x, N.
    pub weight: f64,
    /// A force of a shape of its own.
    pub learned: LearnedForce,
}

impl Forces {
    /// All of them along +x, N, at `time` s, `x` m and `v` m/s.
    pub fn at(&self, time: f64, x: f64, v: f64) -> f64 {
        let f = self.spring.on(x, self.drag.on(v, self.friction.on(v, self.weight)));
        self.learned.on(x, v, self.film.on(x, v, self.magnet.on(time, x + self.travel, f)))
    }

    /// Growth of that with x, N/m, and with v, N s/m.
    pub fn slopes(&self, time: f64, x: f64, v: f64) -> (f64, f64) {
        let (film, learned) = (self.film.slope(x, v), self.learned.slope(x, v));
        let (by_place, by_speed) = (film.0 + learned.0, film.1 + learned.1);
        let by_place = by_place + self.spring.slope(x) + self.magnet.slope(time, x + self.travel);
        (by_place, by_speed + self.friction.slope(v) + self.drag.slope(v))
    }

    /// The parameters that set them, by their places.
    pub fn settings(&self) -> Settings {
        // what is infinite, or not there, has 0 for its parameter
        let or_zero = |v: f64| if v.is_finite() { v } else { 0.0 };
        let (f, d, s, m, q) = (&self.friction, &self.drag, &self.spring, &self.magnet, &self.film);
        let own = [
            f.coulomb,
            f.viscous,
            f.stribeck_excess,
            f.stribeck_speed,
            d.coefficient,
            d.power,
            d.back,
            d.beyond,
            d.crisis_speed.unwrap_or(0.0),
            s.preload,
            s.rate,
            s.growth,
            m.force,
            or_zero(m.gap),
            or_zero(m.time),
            self.travel,
            q.coefficient,
            q.gap,
            q.power,
            self.weight,
        ];
        let l = &self.learned;
        let learned = [l.of_place.range, l.of_place.speed, f64::from(u8::from(l.turns))];
        let mut all = Settings::default();
        let values = own.iter().chain(&learned).chain(&l.of_place.coefficients).chain(&l.of_speed);
        all.0.iter_mut().zip(values).for_each(|(a, v)| *a = *v);
        all
    }
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

    /// The forces they set.
    pub fn forces(&self) -> Forces {
        let (own, rest) = self.0.split_at(OWN);
        let mut first = [0.0; OWN];
        first.copy_from_slice(own);
        let mut learned = LearnedForce::default();
        learned.of_place.range = rest[0];
        learned.of_place.speed = rest[1];
        learned.turns = rest[2] > 0.0;
        let (of_place, of_speed) = rest[OF_SHAPE..].split_at(COEFFICIENTS);
        learned.of_place.coefficients.copy_from_slice(of_place);
        learned.of_speed.copy_from_slice(of_speed);
        let [coulomb, viscous, stribeck_excess, stribeck_speed, drag, power, back, beyond, crisis, preload, rate, growth, magnet, gap, time, travel, film, film_gap, film_power, weight] =
            first;
        let or_infinite = |v: f64| if v > 0.0 { v } else { f64::INFINITY };
        Forces {
            friction: GuideFriction { coulomb, stribeck_excess, stribeck_speed, viscous },
            drag: FluidDrag {
                coefficient: drag,
                power,
                back,
                crisis_speed: if crisis > 0.0 { Some(crisis) } else { None },
                beyond,
            },
            spring: ReturnSpring { preload, rate, growth },
            magnet: ResidualMagnetism { force: magnet, gap: or_infinite(gap), time: or_infinite(time) },
            travel,
            film: SqueezeFilm { coefficient: film, gap: film_gap, power: film_power, ..SqueezeFilm::default() },
            weight,
            learned,
        }
    }

    /// Checks every range.
    ///
    /// # Errors
    /// Names the parameter, its value and what it may be.
    pub fn validate(&self) -> Result<(), String> {
        for (value, p) in self.0.iter().zip(&PARAMETER_TABLE) {
            let (is_good, wanted) = match p.range {
                Any => (true, "a finite number"),
                FromZero => (*value >= 0.0, "a finite number not below 0"),
                AboveZero => (*value > 0.0, "a finite number above 0"),
            };
            if !value.is_finite() || !is_good {
                return Err(text!("{} is {}: give {}", p.name, value, wanted));
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_and_parameters_are_each_others_and_the_default_is_no_force() {
        let s = Settings::default();
        assert_eq!(s.forces().at(0.1, 0.2, 0.3), 0.0);
        assert_eq!(s.forces().settings(), s);
        let mut all = Settings::default();
        for i in 0..PARAMETERS {
            // what turns the learned force with the motion is 1 or 0
            all.set(i, if PARAMETER_TABLE[i].name == "learned_direction" { 1.0 } else { 40.0 + i as f64 });
        }
        assert_eq!(all.forces().settings(), all);
        let names =
            [(0, "friction"), (8, "drag_crisis_speed"), (15, "travel"), (19, "weight"), (94, "learned_speed_24")];
        for (i, name) in names.iter().copied() {
            assert_eq!(by_reference(FIRST_PARAMETER + i).unwrap().name, name);
        }
        assert_eq!((by_reference(195), by_reference(6)), (None, None));
        all.set(3, 0.0);
        assert!(all.validate().unwrap_err().contains("stribeck_speed is 0: give a finite number above 0"));
    }
}
