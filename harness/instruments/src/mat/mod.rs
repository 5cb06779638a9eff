//! MATLAB MAT-files of versions 4 and 5 (saved as `-v4`, `-v6` or `-v7`): vectors and matrices of numbers, also in
//! structs and cells. Variables of `-v4` and `-v6` are read in blocks; those of `-v7` are compressed whole and kept
//! inflated, as a matrix lies in them column by column.
//!
//! Our own reader: matfile 0.5.0 reads no structs and cells, matrw 0.1.4 unwraps what a damaged file may lack and reads
//! no version 4.
//! Source: MathWorks, MAT-File Format, 2024.

mod v4;
mod v5;

use crate::shared::binary::{Bytes, Number, Order};
use crate::shared::block::{hand, spans};
use crate::{Channel, Fault, Format, Group, Sink, Source};
use std::collections::{HashMap, HashSet};
use std::path::Path;

pub(crate) const FORMAT: Format = Format { name: "MAT", is, open };

/// Properties of a group, at most.
const PROPERTIES: usize = 500;
/// Vectors and matrices, scalars and texts, and notes of a file, at most: a file of many small ones takes no more memory than
/// it has bytes.
const MATRICES: usize = 1 << 16;
const TEXTS: usize = 1 << 16;
const NOTES: usize = 1000;
/// Bytes of the properties of all groups, at most: each group of a file has them all.
const PROPERTY_BYTES: usize = 16 << 20;

fn is(head: &[u8], extension: &str) -> bool {
    v5::is(head) || extension == "mat" && v4::is(head)
}

/// A matrix of numbers, column by column.
struct Matrix {
    /// The variable, its fields and the numbers of its cells, joined by dots.
    name: String,
    /// Of [`Contents::areas`].
    area: usize,
    at: u64,
    number: Number,
    order: Order,
    rows: u64,
    columns: u64,
}

/// All that a file holds.
struct Contents {
    /// The file itself, then what was inflated from it.
    areas: Vec<Bytes>,
    matrices: Vec<Matrix>,
    /// Scalars and texts, by name.
    texts: Vec<(String, String)>,
    notes: Vec<String>,
}

impl Contents {
    fn new(bytes: Bytes) -> Contents {
        Contents { areas: vec![bytes], matrices: Vec::new(), texts: Vec::new(), notes: Vec::new() }
    }

    /// Reads the file's variables from byte `at` on by `one`, which returns where the next begins, None where the file ends
    /// before.
    fn read_all(
        &mut self,
        mut at: u64,
        one: impl Fn(&mut Contents, u64) -> Result<Option<u64>, Fault>,
    ) -> Result<(), Fault> {
        while at < self.areas[0].length() {
            let Some(next) = one(self, at)? else {
                self.notes.push(format!("the file ends within the variable at byte {at}: those before it are read"));
                break;
            };
            at = next;
        }
        Ok(())
    }

    fn leave_out(&mut self, name: &str, why: &str) {
        self.note(|| format!("variable \"{name}\" is left out: {why}"));
    }

    fn note(&mut self, text: impl FnOnce() -> String) {
        match self.notes.len() {
            n if n < NOTES => self.notes.push(text()),
            NOTES => self.notes.push("and more of the kind".to_string()),
            _ => {}
        }
    }

    /// Adds a scalar or a text.
    fn say(&mut self, name: String, text: String) {
        if self.texts.len() < TEXTS {
            self.texts.push((name, text));
        }
    }

    /// Adds an array of numbers: a scalar as a property, a vector or a matrix as channels.
    fn add(&mut self, matrix: Matrix) -> Result<(), Fault> {
        let Matrix { area, at, number, order, rows, columns, .. } = matrix;
        if (rows, columns) == (1, 1) {
            let mut value = [0.0];
            self.areas[area].numbers(at, number.size(), number, order, &mut value)?;
            self.say(matrix.name, value[0].to_string());
        } else if rows > 0 && columns > 0 {
            if rows > 1 && columns > rows {
                self.note(|| format!("matrix \"{}\" is wider than long: its rows are channels", matrix.name));
            }
            if self.matrices.len() < MATRICES {
                self.matrices.push(matrix);
            } else {
                self.leave_out(&matrix.name, &format!("the file has more than {MATRICES} vectors and matrices"));
            }
        }
        Ok(())
    }
}

