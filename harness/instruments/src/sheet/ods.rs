//! OpenDocument sheets: <https://docs.oasis-open.org/office/OpenDocument/v1.3/>. Our own reader, since that of
//! `calamine` 0.38 does not end where the content ends within a table, and spreads repeated cells without a limit of
//! memory.

use super::cells::{Book, Cell, Sheet};
use super::{packed, time};
use crate::Fault;
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};
use std::io::BufReader;
use std::path::Path;

/// Characters of a cell's text.
const TEXT: usize = 1 << 16;

/// What was read so far.
struct Content<'a> {
    path: &'a Path,
    book: Book,
    sheet: Option<Sheet>,
    row: usize,
    column: usize,
    /// How often the row stands one below the other.
    rows: usize,
    cell: Option<Open>,
    /// Open elements, and open notes on a cell among them.
    depth: usize,
    notes: usize,
}

/// The cell that is being read.
struct Open {
    value: Cell,
    is_error: bool,
    /// How often the cell stands side by side.
    columns: usize,
    text: String,
}

/// Reads all sheets.
pub(super) fn read(path: &Path) -> Result<Book, Fault> {
    let mut archive = packed::archive(path)?;
    let damaged = |e: &dyn std::fmt::Display| Fault::new(path, e, "open it in its program and save it anew");
    let part = archive.by_name("content.xml").map_err(|e| damaged(&e).at("part \"content.xml\""))?;
    let mut reader = Reader::from_reader(BufReader::new(part));
    reader.config_mut().expand_empty_elements = true;
    let book = Book::default();
    let mut content = Content { path, book, sheet: None, row: 0, column: 0, rows: 1, cell: None, depth: 0, notes: 0 };
    let mut buffer = Vec::new();
    loop {
        let at = format!("part \"content.xml\", byte {}", reader.buffer_position());
        let event = reader.read_event_into(&mut buffer).map_err(|e| damaged(&e).at(&at))?;
        match event {
            Event::Eof if content.depth == 0 => return Ok(content.book),
            Event::Eof => return Err(damaged(&"the content ends within an element").at(at)),
            event => content.take(&event).map_err(|e| if e.place.is_some() { e } else { e.at(at) })?,
        }
        buffer.clear();
    }
}

