//! The description: read against the variable table, written with start values.

use super::{Label, Model};
use anyhow::{bail, ensure, Context, Result};
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, Writer, XmlVersion};

impl Model {
    /// The description with its GUID and start values, and what `label` holds. A start value other than 0 is a
    /// parameter's nominal value too.
    pub(super) fn described(&self, guid: &str, values: &[f64], label: &Label) -> Result<String> {
        let head = label.attributes(self.name, guid);
        let mut reader = Reader::from_str(self.description);
        let mut writer = Writer::new(Vec::new());
        let (mut parameter, mut nominal) = (None, None);
        loop {
            let event = reader.read_event()?;
            let written = match &event {
                Event::Eof => break,
                Event::Start(t) if t.name().as_ref() == "fmiModelDescription" => {
                    Event::Start(with_attributes(t, &head)?)
                }
                Event::Start(t) if t.name().as_ref() == "ScalarVariable" => {
                    let name = attribute(t, "name")?.unwrap_or_default();
                    parameter = self.place(&name);
                    let known = label.nominals.iter().find(|(n, _)| *n == name).map(|n| n.1);
                    nominal = known.or(parameter.map(|i| values[i].abs())).filter(|v| v.is_finite() && *v > 0.0);
                    event
                }
                Event::Empty(t) if matches!(t.name().as_ref(), "Real" | "Enumeration") => {
                    let mut changed = Vec::new();
                    if let Some(i) = parameter {
                        changed.push(("start", Number(values[i]).to_string()));
                    }
                    if let Some(v) = nominal.filter(|_| t.name().as_ref() == "Real") {
                        changed.push(("nominal", Number(v).to_string()));
                    }
                    Event::Empty(with_attributes(t, &changed)?)
                }
                _ => event,
            };
            writer.write_event(written)?;
        }
        Ok(String::from_utf8(writer.into_inner())?)
    }

    /// Holds a description against the variable table.
    ///
    /// # Errors
    /// The first thing at odds: a variable, its reference, type or unit, a log category, the model's name.
    pub fn check(&self, source: &str) -> Result<()> {
        let mut reader = Reader::from_str(source);
        let mut seen: Vec<(String, u32, bool)> = Vec::new();
        let mut categories = Vec::new();
        loop {
            match reader.read_event()? {
                Event::Eof => break,
                Event::Start(t) | Event::Empty(t) => match t.name().as_ref() {
                    "CoSimulation" => {
                        let id = attribute(&t, "modelIdentifier")?;
                        let name = self.name;
                        ensure!(id.as_deref() == Some(name), "modelIdentifier is {id:?}, the library is {name}");
                    }
                    "Category" => categories.extend(attribute(&t, "name")?),
                    "ScalarVariable" => {
                        let name = attribute(&t, "name")?.context("a ScalarVariable has no name")?;
                        let reference = attribute(&t, "valueReference")?.unwrap_or_default();
                        let reference = reference.parse().with_context(|| format!("{name}: valueReference"))?;
                        let tunable = attribute(&t, "variability")?.as_deref() == Some("tunable");
                        seen.push((name, reference, tunable));
                    }
                    kind @ ("Real" | "Integer" | "Boolean" | "String" | "Enumeration") => {
                        let Some((name, reference, tunable)) = seen.last() else { continue };
                        let Some(e) = self.table.iter().find(|e| e.reference == *reference && e.name == name) else {
                            bail!("{name} with value reference {reference} is not in the variable table");
                        };
                        ensure!(e.kind == kind, "{name} is {} in the table", e.kind);
                        let unit = attribute(&t, "unit")?.unwrap_or_default();
                        ensure!(unit == e.unit, "{name} has unit {unit:?}, in the table {:?}", e.unit);
                        let nominal = attribute(&t, "nominal")?.map_or(Ok(0.0), |n| n.parse::<f64>())?;
                        ensure!((nominal > 0.0) == (kind == "Real"), "{name} has nominal value {nominal}");
                        if let Some((i, may)) = e.parameter {
                            ensure!(*tunable == may, "{name}: variability and table are at odds");
                            let start: f64 = attribute(&t, "start")?.unwrap_or_default().parse().context(e.name)?;
                            let wanted = self.defaults[i];
                            ensure!(start == wanted, "{name} starts at {start}, in the library at {wanted}");
                        }
                    }
                    _ => {}
                },
                _ => {}
            }
        }
        for e in &self.table {
            ensure!(seen.iter().filter(|(n, _, _)| n == e.name).count() == 1, "{} is not there once", e.name);
        }
        ensure!(
            categories == self.categories,
            "log categories are {categories:?}, in the library {:?}",
            self.categories
        );
        Ok(())
    }
}

