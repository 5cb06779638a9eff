//! What the segments of a TDMS file say: objects, their properties, and where their samples lie.

use crate::binary::{Bytes, Number, Order, Walk, EXPORT};
use crate::Fault;
use std::collections::HashMap;
use std::sync::Arc;

const LEAD: u64 = 28;
const UNFINISHED: u64 = u64::MAX;
const META: u32 = 1 << 1;
const NEW_LIST: u32 = 1 << 2;
const RAW: u32 = 1 << 3;
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
const NO_DATA: u32 = u32::MAX;
const SAME_INDEX: u32 = 0;
const FORMAT_CHANGING: u32 = 0x1269;
const DIGITAL_LINE: u32 = 0x126A;
const STRING: u32 = 0x20;
const TIMESTAMP: u32 = 0x44;
/// Seconds from 1904-01-01, from which timestamps count, to 1970-01-01.
const EPOCH: i64 = 2_082_844_800;

/// How samples of a channel are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stored {
    Number(Number),
    /// Seconds and parts of 2^-64 s.
    Time,
    /// A bit of a byte.
    Line(u32),
}

/// Samples that lie in runs: `run` samples each `stride` bytes after the last, each run `pitch` bytes after the last.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) at: u64,
    pub(super) run: u64,
    pub(super) stride: u64,
    pub(super) pitch: u64,
    pub(super) count: u64,
    pub(super) stored: Stored,
    pub(super) order: Order,
}

/// The samples of a channel, or of one of its DAQmx scalers.
#[derive(Debug)]
pub(super) struct Track {
    pub(super) scaler: Option<u32>,
    pub(super) pieces: Vec<Piece>,
}

/// A property's value.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Number(f64),
    Text(String),
}

/// The file, a group or a channel.
#[derive(Default, Debug)]
pub(super) struct Object {
    pub(super) path: String,
    /// The path of the channel's group; empty where this is no channel.
    pub(super) group: String,
    properties: Vec<(String, Value)>,
    places: HashMap<String, usize>,
    index: Option<Index>,
    pub(super) tracks: Vec<Track>,
    pub(super) samples: u64,
    /// The first timestamp of a channel of timestamps.
    pub(super) origin: (i64, u64),
    /// Why its samples are not read.
    pub(super) left_out: Option<String>,
}

/// Where the raw data of an object lie in a chunk of a segment.
#[derive(Clone, Debug)]
enum Index {
    Plain { form: Form, values: u64, bytes: u64 },
    Daqmx { values: u64, scalers: Arc<[Scaler]>, widths: Arc<[u32]> },
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Form {
    Read(Stored),
    Text,
    Complex,
}

#[derive(Clone, Copy, Debug)]
struct Scaler {
    stored: Option<Stored>,
    buffer: usize,
    /// Bytes from the start of a row of the buffer.
    offset: u64,
    size: u64,
    id: u32,
}

pub(super) struct Contents {
    pub(super) objects: Vec<Object>,
    pub(super) notes: Vec<String>,
}

/// Names in a path such as `/'Group'/'It''s'`.
fn names(path: &str) -> Option<Vec<String>> {
    let mut names = Vec::new();
    let mut rest = path.chars().peekable();
    while rest.next_if_eq(&'/').is_some() {
        if rest.next_if_eq(&'\'').is_none() {
            return (rest.peek().is_none() && names.is_empty()).then_some(names);
        }
        let mut name = String::new();
        loop {
            match rest.next()? {
                '\'' if rest.next_if_eq(&'\'').is_some() => name.push('\''),
                '\'' => break,
                other => name.push(other),
            }
        }
        names.push(name);
    }
    rest.peek().is_none().then_some(names)
}

pub(super) fn path_of_group(name: &str) -> String {
    format!("/'{}'", name.replace('\'', "''"))
}

impl Object {
    fn new(path: String) -> Object {
        let group = match names(&path).as_deref() {
            Some([group, _]) => path_of_group(group),
            _ => String::new(),
        };
        Object { path, group, ..Object::default() }
    }

    /// The group's and the channel's name; None where this is no channel.
    pub(super) fn names(&self) -> Option<(String, String)> {
        let [group, channel] = <[String; 2]>::try_from(names(&self.path)?).ok()?;
        Some((group, channel))
    }

