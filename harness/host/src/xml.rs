//! XML of archives, element by element: lines counted as it is read, depth and attributes bounded.

use quick_xml::events::{BytesStart, Event};
use std::collections::BTreeMap;
use std::path::Path;

/// Most elements inside each other; descriptions have ten.
const DEEPEST: usize = 100;
/// Most attributes of an element; the standards name twenty.
const MOST_ATTRIBUTES: usize = 1000;
/// Longest file, bytes.
pub(super) const LONGEST: u64 = 256 << 20;

/// A reader of a text, and where it is.
pub(super) struct Walk<'a> {
    text: &'a str,
    reader: quick_xml::Reader<&'a [u8]>,
    counted: usize,
    line: usize,
    open: Vec<String>,
}

impl<'a> Walk<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        let mut reader = quick_xml::Reader::from_str(text);
        reader.config_mut().expand_empty_elements = true;
        Walk { text, reader, counted: 0, line: 1, open: Vec::new() }
    }

    /// The next event; the end of the text as Eof. With the line where it ends.
    ///
    /// # Errors
    /// Begins with the line: not well formed, too deep, ends inside an element.
    pub(super) fn event(&mut self) -> Result<(Event<'a>, usize), String> {
        let event = self.reader.read_event();
        let at = self.reader.buffer_position().max(self.reader.error_position()).min(self.text.len() as u64) as usize;
        let at = at.max(self.counted);
        self.line += self.text.as_bytes()[self.counted..at].iter().filter(|&&b| b == b'\n').count();
        self.counted = at;
        let line = self.line;
        let event = event.map_err(|e| format!("{line}: not well formed ({e})"))?;
        match &event {
            Event::Start(e) => {
                if self.open.len() == DEEPEST {
                    return Err(format!("{line}: more than {DEEPEST} elements inside each other; export it again"));
                }
                self.open.push(AsRef::<str>::as_ref(&e.name()).to_string());
            }
            Event::End(_) => {
                self.open.pop();
            }
            Event::Eof => {
                if let Some(name) = self.open.last() {
                    return Err(format!("{line}: ends inside {name}; export it again"));
                }
            }
            _ => {}
        }
        Ok((event, line))
    }

    /// Names of the elements that are open, the outermost first.
    pub(super) fn open(&self) -> &[String] {
        &self.open
    }
}

/// The attributes of an element.
///
/// # Errors
/// Not well formed; more than a thousand.
pub(super) fn attributes(e: &BytesStart) -> Result<BTreeMap<String, String>, String> {
    let mut all = BTreeMap::new();
    for a in e.attributes() {
        let a = a.map_err(|e| e.to_string())?;
        let value = a.normalized_value(quick_xml::XmlVersion::Implicit1_0).map_err(|e| e.to_string())?.into_owned();
        all.insert(AsRef::<str>::as_ref(&a.key).to_string(), value);
        if all.len() > MOST_ATTRIBUTES {
            return Err(format!("more than {MOST_ATTRIBUTES} attributes; export it again"));
        }
    }
    Ok(all)
}

/// The bytes of a file that is XML.
///
/// # Errors
/// It cannot be read, or is too long.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, String> {
    input::bytes(path, LONGEST).map_err(|e| format!("cannot be read ({e})"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn last(text: &str) -> Result<usize, String> {
        let mut walk = Walk::new(text);
        loop {
            if let (Event::Eof, line) = walk.event()? {
                return Ok(line);
            }
        }
    }

    #[test]
    fn lines_are_counted_and_what_is_too_deep_or_cut_is_told_with_its_own() {
        assert_eq!(last("<a>\n<b/>\n</a>\n"), Ok(4));
        assert!(last("<a>\n<b>\n</a>").unwrap_err().starts_with("3: not well formed"));
        assert_eq!(last("<a>\n<b>").unwrap_err(), "2: ends inside b; export it again");
        let deep = "<a>\n".repeat(150_000);
        assert!(last(&deep).unwrap_err().starts_with("101: more than 100 elements inside each other"));
    }

    #[test]
    fn attributes_without_number_are_refused() {
        let text: String = (0..200_000).map(|i| format!("a{i}=\"1\" ")).collect();
        let text = format!("<a {text}/>");
        let mut walk = Walk::new(&text);
        let (Event::Start(e), _) = walk.event().unwrap() else { panic!("no element") };
        assert!(attributes(&e).unwrap_err().contains("more than 1000 attributes"));
    }
}
