//! The cells of a line, and what a cell holds.

use super::stamp::{self, Stamp};
use crate::shared::lines::decode;
use std::ops::Range;

/// What stands between cells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Delimiter {
    Byte(u8),
    /// Any number of spaces and tabs.
    Spaces,
}

/// The decimal separator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Decimal {
    Point,
    Comma,
    /// The first number with a separator decides.
    Open,
}

/// How numbers are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Dialect {
    pub delimiter: Delimiter,
    pub decimal: Decimal,
    /// Whether a lone separator before three digits (`1.234` beside decimal commas) groups thousands. Only where other
    /// numbers of the file prove it.
    pub thousands: bool,
}

/// What a cell holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Cell {
    Empty,
    /// Says that there is no value.
    Missing,
    Number(f64),
    Stamp(Stamp),
    /// A date without a time.
    Date,
    Text,
}

impl Cell {
    /// Whether it holds a sample.
    pub fn is_value(self) -> bool {
        matches!(self, Cell::Number(_) | Cell::Stamp(_))
    }
}

/// The places of a line's cells.
pub(crate) fn split(line: &[u8], delimiter: Delimiter, cells: &mut Vec<Range<usize>>) {
    cells.clear();
    if line.contains(&b'"') {
        return split_quoted(line, delimiter, cells);
    }
    let mut from = 0;
    match delimiter {
        Delimiter::Byte(delimiter) => {
            for (i, b) in line.iter().enumerate() {
                if *b == delimiter {
                    cells.push(from..i);
                    from = i + 1;
                }
            }
            cells.push(from..line.len());
        }
        Delimiter::Spaces => {
            for (i, b) in line.iter().enumerate() {
                if matches!(b, b' ' | b'\t') {
                    if i > from {
                        cells.push(from..i);
                    }
                    from = i + 1;
                }
            }
            if line.len() > from {
                cells.push(from..line.len());
            }
        }
    }
}

/// The same where quotes hold delimiters together.
fn split_quoted(line: &[u8], delimiter: Delimiter, cells: &mut Vec<Range<usize>>) {
    let ends = |b: u8| match delimiter {
        Delimiter::Byte(d) => b == d,
        Delimiter::Spaces => matches!(b, b' ' | b'\t'),
    };
    let (mut from, mut quoted) = (0, false);
    for (i, b) in line.iter().enumerate() {
        if *b == b'"' {
            quoted = !quoted;
        } else if !quoted && ends(*b) {
            if delimiter != Delimiter::Spaces || i > from {
                cells.push(from..i);
            }
            from = i + 1;
        }
    }
    if delimiter != Delimiter::Spaces || line.len() > from {
        cells.push(from..line.len());
    }
}

/// A cell's bytes without spaces and quotes around.
pub(crate) fn bare(cell: &[u8]) -> &[u8] {
    let cell = cell.trim_ascii();
    match cell {
        [b'"', inner @ .., b'"'] => inner.trim_ascii(),
        _ => cell,
    }
}

/// A cell's text: without spaces and quotes around, doubled quotes single.
pub(crate) fn text(cell: &[u8]) -> String {
    let text = decode(bare(cell));
    text.replace("\"\"", "\"").trim_matches(|c: char| c.is_whitespace() || c == '\u{feff}' || c == '\u{1a}').to_string()
}

impl Dialect {
    /// What a cell holds. An open decimal separator is settled by the first number that has one.
    #[inline]
    pub fn cell(&mut self, cell: &[u8]) -> Cell {
        let cell = bare(cell);
        let Some(first) = cell.first() else { return Cell::Empty };
        if first.is_ascii_digit() || matches!(first, b'+' | b'-' | b'.' | b',') {
            if let Some(number) = self.number(cell) {
                return Cell::Number(number);
            }
        }
        other(cell)
    }

    #[inline]
    fn number(&mut self, cell: &[u8]) -> Option<f64> {
        match self.decimal {
            Decimal::Point => point(cell).or_else(|| grouped(cell, b'.', self.thousands)),
            Decimal::Comma => comma(cell).or_else(|| grouped(cell, b',', self.thousands)),
            Decimal::Open => self.settle(cell),
        }
    }

    fn settle(&mut self, cell: &[u8]) -> Option<f64> {
        for decimal in [Decimal::Point, Decimal::Comma] {
            let settled = Dialect { decimal, ..*self }.number(cell);
            if settled.is_some() {
                if cell.iter().any(|b| matches!(b, b'.' | b',')) {
                    self.decimal = decimal;
                }
                return settled;
            }
        }
        None
    }
}

