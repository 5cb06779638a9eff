//! The lines of a text file, one at a time, in constant memory.
//!
//! UTF-16 is decoded as it is read. Every other encoding is handed on as bytes, since numbers are ASCII in all of them;
//! [`decode`] makes a text of the bytes of a name.

use crate::Fault;
use encoding_rs::{Decoder, UTF_16BE, UTF_16LE, WINDOWS_1252};
use std::borrow::Cow;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Bytes that are read at a time.
const CHUNK: usize = 1 << 18;
/// The longest line, bytes. Excel's 16384 columns of 25 characters are below it.
const LONGEST: usize = 1 << 24;

/// UTF-8 where the bytes are UTF-8, Windows-1252 (which holds Latin-1) otherwise.
pub(crate) fn decode(bytes: &[u8]) -> Cow<'_, str> {
    match std::str::from_utf8(bytes) {
        Ok(text) => Cow::Borrowed(text),
        Err(_) => WINDOWS_1252.decode_without_bom_handling(bytes).0,
    }
}

/// The first characters of a text, for a message.
pub(crate) fn excerpt(bytes: &[u8]) -> String {
    let text = decode(&bytes[..bytes.len().min(200)]);
    let short: String = text.trim().chars().take(40).collect();
    if short.len() < text.trim().len() {
        format!("{short}...")
    } else {
        short
    }
}

/// How the bytes of a file become text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Encoding {
    /// ASCII, UTF-8, Latin-1, Windows-1252.
    Bytes,
    Utf16(&'static encoding_rs::Encoding),
}

/// The encoding that a file's first bytes show, and the length of its byte order mark.
pub(crate) fn encoding(head: &[u8]) -> (Encoding, usize) {
    match head {
        [0xEF, 0xBB, 0xBF, ..] => (Encoding::Bytes, 3),
        [0xFF, 0xFE, ..] => (Encoding::Utf16(UTF_16LE), 2),
        [0xFE, 0xFF, ..] => (Encoding::Utf16(UTF_16BE), 2),
        _ => {
            let zeros = |odd: usize| head.iter().skip(odd).step_by(2).filter(|b| **b == 0).count();
            let most = head.len() * 2 / 5;
            match (zeros(0), zeros(1)) {
                (0, odd) if odd > 0 && odd >= most => (Encoding::Utf16(UTF_16LE), 0),
                (even, 0) if even > 0 && even >= most => (Encoding::Utf16(UTF_16BE), 0),
                _ => (Encoding::Bytes, 0),
            }
        }
    }
}

/// Where a line begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mark {
    /// Bytes of decoded text before it.
    offset: u64,
    /// Lines before it.
    pub lines: u64,
}

/// A line without its end.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line<'a> {
    pub text: &'a [u8],
    /// 1 for the first.
    pub number: u64,
    /// Whether it has an end: CRLF, LF or CR. The last line of a file may have none.
    pub ended: bool,
}

/// Reads lines.
pub(crate) struct Lines {
    path: PathBuf,
    file: File,
    /// Of the byte order mark.
    skip: u64,
    encoding: Encoding,
    decoder: Option<Decoder>,
    raw: Vec<u8>,
    buffer: Vec<u8>,
    /// The first byte of `buffer` not yet taken.
    from: usize,
    ended: bool,
    mark: Mark,
    /// Byte of text from which on the file holds zeros only: memory reserved but never written.
    pub zeros: Option<u64>,
}

impl Lines {
    pub fn open(path: &Path) -> Result<Lines, Fault> {
        let unreadable = |e| Fault::unreadable(path, e);
        let mut head = Vec::with_capacity(4096);
        let mut file = input::open(path).map_err(unreadable)?;
        (&mut file).take(4096).read_to_end(&mut head).map_err(unreadable)?;
        let (encoding, mark) = encoding(&head);
        let mut lines = Lines {
            path: path.to_path_buf(),
            file,
            skip: mark as u64,
            encoding,
            decoder: None,
            raw: vec![0; CHUNK],
            buffer: Vec::new(),
            from: 0,
            ended: false,
            mark: Mark { offset: 0, lines: 0 },
            zeros: None,
        };
        lines.go(Mark { offset: 0, lines: 0 })?;
        Ok(lines)
    }

    /// Where the next line begins.
    pub fn mark(&self) -> Mark {
        self.mark
    }

