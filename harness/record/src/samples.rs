//! One recording's CSV: its columns, its rows, and the samples they become.

use crate::error::Section;
use crate::release::release;
use crate::{units, words, Channel, Column, Kind, RecordError, RecordErrors, Rows, GRAVITY};
use std::cell::Cell;
use std::collections::{HashMap, HashSet};
use std::fs::File;
use std::io::{Error, ErrorKind, Read};
use std::path::Path;
use std::rc::Rc;

/// Most columns of a file: those of a spreadsheet.
const COLUMNS: usize = 16_384;
/// Longest row, bytes. One quote that is not closed makes the rest of a file one row.
const ROW: u64 = 32 << 20;
/// What to do about a file that ends amid what it holds.
const COPY: &str = "copy the file again";
/// Columns that are named of those left out, at most.
const NAMED: usize = 20;
/// Fewest samples a recording may have.
const FEWEST: usize = 16;
/// Median steps beyond which a step is a pause.
const PAUSE: f64 = 5.0;
/// Share of its range by which an imposed penetration moves unseen where something was missed.
const MOVED: f64 = 0.1;
/// Samples in a row that have to read as much: a spike is no impact.
const IN_A_ROW: usize = 3;
/// Largest reading in SI: no instrument reads more, and powers of more leave the range of a double.
pub const LARGEST: f64 = 1e30;

/// What a file holds, SI.
#[derive(Debug)]
pub struct Samples {
    /// s, strictly increasing
    pub time: Vec<f64>,
    /// Indexed by `Channel::index`.
    pub channels: [Option<Vec<f64>>; 3],
    pub columns: Vec<Column>,
    /// Every row of the file.
    pub rows: Rows,
    /// What was merged or left out, each naming the file.
    pub notes: Vec<String>,
}

/// A file by itself, SI: a recording, or a simulation's results.
#[derive(Clone, Debug)]
pub struct Signals {
    /// s, strictly increasing
    pub time: Vec<f64>,
    /// Indexed by `Channel::index`.
    pub channels: [Option<Vec<f64>>; 3],
    /// Whether the contact is closed, by sample, as a contactor's contacts or a light barrier show it.
    pub closed: Option<Vec<bool>>,
    /// What was merged or left out, each naming the file.
    pub notes: Vec<String>,
}

/// What of a file is wanted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wanted {
    /// Names of columns, each a channel (or time, or closed) and the column that it is.
    pub columns: Vec<(String, String)>,
    /// The rows of this number in the column `run`.
    pub run: Option<f64>,
}

/// Reads the file at `path` by itself. Rows of one time become one sample; columns that are not known are left out, and
/// pauses stay.
///
/// # Errors
/// Everything wrong with the file.
pub fn read_file(path: &Path) -> Result<Signals, RecordErrors> {
    read_wanted(path, &Wanted::default())
}

/// The same of a file as programs that simulate write it: a column may be called after what it is a part of
/// (`contact.force`), and be without a unit, in SI then; of several runs one is read.
///
/// # Errors
/// Everything wrong with the file.
pub fn read_wanted(path: &Path, wanted: &Wanted) -> Result<Signals, RecordErrors> {
    let mut table = Table::read(path, Use::Alone(wanted)).map_err(RecordErrors)?;
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy();
    let mut notes: Vec<String> = table.assumed.iter().map(|a| format!("{name}: {a}.")).collect();
    notes.extend(left_out(&name, &table.left_out));
    let (mut data, _) = table.merged(&name, &mut notes);
    if data[table.clock].len() < FEWEST {
        let n = data[table.clock].len();
        return Err(RecordErrors(vec![table.too_few(path, n, "")]));
    }
    let channels = table.channels(&mut data);
    let event = table.columns.iter().position(|c| c.name == units::CLOSED);
    let closed = event.map(|i| data[i].iter().map(|v| *v > 0.5).collect());
    Ok(Signals { time: std::mem::take(&mut data[table.clock]), channels, closed, notes })
}

/// What to report of the columns of the file `name` that are not known: the likely slips, then all of them.
fn left_out(name: &str, columns: &[String]) -> Vec<String> {
    let slip = |c: &String| {
        // of many words one may well be a known one
        let meant = words::nearest(c, &units::COLUMNS).filter(|_| !c.contains(char::is_whitespace))?;
        Some(format!("{name}: column {c:?} is not known; did you mean {meant:?}?"))
    };
    let mut notes: Vec<String> = columns.iter().filter_map(slip).take(NAMED).collect();
    let shown: Vec<_> = columns.iter().take(NAMED).map(|c| words::beginning(c)).collect();
    if let Some(more) = columns.len().checked_sub(shown.len()).filter(|_| !columns.is_empty()) {
        let more = if more > 0 { format!(", and {more} more") } else { String::new() };
        notes.push(format!("{name}: columns that are not known were left out: {}{more}.", shown.join(", ")));
    }
    notes
}