/// A number with a decimal point. Words such as `nan` are none.
#[inline]
fn point(cell: &[u8]) -> Option<f64> {
    let number: f64 = fast_float2::parse(cell).ok()?;
    (number.is_finite() || cell.iter().any(u8::is_ascii_digit)).then_some(number)
}

/// A number with a decimal comma.
fn comma(cell: &[u8]) -> Option<f64> {
    let mut copy = [0; 64];
    let copy = copy.get_mut(..cell.len())?;
    for (to, from) in copy.iter_mut().zip(cell) {
        *to = match from {
            b',' => b'.',
            b'.' => return None,
            other => *other,
        };
    }
    // a comma at the end separates cells
    if cell.ends_with(b",") {
        return None;
    }
    point(copy)
}

/// A number with groups of thousands or a Fortran exponent (`1.5D+03`).
fn grouped(cell: &[u8], decimal: u8, lone: bool) -> Option<f64> {
    // a comma at the end separates cells
    if cell.len() > 64 || cell.ends_with(b",") {
        return None;
    }
    let text = decode(cell);
    let mantissa_end = text.find(['D', 'd', 'E', 'e']).unwrap_or(text.len());
    let (mantissa, exponent) = text.split_at(mantissa_end);
    let (whole, fraction) = match mantissa.split_once(decimal as char) {
        Some((whole, fraction)) => (whole, Some(fraction)),
        None => (mantissa, None),
    };
    let whole = ungrouped(whole, decimal, lone || fraction.is_some())?;
    let mut number = whole;
    if let Some(fraction) = fraction {
        number.push('.');
        number.push_str(fraction);
    }
    if !exponent.is_empty() {
        number.push('e');
        number.push_str(&exponent[1..]);
    }
    point(number.as_bytes())
}

/// Digits without the separators of thousands; None where they are not in groups of three, or where there is only one and
/// it could be a decimal separator.
fn ungrouped(whole: &str, decimal: u8, lone: bool) -> Option<String> {
    let other = if decimal == b'.' { ',' } else { '.' };
    let Some(separator) = whole.chars().find(|c| !c.is_ascii_digit() && !matches!(c, '+' | '-')) else {
        return Some(whole.to_string());
    };
    if ![other, '\'', '\u{2019}', ' ', '\u{a0}', '\u{202f}'].contains(&separator) {
        return None;
    }
    let (sign, digits) = whole.split_at(usize::from(whole.starts_with(['+', '-'])));
    let groups: Vec<&str> = digits.split(separator).collect();
    let whole_groups = groups[1..].iter().all(|g| g.len() == 3) && (1..=3).contains(&groups[0].len());
    let all_digits = groups.iter().all(|g| g.bytes().all(|b| b.is_ascii_digit()));
    let sure = lone || separator != other || groups.len() > 2;
    (whole_groups && all_digits && sure).then(|| format!("{sign}{}", groups.concat()))
}

/// Whether a cell can only be a number with groups of thousands: both separators, or several groups.
pub(crate) fn proves_thousands(cell: &[u8], decimal: Decimal) -> bool {
    let (decimal, other) = match decimal {
        Decimal::Point => (b'.', b','),
        Decimal::Comma => (b',', b'.'),
        Decimal::Open => return false,
    };
    let cell = bare(cell);
    cell.contains(&other) && cell.first().is_some_and(|b| b.is_ascii_digit() || *b == b'-') && {
        point(cell).is_none() && comma(cell).is_none() && grouped(cell, decimal, false).is_some()
    }
}

/// Words for no value, in lower case.
const MISSING: [&str; 22] = [
    "nan", "+nan", "-nan", "n/a", "na", "#n/a", "null", "none", "-", "--", "---", "\u{2013}", "\u{2014}", "?", "#num!",
    "#div/0!", "#value!", "#ref!", "1.#qnan", "-1.#ind", "1.#ind", "nan(ind)",
];

/// Words for an infinite value, in lower case, without sign, and those of meters and loggers for a reading over their
/// range; `∞` is what PicoScope writes for that. They are read as infinite: no reading, whatever its sign.
const INFINITE: [&str; 17] = [
    "inf",
    "infinity",
    "\u{221e}",
    "1.#inf",
    "ol",
    "o.l",
    "o.l.",
    "0.l",
    "ovl",
    "ovld",
    "ovf",
    "ovfl",
    "ovrng",
    "over",
    "overload",
    "overrange",
    "overflow",
];