    pub(super) fn is_daqmx(&self) -> bool {
        self.tracks.iter().any(|t| t.scaler.is_some())
    }

    pub(super) fn stored(&self) -> Option<Stored> {
        Some(self.tracks.first()?.pieces.first()?.stored)
    }

    fn value(&self, name: &str) -> Option<&Value> {
        self.places.get(name).map(|i| &self.properties[*i].1)
    }

    pub(super) fn number(&self, name: &str) -> Option<f64> {
        match self.value(name)? {
            Value::Number(n) => Some(*n),
            Value::Text(_) => None,
        }
    }

    pub(super) fn text(&self, name: &str) -> Option<&str> {
        match self.value(name)? {
            Value::Text(t) => Some(t),
            Value::Number(_) => None,
        }
    }

    pub(super) fn property_names(&self) -> impl Iterator<Item = &str> {
        self.properties.iter().map(|(n, _)| n.as_str())
    }

    /// The properties that a person wrote, as texts.
    pub(super) fn texts(&self, before: &str) -> impl Iterator<Item = (String, String)> + '_ {
        let before = before.to_string();
        let of_machine =
            |n: &str| n.starts_with("NI_") || n == "unit_string" || n.starts_with("wf_") && n != "wf_start_time";
        self.properties.iter().filter(move |(n, _)| !of_machine(n)).map(move |(n, v)| {
            let text = match v {
                Value::Number(x) => x.to_string(),
                Value::Text(t) => t.clone(),
            };
            (format!("{before}{n}"), text)
        })
    }

    fn set(&mut self, name: String, value: Value) {
        match self.places.get(&name) {
            Some(i) => self.properties[*i].1 = value,
            None => {
                self.places.insert(name.clone(), self.properties.len());
                self.properties.push((name, value));
            }
        }
    }

    /// Adds samples, as a longer run of the last piece where they follow its pattern.
    fn push(&mut self, scaler: Option<u32>, piece: Piece) {
        if piece.count == 0 {
            return;
        }
        let at = self.tracks.iter().position(|t| t.scaler == scaler).unwrap_or_else(|| {
            self.tracks.push(Track { scaler, pieces: Vec::new() });
            self.tracks.len() - 1
        });
        let pieces = &mut self.tracks[at].pieces;
        if let Some(last) = pieces.last_mut() {
            let alike = (last.run, last.stride, last.stored, last.order)
                == (piece.run, piece.stride, piece.stored, piece.order);
            let whole = last.count % last.run == 0;
            let next = piece.at.saturating_sub(last.at);
            let pitch = if last.count == last.run { next } else { last.pitch };
            let inside = piece.count <= piece.run || piece.pitch == pitch;
            if alike && whole && inside && next > 0 && next == last.count / last.run * pitch {
                last.pitch = pitch;
                last.count += piece.count;
                return;
            }
        }
        pieces.push(piece);
    }
}

/// Reads all segments' metadata.
pub(super) fn read(bytes: &mut Bytes) -> Result<Contents, Fault> {
    let mut reader = Reader::default();
    let mut at = 0;
    while at < bytes.length() {
        match reader.segment(bytes, at)? {
            Some(next) => at = next,
            None => break,
        }
    }
    for object in &mut reader.objects {
        let first = object.tracks.first().and_then(|t| t.pieces.first()).filter(|p| p.stored == Stored::Time);
        if let Some(piece) = first {
            let mut stamp = [0; 16];
            bytes.fill(piece.at, &mut stamp)?;
            object.origin = timestamp(stamp, piece.order);
            let start = date(object.origin);
            object.set("first time".to_string(), Value::Text(start));
        }
    }
    Ok(Contents { objects: reader.objects, notes: reader.notes })
}

#[derive(Default)]
struct Reader {
    objects: Vec<Object>,
    places: HashMap<String, usize>,
    /// Objects of the present segment, and whether they have data in it.
    order: Vec<(usize, bool)>,
    in_order: HashMap<usize, usize>,
    notes: Vec<String>,
}

