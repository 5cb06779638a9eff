//! What the model description and its documentation say of the law's parameters and mechanisms, written from the
//! declarations of its parts. The files keep it between markers; a test holds them to it, and rewrites them with
//! `TOUCHDOWN_WRITE=1 cargo test -p touchdown-pack generate`.

use super::description::Number;
use anyhow::{ensure, Context, Result};
use law::part::{Item, Kind, Mechanism, Parameter};
use law::parts::{parameters, MECHANISMS};

/// End of every passage.
const END: &str = "<!-- end of what is written from fmu/law/src/parts -->\n";
/// Passage of the model description: the parameters, mechanism by mechanism, as hosts list them.
const VARIABLES: &str = "<!-- parameters, written from fmu/law/src/parts -->\n";
/// Passage of the model description: which parameters belong together.
const GROUPS: &str = "<!-- groups, written from fmu/law/src/parts -->\n";
/// Passage of the model description: the lists that choices have.
const TYPES: &str = "<!-- types, written from fmu/law/src/parts -->\n";
/// Passages of the documentation.
const MECHANISM_ROWS: &str = "<!-- mechanisms, written from fmu/law/src/parts -->\n";
const PARAMETER_ROWS: &str = "<!-- parameters, written from fmu/law/src/parts -->\n";

/// The model description with its passages written anew.
///
/// # Errors
/// A passage without its begin or end.
pub fn description(now: &str) -> Result<String> {
    let before = now.split(VARIABLES).next().unwrap_or_default();
    let first = before.matches("<ScalarVariable ").count() + 1;
    let passage: String = parameters().zip(first..).map(|(p, index)| variable(p, index)).collect();
    let text = replaced(now, VARIABLES, &passage, "    ")?;
    let groups: String = MECHANISMS.iter().map(group).collect();
    let text = replaced(&text, GROUPS, &groups, "        ")?;
    let types: String = parameters().filter(|p| p.kind != Kind::Real).map(list).collect();
    replaced(&text, TYPES, &types, "    ")
}

/// The documentation with its passages written anew, each parameter's start value as `value` has it.
///
/// # Errors
/// A passage without its begin or end.
pub fn documentation(now: &str, value: &dyn Fn(&Parameter) -> f64) -> Result<String> {
    let mechanisms: String = MECHANISMS
        .iter()
        .map(|m| {
            let name = m.name.replace('_', " ");
            let cells = [&name, m.sentence, m.equation, m.source].map(escaped);
            format!("<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n", cells[0], cells[1], cells[2], cells[3])
        })
        .collect();
    let rows: String = parameters()
        .map(|p| {
            let unit = if p.kind == Kind::Real { p.unit } else { "Enumeration" };
            let (unit, text) = (escaped(unit), escaped(p.text) + &items(p));
            let number = value(p);
            let start = crate::item(p.name, number).map_or_else(|| Number(number).to_string(), String::from);
            format!(
                "<tr><td><code>{}</code></td><td>parameter</td><td>{unit}</td><td>{start}</td><td>{text}</td></tr>\n",
                p.name
            )
        })
        .collect();
    let text = replaced(now, MECHANISM_ROWS, &mechanisms, "")?;
    replaced(&text, PARAMETER_ROWS, &rows, "")
}

/// The items of a choice with their numbers, as the documentation lists them.
fn items(p: &Parameter) -> String {
    let item = |(n, i): (usize, &Item)| format!("<br><code>{}</code> ({n}): {}", i.name, escaped(i.text));
    p.kind.items().iter().enumerate().map(item).collect()
}

/// A choice's list as the model description has it; it is named as the parameter is.
fn list(p: &Parameter) -> String {
    let item = |(n, i): (usize, &Item)| {
        format!("        <Item name=\"{}\" value=\"{n}\" description=\"{}\"/>\n", i.name, escaped(i.text))
    };
    let items: String = p.kind.items().iter().enumerate().map(item).collect();
    let (name, text) = (p.name, escaped(p.text));
    format!(
        "    <SimpleType name=\"{name}\" description=\"{text}\">\n      <Enumeration>\n{items}      </Enumeration>\n    \
         </SimpleType>\n"
    )
}