/// A tag with some attributes' values changed, the rest in place; those it has not stand after them.
fn with_attributes(tag: &BytesStart<'_>, changed: &[(&str, String)]) -> Result<BytesStart<'static>> {
    let mut o = BytesStart::new(tag.name().as_ref().to_string());
    let mut left: Vec<&(&str, String)> = changed.iter().collect();
    for a in tag.attributes() {
        let a = a?;
        let key = a.key.as_ref().to_string();
        match left.iter().position(|c| c.0 == key) {
            Some(i) => o.push_attribute((key.as_str(), left.remove(i).1.as_str())),
            None => o.push_attribute((key.as_str(), &*a.normalized_value(XmlVersion::Implicit1_0)?)),
        }
    }
    for (name, value) in left {
        o.push_attribute((*name, value.as_str()));
    }
    Ok(o)
}

fn attribute(tag: &BytesStart<'_>, name: &str) -> Result<Option<String>> {
    Ok(match tag.try_get_attribute(name)? {
        Some(a) => Some(a.normalized_value(XmlVersion::Implicit1_0)?.into_owned()),
        None => None,
    })
}

/// A number that reads back to the same bits, with an exponent where it is shorter.
pub(super) struct Number(pub f64);

impl std::fmt::Display for Number {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (plain, exponent) = (format!("{}", self.0), format!("{:e}", self.0));
        f.write_str(if exponent.len() < plain.len() { &exponent } else { &plain })
    }
}

#[cfg(test)]
mod tests {
    use super::super::DESCRIPTION;
    use super::*;

    #[test]
    fn groups_hold_parameters_and_none_twice() {
        for (_, model) in Model::all() {
            let groups = model.description.split(" variables=\"").skip(1);
            let names: Vec<&str> = groups.flat_map(|g| g.split('"').next().unwrap().split(' ')).collect();
            assert!(names.len() > 8, "{}", model.name);
            for (i, name) in names.iter().enumerate() {
                assert!(model.place(name).is_some() && !names[..i].contains(name), "{name}");
            }
        }
    }

    #[test]
    fn the_description_agrees_with_the_table_and_disagreement_is_named() {
        let element = Model::contact();
        element.check(DESCRIPTION).unwrap();
        for (_, model) in Model::all() {
            model.check(model.description).unwrap();
        }
        let bar = Model::moving_bar();
        let e = bar.check(&bar.description.replacen("unit=\"kg\"", "unit=\"g\"", 1)).unwrap_err().to_string();
        assert!(e.contains("mass"), "{e}");
        for (from, to, named) in [
            ("\"hysteresis_damping\" value", "\"hysteresis_dampinG\" value", "hysteresis_dampinG"),
            ("unit=\"J\"", "unit=\"N\"", "stored_energy"),
            ("start=\"1e8\"", "start=\"1e9\"", "stiffness"),
            ("valueReference=\"122\"", "valueReference=\"121\"", "effective_mass"),
            ("logContact", "logFoo", "logFoo"),
            (" nominal=\"1e3\"", "", "force has nominal value 0"),
        ] {
            let e = element.check(&DESCRIPTION.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(e.contains(named), "{e}");
        }
    }
}
