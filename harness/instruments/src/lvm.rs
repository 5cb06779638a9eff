//! LabVIEW measurement files (`.lvm`), as National Instruments describes them in "Specification for the LabVIEW
//! Measurement File (.lvm)".
//!
//! A header of the file names separator and decimal separator, and whether there is no column of X, one, or one for every
//! channel. Segments follow: a header, a line of names and lines of samples each. A segment that goes on where the one
//! before ended (same channels and step, X0 one step behind its last sample) is of the same group; any other segment is a
//! group. Channels of unequal X0 or Delta_X, or with columns of X of their own, are groups of their own. Without a column
//! of X the clock is X0 and Delta_X in the unit of X, where X is a time. Channels whose `Date` and `Time` differ begin apart.
//! Special segments and the column of comments are left out.
//!
//! Read line by line, in constant memory. Our own reader stands here since there is no crate for the format.

use crate::shared::block::Block;
use crate::shared::cell::{bare, split, text, Cell, Decimal, Delimiter, Dialect};
use crate::shared::lines::{excerpt, Lines, Mark};
use crate::shared::stamp::{self, Stamp};
use crate::shared::unit::ticks_of_a_second;
use crate::{Channel, Clock, Fault, Format, Group, Sink, Source};
use std::collections::HashMap;
use std::ops::Range;
use std::path::{Path, PathBuf};

pub(crate) const FORMAT: Format = Format { name: "LabVIEW measurement (LVM)", is, open };

/// Channels of a segment, at most.
const CHANNELS: usize = 16_384;
/// Segments that are not joined, at most.
const GROUPS: usize = 10_000;
/// How far X0 may be off the end of the segment before, steps.
const GAP: f64 = 0.01;

fn is(head: &[u8], _extension: &str) -> bool {
    let head = head.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(head);
    head.starts_with(b"LabVIEW Measurement")
}

/// Where the columns of X stand.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Abscissa {
    No,
    One,
    Multi,
}

/// Lines of samples of one segment.
struct Part {
    start: Mark,
    rows: u64,
}

/// Where a group's samples stand.
struct Place {
    columns: Vec<usize>,
    /// Added to the numbers of the first column, the X of channels that begin later than others: in the unit of X.
    later: f64,
    parts: Vec<Part>,
}

/// The header of a segment: its keys, with a value a channel.
type Keys = HashMap<String, Vec<String>>;

struct Lvm {
    path: PathBuf,
    lines: Lines,
    dialect: Dialect,
    abscissa: Abscissa,
    properties: Vec<(String, String)>,
    groups: Vec<Group>,
    places: Vec<Place>,
    notes: Vec<String>,
    segments: usize,
}

fn open(path: &Path) -> Result<Box<dyn Source>, Fault> {
    let mut lvm = Lvm {
        path: path.to_path_buf(),
        lines: Lines::open(path)?,
        dialect: Dialect { delimiter: Delimiter::Byte(b'\t'), decimal: Decimal::Point, thousands: false },
        abscissa: Abscissa::One,
        properties: Vec::new(),
        groups: Vec::new(),
        places: Vec::new(),
        notes: Vec::new(),
        segments: 0,
    };
    lvm.file_header()?;
    while lvm.segment()? {}
    if lvm.groups.is_empty() {
        return Err(Fault::new(path, "the file holds no samples", "give a file with a segment of samples"));
    }
    if let [only] = lvm.groups.as_mut_slice() {
        only.name.clear();
    }
    Ok(Box::new(lvm))
}

/// The delimiter behind the key `Separator`.
fn delimiter(line: &[u8]) -> Option<Delimiter> {
    line.strip_prefix(b"Separator").and_then(|rest| rest.first()).map(|b| Delimiter::Byte(*b))
}

impl Lvm {
    fn fault(&self, line: u64, what: impl std::fmt::Display, cure: &str) -> Fault {
        Fault::new(&self.path, what, cure).at(format!("line {line}"))
    }

    /// The next line that is not blank, as cells, with where it begins.
    fn cells(&mut self) -> Result<Option<(Mark, Vec<String>)>, Fault> {
        let mut places = Vec::new();
        loop {
            let mark = self.lines.mark();
            let Some(line) = self.lines.next()? else { return Ok(None) };
            split(line.text, self.dialect.delimiter, &mut places);
            let cells: Vec<String> = places.iter().map(|c| text(&line.text[c.clone()])).collect();
            if cells.len() > 2 * CHANNELS + 2 {
                return Err(self.fault(mark.lines + 1, "too many cells", "give the channels in several files"));
            }
            if cells.iter().any(|c| !c.is_empty()) {
                return Ok(Some((mark, cells)));
            }
        }
    }