impl Matrix {
    /// Samples: the longer side.
    fn samples(&self) -> u64 {
        self.rows.max(self.columns)
    }

    fn channels(&self) -> u64 {
        self.rows.min(self.columns)
    }

    /// Bytes from channel to channel, and from sample to sample.
    fn strides(&self) -> (u64, u64) {
        let size = self.number.size();
        if self.columns > self.rows {
            (size, size * self.rows)
        } else {
            (size * self.rows, size)
        }
    }

    /// The structs that the matrix lies in, the innermost first.
    fn structs(&self) -> impl Iterator<Item = &str> {
        self.name.rmatch_indices('.').map(|(at, _)| &self.name[..at])
    }

    /// The struct that the matrix is a field of, and the field; empty where it is a variable of its own.
    fn field(&self) -> (&str, &str) {
        self.name.rsplit_once('.').unwrap_or(("", &self.name))
    }
}

struct Mat {
    areas: Vec<Bytes>,
    matrices: Vec<Matrix>,
    groups: Vec<Group>,
    /// Of each group: its matrices.
    members: Vec<Vec<usize>>,
    notes: Vec<String>,
}

fn open(path: &Path) -> Result<Box<dyn Source>, Fault> {
    let mut bytes = Bytes::open(path)?;
    let head = bytes.bytes(0, bytes.length().min(128))?;
    let mut contents = if v5::is(&head) { v5::read(path, bytes)? } else { v4::read(bytes)? };
    if contents.matrices.is_empty() {
        let left = if contents.notes.is_empty() { String::new() } else { format!(" ({})", contents.notes.join("; ")) };
        let cure = "save vectors or matrices of numbers";
        return Err(Fault::new(path, format!("the file holds no vectors of numbers{left}"), cure));
    }
    let tables = tables(&mut contents)?;
    let (groups, members) = grouped(&mut contents, &tables);
    let Contents { areas, matrices, notes, .. } = contents;
    Ok(Box::new(Mat { areas, matrices, groups, members, notes }))
}

/// Samples of a table's first column that have to grow, at most and at least.
const GROW: u64 = 1000;
const FEWEST: u64 = 8;

/// Indices of the matrices that are tables of their own: several whose first column grows, each its own clock, and no vector of their
/// length that grows, which would be the clock of all. A single one may belong to the vectors beside it.
fn tables(contents: &mut Contents) -> Result<HashSet<usize>, Fault> {
    let (mut all, mut clocks) = (HashSet::new(), HashSet::new());
    for (i, m) in contents.matrices.iter().enumerate().filter(|(_, m)| m.samples() >= FEWEST) {
        let mut first = vec![0.0; m.samples().min(GROW) as usize];
        contents.areas[m.area].numbers(m.at, m.strides().1, m.number, m.order, &mut first)?;
        if !first.windows(2).all(|w| w[1] > w[0]) {
            continue;
        }
        if m.channels() > 1 {
            all.insert(i);
        } else {
            clocks.insert(m.samples());
        }
    }
    all.retain(|i| !clocks.contains(&contents.matrices[*i].samples()));
    Ok(if all.len() > 1 { all } else { HashSet::new() })
}

