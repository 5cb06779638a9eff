//! Tables of numbers in a text: CSV and TXT in any dialect.
//!
//! Delimiter (tab, semicolon, comma, bar, spaces), decimal separator and the lines of the header are found from the lines
//! themselves ([`layout`]); a first line `sep=;` is taken. The encoding is UTF-8, UTF-16, Latin-1 or Windows-1252; line ends
//! are LF, CRLF or CR. Above a table may stand any number of lines: properties, names, units ([`header`]). Comment lines
//! begin with `#`, `%`, `//`, or `;` where that is no delimiter. A new header begins a new table, and every table becomes a
//! group. A column of times of day or of dates with times becomes seconds since its first one.
//!
//! Numbers: a separator of thousands is read as one where nothing else is possible (`1.234,5`, `1,234,567`); `1.234` beside
//! decimal commas is one only where the first lines of the table prove it, and a fault otherwise. An empty cell, `NaN`, `-`,
//! `n/a` are missing samples.
//!
//! Left out with a note: columns without numbers, lines of text behind the last table, and a last line that was cut: it
//! has no line end, and a text, fewer cells, or fewer decimals than the lines before, which all have as many. Text
//! between numbers is a fault.
//!
//! The file is read line by line, once to find its tables and once for each reading of a table; memory holds a block of
//! samples, whatever the file's length. Our own reader stands here since the crate `csv` wants the dialect given, and reads
//! neither several tables nor headers of instruments.

mod header;
mod layout;
mod walk;

use crate::shared::block::Block;
use crate::shared::cell::{split, text, Delimiter, Dialect};
use crate::shared::head::{Head, PROPERTIES};
use crate::shared::lines::{encoding, Encoding, Lines, Mark};
use crate::shared::stamp::Dates;
use crate::shared::{clock, unit};
use crate::{Fault, Format, Group, Sink, Source};
use layout::{Kept, Kind, Layout, WINDOW};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use walk::{Column, Stop, Walk};

pub(crate) const FORMAT: Format = Format { name: "text (CSV, TXT)", is, open };

/// Columns of a table, at most: those of Excel.
const COLUMNS: usize = 16_384;
/// Tables of a file, at most.
const TABLES: usize = 10_000;
/// Header lines of a table that are kept, at most, and their bytes.
const HEADER_LINES: usize = 2_000;
const HEADER_BYTES: usize = 1 << 20;
/// Windows that are looked at for a table of numbers only, beyond one of numbers beside texts.
const AHEAD: usize = 8;
/// Lines of a quoted name, at most.
const NAME_LINES: usize = 20;
/// Bytes of a window, about.
const WINDOW_BYTES: usize = 1 << 21;

/// Text has no control characters, save those of lines, tabs, pages and the end-of-file mark of DOS.
fn is(head: &[u8], _extension: &str) -> bool {
    let control = |b: &u8| *b < 0x20 && !matches!(b, b'\t' | b'\n' | b'\r' | 0x0C | 0x1A);
    encoding(head).0 != Encoding::Bytes || !head.trim_ascii().is_empty() && !trim_zeros(head).iter().any(control)
}

/// Without the zeros at the end, which stand in a file whose end was never written.
fn trim_zeros(head: &[u8]) -> &[u8] {
    &head[..head.iter().rposition(|b| *b != 0).map_or(0, |at| at + 1)]
}

/// A table found.
struct Table {
    start: Mark,
    dialect: Dialect,
    kinds: Vec<Kind>,
    /// The columns that hold numbers.
    shown: Vec<usize>,
}

struct Text {
    path: PathBuf,
    lines: Lines,
    tables: Vec<Table>,
    groups: Vec<Group>,
    notes: Vec<String>,
    /// In which order the dates of all tables are.
    dates: Dates,
}

fn open(path: &Path) -> Result<Box<dyn Source>, Fault> {
    let mut source = Text {
        path: path.to_path_buf(),
        lines: Lines::open(path)?,
        tables: vec![],
        groups: vec![],
        notes: vec![],
        dates: Dates::default(),
    };
    source.scan()?;
    source.dates.settle().map_err(|what| Fault::new(path, what, "write all dates in one order, such as 2024-05-31"))?;
    if source.groups.is_empty() {
        let cure = "give a table with a delimiter between its cells and numbers in its lines";
        return Err(Fault::new(path, "no table of numbers was found in the text", cure));
    }
    if source.groups.len() > 1 {
        source.groups.iter_mut().enumerate().for_each(|(i, g)| g.name = format!("table {}", i + 1));
    }
    Ok(Box::new(source))
}