    fn file_header(&mut self) -> Result<(), Fault> {
        let start = self.lines.mark();
        while let Some(line) = self.lines.next()? {
            if let Some(delimiter) = delimiter(line.text) {
                self.dialect.delimiter = delimiter;
                break;
            }
            if line.text.starts_with(b"***End_of_Header***") {
                break;
            }
        }
        self.lines.go(start)?;
        self.cells()?;
        while let Some((_, cells)) = self.cells()? {
            let value = cells.get(1).cloned().unwrap_or_default();
            match cells[0].as_str() {
                "***End_of_Header***" => return Ok(()),
                "Decimal_Separator" if value == "," => self.dialect.decimal = Decimal::Comma,
                // the separator of a file with commas between its cells is cut off like its cells
                "Decimal_Separator" | "Separator" | "Reader_Version" | "Multi_Headings" | "Time_Pref" => {}
                "X_Columns" => {
                    self.abscissa = match value.as_str() {
                        "No" => Abscissa::No,
                        "Multi" => Abscissa::Multi,
                        _ => Abscissa::One,
                    }
                }
                key if !value.is_empty() && self.properties.len() < 1000 => {
                    self.properties.push((key.to_string(), value))
                }
                _ => {}
            }
        }
        let cure = "give a whole file: the header ends with ***End_of_Header***";
        Err(Fault::new(&self.path, "the header of the file does not end", cure))
    }

    /// Reads a segment's header and counts its samples; false at the end of the file.
    fn segment(&mut self) -> Result<bool, Fault> {
        let mut keys = Keys::new();
        let first = self.lines.mark().lines + 1;
        loop {
            let Some((mark, cells)) = self.cells()? else {
                if !keys.is_empty() {
                    self.notes.push(format!("line {first}: the file was cut in the header of this segment"));
                }
                return Ok(false);
            };
            match cells[0].as_str() {
                "***Start_Special***" => self.skip_special(mark.lines + 1)?,
                "***End_of_Header***" => break,
                "" => {
                    return Err(self.fault(
                        mark.lines + 1,
                        "samples without a header",
                        "give a file as LabVIEW wrote it",
                    ))
                }
                key if keys.len() < 1000 => {
                    keys.insert(key.to_string(), cells[1..].to_vec());
                }
                _ => {}
            }
        }
        let Some((mark, names)) = self.cells()? else {
            self.notes.push(format!("line {first}: the file was cut in the header of this segment"));
            return Ok(false);
        };
        if !is_header(names[0].as_bytes(), self.dialect) {
            let cure = "give a file with its line of names, which begins with X_Value";
            return Err(self.fault(mark.lines + 1, "the line of names is missing", cure));
        }
        let start = self.lines.mark();
        let rows = self.count()?;
        self.segments += 1;
        self.check_count(&keys, first, rows);
        if rows > 0 {
            self.take(&keys, &names, start, rows)?;
        }
        Ok(true)
    }

    fn skip_special(&mut self, line: u64) -> Result<(), Fault> {
        self.notes.push(format!("line {line}: a special segment is left out"));
        while let Some((_, cells)) = self.cells()? {
            if cells[0] == "***End_Special***" {
                break;
            }
        }
        Ok(())
    }

    /// Counts lines of samples up to the next header, which stands next then.
    fn count(&mut self) -> Result<u64, Fault> {
        let mut rows = 0;
        let mut width = 0;
        let mut places = Vec::new();
        loop {
            let mark = self.lines.mark();
            let Some(line) = self.lines.next()? else { return Ok(rows) };
            split(line.text, self.dialect.delimiter, &mut places);
            let filled = places.iter().any(|c| !bare(&line.text[c.clone()]).is_empty());
            if !filled {
                continue;
            }
            if is_header(&line.text[places[0].clone()], self.dialect) {
                self.lines.go(mark)?;
                return Ok(rows);
            }
            if !line.ended && rows > 0 && (places.len() < width || self.holds_text(mark)?) {
                self.notes.push(format!("line {}: the last line was cut and is left out", mark.lines + 1));
                return Ok(rows);
            }
            width = width.max(places.len());
            rows += 1;
        }
    }

    /// Whether the line at `mark` holds a text where numbers stand.
    fn holds_text(&mut self, mark: Mark) -> Result<bool, Fault> {
        self.lines.go(mark)?;
        let mut dialect = self.dialect;
        let Some(line) = self.lines.next()? else { return Ok(false) };
        let mut places = Vec::new();
        split(line.text, dialect.delimiter, &mut places);
        Ok(places
            .iter()
            .any(|c| !matches!(dialect.cell(&line.text[c.clone()]), Cell::Number(_) | Cell::Empty | Cell::Missing)))
    }

