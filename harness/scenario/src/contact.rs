//! The contact of a scenario: every parameter of the law by its name, or stiffness from two faces.

use host::Value;
use law::part::{Kind, Parameter};
use law::stiffness::{half_space, rectangular_faces};
use law::{parts, Parameters};
use record::words;
use schemars::{json_schema, JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserializer, Error as _, MapAccess, Visitor};
use serde::Deserialize;
use serde_json::json;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::LazyLock;

/// Key at fault, and the cure.
pub type Fault = (&'static str, String);

/// Two flat rectangular faces that meet (Ahn and Ryu 2005, eq. 7). Each pair is the two sides' material.
#[derive(Clone, Debug, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Faces {
    /// Half of one side, m, > 0.
    pub a: f64,
    /// Half of the other side, m, > 0.
    pub b: f64,
    /// Young's moduli, Pa, > 0.
    pub youngs_modulus: [f64; 2],
    /// Poisson's ratios, -1 to 0.5.
    pub poisson_ratio: [f64; 2],
}

impl Faces {
    /// Stiffness, N/m.
    ///
    /// # Errors
    /// The key at fault and the cure.
    pub fn stiffness(&self) -> Result<f64, Fault> {
        if !self.youngs_modulus.iter().all(|e| e.is_finite() && *e > 0.0) {
            return Err(("youngs_modulus", "two moduli above 0, in Pa".into()));
        }
        if !self.poisson_ratio.iter().all(|n| (-1.0..=0.5).contains(n)) {
            return Err(("poisson_ratio", "two ratios from -1 to 0.5".into()));
        }
        let h = |i: usize| half_space(self.youngs_modulus[i], self.poisson_ratio[i]);
        rectangular_faces(self.a, self.b, h(0), h(1)).ok_or(("a", "half sides a and b above 0, in m".into()))
    }
}

/// Names of an FMU's variables; absent: those of our own.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Variables {
    /// Input, a length, positive into the stop.
    pub penetration: Option<String>,
    /// Input, a speed; empty where the FMU takes none.
    pub velocity: Option<String>,
    /// Output, a force, positive in compression.
    pub force: Option<String>,
}

/// The contact's parameters by the names of the FMU's contract; what is absent is neutral.
#[derive(Clone, Debug, Default)]
pub struct Contact {
    /// What to call it where it stands beside others.
    pub name: Option<String>,
    /// FMU to use, a path from the scenario's folder; absent: our own. It gets the parameters given here,
    /// no others; `stiffness` and `exponent` may then be absent.
    pub fmu: Option<PathBuf>,
    /// Names of that FMU's variables.
    pub variables: Variables,
    /// Further parameters of that FMU by its own names; of an Enumeration the item's name or number.
    pub parameters: BTreeMap<String, Value>,
    /// Hold that FMU's force over macro-steps of this length, s, > 0; absent: it answers at once, or its
    /// steps are tried out and taken back.
    pub macro_step: Option<f64>,
    /// Faces whose theoretical stiffness is taken, p = 1, instead of `stiffness` and `exponent`.
    pub faces: Option<Faces>,
    /// The law's own parameters that are given, plain SI.
    pub law: Vec<(&'static Parameter, f64)>,
}

/// Keys of a contact beside the law's parameters.
const KEYS: [&str; 6] = ["name", "fmu", "variables", "parameters", "macro_step", "faces"];

/// A key of a contact.
#[derive(Clone, Copy)]
enum Key {
    Own(&'static str),
    Law(&'static Parameter),
}

/// An item of a choice, by its number or its name.
#[derive(Deserialize)]
#[serde(untagged, expecting = "give the name of an item, or its number")]
enum Choice {
    Number(i32),
    Name(String),
}

impl Choice {
    /// Its number.
    ///
    /// # Errors
    /// Names the nearest item of `p`, and those there are.
    fn number(self, p: &Parameter) -> Result<f64, String> {
        match self {
            Choice::Number(n) => Ok(f64::from(n)),
            Choice::Name(name) => {
                let names: Vec<&str> = p.kind.items().iter().map(|i| i.name).collect();
                words::place(p.name, &name, &names).map(|n| n as f64)
            }
        }
    }
}

/// Every key, for the error about one that is none.
static NAMES: LazyLock<Vec<&'static str>> =
    LazyLock::new(|| KEYS.into_iter().chain(parts::parameters().map(|p| p.name)).collect());

impl<'de> Deserialize<'de> for Key {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        let key = String::deserialize(d)?;
        let own = KEYS.into_iter().find(|k| *k == key).map(Key::Own);
        own.or(parts::parameter(&key).map(Key::Law)).ok_or_else(|| D::Error::unknown_field(&key, &NAMES))
    }
}

impl<'de> Deserialize<'de> for Contact {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_map(Table)
    }
}

impl JsonSchema for Contact {
    fn schema_name() -> Cow<'static, str> {
        "Contact".into()
    }

