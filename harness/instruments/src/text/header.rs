//! What the lines above a table say: names, units, properties, steps of time.

use super::cell::{split, text, Cell, Decimal, Delimiter, Dialect};
use super::layout::{comment, is_blank, Kind};
use super::unit;
use crate::lines::decode;
use crate::{Channel, Clock};

/// Properties of a table, at most.
pub(crate) const PROPERTIES: usize = 1000;

/// What a header tells of a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Header {
    /// Of every column.
    pub channels: Vec<Channel>,
    pub properties: Vec<(String, String)>,
}

/// Reads the lines above a table.
pub(crate) fn read(lines: &[Vec<u8>], dialect: Dialect, kinds: &[Kind]) -> Header {
    let shown: Vec<(&[u8], bool)> = lines
        .iter()
        .map(|l| comment(l, dialect.delimiter).map_or((l.as_slice(), false), |inner| (inner, true)))
        .collect();
    let used: Vec<usize> = (0..kinds.len()).filter(|c| kinds[*c] != Kind::Open).collect();
    let width = used.last().map_or(0, |c| c + 1);
    let above = above(&shown, dialect, &used, width);
    let (names, units) = choose(&above, dialect, &used);
    let cell = |row: Option<usize>, c: usize| row.and_then(|r| above[r].1.get(c)).map_or("", String::as_str);
    let channels = (0..kinds.len()).map(|c| channel(cell(names, c), cell(units, c))).collect();
    let mut header = Header { channels, properties: Vec::new() };
    let taken: Vec<usize> = [names, units].into_iter().flatten().map(|r| above[r].0).collect();
    for (i, (line, _)) in shown.iter().enumerate() {
        if taken.contains(&i) || is_blank(line, dialect.delimiter) || header.properties.len() >= PROPERTIES {
            continue;
        }
        labelled(&row_cells(line, dialect, width), &used, &mut header.channels);
        header.properties.push(property(line, dialect));
    }
    steps_beside_names(&above, names, units, &used, &mut header.properties);
    header
}

/// A channel of a cell of names and a cell of units.
fn channel(name: &str, unit: &str) -> Channel {
    if unit.is_empty() {
        let (name, unit) = unit::of_name(name);
        return Channel { name, unit };
    }
    Channel { name: name.to_string(), unit: unit::inner(unit).unwrap_or(unit).to_string() }
}

/// The lines right above the table that have a cell for its columns, the lowest first: index and cells.
fn above(lines: &[(&[u8], bool)], dialect: Dialect, used: &[usize], width: usize) -> Vec<(usize, Vec<String>)> {
    let mut rows = Vec::new();
    for (i, (line, _)) in lines.iter().enumerate().rev() {
        if is_blank(line, dialect.delimiter) {
            if rows.is_empty() {
                continue;
            }
            break;
        }
        let cells = row_cells(line, dialect, width);
        let filled = used.iter().filter(|c| cells.get(**c).is_some_and(|t| !t.is_empty())).count();
        let sentence =
            width == 1 && cells.first().is_some_and(|t| t.contains(": ") || t.contains('=') || t.ends_with(':'));
        let exact = dialect.delimiter != Delimiter::Spaces || cells.len() == width;
        // a label to the left of the table: `labelled` takes such lines
        let label = !used.contains(&0) && cells.first().is_some_and(|t| !t.is_empty());
        // the column of an index may be without a name
        let index = cells.first().is_some_and(String::is_empty) && filled > 0 && filled + 1 == used.len();
        if filled * 2 <= used.len() && !index || sentence || label || !exact || rows.len() == 6 {
            break;
        }
        rows.push((i, cells));
    }
    rows
}

/// The cells of a header line for `width` columns. It may have another delimiter than the table.
fn row_cells(line: &[u8], dialect: Dialect, width: usize) -> Vec<String> {
    let with = |delimiter| {
        let mut cells = Vec::new();
        split(line, delimiter, &mut cells);
        let mut cells: Vec<String> = cells.iter().map(|c| text(&line[c.clone()])).collect();
        while cells.len() > width && cells.last().is_some_and(String::is_empty) {
            cells.pop();
        }
        cells
    };
    let own = with(dialect.delimiter);
    if dialect.delimiter != Delimiter::Spaces {
        if own.len() == 1 && width > 1 {
            let other = [b'\t', b';', b',', b'|'].map(Delimiter::Byte).map(with).into_iter().find(|c| c.len() == width);
            return other.unwrap_or(own);
        }
        return own;
    }
    let others = || [b'\t', b';', b',', b'|'].map(Delimiter::Byte).map(with).into_iter();
    if own.len() == width {
        return others().find(|c| c.len() == width && width > 1).unwrap_or(own);
    }
    let wide: Vec<String> =
        decode(line).split("  ").flat_map(|c| c.split('\t')).map(|c| c.trim().to_string()).collect();
    let wide: Vec<String> = wide.into_iter().filter(|c| !c.is_empty()).collect();
    let joined = join_units(&own);
    [wide, joined].into_iter().chain(others()).find(|c| c.len() == width).unwrap_or(own)
}