/// Reads the file `name` in `dir`, a recording of `kind` where that is known. Rows of one time become one sample; of a
/// recording with pauses the piece that holds the impact is kept, and of a drop test what follows the release.
///
/// # Errors
/// Everything wrong with the file.
pub fn read(dir: &Path, name: &str, kind: Option<Kind>) -> Result<Samples, Vec<RecordError>> {
    let path = dir.join(name);
    let mut table = Table::read(&path, Use::Campaign(kind))?;
    let mut notes = Vec::new();
    let (mut data, mut rows) = table.merged(name, &mut notes);
    let too_few = |n: usize, of: &str| vec![table.too_few(&path, n, of)];
    let n = data[table.clock].len();
    if n < FEWEST {
        return Err(too_few(n, ""));
    }
    let imposed = table.column(Channel::Penetration).filter(|_| kind == Some(Kind::Indentation));
    let pieces = pieces(&data[table.clock], imposed.map(|i| &data[i][..]));
    if pieces.len() > 1 {
        let piece = kept_piece(&table, &data, &pieces, kind);
        let (from, to) = pieces[piece];
        if to - from < FEWEST {
            return Err(too_few(to - from, "between its pauses "));
        }
        let time = &data[table.clock];
        let pause = |i: usize, side: &str| {
            let (before, after) = (time[i - 1], time[i]);
            format!(
                "{name}: a pause of {} s after {} s: what lies {side} it was left out.",
                short(after - before),
                short(before)
            )
        };
        if from > 0 {
            notes.push(pause(from, "before"));
        }
        if to < n {
            notes.push(pause(to, "after"));
        }
        rows = kept(&mut data, &rows, from, to);
    }
    if let Some(i) = table.column(Channel::Acceleration).filter(|_| kind == Some(Kind::DropTest)) {
        if let Some(r) = release(&data[table.clock], &data[i], &[-1.0]) {
            let n = data[i].len();
            if n - r.first < FEWEST {
                return Err(too_few(n - r.first, "from the release on "));
            }
            let at = short(data[table.clock][r.first]);
            notes.push(format!("{name}: the body rests until its release at {at} s: what lies before was left out."));
            rows = kept(&mut data, &rows, r.first, n);
            if r.fall != 0.0 {
                notes.push(format!(
                    "{name}: acceleration was zeroed at rest: {GRAVITY} m/s^2 was taken off, so that it is zero in free fall."
                ));
                data[i].iter_mut().for_each(|a| *a -= r.fall);
            }
        }
    }
    let channels = table.channels(&mut data);
    let time = std::mem::take(&mut data[table.clock]);
    // nothing predicts events yet: they are checked, and go no farther
    let columns = table.columns.into_iter().filter(|c| c.name != units::CLOSED).collect();
    Ok(Samples { time, channels, columns, rows, notes })
}

/// Keeps the samples from `from` to before `to` of the columns `data`, and returns what became of `rows` then.
fn kept(data: &mut [Vec<f64>], rows: &Rows, from: usize, to: usize) -> Rows {
    for y in data {
        *y = y[from..to].to_vec();
    }
    let kept = |s: Option<usize>| s.filter(|s| (from..to).contains(s)).map(|s| s - from);
    let (times, samples) = rows.iter().map(|r| (r.time, kept(r.sample))).unzip();
    Rows::of(times, samples)
}

/// A number in seven digits at most.
pub fn short(v: f64) -> String {
    (v as f32).to_string()
}

/// Stretches without a pause: first sample, and the one behind the last. An `imposed` penetration is known on either side of
/// a pause: where it has hardly moved, nothing was missed, and a machine that only reads less often has made no pause.
fn pieces(time: &[f64], imposed: Option<&[f64]>) -> Vec<(usize, usize)> {
    let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    let longest = PAUSE * steps[steps.len() / 2];
    let most = imposed.map_or(0.0, |x| MOVED * crate::range(x));
    let moved = |i: usize| imposed.is_none_or(|x| (x[i] - x[i - 1]).abs() > most);
    let mut starts = vec![0];
    starts.extend((1..time.len()).filter(|i| time[*i] - time[*i - 1] > longest && moved(*i)));
    let ends = starts.iter().skip(1).copied().chain([time.len()]);
    starts.iter().copied().zip(ends).collect()
}

/// The piece that holds the impact: where force, or acceleration, lies farthest from its median; the deepest
/// penetration of an indentation, or where nothing else is recorded.
fn kept_piece(table: &Table, data: &[Vec<f64>], pieces: &[(usize, usize)], kind: Option<Kind>) -> usize {
    let [force, acceleration, penetration] = Channel::ALL.map(|c| table.column(c));
    let forced = force.or(acceleration).filter(|_| kind != Some(Kind::Indentation));
    let Some(read) = forced.or(penetration).or(force) else { return 0 };
    let mut sorted = data[read].clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[sorted.len() / 2];
    let away = |v: &f64| if forced.is_some() { (v - median).abs() } else { v - median };
    let most = |(from, to): (usize, usize)| {
        let least_of = |w: &[f64]| w.iter().map(away).fold(f64::INFINITY, f64::min);
        data[read][from..to].windows(IN_A_ROW).map(least_of).fold(f64::NEG_INFINITY, f64::max)
    };
    (0..pieces.len()).fold(0, |best, i| if most(pieces[i]) > most(pieces[best]) { i } else { best })
}

/// What a file is read for.
#[derive(Clone, Copy, PartialEq)]
enum Use<'a> {
    /// A recording of a campaign, of its kind where that is known.
    Campaign(Option<Kind>),
    /// By itself: columns that are not known do not matter.
    Alone(&'a Wanted),
}

impl Use<'_> {
    /// What to do about a file that is not there.
    fn cure(self) -> &'static str {
        match self {
            Use::Campaign(_) => "put the recording beside campaign.toml, or take it out of the list",
            Use::Alone(_) => "name a CSV file with a header of columns \"name [unit]\"",
        }
    }
}

