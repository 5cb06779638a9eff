//! Systems inside systems made flat: which component's output feeds which component's input, through the connectors of systems
//! and of signal dictionaries between them, and what unit, factor and offset a value has come to on the way.

use super::node::Node;
use super::values::{real, Bound, Transform};
use crate::description::{Description, Unit, Variable};
use crate::master::build::conversion as between;
use crate::master::system::Connection;
use crate::units::{conversion, Named};
use crate::value::Value;
use crate::Causality;
use anyhow::{anyhow, bail, Result};
use std::collections::HashMap;

/// A connector as the archive declares it.
#[derive(Clone, Debug, Default)]
pub(super) struct Connector {
    /// input, output and so on; empty: not said.
    pub kind: String,
    pub unit: Option<Named>,
}

/// What has connectors.
pub(super) struct Element {
    /// The name of its FMU in the flat system; of a system or a signal dictionary its path, for messages.
    pub name: String,
    /// Whether it is a component.
    pub component: bool,
    pub description: Option<Description>,
    pub connectors: HashMap<String, Connector>,
    /// Values that bindings give to connectors of a system.
    pub values: HashMap<String, Bound>,
}

impl Element {
    fn variable(&self, connector: &str) -> Option<(&Description, &Variable)> {
        let d = self.description.as_ref()?;
        d.variable(connector).map(|v| (d, v))
    }

    /// Unit of a connector: that of the FMU's variable, else what the archive declares; one that is defined before one that is
    /// only named.
    fn unit(&self, connector: &str) -> Option<Named> {
        let own = self.variable(connector).and_then(|(d, v)| d.unit_of(v));
        let declared = self.connectors.get(connector).and_then(|c| c.unit.clone());
        let defined = |u: &Option<Named>| u.clone().filter(|u| u.unit.is_some());
        defined(&own).or(defined(&declared)).or(own).or(declared)
    }

    /// Whether data flows out of a connector into the connection; None where nothing says so. `inner`: the connection is
    /// inside the element.
    fn gives(&self, connector: &str, inner: bool) -> Option<bool> {
        let outward = match self.variable(connector).map(|(_, v)| v.causality) {
            Some(Causality::Input | Causality::Parameter) => false,
            Some(_) => true,
            None => match self.connectors.get(connector)?.kind.as_str() {
                "output" | "calculatedParameter" | "constant" | "local" => true,
                "input" | "parameter" | "structuralParameter" => false,
                _ => return None,
            },
        };
        Some(outward != inner)
    }
}

/// A connector of an element.
pub(super) type Port = (usize, String);

/// A connection, in the direction in which data flows.
struct Edge {
    from: Port,
    to: Port,
    suppress: bool,
    transform: Option<Transform>,
    place: String,
}

/// Every element and connection, of all levels.
#[derive(Default)]
pub(super) struct Wiring {
    pub elements: Vec<Element>,
    edges: Vec<Edge>,
}

/// The connectors that an element of the archive declares.
pub(super) fn connectors(n: &Node, units: &HashMap<String, Unit>) -> Result<HashMap<String, Connector>> {
    let mut all = HashMap::new();
    for c in n.listed("Connectors", "Connector") {
        let unit = c.children.iter().find_map(|t| t.attribute("unit")).filter(|u| !u.trim().is_empty());
        let unit = unit.map(|u| Named { name: u.to_string(), unit: units.get(u).cloned() });
        all.insert(
            c.need("name")?.to_string(),
            Connector { kind: c.attribute("kind").unwrap_or_default().into(), unit },
        );
    }
    Ok(all)
}

/// What a value has come to on its way: factor * value + offset, in a unit, by a map.
#[derive(Default)]
struct Way {
    factor: f64,
    offset: f64,
    unit: Option<Named>,
    map: Vec<(Value, Value)>,
}

