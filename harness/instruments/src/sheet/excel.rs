//! Excel's formats, by the crate `calamine`.

use super::cells::{Book, Cell, Sheet};
use super::time;
use super::{packed, xls};
use crate::shared::date;
use crate::shared::guard::guarded;
use crate::Fault;
use calamine::{Data, DataRef, ExcelDateTime, Reader, SheetType, WorkbookProperties, Xls, Xlsb, Xlsx};
use quick_xml::events::Event;
use std::borrow::Cow;
use std::fs::File;
use std::io::{BufReader, Cursor};
use std::path::Path;
use zip::ZipArchive;

/// Day 0 of Excel's two calendars, in days since the start of 1970.
const ZERO: f64 = -25_569.0;
const ZERO_1904: f64 = -24_107.0;

fn damaged(path: &Path, e: &dyn std::fmt::Display) -> Fault {
    Fault::new(path, e, "open it in its program and save it anew, or export its sheets as text (CSV)")
}

fn damaged_sheet(path: &Path, name: &str, e: &dyn std::fmt::Display) -> Fault {
    damaged(path, e).at(format!("sheet \"{name}\""))
}

/// The sheet `name` of the cells that `next` gives, one after another.
fn sheet<'a, E: std::fmt::Display>(
    path: &Path,
    name: &str,
    mut next: impl FnMut() -> Result<Option<calamine::Cell<DataRef<'a>>>, E>,
) -> Result<Sheet, Fault> {
    let mut sheet = Sheet::new(name);
    while let Some(cell) = next().map_err(|e| damaged_sheet(path, name, &e))? {
        let (row, column) = cell.get_position();
        sheet.put(path, row as usize, column as usize, of_ref(cell.get_value()))?;
    }
    Ok(sheet)
}

fn buffered(path: &Path) -> Result<BufReader<File>, Fault> {
    input::open(path).map(BufReader::new).map_err(|e| Fault::unreadable(path, e))
}

/// Reads a workbook in XML.
pub(super) fn xlsx(path: &Path) -> Result<Book, Fault> {
    check_texts(path, &mut packed::archive(path)?)?;
    guarded(path, || {
        let mut file = Xlsx::new(buffered(path)?).map_err(|e| damaged(path, &e))?;
        let mut book =
            Book { properties: file.workbook_properties().map(properties).unwrap_or_default(), ..Book::default() };
        for name in names(&file) {
            let mut cells = file.worksheet_cells_reader(&name).map_err(|e| damaged_sheet(path, &name, &e))?;
            book.sheets.push(sheet(path, &name, || cells.next_cell())?);
        }
        Ok(book)
    })
}

/// Checks the count of texts that a workbook claims: `calamine` (0.38) takes memory for it.
fn check_texts(path: &Path, archive: &mut ZipArchive<BufReader<File>>) -> Result<(), Fault> {
    let names: Result<Vec<String>, _> = archive.file_names().map(|n| n.map(Cow::into_owned)).collect();
    let mut names = names.map_err(|e| damaged(path, &e))?;
    names.retain(|n| n.to_lowercase().ends_with("sharedstrings.xml"));
    for name in names {
        let at = |e: &dyn std::fmt::Display| damaged(path, e).at(format!("part \"{name}\""));
        let part = archive.by_name(&name).map_err(|e| at(&e))?;
        let size = part.size();
        let mut reader = quick_xml::Reader::from_reader(BufReader::new(part));
        let mut buffer = Vec::new();
        loop {
            buffer.clear();
            let event = reader.read_event_into(&mut buffer).map_err(|e| at(&e))?;
            let start = match &event {
                Event::Start(e) | Event::Empty(e) => e,
                Event::Eof => break,
                _ => continue,
            };
            let declared = start.try_get_attribute("uniqueCount").map_err(|e| at(&e))?;
            let count = declared.and_then(|a| a.value.trim().parse::<u64>().ok());
            if count.is_some_and(|n| n > size) {
                return Err(at(&"it claims more texts than it can hold"));
            }
            if start.local_name().as_ref() == "sst" {
                break;
            }
        }
    }
    Ok(())
}

