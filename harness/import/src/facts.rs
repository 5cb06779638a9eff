//! What is known of a recording beside its samples: speed, height, preload, level, order, each with where it is from.

use crate::amount::{amount, digits};
use std::collections::BTreeMap;

/// Keys of a recording in campaign.toml: the name, its quantity in the table of units (empty: a plain number) and the unit
/// it is written in.
pub const KEYS: [(&str, &str, &str); 8] = [
    ("order", "", ""),
    ("level", "", ""),
    ("drop_height", "penetration", "m"),
    ("impact_speed", "speed", "m/s"),
    ("impact_speed_std", "speed", "m/s"),
    ("start_speed", "speed", "m/s"),
    ("start_speed_std", "speed", "m/s"),
    ("spring_preload", "force", "N"),
];

/// Shorter names for keys.
const SHORT: [(&str, &str); 7] = [
    ("height", "drop_height"),
    ("speed", "impact_speed"),
    ("speed_std", "impact_speed_std"),
    ("velocity", "impact_speed"),
    ("preload", "spring_preload"),
    ("fall_height", "drop_height"),
    ("impact_velocity", "impact_speed"),
];

/// The key of that name or short name, whatever its case, blanks and hyphens.
pub fn key(name: &str) -> Option<&'static str> {
    let plain = name.trim().to_lowercase().replace([' ', '-'], "_");
    let long = SHORT.iter().find(|s| s.0 == plain).map_or(plain.as_str(), |s| s.1);
    KEYS.iter().find(|k| k.0 == long).map(|k| k.0)
}

/// All names that [`key`] knows.
pub fn known() -> Vec<&'static str> {
    KEYS.iter().map(|k| k.0).chain(SHORT.iter().map(|s| s.0)).collect()
}

/// A value as campaign.toml takes it, SI.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Number(f64),
    Text(String),
}

/// A value and where it is from.
#[derive(Clone, Debug, PartialEq)]
pub struct Fact {
    pub value: Value,
    pub from: String,
}

/// What is known of a recording, by key.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facts(pub BTreeMap<&'static str, Fact>);

impl Facts {
    /// Reads `text` as the value of `key`, in `unit` where the text has none.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn read(&mut self, key: &'static str, text: &str, unit: &str, from: &str) -> Result<(), String> {
        let text = text.trim();
        let quantity = KEYS.iter().find(|k| k.0 == key).map_or("", |k| k.1);
        let bare = text.replacen(',', ".", 1).parse::<f64>().is_ok();
        let value = match (key, bare) {
            ("level", false) => Value::Text(text.to_string()),
            _ if bare && !unit.is_empty() => Value::Number(amount(&format!("{text} {unit}"), quantity)?),
            _ => Value::Number(amount(text, quantity)?),
        };
        match value {
            Value::Number(v) if !v.is_finite() || (v < 0.0 && !quantity.is_empty()) => {
                Err(format!("{key} is {text:?}; it is a number from 0 on"))
            }
            value => {
                self.0.insert(key, Fact { value, from: from.to_string() });
                Ok(())
            }
        }
    }

    /// These, and those of `other` where these say nothing.
    pub fn or(mut self, other: &Facts) -> Facts {
        for (k, f) in &other.0 {
            self.0.entry(k).or_insert_with(|| f.clone());
        }
        self
    }

    /// A number; None where there is none.
    pub fn number(&self, key: &str) -> Option<f64> {
        match self.0.get(key)?.value {
            Value::Number(v) => Some(v),
            Value::Text(_) => None,
        }
    }

    /// Lines of campaign.toml, each with its unit and where the value is from.
    pub fn lines(&self) -> Vec<String> {
        let line = |(key, _, unit): &(&'static str, &str, &str)| {
            let fact = self.0.get(key)?;
            let value = match &fact.value {
                Value::Number(v) => digits(*v),
                Value::Text(t) => toml::Value::String(t.clone()).to_string(),
            };
            let unit = if unit.is_empty() { String::new() } else { format!("{unit}, ") };
            Some(format!("{key} = {value}   # {unit}{}", crate::write::comment(&fact.from)))
        };
        KEYS.iter().filter_map(line).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facts_carry_their_unit_and_what_comes_first_stays() {
        let mut a = Facts::default();
        a.read(key("Drop height").unwrap(), "200", "mm", "x").unwrap();
        a.read("level", "soft", "", "x").unwrap();
        let mut b = Facts::default();
        b.read("drop_height", "0.3", "", "y").unwrap();
        b.read("order", "4", "", "y").unwrap();
        let all = a.or(&b);
        assert_eq!((all.number("drop_height"), all.number("order"), all.number("level")), (Some(0.2), Some(4.0), None));
        assert_eq!(all.lines(), ["order = 4   # y", "level = \"soft\"   # x", "drop_height = 0.2   # m, x"]);
        assert!(Facts::default().read("impact_speed", "-1", "", "").is_err());
        assert!(Facts::default().read("impact_speed", "3 N", "", "").is_err());
    }
}
