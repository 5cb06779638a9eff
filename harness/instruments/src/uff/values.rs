//! The values of a dataset 58.

use super::header::{number, Header};
use super::scan::{line, Set};
use crate::shared::lines::excerpt;
use crate::Fault;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// Bytes of binary values that are read at a time.
const CHUNK: usize = 1 << 16;

/// How values are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Storage {
    /// In lines of fields of these widths.
    Lines(&'static [usize]),
    /// Bytes of an abscissa (0: none is stored) and of an ordinate, and whether the big end is first.
    Binary { x: usize, y: usize, big: bool },
}

impl Storage {
    pub fn ascii(header: &Header) -> Storage {
        Storage::Lines(match (header.data_type, header.even) {
            (4, true) => &[20; 4],
            (4, false) => &[13, 20, 13, 20],
            _ => &[13; 6],
        })
    }

    /// The ways in which values may be stored, that of the description first; none for complex values.
    pub fn binary(header: &Header, big: bool) -> Vec<Storage> {
        let sizes: &[(usize, usize)] = match (header.data_type, header.even) {
            (2, true) => &[(0, 4), (0, 8)],
            (2, false) => &[(4, 4), (8, 8)],
            (4, true) => &[(0, 8), (0, 4)],
            (4, false) => &[(4, 8), (8, 8)],
            (5, true) => &[(0, 8), (0, 16)],
            (5, false) => &[(4, 8), (8, 16)],
            (6, true) => &[(0, 16)],
            (6, false) => &[(4, 16), (8, 16)],
            _ => &[],
        };
        sizes.iter().map(|(x, y)| Storage::Binary { x: *x, y: *y, big }).collect()
    }

    /// The byte behind `count` binary values that begin at a byte.
    pub fn end(self, values: u64, count: u64) -> Option<u64> {
        match self {
            Storage::Binary { x, y, .. } => count.checked_mul((x + y) as u64)?.checked_add(values),
            Storage::Lines(_) => None,
        }
    }
}

/// The numbers of a line: words, or fields where a number fills its field and touches the one before.
fn numbers(line: &[u8], widths: &[usize], out: &mut Vec<f64>) -> Option<()> {
    let start = out.len();
    let words = line.split(|b| b.is_ascii_whitespace()).filter(|w| !w.is_empty());
    if words.map(|w| number(w).map(|n| out.push(n))).all(|n| n.is_some()) {
        return Some(());
    }
    out.truncate(start);
    let mut rest = line.trim_ascii_end();
    for width in widths {
        if rest.is_empty() {
            break;
        }
        let (field, behind) = rest.split_at((*width).min(rest.len()));
        out.push(number(field.trim_ascii())?);
        rest = behind;
    }
    Some(())
}

/// Samples that are whole in a dataset that was cut.
pub(crate) fn count_whole(path: &Path, file: &mut BufReader<File>, set: &Set) -> Result<u64, Fault> {
    let parts = if set.header.even { 1 } else { 2 };
    let values = match set.storage {
        Storage::Binary { x, y, .. } => return Ok(set.header.count.min((set.end - set.values) / (x + y) as u64)),
        Storage::Lines(widths) => {
            seek(path, file, set.values)?;
            let (mut text, mut row, mut count) = (Vec::new(), Vec::new(), 0_u64);
            while line(path, file, &mut text)? && text.ends_with(b"\n") {
                row.clear();
                if numbers(&text, widths, &mut row).is_none() {
                    break;
                }
                count += row.len() as u64;
            }
            count
        }
    };
    Ok(set.header.count.min(values / parts))
}

fn seek(path: &Path, file: &mut BufReader<File>, to: u64) -> Result<(), Fault> {
    file.seek(SeekFrom::Start(to)).map(drop).map_err(|e| Fault::unreadable(path, e))
}

/// Reads a dataset from where it stopped.
pub(crate) struct Cursor<'a> {
    set: &'a Set,
    at: u64,
    /// Numbers of the last line that were not wanted yet.
    ahead: Vec<f64>,
}

impl<'a> Cursor<'a> {
    pub fn new(set: &'a Set) -> Cursor<'a> {
        Cursor { set, at: set.values, ahead: Vec::new() }
    }

    /// Channels of the dataset: 2 where it stores its abscissa.
    pub fn columns(&self) -> usize {
        if self.set.header.even {
            1
        } else {
            2
        }
    }

    /// Appends the next `count` samples to each of `columns`.
    pub fn take(
        &mut self,
        path: &Path,
        file: &mut BufReader<File>,
        count: usize,
        columns: &mut [Vec<f64>],
    ) -> Result<(), Fault> {
        seek(path, file, self.at)?;
        match self.set.storage {
            Storage::Binary { x, y, big } => self.binary(path, file, count, columns, (x, y, big)),
            Storage::Lines(widths) => self.lines(path, file, count, columns, widths),
        }
    }

    fn lines(
        &mut self,
        path: &Path,
        file: &mut BufReader<File>,
        count: usize,
        columns: &mut [Vec<f64>],
        widths: &[usize],
    ) -> Result<(), Fault> {
        let mut text = Vec::new();
        let wanted = count * columns.len();
        while self.ahead.len() < wanted {
            let at = format!("byte {}", self.at);
            if self.at >= self.set.end || !line(path, file, &mut text)? {
                let what = format!("the dataset ends before the {} values it says it has", self.set.header.count);
                return Err(Fault::new(path, what, "give the file as it was written").at(at));
            }
            if numbers(&text, widths, &mut self.ahead).is_none() {
                let what = format!("`{}` is not a line of numbers", excerpt(&text));
                return Err(Fault::new(path, what, "give the file as it was written").at(at));
            }
            self.at += text.len() as u64;
        }
        for (i, number) in self.ahead.drain(..wanted).enumerate() {
            let column = i % columns.len();
            columns[column].push(number);
        }
        Ok(())
    }

    fn binary(
        &mut self,
        path: &Path,
        file: &mut BufReader<File>,
        count: usize,
        columns: &mut [Vec<f64>],
        (x, y, big): (usize, usize, bool),
    ) -> Result<(), Fault> {
        let size = x + y;
        let mut bytes = vec![0; CHUNK / size * size];
        let mut left = count;
        while left > 0 {
            let now = left.min(bytes.len() / size);
            let part = &mut bytes[..now * size];
            let read = file.read_exact(part);
            read.map_err(|e| Fault::new(path, e, "give the file as it was written").at(format!("byte {}", self.at)))?;
            for sample in part.chunks_exact(size) {
                if x > 0 {
                    columns[0].push(float(&sample[..x], big));
                }
                columns[usize::from(x > 0)].push(float(&sample[x..], big));
            }
            self.at += part.len() as u64;
            left -= now;
        }
        Ok(())
    }
}

/// A float of 4 or 8 bytes.
fn float(bytes: &[u8], big: bool) -> f64 {
    let mut ordered = [0; 8];
    let ordered = &mut ordered[..bytes.len()];
    ordered.copy_from_slice(bytes);
    if !big {
        ordered.reverse();
    }
    match *ordered {
        [a, b, c, d] => f64::from(f32::from_be_bytes([a, b, c, d])),
        [a, b, c, d, e, f, g, h] => f64::from_be_bytes([a, b, c, d, e, f, g, h]),
        _ => f64::NAN,
    }
}
