//! The lines of a table, one sample of every column each.

use super::layout::{comment, is_blank, Kind};
use crate::shared::cell::{bare, split, Cell, Decimal, Delimiter, Dialect};
use crate::shared::exact::Exact;
use crate::shared::lines::{excerpt, Lines, Mark};
use crate::shared::stamp::{Dates, Elapsed};
use crate::Fault;
use std::ops::{ControlFlow, Range};
use std::path::{Path, PathBuf};

/// Least number that may be a time since 1970: such numbers have more digits than a double.
const EPOCH: f64 = 1e9;
/// Lines of one form that make the form of the table.
const STEADY: u32 = 3;

/// A column as far as it was read.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    pub kind: Kind,
    /// Numbers and times in it.
    pub values: u64,
    elapsed: Elapsed,
    /// The first number, from which the column counts: a double does not hold all digits of its numbers.
    origin: Option<Exact>,
}

/// Where a table ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Stop {
    /// With the text, or since no more was wanted.
    End,
    /// At the header of the next table.
    Header(Mark),
}

/// A line that is none of the table.
struct Odd {
    mark: Mark,
    line: u64,
    /// The first cell that does not fit, from 0, and its text.
    column: usize,
    cell: String,
    /// One cell only does not fit, and the others are as in the table: a fault, not a header.
    alone: bool,
    /// All its cells are texts, two at least, and no two alike: a line of names.
    names: bool,
    first_value: bool,
    after_blank: bool,
}

/// A line that may be a sample, or the first line of the next header.
struct Doubt {
    mark: Mark,
    line: u64,
    row: Vec<f64>,
    /// Columns whose kind it decided.
    decided: Vec<usize>,
}

/// Reads the lines of a table.
pub(crate) struct Walk {
    path: PathBuf,
    dialect: Dialect,
    pub columns: Vec<Column>,
    /// Samples so far.
    pub count: u64,
    pub notes: Vec<String>,
    /// In which order dates are.
    pub dates: Dates,
    cells: Vec<Range<usize>>,
    row: Vec<f64>,
    /// Columns whose kind the last line decided.
    decided: Vec<usize>,
    /// Cells of the last line, bytes behind its last separator, and lines in sequence with as many.
    width: usize,
    tail: usize,
    steady: u32,
}

enum Row {
    Samples,
    /// Samples, and a text in a column that was empty so far: a line of the next header, where a line of names follows.
    Doubtful,
    /// Texts in columns of text only.
    Remark,
    Odd {
        column: usize,
        alone: bool,
        names: bool,
        first_value: bool,
    },
}

impl Walk {
    pub fn new(path: &Path, dialect: Dialect, kinds: &[Kind], dates: Dates) -> Walk {
        Walk {
            path: path.to_path_buf(),
            dialect,
            columns: kinds.iter().map(|kind| Column::new(*kind)).collect(),
            count: 0,
            notes: Vec::new(),
            dates,
            cells: Vec::new(),
            decided: Vec::new(),
            row: vec![f64::NAN; kinds.len()],
            width: 0,
            tail: 0,
            steady: 0,
        }
    }