    /// Notes where a segment holds fewer samples than its header says.
    fn check_count(&mut self, keys: &Keys, line: u64, rows: u64) {
        let said = keys.get("Samples").into_iter().flatten().filter_map(|s| s.parse::<u64>().ok()).max();
        if let Some(said) = said.filter(|said| rows < *said) {
            self.notes.push(format!("line {line}: the segment says {said} samples and holds {rows}"));
        }
    }

    /// Adds a segment's samples to the group they go on with, or as groups of their own.
    fn take(&mut self, keys: &Keys, names: &[String], start: Mark, rows: u64) -> Result<(), Fault> {
        let mut names = names.to_vec();
        while names.last().is_some_and(String::is_empty) {
            names.pop();
        }
        if names.last().is_some_and(|n| n == "Comment") {
            names.pop();
        }
        for (columns, later, group) in self.split_groups(keys, &names)? {
            if let Some(at) = self.goes_on(&columns, &group) {
                self.groups[at].samples += rows;
                self.places[at].parts.push(Part { start, rows });
                continue;
            }
            if self.groups.len() >= GROUPS {
                let what = format!("more than {GROUPS} segments");
                return Err(self.fault(start.lines + 1, what, "give the segments in several files"));
            }
            self.groups.push(Group { samples: rows, ..group });
            self.places.push(Place { columns, later, parts: vec![Part { start, rows }] });
        }
        Ok(())
    }

    /// The channels of a segment as groups, with their columns and what is added to their X.
    fn split_groups(&self, keys: &Keys, names: &[String]) -> Result<Vec<(Vec<usize>, f64, Group)>, Fault> {
        let stride = if self.abscissa == Abscissa::Multi { 2 } else { 1 };
        let late = late(keys, names.len().saturating_sub(1).div_ceil(stride), stride);
        let mut groups: Vec<(Vec<usize>, f64, Group)> = Vec::new();
        for (channel, column) in (1..names.len()).step_by(stride).enumerate() {
            let value = |key: &str| value(keys, key, channel, stride);
            let of = Channel { name: names[column].clone(), unit: value("Y_Unit_Label") };
            let dimension = value("X_Dimension");
            let time = dimension.is_empty() || dimension == "Time";
            let unit = value("X_Unit_Label");
            let unit = if unit.is_empty() && time { "s".to_string() } else { unit };
            let ticks = if time { ticks_of_a_second(&unit) } else { None };
            let late = late[channel];
            let clock = match (time && self.abscissa == Abscissa::No, ticks) {
                (true, Some(ticks)) => self.clock(&value("X0"), &value("Delta_X"), ticks, late),
                (true, None) => {
                    let what = format!("X_Unit_Label {unit:?} of channel {:?} is no unit of time", of.name);
                    return Err(Fault::new(&self.path, what, "write s or ms"));
                }
                _ => None,
            };
            let later = if self.abscissa == Abscissa::No { 0.0 } else { late * ticks.unwrap_or(1.0) };
            let x = Channel { name: names[column - 1].clone(), unit };
            let alike = |g: &&mut (Vec<usize>, f64, Group)| g.2.clock == clock && g.1 == later;
            let together = groups.iter_mut().find(alike).filter(|_| self.abscissa != Abscissa::Multi);
            match together {
                Some((columns, _, group)) => {
                    columns.push(column);
                    group.channels.push(of);
                }
                None => {
                    let (columns, channels) = match self.abscissa {
                        Abscissa::No => (vec![column], vec![of]),
                        Abscissa::One => {
                            let x = Channel { name: names[0].clone(), ..x };
                            (vec![0, column], vec![x, of])
                        }
                        Abscissa::Multi => (vec![column - 1, column], vec![x, of]),
                    };
                    let name = format!("segment {}", self.segments);
                    let properties = self.properties_of(keys);
                    groups.push((columns, later, Group { name, channels, samples: 0, clock, properties }));
                }
            }
        }
        Ok(groups)
    }

    /// The clock of a channel whose X counts in `ticks` of a second, and which begins `late` s after the first.
    fn clock(&self, start: &str, step: &str, ticks: f64, late: f64) -> Option<Clock> {
        let mut dialect = self.dialect;
        let mut number = |t: &str| match dialect.cell(t.as_bytes()) {
            Cell::Number(n) if n.is_finite() => Some(n),
            _ => None,
        };
        let start = number(start).unwrap_or(0.0) / ticks + late;
        Some(Clock { start, step: number(step).filter(|s| *s > 0.0)? / ticks })
    }