impl Reader {
    /// Reads the segment at `at`; where the next begins, None where the file was cut here.
    fn segment(&mut self, bytes: &mut Bytes, at: u64) -> Result<Option<u64>, Fault> {
        let length = bytes.length();
        if length - at < LEAD {
            return self.cut(bytes, at, at);
        }
        let mut walk = Walk { bytes, at, end: length, order: Order::Little };
        let tag = walk.array::<4>()?;
        match &tag {
            b"TDSm" => {}
            b"TDSh" => return Err(walk.fault("this is the index of a TDMS file", "give the file .tdms beside it")),
            _ => return Err(walk.bytes.fault(at, "no segment begins here (\"TDSm\" is missing)", EXPORT)),
        }
        let contents = walk.u32()?;
        walk.order = if contents & BIG_ENDIAN != 0 { Order::Big } else { Order::Little };
        let version = walk.u32()?;
        if ![4712, 4713].contains(&version) {
            return Err(walk.fault(format!("TDMS version {version} is not known"), "save it as TDMS 2.0 (4713)"));
        }
        let (to_next, to_data) = (walk.u64()?, walk.u64()?);
        let data = walk.at.checked_add(to_data).filter(|d| *d <= length);
        let Some(data) = data else { return self.cut(walk.bytes, at, at) };
        let claimed = if to_next == UNFINISHED { None } else { walk.at.checked_add(to_next) };
        let (next, cut) = match claimed {
            Some(next) if next <= length => (next, false),
            _ => (length, true),
        };
        if next < data {
            return Err(walk.fault("the segment ends before its data begin", EXPORT));
        }
        if contents & META != 0 {
            walk.end = data;
            self.metadata(&mut walk, contents & NEW_LIST != 0)?;
        } else if at == 0 {
            return Err(walk.fault("the first segment has no metadata", EXPORT));
        }
        if contents & RAW != 0 && next > data {
            let order = walk.order;
            let space = Space { data, bytes: next - data, order, cut, interleaved: contents & INTERLEAVED != 0 };
            self.place(bytes, &space)?;
        }
        if cut {
            return self.cut(bytes, at, data);
        }
        Ok(Some(next))
    }

    /// The end of a file that was cut in the segment at `at`.
    fn cut(&mut self, bytes: &Bytes, at: u64, whole: u64) -> Result<Option<u64>, Fault> {
        if at == 0 && whole == 0 {
            let cure = "copy the file again, or record again";
            return Err(bytes.fault(bytes.length(), "the file is cut before its first samples", cure));
        }
        self.notes.push(format!(
            "the file was not finished in the segment at byte {at}: the samples before its end are read"
        ));
        Ok(None)
    }

    fn metadata(&mut self, walk: &mut Walk, new_list: bool) -> Result<(), Fault> {
        if new_list {
            self.order.clear();
            self.in_order.clear();
        }
        for _ in 0..walk.u32()? {
            let size = walk.u32()?;
            let path = walk.text(size.into())?;
            let at = match self.places.get(&path) {
                Some(at) => *at,
                None => {
                    self.places.insert(path.clone(), self.objects.len());
                    self.objects.push(Object::new(path));
                    self.objects.len() - 1
                }
            };
            let has_data = self.index(walk, at)?;
            match self.in_order.get(&at) {
                Some(i) => self.order[*i].1 = has_data,
                None => {
                    self.in_order.insert(at, self.order.len());
                    self.order.push((at, has_data));
                }
            }
            for _ in 0..walk.u32()? {
                let (name, value) = property(walk)?;
                self.objects[at].set(name, value);
            }
        }
        Ok(())
    }

    /// Reads the raw data index of an object: whether it has data in this segment.
    fn index(&mut self, walk: &mut Walk, at: usize) -> Result<bool, Fault> {
        let index = match walk.u32()? {
            NO_DATA => return Ok(false),
            SAME_INDEX if self.objects[at].index.is_some() => return Ok(true),
            SAME_INDEX => return Err(walk.fault("an object repeats the index of data that it never had", EXPORT)),
            FORMAT_CHANGING => daqmx(walk, false)?,
            DIGITAL_LINE => daqmx(walk, true)?,
            _ => plain(walk)?,
        };
        self.objects[at].index = Some(index);
        Ok(true)
    }

