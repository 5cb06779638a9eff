//! The tables `[motion.NAME]` of a scenario: mechanisms that act on the body on its way, by the quantities under which a
//! diagnosis reports them.

use mechanisms::part::Allowed;
use mechanisms::physics::{Given, Physics};
use schemars::{json_schema, JsonSchema, Schema, SchemaGenerator};
use serde::de::{DeserializeSeed, Deserializer, Error as _, MapAccess, Visitor};
use serde::Deserialize;
use serde_json::json;
use std::borrow::Cow;
use std::fmt::Formatter;

/// What is given of the motion's mechanisms, in the order of the file.
#[derive(Clone, Debug, Default)]
pub struct Motion(Vec<(Given, f64)>);

impl Motion {
    /// Puts all of it into the physics.
    pub fn put(&self, p: &mut Physics) {
        for (key, value) in &self.0 {
            key.put(p, *value);
        }
    }

    /// Whether `key` of the mechanism is given.
    pub fn gives(&self, mechanism: &str, key: &str) -> bool {
        self.0.iter().any(|(g, _)| g.mechanism == mechanism && g.name == key)
    }
}

impl<'de> Deserialize<'de> for Motion {
    fn deserialize<D: Deserializer<'de>>(d: D) -> Result<Self, D::Error> {
        d.deserialize_map(Tables)
    }
}

impl JsonSchema for Motion {
    fn schema_name() -> Cow<'static, str> {
        "Motion".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let mut tables = serde_json::Map::new();
        for k in Physics::keys() {
            let mut number = json!({"type": "number", "description": format!("{}, {}", k.unit, k.allowed.words())});
            match k.allowed {
                Allowed::Any => {}
                Allowed::FromZero => number["minimum"] = json!(0),
                Allowed::AboveZero => number["exclusiveMinimum"] = json!(0),
            }
            let table = || json!({"type": "object", "additionalProperties": false, "properties": {}});
            tables.entry(k.mechanism).or_insert_with(table)["properties"][k.name] = number;
        }
        json_schema!({"type": "object", "additionalProperties": false, "properties": tables})
    }
}

/// Reads the tables, a mechanism each.
struct Tables;

impl<'de> Visitor<'de> for Tables {
    type Value = Motion;

    fn expecting(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str("a table [motion.NAME] for every mechanism")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Motion, A::Error> {
        let all = Physics::keys();
        let mut names: Vec<&str> = all.iter().map(|k| k.mechanism).collect();
        names.dedup();
        let mut motion = Motion::default();
        while let Some(name) = map.next_key_seed(Word("mechanism", &names))? {
            let keys = all.iter().filter(|k| k.mechanism == name).copied().collect();
            motion.0.extend(map.next_value_seed(Quantities(keys))?);
        }
        Ok(motion)
    }
}

/// Reads the quantities of one mechanism, which has these keys.
struct Quantities(Vec<Given>);

impl<'de> DeserializeSeed<'de> for Quantities {
    type Value = Vec<(Given, f64)>;

    fn deserialize<D: Deserializer<'de>>(self, d: D) -> Result<Self::Value, D::Error> {
        d.deserialize_map(self)
    }
}

impl<'de> Visitor<'de> for Quantities {
    type Value = Vec<(Given, f64)>;

    fn expecting(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str("a table of numbers")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let names: Vec<&str> = self.0.iter().map(|k| k.name).collect();
        let mut all = Vec::new();
        while let Some(name) = map.next_key_seed(Word("key", &names))? {
            for key in self.0.iter().filter(|k| k.name == name) {
                all.push((*key, map.next_value_seed(Quantity(*key))?));
            }
        }
        Ok(all)
    }
}

/// Reads a word: what it is, and all that it may be.
struct Word<'a>(&'static str, &'a [&'static str]);

impl<'de> DeserializeSeed<'de> for Word<'_> {
    type Value = &'static str;

    fn deserialize<D: Deserializer<'de>>(self, d: D) -> Result<&'static str, D::Error> {
        let (what, known) = (self.0, self.1);
        let name = String::deserialize(d)?;
        let found = known.iter().find(|k| **k == name).copied();
        let instead = || record::words::instead(&name, known);
        found.ok_or_else(|| D::Error::custom(format!("{what} {name:?} is not known; {}", instead())))
    }
}

/// Reads the number of a key.
struct Quantity(Given);

impl<'de> DeserializeSeed<'de> for Quantity {
    type Value = f64;

    fn deserialize<D: Deserializer<'de>>(self, d: D) -> Result<f64, D::Error> {
        let (value, key) = (f64::deserialize(d)?, self.0);
        if key.allowed.holds(value) {
            return Ok(value);
        }
        let unit = if key.unit == "1" { String::new() } else { format!(", in {}", key.unit) };
        Err(D::Error::custom(format!("{}: give {}{unit}", key.name, key.allowed.words())))
    }
}

#[cfg(test)]
mod tests {
    use crate::Scenario;

    const DROP: &str =
        "kind = \"drop_test\"\nmass = 0.5\nimpact_speed = 0.5\n[contact]\nstiffness = 1e7\nexponent = 1.5\n";

    #[test]
    fn mechanisms_are_given_as_a_diagnosis_reports_them() {
        let text = format!(
            "{DROP}[motion.fluid_drag]\ndrag = 0.4\ndrag_back = 2.0\n[motion.guide_friction]\nfriction = 0.3\n"
        );
        let case = text.parse::<Scenario>().unwrap().cases().remove(0);
        let p = case.rig.physics(&case.law, 0.0);
        assert_eq!((p.fluid_drag.coefficient, p.fluid_drag.back, p.guide_friction.coulomb), (0.4, 2.0, 0.3));
        assert!(!case.is_free_and_plain());
    }

    #[test]
    fn what_is_wrong_is_told_with_its_line_and_a_cure() {
        for (more, line, part) in [
            ("[motion.fluid_drga]\ndrag = 1.0\n", 7, "fluid_drag"),
            ("[motion.fluid_drag]\ndrga = 1.0\n", 8, "drag"),
            ("[motion.fluid_drag]\ndrag = -1.0\n", 8, "0 or more, in N s^2/m^2"),
            ("[motion.squeeze_film]\nsqueeze_film = 1.0\nsqueeze_gap = 0.0\n", 9, "more than 0, in m"),
            ("[motion]\nfluid_drag = 3\n", 8, "table"),
        ] {
            let (at, what) = Scenario::parse(&format!("{DROP}{more}")).unwrap_err();
            assert!(what.contains(part), "{more}: {what}");
            assert_eq!(at, Some(line), "{more}: {what}");
        }
        let twice = format!("guide_friction = 0.1\n{DROP}[motion.guide_friction]\nfriction = 0.3\n");
        assert!(Scenario::parse(&twice).unwrap_err().1.contains("not both"));
    }
}
