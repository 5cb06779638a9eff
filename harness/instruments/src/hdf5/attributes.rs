//! Attributes and small datasets as text and numbers.

use super::element::{is_number, Number};
use hdf5_reader::Attribute;

/// Numbers and texts of an attribute that are read; longer lists are data, not descriptions.
const LIST: usize = 64;

/// A named value of a group or dataset.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Value {
    pub name: String,
    pub texts: Vec<String>,
    /// Where it is one number.
    pub number: Option<f64>,
    /// The unit of the value itself, where the file gives it one.
    pub unit: String,
}

impl Value {
    pub(super) fn text(&self) -> String {
        self.texts.join(", ")
    }

    pub(super) fn of_numbers(name: &str, numbers: &[f64], unit: String) -> Value {
        let number = if let [one] = numbers { Some(*one) } else { None };
        Value { name: name.into(), texts: numbers.iter().map(f64::to_string).collect(), number, unit }
    }

    pub(super) fn of_texts(name: &str, texts: Vec<String>) -> Value {
        let texts = texts.iter().map(|t| t.trim_matches(['\0', ' ', '\r', '\n']).to_string()).collect();
        Value { name: name.into(), texts, number: None, unit: String::new() }
    }
}

/// The attributes that describe: numbers and texts, without those by which libraries keep their own books.
pub(super) fn values(of: &[Attribute]) -> Vec<Value> {
    of.iter().filter(|a| !is_bookkeeping(&a.name)).filter_map(value).collect()
}

fn value(of: &Attribute) -> Option<Value> {
    if of.num_elements().ok()? > LIST as u64 {
        return None;
    }
    if is_number(&of.datatype) {
        let numbers: Vec<f64> = of.read_1d::<Number>().ok()?.iter().map(|n| n.0).collect();
        return (!numbers.is_empty()).then(|| Value::of_numbers(&of.name, &numbers, String::new()));
    }
    let texts = of.read_strings().or_else(|_| of.read_string().map(|t| vec![t])).ok()?;
    Some(Value::of_texts(&of.name, texts)).filter(|v| v.texts.iter().any(|t| !t.is_empty()))
}

fn is_bookkeeping(name: &str) -> bool {
    const NAMES: [&str; 12] = [
        "CLASS",
        "NAME",
        "DIMENSION_LIST",
        "REFERENCE_LIST",
        "DIMENSION_LABELS",
        "H5PATH",
        "TITLE",
        "VERSION",
        "FLAVOR",
        "PYTABLES_FORMAT_VERSION",
        "_FillValue",
        "_NCProperties",
    ];
    NAMES.contains(&name) || ["MATLAB_", "_Netcdf4", "_nc3_", "Python."].iter().any(|p| name.starts_with(p))
}

/// The units that attributes give: one, or one for each channel of the dataset.
pub(super) fn units(of: &[Value]) -> Vec<String> {
    const NAMES: [&str; 7] =
        ["unit", "units", "unitstring", "physicalunit", "engineeringunit", "engineeringunits", "einheit"];
    of.iter()
        .find(|v| v.number.is_none() && NAMES.contains(&plain(&v.name).as_str()))
        .map_or(Vec::new(), |v| v.texts.clone())
}

/// The names that attributes give to the channels of a dataset of two axes, where they are `count`.
pub(super) fn names(of: &[Value], count: usize) -> Option<Vec<String>> {
    const NAMES: [&str; 7] = ["columns", "columnnames", "channels", "channelnames", "names", "labels", "fields"];
    of.iter()
        .find(|v| v.texts.len() == count && v.number.is_none() && NAMES.contains(&plain(&v.name).as_str()))
        .map(|v| v.texts.clone())
}

/// A name as it is compared: lower case, without separators.
pub(super) fn plain(name: &str) -> String {
    name.chars().filter(|c| !matches!(c, '_' | '-' | ' ' | '.')).flat_map(char::to_lowercase).collect()
}
