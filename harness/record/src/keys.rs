//! The keys of campaign.toml: which there are, what their values have to be, and where they stand.

use crate::error::{Section, TOLD};
use crate::{units, words, RecordError};
use std::collections::BTreeMap;
use std::path::Path;
use toml::de::{DeTable, DeValue};
use toml::Spanned;

/// What a value has to be.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Rule {
    /// A number above zero.
    Above,
    /// A number from zero on.
    FromZero,
    /// Any number.
    Number,
    Text,
    /// A list of texts.
    Texts,
    /// A number or a text.
    Label,
}

/// Largest value: squares of more leave the range of a double.
const LARGEST: f64 = 1e100;
/// Longest name of a column, bytes.
const NAME: usize = 64;

/// A key, what its value has to be, and its unit.
pub(crate) struct Key(pub &'static str, pub Rule, pub &'static str);

const CAMPAIGN: &[Key] = &[
    Key("name", Rule::Text, ""),
    Key("kind", Rule::Text, ""),
    Key("material", Rule::Text, ""),
    Key("operator", Rule::Text, ""),
];

const RIG: &[Key] = &[
    Key("moving_mass", Rule::Above, "kg"),
    Key("travel", Rule::Above, "m"),
    Key("return_spring_rate", Rule::FromZero, "N/m"),
];

const SIMULATION: &[Key] = &[
    Key("terms", Rule::Texts, ""),
    Key("system", Rule::Text, ""),
    Key("gravity", Rule::Number, "m/s^2"),
    Key("k", Rule::Above, "N/m^p"),
    Key("p", Rule::Above, ""),
    Key("mu_d", Rule::FromZero, "N s/m^(p+1)"),
];

const FREE: &[Key] = &[Key("variable", Rule::Text, ""), Key("tolerance", Rule::Above, "")];

const BOND: &[Key] = &[
    Key("name", Rule::Text, ""),
    Key("kind", Rule::Text, ""),
    Key("force", Rule::Text, ""),
    Key("penetration", Rule::Text, ""),
    Key("velocity", Rule::Text, ""),
];

const CHANNELS: &[Key] =
    &[Key("force", Rule::Text, ""), Key("acceleration", Rule::Text, ""), Key("penetration", Rule::Text, "")];

const RECORDING: &[Key] = &[
    Key("file", Rule::Text, ""),
    Key("order", Rule::Number, ""),
    Key("level", Rule::Label, ""),
    Key("drop_height", Rule::FromZero, "m"),
    Key("impact_speed", Rule::FromZero, "m/s"),
    Key("impact_speed_std", Rule::FromZero, "m/s"),
    Key("start_speed", Rule::FromZero, "m/s"),
    Key("start_speed_std", Rule::FromZero, "m/s"),
    Key("spring_preload", Rule::FromZero, "N"),
];

const FORMAT: &[Key] = &[Key("format", Rule::Text, "")];

/// The tables: name, where their keys stand, and the keys. What stands above all tables comes first.
pub(crate) const TABLES: [(&str, &str, &[Key]); 8] = [
    ("", "at the top of the file", FORMAT),
    ("campaign", "under [campaign]", CAMPAIGN),
    ("rig", "under [rig]", RIG),
    ("simulation", "under [simulation]", SIMULATION),
    ("recording", "under [[recording]]", RECORDING),
    ("simulation.free", "under [[simulation.free]]", FREE),
    ("simulation.bond", "under [[simulation.bond]]", BOND),
    ("simulation.channels", "under [simulation.channels]", CHANNELS),
];

/// The table of a recording whose keys are variables of FMUs.
pub(crate) const SET: &str = "set";
/// The table of [campaign] whose keys are the user's own.
pub(crate) const COLUMNS: &str = "columns";

/// A value as it was read.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    Number(f64),
    Text(String),
    /// Texts, each with its line.
    Texts(Vec<(String, usize)>),
}

/// The known entries of one table.
#[derive(Default)]
pub struct Entries {
    /// Line of the table's head; 0 where there is no such table.
    pub line: usize,
    /// By key: its line, and its value unless that is a wrong one.
    values: BTreeMap<&'static str, (usize, Option<Value>)>,
}

