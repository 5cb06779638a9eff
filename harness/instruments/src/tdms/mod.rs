//! TDMS of National Instruments (LabVIEW, DAQmx, DIAdem), versions 4712 and 4713, in blocks, with its scalings applied.
//!
//! Our own reader: the crate tdms 0.3.0 applies no scalings and gives no DAQmx samples, which is what loggers write.
//! Sources: NI, The NI TDMS File Format, 2024; for the DAQmx index and the scalings' properties also the open npTDMS.

mod index;
mod object;
mod scaling;
mod segments;
mod strain;

use crate::shared::binary::Bytes;
use crate::shared::block::{hand, spans};
use crate::shared::unit::ticks_of_a_second;
use crate::{Channel, Clock, Fault, Format, Group, Sink, Source};
use object::{Object, Piece, Stored, Track};
use scaling::{Plan, Unscaled};
use segments::Contents;
use std::collections::HashMap;
use std::path::Path;

pub(crate) const FORMAT: Format = Format { name: "TDMS", is, open };

/// Properties of a group, at most.
const PROPERTIES: usize = 1000;

fn is(head: &[u8], _: &str) -> bool {
    matches!(head.get(..4), Some(b"TDSm" | b"TDSh"))
}

/// A channel that is read.
struct Column {
    object: usize,
    plan: Plan,
}

struct Tdms {
    bytes: Bytes,
    objects: Vec<Object>,
    groups: Vec<Group>,
    columns: Vec<Vec<Column>>,
    notes: Vec<String>,
}

fn open(path: &Path) -> Result<Box<dyn Source>, Fault> {
    let mut bytes = Bytes::open(path)?;
    let Contents { objects, mut notes } = segments::read(&mut bytes)?;
    let (groups, columns) = grouped(&objects, &mut notes);
    if groups.is_empty() {
        let cure = "record or export it again with channels of numbers";
        let left = if notes.is_empty() { String::new() } else { format!(" ({})", notes.join("; ")) };
        return Err(Fault::new(path, format!("the file holds no samples that can be read{left}"), cure));
    }
    Ok(Box::new(Tdms { bytes, objects, groups, columns, notes }))
}

/// The groups and their columns: the channels of a group that have one length and one clock.
fn grouped(objects: &[Object], notes: &mut Vec<String>) -> (Vec<Group>, Vec<Vec<Column>>) {
    let places: HashMap<&str, usize> = objects.iter().enumerate().map(|(i, o)| (o.path.as_str(), i)).collect();
    let origin = objects.iter().filter(|o| o.samples > 0).filter_map(Object::begin).min();
    let mut parts: HashMap<(&str, u64, Option<[u64; 2]>), usize> = HashMap::new();
    let (mut groups, mut columns): (Vec<Group>, Vec<Vec<Column>>) = (Vec::new(), Vec::new());
    for (place, object) in objects.iter().enumerate() {
        let Some((group_name, channel_name)) = object.names() else { continue };
        let parents = [object::path_of_group(&group_name), "/".to_string()];
        let parents = parents.map(|p| places.get(p.as_str()).map(|i| &objects[*i]));
        if let Some(left_out) = &object.left_out {
            notes.push(format!("channel \"{channel_name}\" of group \"{group_name}\" is left out: {left_out}"));
            continue;
        }
        if object.samples == 0 {
            continue;
        }
        let plan = match scaling::plan(object, &parents) {
            Ok(plan) => plan,
            Err(Unscaled(why)) => {
                notes.push(format!("channel \"{channel_name}\" of group \"{group_name}\" is left out: {why}"));
                continue;
            }
        };
        if plan.is_raw() && object.is_daqmx() && matches!(object.stored(), Some(Stored::Number(_))) {
            notes.push(format!("channel \"{channel_name}\" of group \"{group_name}\" has no scaling: raw numbers"));
        }
        let clock = clock(object, origin);
        let key = (object.group.as_str(), object.samples, clock.map(|c| [c.start.to_bits(), c.step.to_bits()]));
        let at = *parts.entry(key).or_insert_with(|| {
            let properties = parents.iter().flatten().flat_map(|p| p.texts("")).take(PROPERTIES).collect();
            let (name, channels) = (group_name.clone(), Vec::new());
            groups.push(Group { name, channels, samples: object.samples, clock, properties });
            columns.push(Vec::new());
            groups.len() - 1
        });
        let group = &mut groups[at];
        let room = PROPERTIES - group.properties.len();
        group.properties.extend(object.texts(&format!("{channel_name}: ")).take(room));
        group.channels.push(Channel { name: channel_name, unit: unit(object) });
        columns[at].push(Column { object: place, plan });
    }
    (groups, columns)
}

