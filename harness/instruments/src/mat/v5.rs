//! MAT-files of version 5: data elements, nested and possibly compressed.

use super::{Contents, Matrix};
use crate::shared::binary::{Bytes, Number, Order, Walk, EXPORT};
use crate::shared::lines::decode;
use crate::Fault;
use flate2::read::ZlibDecoder;
use std::io::Read;
use std::path::Path;

const HEADER: u64 = 128;
const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
const COMPLEX: u32 = 0x800;
/// Structs and cells within each other, at most.
const DEPTH: usize = 32;
/// Letters of a variable's or a field's name, and of a text, at most.
const NAME: u64 = 256;
const TEXT: u64 = 1 << 16;
const DIMENSIONS: u64 = 32;
/// Bytes that the compressed variables of a file may have in all.
const INFLATED: u64 = 1 << 30;
/// Bytes that a compressed byte can become, at most (RFC 1951: 258 by one bit of a length and one of a distance).
const RATIO: u64 = 1032;

pub(super) fn is(head: &[u8]) -> bool {
    // bytes 124 to 127: version 0x0100 and "MI" in the machine's order; HDF5 files of version 7.3 say 0x0200
    let version = matches!(head.get(124..128), Some([0, 1, b'I', b'M'] | [1, 0, b'M', b'I']));
    version || head.starts_with(b"MATLAB 5.0 MAT-file")
}

pub(super) fn read(path: &Path, bytes: Bytes) -> Result<Contents, Fault> {
    let mut contents = Contents::new(bytes);
    let header = contents.areas[0].bytes(0, HEADER)?;
    let order = if header[126] == b'I' { Order::Little } else { Order::Big };
    let about = decode(&header[..116]).trim_matches(['\0', ' ']).to_string();
    contents.texts.push(("header".to_string(), about));
    contents.read_all(HEADER, |contents, at| variable(path, contents, at, order))?;
    Ok(contents)
}

/// Reads the variable at `at`; where the next begins, None where the file ends before.
fn variable(path: &Path, contents: &mut Contents, at: u64, order: Order) -> Result<Option<u64>, Fault> {
    let length = contents.areas[0].length();
    let mut walk = Walk { bytes: &mut contents.areas[0], at, end: length, order };
    if !walk.has(8) {
        return Ok(None);
    }
    let (kind, size) = (walk.u32()?, u64::from(walk.u32()?));
    let from = walk.at;
    if !walk.has(size) {
        return Ok(None);
    }
    match kind {
        COMPRESSED => {
            let held: u64 = contents.areas[1..].iter().map(|a| a.length()).sum();
            let inflated = inflate(&mut contents.areas[0], from, size, order, INFLATED.saturating_sub(held))?;
            contents.areas.push(Bytes::inflated(path, from, inflated));
            let area = contents.areas.len() - 1;
            let mut walk = Walk { end: contents.areas[area].length(), bytes: &mut contents.areas[area], at: 0, order };
            if walk.u32()? == MATRIX {
                let end = walk.end;
                Reader { contents, area, order }.matrix(8, end, "", 0)?;
            }
            if contents.matrices.last().is_none_or(|m| m.area != area) {
                contents.areas.pop();
            }
        }
        MATRIX => Reader { contents, area: 0, order }.matrix(from, from + size, "", 0)?,
        _ => return Err(contents.areas[0].fault(at, format!("a data element of type {kind} is no variable"), EXPORT)),
    }
    Ok(Some(from + size))
}

/// The element that was compressed in `size` bytes at `from`, of at most `most` bytes.
fn inflate(bytes: &mut Bytes, from: u64, size: u64, order: Order, most: u64) -> Result<Vec<u8>, Fault> {
    let mut decoder = ZlibDecoder::new(bytes.part(from, size));
    let mut out = vec![0; 8];
    let read = |decoder: &mut ZlibDecoder<_>, out: &mut Vec<u8>| -> std::io::Result<u64> {
        decoder.read_exact(out)?;
        let claimed = [out[4], out[5], out[6], out[7]];
        let claimed = if order == Order::Little { u32::from_le_bytes(claimed) } else { u32::from_be_bytes(claimed) };
        if u64::from(claimed) > most {
            return Err(std::io::Error::other(format!("with it the file has more than {INFLATED} bytes")));
        }
        // all at once: a vector that grows takes twice what it holds
        out.reserve_exact(u64::from(claimed).min(size * RATIO) as usize);
        decoder.take(claimed.into()).read_to_end(out)?;
        // the end of the stream holds its checksum
        decoder.read_exact(&mut [0]).map_or(Ok(()), |()| Err(std::io::Error::other("more data than claimed")))?;
        Ok(u64::from(claimed))
    };
    let claimed = read(&mut decoder, &mut out);
    match claimed {
        Ok(claimed) if out.len() as u64 == claimed + 8 => Ok(out),
        Ok(_) => Err(bytes.fault(from, "the compressed variable is shorter than it claims", EXPORT)),
        Err(e) => Err(bytes.fault(from, format!("the compressed variable cannot be inflated: {e}"), EXPORT)),
    }
}