    /// Hands up to `most` samples of all columns to `sink`.
    pub fn rows(
        &mut self,
        lines: &mut Lines,
        most: u64,
        sink: &mut dyn FnMut(&[f64]) -> ControlFlow<()>,
    ) -> Result<Stop, Fault> {
        let mut blank = false;
        // the first line that does not fit, the last one, and whether one of them is a line of names
        let mut odd: Option<(Odd, Odd, bool)> = None;
        // a doubtful line: its place, its samples, and the columns that it decided
        let mut doubt: Option<Doubt> = None;
        while self.count < most {
            let mark = lines.mark();
            let Some(line) = lines.next()? else { break };
            if is_blank(line.text, self.dialect.delimiter) {
                blank = true;
                continue;
            }
            if comment(line.text, self.dialect.delimiter).is_some() {
                continue;
            }
            let mut row = self.parse(line.text);
            if let Some(of) = doubt.take_if(|_| odd.is_none()) {
                if let Row::Odd { names: true, .. } = row {
                    for c in &of.decided {
                        self.columns[*c] = Column::new(Kind::Open);
                    }
                    doubt = Some(of);
                } else {
                    self.count += 1;
                    if sink(&of.row).is_break() || self.count == most {
                        return Ok(Stop::End);
                    }
                }
            }
            if matches!(row, Row::Doubtful) {
                if odd.is_none() && self.count > 0 && line.ended {
                    let (decided, kept) = (std::mem::take(&mut self.decided), self.row.clone());
                    doubt = Some(Doubt { mark, line: line.number, row: kept, decided });
                    self.note_form(line.text);
                    blank = false;
                    continue;
                }
                row = Row::Samples;
            }
            if !line.ended && self.count > 0 && self.is_cut(line.text, &row) {
                self.notes.push(format!("line {}: the last line was cut and is left out", line.number));
                break;
            }
            match row {
                Row::Remark => {}
                Row::Samples | Row::Doubtful => {
                    if let Some((first, last, names)) = odd {
                        let header = first.after_blank && !first.alone || names || last.names;
                        let begin = doubt.map_or(first.mark, |d| d.mark);
                        return if header { Ok(Stop::Header(begin)) } else { Err(self.fault(&first)) };
                    }
                    self.note_form(line.text);
                    self.count += 1;
                    if sink(&self.row).is_break() {
                        return Ok(Stop::End);
                    }
                }
                Row::Odd { column, alone, names, first_value } => {
                    let cell = self.cells.get(column).map_or(String::new(), |c| excerpt(bare(&line.text[c.clone()])));
                    let of =
                        Odd { mark, line: line.number, column, cell, alone, names, first_value, after_blank: blank };
                    odd = Some(match odd {
                        None => {
                            let copy = Odd { cell: of.cell.clone(), ..of };
                            (copy, of, names)
                        }
                        Some((first, _, any)) => (first, of, any || names),
                    });
                }
            }
            blank = false;
        }
        if let Some(of) = doubt.as_ref().filter(|_| odd.is_none()) {
            self.count += 1;
            let _ = sink(&of.row);
        }
        if let Some((first, _, _)) = odd {
            if first.alone && first.first_value {
                return Err(self.fault(&first));
            }
            self.notes.push(format!(
                "from line {} on text follows the table and is left out: {}",
                doubt.map_or(first.line, |d| d.line),
                first.cell
            ));
        }
        Ok(Stop::End)
    }

    fn fault(&self, odd: &Odd) -> Fault {
        let place = format!("line {}, column {}", odd.line, odd.column + 1);
        let (what, cure) = if odd.column >= self.columns.len() {
            (format!("`{}` stands behind the last of {} columns", odd.cell, self.columns.len()), "delete the cell")
        } else {
            let cure = "write a number, leave the cell empty, or put a blank line before the header of another table";
            (format!("`{}` is not a number, and its column holds numbers", odd.cell), cure)
        };
        Fault::new(&self.path, what, cure).at(place)
    }

