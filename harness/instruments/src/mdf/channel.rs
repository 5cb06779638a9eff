//! Channels of a channel group: where a value lies in a record, and how it becomes a number.

use super::block::{self, Block, Seen};
use super::conversion::{self, Budget, Conversion};
use super::data::{Rows, Stretch};
use crate::shared::binary::Bytes;
use crate::shared::half::half;
use crate::{Channel, Clock, Fault};

/// Structures within each other, at most.
const DEPTH: usize = 16;
const ALL_INVALID: u32 = 1;
const HAS_INVALID: u32 = 1 << 1;
/// Kinds of channels: a value, the master, a master and a value counted from the record's index.
const VALUE: u8 = 0;
const MASTER: u8 = 2;
const VIRTUAL_MASTER: u8 = 3;
const VIRTUAL: u8 = 6;
/// What a master is of.
const TIME: u8 = 1;

/// How the bits of a value are read.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Unsigned,
    Signed,
    Float,
    /// Not in the record: the record's index.
    Index,
}

/// A channel that is read.
pub(super) struct Field {
    pub(super) channel: Channel,
    kind: Kind,
    big: bool,
    at: usize,
    /// Bytes that the bits lie in.
    size: usize,
    shift: u32,
    bits: u32,
    invalid: Option<usize>,
    conversion: Conversion,
}

/// The channels of a group.
#[derive(Default)]
pub(super) struct Found {
    pub(super) fields: Vec<Field>,
    pub(super) clock: Option<Clock>,
    /// Channels of which something is to be said, and what.
    pub(super) notes: Vec<(String, String)>,
}

/// Reads the chain of channels that begins at `at`.
pub(super) fn read(
    bytes: &mut Bytes,
    seen: &mut Seen,
    budget: &mut Budget,
    at: u64,
    stretch: &Stretch,
) -> Result<Found, Fault> {
    let mut reader = Reader { bytes, seen, budget, stretch, found: Found::default() };
    reader.chain(at, 0)?;
    Ok(reader.found)
}

struct Reader<'a> {
    bytes: &'a mut Bytes,
    seen: &'a mut Seen,
    budget: &'a mut Budget,
    stretch: &'a Stretch,
    found: Found,
}