    fn json_schema(g: &mut SchemaGenerator) -> Schema {
        let own = [
            ("name", "what to call it where it stands beside others", g.subschema_for::<String>()),
            (
                "fmu",
                "FMU to use, a path from the scenario's folder; absent: touchdown's own",
                g.subschema_for::<String>(),
            ),
            ("variables", "names of that FMU's variables", g.subschema_for::<Variables>()),
            (
                "parameters",
                "further parameters of that FMU by its own names",
                g.subschema_for::<BTreeMap<String, Value>>(),
            ),
            (
                "macro_step",
                "hold that FMU's force over steps of this length, s",
                json_schema!({"exclusiveMinimum": 0, "type": "number"}),
            ),
            ("faces", "faces whose theoretical stiffness is taken, with exponent 1", g.subschema_for::<Faces>()),
        ];
        let own = own.map(|(key, text, mut schema)| {
            schema.insert("description".into(), text.into());
            (key.to_string(), schema.to_value())
        });
        let of_law = parts::parameters().map(|p| (p.name.to_string(), property(p)));
        let properties: serde_json::Map<_, _> = own.into_iter().chain(of_law).collect();
        json_schema!({"type": "object", "additionalProperties": false, "properties": properties})
    }
}

/// The schema of one of the law's parameters.
fn property(p: &Parameter) -> serde_json::Value {
    let items: Vec<&str> = p.kind.items().iter().map(|i| i.name).collect();
    if p.kind != Kind::Real {
        return json!({"description": p.text, "anyOf": [{"enum": items}, {"type": "integer", "minimum": 0, "maximum": items.len() - 1}]});
    }
    let mut number = json!({"description": format!("{}: {}, {}", p.text, p.unit, p.range.words), "type": "number"});
    for (key, bound) in [("minimum", p.range.least), ("maximum", p.range.most)] {
        if let Some(v) = bound {
            number[key] = json!(v);
        }
    }
    number
}

/// Reads a contact key by key.
struct Table;

impl<'de> Visitor<'de> for Table {
    type Value = Contact;

    fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("a table of the contact's parameters")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Contact, A::Error> {
        let mut c = Contact::default();
        while let Some(key) = map.next_key()? {
            match key {
                Key::Law(p) if p.kind != Kind::Real => {
                    let value = map.next_value::<Choice>()?.number(p).map_err(A::Error::custom)?;
                    c.law.push((p, value));
                }
                Key::Law(p) => c.law.push((p, map.next_value()?)),
                Key::Own("name") => c.name = Some(map.next_value()?),
                Key::Own("fmu") => c.fmu = Some(map.next_value()?),
                Key::Own("variables") => c.variables = map.next_value()?,
                Key::Own("parameters") => c.parameters = map.next_value()?,
                Key::Own("macro_step") => c.macro_step = Some(map.next_value()?),
                Key::Own("faces") => c.faces = Some(map.next_value()?),
                Key::Own(other) => return Err(A::Error::unknown_field(other, &NAMES)),
            }
        }
        Ok(c)
    }
}

impl Contact {
    /// A parameter of the law that is given, by name.
    fn get(&self, name: &str) -> Option<f64> {
        self.law.iter().find(|(p, _)| p.name == name).map(|(_, v)| *v)
    }

    /// Parameters of the law that are given, by name, in the law's order.
    pub fn given(&self) -> Vec<(String, f64)> {
        parts::parameters().filter_map(|p| Some((p.name.to_string(), self.get(p.name)?))).collect()
    }
}