/// A file that is read as far as its rows are no longer than [`ROW`].
struct RowByRow {
    file: File,
    /// Bytes.
    read: u64,
    /// Where the last row that was taken ends, bytes from the beginning of the file.
    ended: Rc<Cell<u64>>,
}

impl Read for RowByRow {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.read.saturating_sub(self.ended.get()) > ROW {
            return Err(Error::new(ErrorKind::InvalidData, format!("a row has more than {ROW} bytes")));
        }
        let n = self.file.read(buffer)?;
        self.read += n as u64;
        Ok(n)
    }
}

/// What is said of a file that the system does not give from that line on, or of a row that is too long.
fn unreadable(path: &Path, line: usize, e: &Error, cure: &str) -> RecordError {
    let cure = input::cure(e).unwrap_or(cure);
    RecordError::new(Section::Recording, path, line, format!("cannot be read ({e})"), cure)
}

/// What to do about a file that could not be read to its end.
fn cure_of(e: &Error) -> &'static str {
    match e.kind() {
        ErrorKind::InvalidData => "close the quotes in it, and end the row of every sample by a line break",
        _ => COPY,
    }
}

/// A file as it stands: columns in SI, rows in the order of the file.
struct Table {
    columns: Vec<Column>,
    /// Names of columns that are not known.
    left_out: Vec<String>,
    /// What a header that says less was taken to mean.
    assumed: Vec<String>,
    /// Index of the column time.
    clock: usize,
    /// A column each.
    data: Vec<Vec<f64>>,
    /// The line each row stands on: blank lines are skipped, not counted away.
    lines: Vec<usize>,
}