    /// Reads a line into `row`.
    fn parse(&mut self, line: &[u8]) -> Row {
        split(line, self.dialect.delimiter, &mut self.cells);
        self.row.fill(f64::NAN);
        self.decided.clear();
        let (mut values, mut texts, mut bad, mut first_bad, mut missing) = (0, 0, 0, None, false);
        for (c, place) in self.cells.iter().enumerate() {
            let cell = self.dialect.cell(&line[place.clone()]);
            let Some(column) = self.columns.get_mut(c) else {
                if cell != Cell::Empty {
                    bad += 1;
                    first_bad.get_or_insert(c);
                    texts += usize::from(!cell.is_value());
                }
                continue;
            };
            if column.kind == Kind::Open && !matches!(cell, Cell::Empty | Cell::Missing) {
                self.decided.push(c);
            }
            match cell {
                Cell::Empty => {}
                Cell::Missing => missing = true,
                Cell::Number(number) => {
                    values += 1;
                    match column.kind {
                        Kind::Number => self.row[c] = column.number(number, &line[place.clone()], self.dialect.decimal),
                        Kind::Open => {
                            column.kind = Kind::Number;
                            self.row[c] = column.number(number, &line[place.clone()], self.dialect.decimal);
                        }
                        Kind::Text => {}
                        Kind::Stamp => {
                            bad += 1;
                            first_bad.get_or_insert(c);
                        }
                    }
                    column.values += 1;
                }
                Cell::Stamp(stamp) if matches!(column.kind, Kind::Stamp | Kind::Open) => {
                    column.kind = Kind::Stamp;
                    column.values += 1;
                    values += 1;
                    self.row[c] = column.elapsed.seconds(stamp, &mut self.dates);
                }
                Cell::Stamp(_) | Cell::Date | Cell::Text => {
                    texts += 1;
                    match column.kind {
                        Kind::Open => column.kind = Kind::Text,
                        Kind::Text => {}
                        Kind::Number | Kind::Stamp => {
                            bad += 1;
                            first_bad.get_or_insert(c);
                        }
                    }
                }
            }
        }
        if first_bad.is_some() {
            // the line may be of another table: its cells decide nothing
            for c in self.decided.drain(..) {
                self.columns[c] = Column::new(Kind::Open);
            }
        }
        let names = || texts > 1 && values == 0 && self.all_differ(line);
        match first_bad {
            Some(column) => Row::Odd { column, alone: bad == 1 && values > 0, names: names(), first_value: column > 0 },
            None if values > 0 && self.decided.iter().any(|c| self.columns[*c].kind == Kind::Text) => Row::Doubtful,
            None if values > 0 || missing => Row::Samples,
            None => Row::Remark,
        }
    }

    fn all_differ(&self, line: &[u8]) -> bool {
        let mut texts: Vec<&[u8]> =
            self.cells.iter().map(|c| bare(&line[c.clone()])).filter(|c| !c.is_empty()).collect();
        let count = texts.len();
        texts.sort_unstable();
        texts.dedup();
        texts.len() == count
    }

    /// Keeps the form of a line, to see whether the last one was cut.
    fn note_form(&mut self, line: &[u8]) {
        let tail = tail(line);
        let same = self.cells.len() == self.width && tail == self.tail;
        self.steady = if same { self.steady.saturating_add(1) } else { 1 };
        (self.width, self.tail) = (self.cells.len(), tail);
    }

    /// Whether a line without an end was cut.
    fn is_cut(&self, line: &[u8], row: &Row) -> bool {
        let fewer_cells = self.cells.len() < self.width;
        let shorter = self.steady >= STEADY && self.tail > 0 && tail(line) < self.tail;
        matches!(row, Row::Odd { .. }) || fewer_cells || shorter || ends_open(line, self.dialect.delimiter)
    }
}

/// Bytes behind the last decimal separator of the last cell; 0 where it has none.
fn tail(line: &[u8]) -> usize {
    let line = line.trim_ascii_end();
    let separator = line.iter().rposition(|b| !b.is_ascii_alphanumeric() && !matches!(b, b'+' | b'-'));
    separator.filter(|at| matches!(line[*at], b'.' | b',')).map_or(0, |at| line.len() - at - 1)
}

/// Whether a line ends within a number: with a sign, an exponent's letter or a decimal point.
fn ends_open(line: &[u8], delimiter: Delimiter) -> bool {
    let last = line.last().copied().unwrap_or(b' ');
    matches!(last, b'-' | b'+' | b'e' | b'E') && Delimiter::Byte(last) != delimiter
}

impl Column {
    fn new(kind: Kind) -> Column {
        Column { kind, values: 0, elapsed: Elapsed::default(), origin: None }
    }

    /// The number of a cell, counted from the first of the column where a double cannot hold all its digits.
    fn number(&mut self, number: f64, cell: &[u8], decimal: Decimal) -> f64 {
        if self.values == 0 && number.abs() >= EPOCH {
            self.origin = Exact::of(bare(cell), decimal).filter(Exact::is_long);
        }
        match &self.origin {
            None => number,
            Some(origin) => {
                let exact = Exact::of(bare(cell), decimal).and_then(|e| e.less(origin));
                exact.unwrap_or(number - origin.value())
            }
        }
    }

    /// The first number, where the column counts from it.
    pub(crate) fn origin(&self) -> Option<f64> {
        self.origin.as_ref().map(Exact::value)
    }
}
