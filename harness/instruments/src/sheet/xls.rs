//! Excel files before 2007 are checked before `calamine` (0.38) takes them: it follows cycles of sectors without end, and
//! takes memory for the whole rectangle around the cells however far they lie apart.

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
/// The record with which a sheet begins.
const BEGIN: u16 = 0x0809;
/// The rectangle around the cells of a sheet may be this large, and beyond it this many times the count of its cells.
const AREA: u64 = 1 << 20;
const SPARSE: u64 = 16;

/// The bytes of the file, whose sectors form no cycles and whose cells lie on a sheet.
pub(super) fn checked(path: &Path) -> Result<Vec<u8>, Fault> {
    let unreadable = |e: std::io::Error| Fault::new(path, e, "give a file that can be read");
    let damaged = |e: std::io::Error| Fault::new(path, e, "take an undamaged copy of the file");
    let file = std::fs::File::open(path).map_err(unreadable)?;
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

/// Where the cells of a sheet lie too far apart, or beyond the last column.
fn far_cell(stream: &[u8]) -> Option<usize> {
    let word = |at: usize| stream.get(at..at + 2).map(|b| u16::from_le_bytes([b[0], b[1]]));
    let (mut at, mut cells) = (0, Cells::default());
    while let (Some(kind), Some(length)) = (word(at), word(at + 2)) {
        let place = (word(at + 4), word(at + 6));
        if let (true, (Some(row), Some(column))) = (CELLS.contains(&kind) && length >= 4, place) {
            let count = if kind == SEVERAL { u64::from(length / 6) } else { 1 };
            cells.add(row.into(), column.into(), count);
        }
        let next = at + 4 + usize::from(length);
        let ends = word(next).is_none_or(|kind| kind == BEGIN);
        if ends && cells.is_far() {
            return Some(at);
        }
        if ends {
            cells = Cells::default();
        }
        at = next;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::far_cell;

    fn number(row: u16, column: u16) -> Vec<u8> {
        [&[0x03, 0x02, 14, 0][..], &row.to_le_bytes(), &column.to_le_bytes(), &[0; 10]].concat()
    }

    #[test]
    fn cells_beyond_the_last_column_are_found() {
        assert_eq!(far_cell(&[number(7, 0), number(7, 255)].concat()), None);
        assert_eq!(far_cell(&[number(7, 0), number(7, 256)].concat()), Some(18));
        assert_eq!(far_cell(&number(7, 256)[..7]), None);
    }

    #[test]
    fn cells_that_lie_far_apart_are_found() {
        let column: Vec<u8> = (0..60_000).flat_map(|row| number(row, 3)).collect();
        assert_eq!(far_cell(&column), None);
        assert_eq!(far_cell(&[column, number(0, 20)].concat()), Some(60_000 * 18));
        assert_eq!(far_cell(&[number(0, 0), number(65_535, 255)].concat()), Some(18));
        let begin = [0x09, 0x08, 0, 0];
        assert_eq!(far_cell(&[&number(0, 0)[..], &begin, &number(65_535, 255)].concat()), None);
    }
}
