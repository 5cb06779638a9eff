//! What a value in one unit is in another, by the units that descriptions and archives define.

use super::description::Unit;
use record::units::factor;

/// Quantities whose units touchdown knows by name, with their exponents of kg, m, s.
const KNOWN: [(&str, [i32; 3]); 7] = [
    ("time", [0, 0, 1]),
    ("force", [1, 1, -2]),
    ("acceleration", [0, 1, -2]),
    ("penetration", [0, 1, 0]),
    ("speed", [0, 1, -1]),
    ("mass", [1, 0, 0]),
    ("spring rate", [1, 0, -2]),
];
/// Exponents that decide whether units are of one kind: all but that of rad, which is 1.
const KIND: usize = 7;

/// A unit as a file names it, and what it is where the file defines it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Named {
    pub name: String,
    pub unit: Option<Unit>,
}

impl Named {
    /// Its name without brackets around it.
    fn bare(&self) -> &str {
        let name = self.name.trim();
        name.strip_prefix('[').and_then(|n| n.strip_suffix(']')).unwrap_or(name)
    }

    /// What it may be: as defined, else as touchdown knows units by name.
    fn meanings(&self) -> Vec<Unit> {
        if let Some(unit) = &self.unit {
            return vec![unit.clone()];
        }
        let known = KNOWN.iter().filter_map(|(column, of)| {
            let mut exponents = [0; 8];
            exponents[..3].copy_from_slice(of);
            Some(Unit { exponents, factor: factor(column, self.bare())?, offset: 0.0 })
        });
        known.collect()
    }
}

/// (factor, offset) that takes a value in `from` to one in `to`; of a difference (`relative`) the offset is 0.
///
/// # Errors
/// That they are of different kinds, or which of them is not defined.
pub(super) fn conversion(from: &Named, to: &Named, relative: bool) -> Result<(f64, f64), String> {
    let alike = from.unit == to.unit || from.unit.is_none() || to.unit.is_none();
    if from.bare() == to.bare() && alike {
        return Ok((1.0, 0.0));
    }
    let (all_from, all_to) = (from.meanings(), to.meanings());
    for (named, all) in [(from, &all_from), (to, &all_to)] {
        if all.is_empty() {
            return Err(format!("{}, which is not defined", named.name));
        }
    }
    for a in &all_from {
        for b in &all_to {
            if a.exponents[..KIND] == b.exponents[..KIND] {
                let offset = if relative { 0.0 } else { (a.offset - b.offset) / b.factor };
                return Ok((a.factor / b.factor, offset));
            }
        }
    }
    Err(format!("{} and {}, which are of different kinds", from.name, to.name))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn defined(name: &str, kelvin: i32, factor: f64, offset: f64) -> Named {
        let exponents = [0, 1 - kelvin, 0, 0, kelvin, 0, 0, 0];
        Named { name: name.into(), unit: Some(Unit { exponents, factor, offset }) }
    }

    fn undefined(name: &str) -> Named {
        Named { name: name.into(), unit: None }
    }

    #[test]
    fn a_temperature_has_an_offset_and_a_difference_of_temperatures_has_none() {
        let (c, k) = (defined("degC", 1, 1.0, 273.15), defined("K", 1, 1.0, 0.0));
        assert_eq!(conversion(&c, &k, false), Ok((1.0, 273.15)));
        assert_eq!(conversion(&c, &k, true), Ok((1.0, 0.0)));
        let f = defined("degF", 1, 5.0 / 9.0, 459.67 * 5.0 / 9.0);
        let (factor, offset) = conversion(&c, &f, false).unwrap();
        assert!((factor * 20.0 + offset - 68.0).abs() < 1e-9);
        assert!((conversion(&f, &k, true).unwrap().0 * 18.0 - 10.0).abs() < 1e-12);
    }

    #[test]
    fn names_that_no_file_defines_are_known_or_refused_and_never_taken_for_another() {
        assert_eq!(conversion(&undefined("mm"), &defined("m", 0, 1.0, 0.0), false), Ok((1e-3, 0.0)));
        assert_eq!(conversion(&undefined("furlong"), &undefined("furlong"), false), Ok((1.0, 0.0)));
        assert_eq!(conversion(&undefined("[m3]"), &undefined("m3"), false), Ok((1.0, 0.0)));
        assert_eq!(conversion(&undefined("[mm]"), &undefined("m"), false), Ok((1e-3, 0.0)));
        let e = conversion(&undefined("furlong"), &undefined("m"), false).unwrap_err();
        assert_eq!(e, "furlong, which is not defined");
        let e = conversion(&undefined("mm"), &defined("K", 1, 1.0, 0.0), false).unwrap_err();
        assert!(e.contains("different kinds"), "{e}");
        // g is an acceleration beside m/s2 and a mass beside kg
        assert_eq!(conversion(&undefined("g"), &undefined("kg"), false), Ok((1e-3, 0.0)));
        assert_eq!(conversion(&undefined("g"), &undefined("m/s2"), false), Ok((9.80665, 0.0)));
    }

    #[test]
    fn an_angle_is_of_one_kind_with_a_number() {
        let mut rad = defined("rad", 1, 1.0, 0.0);
        rad.unit.as_mut().unwrap().exponents = [0, 0, 0, 0, 0, 0, 0, 1];
        let mut one = defined("1", 1, 1.0, 0.0);
        one.unit.as_mut().unwrap().exponents = [0; 8];
        assert_eq!(conversion(&rad, &one, false), Ok((1.0, 0.0)));
    }
}