fn other(cell: &[u8]) -> Cell {
    if let Some(stamp) = stamp::parse(cell) {
        return Cell::Stamp(stamp);
    }
    if stamp::is_date(cell) {
        return Cell::Date;
    }
    if cell.len() > 12 {
        return Cell::Text;
    }
    let word = decode(cell).trim().to_lowercase();
    let (sign, size) = match word.strip_prefix(['-', '+']) {
        Some(size) if word.starts_with('-') => (-1.0, size),
        Some(size) => (1.0, size),
        None => (1.0, word.as_str()),
    };
    if word.is_empty() || word == "\u{1a}" {
        Cell::Empty
    } else if MISSING.contains(&word.as_str()) {
        Cell::Missing
    } else if INFINITE.contains(&size) {
        Cell::Number(sign * f64::INFINITY)
    } else {
        Cell::Text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(text: &str, decimal: Decimal, thousands: bool) -> Cell {
        Dialect { delimiter: Delimiter::Spaces, decimal, thousands }.cell(text.as_bytes())
    }

    #[test]
    fn numbers_are_read_in_every_notation() {
        for (text, want) in [("1.5", 1.5), ("+1.5e-3", 1.5e-3), ("1.5D+03", 1500.0), (".5", 0.5), ("5.", 5.0)] {
            assert_eq!(number(text, Decimal::Point, false), Cell::Number(want), "{text}");
        }
        for (text, want) in
            [("1,5", 1.5), ("-1.234,5", -1234.5), ("1.234.567", 1_234_567.0), ("1,5D-1", 0.15), ("7", 7.0)]
        {
            assert_eq!(number(text, Decimal::Comma, false), Cell::Number(want), "{text}");
        }
        assert_eq!(number("1'234.5", Decimal::Point, false), Cell::Number(1234.5));
        assert_eq!(number("1\u{a0}234,5", Decimal::Comma, false), Cell::Number(1234.5));
        assert_eq!(number("1,234.5", Decimal::Point, false), Cell::Number(1234.5));
        assert_eq!(number("-∞", Decimal::Point, false), Cell::Number(f64::NEG_INFINITY));
    }

    #[test]
    fn a_lone_separator_groups_thousands_only_where_the_file_proves_it() {
        assert_eq!(number("1.234", Decimal::Comma, false), Cell::Text);
        assert_eq!(number("1.234", Decimal::Comma, true), Cell::Number(1234.0));
        assert_eq!(number("1,23", Decimal::Point, true), Cell::Text);
        assert!(proves_thousands(b"1.234,5", Decimal::Comma) && !proves_thousands(b"1.234", Decimal::Comma));
    }

    #[test]
    fn words_for_no_value_are_missing_and_other_words_text() {
        for word in ["NaN", "n/a", "-", "#N/A", "\" NaN \""] {
            assert_eq!(number(word, Decimal::Point, false), Cell::Missing, "{word}");
        }
        for word in ["abc", "1.5 kN", "12a", "1-2", "--5"] {
            assert_eq!(number(word, Decimal::Point, false), Cell::Text, "{word}");
        }
        assert_eq!(number("  ", Decimal::Point, false), Cell::Empty);
    }

    #[test]
    fn words_for_a_reading_over_the_range_are_infinite() {
        for word in ["OL", "+OL", "OVER", "OVLD", "Overload", "O.L."] {
            assert_eq!(number(word, Decimal::Point, false), Cell::Number(f64::INFINITY), "{word}");
        }
        assert_eq!(number("-OL", Decimal::Point, false), Cell::Number(f64::NEG_INFINITY));
        assert_eq!(
            (number("---", Decimal::Point, false), number("Old", Decimal::Point, false)),
            (Cell::Missing, Cell::Text)
        );
    }

    #[test]
    fn the_first_separator_settles_an_open_decimal() {
        let mut dialect = Dialect { delimiter: Delimiter::Spaces, decimal: Decimal::Open, thousands: false };
        assert_eq!(dialect.cell(b"3"), Cell::Number(3.0));
        assert_eq!(dialect.decimal, Decimal::Open);
        assert_eq!(dialect.cell(b"0,5"), Cell::Number(0.5));
        assert_eq!(dialect.cell(b"0.5"), Cell::Text);
    }

    #[test]
    fn quotes_hold_delimiters_together() {
        let mut cells = Vec::new();
        let line = b"\"a, \"\"b\"\"\",2,";
        split(line, Delimiter::Byte(b','), &mut cells);
        let texts: Vec<String> = cells.iter().map(|c| text(&line[c.clone()])).collect();
        assert_eq!(texts, ["a, \"b\"", "2", ""]);
    }
}
