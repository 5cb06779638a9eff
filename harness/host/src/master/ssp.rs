//! SSP 1.0 archives in (Modelica Association 2019, System Structure and Parameterization): one flat system of
//! FMI 2.0 components with Real connections.

use super::build::MOST_FMUS;
use super::system::{Component, Connection, Master, System};
use crate::archive;
use crate::value::Value;
use crate::xml::{self, Walk};
use anyhow::{anyhow, bail, ensure, Context, Result};
use quick_xml::events::{BytesStart, Event};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use toml::Spanned;

/// An element with its local name, whatever its prefix.
#[derive(Default)]
struct Node {
    name: String,
    attributes: BTreeMap<String, String>,
    children: Vec<Node>,
    line: usize,
}

fn local(name: &str) -> &str {
    name.rsplit(':').next().unwrap_or(name)
}

impl Node {
    fn of(e: &BytesStart, line: usize) -> Result<Node, String> {
        let name = local(AsRef::<str>::as_ref(&e.name())).to_string();
        let attributes = xml::attributes(e).map_err(|why| format!("{line}: {why}"))?;
        let attributes = attributes.into_iter().map(|(k, v)| (local(&k).to_string(), v)).collect();
        Ok(Node { name, attributes, children: Vec::new(), line })
    }

    /// The root element of a file's text; faults begin with the line.
    fn parse(text: &str) -> Result<Node, String> {
        let mut walk = Walk::new(text);
        let mut stack = vec![Node::default()];
        loop {
            let (event, line) = walk.event()?;
            match event {
                Event::Start(e) => stack.push(Node::of(&e, line)?),
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

    /// The root element of a file in the archive that a text names.
    fn in_archive(folder: &Path, source: &str) -> Result<Node> {
        let read = || {
            let bytes = xml::read(&archive::inside(folder, source)?)?;
            String::from_utf8(bytes).map_err(|_| "is not UTF-8; export it again".to_string())
        };
        let text = read().map_err(|why| anyhow!("{source}: {why}"))?;
        Node::parse(&text).map_err(|why| anyhow!("{source}:{why}"))
    }

    fn child(&self, name: &str) -> Option<&Node> {
        self.children.iter().find(|c| c.name == name)
    }

    fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Node> {
        self.children.iter().filter(move |c| c.name == name)
    }

    fn need(&self, attribute: &str) -> Result<&str> {
        let found = self.attributes.get(attribute).map(String::as_str);
        found.with_context(|| format!("SystemStructure.ssd:{}: {} has no {attribute}", self.line, self.name))
    }

    fn number(&self, attribute: &str) -> Result<Option<f64>> {
        let Some(text) = self.attributes.get(attribute) else { return Ok(None) };
        let value = text.trim().parse();
        Ok(Some(
            value.with_context(|| format!("SystemStructure.ssd:{}: {attribute}=\"{text}\" is no number", self.line))?,
        ))
    }

    /// The first element of a name anywhere below.
    fn find(&self, name: &str) -> Option<&Node> {
        self.children.iter().find_map(|c| if c.name == name { Some(c) } else { c.find(name) })
    }
}

fn spanned<T>(value: T) -> Spanned<T> {
    Spanned::new(0..0, value)
}

/// Parameters of a binding, inline or in a file of the archive, by name without the prefix.
fn bindings(n: &Node, folder: &Path) -> Result<Vec<(String, Value)>> {
    let mut found = Vec::new();
    for b in n.child("ParameterBindings").into_iter().flat_map(|p| p.all("ParameterBinding")) {
        let prefix = b.attributes.get("prefix").cloned().unwrap_or_default();
        ensure!(
            b.child("ParameterMapping").is_none(),
            "SystemStructure.ssd:{}: parameter mappings are not read here; name the parameters as the FMU does",
            b.line
        );
        let file;
        let set = match b.attributes.get("source") {
            Some(source) => {
                file = Node::in_archive(folder, source)?;
                Some(&file)
            }
            None => b.child("ParameterValues").and_then(|v| v.child("ParameterSet")),
        };
        let Some(parameters) = set.and_then(|s| s.child("Parameters")) else { continue };
        for p in parameters.all("Parameter") {
            let name = format!("{prefix}{}", p.need("name")?);
            let Some(v) = p.children.first() else { continue };
            let text = v.need("value")?;
            let wrong = || format!("parameter {name}: \"{text}\" is no {}", v.name);
            let value = match v.name.as_str() {
                "Real" => Value::Real(text.trim().parse().with_context(wrong)?),
                "Integer" => Value::Integer(text.trim().parse().with_context(wrong)?),
                "Boolean" => Value::Boolean(matches!(text.trim(), "true" | "1")),
                // of an Enumeration the item's name
                "String" | "Enumeration" => Value::Text(text.to_string()),
                other => bail!("parameter {name} is of type {other}, which is not read here"),
            };
            found.push((name, value));
        }
    }
    Ok(found)
}

/// Reads an archive. The master is Gauss-Seidel in dependency order; its step that of the OMSimulator annotation, or
/// of the FMUs where there is none.
///
/// # Errors
/// Says what is wrong with the archive, with the line of SystemStructure.ssd, and the cure.
pub(super) fn load(path: &Path) -> Result<System> {
    let folder = archive::unpack(path, &archive::SSP).map_err(|why| anyhow!(why))?;
    let root = Node::in_archive(folder.path(), archive::SSP.needs)?;
    ensure!(root.name == "SystemStructureDescription", "SystemStructure.ssd: the root element is {}", root.name);
    let version = root.attributes.get("version").cloned().unwrap_or_default();
    ensure!(version.starts_with("1."), "SystemStructure.ssd is of SSP {version:?}; this host reads SSP 1.0");
    let system = root.child("System").context("SystemStructure.ssd has no System")?;
    let mut components = Vec::new();
    let count = system.child("Elements").map_or(0, |e| e.children.len());
    ensure!(
        count <= MOST_FMUS,
        "SystemStructure.ssd: {count} components, more than the {MOST_FMUS} that run here; run the system in parts"
    );
    let of_system = bindings(system, folder.path())?;
    for c in system.child("Elements").into_iter().flat_map(|e| &e.children) {
        ensure!(
            c.name == "Component",
            "SystemStructure.ssd:{}: a {} inside the system; only components are read here, flatten it",
            c.line,
            c.name
        );
        let name = c.need("name")?.to_string();
        let mut set: BTreeMap<String, Spanned<Value>> = BTreeMap::new();
        let prefix = format!("{name}.");
        for (n, v) in &of_system {
            if let Some(own) = n.strip_prefix(&prefix) {
                set.insert(own.to_string(), spanned(v.clone()));
            }
        }
        for (n, v) in bindings(c, folder.path())? {
            set.insert(n, spanned(v));
        }
        let source = c.need("source")?.to_string();
        archive::inside(folder.path(), &source).map_err(|why| anyhow!("SystemStructure.ssd:{}: {why}", c.line))?;
        components.push(Component { name: spanned(name), file: spanned(source), set, input_orders: None, log: vec![] });
    }
    ensure!(!components.is_empty(), "SystemStructure.ssd has no Component");
    let mut connect = Vec::new();
    for c in system.child("Connections").into_iter().flat_map(|e| e.all("Connection")) {
        let (Some(a), Some(b)) = (c.attributes.get("startElement"), c.attributes.get("endElement")) else {
            // a connector of the system itself: nothing of ours is on its other side
            continue;
        };
        let (from, to) = (format!("{a}.{}", c.need("startConnector")?), format!("{b}.{}", c.need("endConnector")?));
        let (mut factor, mut offset) = (1.0, 0.0);
        if let Some(l) = c.child("LinearTransformation") {
            factor = l.number("factor")?.unwrap_or(1.0);
            offset = l.number("offset")?.unwrap_or(0.0);
        }
        connect.push(Connection { from: spanned(from), to: spanned(to), factor, offset });
    }
    let experiment = root.child("DefaultExperiment");
    let time = |name: &str| -> Result<Option<f64>> { experiment.map_or(Ok(None), |e| e.number(name)) };
    let step = root.find("FixedStepMaster").map_or(Ok(None), |m| m.number("stepSize"))?;
    let plain = Master::plain();
    let start = time("startTime")?.unwrap_or(plain.start);
    let stop = time("stopTime")?.unwrap_or(plain.stop);
    let bare = System::of(components, path, folder.path());
    Ok(System {
        name: system.attributes.get("name").cloned(),
        connect,
        master: Master { start, stop, step, ..plain },
        keep: Some(Arc::new(folder)),
        ..bare
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_are_read_whatever_their_prefix_and_faults_are_named_with_their_line() {
        let n = Node::parse("<a:x v=\"1\">\n<b:y/>\n<y k=\"2\"/></a:x>").unwrap();
        assert_eq!((n.name.as_str(), n.all("y").count(), n.number("v").unwrap()), ("x", 2, Some(1.0)));
        assert!(n.child("y").unwrap().need("k").unwrap_err().to_string().contains("ssd:2: y has no k"));
        assert!(Node::parse("<a><b></a>").is_err());
        assert!(Node::parse("<a>").is_err());
    }
}
