//! The table of numbers on a sheet.

use super::cells::{letters, place, Cell, Sheet};
use super::layout::{layout, Kind, Layout};
use super::time;
use crate::shared::cell::{proves_thousands, Cell as Text, Decimal, Delimiter, Dialect};
use crate::shared::head::{self, property, Head, Row};
use crate::shared::stamp::{self, Dates, Elapsed};
use crate::shared::{clock, unit};
use crate::{Group, Memory};

/// Rows in which the head of a table is looked for, and which show how texts write numbers.
const HEAD: usize = 1000;

/// Adds the group of a sheet to `memory`; nothing where no column holds numbers.
pub(super) fn take(sheet: Sheet, properties: &[(String, String)], dates: Dates, memory: &mut Memory) {
    let dialect = dialect(&sheet);
    let kinds: Vec<Vec<Kind>> =
        sheet.rows.iter().take(HEAD).map(|row| row.iter().map(|c| kind(c, dialect)).collect()).collect();
    let Some(layout) = layout(&kinds) else { return };
    let head = head(&sheet, &layout, dialect);
    let mut group = Group { name: sheet.name.clone(), properties: head.properties, ..Group::default() };
    group.clock = clock::of_properties(&group.properties);
    group.properties.extend_from_slice(properties);
    let mut all = Vec::new();
    let (starts, ends) = (starts(&sheet, layout.first, layout.numeric.len()), ends(&sheet, layout.numeric.len()));
    let mut left = sheet.most_samples();
    for (column, mut channel) in head.channels.into_iter().enumerate() {
        if !layout.numeric[column] {
            memory.notes.extend(starts[column].map(|row| left_out(&sheet, row, column, &channel.name)));
            continue;
        }
        let Some(rest) = left.checked_sub(ends[column].saturating_sub(layout.first)) else {
            let at = letters(column);
            memory.notes.push(format!(
                "sheet \"{}\": its columns hold few cells far apart; those from {at} on are left out",
                sheet.name
            ));
            break;
        };
        left = rest;
        let read = samples(&sheet, layout.first..ends[column].max(layout.first), column, dialect, dates);
        if let Some(day) = read.first_day {
            let name = if channel.name.is_empty() { letters(column) } else { channel.name.clone() };
            group.properties.push((format!("{name}.first"), time::iso(day)));
        }
        if read.is_time {
            channel.unit = "s".into();
        }
        memory.notes.extend(read.note);
        group.channels.push(channel);
        all.push(read.samples);
    }
    if group.channels.iter().any(|c| unit::is_time(&c.name, &c.unit)) {
        group.clock = None;
    }
    // a table ends with its last number
    let last = |s: &Vec<f64>| s.iter().rposition(|n| !n.is_nan()).map_or(0, |at| at + 1);
    let longest = all.iter().map(last).max().unwrap_or(0);
    all.iter_mut().for_each(|s| s.truncate(longest));
    if longest > 0 {
        group.samples = longest as u64;
        memory.groups.push(group);
        memory.samples.push(all);
    }
}

/// In which order the dates are that all sheets hold as texts.
pub(super) fn dates(sheets: &[Sheet]) -> Dates {
    let mut dates = Dates::default();
    for sheet in sheets {
        let width = sheet.rows.iter().map(Vec::len).max().unwrap_or(0);
        let mut elapsed: Vec<Elapsed> = (0..width).map(|_| Elapsed::default()).collect();
        for row in &sheet.rows {
            for (cell, elapsed) in row.iter().zip(&mut elapsed) {
                let Cell::Text(text) = cell else { continue };
                if let Some(stamp) = stamp::parse(text.trim().as_bytes()) {
                    elapsed.seconds(stamp, &mut dates);
                }
            }
        }
    }
    dates
}

/// How the sheet's texts write numbers: with the decimal separator that reads more of them.
fn dialect(sheet: &Sheet) -> Dialect {
    let of = |decimal| Dialect { delimiter: Delimiter::Spaces, decimal, thousands: false };
    let texts = || {
        sheet.rows.iter().take(HEAD).flatten().filter_map(|cell| match cell {
            Cell::Text(text) => Some(text.as_bytes()),
            _ => None,
        })
    };
    let count = |decimal| texts().filter(|t| of(decimal).cell(t).is_value()).count();
    let decimal = if count(Decimal::Comma) > count(Decimal::Point) { Decimal::Comma } else { Decimal::Point };
    Dialect { thousands: texts().any(|t| proves_thousands(t, decimal)), ..of(decimal) }
}

fn kind(cell: &Cell, mut dialect: Dialect) -> Kind {
    match cell {
        Cell::Empty | Cell::Error(_) => Kind::Empty,
        Cell::Number(_) | Cell::Date(_) | Cell::Time(_) => Kind::Number,
        Cell::Text(text) => match dialect.cell(text.as_bytes()) {
            Text::Empty | Text::Missing => Kind::Empty,
            Text::Number(_) | Text::Stamp(_) => Kind::Number,
            Text::Date | Text::Text => Kind::Text,
        },
    }
}