/// Groups of one length each; a struct that has its own time is a group of its own, and so is each of the `tables`.
fn grouped(contents: &mut Contents, tables: &HashSet<usize>) -> (Vec<Group>, Vec<Vec<usize>>) {
    let is_time = |m: &&Matrix| m.channels() == 1 && ["time", "t"].contains(&m.field().1.to_lowercase().as_str());
    let timed: HashSet<(String, u64)> = (contents.matrices.iter().filter(is_time))
        .filter(|m| !m.field().0.is_empty())
        .map(|m| (m.field().0.to_string(), m.samples()))
        .collect();
    let mut left = PROPERTY_BYTES;
    let mut places: HashMap<(String, u64), usize> = HashMap::new();
    let (mut groups, mut members): (Vec<Group>, Vec<Vec<usize>>) = (Vec::new(), Vec::new());
    let texts: HashMap<&str, &str> = contents.texts.iter().map(|(n, t)| (n.as_str(), t.as_str())).collect();
    for (i, matrix) in contents.matrices.iter().enumerate() {
        // of structs in structs the innermost that has a time of this length
        let of_structs = matrix.structs().map(|s| (s.to_string(), matrix.samples()));
        let of_struct = of_structs.into_iter().find(|k| timed.contains(k));
        let in_struct = of_struct.is_some();
        let alone = if tables.contains(&i) { matrix.name.clone() } else { String::new() };
        let key = of_struct.unwrap_or((alone, matrix.samples()));
        let at = *places.entry(key.clone()).or_insert_with(|| {
            let properties = contents.texts.iter().take(PROPERTIES);
            let fits = |(name, text): &&(String, String)| {
                left = left.saturating_sub(name.len() + text.len());
                left > 0
            };
            let properties = properties.take_while(fits).cloned().collect();
            groups.push(Group { name: key.0.clone(), samples: matrix.samples(), properties, ..Group::default() });
            members.push(Vec::new());
            groups.len() - 1
        });
        let Channel { name, unit } = channel(matrix, in_struct, &texts);
        let numbered = |c: u64| if matrix.channels() == 1 { name.clone() } else { format!("{name} {c}") };
        groups[at].channels.extend((1..=matrix.channels()).map(|c| Channel { name: numbered(c), unit: unit.clone() }));
        members[at].push(i);
    }
    if groups.len() > 1 {
        for group in groups.iter_mut().filter(|g| g.name.is_empty()) {
            group.name = format!("{} samples", group.samples);
        }
    }
    if contents.texts.len() > PROPERTIES {
        contents.notes.push(format!("of {} scalars and texts the first {PROPERTIES} are read", contents.texts.len()));
    }
    (groups, members)
}

/// A matrix' name and unit. A struct like a timeseries says its units; its `Data` are what the struct is named after.
/// Others have a unit beside their values, or in the label of Simulink's "Structure With Time", whose time is in s.
fn channel(matrix: &Matrix, timed: bool, texts: &HashMap<&str, &str>) -> Channel {
    let (of, field) = matrix.field();
    let text = |name: String| texts.get(name.as_str()).map(|t| t.to_string());
    let units = |info: &str| text(format!("{of}.{info}.Units")).unwrap_or_default();
    match (timed, field) {
        (true, "Time") => return Channel { name: field.to_string(), unit: units("TimeInfo") },
        (true, "Data") => return Channel { name: of.to_string(), unit: units("DataInfo") },
        _ => {}
    }
    let beside = || ["unit", "units", "Unit", "Units"].into_iter().find_map(|u| text(format!("{of}.{u}")));
    let label = || text(format!("{of}.label")).map(|l| crate::shared::unit::of_name(&l).1);
    let unit = match field.to_lowercase().as_str() {
        "time" | "t" if timed => {
            let simulink = texts.contains_key(format!("{of}.signals.dimensions").as_str());
            text(format!("{of}.time_unit")).or_else(|| simulink.then(|| "s".to_string()))
        }
        "data" | "values" | "value" if !of.is_empty() => beside().or_else(label),
        _ => None,
    };
    Channel { name: matrix.name.clone(), unit: unit.unwrap_or_default() }
}

impl Source for Mat {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn read(&mut self, group: usize, sink: &mut Sink) -> Result<(), Fault> {
        let (samples, members) = (self.groups[group].samples, &self.members[group]);
        let widest = members.iter().map(|m| self.matrices[*m].strides().1).max().unwrap_or(1);
        for (first, count) in spans(samples, widest) {
            let mut block = Vec::with_capacity(self.groups[group].channels.len());
            for matrix in members.iter().map(|m| &self.matrices[*m]) {
                let (across, along) = matrix.strides();
                for c in 0..matrix.channels() {
                    let mut out = vec![0.0; count];
                    let at = matrix.at + c * across + first * along;
                    self.areas[matrix.area].numbers(at, along, matrix.number, matrix.order, &mut out)?;
                    block.push(out);
                }
            }
            if hand(&block, sink).is_break() {
                return Ok(());
            }
        }
        Ok(())
    }
}
