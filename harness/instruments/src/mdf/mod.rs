//! MDF of ASAM, version 4 (`.mf4`, `.mdf`), in blocks, with its conversions applied; sorted and unsorted, row by row
//! and column by column, compressed and not.
//!
//! Our own reader: mf4-rs 3.8.0 reads no compressed data; mdf4-rs 0.3.3 reads a file whole into memory, and
//! its later versions ask for a newer Rust. Source: ASAM MDF, version 4.2, as asammdf reads and writes it.

mod block;
mod channel;
mod conversion;
mod data;

use crate::shared::binary::{Bytes, EXPORT};
use crate::shared::block::{hand, spans};
use crate::{Channel, Fault, Format, Group, Sink, Source};
use block::{Block, Seen};
use channel::Field;
use conversion::Budget;
use data::{Records, Stretch};
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

pub(crate) const FORMAT: Format = Format { name: "MDF", is, open };

/// The cure of what only a newer version of MDF says.
const EXPORT_AS_4: &str = "export it as MDF 4.1 (.mf4)";
const HEADER: u64 = 64;
/// Flags of a channel group: texts of variable length; its time lies in another group.
const TEXTS: u16 = 1;
const REMOTE_MASTER: u16 = 1 << 3;
/// Flags of an unfinished file: counts of records are not written; nor is the length of the last data.
const COUNTS: u16 = 1;
const LAST_LENGTH: u16 = 1 << 2;

fn is(head: &[u8], _: &str) -> bool {
    matches!(head.get(..8), Some(b"MDF     " | b"UnFinMF "))
}

/// Records that are read together, of one or more channels of a group.
struct Part {
    /// Address of its channel group.
    at: u64,
    records: Records,
    fields: Vec<Field>,
    count: u64,
}

struct Mdf {
    bytes: Bytes,
    groups: Vec<Group>,
    parts: Vec<Vec<Part>>,
    notes: Vec<String>,
}

fn open(path: &Path) -> Result<Box<dyn Source>, Fault> {
    let bytes = Bytes::open(path)?;
    let mut opening = Opening::new(bytes)?;
    opening.read()?;
    if opening.groups.is_empty() {
        let left = if opening.notes.is_empty() { String::new() } else { format!(" ({})", opening.notes.join("; ")) };
        let cure = "record or export it again with channels of numbers";
        return Err(Fault::new(path, format!("the file holds no samples that can be read{left}"), cure));
    }
    let Opening { bytes, groups, parts, notes, .. } = opening;
    Ok(Box::new(Mdf { bytes, groups, parts, notes }))
}

/// A file that is being opened.
struct Opening {
    bytes: Bytes,
    /// What was not written at the end of a measurement.
    unfinished: u16,
    seen: Seen,
    budget: Budget,
    properties: Vec<(String, String)>,
    groups: Vec<Group>,
    parts: Vec<Vec<Part>>,
    /// The group of each channel group, by its address.
    places: HashMap<u64, usize>,
    notes: Vec<String>,
}

/// A channel group's head.
struct Head {
    at: u64,
    block: Block,
    id: u64,
    claimed: u64,
    flags: u16,
    data_bytes: u64,
    invalid_bytes: u64,
}

impl Opening {
    fn new(mut bytes: Bytes) -> Result<Opening, Fault> {
        let head = bytes.bytes(0, HEADER)?;
        let version = u16::from_le_bytes([head[28], head[29]]);
        if version < 400 {
            let what = format!("MDF of version {}.{:02} is not read", version / 100, version % 100);
            return Err(bytes.fault(28, what, EXPORT_AS_4));
        }
        let unfinished = if &head[..8] == b"UnFinMF " { u16::from_le_bytes([head[60], head[61]]) } else { 0 };
        let program = String::from_utf8_lossy(&head[16..24]).trim_matches(['\0', ' ']).to_string();
        let properties = vec![("program".to_string(), program)];
        let (seen, budget, notes) = (Seen::default(), Budget::default(), Vec::new());
        let (groups, parts, places) = (Vec::new(), Vec::new(), HashMap::new());
        Ok(Opening { bytes, unfinished, seen, budget, properties, groups, parts, places, notes })
    }

    fn read(&mut self) -> Result<(), Fault> {
        let header = self.seen.block(&mut self.bytes, HEADER, b"##HD")?;
        let mut walk = header.walk(&mut self.bytes);
        let (nanoseconds, _zone, _summer, flags) = (walk.u64()?, walk.u16()?, walk.u16()?, walk.u8()?);
        let start =
            crate::shared::date::utc((nanoseconds / 1_000_000_000) as i64, (nanoseconds % 1_000_000_000) as f64 * 1e-9);
        let start = if flags & 1 == 1 { start.trim_end_matches('Z').to_string() } else { start };
        self.properties.push(("start".to_string(), start));
        self.properties.extend(block::comments(&mut self.bytes, header.link(5))?);
        if self.unfinished != 0 {
            self.notes.push("the measurement was not finished: the samples that were written are read".to_string());
        }
        let mut at = header.link(0);
        while at != 0 {
            let group = self.seen.block(&mut self.bytes, at, b"##DG")?;
            self.data_group(&group)?;
            at = group.link(0);
        }
        Ok(())
    }

