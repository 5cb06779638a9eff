//! Units that a column may be in.

use crate::words;

/// The column of events: 1 where the contact is closed, 0 where it is open.
pub const CLOSED: &str = "closed";

/// By column: its units, each with the factor to SI.
const UNITS: [(&str, &[(&str, f64)]); 5] = [
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
            ("lbf", 4.4482216152605),
            ("kgf", 9.80665),
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
];

/// The columns there may be.
pub const COLUMNS: [&str; 5] = [UNITS[0].0, UNITS[1].0, UNITS[2].0, UNITS[3].0, CLOSED];

fn of(column: &str) -> &'static [(&'static str, f64)] {
    UNITS.iter().find(|u| u.0 == column).map_or(&[], |u| u.1)
}

/// Factor from `unit` to SI, where the column may be in it.
pub fn factor(column: &str, unit: &str) -> Option<f64> {
    of(column).iter().find(|u| u.0 == unit).map(|u| u.1)
}

/// What to write instead of a unit that the column cannot be in.
pub fn instead(column: &str, unit: &str) -> String {
    let known: Vec<&str> = of(column).iter().map(|u| u.0).collect();
    match UNITS.iter().find(|u| u.0 != column && factor(u.0, unit).is_some()) {
        Some((other, _)) => format!("it measures {other}; known are {}", known.join(", ")),
        None => words::instead(unit, &known),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_has_its_factor_in_its_own_column_alone() {
        assert_eq!(factor("force", "kN"), Some(1e3));
        assert_eq!(factor("force", "mm"), None);
        assert_eq!(factor("wind", "m"), None);
    }

    #[test]
    fn a_wrong_unit_is_told_the_nearest_or_what_it_measures() {
        assert!(instead("force", "KN").starts_with("did you mean \"kN\"?"));
        assert!(instead("acceleration", "m/s^").starts_with("did you mean \"m/s^2\"?"));
        assert!(instead("force", "mm").starts_with("it measures penetration; known are N, kN"));
    }
}
