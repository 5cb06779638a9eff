//! The data of a data group: fragments of one stream of records, plain or compressed.

use super::block::{Block, Seen, HEAD};
use super::EXPORT_AS_4;
use crate::shared::binary::{Bytes, EXPORT};
use crate::Fault;
use flate2::read::ZlibDecoder;
use std::collections::HashMap;
use std::io::Read;
use std::sync::Arc;

/// Bytes of an inflated block, at most; the standard asks for 4 MiB at most.
const INFLATED: u64 = 1 << 28;
/// Bytes that deflate makes of one, at most.
const RATIO: u64 = 1032;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Packing {
    Plain,
    Deflate,
    /// Deflated columns of a table of rows of that many bytes.
    Transposed(u64),
    /// Zeros that the file does not hold.
    Zeros,
}

#[derive(Clone, Copy, Debug)]
struct Fragment {
    at: u64,
    stored: u64,
    length: u64,
    packing: Packing,
}

/// The data of a data group.
#[derive(Clone, Default)]
pub(super) struct Stream {
    data: Arc<Vec<Fragment>>,
    /// Invalidation bits that lie apart from the records.
    invalid: Option<Arc<Vec<Fragment>>>,
    /// What the file lacks because it was cut.
    pub(super) cut: Option<String>,
}

/// Bytes of a record's values and of its invalidation bits.
#[derive(Clone, Copy)]
pub(super) struct Stretch {
    pub(super) data: u64,
    pub(super) invalid: u64,
}

impl Stretch {
    pub(super) fn record(&self) -> u64 {
        self.data + self.invalid
    }
}

/// Finds all fragments of the data at `at`, of records of that stretch where they are of one kind; `last`: the length
/// of the last was not written.
pub(super) fn stream(
    bytes: &mut Bytes,
    seen: &mut Seen,
    at: u64,
    stretch: Stretch,
    last: bool,
) -> Result<Stream, Fault> {
    let mut finder =
        Finder { bytes, seen, stretch, last, data: Vec::new(), invalid: Vec::new(), apart: false, cut: None };
    finder.find(at)?;
    let Finder { data, invalid, apart, cut, .. } = finder;
    Ok(Stream { data: data.into(), invalid: apart.then(|| invalid.into()), cut })
}

struct Finder<'a> {
    bytes: &'a mut Bytes,
    seen: &'a mut Seen,
    stretch: Stretch,
    last: bool,
    data: Vec<Fragment>,
    invalid: Vec<Fragment>,
    /// Whether invalidation bits lie apart.
    apart: bool,
    cut: Option<String>,
}

