//! What stands above the samples of a table: names, units, and rows that describe.

use super::cell::Dialect;
use super::unit;
use crate::Channel;

/// Properties of a table, at most.
pub(crate) const PROPERTIES: usize = 1000;
/// Rows directly above the samples that may hold names and units, at most.
const TITLES: usize = 6;

/// A row above a table.
pub(crate) struct Row {
    pub cells: Vec<String>,
    /// Whether it has the table's columns: it may hold names or units.
    pub fits: bool,
    /// What it says where it holds neither.
    pub property: (String, String),
}

/// What the rows above a table hold.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Head {
    /// Of every column.
    pub channels: Vec<Channel>,
    pub properties: Vec<(String, String)>,
}

/// Reads the rows above a table, None for a blank one. `used` are the columns that may hold samples, of `columns`;
/// `dialect` distinguishes numbers from texts.
pub(crate) fn read(rows: &[Option<Row>], dialect: Dialect, used: &[usize], columns: usize) -> Head {
    let above = above(rows, used);
    let (names, units) = choose(&above, dialect, used);
    let cell = |row: Option<usize>, c: usize| row.and_then(|r| above[r].1.get(c)).map_or("", String::as_str);
    let channels = (0..columns).map(|c| channel(cell(names, c), cell(units, c))).collect();
    let mut head = Head { channels, properties: Vec::new() };
    let taken: Vec<usize> = [names, units].into_iter().flatten().map(|r| above[r].0).collect();
    let others = rows.iter().enumerate().filter(|(i, _)| !taken.contains(i)).filter_map(|(_, row)| row.as_ref());
    for row in others.take(PROPERTIES) {
        labelled(&row.cells, used, &mut head.channels);
        head.properties.push(row.property.clone());
    }
    steps_beside_names(&above, names, units, used, &mut head.properties);
    head
}

/// A channel of a cell of names and a cell of units.
fn channel(name: &str, unit: &str) -> Channel {
    if unit.is_empty() {
        let (name, unit) = unit::of_name(name);
        return Channel { name, unit };
    }
    Channel { name: name.to_string(), unit: unit::inner(unit).unwrap_or(unit).to_string() }
}

/// The rows right above the table that have a cell for its columns, the lowest first: index and cells.
fn above<'a>(rows: &'a [Option<Row>], used: &[usize]) -> Vec<(usize, &'a [String])> {
    let one_column = used.last() == Some(&0);
    let mut above: Vec<(usize, &[String])> = Vec::new();
    for (i, row) in rows.iter().enumerate().rev() {
        // a blank row may part units in brackets from the names above them
        let over_units = match above.as_slice() {
            [(_, units)] => all_bracketed(units, used),
            _ => false,
        };
        let Some(row) = row else {
            if above.is_empty() || over_units {
                continue;
            }
            break;
        };
        let cells = &row.cells;
        if above.is_empty() && used.len() > 1 && is_unmeasured(cells) {
            continue;
        }
        let filled = filled(cells, used).count();
        let sentence =
            one_column && cells.first().is_some_and(|t| t.contains(": ") || t.contains('=') || t.ends_with(':'));
        // a label to the left of the table: `labelled` takes such rows
        let names = over_units && filled == used.len();
        let label = !used.contains(&0) && cells.first().is_some_and(|t| !t.is_empty()) && !names;
        // the column of an index may be without a name
        let index = cells.first().is_some_and(String::is_empty) && filled > 0 && filled + 1 == used.len();
        if filled * 2 <= used.len() && !index || sentence || label || !row.fits || above.len() == TITLES {
            break;
        }
        above.push((i, cells.as_slice()));
    }
    above
}

/// Whether a row is of a sample that was not taken: the number of the sample with a word behind it, as in `17 (invalid)`.
fn is_unmeasured(cells: &[String]) -> bool {
    let mut filled = cells.iter().filter(|t| !t.is_empty());
    let (Some(cell), None) = (filled.next(), filled.next()) else { return false };
    let word = cell.trim_start_matches(|c: char| c.is_ascii_digit());
    word.len() < cell.len() && word.trim_start().starts_with('(')
}

/// Which of the rows above are names and units: the units are the lowest row of units with a row above it; the names
/// stand above the units, or right above the table, seldom with the units above them.
fn choose(above: &[(usize, &[String])], dialect: Dialect, used: &[usize]) -> (Option<usize>, Option<usize>) {
    let units =
        (0..above.len().saturating_sub(1)).find(|r| is_units(above[*r].1, used) && names_above(above[r + 1].1, used));
    if let Some(units) = units {
        return (Some(units + 1), Some(units));
    }
    match above {
        [(_, cells), ..] if all_bracketed(cells, used) => (None, Some(0)),
        [(_, cells), (_, over), ..] if is_names(cells, dialect, used) && is_units(over, used) => (Some(0), Some(1)),
        [(_, cells), ..] if is_names(cells, dialect, used) => (Some(0), None),
        _ => (None, None),
    }
}

fn filled<'a>(cells: &'a [String], used: &'a [usize]) -> impl Iterator<Item = &'a str> {
    used.iter().filter_map(|c| cells.get(*c)).map(String::as_str).filter(|t| !t.is_empty())
}