impl Entries {
    /// Whether the key stands there, be its value right or wrong.
    pub fn given(&self, key: &str) -> bool {
        self.values.contains_key(key)
    }
    /// Line of a key; that of the table's head where the key is absent.
    pub fn line_of(&self, key: &str) -> usize {
        self.values.get(key).map_or(self.line, |v| v.0)
    }
    pub fn value(&self, key: &str) -> Option<&Value> {
        self.values.get(key)?.1.as_ref()
    }
    pub fn number(&self, key: &str) -> Option<f64> {
        match self.value(key)? {
            Value::Number(x) => Some(*x),
            _ => None,
        }
    }
    pub fn text(&self, key: &str) -> Option<&str> {
        match self.value(key)? {
            Value::Text(s) => Some(s),
            _ => None,
        }
    }
    /// None where the key is absent.
    pub fn texts(&self, key: &str) -> Option<&[(String, usize)]> {
        match self.value(key) {
            Some(Value::Texts(v)) => Some(v),
            _ => None,
        }
    }
}

/// campaign.toml, its keys checked.
#[derive(Default)]
pub struct Document {
    pub top: Entries,
    pub campaign: Entries,
    pub rig: Entries,
    pub simulation: Entries,
    /// Tables below [simulation], of a campaign of kind `system`.
    pub free: Vec<Entries>,
    pub bonds: Vec<Entries>,
    pub channels: Option<Entries>,
    pub recordings: Vec<Entries>,
    /// Values of `[recording.set]`, by recording.
    pub sets: Vec<Vec<Setting>>,
    /// Values of `[campaign.columns]`.
    pub columns: BTreeMap<String, Label>,
}

/// A value of a column of the user's own.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(untagged)]
pub enum Label {
    Number(f64),
    Text(String),
}

/// A value that a recording gives a variable of an FMU.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// `fmu.variable`.
    pub variable: String,
    /// In the variable's unit.
    pub value: f64,
    /// Line in campaign.toml.
    pub line: usize,
}

/// Reads `text` of the file `path`: what is right of it, and everything wrong with its keys and values.
///
/// # Errors
/// Everything wrong with its syntax: what is left of a file that is no TOML says little.
pub fn read(path: &Path, text: &str) -> Result<(Document, Vec<RecordError>), Vec<RecordError>> {
    let ends = text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(at, _)| at).collect();
    let mut r = Reader { path, ends, errors: Vec::new(), more: 0 };
    let (root, faults) = DeTable::parse_recoverable(text);
    if !faults.is_empty() {
        for e in faults {
            let line = e.span().map_or(0, |s| r.line(s.start));
            r.error("", line, e.message().trim(), "correct this line, so that the file is TOML");
        }
        return Err(r.told());
    }
    let mut d = Document { top: r.entries("", root.get_ref(), 0), ..Document::default() };
    for (key, value) in root.get_ref() {
        let head = r.line(key.span().start);
        match (key.get_ref().as_ref(), value.get_ref()) {
            ("campaign", DeValue::Table(t)) => {
                d.campaign = r.entries("campaign", t, head);
                d.columns = r.columns(t);
            }
            ("rig", DeValue::Table(t)) => d.rig = r.entries("rig", t, head),
            ("simulation", DeValue::Table(t)) => {
                d.simulation = r.entries("simulation", t, head);
                d.free = r.list("simulation.free", t);
                d.bonds = r.list("simulation.bond", t);
                d.channels = r.table("simulation.channels", t);
            }
            (name @ ("campaign" | "rig" | "simulation"), _) => {
                r.error(name, head, format!("{name} is no table"), format!("write it as a table [{name}]"));
            }
            ("recording", DeValue::Array(list)) if list.iter().all(|v| v.get_ref().is_table()) => {
                for v in list {
                    let line = r.line(v.span().start);
                    if let DeValue::Table(t) = v.get_ref() {
                        let entries = r.entries("recording", t, line);
                        d.recordings.push(entries);
                        d.sets.push(r.settings(t));
                    }
                }
            }
            ("recording", _) => {
                r.error(
                    "recording",
                    head,
                    "recording is no list of tables",
                    "write [[recording]] above every recording",
                );
            }
            _ => {}
        }
    }
    Ok((d, r.told()))
}

/// The number that a value is, if it is one.
fn number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Float(f) => f.as_str().parse::<f64>().ok(),
        DeValue::Integer(i) => i128::from_str_radix(i.as_str(), i.radix()).ok().map(|i| i as f64),
        _ => None,
    }
}