impl Text {
    /// Finds all tables.
    fn scan(&mut self) -> Result<(), Fault> {
        let delimiter = self.separator_line()?;
        let mut header: Vec<Vec<u8>> = Vec::new();
        loop {
            let (window, whole) = self.window()?;
            if window.is_empty() {
                break;
            }
            let last = self.tables.last().map(|t| t.dialect);
            let mut found = layout::find(&window, whole, delimiter, last);
            if !whole && found.as_ref().is_some_and(|f| !f.pure) && self.pure_ahead(delimiter)? {
                found = None;
            }
            let late = found.as_ref().is_none_or(|f| f.start > WINDOW / 2 && f.start > window.len() / 2);
            if late && !whole {
                // the lines before the table, or half of the window where it holds none, are of the header
                let keep = found.map_or(window.len() / 2, |f| f.start.saturating_sub(WINDOW / 4)).max(1);
                self.lines.go(window.get(keep).map_or(self.lines.mark(), |l| l.mark))?;
                header.extend(window.into_iter().take(keep).map(|l| l.bytes));
                shorten(&mut header);
                continue;
            }
            let Some(found) = found else { break };
            header.extend(window[..found.start].iter().map(|l| l.bytes.clone()));
            shorten(&mut header);
            match self.table(&found, &window, &header)? {
                Stop::End => break,
                Stop::Header(next) => self.lines.go(next)?,
            }
            header.clear();
        }
        if let Some(byte) = self.lines.zeros {
            self.notes.push(format!("from byte {byte} on the file holds zeros only: it was not written to its end"));
        }
        Ok(())
    }

    /// The delimiter that a first line `sep=;` names; the lines stand behind it then.
    fn separator_line(&mut self) -> Result<Option<Delimiter>, Fault> {
        let start = self.lines.mark();
        let first = self.lines.next()?.map(|l| l.text.to_ascii_lowercase()).unwrap_or_default();
        let bare = first.trim_ascii_end();
        let bare = bare.strip_prefix(b"\"").and_then(|b| b.strip_suffix(b"\"")).unwrap_or(bare);
        match bare.strip_prefix(b"sep=") {
            Some([byte]) => Ok(Some(Delimiter::Byte(*byte))),
            // the tab itself was trimmed
            Some([]) => Ok(Some(Delimiter::Byte(b'\t'))),
            _ => {
                self.lines.go(start)?;
                Ok(None)
            }
        }
    }

    /// Whether a table of numbers only stands in the next windows; then numbers beside texts before it are metadata.
    fn pure_ahead(&mut self, delimiter: Option<Delimiter>) -> Result<bool, Fault> {
        let here = self.lines.mark();
        let mut pure = false;
        for _ in 0..AHEAD {
            let (window, whole) = self.window()?;
            pure = layout::find(&window, whole, delimiter, None).is_some_and(|f| f.pure);
            if pure || whole {
                break;
            }
        }
        self.lines.go(here)?;
        Ok(pure)
    }

    /// The next lines, and whether the text ends with them.
    fn window(&mut self) -> Result<(Vec<Kept>, bool), Fault> {
        let mut window = Vec::new();
        let mut bytes = 0;
        while window.len() < WINDOW && bytes < WINDOW_BYTES {
            let mark = self.lines.mark();
            let Some(line) = self.lines.next()? else { return Ok((window, true)) };
            let mut text = line.text.to_vec();
            if is_open(&text) {
                self.join(&mut text)?;
            }
            bytes += text.len();
            window.push(Kept { mark, bytes: text });
        }
        Ok((window, false))
    }

    /// Appends the lines up to the one that closes a quoted cell, where it is near: a name of several lines.
    fn join(&mut self, text: &mut Vec<u8>) -> Result<(), Fault> {
        let (here, length) = (self.lines.mark(), text.len());
        for _ in 0..NAME_LINES {
            let Some(line) = self.lines.next()? else { break };
            text.push(b' ');
            text.extend_from_slice(line.text);
            if !is_open(text) {
                return Ok(());
            }
        }
        text.truncate(length);
        self.lines.go(here)
    }

