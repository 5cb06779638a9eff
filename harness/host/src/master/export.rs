//! SSP archives out, by the schema of SSP 1.0: a system that other hosts load and run as it stands.
//!
//! Not every host applies parameter bindings, so our own FMUs are packed with their values inside; for others the
//! bindings stand in the description. The step stands in the OMSimulator annotation, which libcosim and ecos read too.

use super::build::{build, file_of};
use super::system::{Connection, System};
use crate::description::{Description, Kind, Variable};
use crate::value::Value;
use anyhow::{bail, Context, Result};
use pack::Model;
use quick_xml::escape::escape;
use std::fmt::Write as _;
use std::io::{Cursor, Write};
use std::path::Path;

/// Tolerance in the annotation where nothing says another: OMSimulator's own.
const TOLERANCE: f64 = 1e-4;

/// What a value of a variable is as an SSP parameter: type and text.
fn parameter(variable: Option<&Variable>, v: &Value) -> (&'static str, String) {
    let kind = variable.map(|v| v.kind);
    match (v, kind) {
        (Value::Boolean(b), _) => ("Boolean", b.to_string()),
        (Value::Integer(n), Some(Kind::Boolean)) => ("Boolean", (*n != 0).to_string()),
        (Value::Integer(n), Some(Kind::Integer)) => ("Integer", n.to_string()),
        (Value::Real(x), Some(Kind::Integer)) => ("Integer", format!("{x:.0}")),
        (Value::Integer(n), Some(Kind::Enumeration)) => item(variable, *n as f64),
        (Value::Real(x), Some(Kind::Enumeration)) => item(variable, *x),
        (Value::Integer(n), _) => ("Real", n.to_string()),
        (Value::Real(x), _) => ("Real", format!("{x:e}")),
        (Value::Text(t), Some(Kind::Enumeration)) => ("Enumeration", t.clone()),
        (Value::Text(t), _) => ("String", t.clone()),
    }
}

/// An Enumeration's item by its number, else the number.
fn item(variable: Option<&Variable>, n: f64) -> (&'static str, String) {
    let items = variable.map_or(&[][..], |v| v.items.as_slice());
    match items.iter().find(|i| f64::from(i.1) == n) {
        Some((name, _)) => ("Enumeration", name.clone()),
        None => ("Integer", format!("{n:.0}")),
    }
}

/// Enumerations of the connectors, each once: name and items.
#[derive(Default)]
struct Enumerations(Vec<(String, Vec<(String, i32)>)>);

impl Enumerations {
    /// The name of that of a variable of the FMU called `fmu`; None where it has no items.
    fn name(&mut self, fmu: &str, v: &Variable) -> Option<String> {
        if v.items.is_empty() {
            return None;
        }
        let mut name = v.declared_type.clone().unwrap_or_else(|| v.name.clone());
        if self.0.iter().any(|e| e.0 == name && e.1 != v.items) {
            name = format!("{fmu}.{name}");
        }
        if self.0.iter().all(|e| e.0 != name) {
            self.0.push((name.clone(), v.items.clone()));
        }
        Some(name)
    }

    fn written(&self) -> String {
        let mut o = String::new();
        for (name, items) in &self.0 {
            // writing to a String cannot fail
            let _ = writeln!(o, "    <ssc:Enumeration name=\"{}\">", escape(name.as_str()));
            for (item, value) in items {
                let _ = writeln!(o, "      <ssc:Item name=\"{}\" value=\"{value}\"/>", escape(item.as_str()));
            }
            o += "    </ssc:Enumeration>\n";
        }
        listed("  ", "ssd:Enumerations", &o)
    }
}

/// A list in its element; the schema has no empty ones.
fn listed(indent: &str, name: &str, entries: &str) -> String {
    if entries.is_empty() {
        return String::new();
    }
    format!("{indent}<{name}>\n{entries}{indent}</{name}>\n")
}

/// Longest name of a component that an FMU's file has, characters: with what parts it from others it fits every file system.
const LONGEST_NAME: usize = 100;

