//! Units beside and inside names.

pub(crate) use units::is_unit;

/// How often a unit of time fits into a second: a step divided by it is exact to the last digit; None for other units.
pub(crate) fn ticks_of_a_second(unit: &str) -> Option<f64> {
    let seconds = units::factor("time", unit)?;
    Some(if seconds < 1.0 { (1.0 / seconds).round() } else { 1.0 / seconds })
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
    let name = name.to_lowercase();
    units::factor("time", unit).is_some()
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