    /// Goes to where a line begins.
    pub fn go(&mut self, to: Mark) -> Result<(), Fault> {
        self.buffer.clear();
        self.from = 0;
        self.ended = false;
        self.mark = to;
        let bytes = match self.encoding {
            Encoding::Bytes => self.skip + to.offset,
            Encoding::Utf16(_) => self.skip,
        };
        let place = self.file.seek(SeekFrom::Start(bytes));
        place.map_err(|e| self.unreadable(e))?;
        if let Encoding::Utf16(encoding) = self.encoding {
            self.decoder = Some(encoding.new_decoder_without_bom_handling());
            let mut left = to.offset;
            while left > 0 && self.fill()? {
                let take = left.min(self.buffer.len() as u64);
                self.buffer.drain(..take as usize);
                left -= take;
            }
        }
        Ok(())
    }

    /// A fault of this file at a line.
    pub fn fault(&self, line: u64, what: impl std::fmt::Display, cure: impl std::fmt::Display) -> Fault {
        Fault::new(&self.path, what, cure).at(format!("line {line}"))
    }

    fn unreadable(&self, e: std::io::Error) -> Fault {
        Fault::unreadable(&self.path, e).at(format!("after line {}", self.mark.lines))
    }

    /// Reads a chunk more; whether there was one.
    fn fill(&mut self) -> Result<bool, Fault> {
        if self.from > 0 {
            self.buffer.drain(..self.from);
            self.from = 0;
        }
        let read = loop {
            match self.file.read(&mut self.raw) {
                Err(e) if e.kind() == std::io::ErrorKind::Interrupted => {}
                other => break other,
            }
        };
        let read = read.map_err(|e| self.unreadable(e))?;
        match &mut self.decoder {
            None => self.buffer.extend_from_slice(&self.raw[..read]),
            Some(decoder) => {
                let room = decoder.max_utf8_buffer_length(read).unwrap_or(4 * CHUNK);
                let start = self.buffer.len();
                self.buffer.resize(start + room, 0);
                let (_, _, wrote, _) = decoder.decode_to_utf8(&self.raw[..read], &mut self.buffer[start..], read == 0);
                self.buffer.truncate(start + wrote);
            }
        }
        self.ended = read == 0;
        Ok(read > 0)
    }

    /// The next line; None at the end of the text.
    pub fn next(&mut self) -> Result<Option<Line<'_>>, Fault> {
        let mut searched = 0;
        loop {
            let rest = &self.buffer[self.from..];
            let found = memchr::memchr3(b'\n', b'\r', 0, &rest[searched..]).map(|at| searched + at);
            match found {
                Some(at) if rest[at] == 0 => match self.after_zeros(at)? {
                    Some(other) => searched = other,
                    None => return Ok(self.take(at, at, false)),
                },
                Some(at) => match end(&rest[at..], self.ended) {
                    Some(length) => return Ok(self.take(at, at + length, true)),
                    None => {
                        searched = at;
                        self.fill()?;
                    }
                },
                None if self.ended => return Ok(self.take(rest.len(), rest.len(), false)),
                None => {
                    searched = rest.len();
                    if searched > LONGEST {
                        let cure = "give a text with lines, or name the format it is of by its extension";
                        return Err(self.fault(self.mark.lines + 1, "the line is longer than 16 MiB", cure));
                    }
                    self.fill()?;
                }
            }
        }
    }

    /// The first byte other than zero from `at` on; None where the file holds zeros only from there: the text ends then.
    fn after_zeros(&mut self, at: usize) -> Result<Option<usize>, Fault> {
        loop {
            let rest = &self.buffer[self.from + at..];
            if let Some(other) = rest.iter().position(|b| *b != 0) {
                return Ok(Some(at + other));
            }
            if rest.len() > CHUNK || !self.fill()? {
                self.zeros = Some(self.skip + self.mark.offset + at as u64);
                self.ended = true;
                self.buffer.truncate(self.from + at);
                return Ok(None);
            }
        }
    }

    /// Takes `length` bytes of text, then what is up to `next`; None where nothing is left.
    fn take(&mut self, length: usize, next: usize, ended: bool) -> Option<Line<'_>> {
        if length == 0 && !ended {
            return None;
        }
        let start = self.from;
        self.from += next;
        self.mark.offset += next as u64;
        self.mark.lines += 1;
        Some(Line { text: &self.buffer[start..start + length], number: self.mark.lines, ended })
    }
}

/// The length of a line's end: LF, CR, or up to four CRs before an LF (as some writers double them); None where more bytes must
/// be seen.
fn end(bytes: &[u8], last: bool) -> Option<usize> {
    let returns = bytes.iter().take(4).take_while(|b| **b == b'\r').count();
    match bytes.get(returns) {
        Some(b'\n') => Some(returns + 1),
        Some(_) => Some(1),
        None if last => Some(1),
        None => None,
    }
}