    /// Notes where the samples of a segment lie.
    fn place(&mut self, bytes: &Bytes, space: &Space) -> Result<(), Fault> {
        let with_data: Vec<(usize, Index)> = self
            .order
            .iter()
            .filter(|(_, has)| *has)
            .filter_map(|(o, _)| self.objects[*o].index.clone().map(|i| (*o, i)))
            .collect();
        let daqmx = with_data.iter().filter(|(_, i)| matches!(i, Index::Daqmx { .. })).count();
        if daqmx > 0 && daqmx < with_data.len() {
            return Err(bytes.fault(space.data, "a segment mixes DAQmx data and others", EXPORT));
        }
        let placed = match (daqmx > 0, space.interleaved) {
            (true, _) => self.place_daqmx(&with_data, space),
            (false, true) => self.place_interleaved(&with_data, space),
            (false, false) => self.place_contiguous(&with_data, space),
        };
        placed.map_err(|what| bytes.fault(space.data, what, EXPORT))
    }

    fn place_contiguous(&mut self, objects: &[(usize, Index)], space: &Space) -> Result<(), String> {
        let sizes = objects.iter().map(|(_, i)| i.bytes()).collect::<Option<Vec<u64>>>().ok_or(TOO_LARGE)?;
        let chunk = sizes.iter().try_fold(0u64, |sum, s| sum.checked_add(*s)).ok_or(TOO_LARGE)?;
        let (whole, rest) = space.chunks(chunk)?;
        let (mut before, mut last) = (0, space.data + whole * chunk);
        for ((object, index), size) in objects.iter().zip(&sizes) {
            let Index::Plain { form, values, .. } = index else { continue };
            // the rest of a finished segment is a chunk of fewer values; of a cut one, the begin of a whole chunk
            let share = |of: u64| (u128::from(of) * u128::from(rest) / u128::from(chunk)) as u64;
            let of_rest = match (space.cut, form) {
                (true, _) => rest.saturating_sub(before).min(*size),
                (false, Form::Text) => share(*size),
                (false, _) => share(*values) * form.size(),
            };
            self.add(*object, *form, |stored| {
                let piece = |at, count| space.piece(at, (*values).max(1), form.size(), chunk, count, stored);
                vec![piece(space.data + before, whole * values), piece(last, of_rest / form.size())]
            })?;
            last += if space.cut { *size } else { of_rest };
            before += size;
        }
        Ok(())
    }

    fn place_interleaved(&mut self, objects: &[(usize, Index)], space: &Space) -> Result<(), String> {
        let mut row = 0u64;
        for (_, index) in objects {
            let Index::Plain { form, values, .. } = index else { continue };
            if *form == Form::Text || objects.first().is_some_and(|(_, i)| i.values() != *values) {
                return Err("interleaved channels are of unequal lengths or texts".to_string());
            }
            row = row.checked_add(form.size()).ok_or(TOO_LARGE)?;
        }
        let (rows, _) = space.chunks(row)?;
        let mut before = 0;
        for (object, index) in objects {
            let Index::Plain { form, .. } = index else { continue };
            self.add(*object, *form, |stored| {
                vec![space.piece(space.data + before, rows.max(1), row, rows * row, rows, stored)]
            })?;
            before += form.size();
        }
        Ok(())
    }

    /// Each buffer of the segment holds rows of its own width.
    fn place_daqmx(&mut self, objects: &[(usize, Index)], space: &Space) -> Result<(), String> {
        let Some((_, Index::Daqmx { widths, .. })) = objects.first() else { return Ok(()) };
        let mut rows = vec![0u64; widths.len()];
        for (_, index) in objects {
            let Index::Daqmx { values, scalers, widths: own } = index else { continue };
            if own != widths {
                return Err("channels of one segment claim different widths of the raw data".to_string());
            }
            for s in scalers.iter() {
                let width = widths.get(s.buffer).ok_or("a scaler is of a buffer that is not there")?;
                if s.offset + s.size > u64::from(*width) {
                    return Err("a scaler lies outside the rows of its buffer".to_string());
                }
                rows[s.buffer] = rows[s.buffer].max(*values);
            }
        }
        let mut starts = Vec::new();
        let mut chunk = 0u64;
        for (rows, width) in rows.iter().zip(widths.iter()) {
            starts.push(chunk);
            chunk = rows.checked_mul((*width).into()).and_then(|s| chunk.checked_add(s)).ok_or(TOO_LARGE)?;
        }
        let (whole, rest) = space.chunks(chunk)?;
        for (object, index) in objects {
            let Index::Daqmx { values, scalers, .. } = index else { continue };
            if scalers.is_empty() {
                continue;
            }
            let part = |s: &Scaler| rest.saturating_sub(starts[s.buffer]) / u64::from(widths[s.buffer]).max(1);
            let part = scalers.iter().map(part).min().unwrap_or(0).min(*values);
            let count = whole * values + part;
            for s in scalers.iter() {
                let (at, width) = (space.data + starts[s.buffer] + s.offset, widths[s.buffer].into());
                match s.stored {
                    Some(stored) => {
                        let piece = space.piece(at, (*values).max(1), width, chunk, count, stored);
                        self.objects[*object].push(Some(s.id), piece);
                    }
                    None => self.objects[*object].left_out = Some("its raw data are of an unknown type".to_string()),
                }
            }
            self.objects[*object].samples += count;
        }
        Ok(())
    }

