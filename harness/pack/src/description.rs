//! The description: read against the variable table, written with start values.

use super::Model;
use anyhow::{bail, ensure, Context, Result};
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, Writer, XmlVersion};

impl Model {
    /// The description with its GUID and start values.
    pub(super) fn described(&self, guid: &str, values: &[f64]) -> Result<String> {
        let mut reader = Reader::from_str(self.description);
        let mut writer = Writer::new(Vec::new());
        let mut parameter = None;
        loop {
            let event = reader.read_event()?;
            let written = match &event {
                Event::Eof => break,
                Event::Start(t) if t.name().as_ref() == "fmiModelDescription" => {
                    Event::Start(with_attribute(t, "guid", guid)?)
                }
                Event::Start(t) if t.name().as_ref() == "ScalarVariable" => {
                    parameter = attribute(t, "name")?.and_then(|n| self.place(&n));
                    event
                }
                Event::Empty(t) if matches!(t.name().as_ref(), "Real" | "Integer") => match parameter {
                    Some(i) => Event::Empty(with_attribute(t, "start", &format!("{}", Number(values[i])))?),
                    None => event,
                },
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

/// A tag with one attribute's value changed, the rest in place.
fn with_attribute(tag: &BytesStart<'_>, name: &str, value: &str) -> Result<BytesStart<'static>> {
    let mut o = BytesStart::new(tag.name().as_ref().to_string());
    for a in tag.attributes() {
        let a = a?;
        let key = a.key.as_ref().to_string();
        if key == name {
            o.push_attribute((name, value));
        } else {
            o.push_attribute((key.as_str(), &*a.normalized_value(XmlVersion::Implicit1_0)?));
        }
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
    fn the_description_agrees_with_the_table_and_disagreement_is_named() {
        let element = Model::contact();
        element.check(DESCRIPTION).unwrap();
        let bar = Model::moving_bar();
        bar.check(bar.description).unwrap();
        let e = bar.check(&bar.description.replacen("unit=\"kg\"", "unit=\"g\"", 1)).unwrap_err().to_string();
        assert!(e.contains("mass"), "{e}");
        for (from, to, named) in [
            ("\"hysteresis_damping\"", "\"hysteresis_dampinG\"", "hysteresis_dampinG"),
            ("unit=\"J\"", "unit=\"N\"", "stored_energy"),
            ("start=\"1e8\"", "start=\"1e9\"", "stiffness"),
            ("valueReference=\"122\"", "valueReference=\"121\"", "effective_mass"),
            ("logContact", "logFoo", "logFoo"),
        ] {
            let e = element.check(&DESCRIPTION.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(e.contains(named), "{e}");
        }
    }
}
