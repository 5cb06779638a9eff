//! The table of numbers on a sheet.

use super::cells::{letters, place, Cell, Sheet};
use super::time;
use crate::table_head::{table_head, Kind, TableHead};
use crate::{Group, Memory};

/// Rows in which the head of a table is looked for.
const HEAD: usize = 1000;

/// Adds the group of a sheet to `memory`; nothing where no column holds numbers.
pub(super) fn take(sheet: Sheet, properties: &[(String, String)], memory: &mut Memory) {
    let top: Vec<Vec<String>> = sheet.rows.iter().take(HEAD).map(|row| row.iter().map(text).collect()).collect();
    let Some(head) = table_head(&top, kind) else { return };
    let mut group = Group { name: sheet.name.clone(), properties: head.properties.clone(), ..Group::default() };
    group.properties.extend_from_slice(properties);
    let mut all = Vec::new();
    for column in 0..head.numeric.len() {
        if !head.numeric[column] {
            memory.notes.extend(left_out(&sheet, &head, column));
            continue;
        }
        let (samples, bad) = samples(&sheet, head.rows, column);
        let mut channel = head.channels[column].clone();
        if let Some(first) = first_time(&sheet, head.rows, column) {
            if let Cell::Date(day) = first {
                let name = if channel.name.is_empty() { letters(column) } else { channel.name.clone() };
                group.properties.push((format!("{name}.first"), time::iso(*day)));
            }
            channel.unit = "s".into();
        }
        memory.notes.extend(bad);
        group.channels.push(channel);
        all.push(samples);
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

/// A cell as the head of a table shows it.
fn text(cell: &Cell) -> String {
    match cell {
        Cell::Empty | Cell::Error(_) => String::new(),
        Cell::Number(n) | Cell::Time(n) => n.to_string(),
        Cell::Date(day) => time::iso(*day),
        Cell::Text(text) => text.trim().to_string(),
    }
}

fn kind(text: &str) -> Kind {
    match text {
        "" => Kind::Empty,
        _ if text.parse::<f64>().is_ok() || time::date(text).is_some() => Kind::Number,
        _ => Kind::Text,
    }
}

/// The first date or time of a column whose samples begin with one.
fn first_time(sheet: &Sheet, from: usize, column: usize) -> Option<&Cell> {
    let mut cells = sheet.rows[from..].iter().filter_map(|row| row.get(column));
    cells.find(|c| !matches!(c, Cell::Empty | Cell::Error(_))).filter(|c| matches!(c, Cell::Date(_) | Cell::Time(_)))
}

/// The samples of a column from a row on, and a note where cells hold something else.
fn samples(sheet: &Sheet, from: usize, column: usize) -> (Vec<f64>, Option<String>) {
    let first = match first_time(sheet, from, column) {
        Some(Cell::Date(day) | Cell::Time(day)) => Some(*day),
        _ => None,
    };
    let mut bad: Option<(usize, String)> = None;
    let mut count = 0;
    let mut sample = |row: usize, cell: &Cell| {
        let number = match (cell, first) {
            (Cell::Date(day) | Cell::Time(day), Some(first)) => Ok((day - first) * 86_400.0),
            (Cell::Number(n), None) => Ok(*n),
            (Cell::Text(text), None) => text.trim().parse().map_err(|_| text.to_string()),
            (Cell::Error(text), _) => Err(text.to_string()),
            (Cell::Empty, _) => Ok(f64::NAN),
            (other, _) => Err(self::text(other)),
        };
        number.unwrap_or_else(|text| {
            count += 1;
            bad.get_or_insert((row, text));
            f64::NAN
        })
    };
    let rows = sheet.rows.iter().enumerate().skip(from);
    let samples = rows.map(|(i, row)| row.get(column).map_or(f64::NAN, |cell| sample(i, cell))).collect();
    let note = bad.map(|(row, text)| {
        let more = if count > 1 { format!(", and {} further cells below it", count - 1) } else { String::new() };
        format!("{}: `{text}` is no number{more}; read as missing", place(&sheet.name, row, column))
    });
    (samples, note)
}

/// A note for a column of text below the head.
fn left_out(sheet: &Sheet, head: &TableHead, column: usize) -> Option<String> {
    let below = sheet.rows.iter().enumerate().skip(head.rows);
    let (row, cell) = below.filter_map(|(i, row)| Some((i, row.get(column)?))).find(|(_, c)| **c != Cell::Empty)?;
    let name = &head.channels[column].name;
    let name = if name.is_empty() { letters(column) } else { name.clone() };
    Some(format!(
        "{}: column \"{name}\" left out, it holds text such as `{}`",
        place(&sheet.name, row, column),
        text(cell)
    ))
}