impl Table {
    fn read(path: &Path, purpose: Use) -> Result<Table, Vec<RecordError>> {
        let error =
            |section: Section, line: usize, what: String, cure: &str| RecordError::new(section, path, line, what, cure);
        let file =
            input::open_at_most(path, input::RECORDING).map_err(|e| vec![unreadable(path, 0, &e, purpose.cure())])?;
        // where the last row ended, bytes
        let ended = Rc::new(Cell::new(0));
        let file = RowByRow { file, read: 0, ended: ended.clone() };
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).from_reader(file);
        let head = match reader.headers() {
            Ok(h) => h.clone(),
            Err(e) => {
                if let csv::ErrorKind::Io(e) = e.kind() {
                    return Err(vec![unreadable(path, 1, e, cure_of(e))]);
                }
                return Err(vec![error(
                    Section::CsvHeader,
                    1,
                    e.to_string(),
                    "write a header of columns \"name [unit]\"",
                )]);
            }
        };
        if head.len() > COLUMNS {
            let what = format!("{} columns, more than the {COLUMNS} that are read", head.len());
            return Err(vec![error(
                Section::CsvHeader,
                1,
                what,
                "leave out the columns that are no recording of the contact",
            )]);
        }
        let mut records = reader.records().peekable();
        let width = records.peek().and_then(|r| r.as_ref().ok()).map_or(head.len(), csv::StringRecord::len);
        let head: csv::StringRecord = input::whole_names(head.iter().map(String::from).collect(), width).into();
        if let Some((what, cure)) = dialect(&head, width) {
            return Err(vec![error(Section::CsvHeader, 1, what, cure)]);
        }
        let Header { columns, fields, left_out, assumed, run, mut errors } = header(path, &head, purpose);
        let wanted_run = match purpose {
            Use::Alone(w) => w.run,
            Use::Campaign(_) => None,
        };
        let mut runs: Vec<f64> = Vec::new();
        let mut data: Vec<Vec<f64>> = vec![Vec::new(); columns.len()];
        let mut lines: Vec<usize> = Vec::new();
        let mut faults = Faults::default();
        let mut rows = 0;
        for row in records {
            rows += 1;
            if let Some((r, from)) = row.as_ref().ok().and_then(|r| Some((r, r.position()?.byte()))) {
                ended.set(from + r.as_slice().len() as u64);
            }
            let row = match row {
                Ok(r) if r.len() != head.len() => {
                    let line = r.position().map_or(0, |p| p.line() as usize);
                    let what = || "this row has another number of cells than the header".to_string();
                    faults.add(Section::CsvHeader, "", line, what, "complete or remove it");
                    continue;
                }
                Ok(r) => r,
                Err(e) => {
                    if let csv::ErrorKind::Io(e) = e.kind() {
                        // behind the last row that was read
                        let line = lines.last().map_or(2, |l| l + 1);
                        errors.push(unreadable(path, line, e, cure_of(e)));
                        break;
                    }
                    let line = e.position().map_or(0, |p| p.line() as usize);
                    let (what, cure) = match e.kind() {
                        csv::ErrorKind::Utf8 { .. } => ("this row is no UTF-8 text", "write it as plain numbers"),
                        _ => ("this row cannot be read", COPY),
                    };
                    faults.add(Section::CsvHeader, "", line, || what.to_string(), cure);
                    continue;
                }
            };
            let line = row.position().map_or(0, |p| p.line() as usize);
            if let Some(of) = run.and_then(|f| row.get(f)?.parse::<f64>().ok()).filter(|r| r.is_finite()) {
                if !runs.contains(&of) {
                    runs.push(of);
                }
                if wanted_run.is_some_and(|w| w != of) {
                    continue;
                }
            }
            let texts = || fields.iter().map(|f| row.get(*f).unwrap_or_default());
            let number = |text: &str| text.parse::<f64>().ok().filter(|v| v.is_finite());
            let si = |(text, c): (&str, &Column)| Some(number(text)? * c.to_si).filter(|v| v.abs() <= LARGEST);
            let cells: Vec<Option<f64>> = texts().zip(&columns).map(si).collect();
            for (c, (cell, v)) in columns.iter().zip(texts().zip(&cells)) {
                match v {
                    None if number(cell).is_some() => {
                        let cell = words::beginning(cell);
                        let what = || format!("{} holds {cell} {}, beyond {LARGEST:e} in SI", c.name, c.unit);
                        let cure = "correct the number, or the unit in the header";
                        faults.add(Section::Units, &c.name, line, what, cure);
                    }
                    None => {
                        let cell = words::beginning(cell);
                        let what = || format!("{} holds {cell:?}, not a finite number", c.name);
                        let cure = match number(&cell.replacen(',', ".", 1)) {
                            Some(_) => {
                                "write it with a decimal point, or make a campaign of the files with `touchdown import`"
                            }
                            None => "remove the rows of the gap, or cut the recording there",
                        };
                        faults.add(Section::MissingValues, &c.name, line, what, cure);
                    }
                    Some(v) if c.name == units::CLOSED && *v != 0.0 && *v != 1.0 => {
                        let what = || format!("{} holds {cell:?}, neither 0 nor 1", c.name);
                        faults.add(
                            Section::CsvHeader,
                            &c.name,
                            line,
                            what,
                            "write 1 where the contact is closed and 0 where it is open",
                        );
                    }
                    Some(_) => {}
                }
            }
            if let Some(v) = cells.into_iter().collect::<Option<Vec<f64>>>() {
                data.iter_mut().zip(v).for_each(|(y, v)| y.push(v));
                lines.push(line);
            }
        }
        let all: Vec<String> = runs.iter().map(f64::to_string).collect();
        let chosen = wanted_run.or(runs.first().copied().filter(|_| runs.len() < 2));
        if !runs.is_empty() && !chosen.is_some_and(|c| runs.contains(&c)) {
            let what = format!("it holds the runs {}", all.join(", "));
            return Err(vec![error(Section::NumberOfSamples, 1, what, "say which, such as --run 1")]);
        }
        let clock = columns.iter().position(|c| c.name == "time");
        let swapped = clock.and_then(|c| time_cure(&columns, &data, c));
        if let (Some(t), Some(cure)) = (clock.map(|c| &data[c]), swapped) {
            if let Some(i) = (1..t.len()).find(|i| t[*i] < t[i - 1]) {
                let what = format!("time goes back here, from {} s to {} s", t[i - 1], t[i]);
                return Err(vec![error(Section::Time, lines[i], what, &cure)]);
            }
        }
        if let Some(t) = clock.map(|c| &data[c]) {
            for i in (1..t.len()).filter(|i| t[*i] < t[*i - 1]) {
                let what = || format!("time goes back here, from {} s to {} s", t[i - 1], t[i]);
                faults.add(
                    Section::Time,
                    "order",
                    lines[i],
                    what,
                    "sort the rows by time, and keep one recording a file",
                );
            }
        }
        errors.extend(faults.all.into_iter().map(|f| f.error(path)));
        if rows < FEWEST {
            let cure = format!("record at least {FEWEST} samples");
            let line = lines.last().copied().unwrap_or(1);
            errors.push(error(
                Section::NumberOfSamples,
                line,
                format!("{rows} samples are too few to judge anything"),
                &cure,
            ));
        }
        errors.sort_by_key(|e| e.line);
        match clock {
            Some(clock) if errors.is_empty() => Ok(Table { columns, left_out, assumed, clock, data, lines }),
            _ => Err(errors),
        }
    }

    /// That `n` samples are too few; `of`: which.
    fn too_few(&self, path: &Path, n: usize, of: &str) -> RecordError {
        let line = self.lines.last().copied().unwrap_or(1);
        let cure = format!("record at least {FEWEST} samples");
        RecordError::new(
            Section::NumberOfSamples,
            path,
            line,
            format!("{n} samples {of}are too few to judge anything"),
            cure,
        )
    }

    /// The channels of `data`, which holds a column each, taken out of it.
    fn channels(&self, data: &mut [Vec<f64>]) -> [Option<Vec<f64>>; 3] {
        Channel::ALL.map(|c| self.column(c).map(|i| std::mem::take(&mut data[i])))
    }

    fn column(&self, c: Channel) -> Option<usize> {
        self.columns.iter().position(|k| k.name == c.name())
    }

    /// The columns, taken out of the table, with rows of one time merged into the mean of their readings, and what became of
    /// every row.
    fn merged(&mut self, name: &str, notes: &mut Vec<String>) -> (Vec<Vec<f64>>, Rows) {
        let data = std::mem::take(&mut self.data);
        let time = &data[self.clock];
        let again = |i: &usize| time[*i] == time[*i - 1];
        let Some(first) = (1..time.len()).find(again) else {
            let rows = Rows::alike(time.clone());
            return (data, rows);
        };
        // by sample: rows that it was made of
        let mut counts: Vec<f64> = Vec::new();
        let mut samples: Vec<usize> = Vec::with_capacity(time.len());
        for i in 0..time.len() {
            if i > 0 && again(&i) {
                counts[samples[i - 1]] += 1.0;
            } else {
                counts.push(1.0);
            }
            samples.push(counts.len() - 1);
        }
        notes.push(format!(
            "{name}: rows of one time were merged into one sample, the mean of their readings: {} in all, the first at {} s \
             (line {}).",
            time.len() - counts.len(),
            short(time[first]),
            self.lines[first]
        ));
        let mean = |y: &Vec<f64>| {
            let mut sums = vec![0.0; counts.len()];
            for (v, s) in y.iter().zip(&samples) {
                sums[*s] += v;
            }
            sums.iter().zip(&counts).map(|(s, n)| s / n).collect()
        };
        let mut merged: Vec<Vec<f64>> = data.iter().map(mean).collect();
        // a mean of equal times may miss them by a rounding
        merged[self.clock] = time.clone();
        merged[self.clock].dedup();
        (merged, Rows::of(time.clone(), samples.into_iter().map(Some).collect()))
    }
}