/// Names, units and properties of the rows above the samples.
fn head(sheet: &Sheet, layout: &Layout, dialect: Dialect) -> Head {
    let row = |cells: &Vec<Cell>| {
        let cells: Vec<String> = cells.iter().map(text).collect();
        let filled: Vec<String> = cells.iter().filter(|c| !c.is_empty()).cloned().collect();
        (!filled.is_empty()).then(|| Row { cells, fits: true, property: property(&filled) })
    };
    let rows: Vec<Option<Row>> = sheet.rows[..layout.first].iter().map(row).collect();
    let used: Vec<usize> = (0..layout.numeric.len()).filter(|c| layout.numeric[*c]).collect();
    head::read(&rows, dialect, &used, layout.numeric.len())
}

/// A cell as the head of a table shows it.
fn text(cell: &Cell) -> String {
    match cell {
        Cell::Empty | Cell::Error(_) => String::new(),
        Cell::Number(n) | Cell::Time(n) => n.to_string(),
        Cell::Date(day) => time::iso(*day),
        Cell::Text(text) => text.trim().to_string(),
    }
}

/// A column of samples.
struct Column {
    samples: Vec<f64>,
    /// Whether it holds times: its samples are s since the first.
    is_time: bool,
    /// The day that its first date names, since the start of 1970.
    first_day: Option<f64>,
    /// Where a cell holds something else.
    note: Option<String>,
}

/// What the first sample of a column is; the others must be alike.
enum First {
    Number,
    /// A date or a time, in days.
    Day(f64),
    Stamp(Elapsed),
}

/// Of each of `width` columns, the first row from `from` on in which it holds anything.
fn starts(sheet: &Sheet, from: usize, width: usize) -> Vec<Option<usize>> {
    let mut starts = vec![None; width];
    for (row, cells) in sheet.rows.iter().enumerate().skip(from) {
        for (start, _) in starts.iter_mut().zip(cells).filter(|(s, c)| s.is_none() && **c != Cell::Empty) {
            *start = Some(row);
        }
    }
    starts
}

/// Of each of `width` columns, the row behind its last cell.
fn ends(sheet: &Sheet, width: usize) -> Vec<usize> {
    let mut ends = vec![0; width];
    // a row is as long as its last cell: the columns from the longest row below on are not in any
    let mut below = 0;
    for (row, cells) in sheet.rows.iter().enumerate().rev() {
        let here = cells.len().min(width);
        if here > below {
            ends[below..here].fill(row + 1);
            below = here;
        }
    }
    ends
}

/// The samples of a column in some rows.
fn samples(
    sheet: &Sheet,
    rows: std::ops::Range<usize>,
    column: usize,
    mut dialect: Dialect,
    mut dates: Dates,
) -> Column {
    let mut first: Option<First> = None;
    let mut first_day = None;
    let mut sample = |cell: &Cell| -> Option<f64> {
        let read = match cell {
            Cell::Text(text) => dialect.cell(text.as_bytes()),
            Cell::Number(n) => Text::Number(*n),
            Cell::Empty => Text::Empty,
            Cell::Error(_) => Text::Text,
            Cell::Date(day) | Cell::Time(day) => {
                if first.is_none() {
                    first_day = matches!(cell, Cell::Date(_)).then_some(*day);
                }
                let First::Day(first) = first.get_or_insert(First::Day(*day)) else { return None };
                return Some((day - *first) * 86_400.0);
            }
        };
        match read {
            Text::Empty | Text::Missing => Some(f64::NAN),
            Text::Number(n) => matches!(first.get_or_insert(First::Number), First::Number).then_some(n),
            Text::Stamp(stamp) => match first.get_or_insert_with(|| First::Stamp(Elapsed::default())) {
                First::Stamp(elapsed) => Some(elapsed.seconds(stamp, &mut dates)),
                _ => None,
            },
            Text::Date | Text::Text => None,
        }
    };
    let mut bad: Option<(usize, &Cell)> = None;
    let mut count = 0;
    let mut samples = Vec::with_capacity(rows.len());
    for (row, cells) in sheet.rows.iter().enumerate().take(rows.end).skip(rows.start) {
        let cell = cells.get(column).unwrap_or(&Cell::Empty);
        samples.push(sample(cell).unwrap_or_else(|| {
            count += 1;
            bad.get_or_insert((row, cell));
            f64::NAN
        }));
    }
    let note = bad.map(|(row, cell)| {
        let read = match cell {
            Cell::Error(text) => text.to_string(),
            other => text(other),
        };
        let more = if count > 1 { format!(", and {} further cells below it", count - 1) } else { String::new() };
        format!("{}: `{read}` is no number{more}; read as missing", place(&sheet.name, row, column))
    });
    Column { samples, is_time: matches!(first, Some(First::Day(_) | First::Stamp(_))), first_day, note }
}

/// A note for a column of text below the head, which begins in `row`.
fn left_out(sheet: &Sheet, row: usize, column: usize, name: &str) -> String {
    let name = if name.is_empty() { letters(column) } else { name.to_string() };
    let at = place(&sheet.name, row, column);
    let cell = sheet.rows[row].get(column).map_or_else(String::new, text);
    format!("{at}: column \"{name}\" left out, it holds text such as `{cell}`")
}
