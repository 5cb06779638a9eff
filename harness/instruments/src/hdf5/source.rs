//! An open HDF5 file: its datasets as groups of channels.

use super::attributes::{self, Value};
use super::clock::clock;
use super::element::{is_long, is_number, Number, Record, Whole};
use super::layout::{layout, Kind, Layout};
use super::tree::{self, folders, Folder};
use super::{lzf, matlab, Dialect};
use crate::shared::block::{hand, most};
use crate::shared::guard::guarded;
use crate::shared::stamp;
use crate::{Channel, Clock, Fault, Group, Sink, Source};
use hdf5_reader::error::Error;
use hdf5_reader::reference::read_object_references;
use hdf5_reader::{Dataset, Datatype, FilterRegistry, Hdf5File, OpenOptions, SliceInfo, SliceInfoElem};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Bytes that one chunk, or one read, may take.
const LARGEST: usize = 1 << 28;
/// Elements of a list of texts or numbers that is read as a property.
const LIST: u64 = 64;

/// Channels of one dataset in a group.
struct Part {
    dataset: Dataset,
    layout: Layout,
    /// Value of a stored number: `factor` times it plus `offset`, as `scale_factor` and `add_offset` say.
    factor: f64,
    offset: f64,
    /// The first integer, from which long ones count: a double does not hold their digits.
    origin: Option<i128>,
}

struct Hdf5 {
    path: PathBuf,
    groups: Vec<Group>,
    parts: Vec<Vec<Part>>,
    notes: Vec<String>,
}

/// Opens an HDF5 file.
///
/// # Errors
/// Where the file is cut, damaged, or holds no channels.
pub(crate) fn open(path: &Path, dialect: Dialect) -> Result<Box<dyn Source>, Fault> {
    let length = input::open(path).and_then(|f| f.metadata()).map_err(|e| Fault::unreadable(path, e))?.len();
    guarded(path, || {
        let file = Hdf5File::open_with_options(path, options()).map_err(|e| damaged(path, &e))?;
        let end = file.superblock().eof_address;
        if end > length {
            let what = format!("the file ends at byte {length}, its head says at byte {end}");
            return Err(Fault::new(path, what, "copy or write the file whole"));
        }
        let folders = folders(&file, dialect).map_err(|e| damaged(path, &e))?;
        let mut hdf5 = Hdf5 { path: path.into(), groups: Vec::new(), parts: Vec::new(), notes: Vec::new() };
        hdf5.take(&file, &folders, dialect, length);
        if hdf5.groups.is_empty() {
            let what = format!(
                "the file holds no channels{}",
                hdf5.notes.iter().map(|n| format!("; {n}")).collect::<String>()
            );
            return Err(Fault::new(path, what, "give a file with datasets of numbers"));
        }
        Ok(Box::new(hdf5) as Box<dyn Source>)
    })
}

fn options() -> OpenOptions {
    let mut filters = FilterRegistry::new();
    filters.register(lzf::ID, Box::new(|filter, data, _| lzf::decode(filter, data, LARGEST)));
    OpenOptions::default()
        .with_filter_registry(filters)
        .with_max_chunk_bytes(LARGEST)
        .with_max_read_bytes(LARGEST)
        .with_chunk_cache_bytes(LARGEST)
}

fn damaged(path: &Path, error: &Error) -> Fault {
    match error {
        Error::UnsupportedFilter(which) => Fault::new(
            path,
            format!("the compression is not known ({which})"),
            "write the file anew with gzip, such as by `h5repack -f GZIP=4 IN OUT`",
        ),
        _ => Fault::new(path, error, "take an undamaged copy of the file"),
    }
}

impl Hdf5 {
    /// Takes all channels of the folders.
    fn take(&mut self, file: &Hdf5File, folders: &[Folder], dialect: Dialect, length: u64) {
        let references = matlab::References::of(file, dialect);
        let scales = Scales::of(file, folders);
        let mut values: Vec<Vec<Value>> = Vec::new();
        for folder in folders {
            let mut own = folder.attributes.clone();
            let mut channels: Vec<(String, Dataset)> = Vec::new();
            for dataset in &folder.datasets {
                for (name, dataset) in references.resolve(dataset, &mut self.notes) {
                    match property(&name, &dataset) {
                        Some(value) => own.push(value),
                        None => channels.push((name, dataset)),
                    }
                }
            }
            let mut known = own.clone();
            known.extend(folder.above.iter().flat_map(|&a| values[a].clone()));
            for (name, dataset) in channels {
                match layout(&dataset, dialect, length) {
                    Ok(layout) => {
                        let scale = scales.of_time(&dataset, &layout);
                        let at = self.add(&folder.path, &name, dataset, layout, &known);
                        if let Some((path, name, scale)) = scale.filter(|s| s.0 != folder.path) {
                            self.add_scale(at, &tree::join(&path, &name), scale, dialect, length);
                        }
                    }
                    Err(why) => {
                        self.notes.push(format!("dataset \"{}\" left out: {why}", tree::join(&folder.path, &name)))
                    }
                }
            }
            values.push(known);
        }
    }

