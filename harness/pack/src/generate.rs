//! What the model description and its documentation say of the law's parameters and mechanisms, written from the
//! declarations of its parts. The files keep it between markers; a test holds them to it, and rewrites them with
//! `TOUCHDOWN_WRITE=1 cargo test -p touchdown-pack generate`.

use super::description::Number;
use anyhow::{ensure, Context, Result};
use law::part::{Kind, Parameter};
use law::parts::{parameters, BY_REFERENCE, MECHANISMS};

/// End of every passage.
const END: &str = "<!-- end of what is written from fmu/law/src/parts -->\n";
/// Passages of the model description: a run of parameters from a value reference on.
const VARIABLES: [(&str, u32); 2] = [
    ("<!-- parameters from 100 on, written from fmu/law/src/parts -->\n", 100),
    ("<!-- parameters from 124 on, written from fmu/law/src/parts -->\n", 124),
];
/// Passages of the documentation.
const MECHANISM_ROWS: &str = "<!-- mechanisms, written from fmu/law/src/parts -->\n";
const PARAMETER_ROWS: &str = "<!-- parameters, written from fmu/law/src/parts -->\n";

/// The model description with its passages written anew.
///
/// # Errors
/// A passage without its begin or end.
pub fn description(now: &str) -> Result<String> {
    let mut text = now.to_string();
    for (begin, reference) in VARIABLES {
        let before = text.split(begin).next().unwrap_or_default();
        let first = before.matches("<ScalarVariable ").count() + 1;
        let from = BY_REFERENCE.iter().skip_while(|p| p.reference < reference);
        let run = from.zip(reference..).take_while(|(p, r)| p.reference == *r);
        let passage: String = run.zip(first..).map(|((p, _), index)| variable(p, index)).collect();
        text = replaced(&text, begin, &passage, "    ")?;
    }
    Ok(text)
}

/// The documentation with its passages written anew.
///
/// # Errors
/// A passage without its begin or end.
pub fn documentation(now: &str) -> Result<String> {
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
            let unit = if p.kind == Kind::Integer { "Integer" } else { p.unit };
            let (unit, text) = (escaped(unit), escaped(p.text));
            format!(
                "<tr><td><code>{}</code></td><td>parameter</td><td>{unit}</td><td>{}</td><td>{text}</td></tr>\n",
                p.name,
                Number(p.neutral)
            )
        })
        .collect();
    let text = replaced(now, MECHANISM_ROWS, &mechanisms, "")?;
    replaced(&text, PARAMETER_ROWS, &rows, "")
}

/// `text` with what stands between `begin` and the next end replaced; the end is indented by `indent`.
fn replaced(text: &str, begin: &str, passage: &str, indent: &str) -> Result<String> {
    let (before, rest) = text.split_once(begin).with_context(|| format!("no line {}", begin.trim_end()))?;
    let (old, after) = rest.split_once(END).with_context(|| format!("no end after {}", begin.trim_end()))?;
    ensure!(!old.contains(" written from "), "no end after {}", begin.trim_end());
    Ok([before, begin, passage, indent, END, after].concat())
}

/// A parameter as the model description has it.
fn variable(p: &Parameter, index: usize) -> String {
    let attribute = |name: &str, value: Option<String>| value.map_or(String::new(), |v| format!(" {name}=\"{v}\""));
    let text = |s: &str| (!s.is_empty()).then(|| escaped(s));
    let number = |v: Option<f64>| v.map(|v| Number(v).to_string());
    let attributes = [
        attribute("unit", text(p.unit)),
        attribute("displayUnit", text(p.display)),
        attribute("min", number(p.range.least)),
        attribute("max", number(p.range.most)),
        attribute("start", number(Some(p.neutral))),
    ];
    format!(
        "    <!-- index {index} -->\n    <ScalarVariable name=\"{}\" valueReference=\"{}\" causality=\"parameter\" \
         variability=\"fixed\" initial=\"exact\" description=\"{}\">\n      <{:?}{}/>\n    </ScalarVariable>\n",
        p.name,
        p.reference,
        escaped(p.text),
        p.kind,
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
            let wanted = if name.ends_with("xml") { description(&now) } else { documentation(&now) }.unwrap();
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
        assert!(description(&crate::DESCRIPTION.replacen(VARIABLES[0].0, "", 1)).is_err());
    }
}
