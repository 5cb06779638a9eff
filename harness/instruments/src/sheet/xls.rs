//! Excel files before 2007 are checked before `calamine` (0.38) takes them: it follows cycles of sectors without end,
//! and takes memory for the whole rectangle around the cells however far they lie apart.

use crate::Fault;
use std::io::{Cursor, Read};
use std::path::Path;

/// Bytes of a file, at most; a sheet of this format has no more than 65536 rows by 256 columns.
const LARGEST: u64 = 1 << 30;
/// Columns of a sheet of this format.
const COLUMNS: u32 = 256;
/// Records that place cells: row and column are their first two numbers of two bytes.
const CELLS: [u16; 11] = [0x0002, 0x0003, 0x0004, 0x0006, 0x00bd, 0x00d6, 0x00fd, 0x0203, 0x0204, 0x0205, 0x027e];
/// The record of several cells side by side, of six bytes each.
const SEVERAL: u16 = 0x00bd;
/// Records with which a sheet begins and ends, and that says where a sheet begins.
const BEGIN: u16 = 0x0809;
const END: u16 = 0x000a;
const SHEET: u16 = 0x0085;
/// The record that claims the rectangle around the cells, for which `calamine` takes memory.
const CLAIM: u16 = 0x0200;
/// Rows of a sheet of this format.
const ROWS: u64 = 1 << 16;
/// The rectangle around the cells of a sheet may be this large, and beyond it this many times the count of its cells.
const AREA: u64 = 1 << 20;
const SPARSE: u64 = 16;

/// The bytes of the file, whose sectors form no cycles and whose cells lie on a sheet.
pub(super) fn checked(path: &Path) -> Result<Vec<u8>, Fault> {
    let unreadable = |e| Fault::unreadable(path, e);
    let damaged = |e: std::io::Error| Fault::new(path, e, "take an undamaged copy of the file");
    let file = input::open(path).map_err(unreadable)?;
    if file.metadata().map_err(unreadable)?.len() > LARGEST {
        return Err(Fault::new(path, "the file has more than 1 GiB", "save it as XLSX or as text (CSV)"));
    }
    let mut bytes = Vec::new();
    file.take(LARGEST).read_to_end(&mut bytes).map_err(unreadable)?;
    let mut container = cfb::CompoundFile::open(Cursor::new(&bytes)).map_err(damaged)?;
    let streams: Vec<_> =
        container.walk().filter(|e| e.is_stream()).map(|e| (e.path().to_path_buf(), e.len())).collect();
    for (name, length) in streams {
        if length > bytes.len() as u64 {
            let what = format!("the part \"{}\" claims {length} bytes, more than the file has", name.display());
            return Err(Fault::new(path, what, "take an undamaged copy of the file"));
        }
        let mut stream = Vec::new();
        container.open_stream(&name).and_then(|s| s.take(length).read_to_end(&mut stream)).map_err(damaged)?;
        let is_book = name
            .file_name()
            .is_some_and(|n| ["workbook", "book"].contains(&n.to_string_lossy().to_lowercase().as_str()));
        if let Some(at) = is_book.then(|| far_cell(&stream)).flatten() {
            let fault = Fault::new(
                path,
                "a cell lies beyond the last column, or far from all others",
                "take an undamaged copy, or save it as XLSX",
            );
            return Err(fault.at(format!("byte {at} of the workbook")));
        }
    }
    Ok(bytes)
}

/// The cells of a sheet: how many, and the rectangle around them.
#[derive(Default)]
struct Cells {
    count: u64,
    rows: Option<(u32, u32)>,
    columns: Option<(u32, u32)>,
}

impl Cells {
    fn add(&mut self, row: u32, column: u32, count: u64) {
        let around = |range: Option<(u32, u32)>, at: u32| range.map_or((at, at), |(a, b)| (a.min(at), b.max(at)));
        self.count += count;
        self.rows = Some(around(self.rows, row));
        self.columns = Some(around(self.columns, column));
    }

    fn is_far(&self) -> bool {
        let length = |range: Option<(u32, u32)>| range.map_or(0, |(a, b)| u64::from(b - a) + 1);
        let area = length(self.rows) * length(self.columns);
        self.columns.is_some_and(|(_, last)| last >= COLUMNS) || area > AREA && area > SPARSE * self.count
    }
}

/// The records of a stream from a byte on: byte, kind and content.
fn records(stream: &[u8], from: usize) -> impl Iterator<Item = (usize, u16, &[u8])> {
    let mut at = from;
    std::iter::from_fn(move || {
        let content = at.checked_add(4)?;
        let (kind, length) = (word(stream, at)?, usize::from(word(stream, at + 2)?));
        let record = (at, kind, &stream[content..stream.len().min(content + length)]);
        at = content + length;
        Some(record)
    })
}