impl Content<'_> {
    fn take(&mut self, event: &Event) -> Result<(), Fault> {
        match event {
            Event::Start(e) => {
                self.depth += 1;
                self.start(e)
            }
            Event::End(e) => {
                self.depth = self.depth.saturating_sub(1);
                self.end(e.name().0)
            }
            Event::Text(t) => {
                self.text(&t.xml10_content());
                Ok(())
            }
            Event::GeneralRef(r) => {
                let named = |name: &str| quick_xml::escape::resolve_predefined_entity(name).map(str::to_string);
                let text = r.resolve_char_ref().ok().flatten().map(String::from).or_else(|| named(&r.xml10_content()));
                self.text(&text.unwrap_or_default());
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn start(&mut self, e: &BytesStart) -> Result<(), Fault> {
        match e.name().0 {
            "table:table" => {
                self.sheet = Some(Sheet::new(&self.attribute(e, "table:name")?.unwrap_or_default()));
                (self.row, self.column) = (0, 0);
            }
            "table:table-row" => {
                self.column = 0;
                self.rows = self.count(e, "table:number-rows-repeated")?;
            }
            "table:table-cell" | "table:covered-table-cell" => self.cell = Some(self.open(e)?),
            "office:annotation" => self.notes += 1,
            "text:tab" | "text:s" => self.text(" "),
            _ => {}
        }
        Ok(())
    }

    fn end(&mut self, name: &str) -> Result<(), Fault> {
        match name {
            "table:table" => self.book.sheets.extend(self.sheet.take()),
            "table:table-row" => self.end_row()?,
            "table:table-cell" | "table:covered-table-cell" => self.end_cell()?,
            "office:annotation" => self.notes = self.notes.saturating_sub(1),
            _ => {}
        }
        Ok(())
    }

    fn text(&mut self, text: &str) {
        if let Some(cell) = self.cell.as_mut().filter(|c| self.notes == 0 && c.text.len() + text.len() <= TEXT) {
            cell.text.push_str(text);
        }
    }

    fn open(&self, e: &BytesStart) -> Result<Open, Fault> {
        let number = |text: Option<String>| match text {
            Some(text) => match text.trim().parse() {
                Ok(number) => Ok(Cell::Number(number)),
                Err(_) => Err(Fault::new(self.path, format!("`{text}` is no number"), "correct the cell's value")),
            },
            None => Ok(Cell::Empty),
        };
        let dated = |text: Option<String>, of: fn(&str) -> Option<f64>, cell: fn(f64) -> Cell| {
            text.map_or(Cell::Empty, |text| of(&text).map_or_else(|| Cell::Text(text.as_str().into()), cell))
        };
        let value = match self.attribute(e, "office:value-type")?.as_deref() {
            Some("float" | "percentage" | "currency") => number(self.attribute(e, "office:value")?)?,
            Some("date") => dated(self.attribute(e, "office:date-value")?, time::date, Cell::Date),
            Some("time") => dated(self.attribute(e, "office:time-value")?, time::duration, Cell::Time),
            Some("boolean") => {
                let is = self.attribute(e, "office:boolean-value")?.is_some_and(|v| v.eq_ignore_ascii_case("true"));
                Cell::Number(f64::from(u8::from(is)))
            }
            Some("string") => Cell::Text(self.attribute(e, "office:string-value")?.unwrap_or_default().into()),
            _ => Cell::Empty,
        };
        let is_error = self.attribute(e, "calcext:value-type")?.as_deref() == Some("error");
        Ok(Open { value, is_error, columns: self.count(e, "table:number-columns-repeated")?, text: String::new() })
    }

    fn end_cell(&mut self) -> Result<(), Fault> {
        let (Some(cell), Some(sheet)) = (self.cell.take(), self.sheet.as_mut()) else { return Ok(()) };
        // programs show an error in the text, some with a value of 0
        let shows_error = cell.text.starts_with('#') || cell.text.starts_with("Err:");
        let value = match cell.value {
            _ if cell.is_error => Cell::Error(cell.text.into()),
            Cell::Number(_) if shows_error => Cell::Error(cell.text.into()),
            Cell::Text(text) if text.is_empty() && cell.text.is_empty() => Cell::Empty,
            Cell::Text(text) if text.is_empty() => Cell::Text(cell.text.into()),
            value => value,
        };
        if value != Cell::Empty {
            for column in self.column..self.column.saturating_add(cell.columns) {
                match column == self.column {
                    true => sheet.put(self.path, self.row, column, value.clone())?,
                    false => sheet.copy(self.path, self.row, column, value.clone())?,
                }
            }
        }
        self.column = self.column.saturating_add(cell.columns);
        Ok(())
    }

    /// A row that stands several times is copied, unless it is empty.
    fn end_row(&mut self) -> Result<(), Fault> {
        let Some(sheet) = self.sheet.as_mut() else { return Ok(()) };
        let cells = sheet.rows.get(self.row).cloned().unwrap_or_default();
        let below = self.row.saturating_add(self.rows);
        if !cells.is_empty() {
            for row in self.row + 1..below {
                for (column, cell) in cells.iter().enumerate() {
                    sheet.copy(self.path, row, column, cell.clone())?;
                }
            }
        }
        self.row = below;
        Ok(())
    }

    fn attribute(&self, e: &BytesStart, name: &str) -> Result<Option<String>, Fault> {
        let fault = |e: &dyn std::fmt::Display| Fault::new(self.path, e, "open it in its program and save it anew");
        let Some(found) = e.try_get_attribute(name).map_err(|e| fault(&e))? else { return Ok(None) };
        Ok(Some(found.normalized_value(XmlVersion::Implicit1_0).map_err(|e| fault(&e))?.into_owned()))
    }

    fn count(&self, e: &BytesStart, name: &str) -> Result<usize, Fault> {
        self.attribute(e, name)?.map_or(Ok(1), |text| {
            text.parse().map_err(|_| {
                Fault::new(self.path, format!("`{text}` is no count"), "open it in its program and save it anew")
            })
        })
    }
}
