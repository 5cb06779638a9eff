//! SSP 1.0 and 2.0 archives in (Modelica Association, System Structure and Parameterization): systems of FMI 2.0 components,
//! nested or not, made one flat system.

mod node;
mod place;
mod values;
mod wiring;

use super::build::MOST_FMUS;
use super::system::{Component, Master, System};
use crate::archive;
use crate::description::Description;
use crate::{Causality, Variability};
use anyhow::{anyhow, bail, ensure, Context, Result};
use node::Node;
use place::Base;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::Spanned;
use values::{bindings, units, Bound, Read};
use wiring::{connectors, Connector, Element, Wiring};

/// Systems inside each other that are read, and elements of all of them: a description may name itself.
const DEEPEST: usize = 20;
const MOST_ELEMENTS: usize = 20_000;

/// Reads archives and keeps what was read.
#[derive(Default)]
struct Reader {
    wiring: Wiring,
    components: Vec<Component>,
    read: Read,
    notes: Vec<String>,
    keep: Vec<Arc<output::Scratch>>,
}

/// What a system is read in.
struct Around<'a> {
    base: &'a Base,
    units: &'a HashMap<String, crate::Unit>,
    /// Names of the elements around it, for the names in the flat system.
    path: &'a str,
    /// Elements of the signal dictionaries of the systems around it.
    dictionaries: HashMap<String, usize>,
    depth: usize,
}

/// A name without the dot that parts an FMU's name from its variables'.
fn undotted(name: &str) -> String {
    name.replace('.', "/")
}

fn description_root(root: &Node) -> Result<()> {
    ensure!(root.name == "SystemStructureDescription", "{}: the root element is {}", root.place(), root.name);
    let version = root.attribute("version").unwrap_or_default();
    let known = version.starts_with("1.") || version.starts_with("2.");
    ensure!(known, "{}: SSP {version:?}; this host reads SSP 1.0 and 2.0, export it as one of them", root.place());
    Ok(())
}

impl Reader {
    /// Adds an element.
    fn add(&mut self, e: Element, n: &Node) -> Result<usize> {
        let all = self.wiring.elements.len();
        ensure!(
            all < MOST_ELEMENTS,
            "{}: more than {MOST_ELEMENTS} elements; simulate a part of the system",
            n.place()
        );
        self.wiring.elements.push(e);
        Ok(all)
    }

    /// Reads a system; `inherited`: what bindings outside give to names in it, those of more weight later. Its element.
    fn system(&mut self, n: &Node, around: &Around<'_>, inherited: Vec<Bound>) -> Result<usize> {
        ensure!(around.depth < DEEPEST, "{}: more than {DEEPEST} systems inside each other", n.place());
        let mut bound = bindings(n, around.base, None, &mut self.read)?;
        bound.extend(inherited);
        let connectors = connectors(n, around.units)?;
        let mut values = HashMap::new();
        for b in bound.iter().filter(|b| connectors.contains_key(&b.name)) {
            self.read.used(b.id);
            values.insert(b.name.clone(), b.clone());
        }
        let name = if around.path.is_empty() { "the system".to_string() } else { around.path.to_string() };
        let own = self.add(Element { name, component: false, description: None, connectors, values }, n)?;
        let mut dictionaries = around.dictionaries.clone();
        for d in n.listed("SignalDictionaries", "SignalDictionary") {
            let name = d.need("name")?.to_string();
            dictionaries.insert(name.clone(), self.dictionary(&name, d, around)?);
        }
        let mut elements: HashMap<&str, usize> = HashMap::new();
        for c in n.child("Elements").into_iter().flat_map(|e| &e.children) {
            if !matches!(c.name.as_str(), "Component" | "System" | "SignalDictionaryReference") {
                continue;
            }
            let name = c.need("name")?;
            let prefix = format!("{name}.");
            let given = bound.iter().filter_map(|b| {
                let name = b.name.strip_prefix(&prefix)?.to_string();
                Some(Bound { name, ..b.clone() })
            });
            let path = match around.path {
                "" => undotted(name),
                outer => format!("{outer}/{}", undotted(name)),
            };
            let inner = Around { path: &path, dictionaries: dictionaries.clone(), depth: around.depth + 1, ..*around };
            let element = match c.name.as_str() {
                "System" => self.system(c, &inner, given.collect())?,
                "Component" => self.component(c, &inner, given.collect())?,
                _ => {
                    let wanted = c.need("dictionary")?;
                    let found = dictionaries.get(wanted).copied();
                    let found =
                        found.with_context(|| format!("{}: there is no signal dictionary {wanted}", c.place()))?;
                    let more = wiring::connectors(c, around.units)?;
                    // one bus has as many references as there are parts at it: what each of them gives or takes differs
                    let more = more.into_iter().map(|(name, c)| (name, Connector { kind: String::new(), ..c }));
                    self.wiring.elements[found].connectors.extend(more.filter(|c| c.1.unit.is_some()));
                    found
                }
            };
            if elements.insert(name, element).is_some() {
                bail!("{}: two elements are named {name}; give each its own name", c.place());
            }
        }
        for c in n.listed("Connections", "Connection") {
            let port = |element: &str, connector: &str| -> Result<((usize, String), bool)> {
                let connector = c.need(connector)?.to_string();
                match c.attribute(element).filter(|e| !e.is_empty()) {
                    None => Ok(((own, connector), true)),
                    Some(name) => {
                        let mut known: Vec<&str> = elements.keys().copied().collect();
                        known.sort_unstable();
                        let found = elements.get(name).copied().with_context(|| {
                            format!("{}: {}", c.place(), record::words::not_known("element", name, &known))
                        });
                        Ok(((found?, connector), false))
                    }
                }
            };
            let (start, end) = (port("startElement", "startConnector")?, port("endElement", "endConnector")?);
            self.wiring.connect(start, end, c)?;
        }
        Ok(own)
    }