    /// Counts a table's samples and takes what its header says; where the next begins.
    fn table(&mut self, found: &Layout, window: &[Kept], header: &[Vec<u8>]) -> Result<Stop, Fault> {
        let start = window[found.start].mark;
        let line = start.lines + 1;
        let limit = |what: String, cure: &str| Err(Fault::new(&self.path, what, cure).at(format!("line {line}")));
        if found.kinds.len() > COLUMNS {
            return limit(format!("more than {COLUMNS} columns"), "give the channels in several files");
        }
        if self.tables.len() >= TABLES {
            return limit(format!("more than {TABLES} tables"), "give the tables in several files");
        }
        if has_commas_for_both(found, window, header) {
            let what = "commas stand between the cells and in the numbers: there are half as many names as columns";
            return limit(
                what.to_string(),
                "write the file with semicolons or tabs between the cells, or with decimal points",
            );
        }
        self.lines.go(start)?;
        let mut walk = Walk::new(&self.path, found.dialect, &found.kinds, Dates::default());
        let stop = walk.rows(&mut self.lines, u64::MAX, &mut |_| ControlFlow::Continue(()))?;
        self.notes.append(&mut walk.notes);
        self.dates.join(&walk.dates);
        let mut said = header::read(header, found.dialect, &found.kinds);
        beside(found, window, &mut said);
        let shown: Vec<usize> = (0..found.kinds.len()).filter(|c| walk.columns[*c].is_shown()).collect();
        for (c, column) in walk.columns.iter().enumerate() {
            let name = &said.channels[c].name.clone();
            if column.is_shown() {
                if column.kind == Kind::Stamp {
                    said.channels[c].unit = "s".to_string();
                }
                if let Some(first) = column.origin() {
                    self.notes
                        .push(format!("line {line}: column {} ({name}) counts from its first number, {first}", c + 1));
                }
            } else if !name.is_empty() && !name.contains('=') && !said.properties.iter().any(|(n, _)| n == name) {
                let what = if column.kind == Kind::Text { "text" } else { "nothing" };
                self.notes.push(format!("line {line}: column {} ({name}) holds {what} and is left out", c + 1));
            }
        }
        if shown.is_empty() {
            return Ok(stop);
        }
        let channels: Vec<_> = shown.iter().map(|c| said.channels[*c].clone()).collect();
        let timed = channels.iter().any(|c| unit::is_time(&c.name, &c.unit));
        let clock = if timed { None } else { clock::of_properties(&said.properties) };
        self.groups.push(Group {
            name: String::new(),
            channels,
            samples: walk.count,
            clock,
            properties: said.properties,
        });
        let kinds = walk.columns.iter().map(|c| c.kind).collect();
        self.tables.push(Table { start, dialect: found.dialect, kinds, shown });
        Ok(stop)
    }
}

/// Whether a quote is not closed.
fn is_open(text: &[u8]) -> bool {
    text.iter().filter(|b| **b == b'"').count() % 2 == 1
}

/// Whether commas stand between the cells and in the numbers: whole numbers in twice as many columns as there are names.
fn has_commas_for_both(found: &Layout, window: &[Kept], header: &[Vec<u8>]) -> bool {
    let comma = Delimiter::Byte(b',');
    let Some(names) = header.iter().rev().find(|l| !layout::is_blank(l, comma)) else { return false };
    let mut cells = Vec::new();
    split(names, comma, &mut cells);
    let texts = cells.iter().all(|c| names[c.clone()].iter().any(u8::is_ascii_alphabetic));
    let whole = || window[found.start..].iter().take(WINDOW / 2).all(|l| !l.bytes.contains(&b'.'));
    found.dialect.delimiter == comma && cells.len() > 1 && found.kinds.len() == 2 * cells.len() && texts && whole()
}

/// Drops the upper lines of a header that is too long to keep.
fn shorten(header: &mut Vec<Vec<u8>>) {
    let mut bytes = 0;
    let keep = header.iter().rev().take(HEADER_LINES).take_while(|l| {
        bytes += l.len();
        bytes <= HEADER_BYTES
    });
    let drop = header.len() - keep.count();
    header.drain(..drop);
}

/// Metadata that stands in columns to the left of the samples.
fn beside(found: &Layout, window: &[Kept], said: &mut Head) {
    let labels: Vec<usize> = (1..found.kinds.len())
        .map(|c| c - 1)
        .filter(|c| {
            found.kinds[*c] == Kind::Text && found.kinds[c + 1] == Kind::Text && said.channels[*c].name.is_empty()
        })
        .collect();
    if labels.is_empty() {
        return;
    }
    let mut pairs = Vec::new();
    let mut cells = Vec::new();
    for line in &window[found.start..] {
        split(&line.bytes, found.dialect.delimiter, &mut cells);
        let cell = |c: usize| cells.get(c).map_or(String::new(), |r| text(&line.bytes[r.clone()]));
        pairs.extend(
            labels.iter().map(|c| (*c, cell(*c), cell(c + 1))).filter(|(_, l, v)| !l.is_empty() && !v.is_empty()),
        );
    }
    header::beside(&pairs, &found.kinds, &mut said.channels);
    pairs.truncate(PROPERTIES);
    said.properties.extend(pairs.into_iter().map(|(_, label, value)| (label, value)));
}

impl Source for Text {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn read(&mut self, group: usize, sink: &mut Sink) -> Result<(), Fault> {
        let table = &self.tables[group];
        let rows = self.groups[group].samples;
        let mut block = Block::new(table.shown.len());
        let mut stopped = false;
        self.lines.go(table.start)?;
        let mut walk = Walk::new(&self.path, table.dialect, &table.kinds, self.dates);
        walk.rows(&mut self.lines, rows, &mut |row| {
            block.columns.iter_mut().zip(&table.shown).for_each(|(b, c)| b.push(row[*c]));
            let flow = block.hand_full(sink);
            stopped = flow.is_break();
            flow
        })?;
        if !stopped {
            let _ = block.hand(sink);
        }
        Ok(())
    }
}

impl Column {
    /// Whether it holds samples.
    fn is_shown(&self) -> bool {
        self.values > 0 && matches!(self.kind, Kind::Number | Kind::Stamp)
    }
}
