//! Reads the files that measuring instruments write: every format becomes tables of channels, read in blocks.
//!
//! A format is a file of this crate with one function `open`, and its line in `FORMATS`. What a channel measures, which
//! column is the time and where the impact lies is not known here; `import` decides that from names, units and samples.

mod hdf5;
mod lvm;
mod mat;
mod mat73;
mod mdf;
mod parquet;
mod shared;
mod sheet;
mod tdms;
mod text;
mod uff;
mod wav;

pub use shared::memory::Memory;

use std::fmt;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Samples in a block, at most.
pub const BLOCK: usize = 1 << 16;

/// Why a file could not be read, with the place in it and what to do.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{}{}: {what}; {cure}", path.display(), place.as_ref().map_or(String::new(), |p| format!(": {p}")))]
pub struct Fault {
    pub path: PathBuf,
    /// Where in the file: `line 7`, `byte 4096`, `sheet "Drop 1", cell B7`; None where it is the whole file.
    pub place: Option<String>,
    pub what: String,
    pub cure: String,
}

impl Fault {
    /// A fault of the whole file at `path`.
    pub fn new(path: &Path, what: impl fmt::Display, cure: impl fmt::Display) -> Fault {
        Fault { path: path.to_path_buf(), place: None, what: what.to_string(), cure: cure.to_string() }
    }

    /// The fault of a file that the system does not give.
    pub(crate) fn unreadable(path: &Path, e: std::io::Error) -> Fault {
        let cure = input::cure(&e).unwrap_or("give a file that can be read");
        Fault::new(path, e, cure)
    }

    /// The same fault, at a place in the file.
    pub fn at(self, place: impl fmt::Display) -> Fault {
        Fault { place: Some(place.to_string()), ..self }
    }
}

/// A channel as the file names it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Channel {
    /// Empty where the file gives none.
    pub name: String,
    /// As the file writes it, such as `kN` or `m/s²`; empty where it gives none.
    pub unit: String,
}

/// Equal steps of time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clock {
    /// Time of the first sample, s.
    pub start: f64,
    /// Step from sample to sample, s, above 0.
    pub step: f64,
}

/// Channels sampled together: a sheet, a group, a table.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Group {
    /// As the file names it; empty where it has one group only and no name for it.
    pub name: String,
    pub channels: Vec<Channel>,
    /// Samples of the longest channel.
    pub samples: u64,
    /// Where the file itself gives the steps of time; None where time is a channel or is not in the file.
    pub clock: Option<Clock>,
    /// What else the file says of the group, as (name, text): header lines, properties.
    pub properties: Vec<(String, String)>,
}

/// Takes a block: one slice a channel, in the order of the group's channels, all of one length of at most [`BLOCK`]. A
/// sample that is missing is NaN. `Break` ends the reading.
pub type Sink<'a> = dyn FnMut(&[&[f64]]) -> ControlFlow<()> + 'a;

/// An open file.
pub trait Source {
    /// Its groups, in the file's order. Groups and channels that hold no numbers are left out.
    fn groups(&self) -> &[Group];

    /// What a reader of the file should know: channels left out and why.
    fn notes(&self) -> &[String];

    /// Hands all samples of a group to `sink`, in order. Memory does not grow with the length of the file where the
    /// format allows it. May be called again, for any group.
    ///
    /// # Errors
    /// What cannot be read, with its place.
    ///
    /// # Panics
    /// May, where `group` is not an index of [`Source::groups`].
    fn read(&mut self, group: usize, sink: &mut Sink) -> Result<(), Fault>;
}

/// A format: its name, whether a file is of it, and its reader.
pub struct Format {
    pub name: &'static str,
    /// Whether a file that begins with these bytes (up to 4096) and has that extension (lower case, without the dot) is of
    /// this format. The first of [`FORMATS`] that says yes reads the file.
    pub is: fn(head: &[u8], extension: &str) -> bool,
    pub open: fn(&Path) -> Result<Box<dyn Source>, Fault>,
}

/// All formats, the ones known by their first bytes first, text of any dialect last.
pub const FORMATS: &[Format] = &[
    tdms::FORMAT,
    mdf::FORMAT,
    wav::FORMAT,
    mat73::FORMAT,
    mat::FORMAT,
    hdf5::FORMAT,
    parquet::FORMAT,
    sheet::FORMAT,
    lvm::FORMAT,
    uff::FORMAT,
    text::FORMAT,
];

/// The lines of a text of at most `most` bytes, in any encoding that [`open`] reads.
///
/// # Errors
/// Where it cannot be read, or is longer.
pub fn lines(path: &Path, most: u64) -> Result<Vec<String>, Fault> {
    // what is no regular file, or too long, is refused before its lines are looked for
    drop(input::open_at_most(path, most).map_err(|e| Fault::unreadable(path, e))?);
    let mut lines = shared::lines::Lines::open(path)?;
    let mut all = Vec::new();
    while let Some(line) = lines.next()? {
        all.push(shared::lines::decode(line.text).into_owned());
    }
    Ok(all)
}

/// Opens a file of any format.
///
/// # Errors
/// Where the file cannot be read, is empty, or is of no known format.
pub fn open(path: &Path) -> Result<Box<dyn Source>, Fault> {
    use std::io::Read;
    let fault = |e| Fault::unreadable(path, e);
    let mut head = Vec::with_capacity(4096);
    input::open(path).map_err(fault)?.take(4096).read_to_end(&mut head).map_err(fault)?;
    if head.is_empty() {
        return Err(Fault::new(path, "the file is empty", "give a file with samples"));
    }
    let extension = path.extension().map_or(String::new(), |e| e.to_string_lossy().to_lowercase());
    match FORMATS.iter().find(|f| (f.is)(&head, &extension)) {
        Some(f) => (f.open)(path),
        None => {
            let known: Vec<&str> = FORMATS.iter().map(|f| f.name).collect();
            Err(Fault::new(path, "the format is not known", format!("known are {}", known.join(", "))))
        }
    }
}