/// What is to be said of a file whose cells are not parted as a campaign's are; None where they may be.
fn dialect(head: &csv::StringRecord, width: usize) -> Option<(String, &'static str)> {
    const IMPORT: &str = "write commas between the cells and decimal points, or make a campaign of such files with \
                          `touchdown import`, which reads them";
    let one = if head.len() <= 2 { head.iter().next()? } else { "" };
    let by = [(';', "semicolons"), ('\t', "tabs")].into_iter().find(|b| one.contains(b.0) && one.contains("time"));
    if let Some((_, name)) = by {
        return Some((format!("{name} stand between the cells"), IMPORT));
    }
    (head.len() > 1 && width == 2 * head.len())
        .then(|| ("a row has twice as many cells as the header: these are decimal commas".to_string(), IMPORT))
}

/// What to do where time goes back: the column that looks like the time, where another one does.
fn time_cure(columns: &[Column], data: &[Vec<f64>], clock: usize) -> Option<String> {
    let rises = |y: &Vec<f64>| y.len() > 3 && y.windows(2).all(|w| w[1] > w[0]);
    let other = (0..columns.len()).find(|c| *c != clock && rises(&data[*c]))?;
    Some(format!("are the columns time and {} swapped? Correct the header", columns[other].name))
}

/// Name and unit of a column: the unit stands in the last brackets, unless these hold an index such as `[1,2]`.
fn parted(head: &str) -> (&str, Option<&str>) {
    match head.rsplit_once('[') {
        Some((name, inside)) if !inside.contains(',') => (name.trim(), inside.strip_suffix(']').map(str::trim)),
        _ => (head, None),
    }
}

/// What a header says, and what is wrong with it.
struct Header {
    columns: Vec<Column>,
    /// Where in a row each column stands.
    fields: Vec<usize>,
    /// Names of columns that are not known.
    left_out: Vec<String>,
    /// What a header that says less was taken to mean.
    assumed: Vec<String>,
    /// Where in a row the number of the run stands.
    run: Option<usize>,
    errors: Vec<RecordError>,
}

/// The channel that each column of a simulation's results is, by what is wanted, by its own name, or by the last part of
/// it: None for others.
fn roles(names: &[&str], wanted: &Wanted) -> Result<Vec<Option<&'static str>>, (String, String)> {
    let mut roles = vec![None; names.len()];
    for (channel, column) in &wanted.columns {
        let known = units::COLUMNS.iter().find(|c| *c == channel);
        let Some(known) = known else {
            return Err((format!("{channel:?} is no channel"), words::instead(channel, &units::COLUMNS)));
        };
        // another file may hold it
        if let Some(at) = names.iter().position(|n| n == column) {
            roles[at] = Some(*known);
        }
    }
    for known in units::COLUMNS {
        if roles.contains(&Some(known)) {
            continue;
        }
        if let Some(at) = names.iter().position(|n| *n == known) {
            roles[at] = Some(known);
            continue;
        }
        let last = |n: &&str| n.rsplit(['.', '/', ':']).next().is_some_and(|l| l == known && l.len() < n.len());
        let of: Vec<usize> = (0..names.len()).filter(|i| last(&names[*i])).collect();
        match of[..] {
            [] => {}
            [one] => roles[one] = Some(known),
            [first, ..] => {
                let all: Vec<&str> = of.iter().map(|i| names[*i]).collect();
                let what = format!("{} may be {known}", all.join(", "));
                return Err((what, format!("say which, such as --map {known}={}", names[first])));
            }
        }
    }
    Ok(roles)
}