/// `text` with what stands between `begin` and the next end replaced; the end is indented by `indent`.
fn replaced(text: &str, begin: &str, passage: &str, indent: &str) -> Result<String> {
    let (before, rest) = text.split_once(begin).with_context(|| format!("no line {}", begin.trim_end()))?;
    let (old, after) = rest.split_once(END).with_context(|| format!("no end after {}", begin.trim_end()))?;
    ensure!(!old.contains(" written from "), "no end after {}", begin.trim_end());
    Ok([before, begin, passage, indent, END, after].concat())
}

/// The parameters of a mechanism as a group of the model description.
fn group(m: &Mechanism) -> String {
    let names: Vec<&str> = m.parameters.iter().map(|p| p.name).collect();
    format!("        <Group name=\"{}\" variables=\"{}\"/>\n", m.name, names.join(" "))
}

/// A typical size of a parameter, above 0: its neutral value, or where that is 0 one of the unit it is shown in.
fn nominal(p: &Parameter) -> f64 {
    if p.neutral != 0.0 {
        return p.neutral.abs();
    }
    match (p.unit, p.display) {
        (_, "mm") => 1e-3,
        (_, "um") => 1e-6,
        (_, "kN") => 1e3,
        ("N.s/m", _) => 1e2,
        ("N.s/m^(p+1)", _) => 1e7,
        ("N/m^q" | "N/m^r", _) => 1e8,
        _ => 1.0,
    }
}

/// A parameter as the model description has it.
fn variable(p: &Parameter, index: usize) -> String {
    let attribute = |name: &str, value: Option<String>| value.map_or(String::new(), |v| format!(" {name}=\"{v}\""));
    let text = |s: &str| (!s.is_empty()).then(|| escaped(s));
    let number = |v: Option<f64>| v.map(|v| Number(v).to_string());
    let (kind, declared) = match p.kind {
        Kind::Real => ("Real", None),
        Kind::Enumeration(_) => ("Enumeration", Some(p.name.to_string())),
    };
    let attributes = [
        attribute("declaredType", declared),
        attribute("unit", text(p.unit)),
        attribute("displayUnit", text(p.display)),
        attribute("min", number(p.range.least)),
        attribute("max", number(p.range.most)),
        attribute("nominal", number((p.kind == Kind::Real).then(|| nominal(p)))),
        attribute("start", number(Some(p.neutral))),
    ];
    format!(
        "    <!-- index {index} -->\n    <ScalarVariable name=\"{}\" valueReference=\"{}\" causality=\"parameter\" \
         variability=\"fixed\" initial=\"exact\" description=\"{}\">\n      <{kind}{}/>\n    </ScalarVariable>\n",
        p.name,
        p.reference,
        escaped(p.text),
        attributes.concat()
    )
}

fn escaped(s: &str) -> String {
    s.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_files_say_what_is_generated_from_the_parts() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../modelDescription");
        for name in ["modelDescription.xml", "documentation/index.html"] {
            let path = folder.join(name);
            let now = std::fs::read_to_string(&path).unwrap();
            let wanted =
                if name.ends_with("xml") { description(&now) } else { documentation(&now, &|p| p.neutral) }.unwrap();
            if std::env::var_os("TOUCHDOWN_WRITE").is_some() {
                std::fs::write(&path, &wanted).unwrap();
            } else {
                let at = now.lines().zip(wanted.lines()).find(|(a, b)| a != b);
                assert!(now == wanted, "{name} is not what the parts say: set TOUCHDOWN_WRITE=1 to rewrite it; {at:?}");
            }
        }
    }

    #[test]
    fn every_unit_of_a_parameter_is_defined_with_the_unit_it_is_shown_in() {
        let d = crate::DESCRIPTION;
        for p in parameters().filter(|p| p.kind == Kind::Real) {
            let unit = d.lines().find(|l| l.contains(&format!("<Unit name=\"{}\"", p.unit)));
            let unit = unit.unwrap_or_else(|| panic!("{} is no unit of the description: add it there", p.unit));
            assert!(
                p.display.is_empty() || unit.contains(&format!("<DisplayUnit name=\"{}\"", p.display)),
                "{}",
                p.name
            );
        }
    }

    #[test]
    fn a_passage_that_lost_its_end_is_refused() {
        assert!(description(&crate::DESCRIPTION.replacen(END, "", 1)).is_err());
        assert!(description(&crate::DESCRIPTION.replacen(VARIABLES, "", 1)).is_err());
    }
}