    /// Adds the scale of the time axis that a dataset of the group `at` names, from another folder, once.
    fn add_scale(&mut self, at: usize, name: &str, scale: Dataset, dialect: Dialect, length: u64) {
        let Ok(layout) = layout(&scale, dialect, length) else { return };
        let there = self.parts[at].iter().any(|p| p.dataset.address() == scale.address());
        if layout.kind == Kind::Line && !there && self.groups[at].clock.is_none() {
            let own = attributes::values(&scale.attributes());
            let unit = attributes::units(&own).first().cloned().unwrap_or_default();
            self.groups[at].channels.push(Channel { name: name.to_string(), unit });
            let origin = origin(&scale, &layout);
            self.parts[at].push(Part { factor: 1.0, offset: 0.0, origin, dataset: scale, layout });
        }
    }

    /// Adds the channels of a dataset to the group of its parent, length and clock; which.
    fn add(&mut self, folder: &str, name: &str, dataset: Dataset, layout: Layout, known: &[Value]) -> usize {
        let own = attributes::values(&dataset.attributes());
        let clock = clock(&own).or_else(|| clock(known));
        let group = if layout.kind == Kind::Records { tree::join(folder, name) } else { folder.to_string() };
        let at = self.group_of(group, layout.samples, clock, known);
        let group = &mut self.groups[at];
        group.channels.extend(channels(name, &layout, &own));
        group.properties.extend(own.iter().map(|v| (format!("{name}.{}", v.name), v.text())));
        let of = |key: &str, other: f64| own.iter().find(|v| v.name == key).and_then(|v| v.number).unwrap_or(other);
        let origin = origin(&dataset, &layout);
        if let Some(origin) = origin {
            self.notes.push(format!("dataset \"{name}\" counts from its first number, {origin}"));
        }
        let (factor, offset) = (of("scale_factor", 1.0), of("add_offset", 0.0));
        self.parts[at].push(Part { factor, offset, origin, dataset, layout });
        at
    }

    fn group_of(&mut self, name: String, samples: u64, clock: Option<Clock>, known: &[Value]) -> usize {
        let is = |g: &Group| g.name == name && g.samples == samples && g.clock == clock;
        self.groups.iter().position(is).unwrap_or_else(|| {
            let properties = known.iter().map(|v| (v.name.clone(), v.text())).collect();
            self.groups.push(Group { name, channels: Vec::new(), samples, clock, properties });
            self.parts.push(Vec::new());
            self.groups.len() - 1
        })
    }
}

/// The first of integers that a double does not hold, where they are counted from it.
fn origin(dataset: &Dataset, layout: &Layout) -> Option<i128> {
    if !is_long(dataset.dtype()) || layout.kind != Kind::Line {
        return None;
    }
    let one = |(axis, _): (usize, &u64)| {
        let end = if axis == layout.time { 1 } else { dataset.shape()[axis] };
        SliceInfoElem::Slice { start: 0, end, step: 1 }
    };
    let selections = dataset.shape().iter().enumerate().map(one).collect();
    let first = dataset.read_slice::<Whole>(&SliceInfo { selections }).ok()?.iter().next()?.0;
    Some(first).filter(|f| stamp::in_nanoseconds(*f))
}

/// Datasets that others name as the scale of an axis (`DIMENSION_LIST`), by their address.
struct Scales(HashMap<u64, (String, Dataset)>, u8);

impl Scales {
    fn of(file: &Hdf5File, folders: &[Folder]) -> Scales {
        let all = folders.iter().flat_map(|f| f.datasets.iter().map(|d| (d.address(), (f.path.clone(), d.clone()))));
        Scales(all.collect(), file.superblock().offset_size)
    }

    /// The scale of the axis of the samples, where it is as long: its folder, its name and itself.
    fn of_time(&self, dataset: &Dataset, layout: &Layout) -> Option<(String, String, Dataset)> {
        let list = dataset.attribute("DIMENSION_LIST").ok()?;
        let size = dataset.vlen_reference_size();
        let axis = list.raw_data.chunks_exact(size).nth(layout.time)?;
        let bytes = dataset.resolve_vlen_reference_bytes(axis, usize::from(self.1)).ok()?;
        let address = *read_object_references(&bytes, self.1).ok()?.first()?;
        let (path, scale) = self.0.get(&address)?;
        let fits = scale.num_elements().ok()? == layout.samples && is_number(scale.dtype());
        fits.then(|| (path.clone(), scale.name().to_string(), scale.clone()))
    }
}