/// The columns of a header, one each, and what is wrong with them.
fn header(path: &Path, head: &csv::StringRecord, purpose: Use) -> Header {
    let mut errors = Vec::new();
    let mut error =
        |section: Section, what: String, cure: String| errors.push(RecordError::new(section, path, 1, what, cure));
    let (mut columns, mut fields, mut left_out): (Vec<Column>, Vec<usize>, Vec<String>) = Default::default();
    let mut assumed = Vec::new();
    let names: Vec<&str> = head.iter().map(|h| parted(h).0).collect();
    let roles = match purpose {
        Use::Campaign(_) => vec![None; names.len()],
        Use::Alone(wanted) => roles(&names, wanted).unwrap_or_else(|(what, cure)| {
            error(Section::CsvHeader, what, cure);
            vec![None; names.len()]
        }),
    };
    let alone = matches!(purpose, Use::Alone(_));
    let run = names.iter().position(|n| *n == "run").filter(|_| alone);
    let mut seen = HashSet::new();
    for (field, h) in head.iter().enumerate() {
        let (mut name, mut unit) = parted(h);
        let mut known = units::COLUMNS.contains(&name);
        if alone {
            let Some(role) = roles[field] else {
                left_out.push(name.into());
                continue;
            };
            if role != name {
                assumed.push(format!("{name} is {role}"));
            }
            if unit.is_none() {
                unit = units::si(role);
                assumed.push(format!("{name} has no unit and is taken to be in {}", unit.unwrap_or("SI")));
            }
            (name, known) = (role, true);
        }
        let shown = words::beginning(name);
        if !known {
            error(Section::CsvHeader, format!("column {shown:?} is not known"), words::instead(name, &units::COLUMNS));
        }
        if !seen.insert(name) {
            error(Section::CsvHeader, format!("column {shown:?} stands twice"), "keep one of them".into());
        }
        let factor = unit.and_then(|u| units::factor(name, u));
        match unit {
            None => {
                let h = words::beginning(h);
                error(Section::CsvHeader, format!("column {h:?} has no unit"), "write it as \"name [unit]\"".into())
            }
            Some(u) if known && factor.is_none() => {
                let shown = words::beginning(u);
                error(Section::Units, format!("unit {shown:?} does not measure {name}"), units::instead(name, u));
            }
            _ => {}
        }
        columns.push(Column { name: name.into(), unit: unit.unwrap_or_default().into(), to_si: factor.unwrap_or(1.0) });
        fields.push(field);
    }
    let has = |name: &str| columns.iter().any(|c| c.name == name);
    if !has("time") {
        error(Section::CsvHeader, "there is no column time".into(), "add time [s]".into());
    }
    if purpose == Use::Campaign(Some(Kind::Indentation)) {
        for c in [Channel::Force, Channel::Penetration].iter().filter(|c| !has(c.name())) {
            let cure = "record both force and penetration";
            error(Section::CsvHeader, format!("an indentation needs the channel {}", c.name()), cure.into());
        }
    } else if !(Channel::ALL.iter().any(|c| has(c.name())) || alone && has(units::CLOSED)) {
        let mut cure = "record force [N], acceleration [m/s^2] or penetration [m]".to_string();
        if alone {
            cure = format!("say which column is one, such as --map force=COLUMN; its columns are {}", names.join(", "));
        }
        error(Section::CsvHeader, "there is no channel besides time".into(), cure);
    }
    Header { columns, fields, left_out, assumed, run, errors }
}

/// One thing wrong with rows, reported where it stands first.
struct Fault {
    section: Section,
    line: usize,
    what: String,
    cure: &'static str,
    more: usize,
}

impl Fault {
    fn error(self, path: &Path) -> RecordError {
        let more = match self.more {
            0 => String::new(),
            1 => ", and so does 1 row more".into(),
            n => format!(", and so do {n} rows more"),
        };
        RecordError::new(self.section, path, self.line, self.what + &more, self.cure)
    }
}

/// What is wrong with rows.
#[derive(Default)]
struct Faults {
    all: Vec<Fault>,
    /// Where each stands, by its cure and what it is of.
    places: HashMap<&'static str, HashMap<String, usize>>,
}