    /// Adds the samples that `pieces` gives of the stored form; else says why the channel is left out.
    fn add(&mut self, object: usize, form: Form, pieces: impl Fn(Stored) -> Vec<Piece>) -> Result<(), String> {
        let object = &mut self.objects[object];
        let stored = match form {
            Form::Read(stored) => stored,
            Form::Text => {
                object.left_out = Some("it holds text".to_string());
                return Ok(());
            }
            Form::Complex => {
                object.left_out = Some("its numbers are complex".to_string());
                return Ok(());
            }
        };
        if object.stored().is_some_and(|s| (s == Stored::Time) != (stored == Stored::Time)) {
            return Err(format!("the channel {} changes between times and numbers", object.path));
        }
        for piece in pieces(stored) {
            object.samples += piece.count;
            object.push(None, piece);
        }
        Ok(())
    }
}

const TOO_LARGE: &str = "a segment claims more data than any file holds";

/// The raw data of a segment.
struct Space {
    data: u64,
    bytes: u64,
    order: Order,
    /// Whether the file ends within it.
    cut: bool,
    interleaved: bool,
}

impl Space {
    /// Whole chunks of `chunk` bytes, and the bytes that are left.
    fn chunks(&self, chunk: u64) -> Result<(u64, u64), String> {
        match (self.bytes.checked_div(chunk), self.cut) {
            (Some(whole), _) => Ok((whole, self.bytes % chunk)),
            (None, true) => Ok((0, 0)),
            (None, false) => Err(format!("a segment holds {} bytes of data that belong to no channel", self.bytes)),
        }
    }

    fn piece(&self, at: u64, run: u64, stride: u64, pitch: u64, count: u64, stored: Stored) -> Piece {
        // chunks of one sample each are one long run
        let (run, stride, pitch) = if run == 1 && count > 1 { (count, pitch, 0) } else { (run, stride, pitch) };
        Piece { at, run, stride, pitch, count, stored, order: self.order }
    }
}

impl Form {
    /// Bytes of one value; 1 for text, whose bytes the index claims.
    fn size(self) -> u64 {
        match self {
            Form::Read(Stored::Number(number)) => number.size(),
            Form::Read(Stored::Line(_)) | Form::Text => 1,
            Form::Read(Stored::Time) | Form::Complex => 16,
        }
    }
}

impl Index {
    fn values(&self) -> u64 {
        match self {
            Index::Plain { values, .. } | Index::Daqmx { values, .. } => *values,
        }
    }

    /// Bytes in a chunk of contiguous data; None where they are more than any file's.
    fn bytes(&self) -> Option<u64> {
        match self {
            Index::Plain { form: Form::Text, bytes, .. } => Some(*bytes),
            Index::Plain { form, values, .. } => values.checked_mul(form.size()),
            Index::Daqmx { .. } => Some(0),
        }
    }
}

fn plain(walk: &mut Walk) -> Result<Index, Fault> {
    let (kind, dimension, values) = (walk.u32()?, walk.u32()?, walk.u64()?);
    if dimension != 1 {
        return Err(walk.fault(format!("an array of {dimension} dimensions is claimed"), EXPORT));
    }
    let form = match kind {
        STRING => Form::Text,
        TIMESTAMP => Form::Read(Stored::Time),
        0x0010_000D => Form::Complex,
        _ => match number(kind) {
            Some(number) => Form::Read(Stored::Number(number)),
            None => return Err(walk.fault(format!("data of type {kind:#x} are not read"), "save the channel as DBL")),
        },
    };
    let bytes = if form == Form::Text { walk.u64()? } else { 0 };
    Ok(Index::Plain { form, values, bytes })
}

