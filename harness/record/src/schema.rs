//! The JSON schema of campaign.toml, from the table of its keys: for editors that complete and check as one types.

use crate::keys::{Key, Rule, TABLES};
use crate::Kind;
use serde_json::{json, Map, Value};

/// The schema (JSON Schema 2020-12) of campaign.toml. `terms`: what `[simulation]` may list.
pub fn schema(terms: &[&str]) -> Value {
    let mut properties = Map::new();
    for (table, _, keys) in TABLES {
        let of: Map<_, _> = keys.iter().map(|k| (k.0.to_string(), property(k, terms))).collect();
        let of_table = json!({"type": "object", "additionalProperties": false, "properties": of});
        match table {
            "" => properties.extend(of),
            "recording" => {
                let mut each = of_table;
                each["required"] = json!(["file"]);
                properties.insert(table.into(), json!({"type": "array", "minItems": 1, "items": each}));
            }
            _ => {
                properties.insert(table.into(), of_table);
            }
        }
    }
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Recordings",
        "description": "campaign.toml of a campaign of recordings, format recordings/1; plain SI",
        "type": "object",
        "additionalProperties": false,
        "required": ["format", "campaign", "recording"],
        "properties": properties,
    })
}

/// What a key may hold.
fn property(key: &Key, terms: &[&str]) -> Value {
    let Key(name, rule, unit) = key;
    let mut of = match (*name, rule) {
        ("format", _) => json!({"const": "recordings/1"}),
        ("kind", _) => {
            let names = Kind::ALL.map(Kind::name);
            json!({"enum": names.iter().map(|n| n.to_string()).chain(names.map(|n| n.replace('-', "_"))).collect::<std::collections::BTreeSet<_>>()})
        }
        (_, Rule::Texts) => json!({"type": "array", "items": {"enum": terms}}),
        (_, Rule::Above) => json!({"type": "number", "exclusiveMinimum": 0}),
        (_, Rule::FromZero) => json!({"type": "number", "minimum": 0}),
        (_, Rule::Number) => json!({"type": "number"}),
        (_, Rule::Text) => json!({"type": "string"}),
        (_, Rule::Label) => json!({"type": ["number", "string"]}),
    };
    if !unit.is_empty() {
        of["description"] = json!(format!("in {unit}"));
    }
    of
}