    fn data_group(&mut self, group: &Block) -> Result<(), Fault> {
        let id_size = u64::from(group.walk(&mut self.bytes).u8()?);
        if ![0, 1, 2, 4, 8].contains(&id_size) {
            return Err(self.bytes.fault(group.at, format!("record ids of {id_size} bytes are claimed"), EXPORT));
        }
        let mut heads = Vec::new();
        let mut at = group.link(1);
        while at != 0 {
            let head = self.head(at)?;
            at = head.block.link(0);
            heads.push(head);
        }
        let last = self.unfinished & LAST_LENGTH != 0;
        let stretch = |h: &Head| Stretch { data: h.data_bytes, invalid: h.invalid_bytes };
        let first = heads.first().map_or(Stretch { data: 0, invalid: 0 }, stretch);
        let stream = data::stream(&mut self.bytes, &mut self.seen, group.link(2), first, last)?;
        if let Some(cut) = &stream.cut {
            self.notes.push(cut.clone());
        }
        let size = |h: &Head| if h.flags & TEXTS != 0 { None } else { Some(h.data_bytes + h.invalid_bytes) };
        let sizes: Arc<HashMap<_, _>> = Arc::new(heads.iter().map(|h| (h.id, size(h))).collect());
        let counts = if id_size > 0 { stream.count(&mut self.bytes, id_size, &sizes)? } else { HashMap::new() };
        for head in heads.into_iter().filter(|h| h.flags & TEXTS == 0) {
            let stretch = stream.held(stretch(&head));
            let there = match id_size {
                0 => stream.whole_records(&stretch),
                _ => counts.get(&head.id).copied().unwrap_or(0),
            };
            let records = Records { stream: stream.clone(), stretch, id_size, id: head.id, sizes: sizes.clone() };
            self.channel_group(head, records, there)?;
        }
        Ok(())
    }

    fn head(&mut self, at: u64) -> Result<Head, Fault> {
        let block = self.seen.block(&mut self.bytes, at, b"##CG")?;
        let mut walk = block.walk(&mut self.bytes);
        let (id, claimed, flags) = (walk.u64()?, walk.u64()?, walk.u16()?);
        walk.skip(6)?;
        let (data_bytes, invalid_bytes) = (walk.u32()?.into(), walk.u32()?.into());
        Ok(Head { at, block, id, claimed, flags, data_bytes, invalid_bytes })
    }

    fn channel_group(&mut self, head: Head, records: Records, there: u64) -> Result<(), Fault> {
        let counts_missing = self.unfinished & COUNTS != 0 || self.unfinished != 0 && head.claimed == 0;
        let count = if counts_missing { there } else { head.claimed.min(there) };
        let mut name = block::text(&mut self.bytes, head.block.link(2))?;
        if name.is_empty() {
            name = block::text(&mut self.bytes, head.block.link(5))?;
        }
        if count < head.claimed && !counts_missing && head.data_bytes > 0 {
            self.notes.push(format!("group \"{name}\" claims {} samples, {count} are there and read", head.claimed));
        }
        let found =
            channel::read(&mut self.bytes, &mut self.seen, &mut self.budget, head.block.link(1), &records.stretch)?;
        let of = if name.is_empty() { String::new() } else { format!(" of group \"{name}\"") };
        if count == 0 {
            return Ok(());
        }
        self.notes.extend(found.notes.iter().map(|(channel, why)| format!("channel \"{channel}\"{of} {why}")));
        let fields = found.fields;
        if fields.is_empty() {
            return Ok(());
        }
        let channels: Vec<Channel> = fields.iter().map(|f| f.channel.clone()).collect();
        let part = Part { at: head.at, records, fields, count };
        let master = if head.flags & REMOTE_MASTER != 0 { head.block.link(6) } else { 0 };
        // channels stored column by column join the group of their time, where they are as many
        if let Some(place) = self.places.get(&master).copied().filter(|p| self.groups[*p].samples == count) {
            self.groups[place].channels.extend(channels);
            self.parts[place].push(part);
            return Ok(());
        }
        self.places.insert(head.at, self.groups.len());
        let properties = self.properties.clone();
        self.groups.push(Group { name, channels, samples: count, clock: found.clock, properties });
        self.parts.push(vec![part]);
        Ok(())
    }
}

impl Source for Mdf {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn read(&mut self, group: usize, sink: &mut Sink) -> Result<(), Fault> {
        let (samples, parts) = (self.groups[group].samples, &self.parts[group]);
        let widest = parts.iter().map(|p| p.records.stretch.record()).max().unwrap_or(1);
        let mut readers: Vec<_> = parts.iter().map(|p| p.records.reader()).collect();
        for (first, count) in spans(samples, widest) {
            let mut block = Vec::with_capacity(self.groups[group].channels.len());
            for (part, reader) in parts.iter().zip(&mut readers) {
                let rows = reader.next(&mut self.bytes, (count as u64).min(part.count.saturating_sub(first)))?;
                block.extend(part.fields.iter().map(|f| f.values(&rows, first, &part.records.stretch)));
            }
            if block.iter().any(|column: &Vec<f64>| column.len() != count) {
                let at = parts.first().map_or(0, |p| p.at);
                return Err(self.bytes.fault(
                    at,
                    "the group's records end early",
                    "do not write the file while it is read",
                ));
            }
            if hand(&block, sink).is_break() {
                return Ok(());
            }
        }
        Ok(())
    }
}
