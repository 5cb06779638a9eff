//! Bytes of a binary file at any place of it, by pages, with every claim of size held against the file's length.

use super::lines::decode;
use crate::Fault;
use std::collections::HashMap;
use std::io::{Cursor, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Bytes in a page.
const PAGE: u64 = 1 << 18;
/// Pages kept, at most.
const KEPT: usize = 64;
/// Bytes in a text, at most.
const TEXT: u64 = 1 << 24;
/// The cure of a file that contradicts itself.
pub(crate) const EXPORT: &str = "the file is damaged; export or copy it again";

/// Order of the bytes of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Order {
    Little,
    Big,
}

/// How a number is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Number {
    I8,
    I16,
    I32,
    I64,
    U8,
    U16,
    U32,
    U64,
    F32,
    F64,
}

impl Number {
    /// Bytes of one number.
    pub(crate) fn size(self) -> u64 {
        match self {
            Number::I8 | Number::U8 => 1,
            Number::I16 | Number::U16 => 2,
            Number::I32 | Number::U32 | Number::F32 => 4,
            Number::I64 | Number::U64 | Number::F64 => 8,
        }
    }
}

trait Input: Read + Seek + Send {}
impl<T: Read + Seek + Send> Input for T {}

struct Page {
    bytes: Vec<u8>,
    used: u64,
}

/// A file's bytes, or bytes inflated from it.
pub(crate) struct Bytes {
    path: PathBuf,
    /// What a place is of, such as ` of the data inflated from byte 128`; empty for the file itself.
    of: String,
    input: Box<dyn Input>,
    length: u64,
    pages: HashMap<u64, Page>,
    uses: u64,
}

impl Bytes {
    /// The bytes of the file at `path`.
    pub(crate) fn open(path: &Path) -> Result<Bytes, Fault> {
        let unreadable = |e| Fault::unreadable(path, e);
        let file = input::open(path).map_err(unreadable)?;
        let length = file.metadata().map_err(unreadable)?.len();
        Ok(Bytes::new(path, String::new(), Box::new(file), length))
    }

    /// Bytes that were inflated from byte `from` of the file at `path`.
    pub(crate) fn inflated(path: &Path, from: u64, bytes: Vec<u8>) -> Bytes {
        let length = bytes.len() as u64;
        Bytes::new(path, format!(" of the data inflated from byte {from}"), Box::new(Cursor::new(bytes)), length)
    }

    fn new(path: &Path, of: String, input: Box<dyn Input>, length: u64) -> Bytes {
        Bytes { path: path.to_path_buf(), of, input, length, pages: HashMap::new(), uses: 0 }
    }

    pub(crate) fn length(&self) -> u64 {
        self.length
    }

    /// A fault at byte `at`.
    pub(crate) fn fault(&self, at: u64, what: impl std::fmt::Display, cure: impl std::fmt::Display) -> Fault {
        Fault::new(&self.path, what, cure).at(format!("byte {at}{}", self.of))
    }

    /// Whether `count` bytes at `at` lie within.
    pub(crate) fn holds(&self, at: u64, count: u64) -> bool {
        at.checked_add(count).is_some_and(|end| end <= self.length)
    }

    /// Fills `out` from byte `at`.
    pub(crate) fn fill(&mut self, at: u64, out: &mut [u8]) -> Result<(), Fault> {
        if !self.holds(at, out.len() as u64) {
            let what = format!("{} bytes are claimed, but the data end at byte {}", out.len(), self.length);
            return Err(self.fault(at, what, EXPORT));
        }
        let mut done = 0;
        while done < out.len() {
            let from = at + done as u64;
            let page = self.page(from / PAGE)?;
            let bytes = &page[(from % PAGE) as usize..];
            let count = bytes.len().min(out.len() - done);
            out[done..done + count].copy_from_slice(&bytes[..count]);
            done += count;
        }
        Ok(())
    }

    /// `count` bytes from byte `at`.
    pub(crate) fn bytes(&mut self, at: u64, count: u64) -> Result<Vec<u8>, Fault> {
        if !self.holds(at, count) {
            let what = format!("{count} bytes are claimed, but the data end at byte {}", self.length);
            return Err(self.fault(at, what, EXPORT));
        }
        let mut out = vec![0; count as usize];
        self.fill(at, &mut out)?;
        Ok(out)
    }

    /// Numbers, the first at byte `at`, each `stride` bytes after the last.
    pub(crate) fn numbers(
        &mut self,
        at: u64,
        stride: u64,
        number: Number,
        order: Order,
        out: &mut [f64],
    ) -> Result<(), Fault> {
        macro_rules! read {
            ($kind:ty) => {
                match order {
                    Order::Little => self.each(at, stride, out, |b| <$kind>::from_le_bytes(b) as f64),
                    Order::Big => self.each(at, stride, out, |b| <$kind>::from_be_bytes(b) as f64),
                }
            };
        }
        match number {
            Number::I8 => read!(i8),
            Number::I16 => read!(i16),
            Number::I32 => read!(i32),
            Number::I64 => read!(i64),
            Number::U8 => read!(u8),
            Number::U16 => read!(u16),
            Number::U32 => read!(u32),
            Number::U64 => read!(u64),
            Number::F32 => read!(f32),
            Number::F64 => read!(f64),
        }
    }