fn word(bytes: &[u8], at: usize) -> Option<u16> {
    let found = bytes.get(at..at.checked_add(2)?)?;
    Some(u16::from_le_bytes([found[0], found[1]]))
}

fn double_word(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from(word(bytes, at)?) | u32::from(word(bytes, at.checked_add(2)?)?) << 16)
}

/// Where the cells of a sheet lie too far apart, or beyond the last column, or a sheet claims that they do.
fn far_cell(stream: &[u8]) -> Option<usize> {
    let declared = records(stream, 0).filter(|(_, kind, _)| *kind == SHEET);
    let starts: Vec<usize> = declared.filter_map(|(_, _, of)| Some(double_word(of, 0)? as usize)).collect();
    starts.into_iter().find_map(|start| far_cell_of_sheet(stream, start))
}

fn far_cell_of_sheet(stream: &[u8], start: usize) -> Option<usize> {
    let mut cells = Cells::default();
    let mut last = start;
    let mut open = 0;
    for (at, kind, content) in records(stream, start) {
        match kind {
            BEGIN => open += 1,
            END if open <= 1 => break,
            END => open -= 1,
            CLAIM if !is_claim_fit(content) => return Some(at),
            _ => {}
        }
        if let (true, Some(row), Some(column)) = (CELLS.contains(&kind), word(content, 0), word(content, 2)) {
            let count = if kind == SEVERAL { content.len() as u64 / 6 } else { 1 };
            cells.add(row.into(), column.into(), count);
            last = at;
        }
    }
    cells.is_far().then_some(last)
}

/// Whether a rectangle of cells lies on a sheet: first row, row behind the last, first column, column behind the last.
/// Rows have two bytes in old files, four in newer ones.
fn is_claim_fit(content: &[u8]) -> bool {
    let short = |at| word(content, at).map(u64::from);
    let long = |at| double_word(content, at).map(u64::from);
    let claim = if content.len() < 14 { (short(0), short(2), short(6)) } else { (long(0), long(4), short(10)) };
    match claim {
        (Some(first), Some(behind), Some(columns)) => {
            (behind == 0 || first < behind) && behind <= ROWS && columns <= u64::from(COLUMNS)
        }
        _ => true,
    }
}

#[cfg(test)]
mod tests {
    use super::far_cell;

    /// A stream that says where its sheet begins, and the sheet's records.
    fn book(records: &[u8]) -> Vec<u8> {
        [&[0x85, 0, 4, 0, 8, 0, 0, 0][..], &[0x09, 0x08, 0, 0], records, &[0x0a, 0, 0, 0]].concat()
    }

    fn number(row: u16, column: u16) -> Vec<u8> {
        [&[0x03, 0x02, 14, 0][..], &row.to_le_bytes(), &column.to_le_bytes(), &[0; 10]].concat()
    }

    fn claim(first: u32, behind: u32, columns: u16) -> Vec<u8> {
        [
            &[0x00, 0x02, 14, 0][..],
            &first.to_le_bytes(),
            &behind.to_le_bytes(),
            &[0; 2],
            &columns.to_le_bytes(),
            &[0; 2],
        ]
        .concat()
    }

    #[test]
    fn cells_beyond_the_last_column_are_found() {
        assert_eq!(far_cell(&book(&[number(7, 0), number(7, 255)].concat())), None);
        assert_eq!(far_cell(&book(&[number(7, 0), number(7, 256)].concat())), Some(12 + 18));
        assert_eq!(far_cell(&book(&number(7, 256))[..19]), None);
    }

    #[test]
    fn cells_that_lie_far_apart_are_found() {
        let column: Vec<u8> = (0..60_000).flat_map(|row| number(row, 3)).collect();
        assert_eq!(far_cell(&book(&column)), None);
        assert_eq!(far_cell(&book(&[column, number(0, 20)].concat())), Some(12 + 60_000 * 18));
        assert_eq!(far_cell(&book(&[number(0, 0), number(65_535, 255)].concat())), Some(12 + 18));
    }

    #[test]
    fn claims_beyond_a_sheet_are_found() {
        for fit in [claim(0, 65_536, 256), claim(0, 0, 0), claim(5, 6, 1)] {
            assert_eq!(far_cell(&book(&fit)), None);
        }
        for far in [claim(0, 65_537, 1), claim(7, 7, 1), claim(9, 7, 1), claim(0, 1, 257), claim(u32::MAX, 1, 1)] {
            assert_eq!(far_cell(&book(&far)), Some(12));
        }
    }
}
