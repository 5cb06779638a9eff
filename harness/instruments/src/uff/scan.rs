//! Finds the datasets of a file.

use super::header::{Header, Units, LINES};
use super::values::{count_whole, Storage};
use crate::Fault;
use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// The longest line that is kept whole, bytes; of a longer one the rest counts as a line of its own.
const LONGEST: u64 = 1 << 16;
/// Datasets 58 of a file, at most.
const SETS: usize = 100_000;

/// A dataset 58 that is read.
#[derive(Clone, Debug)]
pub(crate) struct Set {
    pub header: Header,
    /// Byte of its first value, and the byte behind its last.
    pub values: u64,
    pub end: u64,
    /// Samples that are whole.
    pub count: u64,
    pub storage: Storage,
}

/// What a file holds.
#[derive(Debug, Default)]
pub(crate) struct Found {
    pub sets: Vec<Set>,
    pub notes: Vec<String>,
}

/// Reads a line with its end into `line`; false at the end of the file.
pub(crate) fn line(path: &Path, file: &mut BufReader<File>, line: &mut Vec<u8>) -> Result<bool, Fault> {
    line.clear();
    let read = file.take(LONGEST).read_until(b'\n', line);
    read.map(|n| n > 0).map_err(|e| Fault::unreadable(path, e))
}

fn is_mark(line: &[u8]) -> bool {
    line.trim_ascii() == b"-1"
}

struct Scan<'a> {
    path: &'a Path,
    file: &'a mut BufReader<File>,
    length: u64,
    line: Vec<u8>,
    /// Byte of the line that was read last, and of the one behind it.
    at: u64,
    next: u64,
    units: Option<Units>,
    found: Found,
}

pub(crate) fn scan(path: &Path, file: &mut BufReader<File>) -> Result<Found, Fault> {
    let length = file.get_ref().metadata().map_err(|e| Fault::unreadable(path, e))?.len();
    let units = Some(Units::SI);
    let mut scan = Scan { path, file, length, line: Vec::new(), at: 0, next: 0, units, found: Found::default() };
    while scan.read_line()? {
        if is_mark(&scan.line) {
            scan.dataset()?;
        }
    }
    Ok(scan.found)
}