fn unit(object: &Object) -> String {
    match object.text("unit_string") {
        Some(unit) => unit.to_string(),
        None if object.stored() == Some(Stored::Time) => "s".to_string(),
        None => String::new(),
    }
}

/// The waveform's steps, where they are of time; they count from `origin`, when the first waveform of the file begins.
fn clock(object: &Object, origin: Option<(i64, u64)>) -> Option<Clock> {
    let ticks = match object.text("wf_xunit_string").map(str::trim) {
        None | Some("") => 1.0,
        Some(unit) => ticks_of_a_second(unit)?,
    };
    let seconds = |name: &str| object.number(name).map(|n| n / ticks).filter(|s| s.is_finite());
    let step = seconds("wf_increment").filter(|s| *s > 0.0)?;
    let late = object.begin().zip(origin).map_or(0.0, |(begin, origin)| object::seconds(begin, origin));
    let start = seconds("wf_start_offset").unwrap_or(0.0) + late;
    Some(Clock { start, step })
}

impl Source for Tdms {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn read(&mut self, group: usize, sink: &mut Sink) -> Result<(), Fault> {
        let (columns, samples) = (&self.columns[group], self.groups[group].samples);
        let tracks = |c: &Column| &self.objects[c.object].tracks;
        let widest = columns.iter().flat_map(tracks).flat_map(|t| &t.pieces).map(|p| p.stride).max().unwrap_or(1);
        let mut places: Vec<Vec<Place>> = columns.iter().map(|c| vec![Place::default(); tracks(c).len()]).collect();
        for (_, count) in spans(samples, widest) {
            let mut block = Vec::with_capacity(columns.len());
            for (column, places) in columns.iter().zip(&mut places) {
                let object = &self.objects[column.object];
                let mut raw = Vec::with_capacity(object.tracks.len());
                for (track, place) in object.tracks.iter().zip(places) {
                    raw.push((track.scaler, place.next(&mut self.bytes, track, object.origin, count)?));
                }
                block.push(column.plan.apply(raw));
            }
            if hand(&block, sink).is_break() {
                return Ok(());
            }
        }
        Ok(())
    }
}

/// Where the reading of a track is.
#[derive(Clone, Copy, Default)]
struct Place {
    piece: usize,
    /// Samples of that piece already read.
    done: u64,
}

impl Place {
    /// The next `count` samples; NaN where the track has no more.
    fn next(&mut self, bytes: &mut Bytes, track: &Track, origin: (i64, u64), count: usize) -> Result<Vec<f64>, Fault> {
        let mut out = vec![f64::NAN; count];
        let mut filled = 0;
        while filled < count {
            let Some(piece) = track.pieces.get(self.piece) else { break };
            let left = piece.count - self.done;
            let in_run = piece.run - self.done % piece.run;
            let now = left.min(in_run).min((count - filled) as u64) as usize;
            read_run(bytes, piece, self.done, origin, &mut out[filled..filled + now])?;
            filled += now;
            self.done += now as u64;
            if self.done == piece.count {
                *self = Place { piece: self.piece + 1, done: 0 };
            }
        }
        Ok(out)
    }
}

/// Samples of one run of a piece, from sample `first` of the piece.
fn read_run(bytes: &mut Bytes, piece: &Piece, first: u64, origin: (i64, u64), out: &mut [f64]) -> Result<(), Fault> {
    let at = piece.at + first / piece.run * piece.pitch + first % piece.run * piece.stride;
    match piece.stored {
        Stored::Number(number) => bytes.numbers(at, piece.stride, number, piece.order, out),
        Stored::Line(bit) => bytes.each(at, piece.stride, out, |[b]| f64::from(b >> bit & 1)),
        Stored::Time => {
            bytes.each(at, piece.stride, out, |b| object::seconds(object::timestamp(b, piece.order), origin))
        }
    }
}