/// Every parameter of a law, by name.
pub fn named(p: &Parameters) -> Vec<(String, f64)> {
    p.values().map(|(p, v)| (p.name.to_string(), v)).collect()
}

impl Contact {
    /// The law's parameters.
    ///
    /// # Errors
    /// The key at fault and the cure.
    pub fn parameters(&self) -> Result<Parameters, Fault> {
        let mut p = Parameters::default();
        for (q, value) in &self.law {
            (q.set)(&mut p, *value);
        }
        if self.fmu.is_none() {
            let alone = |key, empty: bool| if empty { Ok(()) } else { Err((key, "it with fmu only".to_string())) };
            alone("variables", self.variables == Variables::default())?;
            alone("parameters", self.parameters.is_empty())?;
        }
        if self.macro_step.is_some_and(|h| !(h.is_finite() && h > 0.0)) {
            return Err(("macro_step", "a time above 0, in s, or leave it out".into()));
        }
        match (&self.faces, self.get("stiffness"), self.get("exponent")) {
            (Some(_), Some(_), _) => return Err(("faces", "either stiffness or faces, not both".into())),
            (Some(f), None, e) => {
                if e.is_some_and(|e| e != 1.0) {
                    return Err(("exponent", "1, or leave it out: two flat faces are a linear spring".into()));
                }
                p.elastic.stiffness = f.stiffness()?;
                p.elastic.exponent = 1.0;
            }
            (None, _, _) if self.fmu.is_some() => {}
            (None, None, _) => return Err(("stiffness", "k in N/m^p, or faces = { a, b, .. }".into())),
            (None, _, None) => return Err(("exponent", "p, 0.5 to 5".into())),
            _ => {}
        }
        p.validate().map_err(|e| (e.name, e.expected.to_string()))?;
        Ok(p)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schema_has_every_key_and_no_other() {
        let schema = schemars::schema_for!(Contact).to_value();
        let mut keys: Vec<&str> = schema["properties"].as_object().unwrap().keys().map(String::as_str).collect();
        let mut names = NAMES.clone();
        keys.sort_unstable();
        names.sort_unstable();
        assert_eq!(keys, names);
    }

    #[test]
    fn every_parameter_of_the_law_can_be_given_and_no_other_key() {
        for p in parts::parameters() {
            let value = if p.kind != Kind::Real { 1.0 } else { 1.25 };
            let c: Contact = toml::from_str(&format!("{} = {value}", p.name)).unwrap();
            assert_eq!(c.given(), [(p.name.to_string(), value)]);
        }
        let e = toml::from_str::<Contact>("exponent = 1\nadhesion_force_ = 2.0\n").unwrap_err();
        assert!(
            e.message().contains("unknown field `adhesion_force_`") && e.message().contains("`adhesion_force`"),
            "{e}"
        );
        assert_eq!(e.span(), Some(13..28));
        assert!(toml::from_str::<Contact>("plastic_form = 0.5").is_err());
        let named: Contact = toml::from_str("adhesion_form = \"growing\"").unwrap();
        assert_eq!(named.given(), [("adhesion_form".to_string(), 4.0)]);
        let e = toml::from_str::<Contact>("plastic_form = \"walton\"").unwrap_err().to_string();
        assert!(e.contains("plastic_form \"walton\" is not known; did you mean \"walton_braun\"?"), "{e}");
    }

    #[test]
    fn faces_give_equation_7_and_exclude_a_stiffness() {
        let f = Faces { a: 2e-3, b: 2e-3, youngs_modulus: [200e9; 2], poisson_ratio: [0.3; 2] };
        let mut c = Contact { faces: Some(f.clone()), ..Contact::default() };
        let p = c.parameters().unwrap();
        assert_eq!(p.elastic.exponent, 1.0);
        assert!((p.elastic.stiffness - f.stiffness().unwrap()).abs() == 0.0 && p.elastic.stiffness > 4e8);
        c.law.extend(parts::parameter("stiffness").map(|p| (p, 1.0)));
        assert_eq!(c.parameters().unwrap_err().0, "faces");
    }
}
