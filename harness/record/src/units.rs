//! Units: those that a column may be in, and those of what campaign.toml holds.

use crate::words;

/// The column of events: 1 where the contact is closed, 0 where it is open.
pub const CLOSED: &str = "closed";

/// By quantity, the columns first: its units, each with the factor to SI.
const UNITS: [(&str, &[(&str, f64)]); 8] = [
    ("time", &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("µs", 1e-6), ("ns", 1e-9), ("min", 60.0)]),
    (
        "force",
        &[
            ("N", 1.0),
            ("kN", 1e3),
            ("MN", 1e6),
            ("mN", 1e-3),
            ("uN", 1e-6),
            ("µN", 1e-6),
            ("nN", 1e-9),
            ("pN", 1e-12),
            ("daN", 10.0),
            ("lbf", 4.4482216152605),
            ("kgf", 9.80665),
            ("gf", 9.80665e-3),
        ],
    ),
    (
        "acceleration",
        &[
            ("m/s^2", 1.0),
            ("m/s2", 1.0),
            ("m/s²", 1.0),
            ("m/s/s", 1.0),
            ("mm/s^2", 1e-3),
            ("cm/s^2", 1e-2),
            ("km/s^2", 1e3),
            ("g", 9.80665),
            ("gn", 9.80665),
            ("g0", 9.80665),
        ],
    ),
    (
        "penetration",
        &[
            ("m", 1.0),
            ("mm", 1e-3),
            ("cm", 1e-2),
            ("um", 1e-6),
            ("µm", 1e-6),
            ("nm", 1e-9),
            ("pm", 1e-12),
            ("in", 0.0254),
        ],
    ),
    (CLOSED, &[("1", 1.0)]),
    ("speed", &[("m/s", 1.0), ("mm/s", 1e-3), ("cm/s", 1e-2), ("km/h", 1.0 / 3.6)]),
    ("mass", &[("kg", 1.0), ("g", 1e-3), ("mg", 1e-6), ("t", 1e3), ("lb", 0.45359237)]),
    ("spring rate", &[("N/m", 1.0), ("N/mm", 1e3), ("kN/m", 1e3), ("kN/mm", 1e6), ("mN/m", 1e-3)]),
];

/// The columns there may be.
pub const COLUMNS: [&str; 5] = [UNITS[0].0, UNITS[1].0, UNITS[2].0, UNITS[3].0, CLOSED];

/// What a column in `unit` measures, and its factor to SI, in any spelling that instruments have for it; None where the
/// unit is of none of the columns, or says nothing, as 1 does.
pub fn measured(unit: &str) -> Option<(&'static str, f64)> {
    let unit = unit.trim();
    let plain = COLUMNS.into_iter().filter(|c| *c != CLOSED).find_map(|c| listed(c, unit).map(|f| (c, f)));
    plain.or_else(|| ::units::measured(unit))
}

fn of(column: &str) -> &'static [(&'static str, f64)] {
    UNITS.iter().find(|u| u.0 == column).map_or(&[], |u| u.1)
}

/// SI unit of a column; None for no column.
pub fn si(column: &str) -> Option<&'static str> {
    of(column).iter().find(|u| u.1 == 1.0).map(|u| u.0)
}

/// The factor of a unit of the table.
fn listed(column: &str, unit: &str) -> Option<f64> {
    of(column).iter().find(|u| u.0 == unit).map(|u| u.1)
}

/// Factor from `unit` to SI, where the column may be in it, in any spelling.
pub fn factor(column: &str, unit: &str) -> Option<f64> {
    listed(column, unit).or_else(|| ::units::factor(column, unit))
}

/// What a sensor's output in `unit` is counted in, `V`, `A` or `C`, and the factor to that; None for other units.
pub fn output(unit: &str) -> Option<(&'static str, f64)> {
    ::units::output(unit)
}

/// The unit of the column that is spelt nearly as `unit`; None where none is.
pub fn nearest(column: &str, unit: &str) -> Option<&'static str> {
    words::nearest(unit, &of(column).iter().map(|u| u.0).collect::<Vec<_>>())
}

/// What to write instead of a unit that the column cannot be in.
pub fn instead(column: &str, unit: &str) -> String {
    let known: Vec<&str> = of(column).iter().map(|u| u.0).collect();
    let Some(other) = UNITS.iter().map(|u| u.0).find(|u| *u != column && factor(u, unit).is_some()) else {
        return words::instead(unit, &known);
    };
    let load = match other {
        "mass" if column == "force" => "a load in kg is in kgf, 9.807 N; ",
        "acceleration" if column == "force" && factor("mass", unit).is_some() => {
            "a load in grams is in gf, 9.807e-3 N; "
        }
        _ => "",
    };
    format!("it measures {other}; {load}known are {}", known.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_has_its_factor_in_its_own_column_alone() {
        assert_eq!(factor("force", "kN"), Some(1e3));
        assert_eq!(factor("force", "mm"), None);
        assert_eq!((factor("force", "lbs"), factor("acceleration", "ft/s^2")), (Some(4.4482216152605), Some(0.3048)));
        assert_eq!(factor("wind", "m"), None);
    }

    #[test]
    fn units_of_instruments_are_known_by_their_spellings() {
        for (unit, column, to_si) in [
            ("kN", "force", 1e3),
            ("[N]", "force", 1.0),
            ("Newtons", "force", 1.0),
            ("m/s²", "acceleration", 1.0),
            ("m·s⁻²", "acceleration", 1.0),
            ("(m/s^2)", "acceleration", 1.0),
            ("m/s**2", "acceleration", 1.0),
            ("G", "acceleration", 9.80665),
            ("gn", "acceleration", 9.80665),
            ("μs", "time", 1e-6),
            ("Seconds", "time", 1.0),
            ("mm", "penetration", 1e-3),
            ("μm", "penetration", 1e-6),
        ] {
            assert_eq!(measured(unit), Some((column, to_si)), "{unit}");
        }
        for unit in ["V", "mV", "", "°C", "m/s", "MS", "kg"] {
            assert_eq!(measured(unit), None, "{unit}");
        }
        assert_eq!(factor("mass", "g"), Some(1e-3));
        assert!(!COLUMNS.contains(&"mass"));
    }

    #[test]
    fn a_wrong_unit_is_told_the_nearest_or_what_it_measures() {
        assert!(instead("force", "KN").starts_with("did you mean \"kN\"?"));
        assert!(instead("acceleration", "m/s^").starts_with("did you mean \"m/s^2\"?"));
        assert!(instead("force", "mm").starts_with("it measures penetration; known are N, kN"));
        assert!(instead("force", "kg").contains("a load in kg is in kgf"));
        assert!(instead("force", "g").contains("a load in grams is in gf"));
        assert!(instead("force", "grams").contains("a load in kg is in kgf"));
    }
}
