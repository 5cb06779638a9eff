//! Values of parameters: sets (SSV), mappings (SSM), transformations, and what they are in the FMU that takes them.

use super::node::Node;
use super::place::Base;
use crate::archive;
use crate::description::{Description, Unit, Variable};
use crate::units::{conversion, Named};
use crate::value::Value;
use crate::Kind;
use anyhow::{anyhow, bail, ensure, Context, Result};
use std::collections::HashMap;
use std::path::Path;

/// A transformation of values (SSP 1.0 section 4.4.2).
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Transform {
    Linear { factor: f64, offset: f64 },
    Map(Vec<(Value, Value)>),
}

impl Transform {
    /// That of a connection or of an entry of a mapping.
    pub fn of(n: &Node) -> Result<Option<Transform>> {
        for c in &n.children {
            let entry: fn(&Node, &str) -> Result<Value> = match c.name.as_str() {
                "LinearTransformation" => {
                    let (factor, offset) = (c.number("factor")?.unwrap_or(1.0), c.number("offset")?.unwrap_or(0.0));
                    return Ok(Some(Transform::Linear { factor, offset }));
                }
                "BooleanMappingTransformation" => |e, side| Ok(Value::Boolean(matches!(e.need(side)?, "true" | "1"))),
                "IntegerMappingTransformation" => |e, side| {
                    let text = e.need(side)?;
                    let number = text.trim().parse();
                    Ok(Value::Integer(number.with_context(|| format!("{}: \"{text}\" is no Integer", e.place()))?))
                },
                "EnumerationMappingTransformation" => |e, side| Ok(Value::Text(e.need(side)?.to_string())),
                _ => continue,
            };
            let map = c.all("MapEntry").map(|e| Ok((entry(e, "source")?, entry(e, "target")?)));
            return Ok(Some(Transform::Map(map.collect::<Result<_>>()?)));
        }
        Ok(None)
    }

    pub fn apply(&self, v: Value, items: &[(String, i32)]) -> Result<Value, String> {
        match self {
            Transform::Linear { factor, offset } => match v {
                Value::Real(x) => Ok(Value::Real(factor * x + offset)),
                // a whole number for a Real
                Value::Integer(n) => Ok(Value::Real(factor * n as f64 + offset)),
                v => Err(format!("{v} has no linear transformation")),
            },
            Transform::Map(map) => {
                // an Enumeration may be mapped by its numbers too
                let number = |v: &Value| match v {
                    Value::Text(t) => items.iter().find(|i| i.0 == *t).map(|i| Value::Integer(i64::from(i.1))),
                    _ => None,
                };
                let same = |a: &Value| *a == v || number(&v).is_some_and(|n| n == *a);
                Ok(map.iter().find(|m| same(&m.0)).map_or(v.clone(), |m| m.1.clone()))
            }
        }
    }
}

/// Units by name, of an archive's file.
pub(super) fn units(root: &Node) -> Result<HashMap<String, Unit>> {
    let mut all = HashMap::new();
    for u in root.listed("Units", "Unit") {
        let Some(base) = u.child("BaseUnit") else { continue };
        let unit = Unit::of(&mut base.attributes.clone()).map_err(|why| anyhow!("{}: {why}", base.place()))?;
        all.insert(u.need("name")?.to_string(), unit);
    }
    Ok(all)
}

/// A value that a binding gives to a name.
#[derive(Clone, Debug)]
pub(super) struct Bound {
    /// Hierarchical name, as seen where it is looked for.
    pub name: String,
    pub value: Value,
    /// Of an Enumeration, the number that its file gives the item.
    pub number: Option<i64>,
    pub unit: Option<Named>,
    /// Whether units are let be.
    pub suppress: bool,
    pub transforms: Vec<Transform>,
    /// File and line.
    pub place: String,
    /// The parameter it comes from, for those that come to nothing.
    pub id: usize,
}

/// The parameters that bindings were read from: file, name, and whether they have come to something.
#[derive(Default)]
pub(super) struct Read(Vec<(String, String, bool)>);

impl Read {
    pub fn used(&mut self, id: usize) {
        self.0[id].2 = true;
    }

    /// A note for each file whose parameters name nothing.
    pub fn notes(&self) -> Vec<String> {
        const MOST: usize = 5;
        let mut files: Vec<(&str, Vec<&str>)> = Vec::new();
        for (file, name, _) in self.0.iter().filter(|r| !r.2) {
            match files.iter_mut().find(|f| f.0 == file) {
                Some(f) => f.1.push(name),
                None => files.push((file, vec![name])),
            }
        }
        let note = |(file, names): (&str, Vec<&str>)| {
            let more = names.len().saturating_sub(MOST);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let shown = names[..names.len().min(MOST)].join(", ");
            format!("{file}: {shown}{more}: the system has no parameter of that name, so it is not set")
        };
        files.into_iter().map(note).collect()
    }
}