    /// The element of a signal dictionary: what goes into an entry comes out of it.
    fn dictionary(&mut self, name: &str, d: &Node, around: &Around<'_>) -> Result<usize> {
        let file;
        let root = match d.attribute("source") {
            Some(source) => {
                let (name, path) = around.base.path(source, d)?;
                file = Node::read(&path, &name)?;
                Some(&file)
            }
            None => d.child("SignalDictionary"),
        };
        let mut connectors = HashMap::new();
        if let Some(root) = root {
            let units = units(root)?;
            for e in root.all("DictionaryEntry") {
                let unit = e.children.iter().find_map(|t| t.attribute("unit"));
                let unit = unit.map(|u| crate::units::Named { name: u.to_string(), unit: units.get(u).cloned() });
                connectors.insert(e.need("name")?.to_string(), Connector { kind: String::new(), unit });
            }
        }
        let (name, values) = (name.to_string(), HashMap::new());
        self.add(Element { name, component: false, description: None, connectors, values }, d)
    }

    /// Reads a component: an FMU, or an archive or a description of a system of its own.
    fn component(&mut self, c: &Node, around: &Around<'_>, given: Vec<Bound>) -> Result<usize> {
        let (name, file) = around.base.path(c.need("source")?, c)?;
        let ending = Path::new(&name).extension().map(|e| e.to_string_lossy().to_ascii_lowercase());
        let named = c.attribute("type").unwrap_or_default();
        let nested = match (named, ending.as_deref()) {
            ("application/x-ssp-package", _) | (_, Some("ssp")) => {
                let folder =
                    archive::unpack(&file, &archive::SSP).map_err(|why| anyhow!("{}: {name}: {why}", c.place()))?;
                let folder = Arc::new(folder);
                self.keep.push(folder.clone());
                let root = Node::read(&folder.path().join(archive::SSP.needs), archive::SSP.needs)?;
                Some((Base::top(folder.path()), root))
            }
            ("application/x-ssp-definition", _) | (_, Some("ssd")) => {
                Some((around.base.of(&name), Node::read(&file, &name)?))
            }
            _ => None,
        };
        let mut bound = bindings(c, around.base, Some(&file), &mut self.read)?;
        bound.extend(given);
        if let Some((base, root)) = nested {
            description_root(&root)?;
            let system = root.child("System").with_context(|| format!("{name} has no System"))?;
            let units = units(&root)?;
            let dictionaries = around.dictionaries.clone();
            let inner = Around { base: &base, units: &units, dictionaries, ..*around };
            return self.system(system, &inner, bound);
        }
        // what is wrong with the FMU is said where it is opened
        let description = Description::in_archive(&file).ok();
        let mut component = Component::named(around.path.to_string(), file.to_string_lossy().into_owned());
        for b in bound {
            let Some(d) = &description else { continue };
            let Some(v) = d.variable(&b.name) else { continue };
            self.read.used(b.id);
            let computed =
                matches!(v.causality, Causality::Output | Causality::CalculatedParameter | Causality::Independent);
            if computed || v.variability == Variability::Constant {
                let what = format!("{}.{} is no parameter of its FMU", around.path, b.name);
                self.notes.push(format!("{}: {what}, and is not set", b.place));
                continue;
            }
            component.set.insert(b.name.clone(), Spanned::new(0..0, b.taken(d, v, &mut self.notes)?));
        }
        self.components.push(component);
        let (connectors, values) = (connectors(c, around.units)?, HashMap::new());
        let name = around.path.to_string();
        self.add(Element { name, component: true, description, connectors, values }, c)
    }
}