/// What is measured in an SI unit; None where no other unit is known for it.
fn quantity(unit: &str) -> Option<&'static str> {
    let known = [
        ("kg", "mass"),
        ("m", "penetration"),
        ("m/s", "speed"),
        ("N", "force"),
        ("N/m", "spring rate"),
        ("m/s^2", "acceleration"),
    ];
    known.iter().find(|k| k.0 == unit).map(|k| k.1)
}

/// Whether a value in that unit may be written as a text with another.
pub(crate) fn is_amount(unit: &str) -> bool {
    quantity(unit).is_some()
}

/// The amount in a text such as `800 g`, in `unit`, an SI unit; a decimal comma is allowed.
fn amount(text: &str, unit: &str) -> Result<f64, String> {
    let text = text.trim();
    let end = text.find(|c: char| !(c.is_ascii_digit() || "+-.,eE".contains(c))).unwrap_or(text.len());
    let end = if text[..end].ends_with(['e', 'E']) { end - 1 } else { end };
    let number: f64 = text[..end].replacen(',', ".", 1).parse().map_err(|_| "it is no number".to_string())?;
    let of = text[end..].trim();
    if of.is_empty() {
        return Ok(number);
    }
    let Some(quantity) = quantity(unit) else {
        let inside = if unit.is_empty() { String::new() } else { format!(" in {unit}") };
        return Err(format!("it takes a plain number{inside}"));
    };
    let factor = units::factor(quantity, of)
        .ok_or_else(|| format!("{of:?} is no unit of it: {}", units::instead(quantity, of)))?;
    Ok(number * factor)
}

struct Reader<'a> {
    path: &'a Path,
    /// Where lines end, bytes from the beginning of the text.
    ends: Vec<usize>,
    errors: Vec<RecordError>,
    /// Those that are only counted.
    more: usize,
}