impl Wiring {
    /// Adds a connection between two ports, each with whether the connection is inside its element. Start and end say nothing
    /// of the direction: the kinds of the connectors do.
    ///
    /// # Errors
    /// A connection of array elements.
    pub fn connect(&mut self, start: (Port, bool), end: (Port, bool), n: &Node) -> Result<()> {
        if ["startIndices", "endIndices"].iter().any(|i| n.attribute(i).is_some()) {
            bail!("{}: a connection of array elements, which FMI 2.0 has not; export it with scalars", n.place());
        }
        let gives = |(port, inner): &(Port, bool)| self.elements[port.0].gives(&port.1, *inner);
        let ends = (gives(&start), gives(&end));
        let back = matches!(ends, (Some(false), Some(true) | None) | (None, Some(true)));
        let (from, to) = if back { (end.0, start.0) } else { (start.0, end.0) };
        let (suppress, transform) = (n.flag("suppressUnitConversion"), Transform::of(n)?);
        self.edges.push(Edge { from, to, suppress, transform, place: n.place() });
        Ok(())
    }

    fn named(&self, p: &Port) -> String {
        format!("{}.{}", self.elements[p.0].name, p.1)
    }

    /// Connections that lead to a port, the first one first, and the port that they begin at.
    ///
    /// # Errors
    /// Connections that lead round, or two into one port.
    fn way_to(&self, e: usize, into: &HashMap<&Port, Vec<usize>>) -> Result<(Vec<usize>, &Port)> {
        let mut way = vec![e];
        let mut at = &self.edges[e].from;
        while !self.elements[at.0].component {
            let Some([before, more @ ..]) = into.get(at).map(Vec::as_slice) else { break };
            let before = *before;
            if let Some(other) = more.first() {
                let place = &self.edges[*other].place;
                bail!("{place}: {} is connected twice; leave one connection out", self.named(at));
            }
            if way.contains(&before) {
                bail!("{}: the connections lead round without a component", self.edges[before].place);
            }
            way.insert(0, before);
            at = &self.edges[before].from;
        }
        Ok((way, at))
    }

    /// What becomes of a value in `unit` on `way`; of what is no difference of values (`relative`) offsets of units count.
    fn along(&self, way: &[usize], unit: Option<Named>, relative: bool, notes: &mut Vec<String>) -> Result<Way> {
        let mut w = Way { factor: 1.0, unit, ..Way::default() };
        for e in way.iter().map(|e| &self.edges[*e]) {
            let to = self.elements[e.to.0].unit(&e.to.1);
            if let (Some(a), Some(b), false) = (&w.unit, &to, e.suppress) {
                let (factor, offset) = conversion(a, b, relative).unwrap_or_else(|why| {
                    let what = format!("{} -> {}", self.named(&e.from), self.named(&e.to));
                    notes.push(format!("{}: {what}: their units are {why}: the number goes as it is", e.place));
                    (1.0, 0.0)
                });
                (w.factor, w.offset) = (factor * w.factor, factor * w.offset + offset);
            }
            match &e.transform {
                Some(Transform::Linear { factor, offset }) => {
                    (w.factor, w.offset) = (factor * w.factor, factor * w.offset + offset);
                }
                Some(Transform::Map(map)) => {
                    let next = Transform::Map(map.clone());
                    let mut all = Vec::new();
                    for (from, to) in std::mem::take(&mut w.map) {
                        let to = next.apply(to, &[]).map_err(|why| anyhow!("{}: {why}", e.place))?;
                        all.push((from, to));
                    }
                    let listed = |v: &Value| all.iter().any(|m: &(Value, Value)| m.0 == *v);
                    let more: Vec<_> = map.iter().filter(|m| !listed(&m.0)).cloned().collect();
                    all.extend(more);
                    w.map = all;
                }
                None => {}
            }
            // a connector without a unit has that of what feeds it
            w.unit = to.or(if e.suppress { None } else { w.unit });
        }
        Ok(w)
    }