    /// What `value` makes of `N` bytes, the first at byte `at`, each `stride` bytes after the last.
    pub(crate) fn each<const N: usize>(
        &mut self,
        at: u64,
        stride: u64,
        out: &mut [f64],
        value: impl Fn([u8; N]) -> f64,
    ) -> Result<(), Fault> {
        let mut done = 0;
        while done < out.len() {
            let from = (done as u64).checked_mul(stride).and_then(|d| at.checked_add(d));
            let from = from.ok_or_else(|| self.fault(at, "a place lies beyond any file", EXPORT))?;
            let room = PAGE.min(self.length.saturating_sub(from / PAGE * PAGE)).saturating_sub(from % PAGE);
            if room < N as u64 {
                let mut bytes = [0; N];
                self.fill(from, &mut bytes)?;
                out[done] = value(bytes);
                done += 1;
                continue;
            }
            let whole = ((room - N as u64) / stride.max(1) + 1).min((out.len() - done) as u64) as usize;
            let page = self.page(from / PAGE)?;
            let (start, stride) = ((from % PAGE) as usize, stride as usize);
            for (i, out) in out[done..done + whole].iter_mut().enumerate() {
                let mut bytes = [0; N];
                bytes.copy_from_slice(&page[start + i * stride..start + i * stride + N]);
                *out = value(bytes);
            }
            done += whole;
        }
        Ok(())
    }

    /// A reader of `count` bytes from byte `at`.
    pub(crate) fn part(&mut self, at: u64, count: u64) -> Part<'_> {
        let end = at.saturating_add(count).min(self.length);
        Part { bytes: self, at, end }
    }

    fn page(&mut self, index: u64) -> Result<&[u8], Fault> {
        self.uses += 1;
        if !self.pages.contains_key(&index) {
            if self.pages.len() >= KEPT {
                let oldest = self.pages.iter().min_by_key(|(_, p)| p.used).map(|(i, _)| *i);
                oldest.and_then(|i| self.pages.remove(&i));
            }
            let from = index * PAGE;
            let mut bytes = vec![0; PAGE.min(self.length.saturating_sub(from)) as usize];
            let read = self.input.seek(SeekFrom::Start(from)).and_then(|_| self.input.read_exact(&mut bytes));
            read.map_err(|e| self.fault(from, e, "give a file that can be read and is not being written"))?;
            self.pages.insert(index, Page { bytes, used: 0 });
        }
        let page = self.pages.get_mut(&index).expect("the page was read");
        page.used = self.uses;
        Ok(&page.bytes)
    }
}

/// Reads a part of the bytes.
pub(crate) struct Part<'a> {
    bytes: &'a mut Bytes,
    at: u64,
    end: u64,
}

impl Read for Part<'_> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let count = (out.len() as u64).min(self.end.saturating_sub(self.at)) as usize;
        self.bytes.fill(self.at, &mut out[..count]).map_err(std::io::Error::other)?;
        self.at += count as u64;
        Ok(count)
    }
}

/// Reads one value after the other, up to an end.
pub(crate) struct Walk<'a> {
    pub(crate) bytes: &'a mut Bytes,
    pub(crate) at: u64,
    pub(crate) end: u64,
    pub(crate) order: Order,
}

impl Walk<'_> {
    /// A fault at the present place.
    pub(crate) fn fault(&self, what: impl std::fmt::Display, cure: impl std::fmt::Display) -> Fault {
        self.bytes.fault(self.at, what, cure)
    }

    /// Whether `count` bytes are left.
    pub(crate) fn has(&self, count: u64) -> bool {
        self.at.checked_add(count).is_some_and(|end| end <= self.end)
    }

    /// Goes on by `count` bytes.
    pub(crate) fn skip(&mut self, count: u64) -> Result<(), Fault> {
        if !self.has(count) {
            return Err(self.fault(format!("{count} bytes are claimed, but the block ends at {}", self.end), EXPORT));
        }
        self.at += count;
        Ok(())
    }

    pub(crate) fn array<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let at = self.at;
        self.skip(N as u64)?;
        let mut out = [0; N];
        self.bytes.fill(at, &mut out)?;
        Ok(out)
    }

    /// The number's bytes, the lowest first.
    fn little<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let mut out = self.array::<N>()?;
        if self.order == Order::Big {
            out.reverse();
        }
        Ok(out)
    }

    pub(crate) fn u8(&mut self) -> Result<u8, Fault> {
        Ok(self.little::<1>()?[0])
    }

    pub(crate) fn u16(&mut self) -> Result<u16, Fault> {
        Ok(u16::from_le_bytes(self.little()?))
    }

    pub(crate) fn u32(&mut self) -> Result<u32, Fault> {
        Ok(u32::from_le_bytes(self.little()?))
    }

    pub(crate) fn u64(&mut self) -> Result<u64, Fault> {
        Ok(u64::from_le_bytes(self.little()?))
    }

    pub(crate) fn f64(&mut self) -> Result<f64, Fault> {
        Ok(f64::from_le_bytes(self.little()?))
    }

    /// One number of a kind.
    pub(crate) fn number(&mut self, kind: Number) -> Result<f64, Fault> {
        let mut out = [0.0];
        let at = self.at;
        self.skip(kind.size())?;
        self.bytes.numbers(at, kind.size(), kind, self.order, &mut out)?;
        Ok(out[0])
    }

    /// Text of `count` bytes.
    pub(crate) fn text(&mut self, count: u64) -> Result<String, Fault> {
        if count > TEXT {
            return Err(self.fault(format!("a text of {count} bytes is claimed"), EXPORT));
        }
        let at = self.at;
        self.skip(count)?;
        Ok(decode(&self.bytes.bytes(at, count)?).into_owned())
    }
}