impl Scan<'_> {
    fn read_line(&mut self) -> Result<bool, Fault> {
        let more = line(self.path, self.file, &mut self.line)?;
        self.at = self.next;
        self.next += self.line.len() as u64;
        Ok(more)
    }

    fn go(&mut self, to: u64) -> Result<(), Fault> {
        self.next = to;
        let gone = self.file.seek(SeekFrom::Start(to));
        gone.map(drop).map_err(|e| Fault::unreadable(self.path, e))
    }

    fn fault(&self, byte: u64, what: impl std::fmt::Display, cure: &str) -> Fault {
        Fault::new(self.path, what, cure).at(format!("byte {byte}"))
    }

    /// Passes over the lines up to the mark that ends a dataset.
    fn skip(&mut self) -> Result<(), Fault> {
        while self.read_line()? {
            if is_mark(&self.line) {
                break;
            }
        }
        Ok(())
    }

    /// Reads the dataset whose first mark was read.
    fn dataset(&mut self) -> Result<(), Fault> {
        if !self.read_line()? {
            return Ok(());
        }
        let first = self.line.clone();
        let kind = first.trim_ascii();
        let binary = match kind {
            [b'5', b'8', rest @ ..] if rest.first().is_none_or(|b| *b == b' ') => false,
            [b'5', b'8', b'b' | b'B', ..] => true,
            [b'1', b'6', b'4', rest @ ..] if rest.first().is_none_or(|b| *b == b' ') => {
                if self.read_line()? && !is_mark(&self.line) {
                    let code = self.line.get(..10).and_then(|f| std::str::from_utf8(f).ok()).map(str::trim);
                    self.units = code.and_then(|c| c.parse().ok()).and_then(Units::of_code);
                    self.skip()?;
                }
                return Ok(());
            }
            _ if is_mark(&first) => return Ok(()),
            _ => return self.skip(),
        };
        if self.found.sets.len() >= SETS {
            return Err(self.fault(
                self.at,
                format!("more than {SETS} functions"),
                "give the functions in several files",
            ));
        }
        self.function(&first, binary)
    }

    fn function(&mut self, first: &[u8], binary: bool) -> Result<(), Fault> {
        let at = self.at;
        let mut lines = Vec::with_capacity(LINES);
        for _ in 0..LINES {
            if !self.read_line()? || !self.line.ends_with(b"\n") {
                self.found.notes.push(format!("byte {at}: the dataset was cut in its header and is left out"));
                return Ok(());
            }
            lines.push(self.line.clone());
        }
        let header = Header::read(&lines, self.units).map_err(|record| {
            let what = format!("record {record} of dataset 58 does not hold the numbers it should");
            self.fault(at, what, "give a file whose dataset 58 keeps to the columns of its description")
        })?;
        let values = self.next;
        let (storage, end, whole) = if binary {
            self.binary(at, first, &header)?
        } else {
            let (end, whole) = self.ascii_end()?;
            (Some(Storage::ascii(&header)), end, whole)
        };
        let why_not = match (&header, storage) {
            (h, _) if matches!(h.data_type, 5 | 6) => Some("it is complex"),
            (h, _) if !matches!(h.data_type, 2 | 4) => Some("its data type is not known"),
            (h, _) if !h.is_time_response() => Some("it is no time response"),
            (h, _) if h.even && h.ticks().is_none() => Some("the unit of its abscissa is no unit of time"),
            (h, _) if h.even && h.step <= 0.0 => Some("its step is not above 0"),
            (h, _) if h.count == 0 => Some("it holds no values"),
            (_, None) => Some("its floats are not of IEEE"),
            _ => None,
        };
        let (Some(storage), None) = (storage, why_not) else {
            let why = why_not.unwrap_or_default();
            let what =
                format!("byte {at}: function `{}` (type {}) is left out: {why}", header.description(), header.function);
            self.found.notes.push(what);
            return Ok(());
        };
        let mut set = Set { count: header.count, header, values, end, storage };
        if !whole {
            set.count = count_whole(self.path, self.file, &set)?;
            self.go(self.length)?;
            let what = format!(
                "byte {at}: the file was cut in this dataset: {} of {} samples are whole",
                set.count, set.header.count
            );
            self.found.notes.push(what);
        }
        if set.count > 0 {
            self.found.sets.push(set);
        }
        Ok(())
    }

    /// How a binary dataset is stored (None where it cannot be read), the byte behind its values, and whether it is whole.
    /// Leaves the reading behind its mark. The number of bytes that the first line says is wrong in files of some writers,
    /// as is the precision; so the mark behind the values decides.
    fn binary(&mut self, at: u64, first: &[u8], header: &Header) -> Result<(Option<Storage>, u64, bool), Fault> {
        let text = String::from_utf8_lossy(first).into_owned();
        let words: Vec<Option<u64>> = text.split_whitespace().skip(1).map(|w| w.parse().ok()).collect();
        let [Some(order @ (1 | 2)), Some(format), _, Some(said), ..] = words.as_slice() else {
            let cure =
                "give a file whose dataset 58b says byte order (1 or 2), format of floats, and its number of bytes";
            return Err(self.fault(at, "the first line of dataset 58b does not hold the numbers it should", cure));
        };
        let values = self.next;
        let layouts = if *format == 2 { Storage::binary(header, *order == 2) } else { Vec::new() };
        for storage in &layouts {
            if let Some(end) = storage.end(values, header.count).filter(|end| *end < self.length) {
                if self.mark_at(end)? {
                    return Ok((Some(*storage), end, true));
                }
            }
        }
        let said_end = values.saturating_add(*said);
        if layouts.is_empty() && said_end < self.length && self.mark_at(said_end)? {
            return Ok((None, said_end, true));
        }
        let least = layouts.iter().map(|l| l.end(values, header.count).unwrap_or(u64::MAX)).min().unwrap_or(said_end);
        if least < self.length {
            let what = "no mark -1 stands behind the values of dataset 58b";
            return Err(self.fault(
                values,
                what,
                "give a file that was not changed by an editor or a transfer as text",
            ));
        }
        self.go(self.length)?;
        let as_said = layouts.iter().find(|l| l.end(values, header.count) == Some(said_end));
        Ok((as_said.or(layouts.first()).copied(), self.length, false))
    }

    /// Whether the mark of an end stands at a byte, alone on its line; then the reading stands behind it.
    fn mark_at(&mut self, byte: u64) -> Result<bool, Fault> {
        self.go(byte)?;
        for _ in 0..2 {
            if !self.read_line()? {
                return Ok(false);
            }
            if is_mark(&self.line) {
                return Ok(true);
            }
            if !self.line.trim_ascii().is_empty() {
                return Ok(false);
            }
        }
        Ok(false)
    }

    /// Where the lines of values end, and whether the mark of the end stands there.
    fn ascii_end(&mut self) -> Result<(u64, bool), Fault> {
        while self.read_line()? {
            if is_mark(&self.line) {
                return Ok((self.at, true));
            }
        }
        Ok((self.length, false))
    }
}
