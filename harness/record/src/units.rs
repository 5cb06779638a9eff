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
    ("speed", &[("m/s", 1.0), ("mm/s", 1e-3), ("cm/s", 1e-2), ("km/h", 1.0 / 3.6)]),
    ("mass", &[("kg", 1.0), ("g", 1e-3), ("mg", 1e-6), ("t", 1e3), ("lb", 0.45359237)]),
    ("spring rate", &[("N/m", 1.0), ("N/mm", 1e3), ("kN/m", 1e3), ("kN/mm", 1e6), ("mN/m", 1e-3)]),
];

/// Ways in which instruments write units that the table above has under one spelling, after [`spelling`].
const SPELLINGS: [(&str, &str); 40] = [
    ("sec", "s"),
    ("secs", "s"),
    ("second", "s"),
    ("seconds", "s"),
    ("sekunde", "s"),
    ("sekunden", "s"),
    ("seconde", "s"),
    ("secondes", "s"),
    ("segundos", "s"),
    ("msec", "ms"),
    ("millisecond", "ms"),
    ("milliseconds", "ms"),
    ("usec", "us"),
    ("microsecond", "us"),
    ("microseconds", "us"),
    ("nsec", "ns"),
    ("nanoseconds", "ns"),
    ("minutes", "min"),
    ("newton", "N"),
    ("newtons", "N"),
    ("kilonewton", "kN"),
    ("kilonewtons", "kN"),
    ("lbs", "lbf"),
    ("g's", "g"),
    ("gs", "g"),
    ("g_n", "gn"),
    ("gee", "g"),
    ("grav", "g"),
    ("m/sec2", "m/s2"),
    ("m/(s2)", "m/s2"),
    ("ms-2", "m/s2"),
    ("m*s-2", "m/s2"),
    ("mm/s2", "mm/s^2"),
    ("cm/s2", "cm/s^2"),
    ("km/s2", "km/s^2"),
    ("meter", "m"),
    ("metre", "m"),
    ("millimeter", "mm"),
    ("micron", "um"),
    ("inch", "in"),
];

/// The columns there may be.
pub const COLUMNS: [&str; 5] = [UNITS[0].0, UNITS[1].0, UNITS[2].0, UNITS[3].0, CLOSED];

/// A unit without brackets, blanks, and the signs that differ between character sets: `[m·s⁻²]` becomes `m*s-2`.
fn spelling(unit: &str) -> String {
    let unit = unit.trim().trim_matches(['[', ']', '"', '\'']).trim();
    let bare = unit.strip_prefix('(').and_then(|u| u.strip_suffix(')')).unwrap_or(unit);
    let mut plain = String::new();
    for c in bare.chars().filter(|c| !c.is_whitespace() && *c != '^') {
        match c {
            'µ' | 'μ' => plain.push('u'),
            '²' => plain.push('2'),
            '⁻' | '−' => plain.push('-'),
            '·' | '⋅' | '×' => plain.push('*'),
            c => plain.push(c),
        }
    }
    plain.replace("**", "")
}

/// What a column in `unit` measures, and its factor to SI, in any spelling that instruments have for it; None where the
/// unit is of none of the columns, or says nothing, as 1 does.
pub fn measured(unit: &str) -> Option<(&'static str, f64)> {
    let found = |u: &str| COLUMNS.into_iter().filter(|c| *c != CLOSED).find_map(|c| factor(c, u).map(|f| (c, f)));
    let plain = spelling(unit);
    let lower = plain.to_lowercase();
    let known = SPELLINGS.iter().find(|s| s.0 == lower).map(|s| s.1);
    found(unit.trim())
        .or_else(|| found(&plain))
        .or_else(|| found(known?))
        // capital letters that change nothing: S, MS are no units of a column; G is g
        .or_else(|| (plain == "G").then(|| found("g"))?)
}

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
    }
}