impl Faults {
    fn add(&mut self, section: Section, of: &str, line: usize, what: impl Fn() -> String, cure: &'static str) {
        let places = self.places.entry(cure).or_default();
        match places.get(of) {
            Some(at) => self.all[*at].more += 1,
            None => {
                places.insert(of.into(), self.all.len());
                self.all.push(Fault { section, line, what: what(), cure, more: 0 });
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_text(text: &str, kind: Kind) -> Result<Samples, Vec<RecordError>> {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("r.csv"), text).unwrap();
        read(dir.path(), "r.csv", Some(kind))
    }

    /// Rows of (s, N).
    fn force(rows: &[(f64, f64)]) -> String {
        let rows: Vec<String> = rows.iter().map(|(t, f)| format!("{t},{f}\n")).collect();
        format!("time [s],force [N]\n{}", rows.concat())
    }

    #[test]
    fn rows_of_one_time_become_their_mean() {
        let mut rows: Vec<(f64, f64)> = (0..20).map(|i| (0.1 * f64::from(i), f64::from(i))).collect();
        rows.insert(6, (rows[5].0, 8.0));
        rows.insert(12, (rows[11].0, 10.0));
        let s = read_text(&force(&rows), Kind::DropTest).unwrap();
        let f = s.channels[0].as_ref().unwrap();
        assert_eq!((s.time.len(), f.len(), s.rows.len()), (20, 20, 22));
        assert_eq!((f[4], f[5], f[6], f[10]), (4.0, 6.5, 6.0, 10.0));
        assert_eq!((s.rows.get(5).sample, s.rows.get(6).sample, s.rows.get(7).sample), (Some(5), Some(5), Some(6)));
        assert!(s.time.windows(2).all(|w| w[1] > w[0]));
        assert_eq!(s.notes.len(), 1);
        assert!(
            s.notes[0].ends_with("the mean of their readings: 2 in all, the first at 0.5 s (line 8)."),
            "{:?}",
            s.notes
        );
    }

    #[test]
    fn an_indentation_that_is_read_less_often_while_it_moves_slowly_has_no_pause() {
        let mut time: Vec<f64> = (0..50).map(|i| 4.0 * f64::from(i)).collect();
        time.extend((1..200).map(|i| 196.0 + 0.1 * f64::from(i)));
        let depth: Vec<f64> =
            (0..time.len()).map(|i| if i < 50 { 1e-8 * i as f64 } else { 5e-7 * (1.0 + i as f64) }).collect();
        assert_eq!(pieces(&time, Some(&depth)), [(0, time.len())]);
        // of a motion that is not imposed nobody knows what was missed
        assert!(pieces(&time, None).len() > 1);
        let jumps: Vec<f64> = (0..time.len()).map(|i| if i < 20 { 0.0 } else { 1.0 }).collect();
        assert_eq!(pieces(&time, Some(&jumps)), [(0, 20), (20, time.len())]);
    }

    #[test]
    fn of_a_recording_with_pauses_the_piece_with_the_impact_is_kept() {
        // quiet, then the impact after a pause, then quiet again; a spike in the first piece
        let time = |i: i32| f64::from(i) + if i >= 20 { 100.0 } else { 0.0 } + if i >= 60 { 50.0 } else { 0.0 };
        let pulse = |i: i32| if (30..40).contains(&i) { 20.0 } else { 0.1 * f64::from(i % 3) };
        let rows: Vec<(f64, f64)> = (0..90).map(|i| (time(i), if i == 7 { 99.0 } else { pulse(i) })).collect();
        let s = read_text(&force(&rows), Kind::DropTest).unwrap();
        assert_eq!((s.time[0], s.time.len(), s.rows.len()), (120.0, 40, 90));
        assert_eq!((s.rows.get(19).sample, s.rows.get(20).sample, s.rows.get(60).sample), (None, Some(0), None));
        assert_eq!(
            s.notes,
            [
                "r.csv: a pause of 101 s after 19 s: what lies before it was left out.",
                "r.csv: a pause of 51 s after 159 s: what lies after it was left out."
            ]
        );
    }

    #[test]
    fn of_an_indentation_the_deepest_piece_is_kept() {
        let text = |deep: f64| {
            let rows: Vec<String> = (0..60)
                .map(|i| {
                    let t = f64::from(i) + if i >= 30 { 100.0 } else { 0.0 };
                    let x = f64::from(i % 30) * if i >= 30 { deep } else { 1.0 };
                    format!("{t},{},{x}\n", if i < 30 { -500.0 } else { x })
                })
                .collect();
            format!("time [s],force [N],penetration [nm]\n{}", rows.concat())
        };
        assert_eq!(read_text(&text(2.0), Kind::Indentation).unwrap().time[0], 130.0);
        assert_eq!(read_text(&text(0.5), Kind::Indentation).unwrap().time[0], 0.0);
    }

    #[test]
    fn a_piece_too_short_is_an_error() {
        let rows: Vec<(f64, f64)> = (0..40)
            .map(|i| (f64::from(i) + if i >= 30 { 100.0 } else { 0.0 }, if i > 34 { 9.0 } else { 0.0 }))
            .collect();
        let e = read_text(&force(&rows), Kind::DropTest).unwrap_err();
        assert_eq!(e[0].what, "10 samples between its pauses are too few to judge anything");
    }

    /// Sixteen rows of time, force, what else a simulation writes, and whether the contact is closed.
    fn simulated(head: &str, closed: impl Fn(i32) -> f64) -> String {
        let rows: Vec<String> = (0..16).map(|i| format!("{i},{},NaN,{}\n", 2 * i, closed(i))).collect();
        format!("time [s],force [kN],{head}\n{}", rows.concat())
    }

    #[test]
    fn a_file_by_itself_may_hold_more_and_tells_events() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.csv");
        std::fs::write(&path, simulated("velocity,closed [1]", |i| f64::from(i32::from(i > 7)))).unwrap();
        let s = read_file(&path).unwrap();
        assert_eq!((s.time.len(), s.channels[0].as_ref().unwrap()[3]), (16, 6000.0));
        assert_eq!(s.closed.unwrap(), [[false; 8], [true; 8]].concat());
        assert_eq!(s.notes, ["r.csv: columns that are not known were left out: velocity."]);
        std::fs::write(&path, simulated("Force [N],closed [1]", f64::from)).unwrap();
        let e = read_file(&path).unwrap_err().0;
        assert_eq!((e.len(), e[0].line), (1, 4));
        assert!(e[0]
            .to_string()
            .contains("closed holds \"2\", neither 0 nor 1, and so do 13 rows more; write 1 where"));
        assert!(read_file(&dir.path().join("none.csv")).unwrap_err().to_string().contains("name a CSV file"));
    }

    #[test]
    fn results_of_simulations_are_read_by_the_last_part_of_their_names() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.csv");
        let rows: String = (0..16).map(|i| format!("{i},{},{}\n", 10 * i, 2 * i)).collect();
        let read = |head: &str, wanted: &Wanted| {
            std::fs::write(&path, format!("{head}\n{rows}")).unwrap();
            read_wanted(&path, wanted)
        };
        let any = Wanted::default();
        for head in
            ["time [s],bar.x [m],contact.force [N]", "\"time\",\"x\",\"model.root.contact.force\"", "time,x,force"]
        {
            let s = read(head, &any).unwrap_or_else(|e| panic!("{head}: {e}"));
            assert_eq!(s.channels[0].as_ref().unwrap()[3], 6.0, "{head}");
            assert!(s.notes.iter().any(|n| n.contains("is force") || n.contains("taken to be in N")), "{:?}", s.notes);
        }
        let e = read("time,a.force [N],b.force [N]", &any).unwrap_err().to_string();
        assert!(e.contains("--map force=a.force"), "{e}");
        let wanted = Wanted { columns: vec![("force".into(), "b.force".into())], run: None };
        assert_eq!(read("time,a.force [N],b.force [kN]", &wanted).unwrap().channels[0].as_ref().unwrap()[3], 6000.0);
        let e = read("time,u,y", &any).unwrap_err().to_string();
        assert!(e.contains("its columns are time, u, y"), "{e}");
    }