/// Reads a workbook in Excel's binary records in a zip file.
pub(super) fn xlsb(path: &Path) -> Result<Book, Fault> {
    packed::archive(path)?;
    guarded(path, || {
        let mut file = Xlsb::new(buffered(path)?).map_err(|e| damaged(path, &e))?;
        let mut book =
            Book { properties: file.workbook_properties().map(properties).unwrap_or_default(), ..Book::default() };
        for name in names(&file) {
            let mut cells = file.worksheet_cells_reader(&name).map_err(|e| damaged_sheet(path, &name, &e))?;
            book.sheets.push(sheet(path, &name, || cells.next_cell())?);
        }
        Ok(book)
    })
}

/// Reads a workbook of Excel before 2007.
pub(super) fn xls(path: &Path) -> Result<Book, Fault> {
    guarded(path, || {
        let bytes = xls::checked(path)?;
        let mut file: Xls<_> = Xls::new(Cursor::new(bytes)).map_err(|e| damaged(path, &e))?;
        let mut book = Book::default();
        for name in names(&file) {
            let range = file.worksheet_range(&name).map_err(|e| damaged_sheet(path, &name, &e))?;
            let (first_row, first_column) = range.start().unwrap_or((0, 0));
            let mut sheet = Sheet::new(&name);
            for (row, column, value) in range.used_cells() {
                sheet.put(path, first_row as usize + row, first_column as usize + column, of_data(value))?;
            }
            book.sheets.push(sheet);
        }
        Ok(book)
    })
}

/// The sheets of cells; charts and macros are none.
fn names<RS: std::io::Read + std::io::Seek>(of: &impl Reader<RS>) -> Vec<String> {
    let sheets = of.sheets_metadata().iter().filter(|s| s.typ == SheetType::WorkSheet);
    sheets.map(|s| s.name.clone()).collect()
}

fn properties(of: WorkbookProperties) -> Vec<(String, String)> {
    let named =
        [("title", of.title), ("creator", of.creator), ("created", of.created), ("description", of.description)];
    named.into_iter().filter_map(|(name, text)| Some((name.to_string(), text.filter(|t| !t.is_empty())?))).collect()
}

fn of_ref(value: &DataRef) -> Cell {
    match value {
        DataRef::SharedString(text) => Cell::Text((*text).into()),
        other => of_data(&Data::from(other.clone())),
    }
}

fn of_data(value: &Data) -> Cell {
    match value {
        Data::Empty => Cell::Empty,
        Data::Int(n) => Cell::Number(*n as f64),
        Data::Float(n) => Cell::Number(*n),
        Data::Bool(b) => Cell::Number(f64::from(u8::from(*b))),
        Data::DateTime(d) => date(d),
        Data::DateTimeIso(text) => time::date(text).map_or_else(|| Cell::Text(text.as_str().into()), Cell::Date),
        Data::DurationIso(text) => time::duration(text).map_or_else(|| Cell::Text(text.as_str().into()), Cell::Time),
        Data::Error(e) => Cell::Error(e.to_string().into()),
        Data::String(text) if text.is_empty() => Cell::Empty,
        Data::String(text) => Cell::Text(text.as_str().into()),
    }
}

/// A day number of Excel; below 1 it is a time of day.
fn date(of: &ExcelDateTime) -> Cell {
    let days = of.as_f64();
    if of.is_duration() || (0.0..1.0).contains(&days) {
        return Cell::Time(days);
    }
    let (year, month, day, ..) = of.to_ymd_hms_milli();
    let written = date::days(year.into(), month.into(), day.into()) as f64;
    // calamine does not give the calendar of the file; its date does
    let zero = if (written - days - ZERO).abs() < 10.0 { ZERO } else { ZERO_1904 };
    Cell::Date(days + zero)
}
