//! The lines above a table as rows of cells.

use super::layout::{comment, is_blank, Kind};
use crate::shared::cell::{split, text, Delimiter, Dialect};
use crate::shared::head::{self, property, Head, Row};
use crate::shared::lines::decode;
use crate::shared::unit;
use crate::Channel;

/// Reads the lines above a table.
pub(crate) fn read(lines: &[Vec<u8>], dialect: Dialect, kinds: &[Kind]) -> Head {
    let used: Vec<usize> = (0..kinds.len()).filter(|c| kinds[*c] != Kind::Open).collect();
    let width = used.last().map_or(0, |c| c + 1);
    let row = |line: &Vec<u8>| {
        let line = comment(line, dialect.delimiter).unwrap_or(line);
        (!is_blank(line, dialect.delimiter)).then(|| {
            let cells = row_cells(line, dialect, width);
            let fits = dialect.delimiter != Delimiter::Spaces || cells.len() == width;
            Row { cells, fits, property: property(&filled(line, dialect)) }
        })
    };
    let rows: Vec<Option<Row>> = lines.iter().map(row).collect();
    head::read(&rows, dialect, &used, kinds.len())
}

/// The cells of a line that are not empty; the whole line where it is of one.
fn filled(line: &[u8], dialect: Dialect) -> Vec<String> {
    let mut places = Vec::new();
    if let Delimiter::Byte(_) = dialect.delimiter {
        split(line, dialect.delimiter, &mut places);
    }
    let cells: Vec<String> = places.iter().map(|c| text(&line[c.clone()])).filter(|t| !t.is_empty()).collect();
    if cells.len() > 1 {
        cells
    } else {
        vec![text(line)]
    }
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
        return input::whole_names(own, width);
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