/// Components of a system and of those inside it.
fn components(of: &Node) -> usize {
    of.children.iter().map(|c| usize::from(c.name == "Component") + components(c)).sum()
}

/// Reads an archive. The master is Gauss-Seidel in dependency order; step and tolerance are those of the annotations of
/// OMSimulator or the Open Simulation Platform where there are any.
///
/// # Errors
/// Says what is wrong with the archive, with file and line, and the cure.
pub(super) fn load(path: &Path) -> Result<System> {
    let folder = Arc::new(archive::unpack(path, &archive::SSP).map_err(|why| anyhow!(why))?);
    let root = Node::read(&folder.path().join(archive::SSP.needs), archive::SSP.needs)?;
    description_root(&root)?;
    let system = root.child("System").context("SystemStructure.ssd has no System")?;
    let count = components(system);
    ensure!(
        count <= MOST_FMUS,
        "SystemStructure.ssd: {count} components, more than the {MOST_FMUS} that run here; run the system in parts"
    );
    let base = Base::top(folder.path());
    let units = units(&root)?;
    let mut r = Reader { keep: vec![folder.clone()], ..Reader::default() };
    let top = Around { base: &base, units: &units, path: "", dictionaries: HashMap::new(), depth: 0 };
    r.system(system, &top, Vec::new())?;
    ensure!(!r.components.is_empty(), "SystemStructure.ssd has no Component");
    let (connect, set) = r.wiring.flat(&mut r.notes)?;
    for (element, variable, value, id) in set {
        r.read.used(id);
        let name = &r.wiring.elements[element].name;
        if let Some(c) = r.components.iter_mut().find(|c| c.name.get_ref() == name) {
            c.set.insert(variable, Spanned::new(0..0, value));
        }
    }
    r.notes.extend(r.read.notes());
    let experiment = root.child("DefaultExperiment");
    let time = |name: &str| -> Result<Option<f64>> { experiment.map_or(Ok(None), |e| e.number(name)) };
    let annotated = |element: &str, attribute: &str| root.find(element).map_or(Ok(None), |m| m.number(attribute));
    let stated = match annotated("FixedStepMaster", "stepSize")? {
        None => annotated("FixedStepAlgorithm", "baseStepSize")?,
        step => step,
    };
    let step = stated.filter(|h| *h > 0.0 && h.is_finite());
    if let (Some(h), None) = (stated, step) {
        r.notes.push(format!("its step of {h} s is none, and is left out"));
    }
    let descriptions = r.wiring.elements.iter().filter_map(|e| e.description.as_ref());
    let plain = Master::plain().within(descriptions);
    let start = time("startTime")?.unwrap_or(plain.start);
    let stop = time("stopTime")?.unwrap_or(start + (plain.stop - plain.start));
    let tolerance = annotated("FixedStepMaster", "relativeTolerance")?.filter(|t| *t > 0.0 && *t < 1.0);
    let bare = System::of(r.components, path, &PathBuf::from(folder.path()));
    Ok(System {
        name: system.attribute("name").map(String::from),
        connect,
        master: Master { start, stop, step, tolerance, ..plain },
        notes: r.notes,
        keep: r.keep,
        ..bare
    })
}
