//! Spreadsheets: XLSX, XLSB, XLS and ODS. A sheet that holds numbers is a group; tables side by side are one group with
//! all columns. These formats pack all cells of a sheet into one stream, which is read whole. Values of formulas are
//! those that the writer stored. Dates and times count in s from the first.

mod cells;
mod excel;
mod layout;
mod ods;
mod packed;
mod table;
mod time;
mod xls;

use crate::{Fault, Format, Memory, Source};
use std::path::Path;

pub(crate) const FORMAT: Format = Format { name: "spreadsheet (XLSX, XLSB, XLS, ODS)", is, open };

/// Kinds of spreadsheet.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Sheets {
    Xlsx,
    Xlsb,
    Ods,
    Xls,
}

fn is(head: &[u8], extension: &str) -> bool {
    kind(head, extension).is_some()
}

/// The kind by the first bytes; among files of one container by the extension, then by what the container begins with.
fn kind(head: &[u8], extension: &str) -> Option<Sheets> {
    let holds = |text: &[u8]| head.windows(text.len()).any(|w| w == text);
    if head.starts_with(b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1") {
        return ["xls", "xlt"].contains(&extension).then_some(Sheets::Xls);
    }
    if !head.starts_with(b"PK\x03\x04") {
        return None;
    }
    match extension {
        "xlsx" | "xlsm" | "xltx" | "xltm" => Some(Sheets::Xlsx),
        "xlsb" => Some(Sheets::Xlsb),
        "ods" | "ots" => Some(Sheets::Ods),
        _ if holds(b"application/vnd.oasis.opendocument.spreadsheet") => Some(Sheets::Ods),
        _ if holds(b"xl/workbook.bin") => Some(Sheets::Xlsb),
        _ if holds(b"xl/") => Some(Sheets::Xlsx),
        _ => None,
    }
}

fn open(path: &Path) -> Result<Box<dyn Source>, Fault> {
    use std::io::Read;
    let fault = |e| Fault::unreadable(path, e);
    let mut head = Vec::new();
    input::open(path).map_err(fault)?.take(4096).read_to_end(&mut head).map_err(fault)?;
    let extension = path.extension().map_or(String::new(), |e| e.to_string_lossy().to_lowercase());
    let book = match kind(&head, &extension) {
        Some(Sheets::Ods) => ods::read(path),
        Some(Sheets::Xls) => excel::xls(path),
        Some(Sheets::Xlsb) => excel::xlsb(path),
        Some(Sheets::Xlsx) | None => excel::xlsx(path),
    }?;
    let mut memory = Memory { notes: book.notes, ..Memory::default() };
    let mut dates = table::dates(&book.sheets);
    dates.settle().map_err(|what| Fault::new(path, what, "write all dates in one order, such as 2024-05-31"))?;
    for sheet in book.sheets {
        table::take(sheet, &book.properties, dates, &mut memory);
    }
    if memory.groups.is_empty() {
        let what = format!(
            "no sheet holds a table of numbers{}",
            memory.notes.iter().map(|n| format!("; {n}")).collect::<String>()
        );
        return Err(Fault::new(path, what, "give a file with columns of numbers"));
    }
    Ok(Box::new(memory))
}