impl Finder<'_> {
    fn find(&mut self, mut at: u64) -> Result<(), Fault> {
        while at != 0 && self.cut.is_none() {
            let Some(id) = self.id(at)? else { return Ok(()) };
            at = match &id {
                b"##HL" => self.seen.block(self.bytes, at, b"##HL")?.link(0),
                b"##DL" => self.list(at, b"##DL")?,
                b"##LD" => self.list(at, b"##LD")?,
                b"##DV" => {
                    self.apart = true;
                    self.add(at)?;
                    0
                }
                _ => {
                    self.add(at)?;
                    0
                }
            };
        }
        Ok(())
    }

    /// The id of the block at `at`; None where the file ends before.
    fn id(&mut self, at: u64) -> Result<Option<[u8; 4]>, Fault> {
        if !self.bytes.holds(at, HEAD) {
            self.end(at);
            return Ok(None);
        }
        let mut id = [0; 4];
        self.bytes.fill(at, &mut id)?;
        Ok(Some(id))
    }

    fn end(&mut self, at: u64) {
        self.cut = Some(format!("the file is cut before its data at byte {at}: the samples before are read"));
    }

    /// Adds the fragments of a list: the address of the next list.
    fn list(&mut self, at: u64, id: &[u8; 4]) -> Result<u64, Fault> {
        let list = self.seen.block(self.bytes, at, id)?;
        let mut walk = list.walk(self.bytes);
        let (mut blocks, mut invalid): (&[u64], &[u64]) = (list.links().get(1..).unwrap_or(&[]), &[]);
        if id == b"##LD" {
            let (flags, count) = (walk.u32()?, walk.u32()? as usize);
            let Some((values, bits)) = blocks.split_at_checked(count) else {
                return Err(walk.bytes.fault(at, format!("a list of {count} blocks has fewer links"), EXPORT));
            };
            self.apart = true;
            (blocks, invalid) = (values, if flags >> 31 == 1 { bits } else { &[] });
        }
        for (i, block) in blocks.iter().enumerate().filter(|(_, b)| **b != 0) {
            let before = self.data.len();
            self.add(*block)?;
            if self.cut.is_some() {
                break;
            }
            if let Some(bits) = invalid.get(i) {
                let values = self.data[before..].iter().map(|f| f.length).sum();
                self.add_invalid(*bits, values)?;
            }
        }
        Ok(list.link(0))
    }

    fn add(&mut self, at: u64) -> Result<(), Fault> {
        let fragment = self.fragment(at)?;
        self.data.extend(fragment);
        Ok(())
    }

    /// The invalidation bits at `at` for `values` bytes of values; zeros where the list has none for them.
    fn add_invalid(&mut self, at: u64, values: u64) -> Result<(), Fault> {
        let records = values.checked_div(self.stretch.data).unwrap_or(0);
        let length = records.saturating_mul(self.stretch.invalid);
        let zeros = Fragment { at, stored: 0, length, packing: Packing::Zeros };
        let fragment = if at == 0 { Some(zeros) } else { self.fragment(at)? };
        self.invalid.extend(fragment);
        Ok(())
    }

    fn fragment(&mut self, at: u64) -> Result<Option<Fragment>, Fault> {
        let Some(id) = self.id(at)? else { return Ok(None) };
        self.seen.first(self.bytes, at)?;
        let mut length = [0; 8];
        self.bytes.fill(at + 8, &mut length)?;
        let size = u64::from_le_bytes(length);
        match &id {
            b"##DT" | b"##DV" | b"##DI" | b"##SD" | b"##RD" => {
                let room = self.bytes.length() - at - HEAD;
                let claimed = if self.last && size <= HEAD { room } else { size.saturating_sub(HEAD) };
                if claimed > room {
                    self.cut =
                        Some(format!("the file is cut in its data at byte {at}: the samples before its end are read"));
                }
                let length = claimed.min(room);
                Ok(Some(Fragment { at: at + HEAD, stored: length, length, packing: Packing::Plain }))
            }
            b"##DZ" => self.zipped(at, size),
            _ => Err(self.bytes.fault(at, format!("{} is no block of data", id.escape_ascii()), EXPORT)),
        }
    }

    fn zipped(&mut self, at: u64, size: u64) -> Result<Option<Fragment>, Fault> {
        if !self.bytes.holds(at, size) {
            self.end(at);
            return Ok(None);
        }
        let block = Block::read(self.bytes, at)?;
        let mut walk = block.walk(self.bytes);
        walk.skip(2)?;
        let kind = walk.u8()?;
        walk.skip(1)?;
        let (columns, length, stored) = (walk.u32()?, walk.u64()?, walk.u64()?);
        let packing = match kind {
            0 => Packing::Deflate,
            1 => Packing::Transposed(columns.into()),
            _ => return Err(walk.bytes.fault(at, format!("compression {kind} (MDF 4.3) is not read"), EXPORT_AS_4)),
        };
        if !walk.has(stored) || length > INFLATED || length > stored.saturating_mul(RATIO) + RATIO {
            let what = format!("{length} bytes compressed to {stored} are claimed");
            return Err(walk.bytes.fault(at, what, EXPORT));
        }
        Ok(Some(Fragment { at: walk.at, stored, length, packing }))
    }
}

fn inflate(bytes: &mut Bytes, fragment: &Fragment) -> Result<Vec<u8>, Fault> {
    let mut out = Vec::new();
    let packed = ZlibDecoder::new(bytes.part(fragment.at, fragment.stored));
    let inflated = packed.take(fragment.length + 1).read_to_end(&mut out);
    inflated.map_err(|e| bytes.fault(fragment.at, format!("the data cannot be inflated: {e}"), EXPORT))?;
    if out.len() as u64 != fragment.length {
        let what = format!("the data claim {} bytes inflated, but have others", fragment.length);
        return Err(bytes.fault(fragment.at, what, EXPORT));
    }
    Ok(match fragment.packing {
        Packing::Transposed(columns) if columns > 0 => in_rows(&out, columns as usize),
        _ => out,
    })
}