impl Reader<'_> {
    fn chain(&mut self, mut at: u64, depth: usize) -> Result<(), Fault> {
        while at != 0 {
            let block = self.seen.block(self.bytes, at, b"##CN")?;
            let parts = block.link(1);
            let structure = parts != 0 && &Block::read(self.bytes, parts)?.id == b"##CN";
            if !structure {
                self.channel(&block, parts != 0)?;
            } else if depth < DEPTH {
                self.chain(parts, depth + 1)?;
            } else {
                let name = block::text(self.bytes, block.link(2))?;
                self.found.notes.push((name, "is left out: structures lie too deep in each other".to_string()));
            }
            at = block.link(0);
        }
        Ok(())
    }

    fn channel(&mut self, block: &Block, array: bool) -> Result<(), Fault> {
        let name = block::text(self.bytes, block.link(2))?;
        let mut walk = block.walk(self.bytes);
        let (class, sync, data_type, shift) = (walk.u8()?, walk.u8()?, walk.u8()?, walk.u8()?);
        let (at, bits, flags, invalid) = (walk.u32()?, walk.u32()?, walk.u32()?, walk.u32()?);
        let counted = class == VIRTUAL || class == VIRTUAL_MASTER;
        let kind = match data_type {
            _ if counted => Some(Kind::Index),
            0 | 1 => Some(Kind::Unsigned),
            2 | 3 => Some(Kind::Signed),
            4 | 5 => Some(Kind::Float),
            _ => None,
        };
        let possible = match kind {
            Some(Kind::Float) => [16, 32, 64].contains(&bits) && shift == 0,
            Some(Kind::Index) => true,
            _ => (1..=64).contains(&bits) && shift < 8,
        };
        let shift = u32::from(shift);
        let size = if counted { 0 } else { (u64::from(shift) + u64::from(bits)).div_ceil(8) };
        let invalid = (flags & HAS_INVALID != 0 && self.stretch.invalid > 0).then_some(u64::from(invalid));
        let why = match kind {
            _ if array => "it is an array",
            _ if ![VALUE, MASTER, VIRTUAL_MASTER, VIRTUAL].contains(&class) || (6..=9).contains(&data_type) => {
                "it holds text"
            }
            None => "it holds no plain numbers",
            Some(_) if flags & ALL_INVALID != 0 => "all its values are invalid",
            Some(_) if !possible => "its numbers are of an unknown size",
            Some(_)
                if u64::from(at) + size > self.stretch.data
                    || invalid.is_some_and(|i| i / 8 >= self.stretch.invalid) =>
            {
                "it lies outside of its record"
            }
            Some(_) => "",
        };
        let (Some(kind), "") = (kind, why) else {
            self.found.notes.push((name, format!("is left out: {why}")));
            return Ok(());
        };
        let conversion = match conversion::read(self.bytes, self.budget, block.link(4))? {
            Ok((conversion, note)) => {
                self.found.notes.extend(note.map(|n| (name.clone(), n)));
                conversion
            }
            Err(why) => {
                self.found.notes.push((name, format!("is left out: {why}")));
                return Ok(());
            }
        };
        let master_of_time = (class == MASTER || class == VIRTUAL_MASTER) && sync == TIME;
        if let (VIRTUAL_MASTER, Some((start, step))) = (class, conversion.line()) {
            if master_of_time && step.is_finite() && step > 0.0 && start.is_finite() {
                self.found.clock = Some(Clock { start, step });
                return Ok(());
            }
        }
        let mut unit = block::text(self.bytes, block.link(6))?;
        if unit.is_empty() {
            unit = conversion::unit(self.bytes, block.link(4))?;
        }
        if unit.is_empty() && master_of_time {
            unit = "s".to_string();
        }
        let big = data_type % 2 == 1;
        let (at, size, invalid) = (at as usize, size as usize, invalid.map(|i| i as usize));
        self.found.fields.push(Field {
            channel: Channel { name, unit },
            kind,
            big,
            at,
            size,
            shift,
            bits,
            invalid,
            conversion,
        });
        Ok(())
    }
}

impl Field {
    /// The values in the records, of which the first is the record of index `first`.
    pub(super) fn values(&self, rows: &Rows, first: u64, stretch: &Stretch) -> Vec<f64> {
        let raw = |i: usize| match self.kind {
            Kind::Index => (first + i as u64) as f64,
            _ => self.number(&rows.bytes[i * rows.stride + self.at..][..self.size]),
        };
        let valid = |i: usize| match (self.invalid, &rows.invalid) {
            (None, _) => true,
            (Some(bit), None) => rows.bytes[i * rows.stride + stretch.data as usize + bit / 8] >> (bit % 8) & 1 == 0,
            (Some(bit), Some(bits)) => bits[i * stretch.invalid as usize + bit / 8] >> (bit % 8) & 1 == 0,
        };
        let mut values: Vec<f64> = (0..rows.count).map(|i| if valid(i) { raw(i) } else { f64::NAN }).collect();
        self.conversion.apply(&mut values, !matches!(self.kind, Kind::Float));
        values
    }

    /// The number in the value's bytes, of which there are 9 at most.
    fn number(&self, bytes: &[u8]) -> f64 {
        let mut all = [0; 16];
        let all = if self.big {
            all[16 - bytes.len()..].copy_from_slice(bytes);
            u128::from_be_bytes(all)
        } else {
            all[..bytes.len()].copy_from_slice(bytes);
            u128::from_le_bytes(all)
        };
        let bits = (all >> self.shift) as u64 & (u64::MAX >> (64 - self.bits));
        match (self.kind, self.bits) {
            (Kind::Float, 16) => half(bits as u16),
            (Kind::Float, 32) => f32::from_bits(bits as u32).into(),
            (Kind::Float, _) => f64::from_bits(bits),
            (Kind::Signed, _) => ((bits << (64 - self.bits)) as i64 >> (64 - self.bits)) as f64,
            _ => bits as f64,
        }
    }
}
