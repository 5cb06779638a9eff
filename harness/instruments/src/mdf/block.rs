//! Blocks of an MDF file: an id, links to other blocks, and data.

use crate::shared::binary::{Bytes, Order, Walk, EXPORT};
use crate::Fault;
use std::collections::HashSet;

/// Bytes of a block's head.
pub(super) const HEAD: u64 = 24;

/// A block whose links were read.
pub(super) struct Block {
    pub(super) at: u64,
    pub(super) id: [u8; 4],
    links: Vec<u64>,
    /// Where its data begin and end.
    pub(super) data: u64,
    pub(super) end: u64,
}

impl Block {
    /// The block at `at`.
    pub(super) fn read(bytes: &mut Bytes, at: u64) -> Result<Block, Fault> {
        let length = bytes.length();
        let mut walk = Walk { bytes, at, end: length, order: Order::Little };
        if !walk.has(HEAD) {
            let cure = "the file is cut; copy it again or repair it with the program that wrote it";
            return Err(walk.fault("a block is said to lie here, but the file has ended", cure));
        }
        let id = walk.array::<4>()?;
        walk.skip(4)?;
        let (size, links) = (walk.u64()?, walk.u64()?);
        let end = at.checked_add(size).filter(|e| *e <= length && links <= (size.max(HEAD) - HEAD) / 8);
        let Some(end) = end.filter(|_| size >= HEAD) else {
            let what = format!("a block of {size} bytes with {links} links is claimed");
            return Err(walk.bytes.fault(at, what, EXPORT));
        };
        walk.end = end;
        let links = (0..links).map(|_| walk.u64()).collect::<Result<Vec<u64>, Fault>>()?;
        Ok(Block { at, id, links, data: walk.at, end })
    }

    /// The address that a link holds; 0 where there is none.
    pub(super) fn link(&self, place: usize) -> u64 {
        self.links.get(place).copied().unwrap_or(0)
    }

    pub(super) fn links(&self) -> &[u64] {
        &self.links
    }

    /// Reads the block's data.
    pub(super) fn walk<'a>(&self, bytes: &'a mut Bytes) -> Walk<'a> {
        Walk { bytes, at: self.data, end: self.end, order: Order::Little }
    }
}

/// Addresses of blocks that belong to one place only: a second visit is a cycle.
#[derive(Default)]
pub(super) struct Seen(HashSet<u64>);

impl Seen {
    pub(super) fn first(&mut self, bytes: &Bytes, at: u64) -> Result<(), Fault> {
        if self.0.insert(at) {
            return Ok(());
        }
        Err(bytes.fault(at, "two links lead to this block, which belongs to one place", EXPORT))
    }

    /// The block at `at`, which must be of that id.
    pub(super) fn block(&mut self, bytes: &mut Bytes, at: u64, id: &[u8; 4]) -> Result<Block, Fault> {
        self.first(bytes, at)?;
        let block = Block::read(bytes, at)?;
        if &block.id != id {
            let what = format!("{} is expected here, not {}", String::from_utf8_lossy(id), block.id.escape_ascii());
            return Err(bytes.fault(at, what, EXPORT));
        }
        Ok(block)
    }
}

/// Bytes of a name, a unit or a comment that are read, at most.
const TEXT: u64 = 1 << 16;

/// The text of a block of text, or of the element TX of a block of XML; empty where there is none.
pub(super) fn text(bytes: &mut Bytes, at: u64) -> Result<String, Fault> {
    let Some((text, xml)) = raw_text(bytes, at)? else { return Ok(String::new()) };
    Ok(if xml { elements(&text, "TX").into_iter().map(|(_, t)| t).next().unwrap_or_default() } else { text })
}

/// The comment of a block of text or XML, and the XML's entries, as (name, text).
pub(super) fn comments(bytes: &mut Bytes, at: u64) -> Result<Vec<(String, String)>, Fault> {
    let Some((text, xml)) = raw_text(bytes, at)? else { return Ok(Vec::new()) };
    if !xml {
        return Ok(vec![("comment".to_string(), text)]);
    }
    let comment = elements(&text, "TX").into_iter().map(|(_, t)| ("comment".to_string(), t)).take(1);
    let entries = elements(&text, "e").into_iter().filter_map(|(attributes, t)| {
        let name = attributes.split_once("name=")?.1;
        let quote = name.chars().next()?;
        Some((unescaped(name[quote.len_utf8()..].split(quote).next()?), t))
    });
    Ok(comment.chain(entries).filter(|(_, t)| !t.trim().is_empty()).collect())
}

/// A block's text, and whether it is XML.
fn raw_text(bytes: &mut Bytes, at: u64) -> Result<Option<(String, bool)>, Fault> {
    if at == 0 {
        return Ok(None);
    }
    let block = Block::read(bytes, at)?;
    let xml = match &block.id {
        b"##TX" => false,
        b"##MD" => true,
        _ => return Ok(None),
    };
    let text = block.walk(bytes).text((block.end - block.data).min(TEXT))?;
    let text = text.split('\0').next().unwrap_or_default().to_string();
    Ok(Some((text, xml)))
}

/// Attributes and text of all elements of that name which hold text only.
fn elements(xml: &str, name: &str) -> Vec<(String, String)> {
    let (open, close) = (format!("<{name}"), format!("</{name}>"));
    let mut found = Vec::new();
    let mut rest = xml;
    while let Some((_, after)) = rest.split_once(open.as_str()) {
        rest = after;
        if !after.starts_with(|c: char| c == '>' || c.is_whitespace()) {
            continue;
        }
        let Some((attributes, body)) = after.split_once('>') else { break };
        let Some((text, after)) = body.split_once(close.as_str()) else { break };
        found.push((attributes.trim().to_string(), unescaped(text)));
        rest = after;
    }
    found
}

fn unescaped(text: &str) -> String {
    quick_xml::escape::unescape(text).map_or_else(|_| text.to_string(), |t| t.into_owned())
}
