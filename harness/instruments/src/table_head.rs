//! What stands above the samples of a table of cells: names, units, and lines that describe.

use crate::Channel;

/// What a cell holds, for finding where the samples begin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Kind {
    /// Nothing, or a mark of a missing value.
    Empty,
    Number,
    Text,
}

/// The head of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct TableHead {
    /// Rows above the first row of samples.
    pub rows: usize,
    /// Of each column: whether it holds numbers.
    pub numeric: Vec<bool>,
    /// Of each column, with or without numbers.
    pub channels: Vec<Channel>,
    /// The lines above names and units: (name, text); the name is empty for a line of one text.
    pub properties: Vec<(String, String)>,
}

/// Rows that are looked at to tell which columns hold numbers.
const LOOKED_AT: usize = 1000;
/// Rows directly above the samples that may hold names and units.
const TITLES: usize = 3;

/// The head of the table whose first rows are `rows`; `kind` tells what a cell holds. None where no column holds
/// numbers.
pub(crate) fn table_head(rows: &[Vec<String>], kind: impl Fn(&str) -> Kind) -> Option<TableHead> {
    let width = rows.iter().map(Vec::len).max()?;
    let kinds: Vec<Vec<Kind>> = rows.iter().take(LOOKED_AT).map(|r| r.iter().map(|c| kind(c)).collect()).collect();
    let numeric: Vec<bool> = (0..width).map(|column| is_numeric(&kinds, column)).collect();
    let columns: Vec<usize> = (0..width).filter(|&c| numeric[c]).collect();
    if columns.is_empty() {
        return None;
    }
    let first = first_row(&kinds, &columns)?;
    let above: Vec<usize> = (0..first).filter(|&r| rows[r].iter().any(|c| !c.trim().is_empty())).collect();
    let (names, units) = titles(rows, &above, &columns);
    let of = |row: Option<usize>, c: usize| row.and_then(|r| rows[r].get(c)).map_or("", |t| t.trim());
    let channels = (0..width).map(|c| channel(of(names, c), of(units, c))).collect();
    let described = above.iter().filter(|&&r| Some(r) != names && Some(r) != units);
    Some(TableHead { rows: first, numeric, channels, properties: described.map(|&r| property(&rows[r])).collect() })
}

/// A column holds numbers where its lower half does: there are no names and descriptions there.
fn is_numeric(kinds: &[Vec<Kind>], column: usize) -> bool {
    let count = |of: Kind, rows: &[Vec<Kind>]| rows.iter().filter(|r| r.get(column) == Some(&of)).count();
    let lower = &kinds[kinds.len() / 2..];
    let (numbers, texts) = (count(Kind::Number, lower), count(Kind::Text, lower));
    if numbers + texts > 0 {
        return numbers > 0 && numbers >= texts;
    }
    // a column that ends early: its last cell tells
    kinds.iter().rev().filter_map(|r| r.get(column)).find(|k| **k != Kind::Empty) == Some(&Kind::Number)
}

/// The first row in which the numeric columns hold numbers and no text, and so does the row below it.
fn first_row(kinds: &[Vec<Kind>], columns: &[usize]) -> Option<usize> {
    let count = |row: usize, of: Kind| columns.iter().filter(|&&c| kinds[row].get(c) == Some(&of)).count();
    let samples = |row: usize| count(row, Kind::Number) * 2 >= columns.len() && count(row, Kind::Text) == 0;
    let some = |row: usize| count(row, Kind::Number) > 0 && count(row, Kind::Text) == 0;
    let found = (0..kinds.len()).find(|&r| samples(r) && (r + 1 == kinds.len() || count(r + 1, Kind::Text) == 0));
    found.or_else(|| (0..kinds.len()).find(|&r| some(r)))
}

/// The rows of names and of units, among those directly above the samples.
fn titles(rows: &[Vec<String>], above: &[usize], columns: &[usize]) -> (Option<usize>, Option<usize>) {
    let filled = |r: usize| columns.iter().filter(|&&c| rows[r].get(c).is_some_and(|t| !t.trim().is_empty())).count();
    let near: Vec<usize> =
        above.iter().rev().take(TITLES).copied().take_while(|&r| filled(r) * 2 >= columns.len()).collect();
    let is_units = |r: usize| {
        let cells = columns.iter().filter_map(|&c| rows[r].get(c)).map(|t| t.trim()).filter(|t| !t.is_empty());
        cells.clone().count() > 0 && cells.clone().all(is_unit) && (near.len() > 1 || cells.clone().all(is_bracketed))
    };
    let units = near.iter().copied().find(|&r| is_units(r));
    let names = near.iter().copied().find(|&r| Some(r) != units && !(is_units(r) && units.is_none()));
    (names, units)
}

/// A name that carries its unit, such as `Force [kN]`, `Force (kN)` or `Force / kN`, is split; a row of units counts
/// more.
fn channel(name: &str, unit: &str) -> Channel {
    let unit = bare(unit).to_string();
    match split(name) {
        Some((name, own)) if unit.is_empty() => Channel { name: name.into(), unit: own.into() },
        _ => Channel { name: name.into(), unit },
    }
}

fn split(name: &str) -> Option<(&str, &str)> {
    let bracketed = |open: char, close: char| {
        let (first, last) = name.strip_suffix(close)?.rsplit_once(open)?;
        (!first.trim().is_empty()).then_some((first.trim(), last.trim()))
    };
    let found = bracketed('[', ']').or_else(|| bracketed('(', ')').filter(|(_, unit)| is_unit(unit)));
    found.or_else(|| {
        name.rsplit_once(" / ").map(|(n, u)| (n.trim(), u.trim())).filter(|(n, u)| !n.is_empty() && is_unit(u))
    })
}