/// Writes the system as an SSP 1.0 archive to `out`, components in the order they are stepped. What not every host heeds of
/// it.
///
/// # Errors
/// What [`build`] finds wrong with the system; an FMU that cannot be read; an archive that cannot be written (none is left
/// half-written).
pub fn export_ssp(s: &System, out: &Path) -> Result<Vec<String>> {
    let built = build(s)?;
    let order: Vec<String> = built.network.stepping_order().into_iter().map(String::from).collect();
    let folder = output::Scratch::new("export")?;
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Deflated)
        .last_modified_time(zip::DateTime::default())
        .unix_permissions(0o644);
    let mut elements = String::new();
    let mut enumerations = Enumerations::default();
    let mut sources: Vec<String> = Vec::new();
    for name in &order {
        let Some(k) = s.fmu.iter().position(|c| c.name.get_ref() == name) else { bail!("{name}: no such FMU") };
        let (c, d) = (&s.fmu[k], built.fmus[k].description());
        // what a URI and every file system take as it is
        let plain = name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' });
        let plain: String = plain.take(LONGEST_NAME).collect();
        let mut source = format!("resources/{plain}.fmu");
        // some file systems part no names by case
        while sources.iter().any(|s| s.eq_ignore_ascii_case(&source)) {
            source.insert(source.len() - ".fmu".len(), '_');
        }
        sources.push(source.clone());
        let own = c.own();
        let bytes = match own {
            Some(model) => {
                let m = Model::named(model)?;
                let mut starts = Vec::new();
                for (n, v) in &c.set {
                    match v.get_ref() {
                        Value::Real(x) => starts.push((n.clone(), *x)),
                        Value::Integer(i) => starts.push((n.clone(), *i as f64)),
                        Value::Text(t) => {
                            let number = m.number(n, t).map_err(|e| s.at(v.span(), &format!("{name}: {e:#}")))?;
                            starts.push((n.clone(), number));
                        }
                        Value::Boolean(_) => return Err(s.at(v.span(), &format!("{n} of {name}: give a number"))),
                    }
                }
                m.archive(&starts, &m.libraries(None)?).with_context(|| name.clone())?
            }
            None => {
                let path = file_of(s, c, folder.path())?;
                input::bytes(&path, input::LIBRARY).with_context(|| format!("{}: cannot be read", path.display()))?
            }
        };
        zip.start_file(source.as_str(), options)?;
        zip.write_all(&bytes)?;
        let connectors = connectors(s, name, d, &mut enumerations);
        let bindings = if own.is_none() { bindings(s, k, d) } else { String::new() };
        let tag = format!(
            "      <ssd:Component name=\"{}\" type=\"application/x-fmu-sharedlibrary\" source=\"{source}\"",
            escape(name.as_str())
        );
        elements += &match (connectors + &bindings).as_str() {
            "" => format!("{tag}/>\n"),
            inside => format!("{tag}>\n{inside}      </ssd:Component>\n"),
        };
    }
    let mut notes = built.notes.clone();
    let connections: String = s.connect.iter().map(|c| connection(c, &mut notes)).collect();
    let (name, o) = (s.title(), &built.options);
    let name = escape(name.as_str());
    let (start, stop, step) = (o.start, o.stop, o.step);
    let described = built.fmus.iter().filter_map(|f| f.description().tolerance).filter(|t| *t > 0.0);
    let least = described.fold(f64::INFINITY, f64::min);
    let tolerance = s.master.tolerance.unwrap_or(if least.is_finite() { least } else { TOLERANCE });
    let elements = listed("    ", "ssd:Elements", &elements);
    let connections = listed("    ", "ssd:Connections", &connections);
    let enumerations = enumerations.written();
    let tool = env!("CARGO_PKG_VERSION");
    let ssd = format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" xmlns:oms="https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd" name="{name}" version="1.0" generationTool="touchdown {tool}">
  <ssd:System name="{name}">
{elements}{connections}    <ssd:Annotations>
      <ssc:Annotation type="org.openmodelica">
        <oms:Annotations>
          <oms:SimulationInformation>
            <oms:FixedStepMaster description="oms-ma" stepSize="{step:e}" absoluteTolerance="{tolerance:e}" relativeTolerance="{tolerance:e}"/>
          </oms:SimulationInformation>
        </oms:Annotations>
      </ssc:Annotation>
    </ssd:Annotations>
  </ssd:System>
{enumerations}  <ssd:DefaultExperiment startTime="{start}" stopTime="{stop}"/>
</ssd:SystemStructureDescription>
"#
    );
    zip.start_file("SystemStructure.ssd", options)?;
    zip.write_all(ssd.as_bytes())?;
    let kept = pack::write_archive(out, &zip.finish()?.into_inner(), "SystemStructure.ssd")?;
    notes.extend(kept.map(|k| k.note()));
    Ok(notes)
}

