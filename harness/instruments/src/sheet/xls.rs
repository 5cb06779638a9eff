//! Excel files before 2007 are checked before `calamine` (0.38) takes them: it follows cycles of sectors without end, and
//! takes memory for the whole rectangle of cells however far they lie apart.

use crate::Fault;
use std::io::{Cursor, Read};
use std::path::Path;

/// Bytes of a file, at most; a sheet of this format has no more than 65536 rows by 256 columns.
const LARGEST: u64 = 1 << 30;
/// Columns of a sheet of this format.
const COLUMNS: u16 = 256;
/// Records that place a cell: row and column are their first two numbers of two bytes.
const CELLS: [u16; 11] =
    [0x0002, 0x0003, 0x0004, 0x0006, 0x00bd, 0x00d6, 0x00fd, 0x0203, 0x0204, 0x0205, 0x027e];

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
    let streams: Vec<_> = container.walk().filter(|e| e.is_stream()).map(|e| (e.path().to_path_buf(), e.len())).collect();
    for (name, length) in streams {
        if length > bytes.len() as u64 {
            let what = format!("the part \"{}\" claims {length} bytes, more than the file has", name.display());
            return Err(Fault::new(path, what, "take an undamaged copy of the file"));
        }
        let mut stream = Vec::new();
        container.open_stream(&name).and_then(|s| s.take(length).read_to_end(&mut stream)).map_err(damaged)?;
        let is_book = name.file_name().is_some_and(|n| ["workbook", "book"].contains(&n.to_string_lossy().to_lowercase().as_str()));
        if let Some(at) = is_book.then(|| far_cell(&stream)).flatten() {
            let fault = Fault::new(path, "a cell lies beyond the last column", "take an undamaged copy of the file");
            return Err(fault.at(format!("byte {at} of the workbook")));
        }
    }
    Ok(bytes)
}

/// Where a record places a cell beyond the last column.
fn far_cell(stream: &[u8]) -> Option<usize> {
    let word = |at: usize| stream.get(at..at + 2).map(|b| u16::from_le_bytes([b[0], b[1]]));
    let mut at = 0;
    while let (Some(kind), Some(length)) = (word(at), word(at + 2)) {
        if CELLS.contains(&kind) && length >= 4 && word(at + 6).is_some_and(|column| column >= COLUMNS) {
            return Some(at);
        }
        at += 4 + usize::from(length);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::far_cell;

    #[test]
    fn a_cell_beyond_the_last_column_is_found() {
        let number = |column: u16| [&[0x03, 0x02, 14, 0, 7, 0][..], &column.to_le_bytes(), &[0; 10]].concat();
        assert_eq!(far_cell(&[number(0), number(255)].concat()), None);
        assert_eq!(far_cell(&[number(0), number(256)].concat()), Some(18));
        assert_eq!(far_cell(&number(256)[..7]), None);
    }
}