    /// The connections of the flat system, and what values of systems' connectors set of components: element, variable, value
    /// and the parameter it is from.
    ///
    /// # Errors
    /// Connections that lead round, two into one port, a value that cannot be transformed: with the place.
    #[allow(clippy::type_complexity)]
    pub fn flat(&self, notes: &mut Vec<String>) -> Result<(Vec<Connection>, Vec<(usize, String, Value, usize)>)> {
        let (mut connections, mut set) = (Vec::new(), Vec::new());
        let mut into: HashMap<&Port, Vec<usize>> = HashMap::new();
        for (i, e) in self.edges.iter().enumerate() {
            into.entry(&e.to).or_default().push(i);
        }
        for (i, last) in self.edges.iter().enumerate().filter(|(_, e)| self.elements[e.to.0].component) {
            let (way, from) = self.way_to(i, &into)?;
            let sink = self.elements[last.to.0].variable(&last.to.1);
            if !self.elements[from.0].component {
                // nothing feeds it but what a binding gives to a connector on the way
                let ports = way.iter().map(|e| &self.edges[*e].from).enumerate();
                let bound = ports.filter_map(|(i, p)| Some((i, self.elements[p.0].values.get(&p.1)?))).next();
                let (Some((start, bound)), Some((_, v))) = (bound, sink) else { continue };
                let value = self.value_along(&way[start..], bound, v, notes)?;
                set.push((last.to.0, last.to.1.clone(), value, bound.id));
                continue;
            }
            let source = self.elements[from.0].variable(&from.1);
            let plain = Connection::plain(self.named(from), self.named(&last.to));
            let declared = |p: &Port| {
                let e = &self.elements[p.0];
                e.variable(&p.1).is_some_and(|(d, v)| e.unit(&p.1) == d.unit_of(v))
            };
            let alone = way.len() == 1 && (last.suppress || (declared(from) && declared(&last.to)));
            if alone {
                // the units are the FMUs' own: what is written is what there is
                connections.push(match last.transform.clone() {
                    None => Connection { suppress_unit_conversion: last.suppress, ..plain },
                    Some(Transform::Linear { factor, offset }) => {
                        Connection { factor, offset, suppress_unit_conversion: last.suppress, ..plain }
                    }
                    Some(Transform::Map(map)) => Connection { map, ..plain },
                });
                continue;
            }
            let relative = [source, sink].into_iter().flatten().any(|(_, v)| v.relative);
            let w = self.along(&way, self.elements[from.0].unit(&from.1), relative, notes)?;
            let default = match (source, sink) {
                (Some(a), Some(b)) => between(a, b).ok(),
                _ => None,
            };
            connections.push(if default == Some((w.factor, w.offset)) {
                Connection { map: w.map, ..plain }
            } else {
                let (factor, offset, map) = (w.factor, w.offset, w.map);
                Connection { factor, offset, map, suppress_unit_conversion: true, ..plain }
            });
        }
        Ok((connections, set))
    }

    /// What a value bound to a connector is at the end of a way, for variable `v` there.
    fn value_along(&self, way: &[usize], bound: &Bound, v: &Variable, notes: &mut Vec<String>) -> Result<Value> {
        let at = |why: String| anyhow!("{}: parameter {}: {why}", bound.place, bound.name);
        let mut value = bound.value.clone();
        let own = way.first().and_then(|e| {
            let from = &self.edges[*e].from;
            self.elements[from.0].unit(&from.1)
        });
        let mut unit = own.clone();
        match (&bound.unit, own, real(&value)) {
            (Some(a), Some(b), Some(x)) if !bound.suppress => {
                let (factor, offset) = conversion(a, &b, v.relative)
                    .map_err(|why| at(format!("its unit and that of the connector are {why}; correct it")))?;
                value = Value::Real(factor * x + offset);
            }
            (Some(a), None, _) => unit = Some(a.clone()),
            _ => {}
        }
        for t in &bound.transforms {
            value = t.apply(value, &v.items).map_err(at)?;
        }
        let w = self.along(way, unit, v.relative, notes)?;
        if (w.factor, w.offset) != (1.0, 0.0) {
            let linear = Transform::Linear { factor: w.factor, offset: w.offset };
            value = linear.apply(value, &v.items).map_err(at)?;
        }
        let value = Transform::Map(w.map).apply(value, &v.items).map_err(at)?;
        Ok(bound.fitted(value, v))
    }
}