fn split(port: &str) -> (&str, &str) {
    port.split_once('.').unwrap_or((port, ""))
}

/// A connection; a note where it holds what not every host applies.
fn connection(c: &Connection, notes: &mut Vec<String>) -> String {
    let ((a, x), (b, y)) = (split(c.from.get_ref()), split(c.to.get_ref()));
    let mut o = format!(
        "      <ssd:Connection startElement=\"{}\" startConnector=\"{}\" endElement=\"{}\" endConnector=\"{}\"",
        escape(a),
        escape(x),
        escape(b),
        escape(y)
    );
    if c.suppress_unit_conversion {
        o += " suppressUnitConversion=\"true\"";
    }
    let mut inside = String::new();
    if c.factor != 1.0 || c.offset != 0.0 {
        let (factor, offset) = (c.factor, c.offset);
        let _ = writeln!(inside, "        <ssc:LinearTransformation factor=\"{factor:e}\" offset=\"{offset:e}\"/>");
    } else if let Some((first, _)) = c.map.first() {
        let kind = match first {
            Value::Boolean(_) => "Boolean",
            Value::Text(_) => "Enumeration",
            _ => "Integer",
        };
        let text = |v: &Value| match v {
            Value::Text(t) => escape(t.as_str()).into_owned(),
            v => v.to_string(),
        };
        let entries = c
            .map
            .iter()
            .map(|(a, b)| format!("          <ssc:MapEntry source=\"{}\" target=\"{}\"/>\n", text(a), text(b)));
        inside = listed("        ", &format!("ssc:{kind}MappingTransformation"), &entries.collect::<String>());
    }
    if inside.is_empty() {
        return o + "/>\n";
    }
    notes.push(format!(
        "{} -> {}: its transformation is in the archive, and not every host applies those (fmpy does not)",
        c.from.get_ref(),
        c.to.get_ref()
    ));
    o + ">\n" + &inside + "      </ssd:Connection>\n"
}

/// The connected ports of an FMU.
fn connectors(s: &System, name: &str, d: &Description, enumerations: &mut Enumerations) -> String {
    let mut ports: Vec<(&str, &str)> = Vec::new();
    for c in &s.connect {
        for (port, kind) in [(c.from.get_ref(), "output"), (c.to.get_ref(), "input")] {
            let (fmu, variable) = split(port);
            if fmu == name && !ports.iter().any(|p| p.0 == variable) {
                ports.push((variable, kind));
            }
        }
    }
    let mut o = String::new();
    for (port, kind) in ports {
        let of = match d.variable(port) {
            Some(v) if v.kind == Kind::Enumeration => match enumerations.name(name, v) {
                Some(of) => format!("Enumeration name=\"{}\"", escape(of.as_str())),
                None => "Integer".to_string(),
            },
            v => format!("{:?}", v.map_or(Kind::Real, |v| v.kind)),
        };
        let port = escape(port);
        let _ = writeln!(o, "          <ssd:Connector name=\"{port}\" kind=\"{kind}\"><ssc:{of}/></ssd:Connector>");
    }
    listed("        ", "ssd:Connectors", &o)
}

/// The values that an FMU is given.
fn bindings(s: &System, k: usize, d: &Description) -> String {
    let mut o = String::new();
    for (n, v) in &s.fmu[k].set {
        let (kind, text) = parameter(d.variable(n), v.get_ref());
        let (n, text) = (escape(n.as_str()), escape(text.as_str()));
        let _ =
            writeln!(o, "                  <ssv:Parameter name=\"{n}\"><ssv:{kind} value=\"{text}\"/></ssv:Parameter>");
    }
    if o.is_empty() {
        return o;
    }
    let set = listed("                ", "ssv:Parameters", &o);
    format!(
        "        <ssd:ParameterBindings>\n          <ssd:ParameterBinding>\n            <ssd:ParameterValues>\n\
         \x20             <ssv:ParameterSet version=\"1.0\" name=\"start\">\n{set}              </ssv:ParameterSet>\n\
         \x20           </ssd:ParameterValues>\n          </ssd:ParameterBinding>\n        </ssd:ParameterBindings>\n"
    )
}