/// The root of what a source of a binding refers to: a file of the archive, or of the FMU of a component.
fn source(n: &Node, base: &Base, component: Option<&Path>) -> Result<Option<(String, Node)>> {
    let Some(source) = n.attribute("source") else { return Ok(None) };
    if n.attribute("sourceBase") == Some("component") {
        let fmu = component.with_context(|| format!("{}: sourceBase=\"component\" of no component", n.place()))?;
        let inside = source.trim_start_matches("./");
        let bytes = archive::entry(fmu, inside).map_err(|why| anyhow!("{}: {}: {why}", n.place(), fmu.display()))?;
        return Ok(Some((inside.to_string(), Node::of_bytes(bytes, inside)?)));
    }
    let (name, path) = base.path(source, n)?;
    let root = Node::read(&path, &name)?;
    Ok(Some((name, root)))
}

/// The parameters of a set, with `prefix` before their names.
fn set(set: &Node, file: &str, prefix: &str, read: &mut Read) -> Result<Vec<Bound>> {
    let units = units(set)?;
    let item = |name: &str| {
        let mut items = set.listed("Enumerations", "Enumeration").flat_map(|e| e.all("Item"));
        items.find(|i| i.attribute("name") == Some(name))?.attribute("value")?.trim().parse().ok()
    };
    let mut found = Vec::new();
    for p in set.listed("Parameters", "Parameter") {
        let name = format!("{prefix}{}", p.need("name")?);
        ensure!(
            p.child("Dimension").is_none(),
            "{}: {name} is an array, which FMI 2.0 has not; leave it out",
            p.place()
        );
        let typed = p.children.iter().find(|c| !matches!(c.name.as_str(), "Annotations" | "MetaData" | "Signature"));
        let Some(v) = typed else { continue };
        let text = v.need("value")?;
        let wrong = || format!("{}: parameter {name}: \"{text}\" is no {}", v.place(), v.name);
        let mut number = None;
        let value = match v.name.as_str() {
            "Real" | "Float64" | "Float32" => Value::Real(text.trim().parse().with_context(wrong)?),
            "Integer" | "Int8" | "UInt8" | "Int16" | "UInt16" | "Int32" | "UInt32" | "Int64" | "UInt64" => {
                Value::Integer(text.trim().parse().with_context(wrong)?)
            }
            "Boolean" => match text.trim() {
                "true" | "1" => Value::Boolean(true),
                "false" | "0" => Value::Boolean(false),
                _ => bail!(wrong()),
            },
            "String" => Value::Text(text.to_string()),
            "Enumeration" => {
                number = item(text);
                Value::Text(text.to_string())
            }
            other => bail!("{}: parameter {name} is of type {other}, which FMI 2.0 has not; leave it out", v.place()),
        };
        let named = |u: &str| Named { name: u.to_string(), unit: units.get(u).cloned() };
        let unit = v.attribute("unit").filter(|u| !u.trim().is_empty()).map(named);
        let id = read.0.len();
        read.0.push((file.to_string(), name.clone(), false));
        let place = p.place();
        found.push(Bound { name, value, number, unit, suppress: false, transforms: vec![], place, id });
    }
    Ok(found)
}

/// What the entries of a mapping make of parameters: those that none names are not applied.
fn mapped(mapping: &Node, from: Vec<Bound>) -> Result<Vec<Bound>> {
    let mut found = Vec::new();
    for e in mapping.all("MappingEntry") {
        let (source, target) = (e.need("source")?, e.need("target")?);
        for b in from.iter().filter(|b| b.name == source) {
            let transforms = Transform::of(e)?.into_iter().collect();
            let suppress = e.flag("suppressUnitConversion");
            found.push(Bound { name: target.to_string(), transforms, suppress, ..b.clone() });
        }
    }
    Ok(found)
}

/// The parameters that bindings of a system or component give, those of more weight later.
///
/// # Errors
/// What is wrong with a file: its name and line, and the cure.
pub(super) fn bindings(n: &Node, base: &Base, component: Option<&Path>, read: &mut Read) -> Result<Vec<Bound>> {
    const SET: &str = "application/x-ssp-parameter-set";
    let mut found = Vec::new();
    for b in n.listed("ParameterBindings", "ParameterBinding") {
        if let Some(other) = b.attribute("type").filter(|t| !t.is_empty() && *t != SET) {
            bail!("{}: parameters of type {other}; give them as {SET}", b.place());
        }
        let file = source(b, base, component)?;
        let inline = b.child("ParameterValues").and_then(|v| v.child("ParameterSet"));
        let (name, root) = match (&file, inline) {
            (Some((name, root)), _) => (name.clone(), root),
            (None, Some(root)) => (b.place(), root),
            (None, None) => continue,
        };
        let start = read.0.len();
        let mut all = set(root, &name, b.attribute("prefix").unwrap_or_default(), read)?;
        if let Some(m) = b.child("ParameterMapping") {
            let file = source(m, base, component)?;
            let inline = m.child("ParameterMapping");
            if let Some(entries) = file.as_ref().map(|f| &f.1).or(inline) {
                all = mapped(entries, all)?;
                // what a mapping leaves out is left out on purpose
                let kept: Vec<usize> = all.iter().map(|b| b.id).collect();
                (start..read.0.len()).filter(|id| !kept.contains(id)).for_each(|id| read.0[id].2 = true);
            }
        }
        found.extend(all);
    }
    Ok(found)
}

