//! Amounts with a unit, as people write them: `200 mm`, `0,509kg`.

use record::{units, words};

/// Splits a number, a decimal comma allowed, from what follows it; None where the text does not begin with a number.
pub(crate) fn split(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let end = (1..=text.len())
        .rev()
        .filter(|i| text.is_char_boundary(*i))
        .find(|i| text[..*i].replacen(',', ".", 1).parse::<f64>().is_ok_and(f64::is_finite))?;
    let number = text[..end].replacen(',', ".", 1).parse().ok()?;
    Some((number, text[end..].trim()))
}

/// The amount that `text` gives of `quantity` (a name of the table of units, or empty: a plain number), in SI; without a
/// unit it is SI.
///
/// # Errors
/// What is wrong with it, and how to write it.
pub fn amount(text: &str, quantity: &str) -> Result<f64, String> {
    let (number, unit) = split(text).ok_or_else(|| format!("{text:?} is no number"))?;
    if unit.is_empty() {
        return Ok(number);
    }
    match units::factor(quantity, unit) {
        Some(f) if (number * f).is_finite() => Ok(number * f),
        Some(_) => Err(format!("{text:?} is too large in SI: correct the number or its unit")),
        None if quantity.is_empty() => Err(format!("{text:?} has a unit where a plain number is asked for")),
        None => Err(format!("{text:?} is no {quantity}: {}", units::instead(quantity, unit))),
    }
}

/// A number as short as its nine digits allow.
pub(crate) fn digits(v: f64) -> String {
    let rounded: f64 = format!("{v:.8e}").parse().unwrap_or(v);
    if rounded == 0.0 || (1e-4..1e9).contains(&rounded.abs()) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}

/// A number in four digits, for the eye.
pub(crate) fn brief(v: f64) -> String {
    let rounded: f64 = format!("{v:.3e}").parse().unwrap_or(v);
    if rounded == 0.0 || (1e-3..1e6).contains(&rounded.abs()) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}

/// `did you mean`, for one of a few known words.
pub(crate) fn instead(word: &str, known: &[&str]) -> String {
    words::instead(word, known)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_are_si_with_or_without_their_unit() {
        assert_eq!(amount("200 mm", "penetration"), Ok(0.2));
        assert_eq!(amount("0,509kg", "mass"), Ok(0.509));
        assert_eq!(amount("509g", "mass"), Ok(0.509));
        assert_eq!(amount("1.5e-1", "speed"), Ok(0.15));
        assert_eq!(amount("3", ""), Ok(3.0));
        assert!(amount("3 N", "mass").unwrap_err().contains("it measures force"));
        assert!(amount("heavy", "mass").is_err() && amount("3 kg", "").is_err());
        assert_eq!(split("2.5mV/N"), Some((2.5, "mV/N")));
        assert!(amount("1e308 kN/mm", "spring rate").unwrap_err().contains("too large in SI"));
    }

    #[test]
    fn numbers_are_short_and_keep_nine_digits() {
        assert_eq!((digits(0.1 + 0.2), digits(1.0 / 3.0)), ("0.3".into(), "0.333333333".into()));
        assert_eq!((digits(-1.2345e-7), digits(0.0)), ("-1.2345e-7".into(), "0".into()));
        assert_eq!((brief(12.3456), brief(1.5e-7)), ("12.35".into(), "1.5e-7".into()));
    }
}