fn is_bracketed(text: &str) -> bool {
    bare(text).len() < text.len()
}

/// A unit without the brackets around it.
fn bare(unit: &str) -> &str {
    let inner = |open, close| unit.strip_prefix(open)?.strip_suffix(close);
    inner('[', ']').or_else(|| inner('(', ')')).unwrap_or(unit).trim()
}

/// Whether a text reads as a unit: factors of known units with their prefixes and powers, or a mark for none.
fn is_unit(text: &str) -> bool {
    let text = bare(text);
    if matches!(text, "-" | "--" | "1" | "%" | "") {
        return true;
    }
    let factors: Vec<&str> = text.split(['/', '*', '·', '.', ' ', '(', ')']).filter(|f| !f.is_empty()).collect();
    !factors.is_empty() && factors.iter().all(|f| is_factor(f))
}

fn is_factor(factor: &str) -> bool {
    const UNITS: &str =
        "m s g N Pa V A W J Hz K °C C F °F Ω Ohm ohm T H rad deg ° % bar psi in inch ft lb lbf kip min h \
        sec rpm gn eps ε strain counts count cts ADU bit bits dB l L t e pC mol cd VA mV/V S samples u/min U/min °/s";
    const PREFIXED: &str = "m s g N Pa V A W J Hz Ω Ohm ohm T H rad bar C F S eps ε strain l L e psi";
    const PREFIXES: [&str; 10] = ["n", "u", "µ", "μ", "m", "c", "d", "k", "M", "G"];
    let root = factor.trim_end_matches(|c: char| c.is_ascii_digit() || "^-+²³⁻¹".contains(c));
    let is = |list: &str, unit: &str| list.split_whitespace().any(|u| u == unit);
    let prefixed = PREFIXES.iter().any(|p| root.strip_prefix(p).is_some_and(|unit| is(PREFIXED, unit)));
    matches!(factor, "1") || is(UNITS, root) || prefixed
}

/// A line above the table as (name, text).
fn property(cells: &[String]) -> (String, String) {
    let cells: Vec<&str> = cells.iter().map(|c| c.trim()).filter(|c| !c.is_empty()).collect();
    let (name, text) = match cells[..] {
        [one] => {
            one.split_once([':', '=']).filter(|(name, _)| name.chars().any(char::is_alphabetic)).unwrap_or(("", one))
        }
        [name, ..] => (name.trim_end_matches([':', '=']), ""),
        [] => ("", ""),
    };
    let text = if cells.len() > 1 { cells[1..].join(" ") } else { text.trim().to_string() };
    (name.trim().to_string(), text)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kind(cell: &str) -> Kind {
        match cell {
            "" | "NaN" => Kind::Empty,
            _ if cell.parse::<f64>().is_ok() => Kind::Number,
            _ => Kind::Text,
        }
    }

    fn head(text: &str) -> TableHead {
        let rows: Vec<Vec<String>> = text.lines().map(|l| l.split(';').map(str::to_string).collect()).collect();
        table_head(&rows, kind).expect("a table")
    }

    fn channels(of: &TableHead) -> Vec<(&str, &str)> {
        of.channels.iter().map(|c| (c.name.as_str(), c.unit.as_str())).collect()
    }

    #[test]
    fn names_units_and_lines_above_are_told_apart() {
        let of = head("Drop test 7\nDate: 2024-03-12\nRate;1000;Hz\n\nTime;Force\ns;kN\n0;1\n1;2\n2;3");
        assert_eq!((of.rows, channels(&of)), (6, vec![("Time", "s"), ("Force", "kN"), ("", "")]));
        let told: Vec<(&str, &str)> = of.properties.iter().map(|(n, t)| (n.as_str(), t.as_str())).collect();
        assert_eq!(told, [("", "Drop test 7"), ("Date", "2024-03-12"), ("Rate", "1000 Hz")]);
    }

    #[test]
    fn units_in_names_and_in_brackets_are_found() {
        let of = head("Time [s];Force (kN);Path / mm;Ratio (new)\n0;1;2;3\n1;2;3;4");
        assert_eq!(channels(&of), [("Time", "s"), ("Force", "kN"), ("Path", "mm"), ("Ratio (new)", "")]);
        let of = head("t;a;v\n[s];[m/s²];[m s-1]\n0;1;2\n1;2;3");
        assert_eq!(channels(&of), [("t", "s"), ("a", "m/s²"), ("v", "m s-1")]);
    }

    #[test]
    fn names_that_read_as_units_stay_names() {
        let of = head("s;N;A\n0;1;2\n1;2;3");
        assert_eq!(channels(&of), [("s", ""), ("N", ""), ("A", "")]);
        let of = head("s;F\nmm;N\n0;1\n1;2");
        assert_eq!(channels(&of), [("s", "mm"), ("F", "N")]);
    }

    #[test]
    fn units_above_names_are_found() {
        let of = head("ms;kN\nTime;Force\n0;1\n1;2");
        assert_eq!(channels(&of), [("Time", "ms"), ("Force", "kN")]);
    }

    #[test]
    fn a_table_without_a_head_begins_at_once() {
        let of = head("0;1\n1;2");
        assert_eq!((of.rows, of.numeric, of.properties.len()), (0, vec![true, true], 0));
    }

    #[test]
    fn columns_of_text_and_columns_that_end_early_are_told() {
        let of = head("a;b;c\n1;x;5\n2;y;6\n3;z;\n4;z;\n5;z;\n6;z;\n7;z;");
        assert_eq!(of.numeric, [true, false, true]);
        assert_eq!(of.rows, 1);
    }

    #[test]
    fn cells_without_numbers_are_no_table() {
        assert_eq!(table_head(&[vec!["a".into()], vec!["b".into()]], kind), None);
        assert_eq!(table_head(&[], kind), None);
    }
}