impl Bound {
    /// The value as variable `v` takes it, in its unit.
    ///
    /// # Errors
    /// A unit that cannot be converted, a transformation of what has none: with the place.
    pub fn taken(&self, d: &Description, v: &Variable, notes: &mut Vec<String>) -> Result<Value> {
        let at = |why: String| anyhow!("{}: parameter {}: {why}", self.place, self.name);
        let mut value = self.value.clone();
        if let (Some(unit), false, Some(x)) = (&self.unit, self.suppress, real(&value)) {
            match d.unit_of(v) {
                Some(to) => {
                    let (factor, offset) = conversion(unit, &to, v.relative)
                        .map_err(|why| at(format!("its unit and that of {} are {why}; correct it", v.name)))?;
                    if (factor, offset) != (1.0, 0.0) {
                        value = Value::Real(factor * x + offset);
                    }
                }
                None => notes.push(format!(
                    "{}: {} is {x} {}, and {} has no unit: the number is set as it is",
                    self.place, self.name, unit.name, v.name
                )),
            }
        }
        for t in &self.transforms {
            value = t.apply(value, &v.items).map_err(at)?;
        }
        Ok(self.fitted(value, v))
    }

    /// The number of an Enumeration's item where the variable does not know the item by its name.
    pub fn fitted(&self, value: Value, v: &Variable) -> Value {
        let named = matches!(&value, Value::Text(t) if v.items.iter().any(|i| i.0 == *t));
        match self.number {
            Some(n) if !named && matches!(v.kind, Kind::Enumeration | Kind::Integer) && value == self.value => {
                Value::Integer(n)
            }
            _ => value,
        }
    }
}

/// The number of what may have a unit.
pub(super) fn real(v: &Value) -> Option<f64> {
    match v {
        Value::Real(x) => Some(*x),
        Value::Integer(n) => Some(*n as f64),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_changes_what_it_lists_and_nothing_else() {
        let n = Node::parse(
            "<e><IntegerMappingTransformation><MapEntry source=\"1\" target=\"4\"/></IntegerMappingTransformation></e>",
            "x.ssm",
        );
        let t = Transform::of(&n.unwrap()).unwrap().unwrap();
        assert_eq!(t.apply(Value::Integer(1), &[]), Ok(Value::Integer(4)));
        assert_eq!(t.apply(Value::Integer(2), &[]), Ok(Value::Integer(2)));
        // an item by its number
        assert_eq!(t.apply(Value::Text("open".into()), &[("open".into(), 1)]), Ok(Value::Integer(4)));
        let linear = Transform::Linear { factor: 2.0, offset: 1.0 };
        assert_eq!(linear.apply(Value::Real(3.0), &[]), Ok(Value::Real(7.0)));
        assert!(linear.apply(Value::Boolean(true), &[]).is_err());
    }

    #[test]
    fn a_mapping_applies_what_it_names_under_the_new_name_alone() {
        let text = "<m><MappingEntry source=\"p.k\" target=\"a.k\"/><MappingEntry source=\"p.k\" target=\"b.k\"/></m>";
        let mapping = Node::parse(text, "x.ssm").unwrap();
        let text = "<ParameterSet><Parameters><Parameter name=\"k\"><Real value=\"2\"/></Parameter>\
                    <Parameter name=\"m\"><Float64 value=\"3\"/></Parameter></Parameters></ParameterSet>";
        let mut read = Read::default();
        let all = set(&Node::parse(text, "x.ssv").unwrap(), "x.ssv", "p.", &mut read).unwrap();
        assert_eq!(all.iter().map(|b| b.name.as_str()).collect::<Vec<_>>(), ["p.k", "p.m"]);
        let all = mapped(&mapping, all).unwrap();
        assert_eq!(all.iter().map(|b| b.name.as_str()).collect::<Vec<_>>(), ["a.k", "b.k"]);
        assert!(all.iter().all(|b| b.value == Value::Real(2.0)));
        assert_eq!(read.notes().len(), 1);
    }
}
