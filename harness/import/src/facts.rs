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

/// Names of keys as engineers write them in other languages, in lower case, accents and blanks put away.
const ABROAD: [(&str, &[&str]); 5] = [
    (
        "drop_height",
        &[
            "fallhoehe",
            "falltiefe",
            "abwurfhoehe",
            "hoehe",
            "hauteur",
            "hauteur_de_chute",
            "altura",
            "altura_de_caida",
            "altezza",
            "altezza_di_caduta",
            "altezza_caduta",
            "跌落高度",
            "下落高度",
            "落下高さ",
            "落下高度",
            "落差",
            "高度",
            "高さ",
        ],
    ),
    (
        "impact_speed",
        &[
            "aufprallgeschwindigkeit",
            "auftreffgeschwindigkeit",
            "geschwindigkeit",
            "stossgeschwindigkeit",
            "vitesse",
            "vitesse_d_impact",
            "vitesse_impact",
            "velocidad",
            "velocidad_de_impacto",
            "velocita",
            "velocita_d_impatto",
            "velocita_di_impatto",
            "冲击速度",
            "撞击速度",
            "衝突速度",
            "衝撃速度",
            "速度",
        ],
    ),
    (
        "spring_preload",
        &[
            "vorspannkraft",
            "vorspannung",
            "federvorspannung",
            "federvorspannkraft",
            "precharge",
            "precharge_du_ressort",
            "precarga",
            "precarga_del_muelle",
            "precarico",
            "precarico_della_molla",
            "预紧力",
            "预载",
            "予圧",
            "初期荷重",
        ],
    ),
    ("order", &["reihenfolge", "ordre", "orden", "ordine", "顺序", "順序", "順番"]),
    ("level", &["stufe", "niveau", "nivel", "livello", "等级", "级别", "レベル"]),
];

/// A name as keys are compared: lower case, letters with accents as without, `_` for blanks, hyphens and apostrophes.
pub(crate) fn folded(name: &str) -> String {
    crate::words::plain(name.trim()).replace([' ', '-', '\'', '\u{2019}'], "_")
}

/// The key of that name or short name, in any of the languages, whatever its case, blanks and hyphens.
pub fn key(name: &str) -> Option<&'static str> {
    let plain = folded(name);
    if let Some(abroad) = ABROAD.iter().find(|a| a.1.contains(&plain.as_str())) {
        return Some(abroad.0);
    }
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
    fn keys_are_known_as_engineers_write_them() {
        for (name, of) in [
            ("Fallhöhe", "drop_height"),
            ("fallhoehe", "drop_height"),
            ("Hauteur de chute", "drop_height"),
            ("Altura de caída", "drop_height"),
            ("Altezza di caduta", "drop_height"),
            ("落下高さ", "drop_height"),
            ("跌落高度", "drop_height"),
            ("Aufprallgeschwindigkeit", "impact_speed"),
            ("vitesse d'impact", "impact_speed"),
            ("Velocità d’impatto", "impact_speed"),
            ("Federvorspannung", "spring_preload"),
            ("Drop Height", "drop_height"),
        ] {
            assert_eq!(key(name), Some(of), "{name}");
        }
        assert_eq!(key("Temperatur"), None);
    }

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