/// Bytes that lie column by column, row by row; those beyond the last whole row stay where they are.
fn in_rows(columns_first: &[u8], columns: usize) -> Vec<u8> {
    let rows = columns_first.len() / columns;
    let mut out = Vec::with_capacity(columns_first.len());
    for row in 0..rows {
        out.extend(columns_first[row..].iter().step_by(rows).take(columns));
    }
    out.extend_from_slice(&columns_first[rows * columns..]);
    out
}

/// Reads fragments one after the other.
struct Cursor {
    fragments: Arc<Vec<Fragment>>,
    fragment: usize,
    /// Bytes of that fragment already read.
    done: u64,
    /// The fragment, where it was inflated.
    inflated: Vec<u8>,
}

impl Cursor {
    fn new(fragments: &Arc<Vec<Fragment>>) -> Cursor {
        Cursor { fragments: fragments.clone(), fragment: 0, done: 0, inflated: Vec::new() }
    }

    /// The fragment that is being read, where there is more.
    fn present(&mut self) -> Option<Fragment> {
        while self.fragments.get(self.fragment).is_some_and(|f| self.done == f.length) {
            self.fragment += 1;
            self.done = 0;
            self.inflated = Vec::new();
        }
        self.fragments.get(self.fragment).copied()
    }

    /// Goes on by `count` bytes; fewer where the data end: how many.
    fn skip(&mut self, count: u64) -> u64 {
        let mut left = count;
        while let Some(fragment) = self.present().filter(|_| left > 0) {
            let now = left.min(fragment.length - self.done);
            self.done += now;
            left -= now;
        }
        count - left
    }

    /// Fills `out`; less of it where the data end: how much.
    fn fill(&mut self, bytes: &mut Bytes, out: &mut [u8]) -> Result<usize, Fault> {
        let mut filled = 0;
        while let Some(fragment) = self.present().filter(|_| filled < out.len()) {
            let now = ((out.len() - filled) as u64).min(fragment.length - self.done) as usize;
            let part = &mut out[filled..filled + now];
            match fragment.packing {
                Packing::Plain => bytes.fill(fragment.at + self.done, part)?,
                Packing::Zeros => part.fill(0),
                Packing::Deflate | Packing::Transposed(_) => {
                    if self.inflated.is_empty() {
                        self.inflated = inflate(bytes, &fragment)?;
                    }
                    let from = self.done as usize;
                    part.copy_from_slice(&self.inflated[from..from + now]);
                }
            }
            self.done += now as u64;
            filled += now;
        }
        Ok(filled)
    }

    /// An unsigned number of `size` bytes, up to 8; None where the data end.
    fn number(&mut self, bytes: &mut Bytes, size: u64) -> Result<Option<u64>, Fault> {
        let mut out = [0; 8];
        let read = self.fill(bytes, &mut out[..size as usize])?;
        Ok((read as u64 == size).then(|| u64::from_le_bytes(out)))
    }
}

impl Stream {
    /// The stretch, without invalidation bits where they lie apart and are fewer than one record's.
    pub(super) fn held(&self, stretch: Stretch) -> Stretch {
        let bits =
            self.invalid.as_ref().map(|i| i.iter().filter(|f| f.stored > 0).map(|f| f.length).max().unwrap_or(0));
        Stretch { invalid: if bits.is_some_and(|b| b < stretch.invalid) { 0 } else { stretch.invalid }, ..stretch }
    }

    /// Whole records of one kind only, without ids.
    pub(super) fn whole_records(&self, stretch: &Stretch) -> u64 {
        let length = |f: &Arc<Vec<Fragment>>| f.iter().map(|f| f.length).sum::<u64>();
        let size = if self.invalid.is_some() { stretch.data } else { stretch.record() };
        length(&self.data).checked_div(size).unwrap_or(0)
    }

