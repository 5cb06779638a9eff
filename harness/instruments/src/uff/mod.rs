//! Universal files (`.uff`, `.unv`) of SDRC: functions at nodal degrees of freedom, dataset 58, in ASCII and in the binary
//! form 58b; after the dataset descriptions of the Structural Dynamics Research Laboratory, University of Cincinnati.
//!
//! Read are time responses (function type 1, and 0 with time as abscissa) of real numbers. Other functions, complex ones
//! and those in floats other than IEEE are left out with a note; datasets of other types are skipped. Datasets of equal
//! start, step and length form a group with a clock; one with uneven abscissa is a group of two channels, the abscissa
//! first; the steps of an even one are in the unit of its axis. Names come from ID line 1, or the ordinate's axis label, or the node and direction; units from the axes'
//! unit labels, or from the data type and the units of dataset 164 (SI where there is none).
//!
//! Samples are read in blocks from the file, in constant memory. Our own reader stands here since there is no kept crate
//! for the format.

mod header;
mod scan;
mod values;

use crate::shared::block::Block;
use crate::{Channel, Clock, Fault, Format, Group, Sink, Source};
use scan::Set;
use std::collections::HashMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use values::Cursor;

pub(crate) const FORMAT: Format = Format { name: "universal file (UFF, UNV)", is, open };

/// Whether the first line that is not blank is the mark of a dataset, and the number of a dataset follows.
fn is(head: &[u8], _extension: &str) -> bool {
    let mut lines = head.split(|b| *b == b'\n').map(<[u8]>::trim_ascii).skip_while(|l| l.is_empty());
    let mark = lines.next() == Some(b"-1");
    let number = lines.next().unwrap_or_default();
    let digits = number.iter().take_while(|b| b.is_ascii_digit()).count();
    mark && (1..=6).contains(&digits) && number.get(digits).is_none_or(|b| matches!(b, b' ' | b'b' | b'B'))
}

struct Uff {
    path: PathBuf,
    file: BufReader<File>,
    groups: Vec<Group>,
    /// Of each group, its datasets.
    sets: Vec<Vec<Set>>,
    notes: Vec<String>,
}

fn open(path: &Path) -> Result<Box<dyn Source>, Fault> {
    let file = input::open(path).map_err(|e| Fault::unreadable(path, e))?;
    let mut file = BufReader::with_capacity(1 << 18, file);
    let found = scan::scan(path, &mut file)?;
    if found.sets.is_empty() {
        let why = found.notes.first().map_or(String::new(), |n| format!(" ({n})"));
        let cure = "give a file with real time responses, function type 1";
        return Err(Fault::new(path, format!("no time response is in the file{why}"), cure));
    }
    let mut uff = Uff { path: path.to_path_buf(), file, groups: vec![], sets: vec![], notes: found.notes };
    let names = names(&found.sets);
    let mut of_clock = HashMap::new();
    for (set, name) in found.sets.into_iter().zip(names) {
        uff.take(set, name, &mut of_clock);
    }
    if uff.groups.len() > 1 {
        uff.groups.iter_mut().enumerate().for_each(|(i, g)| g.name = format!("group {}", i + 1));
    }
    Ok(Box::new(uff))
}

/// A name for each dataset: its function's description, with node and direction where others have the same.
fn names(sets: &[Set]) -> Vec<String> {
    let mut counts: HashMap<&str, usize> = HashMap::new();
    for set in sets {
        *counts.entry(set.header.description()).or_default() += 1;
    }
    sets.iter()
        .map(|set| match (set.header.description(), set.header.freedom()) {
            ("", freedom) => freedom,
            (description, freedom) if counts[description] > 1 => format!("{description} {freedom}").trim().to_string(),
            (description, _) => description.to_string(),
        })
        .collect()
}

impl Uff {
    /// Adds a dataset to the group of its clock and length, or as a group.
    fn take(&mut self, set: Set, name: String, of_clock: &mut HashMap<(u64, u64, u64), usize>) {
        let header = &set.header;
        let channel = Channel { name, unit: header.ordinate.unit.clone() };
        let properties = header.properties();
        if !header.even {
            let x = Channel { name: header.abscissa.label.clone(), unit: header.abscissa.unit.clone() };
            let channels = vec![x, channel];
            self.groups.push(Group { channels, samples: set.count, properties, ..Group::default() });
            self.sets.push(vec![set]);
            return;
        }
        // the abscissa's label may say ms
        let ticks = header.ticks().unwrap_or(1.0);
        let clock = Clock { start: header.start / ticks, step: header.step / ticks };
        let key = (clock.start.to_bits(), clock.step.to_bits(), set.count);
        match of_clock.get(&key) {
            Some(at) => {
                self.groups[*at].channels.push(channel);
                self.sets[*at].push(set);
            }
            None => {
                of_clock.insert(key, self.groups.len());
                let (samples, clock) = (set.count, Some(clock));
                self.groups.push(Group { name: String::new(), channels: vec![channel], samples, clock, properties });
                self.sets.push(vec![set]);
            }
        }
    }
}

impl Source for Uff {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn read(&mut self, group: usize, sink: &mut Sink) -> Result<(), Fault> {
        let mut cursors: Vec<Cursor> = self.sets[group].iter().map(Cursor::new).collect();
        let mut block = Block::new(self.groups[group].channels.len());
        let mut left = self.groups[group].samples;
        while left > 0 {
            let count = left.min(block.most as u64);
            let mut columns = block.columns.as_mut_slice();
            for cursor in &mut cursors {
                let (own, rest) = columns.split_at_mut(cursor.columns());
                cursor.take(&self.path, &mut self.file, count as usize, own)?;
                columns = rest;
            }
            left -= count;
            if block.hand(sink).is_break() {
                break;
            }
        }
        Ok(())
    }
}
