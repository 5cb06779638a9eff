//! XML of an archive as a tree, each element with its local name, whatever its prefix.

use crate::xml::{self, Walk};
use anyhow::{anyhow, Context, Result};
use quick_xml::events::{BytesStart, Event};
use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

/// An element.
#[derive(Default)]
pub(super) struct Node {
    pub name: String,
    pub attributes: BTreeMap<String, String>,
    pub children: Vec<Node>,
    line: usize,
    file: Rc<str>,
}

fn local(name: &str) -> &str {
    name.rsplit(':').next().unwrap_or(name)
}

impl Node {
    fn of(e: &BytesStart, line: usize, file: &Rc<str>) -> Result<Node, String> {
        let name = local(AsRef::<str>::as_ref(&e.name())).to_string();
        let attributes = xml::attributes(e).map_err(|why| format!("{line}: {why}"))?;
        let attributes = attributes.into_iter().map(|(k, v)| (local(&k).to_string(), v)).collect();
        Ok(Node { name, attributes, children: Vec::new(), line, file: file.clone() })
    }

    /// The root element of the text of `file`; faults begin with the line.
    pub fn parse(text: &str, file: &str) -> Result<Node, String> {
        let file: Rc<str> = file.into();
        let mut walk = Walk::new(text);
        let mut stack = vec![Node::default()];
        loop {
            let (event, line) = walk.event()?;
            match event {
                Event::Start(e) => stack.push(Node::of(&e, line, &file)?),
                Event::End(_) => {
                    let (done, parent) = (stack.pop(), stack.last_mut());
                    parent.zip(done).map(|(p, n)| p.children.push(n)).ok_or(format!("{line}: not well formed"))?;
                }
                Event::Eof => break,
                _ => {}
            }
        }
        let mut roots = stack.pop().unwrap_or_default().children;
        match roots.len() {
            1 => Ok(roots.remove(0)),
            n => Err(format!("1: {n} root elements; export it again")),
        }
    }

    /// The root element of the bytes of `file`.
    pub fn of_bytes(bytes: Vec<u8>, file: &str) -> Result<Node> {
        let text = String::from_utf8(bytes).map_err(|_| anyhow!("{file}: is not UTF-8; export it again"))?;
        Node::parse(text.trim_start_matches('\u{feff}'), file).map_err(|why| anyhow!("{file}:{why}"))
    }

    /// The root element of the file at `path`, which the archive calls `file`.
    pub fn read(path: &Path, file: &str) -> Result<Node> {
        Node::of_bytes(xml::read(path).map_err(|why| anyhow!("{file}: {why}"))?, file)
    }

    /// Where it stands: file and line.
    pub fn place(&self) -> String {
        format!("{}:{}", self.file, self.line)
    }

    pub fn child(&self, name: &str) -> Option<&Node> {
        self.children.iter().find(|c| c.name == name)
    }

    pub fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Node> {
        self.children.iter().filter(move |c| c.name == name)
    }

    /// Elements of one name inside a list of them.
    pub fn listed<'a>(&'a self, list: &'a str, name: &'a str) -> impl Iterator<Item = &'a Node> {
        self.child(list).into_iter().flat_map(move |l| l.all(name))
    }

    pub fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.get(name).map(String::as_str)
    }

    pub fn need(&self, attribute: &str) -> Result<&str> {
        self.attribute(attribute).with_context(|| format!("{}: {} has no {attribute}", self.place(), self.name))
    }

    pub fn number(&self, attribute: &str) -> Result<Option<f64>> {
        let Some(text) = self.attribute(attribute) else { return Ok(None) };
        let value = text.trim().parse();
        Ok(Some(value.with_context(|| format!("{}: {attribute}=\"{text}\" is no number", self.place()))?))
    }

    /// An xs:boolean; false where it is absent.
    pub fn flag(&self, attribute: &str) -> bool {
        self.attribute(attribute).is_some_and(|t| matches!(t.trim(), "true" | "1"))
    }

    /// The first element of a name anywhere below.
    pub fn find(&self, name: &str) -> Option<&Node> {
        self.children.iter().find_map(|c| if c.name == name { Some(c) } else { c.find(name) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_are_read_whatever_their_prefix_and_faults_are_named_with_their_line() {
        let n = Node::parse("<a:x v=\"1\">\n<b:y/>\n<y k=\"2\"/></a:x>", "s.ssd").unwrap();
        assert_eq!((n.name.as_str(), n.all("y").count(), n.number("v").unwrap()), ("x", 2, Some(1.0)));
        assert!(n.child("y").unwrap().need("k").unwrap_err().to_string().contains("ssd:2: y has no k"));
        assert!(Node::parse("<a><b></a>", "s.ssd").is_err());
        assert!(Node::parse("<a>", "s.ssd").is_err());
    }
}