    /// Records of each id in data that mix kinds of records; `sizes`: bytes of each, None for texts.
    pub(super) fn count(
        &self,
        bytes: &mut Bytes,
        id_size: u64,
        sizes: &HashMap<u64, Option<u64>>,
    ) -> Result<HashMap<u64, u64>, Fault> {
        let mut counts = HashMap::new();
        let mut cursor = Cursor::new(&self.data);
        while let Some(id) = cursor.number(bytes, id_size)? {
            let Some(size) = next_size(&mut cursor, bytes, id, sizes)? else { break };
            if cursor.skip(size) < size {
                break;
            }
            *counts.entry(id).or_insert(0) += 1;
        }
        Ok(counts)
    }
}

/// Bytes of the record of that id; None where the data end.
fn next_size(
    cursor: &mut Cursor,
    bytes: &mut Bytes,
    id: u64,
    sizes: &HashMap<u64, Option<u64>>,
) -> Result<Option<u64>, Fault> {
    match sizes.get(&id) {
        Some(Some(size)) => Ok(Some(*size)),
        Some(None) => cursor.number(bytes, 4),
        None => {
            let at = cursor.fragments.get(cursor.fragment).map_or(0, |f| f.at);
            Err(bytes.fault(at, format!("a record of id {id} is of no channel group"), EXPORT))
        }
    }
}

/// The records of a channel group.
pub(super) struct Records {
    pub(super) stream: Stream,
    pub(super) stretch: Stretch,
    /// Bytes of the id before each record; 0 where all records are of this group.
    pub(super) id_size: u64,
    pub(super) id: u64,
    pub(super) sizes: Arc<HashMap<u64, Option<u64>>>,
}

impl Records {
    pub(super) fn reader(&self) -> Reader<'_> {
        let invalid = self.stream.invalid.as_ref().filter(|_| self.stretch.invalid > 0).map(Cursor::new);
        Reader { records: self, data: Cursor::new(&self.stream.data), invalid }
    }
}

/// Reads records one after the other.
pub(super) struct Reader<'a> {
    records: &'a Records,
    data: Cursor,
    invalid: Option<Cursor>,
}

/// Records: bytes of the values and of the invalidation bits.
pub(super) struct Rows {
    pub(super) count: usize,
    pub(super) bytes: Vec<u8>,
    /// Bytes from record to record.
    pub(super) stride: usize,
    /// Invalidation bits that lie apart.
    pub(super) invalid: Option<Vec<u8>>,
}

impl Reader<'_> {
    /// The next `count` records; fewer where the data end.
    pub(super) fn next(&mut self, bytes: &mut Bytes, count: u64) -> Result<Rows, Fault> {
        let stretch = &self.records.stretch;
        let apart = self.records.stream.invalid.is_some();
        let stride = if apart { stretch.data } else { stretch.record() } as usize;
        let mut out = vec![0; stride * count as usize];
        let read = match self.records.id_size {
            0 => self.data.fill(bytes, &mut out)?.checked_div(stride).unwrap_or(count as usize),
            _ => self.picked(bytes, &mut out, stride, count as usize)?,
        };
        let mut invalid = None;
        if let Some(cursor) = &mut self.invalid {
            let mut bits = vec![0; stretch.invalid as usize * count as usize];
            cursor.fill(bytes, &mut bits)?;
            invalid = Some(bits);
        }
        Ok(Rows { count: read, bytes: out, stride, invalid })
    }

    /// The next records of the group's id among others.
    fn picked(&mut self, bytes: &mut Bytes, out: &mut [u8], stride: usize, count: usize) -> Result<usize, Fault> {
        let records = self.records;
        let mut read = 0;
        while read < count {
            let Some(id) = self.data.number(bytes, records.id_size)? else { break };
            let Some(size) = next_size(&mut self.data, bytes, id, &records.sizes)? else { break };
            if id != records.id {
                self.data.skip(size);
                continue;
            }
            if self.data.fill(bytes, &mut out[read * stride..(read + 1) * stride])? < stride {
                break;
            }
            read += 1;
        }
        Ok(read)
    }
}
