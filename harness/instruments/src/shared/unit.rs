//! Units beside and inside names.

/// What units are made of. Prefixes stand before the ones that have them.
const PREFIXED: [&str; 17] =
    ["s", "g", "m", "N", "V", "A", "Pa", "Hz", "W", "J", "bar", "Nm", "C", "rad", "T", "S/s", "eps"];
const PREFIXES: [&str; 10] = ["n", "u", "\u{b5}", "\u{3bc}", "m", "c", "d", "k", "M", "G"];
const WHOLE: [&str; 73] = [
    "min", "h", "d", "t", "lb", "lbf", "lbm", "klbf", "kip", "kp", "kgf", "ft", "in", "inch", "inches", "psi", "ksi",
    "K", "degC", "degF", "deg", "\u{b0}", "\u{b0}C", "\u{b0}F", "%", "rpm", "RPM", "U", "rev", "G", "gn", "g0", "dB",
    "strain", "\u{3b5}", "mil", "kph", "mph", "Ohm", "\u{3a9}", "atm", "Torr", "sec", "secs", "msec", "usec", "second",
    "seconds", "Second", "Seconds", "ms.", "sec.", "Volt", "Volts", "volt", "volts", "Ampere", "Amps", "counts",
    "digits", "EU", "AU", "u/min", "pC", "VA", "kOhm", "k\u{3a9}", "mol", "bit", "bits", "cts", "count", "samples",
];
const WORDS: [&str; 8] = ["newton", "newtons", "metre", "meter", "meters", "metres", "pascal", "hertz"];

fn is_atom(text: &str) -> bool {
    let prefixed = |rest: &str| PREFIXED.contains(&rest);
    WHOLE.contains(&text)
        || prefixed(text)
        || PREFIXES.iter().any(|p| text.strip_prefix(p).is_some_and(prefixed))
        || WORDS.contains(&text.to_lowercase().as_str())
}

/// Whether a text is a unit: atoms with exponents, multiplied and divided; or the sign for none (`-`, `1`).
pub(crate) fn is_unit(text: &str) -> bool {
    if matches!(text, "-" | "1") {
        return true;
    }
    let joins = |c: char| "/*\u{b7}\u{22c5}\u{d7}() .".contains(c);
    let exponent = |c: char| c.is_ascii_digit() || "^\u{b2}\u{b3}-+\u{b9}\u{207b}\u{2212}".contains(c);
    let mut atoms = 0;
    is_atom(text)
        || text.split(joins).filter(|part| !part.is_empty()).all(|part| {
            let atom = part.trim_end_matches(exponent);
            // the 1 of 1/min
            let one = part == "1" && text.starts_with("1/");
            atoms += usize::from(!one);
            one || is_atom(atom)
        }) && atoms > 0
}

/// The unit in a cell of a row of units: brackets off; None where it is none.
pub(crate) fn of_row(cell: &str) -> Option<&str> {
    inner(cell).or_else(|| is_unit(cell).then_some(cell))
}

/// What stands in brackets or parentheses, where nothing else does.
pub(crate) fn inner(cell: &str) -> Option<&str> {
    let square = cell.strip_prefix('[').and_then(|c| c.strip_suffix(']'));
    square.or_else(|| cell.strip_prefix('(').and_then(|c| c.strip_suffix(')'))).map(str::trim)
}

/// Name and unit of `Force [kN]`, `Force (kN)` and `Force / kN`. In square brackets anything but an index is a unit; in
/// parentheses and behind a slash what is known as one.
pub(crate) fn of_name(cell: &str) -> (String, String) {
    let split = |name: &str, unit: &str| (name.trim().to_string(), unit.trim().to_string());
    if let Some((name, unit)) = cell.strip_suffix(']').and_then(|c| c.rsplit_once('[')) {
        if !unit.trim().is_empty() && !unit.trim().bytes().all(|b| b.is_ascii_digit()) {
            return split(name, unit);
        }
    }
    if let Some((name, unit)) = cell.split_once(" / ") {
        let unit = unit.trim();
        if is_unit(inner(unit).unwrap_or(unit)) {
            return split(name, inner(unit).unwrap_or(unit));
        }
    }
    if let Some((name, unit)) = cell.strip_suffix(')').and_then(|_| parenthesis(cell)) {
        if is_unit(unit) || unit.contains(['/', '\u{b2}', '\u{b0}', '\u{b5}']) {
            return split(name, unit);
        }
    }
    (cell.to_string(), String::new())
}

/// What stands before and in the parenthesis that ends a text.
fn parenthesis(cell: &str) -> Option<(&str, &str)> {
    let mut depth = 0;
    for (i, c) in cell.char_indices().rev() {
        match c {
            ')' => depth += 1,
            '(' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return Some((&cell[..i], cell[i + 1..cell.len() - 1].trim()));
        }
    }
    None
}

/// Whether a channel is a time, by its unit or its name.
pub(crate) fn is_time(name: &str, unit: &str) -> bool {
    let unit_of_time = ["s", "ms", "us", "\u{b5}s", "\u{3bc}s", "ns", "min", "h", "sec", "second", "seconds", "msec"];
    let name = name.to_lowercase();
    unit_of_time.contains(&unit.to_lowercase().as_str())
        || ["time", "zeit", "temps", "tiempo"].iter().any(|t| name.starts_with(t))
        || name == "t"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_known() {
        for unit in [
            "s", "ms", "µs", "kN", "m/s²", "m/s^2", "m/s2", "N·m", "1/min", "%", "mV/V", "°C", "µm/m", "(m/s)", "-",
            "kg*m",
        ] {
            assert!(is_unit(unit), "{unit}");
        }
        for other in ["Force", "time", "x", "CH1", "", "Drop 1", "12", "2/3", "filtered"] {
            assert!(!is_unit(other), "{other}");
        }
    }

    #[test]
    fn units_are_split_off_names() {
        let cases = [
            ("Force [kN]", "Force", "kN"),
            ("Force (kN)", "Force", "kN"),
            ("Force / kN", "Force", "kN"),
            ("a / (m/s²)", "a", "m/s²"),
            ("Force (max) [Skt]", "Force (max)", "Skt"),
            ("v (m/(s))", "v", "m/(s)"),
            ("[ms]", "", "ms"),
            ("Force_kN", "Force_kN", ""),
            ("x[0]", "x[0]", ""),
            ("Force (filtered)", "Force (filtered)", ""),
            ("F / F0", "F / F0", ""),
            ("F/kN", "F/kN", ""),
            (")", ")", ""),
        ];
        for (cell, name, unit) in cases {
            assert_eq!(of_name(cell), (name.to_string(), unit.to_string()), "{cell}");
        }
    }
}