    fn properties_of(&self, keys: &Keys) -> Vec<(String, String)> {
        let known =
            ["Channels", "Samples", "Y_Unit_Label", "X_Unit_Label", "X_Dimension", "Y_Dimension", "X0", "Delta_X"];
        let mut own: Vec<(String, String)> = keys
            .iter()
            .filter(|(key, values)| !known.contains(&key.as_str()) && values.iter().any(|v| !v.is_empty()))
            .map(|(key, values)| (key.clone(), values.iter().find(|v| !v.is_empty()).cloned().unwrap_or_default()))
            .collect();
        own.sort();
        // the segment's own date and time stand before the file's
        let files =
            self.properties.iter().filter(|(key, _)| !own.iter().any(|(k, _)| k == key)).cloned().collect::<Vec<_>>();
        own.extend(files);
        own
    }

    /// The group that a segment continues: the last one with its columns and channels whose end is its start.
    fn goes_on(&self, columns: &[usize], next: &Group) -> Option<usize> {
        let at = (0..self.groups.len()).rev().find(|i| self.places[*i].columns == columns)?;
        let group = &self.groups[at];
        let (Some(a), Some(b)) = (group.clock, next.clock) else { return None };
        let end = a.start + group.samples as f64 * a.step;
        let fits = a.step == b.step && group.channels == next.channels && (b.start - end).abs() <= GAP * a.step;
        fits.then_some(at)
    }
}

/// By how much each channel of a segment begins later than the first of them, s, by the keys `Date` and `Time`; 0 where
/// they do not say so of all.
fn late(keys: &Keys, channels: usize, stride: usize) -> Vec<f64> {
    let none = vec![0.0; channels];
    let mut first: Option<Stamp> = None;
    let mut all = Vec::with_capacity(channels);
    for channel in 0..channels {
        let [date, time] = ["Date", "Time"].map(|key| value(keys, key, channel, stride).replace(',', "."));
        let Some(stamp) = stamp::parse(format!("{date} {time}").trim().as_bytes()) else { return none };
        all.push(stamp.after(*first.get_or_insert(stamp)));
    }
    let least = all.iter().copied().fold(f64::INFINITY, f64::min);
    all.iter_mut().for_each(|l| *l -= least);
    all
}

/// A channel's value of a key. With a column of X for every channel the values may stand above every second column.
fn value(keys: &Keys, key: &str, channel: usize, stride: usize) -> String {
    let values = keys.get(key).map_or(&[][..], Vec::as_slice);
    let spread = stride == 2 && values.len() > 2 && values.iter().skip(1).step_by(2).all(String::is_empty);
    let at = if spread { channel * 2 } else { channel };
    values.get(at).cloned().unwrap_or_default()
}

/// Whether a line whose first cell this is belongs to a header: a word other than for no number.
fn is_header(first: &[u8], mut dialect: Dialect) -> bool {
    let first = bare(first);
    first.first().is_some_and(|b| b.is_ascii_alphabetic() || *b == b'*') && dialect.cell(first) == Cell::Text
}

impl Source for Lvm {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn read(&mut self, group: usize, sink: &mut Sink) -> Result<(), Fault> {
        let place = &self.places[group];
        let mut block = Block::new(place.columns.len());
        let mut cells: Vec<Range<usize>> = Vec::new();
        let mut dialect = self.dialect;
        for part in &place.parts {
            self.lines.go(part.start)?;
            let mut rows = 0;
            while rows < part.rows {
                let Some(line) = self.lines.next()? else { break };
                split(line.text, dialect.delimiter, &mut cells);
                if cells.iter().all(|c| bare(&line.text[c.clone()]).is_empty()) {
                    continue;
                }
                rows += 1;
                for (i, (buffer, column)) in block.columns.iter_mut().zip(&place.columns).enumerate() {
                    let later = if i == 0 { place.later } else { 0.0 };
                    let cell = cells.get(*column).map_or(&[][..], |c| &line.text[c.clone()]);
                    buffer.push(match dialect.cell(cell) {
                        Cell::Number(number) => number + later,
                        Cell::Empty | Cell::Missing => f64::NAN,
                        _ => {
                            let what = format!("`{}` is not a number", excerpt(bare(cell)));
                            let place = format!("line {}, column {}", line.number, column + 1);
                            return Err(
                                Fault::new(&self.path, what, "write a number or leave the cell empty").at(place)
                            );
                        }
                    });
                }
                if block.hand_full(sink).is_break() {
                    return Ok(());
                }
            }
        }
        let _ = block.hand(sink);
        Ok(())
    }
}