fn daqmx(walk: &mut Walk, lines: bool) -> Result<Index, Fault> {
    let (_kind, dimension, values) = (walk.u32()?, walk.u32()?, walk.u64()?);
    if dimension != 1 {
        return Err(walk.fault(format!("an array of {dimension} dimensions is claimed"), EXPORT));
    }
    let mut scalers = Vec::new();
    for _ in 0..walk.u32()? {
        scalers.push(if lines { line_scaler(walk)? } else { scaler(walk)? });
    }
    let mut widths = Vec::new();
    for _ in 0..walk.u32()? {
        widths.push(walk.u32()?);
    }
    Ok(Index::Daqmx { values, scalers: scalers.into(), widths: widths.into() })
}

fn scaler(walk: &mut Walk) -> Result<Scaler, Fault> {
    let (kind, buffer, offset, _bitmap, id) = (walk.u32()?, walk.u32()?, walk.u32()?, walk.u32()?, walk.u32()?);
    let number = daqmx_number(kind);
    let size = number.map_or(1, Number::size);
    Ok(Scaler { stored: number.map(Stored::Number), buffer: buffer as usize, offset: offset.into(), size, id })
}

/// A line of a digital port: one bit.
fn line_scaler(walk: &mut Walk) -> Result<Scaler, Fault> {
    let (kind, buffer, bits, _bitmap, id) = (walk.u32()?, walk.u32()?, walk.u32()?, walk.u8()?, walk.u32()?);
    let size = daqmx_number(kind).map_or(1, Number::size);
    let byte = u64::from(bits / 8);
    // the bit lies in the lowest byte of the number that begins at that byte
    let offset = if walk.order == Order::Big { byte + size - 1 } else { byte };
    Ok(Scaler { stored: Some(Stored::Line(bits % 8)), buffer: buffer as usize, offset, size: 1, id })
}

fn daqmx_number(kind: u32) -> Option<Number> {
    use Number::*;
    [U8, I8, U16, I16, U32, I32, U64, I64, F32, F64].get(kind as usize).copied()
}

fn number(kind: u32) -> Option<Number> {
    Some(match kind {
        1 => Number::I8,
        2 => Number::I16,
        3 => Number::I32,
        4 => Number::I64,
        5 | 0x21 => Number::U8,
        6 => Number::U16,
        7 => Number::U32,
        8 => Number::U64,
        9 | 0x19 => Number::F32,
        10 | 0x1A => Number::F64,
        _ => return None,
    })
}

fn property(walk: &mut Walk) -> Result<(String, Value), Fault> {
    let size = walk.u32()?;
    let name = walk.text(size.into())?;
    let value = match walk.u32()? {
        STRING => {
            let size = walk.u32()?;
            Value::Text(walk.text(size.into())?)
        }
        TIMESTAMP => {
            let order = walk.order;
            Value::Text(date(timestamp(walk.array()?, order)))
        }
        kind => match number(kind) {
            Some(number) => Value::Number(walk.number(number)?),
            None => return Err(walk.fault(format!("property \"{name}\" is of the unknown type {kind:#x}"), EXPORT)),
        },
    };
    Ok((name, value))
}

/// Seconds from 1904 and parts of 2^-64 s.
pub(super) fn timestamp(bytes: [u8; 16], order: Order) -> (i64, u64) {
    let whole = match order {
        Order::Little => u128::from_le_bytes(bytes),
        Order::Big => u128::from_be_bytes(bytes),
    };
    ((whole >> 64) as i64, whole as u64)
}

/// Seconds from one timestamp to another.
pub(super) fn seconds((whole, parts): (i64, u64), (whole_from, parts_from): (i64, u64)) -> f64 {
    let parts = i128::from(parts) - i128::from(parts_from);
    (i128::from(whole) - i128::from(whole_from)) as f64 + parts as f64 / 2f64.powi(64)
}

/// The date and time of a timestamp, in UTC.
fn date((whole, parts): (i64, u64)) -> String {
    crate::date::utc(whole.saturating_sub(EPOCH), (parts >> 32) as f64 / 2f64.powi(32))
}