impl Reader<'_> {
    fn line(&self, at: usize) -> usize {
        self.ends.partition_point(|end| *end < at) + 1
    }

    /// What is wrong with a table; "": with what stands above all of them.
    fn error(&mut self, table: &str, line: usize, what: impl Into<String>, cure: impl Into<String>) {
        match self.errors.len() {
            TOLD.. => self.more += 1,
            _ => self.errors.push(RecordError::new(Section::of_table(table), self.path, line, what, cure)),
        }
    }

    /// What is wrong, and last how much more is.
    fn told(mut self) -> Vec<RecordError> {
        if self.more > 0 {
            self.errors.push(RecordError::untold(self.more, self.path));
        }
        self.errors
    }

    /// The known entries of the table `name`, whose head is at `line`; the others are errors.
    fn entries(&mut self, name: &'static str, table: &DeTable<'_>, line: usize) -> Entries {
        let keys = TABLES.iter().find(|t| t.0 == name).map_or(FORMAT, |t| t.2);
        let mut entries = Entries { line, ..Entries::default() };
        for (key, value) in table {
            let (word, at) = (key.get_ref().as_ref(), self.line(key.span().start));
            match keys.iter().find(|k| k.0 == word) {
                Some(k) => {
                    let value = self.value(name, k, value);
                    entries.values.insert(k.0, (at, value));
                }
                None if name.is_empty() && TABLES.iter().any(|t| t.0 == word) => {}
                None if !name.is_empty() && TABLES.iter().any(|t| t.0 == format!("{name}.{word}")) => {}
                None if name == "recording" && word == SET => {}
                None if name == "campaign" && word == COLUMNS => {}
                None => self.unknown(name, word, at),
            }
        }
        entries
    }

    /// The tables of the list `name` ("table.list") in `parent`; none where it is absent.
    fn list(&mut self, name: &'static str, parent: &DeTable<'_>) -> Vec<Entries> {
        let Some((line, value)) = self.below(name, parent) else { return Vec::new() };
        let tables = match value.get_ref() {
            DeValue::Array(list) if list.iter().all(|v| v.get_ref().is_table()) => list.iter().collect(),
            _ => {
                self.error("simulation", line, format!("{name} is no list of tables"), format!("write [[{name}]]"));
                Vec::new()
            }
        };
        let each = |v: &Spanned<DeValue<'_>>| {
            let line = self.line(v.span().start);
            v.get_ref().as_table().map(|t| self.entries(name, t, line))
        };
        tables.into_iter().filter_map(each).collect()
    }

    /// The table `name` ("table.inner") in `parent`; None where it is absent.
    fn table(&mut self, name: &'static str, parent: &DeTable<'_>) -> Option<Entries> {
        let (line, value) = self.below(name, parent)?;
        match value.get_ref() {
            DeValue::Table(t) => Some(self.entries(name, t, line)),
            _ => {
                self.error("simulation", line, format!("{name} is no table"), format!("write it as a table [{name}]"));
                None
            }
        }
    }

    /// Line and value of the key that comes behind the dot in `name`.
    fn below<'v, 'd>(&self, name: &str, parent: &'v DeTable<'d>) -> Option<(usize, &'v Spanned<DeValue<'d>>)> {
        let (_, key) = name.split_once('.')?;
        let (word, value) = parent.iter().find(|(word, _)| word.get_ref() == key)?;
        Some((self.line(word.span().start), value))
    }

    /// The values of `[recording.set]` in the table of a recording.
    fn settings(&mut self, recording: &DeTable<'_>) -> Vec<Setting> {
        let Some((word, value)) = recording.iter().find(|(word, _)| word.get_ref() == SET) else { return Vec::new() };
        let head = self.line(word.span().start);
        let cure = "write [recording.set] with a line \"fmu.variable\" = number for each";
        let DeValue::Table(t) = value.get_ref() else {
            self.error("recording", head, "set is no table", cure);
            return Vec::new();
        };
        let mut found = Vec::new();
        for (name, value) in t {
            let line = self.line(name.span().start);
            match number(value.get_ref()).filter(|v| v.abs() <= LARGEST) {
                Some(value) => found.push(Setting { variable: name.get_ref().to_string(), value, line }),
                None => {
                    self.error("recording", line, format!("{:?} is set to what is no number", name.get_ref()), cure)
                }
            }
        }
        found
    }

    /// The values of `[campaign.columns]` in the table [campaign].
    fn columns(&mut self, campaign: &DeTable<'_>) -> BTreeMap<String, Label> {
        let Some((word, value)) = campaign.iter().find(|(word, _)| word.get_ref() == COLUMNS) else {
            return BTreeMap::new();
        };
        let head = self.line(word.span().start);
        let DeValue::Table(t) = value.get_ref() else {
            let cure = "write [campaign.columns] with a line name = number or name = \"text\" for each";
            self.error("campaign", head, "columns is no table", cure);
            return BTreeMap::new();
        };
        let mut found = BTreeMap::new();
        for (name, value) in t {
            let (line, name) = (self.line(name.span().start), name.get_ref().as_ref());
            let named = name.len() <= NAME && name.chars().all(|c| c.is_alphanumeric() || "_-. ".contains(c));
            if !named || name.trim().is_empty() {
                let cure = format!("call it by letters, digits, spaces, \"_\", \"-\" and \".\", {NAME} bytes at most");
                self.error("campaign", line, format!("{name:?} is no name of a column"), cure);
                continue;
            }
            let label = match (value.get_ref(), number(value.get_ref()).filter(|v| v.abs() <= LARGEST)) {
                (_, Some(x)) => Some(Label::Number(x)),
                (DeValue::String(s), _) => Some(Label::Text(s.to_string())),
                _ => None,
            };
            match label {
                Some(l) => drop(found.insert(name.to_string(), l)),
                None => {
                    let cure = format!("give {name} as a number, {LARGEST:e} at most, or as a text");
                    self.error("campaign", line, format!("column {name:?} is neither number nor text"), cure);
                }
            }
        }
        found
    }

    /// A key that its table does not know: it stands in the wrong table, or is misspelt.
    fn unknown(&mut self, table: &str, word: &str, line: usize) {
        if self.errors.len() == TOLD {
            self.more += 1;
            return;
        }
        let own = TABLES.iter().find(|t| t.0 == table).unwrap_or(&TABLES[0]);
        let cure = match TABLES.iter().find(|t| t.2.iter().any(|k| k.0 == word)) {
            Some(home) => format!("it belongs {}", home.1),
            None => {
                let tables =
                    TABLES.iter().map(|t| t.0).filter(|t| table.is_empty() && !t.is_empty() && !t.contains('.'));
                words::instead(word, &own.2.iter().map(|k| k.0).chain(tables).collect::<Vec<_>>())
            }
        };
        let more = if table == "campaign" { "; a column of your own stands under [campaign.columns]" } else { "" };
        self.error(table, line, format!("key {:?} is not known {}", words::beginning(word), own.1), cure + more);
    }

    /// The value of `key` of a table, or None and an error.
    fn value(&mut self, table: &str, key: &Key, value: &Spanned<DeValue<'_>>) -> Option<Value> {
        let Key(name, rule, unit) = *key;
        let line = self.line(value.span().start);
        let inside = if unit.is_empty() { String::new() } else { format!(", in {unit}") };
        let cure = match rule {
            Rule::Above => format!("give {name} as a number above 0{inside}"),
            Rule::FromZero => format!("give {name} as a number from 0 on{inside}"),
            Rule::Number => format!("give {name} as a number{inside}"),
            Rule::Text => format!("write {name} = \"...\""),
            Rule::Texts => format!("write {name} = [\"...\", \"...\"]"),
            Rule::Label => format!("give {name} as a number or a text"),
        };
        let amount = match (value.get_ref(), rule) {
            (DeValue::String(s), Rule::Above | Rule::FromZero | Rule::Number) => match amount(s, unit) {
                Ok(x) => Some(x),
                // a word is no amount
                Err(_) if !s.trim().starts_with(|c: char| c.is_ascii_digit() || "+-.,".contains(c)) => None,
                Err(why) => {
                    self.error(table, line, format!("{name} = {s:?}: {why}"), cure);
                    return None;
                }
            },
            (v, _) => number(v),
        };
        match (rule, value.get_ref(), amount) {
            (Rule::Text | Rule::Label, DeValue::String(s), _) => return Some(Value::Text(s.to_string())),
            (Rule::Texts, DeValue::Array(list), _) => {
                let mut texts = Vec::new();
                for v in list {
                    let at = self.line(v.span().start);
                    match v.get_ref().as_str() {
                        Some(s) => texts.push((s.to_string(), at)),
                        None => self.error(table, at, format!("{name} holds what is no text"), cure.clone()),
                    }
                }
                return Some(Value::Texts(texts));
            }
            (Rule::Text | Rule::Texts, ..) => {}
            (_, _, Some(x)) => {
                let right = match rule {
                    Rule::Above => x > 0.0,
                    Rule::FromZero => x >= 0.0,
                    _ => true,
                };
                if right && x.abs() <= LARGEST {
                    return Some(Value::Number(x));
                }
                let (x, cure) = match x.abs() > LARGEST {
                    true => (format!("{x:e}"), format!("{cure}, {LARGEST:e} at most")),
                    false => (x.to_string(), cure),
                };
                self.error(table, line, format!("{name} = {x} is out of range"), cure);
                return None;
            }
            _ => {}
        }
        self.error(table, line, format!("{name} is of the wrong type"), cure);
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_many_unknown_keys_the_first_are_told_with_their_line_and_the_others_counted() {
        let text = |n: usize| (0..n).fold(String::from("[rig]\n"), |text, i| text + &format!("a{i} = 1\n"));
        let errors = |n: usize| read(Path::new("campaign.toml"), &text(n)).unwrap_or_else(|_| panic!("it is TOML")).1;
        let all = errors(TOLD);
        // keys may come in any order
        let last = all.iter().find(|e| e.what.contains("\"a999\"")).unwrap();
        assert_eq!((all.len(), last.line), (TOLD, 1001));
        let most = errors(200_000);
        assert_eq!(most.len(), TOLD + 1);
        assert!(most[TOLD]
            .to_string()
            .contains("campaign.toml: 199000 faults more are not told; correct those that are"));
        // what is no TOML in every line
        let broken = "= 1\n".repeat(200_000);
        let errors = read(Path::new("campaign.toml"), &broken).err().unwrap();
        assert!(errors.len() <= TOLD + 1, "{}", errors.len());
    }

    #[test]
    fn a_key_without_an_end_is_not_repeated_whole() {
        let text = format!("{} = 1\n", "k".repeat(3_000_000));
        let (_, errors) = read(Path::new("campaign.toml"), &text).unwrap_or_else(|_| panic!("it is TOML"));
        assert!(errors[0].to_string().len() < 1000 && errors[0].what.contains("kkk... (3000000 bytes)"));
    }
}