fn all_bracketed(cells: &[String], used: &[usize]) -> bool {
    filled(cells, used).all(|t| unit::inner(t).is_some())
}

/// Units that are also common symbols of quantities, and so common as names.
const SYMBOLS: [&str; 11] = ["F", "T", "U", "R", "C", "G", "K", "d", "h", "t", "V"];

/// At least half of the cells are units, and the others could be: short, without a digit at their beginning.
fn is_units(cells: &[String], used: &[usize]) -> bool {
    let is_known = |t: &&str| unit::of_row(t).is_some() && !matches!(*t, "1" | "-");
    let known = filled(cells, used).filter(is_known).count();
    let could = |t: &str| {
        let starts = t.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '.' | '+'));
        matches!(t, "1" | "-") || unit::of_row(t).is_some() || t.chars().count() <= 12 && !t.contains(' ') && !starts
    };
    let count = filled(cells, used).count();
    let sure = filled(cells, used).filter(is_known).any(|t| !SYMBOLS.contains(&t));
    let time = filled(cells, used).any(|t| t == "t");
    sure && !time && known * 2 >= count && filled(cells, used).all(could)
}

/// Whether the row above a row of units holds names: a text first, such as the `x-axis,1,2` of Keysight.
fn names_above(cells: &[String], used: &[usize]) -> bool {
    filled(cells, used).next().is_some_and(|t| !t.starts_with(|c: char| c.is_ascii_digit())) || used.len() == 1
}

/// Whether a row right above a table holds names: more texts than numbers.
fn is_names(cells: &[String], mut dialect: Dialect, used: &[usize]) -> bool {
    let mut numbers = 0;
    filled(cells, used).for_each(|t| numbers += usize::from(dialect.cell(t.as_bytes()).is_value()));
    filled(cells, used).count() > 2 * numbers
}

/// Takes names and units from a row that begins with a label, such as `TraceName` and `VUnit` of Yokogawa and
/// `Vertical Units` of Tektronix, where the rows above the table did not give them.
fn labelled(cells: &[String], used: &[usize], channels: &mut [Channel]) {
    let Some(label) = cells.first().map(|l| l.trim_end_matches(':').to_lowercase()) else { return };
    let values: Vec<usize> = used.iter().copied().filter(|c| *c > 0).collect();
    let give = |set: fn(&mut Channel) -> &mut String, channels: &mut [Channel]| {
        if values.iter().all(|c| set(&mut channels[*c]).is_empty()) {
            for c in &values {
                *set(&mut channels[*c]) = cells.get(*c).cloned().unwrap_or_default();
            }
        }
    };
    match label.as_str() {
        "vertical units" | "vunit" | "unit" | "units" | "einheit" | "einheiten" => give(|c| &mut c.unit, channels),
        "tracename" | "channel name" | "channel names" | "signal name" | "kanalname" => give(|c| &mut c.name, channels),
        "horizontal units" | "horizontal unit" if used.first() == Some(&0) && channels[0].unit.is_empty() => {
            channels[0].unit = cells.get(1).cloned().unwrap_or_default();
        }
        _ => {}
    }
}

/// A row as (name, text), by its cells that are not empty: the first is the name; of one cell `name: text` or
/// `name = text` is parted.
pub(crate) fn property(cells: &[String]) -> (String, String) {
    let name = |text: &str| text.trim_end_matches([':', '=']).trim().to_string();
    match cells {
        [] => (String::new(), String::new()),
        [line] => {
            let pair =
                line.split_once(": ").or_else(|| line.split_once('=')).or_else(|| line.split_once([':', '\t', ';']));
            match pair {
                Some((name, value)) if !name.trim().is_empty() => (name.trim().to_string(), value.trim().to_string()),
                _ => ("header".to_string(), line.trim_end_matches([',', ';', ':']).to_string()),
            }
        }
        [first, number, of] if unit::is_unit(of) && !matches!(of.as_str(), "1" | "-") => {
            (name(first), format!("{number} {of}"))
        }
        [first, rest @ ..] => (name(first), rest.join("; ")),
    }
}

/// Start and step that Rigol writes behind the names: `X,CH1,Start,Increment` above `Sequence,Volt,-6.0E-04,1.0E-06`, or
/// `CH1V,t0 = -6.0E-04s,tInc = 1.0E-06`.
fn steps_beside_names(
    above: &[(usize, &[String])],
    names: Option<usize>,
    units: Option<usize>,
    used: &[usize],
    properties: &mut Vec<(String, String)>,
) {
    let Some(names) = names.map(|r| above[r].1) else { return };
    for (c, name) in names.iter().enumerate().filter(|(c, _)| used.binary_search(c).is_err()) {
        let below = units.and_then(|r| above[r].1.get(c)).filter(|t| !t.is_empty());
        match (below, name.split_once('=')) {
            (Some(below), _) => properties.push((name.clone(), below.clone())),
            (None, Some((name, value))) => properties.push((name.trim().to_string(), value.trim().to_string())),
            _ => {}
        }
    }
}