/// A data element: its type, and where its data lie.
struct Element {
    kind: u32,
    at: u64,
    size: u64,
    next: u64,
}

impl Element {
    fn number(&self) -> Option<Number> {
        Some(match self.kind {
            1 => Number::I8,
            2 => Number::U8,
            3 => Number::I16,
            4 => Number::U16,
            5 => Number::I32,
            6 => Number::U32,
            7 => Number::F32,
            9 => Number::F64,
            12 => Number::I64,
            13 => Number::U64,
            _ => return None,
        })
    }
}

/// Reads the elements of one area.
struct Reader<'a> {
    contents: &'a mut Contents,
    area: usize,
    order: Order,
}

impl Reader<'_> {
    fn bytes(&mut self) -> &mut Bytes {
        &mut self.contents.areas[self.area]
    }

    fn fault(&mut self, at: u64, what: impl std::fmt::Display) -> Fault {
        self.bytes().fault(at, what, EXPORT)
    }

    /// The element at `at`, which ends at `end` at the latest.
    fn element(&mut self, at: u64, end: u64) -> Result<Element, Fault> {
        let order = self.order;
        let mut walk = Walk { bytes: self.bytes(), at, end, order };
        let word = walk.u32()?;
        // data of up to 4 bytes share the 8 bytes of the tag
        let (kind, size, small) =
            if word >> 16 > 0 { (word & 0xFFFF, word >> 16, true) } else { (word, walk.u32()?, false) };
        if small && size > 4 {
            return Err(walk.fault(format!("a small data element of {size} bytes is claimed"), EXPORT));
        }
        let from = walk.at;
        walk.skip(size.into())?;
        let next = if small { at + 8 } else { walk.at.next_multiple_of(8).min(end) };
        Ok(Element { kind, at: from, size: size.into(), next: next.min(end) })
    }

    /// The numbers of a short element.
    fn numbers(&mut self, element: &Element, most: u64) -> Result<Vec<f64>, Fault> {
        let number = element.number().ok_or_else(|| self.fault(element.at, "numbers are of an unknown type"))?;
        let count = element.size / number.size();
        if count > most {
            return Err(self.fault(element.at, format!("{count} numbers are claimed, {most} at most are meant")));
        }
        let (mut out, order) = (vec![0.0; count as usize], self.order);
        self.bytes().numbers(element.at, number.size(), number, order, &mut out)?;
        Ok(out)
    }

    fn name(&mut self, element: &Element) -> Result<String, Fault> {
        if element.size > NAME {
            return Err(self.fault(element.at, format!("a name of {} letters is claimed", element.size)));
        }
        let bytes = self.bytes().bytes(element.at, element.size)?;
        Ok(decode(&bytes).trim_end_matches('\0').to_string())
    }

    /// Reads the matrix whose data lie from `at` to `end`; `name`: that of a field or a cell, empty for a variable.
    fn matrix(&mut self, at: u64, end: u64, name: &str, depth: usize) -> Result<(), Fault> {
        if at == end {
            return Ok(());
        }
        if depth > DEPTH {
            self.contents.leave_out(name, "structs and cells lie too deep in each other");
            return Ok(());
        }
        let flags = self.element(at, end)?;
        let flags_word = self.numbers(&flags, 2)?.first().map_or(0, |f| *f as u32);
        let class = flags_word & 0xFF;
        let opaque = class == 17;
        let shape = if opaque { None } else { Some(self.element(flags.next, end)?) };
        let own = self.element(shape.as_ref().map_or(flags.next, |s| s.next), end)?;
        let own_name = self.name(&own)?;
        let name = if name.is_empty() { own_name } else { name.to_string() };
        if name.is_empty() {
            // the workspace of functions and objects, which has no name
            return Ok(());
        }
        let sides = shape.map_or(Ok(Vec::new()), |s| self.numbers(&s, DIMENSIONS))?;
        let count = sides.iter().try_fold(1u64, |n, s| n.checked_mul(if *s < 0.0 { return None } else { *s as u64 }));
        let count = count.ok_or_else(|| self.fault(at, "the sides of a matrix are no sizes"))?;
        match class {
            1 => self.cells(own.next, end, &name, count, depth),
            2 => self.structs(own.next, end, &name, count, depth),
            3 => {
                let class_name = self.element(own.next, end)?;
                self.structs(class_name.next, end, &name, count, depth)
            }
            4 => self.text(own.next, end, name, &sides, count),
            5 => self.leave_out(&name, "it is a sparse matrix; save full(...) of it"),
            6..=15 if flags_word & COMPLEX != 0 => self.leave_out(&name, "its numbers are complex"),
            6..=15 => self.array(own.next, end, name, &sides, count),
            _ => self.leave_out(&name, "it is an object or a function; save its data as vectors or as a struct"),
        }
    }

    fn leave_out(&mut self, name: &str, why: &str) -> Result<(), Fault> {
        self.contents.leave_out(name, why);
        Ok(())
    }

    fn cells(&mut self, mut at: u64, end: u64, name: &str, count: u64, depth: usize) -> Result<(), Fault> {
        for i in 1..=count {
            at = self.member(at, end, &format!("{name}.{i}"), depth)?;
        }
        Ok(())
    }

    fn structs(&mut self, at: u64, end: u64, name: &str, count: u64, depth: usize) -> Result<(), Fault> {
        let size = self.element(at, end)?;
        let letters = self.numbers(&size, 1)?.first().map_or(0, |n| *n as u64);
        let names = self.element(size.next, end)?;
        if letters == 0 || letters > NAME {
            return if names.size == 0 { Ok(()) } else { Err(self.fault(size.at, "names of fields have no letters")) };
        }
        let all = self.bytes().bytes(names.at, names.size)?;
        let letters = all.chunks_exact(letters as usize).map(|f| f.split(|b| *b == 0).next().unwrap_or(&[]));
        let fields: Vec<String> = letters.map(|f| decode(f).to_string()).collect();
        let mut at = names.next;
        for i in 1..=if fields.is_empty() { 0 } else { count } {
            let of = if count == 1 { name.to_string() } else { format!("{name}.{i}") };
            for field in &fields {
                at = self.member(at, end, &format!("{of}.{field}"), depth)?;
            }
        }
        Ok(())
    }

    /// Reads the matrix in the element at `at`: where the next begins.
    fn member(&mut self, at: u64, end: u64, name: &str, depth: usize) -> Result<u64, Fault> {
        let member = self.element(at, end)?;
        if member.kind != MATRIX {
            return Err(self.fault(at, format!("\"{name}\" is no matrix but of type {}", member.kind)));
        }
        self.matrix(member.at, member.at + member.size, name, depth + 1)?;
        Ok(member.next)
    }

    fn array(&mut self, at: u64, end: u64, name: String, sides: &[f64], count: u64) -> Result<(), Fault> {
        let real = self.element(at, end)?;
        let Some(number) = real.number() else {
            return Err(self.fault(at, format!("the numbers of \"{name}\" are of the unknown type {}", real.kind)));
        };
        if count.checked_mul(number.size()) != Some(real.size) {
            return Err(self.fault(at, format!("\"{name}\" claims {count} numbers, but has {} bytes", real.size)));
        }
        let long: Vec<u64> = sides.iter().map(|s| *s as u64).filter(|s| *s != 1).collect();
        let (rows, columns) = match (sides, long.as_slice()) {
            ([rows, columns], _) => (*rows as u64, *columns as u64),
            (_, []) => (1, 1),
            (_, [only]) => (*only, 1),
            (_, [rows, columns]) => (*rows, *columns),
            _ => return self.leave_out(&name, "it has more than two dimensions"),
        };
        let (area, order) = (self.area, self.order);
        self.contents.add(Matrix { name, area, at: real.at, number, order, rows, columns })
    }

    /// A text of one line as a property.
    fn text(&mut self, at: u64, end: u64, name: String, sides: &[f64], count: u64) -> Result<(), Fault> {
        if count == 0 {
            return Ok(());
        }
        let letters = self.element(at, end)?;
        if sides.first() != Some(&1.0) || letters.size > TEXT {
            return self.leave_out(&name, "it is text of many lines");
        }
        let text = match letters.kind {
            1 | 2 | 16 => decode(&self.bytes().bytes(letters.at, letters.size)?).to_string(),
            3 | 4 | 17 => {
                let units = Element { kind: 4, ..letters };
                let units: Vec<u16> = self.numbers(&units, TEXT)?.iter().map(|u| *u as u16).collect();
                String::from_utf16_lossy(&units)
            }
            kind => return Err(self.fault(at, format!("the text \"{name}\" is of the unknown type {kind}"))),
        };
        self.contents.say(name, text);
        Ok(())
    }
}
