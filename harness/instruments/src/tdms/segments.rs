//! The segments of a TDMS file: which objects they describe, and where the samples of each lie.

use super::index::{self, Form, Index, Scaler, DIGITAL_LINE, FORMAT_CHANGING};
use super::object::{self, Object, Piece, Stored, Value};
use crate::shared::binary::{Bytes, Order, Walk, EXPORT};
use crate::Fault;
use std::collections::HashMap;

const LEAD: u64 = 28;
const UNFINISHED: u64 = u64::MAX;
const META: u32 = 1 << 1;
const NEW_LIST: u32 = 1 << 2;
const RAW: u32 = 1 << 3;
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
const NO_DATA: u32 = u32::MAX;
const SAME_INDEX: u32 = 0;

/// All that a file holds.
pub(super) struct Contents {
    pub(super) objects: Vec<Object>,
    pub(super) notes: Vec<String>,
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
            object.origin = object::timestamp(stamp, piece.order);
            let start = object::date(object.origin);
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
                let (name, value) = object::property(walk)?;
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
            FORMAT_CHANGING => index::daqmx(walk, false)?,
            DIGITAL_LINE => index::daqmx(walk, true)?,
            _ => index::plain(walk)?,
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
            Form::Complex(_) => {
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