/// Names and units of the channels of a dataset, in order.
fn channels(name: &str, layout: &Layout, own: &[Value]) -> Vec<Channel> {
    let count = layout.names.len();
    let names = match layout.kind {
        Kind::Records => layout.names.clone(),
        _ if count > 1 => attributes::names(own, count)
            .unwrap_or_else(|| layout.names.iter().map(|place| format!("{name}{place}")).collect()),
        _ => vec![name.to_string()],
    };
    let units = attributes::units(own);
    let unit = |i: usize| match (units.len(), layout.kind) {
        (n, _) if n == count => units[i].clone(),
        (1, Kind::Line | Kind::Table { .. }) => units[0].clone(),
        _ => String::new(),
    };
    names.into_iter().enumerate().map(|(i, name)| Channel { name, unit: unit(i) }).collect()
}

/// A dataset that describes rather than measures: a text, a short list of texts, one number.
fn property(name: &str, dataset: &Dataset) -> Option<Value> {
    let count = dataset.num_elements().ok()?;
    if let Some(text) = matlab::text(dataset) {
        return Some(Value::of_texts(name, vec![text]));
    }
    match dataset.dtype() {
        Datatype::String { .. } | Datatype::VarLen { .. } if (1..=LIST).contains(&count) => {
            Some(Value::of_texts(name, dataset.read_strings().ok()?))
        }
        of if is_number(of) && count == 1 => {
            let own = attributes::values(&dataset.attributes());
            let number = dataset.read_array::<Number>().ok()?.iter().next()?.0;
            Some(Value::of_numbers(name, &[number], attributes::units(&own).first().cloned().unwrap_or_default()))
        }
        _ => None,
    }
}

impl Source for Hdf5 {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn read(&mut self, group: usize, sink: &mut Sink) -> Result<(), Fault> {
        let of = &self.groups[group];
        let rows = most(of.channels.len()) as u64;
        let mut start = 0;
        while start < of.samples {
            let end = (start + rows).min(of.samples);
            let mut block = Vec::with_capacity(of.channels.len());
            for part in &self.parts[group] {
                block.extend(guarded(&self.path, || {
                    part.read(start, end).map_err(|e| self.place(of, part, start, &e))
                })?);
            }
            if hand(&block, sink).is_break() {
                return Ok(());
            }
            start = end;
        }
        Ok(())
    }
}

impl Hdf5 {
    fn place(&self, group: &Group, part: &Part, sample: u64, error: &Error) -> Fault {
        let path = match part.layout.kind {
            Kind::Records => group.name.clone(),
            _ => tree::join(&group.name, part.dataset.name()),
        };
        damaged(&self.path, error).at(format!("dataset \"{path}\" from sample {sample}"))
    }
}

impl Part {
    /// The samples from `start` to before `end` of each channel.
    fn read(&self, start: u64, end: u64) -> Result<Vec<Vec<f64>>, Error> {
        let whole = |(axis, &n): (usize, &u64)| match axis == self.layout.time {
            true => SliceInfoElem::Slice { start, end, step: 1 },
            false => SliceInfoElem::Slice { start: 0, end: n, step: 1 },
        };
        let selection = SliceInfo { selections: self.dataset.shape().iter().enumerate().map(whole).collect() };
        let (count, rows) = (self.layout.names.len(), (end - start) as usize);
        let mut channels = vec![Vec::with_capacity(rows); count];
        match self.layout.kind {
            Kind::Records => {
                for Record(numbers) in self.dataset.read_slice::<Record>(&selection)? {
                    channels.iter_mut().zip(numbers).for_each(|(channel, n)| channel.push(n));
                }
            }
            Kind::Line if self.origin.is_some() => {
                let origin = self.origin.unwrap_or(0);
                for Whole(n) in self.dataset.read_slice::<Whole>(&selection)? {
                    channels[0].push((n - origin) as f64 * self.factor);
                }
            }
            Kind::Line | Kind::Table { .. } => {
                let across = matches!(self.layout.kind, Kind::Table { across: true });
                for (i, Number(n)) in self.dataset.read_slice::<Number>(&selection)?.into_iter().enumerate() {
                    let channel = if across { i / rows } else { i % count };
                    channels[channel].push(n * self.factor + self.offset);
                }
            }
        }
        if channels.iter().any(|c| c.len() != rows) {
            return Err(Error::InvalidData("samples are missing".into()));
        }
        Ok(channels)
    }
}
