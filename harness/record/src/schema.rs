//! The JSON schema of campaign.toml, from the table of its keys: for editors that complete and check as one types.

use crate::keys::{is_amount, Key, Rule, COLUMNS, SET, TABLES};
use crate::{BondKind, Kind};
use serde_json::{json, Map, Value};

/// The schema (JSON Schema 2020-12) of campaign.toml. `terms`: what `[simulation]` may list.
pub fn schema(terms: &[&str]) -> Value {
    let mut properties = Map::new();
    for (table, _, keys) in TABLES {
        let of: Map<_, _> = keys.iter().map(|k| (k.0.to_string(), property(table, k, terms))).collect();
        let of_table = json!({"type": "object", "additionalProperties": false, "properties": of});
        match table {
            "" => properties.extend(of),
            "recording" => {
                let mut each = of_table;
                each["required"] = json!(["file"]);
                each["properties"][SET] = json!({"type": "object", "additionalProperties": {"type": "number"}});
                properties.insert(table.into(), json!({"type": "array", "minItems": 1, "items": each}));
            }
            "campaign" => {
                let mut of_table = of_table;
                of_table["properties"][COLUMNS] =
                    json!({"type": "object", "additionalProperties": {"type": ["number", "string"]}});
                properties.insert(table.into(), of_table);
            }
            // tables below another, whose row comes first
            _ if table.contains('.') => {
                let (parent, key) = table.split_once('.').unwrap_or_default();
                let required = match key {
                    "free" => json!(["variable"]),
                    "bond" => json!(["name", "kind", "penetration", "velocity"]),
                    _ => json!([]),
                };
                let mut each = of_table;
                each["required"] = required;
                let list = key != "channels";
                properties[parent]["properties"][key] =
                    if list { json!({"type": "array", "items": each}) } else { each };
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
fn property(table: &str, key: &Key, terms: &[&str]) -> Value {
    let Key(name, rule, unit) = key;
    let mut of = match (*name, rule) {
        ("format", _) => json!({"const": "recordings/1"}),
        ("kind", _) if table == "simulation.bond" => json!({"enum": BondKind::ALL.map(BondKind::name)}),
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
    // an amount may be a text with its unit, `800 g`
    if is_amount(unit) && matches!(rule, Rule::Above | Rule::FromZero | Rule::Number) {
        of["type"] = json!(["number", "string"]);
    }
    if !unit.is_empty() {
        of["description"] = json!(format!("in {unit}"));
    }
    of
}
