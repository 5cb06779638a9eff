//! SSP 1.0 archives out: a system that other hosts load and run as it stands.
//!
//! Not every host applies parameter bindings, so our own FMUs are packed with their values inside; for others the
//! bindings stand in the description. The step stands in the OMSimulator annotation, which libcosim and ecos read too.

use super::build::{build, file_of};
use super::system::System;
use crate::description::{Description, Kind, Variable};
use crate::value::Value;
use crate::Fmu;
use anyhow::{bail, Context, Result};
use pack::Model;
use quick_xml::escape::escape;
use std::collections::BTreeMap;
use std::io::{Cursor, Write};
use std::path::Path;

/// What a value of a variable is as an SSP parameter: type and text.
fn parameter(variable: Option<&Variable>, v: &Value) -> (&'static str, String) {
    match v {
        Value::Boolean(b) => ("Boolean", b.to_string()),
        Value::Integer(n) => ("Real", n.to_string()),
        Value::Real(x) => ("Real", format!("{x:e}")),
        Value::Text(t) if variable.is_some_and(|v| v.kind == Kind::Enumeration) => ("Enumeration", t.clone()),
        Value::Text(t) => ("String", t.clone()),
    }
}

/// Writes the system as an SSP 1.0 archive to `out`, components in the order they are stepped.
///
/// # Errors
/// What [`build`] finds wrong with the system; an FMU that cannot be read; a connection with a factor or offset,
/// which not every host applies; an archive that cannot be written (none is left half-written).
pub fn export_ssp(s: &System, out: &Path) -> Result<()> {
    let built = build(s)?;
    let order: Vec<String> = built.network.stepping_order().into_iter().map(String::from).collect();
    let folder = output::Scratch::new("export")?;
    let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default()
        .compression_method(zip::CompressionMethod::Deflated)
        .last_modified_time(zip::DateTime::default())
        .unix_permissions(0o644);
    let mut elements = String::new();
    for name in &order {
        let Some(c) = s.fmu.iter().find(|c| c.name.get_ref() == name) else { bail!("{name}: no such FMU") };
        let source = format!("resources/{name}.fmu");
        let own = c.own();
        let mut foreign = None;
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
                foreign = Some((Fmu::open_in(&path, &s.isolation)?, &c.set));
                input::bytes(&path, input::LIBRARY).with_context(|| format!("{}: cannot be read", path.display()))?
            }
        };
        zip.start_file(source.as_str(), options)?;
        zip.write_all(&bytes)?;
        elements += &element(s, name, &source, foreign.as_ref().map(|(f, set)| (f.description(), *set)))?;
    }
    let mut connections = String::new();
    for c in &s.connect {
        if c.factor != 1.0 || c.offset != 0.0 {
            return Err(s.at(c.from.span(), "a factor or offset here is not applied by every host; leave it out"));
        }
        let (a, x) = split(c.from.get_ref());
        let (b, y) = split(c.to.get_ref());
        connections += &format!(
            "      <ssd:Connection startElement=\"{a}\" startConnector=\"{x}\" endElement=\"{b}\" endConnector=\"{y}\"/>\n"
        );
    }
    let (name, o) = (s.title(), &built.options);
    let name = escape(name.as_str());
    let (start, stop, step) = (o.start, o.stop, o.step);
    let ssd = format!(
        r#"<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" xmlns:oms="https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd" name="{name}" version="1.0">
  <ssd:System name="{name}">
    <ssd:Elements>
{elements}    </ssd:Elements>
    <ssd:Connections>
{connections}    </ssd:Connections>
    <ssd:Annotations>
      <ssc:Annotation type="org.openmodelica">
        <oms:Annotations>
          <oms:SimulationInformation>
            <oms:FixedStepMaster description="oms-ma" stepSize="{step:e}" absoluteTolerance="1e-4" relativeTolerance="1e-4"/>
          </oms:SimulationInformation>
        </oms:Annotations>
      </ssc:Annotation>
    </ssd:Annotations>
  </ssd:System>
  <ssd:DefaultExperiment startTime="{start}" stopTime="{stop}"/>
</ssd:SystemStructureDescription>
"#
    );
    zip.start_file("SystemStructure.ssd", options)?;
    zip.write_all(ssd.as_bytes())?;
    output::write(out, &zip.finish()?.into_inner()).with_context(|| format!("{}: cannot be written", out.display()))
}

fn split(port: &str) -> (String, String) {
    let (a, b) = port.split_once('.').unwrap_or((port, ""));
    (escape(a).into_owned(), escape(b).into_owned())
}

/// A component with its connected ports and, of somebody else's FMU, the parameters given.
fn element(
    s: &System,
    name: &str,
    source: &str,
    foreign: Option<(&Description, &BTreeMap<String, toml::Spanned<Value>>)>,
) -> Result<String> {
    let mut ports: Vec<(String, &str)> = Vec::new();
    for c in &s.connect {
        for (port, kind) in [(c.from.get_ref(), "output"), (c.to.get_ref(), "input")] {
            let (fmu, variable) = split(port);
            if fmu == escape(name) && !ports.iter().any(|p| p.0 == variable) {
                ports.push((variable, kind));
            }
        }
    }
    let mut o = format!(
        "      <ssd:Component name=\"{}\" type=\"application/x-fmu-sharedlibrary\" source=\"{}\">\n        <ssd:Connectors>\n",
        escape(name),
        escape(source)
    );
    for (variable, kind) in &ports {
        o += &format!("          <ssd:Connector name=\"{variable}\" kind=\"{kind}\"><ssc:Real/></ssd:Connector>\n");
    }
    o += "        </ssd:Connectors>\n";
    if let Some((d, set)) = foreign.filter(|f| !f.1.is_empty()) {
        o += "        <ssd:ParameterBindings>\n          <ssd:ParameterBinding>\n            <ssd:ParameterValues>\n";
        o += "              <ssv:ParameterSet version=\"1.0\" name=\"start\">\n                <ssv:Parameters>\n";
        for (n, v) in set {
            let (kind, text) = parameter(d.variable(n), v.get_ref());
            o += &format!(
                "                  <ssv:Parameter name=\"{}\"><ssv:{kind} value=\"{}\"/></ssv:Parameter>\n",
                escape(n.as_str()),
                escape(text.as_str())
            );
        }
        o += "                </ssv:Parameters>\n              </ssv:ParameterSet>\n            </ssd:ParameterValues>\n";
        o += "          </ssd:ParameterBinding>\n        </ssd:ParameterBindings>\n";
    }
    o += "      </ssd:Component>\n";
    Ok(o)
}