    #[test]
    fn of_several_runs_one_is_read() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.csv");
        let rows: String = (0..40).map(|i| format!("{},{},{i}\n", 1 + i / 20, i % 20)).collect();
        std::fs::write(&path, format!("run [1],time [s],force [N]\n{rows}")).unwrap();
        let e = read_file(&path).unwrap_err().to_string();
        assert!(e.contains("it holds the runs 1, 2; say which, such as --run 1"), "{e}");
        let s = read_wanted(&path, &Wanted { run: Some(2.0), ..Wanted::default() }).unwrap();
        assert_eq!((s.time.len(), s.channels[0].as_ref().unwrap()[0]), (20, 20.0));
        assert!(read_wanted(&path, &Wanted { run: Some(3.0), ..Wanted::default() }).is_err());
    }

    #[test]
    fn names_with_commas_shift_no_column_quoted_or_not() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("r.csv");
        let rows: String = (0..16).map(|i| format!("{i},{},{},{}\n", 10 * i, 2 * i, 3 * i)).collect();
        for head in [
            "time [s],\"F[1,2]\",force [N],\"bar.F[2,1] [N]\"",
            "time [s],F[1,2],force [N],bar.F[2,1] [N]",
            "time [s],F[1 ,2],force [N],\"bar.F[2,1] [N]\"",
        ] {
            std::fs::write(&path, format!("{head}\n{rows}")).unwrap();
            let s = read_file(&path).unwrap_or_else(|e| panic!("{head}: {e}"));
            assert_eq!(s.channels[0].as_ref().unwrap()[3], 6.0, "{head}");
            assert!(s.notes[0].ends_with("F[1,2], bar.F[2,1].") || head.contains("F[1 ,2]"), "{:?}", s.notes);
        }
        // more names than cells that no bracket explains stay an error
        std::fs::write(&path, format!("time [s],a,b,force [N],c\n{rows}")).unwrap();
        assert!(read_file(&path).unwrap_err().to_string().contains("another number of cells"));
    }

    #[test]
    fn events_of_a_campaign_are_checked_and_go_no_farther() {
        let text = |closed: &dyn Fn(i32) -> f64| simulated("penetration [m],closed [1]", closed).replace("NaN", "0");
        let s = read_text(&text(&|_| 1.0), Kind::DropTest).unwrap();
        let names: Vec<&str> = s.columns.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["time", "force", "penetration"]);
        let e = read_text(&text(&|_| 0.5), Kind::DropTest).unwrap_err();
        assert!(e[0].what.starts_with("closed holds \"0.5\", neither 0 nor 1"));
    }

    #[test]
    fn a_number_that_its_unit_carries_beyond_any_reading_is_refused_with_line_and_cure() {
        let rows = |at: &str| -> String {
            (0..20).map(|i| format!("{i},{}\n", if i == 7 || i == 9 { at } else { "1" })).collect()
        };
        for (unit, number) in [("kN", "1e308"), ("kN", "-1e308"), ("N", "1.7e308"), ("N", "1.1e30")] {
            let e = read_text(&format!("time [s],force [{unit}]\n{}", rows(number)), Kind::DropTest).unwrap_err();
            assert_eq!((e.len(), e[0].line), (1, 9), "{e:?}");
            assert_eq!(e[0].what, format!("force holds {number} {unit}, beyond 1e30 in SI, and so does 1 row more"));
            assert_eq!(e[0].cure, "correct the number, or the unit in the header");
        }
        assert!(read_text(&format!("time [s],force [N]\n{}", rows("1e30")), Kind::DropTest).is_ok());
    }

    #[test]
    fn everything_wrong_with_a_file_is_told_at_once() {
        let mut text = String::from("time [s],Force [KN],penetration [mN],force\n");
        for i in 0..20 {
            text += &match i {
                3 | 4 => format!("{i},NaN,0,0\n"),
                5 => "2,1,0,0\n".to_string(),
                9 => "9,1\n".to_string(),
                _ => format!("{i},1,0,0\n"),
            };
        }
        let e = read_text(&text, Kind::Indentation).unwrap_err();
        let said: Vec<(usize, &str, &str)> = e.iter().map(|e| (e.line, e.what.as_str(), e.cure.as_str())).collect();
        let refused = |line: usize, what: &str, cure: &str| {
            assert!(
                said.iter().any(|s| s.0 == line && s.1.contains(what) && s.2.contains(cure)),
                "{line} {what} {cure}: {said:#?}"
            );
        };
        refused(1, "column \"Force\" is not known", "did you mean \"force\"?");
        refused(1, "unit \"mN\" does not measure penetration", "it measures force");
        refused(1, "column \"force\" has no unit", "name [unit]");
        refused(5, "Force holds \"NaN\", not a finite number, and so does 1 row more", "remove the rows");
        refused(11, "another number of cells", "complete or remove it");
        assert_eq!(e.len(), 5, "{said:#?}");
        let back: Vec<(f64, f64)> = (0..20).map(|i| (f64::from(if i == 5 { 2 } else { i }), 0.0)).collect();
        let e = read_text(&force(&back), Kind::DropTest).unwrap_err();
        assert_eq!((e.len(), e[0].line, e[0].what.as_str()), (1, 7, "time goes back here, from 4 s to 2 s"));
    }
}
