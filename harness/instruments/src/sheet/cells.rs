//! The cells of a sheet.

use crate::Fault;
use std::path::Path;

/// Cells that a sheet may have, empty ones between others with them: 1 GiB of memory.
const CELLS: usize = 1 << 25;
/// Empty cells between others that a sheet may have however few these are, and for each of these: a few cells far apart in a
/// small file take no more memory than it is worth.
const GAPS: usize = 1 << 20;
const GAPS_EACH: usize = 64;
/// Bytes of the texts of a sheet, each counted as often as it occurs, however few cells there are; and for each of these: a long
/// text that many cells share takes no more memory than they are worth.
const TEXTS: usize = 1 << 24;
const TEXTS_EACH: usize = 256;
/// Rows and columns of the largest sheets of today's programs.
const ROWS: usize = 1 << 20;
const COLUMNS: usize = 1 << 14;

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) enum Cell {
    #[default]
    Empty,
    Number(f64),
    /// Days since the start of 1970.
    Date(f64),
    /// A time of day or a duration, in days.
    Time(f64),
    Text(Box<str>),
    /// Such as `#DIV/0!`.
    Error(Box<str>),
}

/// A sheet: rows of cells, each as long as its last cell that is not empty.
#[derive(Debug, Default)]
pub(super) struct Sheet {
    pub name: String,
    pub rows: Vec<Vec<Cell>>,
    cells: usize,
    /// Those that the file holds, which are not empty; and copies of these.
    filled: usize,
    copies: usize,
    texts: usize,
}

/// All sheets of a file.
#[derive(Debug, Default)]
pub(super) struct Book {
    pub sheets: Vec<Sheet>,
    pub properties: Vec<(String, String)>,
    pub notes: Vec<String>,
}

impl Sheet {
    /// Samples that its table may have in all, with those that are missing.
    pub(super) fn most_samples(&self) -> usize {
        GAPS + GAPS_EACH * self.filled
    }

    pub(super) fn new(name: &str) -> Sheet {
        Sheet { name: name.into(), ..Sheet::default() }
    }

    /// Puts a cell at its place, counted from 0.
    ///
    /// # Errors
    /// Where the place lies beyond a sheet, or the sheet becomes too large.
    pub(super) fn put(&mut self, path: &Path, row: usize, column: usize, cell: Cell) -> Result<(), Fault> {
        self.filled += usize::from(cell != Cell::Empty);
        self.take(path, row, column, cell)
    }

    /// As [`Sheet::put`], a copy of a cell that the file holds once.
    ///
    /// # Errors
    /// As [`Sheet::put`]; where few cells have very many copies.
    pub(super) fn copy(&mut self, path: &Path, row: usize, column: usize, cell: Cell) -> Result<(), Fault> {
        self.copies += usize::from(cell != Cell::Empty);
        if self.copies > self.most_samples() {
            let cure = "take an undamaged copy, or export the sheet as text (CSV)";
            return Err(Fault::new(path, "few cells are repeated very often", cure).at(place(&self.name, row, column)));
        }
        self.take(path, row, column, cell)
    }

    fn take(&mut self, path: &Path, row: usize, column: usize, cell: Cell) -> Result<(), Fault> {
        if cell == Cell::Empty {
            return Ok(());
        }
        let fault = |what: &str| {
            Err(Fault::new(path, what, "take an undamaged copy, or export the sheet as text (CSV)")
                .at(place(&self.name, row, column)))
        };
        if row >= ROWS || column >= COLUMNS {
            return fault("the cell lies beyond the last row or column that a sheet can have");
        }
        let grown = (column + 1).saturating_sub(self.rows.get(row).map_or(0, Vec::len));
        if let Cell::Text(text) | Cell::Error(text) = &cell {
            self.texts += text.len();
        }
        if self.cells + grown > CELLS || self.texts > TEXTS + TEXTS_EACH * self.filled {
            return fault("the sheet has too many cells or too much text");
        }
        if self.cells + grown > GAPS + GAPS_EACH * self.filled + self.copies {
            return fault("the sheet holds few cells far apart");
        }
        self.cells += grown;
        if self.rows.len() <= row {
            self.rows.resize_with(row + 1, Vec::new);
        }
        if grown > 0 {
            self.rows[row].resize(column + 1, Cell::Empty);
        }
        self.rows[row][column] = cell;
        Ok(())
    }
}

/// A cell as programs name it: sheet, column in letters, row from 1.
pub(super) fn place(sheet: &str, row: usize, column: usize) -> String {
    format!("sheet \"{sheet}\", cell {}{}", letters(column), row + 1)
}

/// A column as programs name it: A, B ... Z, AA ...
pub(super) fn letters(column: usize) -> String {
    let last = char::from(b'A' + (column % 26) as u8);
    if column < 26 {
        last.to_string()
    } else {
        letters(column / 26 - 1) + &last.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_named_as_programs_name_them() {
        assert_eq!([letters(0), letters(25), letters(26), letters(701), letters(702)], ["A", "Z", "AA", "ZZ", "AAA"]);
        assert_eq!(place("Drop 1", 6, 1), "sheet \"Drop 1\", cell B7");
    }

    #[test]
    fn a_sheet_of_far_cells_is_refused_before_it_takes_memory() {
        let mut sheet = Sheet::new("far");
        let put = |sheet: &mut Sheet, row, column| sheet.put(Path::new("a.xlsx"), row, column, Cell::Number(1.0));
        assert!(put(&mut sheet, 1 << 20, 0).is_err());
        assert!(put(&mut sheet, 0, 1 << 14).is_err());
        let refused = (0..1 << 20).position(|row| put(&mut sheet, row, (1 << 14) - 1).is_err());
        assert_eq!(refused, Some(64), "a million cells in between");
        let mut sheet = Sheet::new("dense");
        for row in 0..40_000 {
            (0..30).for_each(|column| put(&mut sheet, row, 2 * column).unwrap());
        }
    }
}