/// Words with the bracketed unit behind them: `Time`, `[s]` is one name.
fn join_units(words: &[String]) -> Vec<String> {
    let mut joined: Vec<String> = Vec::new();
    for word in words {
        match joined.last_mut() {
            Some(last) if unit::inner(word).is_some() => *last = format!("{last} {word}"),
            _ => joined.push(word.clone()),
        }
    }
    joined
}

/// Which of the lines above are names and units: the units are the lowest line of units with a line above it; the names
/// stand above the units, or right above the table.
fn choose(above: &[(usize, Vec<String>)], dialect: Dialect, used: &[usize]) -> (Option<usize>, Option<usize>) {
    let units =
        (0..above.len().saturating_sub(1)).find(|r| is_units(&above[*r].1, used) && names_above(&above[r + 1].1, used));
    if let Some(units) = units {
        return (Some(units + 1), Some(units));
    }
    match above.first() {
        Some((_, cells)) if all_bracketed(cells, used) => (None, Some(0)),
        Some((_, cells)) if is_names(cells, dialect, used) => (Some(0), None),
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

/// Whether the line above a line of units holds names: a text first, such as the `x-axis,1,2` of Keysight.
fn names_above(cells: &[String], used: &[usize]) -> bool {
    filled(cells, used).next().is_some_and(|t| !t.starts_with(|c: char| c.is_ascii_digit())) || used.len() == 1
}

/// Whether a line right above a table holds names: more texts than numbers.
fn is_names(cells: &[String], mut dialect: Dialect, used: &[usize]) -> bool {
    let number = |t: &str, dialect: &mut Dialect| dialect.cell(t.as_bytes()).is_value();
    let numbers = filled(cells, used).filter(|t| number(t, &mut dialect)).count();
    filled(cells, used).count() > 2 * numbers
}

/// Takes names and units from a line that begins with a label, such as `TraceName` and `VUnit` of Yokogawa and
/// `Vertical Units` of Tektronix, where the lines above the table did not give them.
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

/// A header line as (name, text): `name: text`, `name = text`, `name;text`; else as a line.
fn property(line: &[u8], dialect: Dialect) -> (String, String) {
    let mut places = Vec::new();
    let mut cells = Vec::new();
    if let Delimiter::Byte(_) = dialect.delimiter {
        split(line, dialect.delimiter, &mut places);
        cells = places.iter().map(|c| text(&line[c.clone()])).filter(|t| !t.is_empty()).collect();
    }
    if cells.len() > 1 {
        let name = cells.remove(0);
        return (name.trim_end_matches([':', '=']).trim().to_string(), cells.join("; "));
    }
    let line = text(line);
    let pair = line.split_once(": ").or_else(|| line.split_once('=')).or_else(|| line.split_once([':', '\t', ';']));
    match pair {
        Some((name, value)) if !name.trim().is_empty() => (name.trim().to_string(), value.trim().to_string()),
        _ => ("header".to_string(), line.trim_end_matches([',', ';', ':']).to_string()),
    }
}

/// Start and step that Rigol writes behind the names: `X,CH1,Start,Increment` above `Sequence,Volt,-6.0E-04,1.0E-06`, or
/// `CH1V,t0 = -6.0E-04s,tInc = 1.0E-06`.
fn steps_beside_names(
    above: &[(usize, Vec<String>)],
    names: Option<usize>,
    units: Option<usize>,
    used: &[usize],
    properties: &mut Vec<(String, String)>,
) {
    let Some(names) = names.map(|r| &above[r].1) else { return };
    for (c, name) in names.iter().enumerate().filter(|(c, _)| !used.contains(c)) {
        let below = units.and_then(|r| above[r].1.get(c)).filter(|t| !t.is_empty());
        match (below, name.split_once('=')) {
            (Some(below), _) => properties.push((name.clone(), below.clone())),
            (None, Some((name, value))) => properties.push((name.trim().to_string(), value.trim().to_string())),
            _ => {}
        }
    }
}

/// Names of a step in seconds, of a rate in Hz and of the first time, in lower case without spaces and signs.
const STEPS: [&str; 12] = [
    "increment",
    "tinc",
    "xinc",
    "xincrement",
    "sampleinterval",
    "samplinginterval",
    "timestep",
    "dt",
    "deltat",
    "deltax",
    "hresolution",
    "sampleperiod",
];
const RATES: [&str; 9] = [
    "samplerate",
    "samplingrate",
    "samplefrequency",
    "samplingfrequency",
    "abtastrate",
    "abtastfrequenz",
    "fs",
    "rate",
    "scanrate",
];
const STARTS: [&str; 7] = ["start", "t0", "xorg", "xorigin", "hoffset", "starttime", "firstsampletime"];

/// The steps of time that properties tell; None where they do not.
pub(crate) fn clock(properties: &[(String, String)]) -> Option<Clock> {
    let find = |names: &[&str], to_unit: fn(&str) -> Option<f64>| {
        properties.iter().find_map(|(name, value)| {
            let (name, of_name) = unit::of_name(name);
            let plain: String = name.to_lowercase().chars().filter(char::is_ascii_alphanumeric).collect();
            names.contains(&plain.as_str()).then(|| quantity(value, &of_name, to_unit)).flatten()
        })
    };
    let rate = || find(&RATES, hertz).filter(|r| *r > 0.0).map(f64::recip);
    let step = find(&STEPS, seconds).or_else(rate).filter(|s| s.is_finite() && *s > 0.0)?;
    Some(Clock { start: find(&STARTS, seconds).unwrap_or(0.0), step })
}

/// A number with a unit behind it, or else with that of its name.
fn quantity(value: &str, unit_of_name: &str, to_unit: fn(&str) -> Option<f64>) -> Option<f64> {
    let value = value.split(';').next()?.trim();
    let mut end = value.find(|c: char| !(c.is_ascii_digit() || "+-.,eE".contains(c))).unwrap_or(value.len());
    end -= usize::from(end < value.len() && value[..end].ends_with(['e', 'E']));
    let mut dialect = Dialect { delimiter: Delimiter::Spaces, decimal: Decimal::Open, thousands: false };
    let Cell::Number(number) = dialect.cell(value[..end].as_bytes()) else { return None };
    let unit = value[end..].trim();
    let unit = unit::inner(unit).unwrap_or(unit);
    Some(number * to_unit(if unit.is_empty() { unit_of_name } else { unit })?)
}

fn seconds(unit: &str) -> Option<f64> {
    match unit.to_lowercase().as_str() {
        "" | "s" | "sec" | "second" | "seconds" => Some(1.0),
        "ms" => Some(1e-3),
        "us" | "\u{b5}s" | "\u{3bc}s" => Some(1e-6),
        "ns" => Some(1e-9),
        _ => None,
    }
}

fn hertz(unit: &str) -> Option<f64> {
    match unit.to_lowercase().as_str() {
        "" | "hz" | "s/s" | "sa/s" | "1/s" => Some(1.0),
        "khz" | "ks/s" | "ksa/s" => Some(1e3),
        "mhz" | "ms/s" | "msa/s" => Some(1e6),
        "gs/s" | "gsa/s" | "ghz" => Some(1e9),
        _ => None,
    }
}

/// Gives the columns of a Tektronix file without names what the metadata to their left says: `cells` holds, of the first
/// lines, each label's column, its text and the text beside it.
pub(crate) fn beside(cells: &[(usize, String, String)], kinds: &[Kind], channels: &mut [Channel]) {
    for (column, label, value) in cells {
        let right: Vec<usize> = (column + 1..kinds.len())
            .skip_while(|c| kinds[*c] == Kind::Text)
            .take_while(|c| kinds[*c] != Kind::Text)
            .filter(|c| kinds[*c] == Kind::Number)
            .collect();
        let [x, y, ..] = right.as_slice() else { continue };
        match label.to_lowercase().as_str() {
            "source" => channels[*y].name = value.clone(),
            "vertical units" => channels[*y].unit = value.clone(),
            "horizontal units" => channels[*x].unit = value.clone(),
            _ => {}
        }
    }
}
