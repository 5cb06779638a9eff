//! Packs a model into an FMU: description, binaries with their start values, icon, documentation, licence.
//!
//! The same input gives the same bytes: no clock, no path, no order of a file system gets in.

mod archive;
mod description;
mod documentation;
pub mod generate;
mod label;
mod library;

pub use archive::{is_archive_of_ours, write_archive};
pub use label::{source_date, Label};
pub use library::{is_ours, library, lies_at, program, whole, Binary};

use anyhow::{bail, ensure, Context, Result};
use hysteresis_contact::variables::{self, Role, Settings, LOG_CATEGORIES, MODEL, PARAMETERS, PARAMETER_TABLE};
use law::part::Item;
use record::words;
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

/// The element's page: its source.
const PAGE: &str = include_str!("../../../modelDescription/documentation/index.html");

/// The description's source.
pub const DESCRIPTION: &str = include_str!("../../../modelDescription/modelDescription.xml");

/// What to set in a simulator: a page of every FMU.
const COSIMULATION: &str = include_str!("../../../modelDescription/documentation/cosimulation.html");

/// What goes in as it stands: path inside the FMU, bytes.
const ATTACHED: [(&str, &[u8]); 3] = [
    (
        "documentation/licenses/LICENSE.txt",
        include_bytes!("../../../modelDescription/documentation/licenses/LICENSE.txt"),
    ),
    (
        "documentation/licenses/license.spdx",
        include_bytes!("../../../modelDescription/documentation/licenses/license.spdx"),
    ),
    ("model.png", include_bytes!("../../../modelDescription/model.png")),
];

/// A variable as its table has it.
struct Entry {
    name: &'static str,
    reference: u32,
    kind: String,
    /// The items of an Enumeration, numbered from 0 on; none for other types.
    items: &'static [Item],
    unit: &'static str,
    /// For a parameter: (place among the parameters, whether it may change between steps).
    parameter: Option<(usize, bool)>,
}

/// A model of this workspace: what its library and its description have to agree on.
pub struct Model {
    /// Its name, and its library's inside an FMU.
    pub name: &'static str,
    /// The library as cargo names it.
    stem: &'static str,
    description: &'static str,
    documentation: fn(&[f64], &Label) -> Result<String>,
    table: Vec<Entry>,
    categories: &'static [&'static str],
    defaults: Vec<f64>,
    validate: fn(&[f64]) -> Result<(), String>,
}

/// The model whose variables are in `$variables` and whose folder below fmu/, and library as cargo names it, is `$stem`: all
/// of its parameters are fixed Reals.
macro_rules! of_table {
    ($variables:ident, $stem:literal) => {{
        use $variables as table;
        let signals = (0..table::SIGNALS.len()).map(|i| (i as u32, None));
        let parameters = (0..table::PARAMETERS).map(|i| (table::FIRST_PARAMETER + i as u32, Some((i, false))));
        let entry = |(reference, parameter)| {
            let v = table::by_reference(reference)?;
            let kind = format!("{:?}", v.kind);
            Some(Entry { name: v.name, reference, kind, items: &[], unit: v.unit, parameter })
        };
        Model {
            name: table::MODEL,
            stem: $stem,
            description: include_str!(concat!("../../../fmu/", $stem, "/modelDescription.xml")),
            documentation: |_, _| {
                documentation::plain(include_str!(concat!("../../../fmu/", $stem, "/documentation/index.html")))
            },
            table: signals.chain(parameters).filter_map(entry).collect(),
            categories: &table::LOG_CATEGORIES,
            defaults: table::PARAMETER_TABLE.iter().map(|p| p.start).collect(),
            validate: |values| {
                let mut s = table::Settings::default();
                for (i, v) in values.iter().enumerate() {
                    s.set(i, *v);
                }
                s.validate()
            },
        }
    }};
}

impl Model {
    /// The contact element.
    pub fn contact() -> Model {
        let entry = |v: variables::Variable| {
            let parameter = match v.role {
                Role::Parameter(i) => Some((i, &PARAMETER_TABLE[i])),
                _ => None,
            };
            let items = parameter.map_or(&[][..], |(_, p)| p.items);
            let kind = if items.is_empty() { format!("{:?}", v.kind) } else { "Enumeration".into() };
            let parameter = parameter.map(|(i, p)| (i, p.tunable));
            Entry { name: v.name, reference: v.reference, kind, items, unit: v.unit, parameter }
        };
        Model {
            name: MODEL,
            stem: "hysteresis_contact",
            description: DESCRIPTION,
            documentation: |values, label| {
                let s = settings(values);
                documentation::contact(PAGE, &s.law, s.effective_mass, label)
            },
            table: variables::all().map(entry).collect(),
            categories: &LOG_CATEGORIES,
            defaults: (0..PARAMETERS).map(|i| Settings::default().get(i)).collect(),
            validate: |values| settings(values).validate(),
        }
    }

    /// The moving bar, the contact's partner.
    pub fn moving_bar() -> Model {
        of_table!(moving_bar_variables, "moving_bar")
    }

    /// Forces on a body, put between a contact and the body.
    pub fn body_force() -> Model {
        of_table!(body_force_variables, "body_force")
    }

    /// All of them, by their names on the command line.
    pub fn all() -> [(&'static str, Model); 3] {
        [("contact", Model::contact()), ("moving-bar", Model::moving_bar()), ("body-force", Model::body_force())]
    }

    /// The model of a name given on the command line: contact, moving-bar or body-force.
    ///
    /// # Errors
    /// Another name.
    pub fn named(name: &str) -> Result<Model> {
        let all = Model::all();
        let names = all.iter().map(|m| m.0).collect::<Vec<_>>();
        let why = || format!("{name} is no model; {}", record::words::instead(name, &names));
        all.into_iter().find(|m| m.0 == name).map(|m| m.1).with_context(why)
    }

    fn place(&self, parameter: &str) -> Option<usize> {
        self.table.iter().find(|e| e.name == parameter).and_then(|e| e.parameter).map(|p| p.0)
    }

    /// The parameter of a name.
    ///
    /// # Errors
    /// No such parameter: names the nearest, and those there are.
    fn parameter(&self, name: &str) -> Result<&Entry> {
        let all: Vec<&Entry> = self.table.iter().filter(|e| e.parameter.is_some()).collect();
        let names: Vec<&str> = all.iter().map(|e| e.name).collect();
        Ok(all[words::place("parameter", name, &names).map_err(anyhow::Error::msg)?])
    }

    /// Value of a parameter as it is written: a number, or an item's name where it is a choice.
    ///
    /// # Errors
    /// No such parameter or item (names the nearest, and those there are); no number.
    pub fn number(&self, parameter: &str, text: &str) -> Result<f64> {
        let e = self.parameter(parameter)?;
        match text.parse() {
            Ok(number) => Ok(number),
            Err(_) if e.items.is_empty() => bail!("{parameter} is {text:?}: give a number"),
            Err(_) => {
                let names: Vec<&str> = e.items.iter().map(|i| i.name).collect();
                Ok(words::place(parameter, text, &names).map_err(anyhow::Error::msg)? as f64)
            }
        }
    }

    /// Values of all parameters, those named as given, the rest as by default.
    ///
    /// # Errors
    /// No such parameter (names the nearest, and those there are); out of its range; not a whole number where one is
    /// wanted.
    pub fn values(&self, starts: &[(String, f64)]) -> Result<Vec<f64>> {
        let mut values = self.defaults.clone();
        for (name, value) in starts {
            let e = self.parameter(name)?;
            ensure!(
                e.kind == "Real" || (value.fract() == 0.0 && value.abs() < 1e9),
                "{name} is {value}: give a whole number"
            );
            if let Some((i, _)) = e.parameter {
                values[i] = *value;
            }
        }
        (self.validate)(&values).map_err(anyhow::Error::msg)?;
        Ok(values)
    }

    /// The bytes of an FMU with the libraries given and `starts` as start values, and nothing else described.
    ///
    /// # Errors
    /// As [`Model::labelled`].
    pub fn archive(&self, starts: &[(String, f64)], binaries: &[Binary]) -> Result<Vec<u8>> {
        self.labelled(starts, binaries, &Label::default())
    }

    /// Writes an FMU to `out` with the libraries given and `starts` as start values. What lies there and is no FMU of ours is kept
    /// under another name, which is returned.
    ///
    /// # Errors
    /// As [`Model::archive`]; a file that cannot be written (none is left half-written).
    pub fn pack(&self, out: &Path, starts: &[(String, f64)], binaries: &[Binary]) -> Result<Option<output::Kept>> {
        write_archive(out, &self.archive(starts, binaries)?, "modelDescription.xml")
    }

    /// Packs the model of this machine into a folder, for a run of its own.
    ///
    /// # Errors
    /// As [`Model::built_library`] and [`Model::pack`].
    pub fn into_folder(&self, folder: &Path, starts: &[(String, f64)]) -> Result<PathBuf> {
        let out = folder.join(format!("{}.fmu", self.name));
        self.pack(&out, starts, &[self.built_library()?])?;
        Ok(out)
    }

    /// The bytes of an FMU with the libraries given and `starts` as start values, described as `label` says.
    ///
    /// # Errors
    /// As [`Model::values`]; a library that is not the model's; description and variable table at odds;
    /// SOURCE_DATE_EPOCH that is no time.
    pub fn labelled(&self, starts: &[(String, f64)], binaries: &[Binary], label: &Label) -> Result<Vec<u8>> {
        ensure!(!binaries.is_empty(), "no library to pack: give one at least");
        self.check(self.description)?;
        let values = self.values(starts)?;
        let label = label.clone().dated()?;
        let guid = guid(&self.described("", &values, &label)?);
        let mut files: BTreeMap<String, Vec<u8>> = BTreeMap::new();
        for (path, bytes) in ATTACHED {
            files.insert(path.into(), bytes.to_vec());
        }
        files.insert("documentation/cosimulation.html".into(), documentation::plain(COSIMULATION)?.into_bytes());
        files.insert("documentation/index.html".into(), (self.documentation)(&values, &label)?.into_bytes());
        for b in binaries {
            let patched =
                library::patch(&b.bytes, &guid, &values).with_context(|| format!("library for {}", b.platform))?;
            files.insert(format!("binaries/{}/{}", b.platform, self.library_name(&b.platform)?), patched);
        }
        let mut zip = zip::ZipWriter::new(Cursor::new(Vec::new()));
        let options = |mode| {
            zip::write::SimpleFileOptions::default()
                .compression_method(zip::CompressionMethod::Deflated)
                .last_modified_time(zip::DateTime::default())
                .unix_permissions(mode)
        };
        zip.start_file("modelDescription.xml", options(0o644))?;
        zip.write_all(self.described(&guid, &values, &label)?.as_bytes())?;
        for (path, bytes) in &files {
            zip.start_file(path.as_str(), options(if path.starts_with("binaries") { 0o755 } else { 0o644 }))?;
            zip.write_all(bytes)?;
        }
        Ok(zip.finish()?.into_inner())
    }
}

/// Whether the element holds a mechanism of that name.
pub fn holds(mechanism: &str) -> bool {
    law::parts::MECHANISMS.iter().any(|m| m.name == mechanism)
}

/// Name of the item that a value of the element's parameter stands for; None where it is no choice.
pub fn item(parameter: &str, value: f64) -> Option<&'static str> {
    let items = law::parts::parameter(parameter)?.kind.items();
    items.iter().enumerate().find(|(n, _)| *n as f64 == value).map(|(_, i)| i.name)
}

/// The element's settings with these values of its parameters.
fn settings(values: &[f64]) -> Settings {
    let mut s = Settings::default();
    for (i, v) in values.iter().enumerate() {
        s.set(i, *v);
    }
    s
}

/// A GUID that changes with the description, start values and all.
fn guid(description: &str) -> String {
    let hex = output::hexadecimal(&Sha256::digest(description.as_bytes())[..16]);
    format!("{{{}-{}-{}-{}-{}}}", &hex[..8], &hex[8..12], &hex[12..16], &hex[16..20], &hex[20..])
}

/// Packs the element of this machine into a folder, for a run of its own.
///
/// # Errors
/// As [`Model::into_folder`].
pub fn into_folder(folder: &Path, starts: &[(String, f64)]) -> Result<PathBuf> {
    Model::contact().into_folder(folder, starts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn start_values_reach_library_and_description_and_change_the_guid() {
        let element = Model::contact();
        let mut library = vec![7u8; 100];
        library.extend(face::start::MARKER);
        library.extend(face::start::UNPACKED_GUID);
        library.extend(face::start::count(PARAMETERS));
        library.extend(vec![0u8; 8 * PARAMETERS + 50]);
        let b = Binary { platform: "linux64".into(), bytes: library };
        let starts = [("stiffness".to_string(), 2.5e9), ("plastic_form".to_string(), 1.0)];
        let (one, again) = (
            element.archive(&starts, std::slice::from_ref(&b)).unwrap(),
            element.archive(&starts, std::slice::from_ref(&b)).unwrap(),
        );
        assert_eq!(one, again);
        let other = element.archive(&[], std::slice::from_ref(&b)).unwrap();
        let text = |bytes: Vec<u8>| {
            let mut z = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
            std::io::read_to_string(z.by_name("modelDescription.xml").unwrap()).unwrap()
        };
        let (one, other) = (text(one), text(other));
        assert!(one.contains("start=\"2.5e9\"") && !other.contains("start=\"2.5e9\""), "{one}");
        let guid = |t: &str| t.split("guid=\"").nth(1).unwrap()[..38].to_string();
        assert_ne!(guid(&one), guid(&other));
        assert!(element.archive(&[("stiffnes".into(), 1.0)], std::slice::from_ref(&b)).is_err());
        assert!(element.archive(&[("stiffness".into(), -1.0)], std::slice::from_ref(&b)).is_err());
        let mut older = b.clone();
        assert!(element.archive(&[("plastic_form".into(), 0.5)], &[b]).is_err());
        let at = older.bytes.windows(16).position(|w| w == face::start::MARKER).unwrap();
        older.bytes[at + face::start::COUNT_OFFSET] -= 1;
        let e = format!("{:#}", element.archive(&[], &[older]).unwrap_err());
        assert!(e.contains(&format!("has {} parameters", PARAMETERS - 1)), "{e}");
        let foreign = Binary { platform: "linux64".into(), bytes: vec![0; 1000] };
        assert!(element.archive(&[], &[foreign]).is_err());
    }
    #[test]
    fn what_a_label_tells_stands_in_the_description_and_changes_the_guid() {
        let element = Model::contact();
        let mut values = element.values(&[]).unwrap();
        values[0] = 2.5e9;
        let plain = element.described("", &values, &Label::default()).unwrap();
        assert!(plain.contains("modelName=\"HysteresisContact\"") && !plain.contains("generationDateAndTime"));
        // a start value is its own nominal value, and what is 0 keeps that of its unit
        assert!(plain.contains("nominal=\"2.5e9\" start=\"2.5e9\""), "{plain}");
        assert!(plain.contains("nominal=\"1e7\" start=\"0\""));
        let label = Label {
            name: Some("drop".into()),
            description: Some("a < \"b\" & c".into()),
            made: Some(0),
            nominals: vec![("force", 812.0), ("velocity", 0.0)],
            ..Label::default()
        };
        let described = element.described("", &values, &label).unwrap();
        for wanted in [
            "modelName=\"HysteresisContact_drop\"",
            "modelIdentifier=\"HysteresisContact\"",
            "generationDateAndTime=\"1970-01-01T00:00:00Z\"",
            "&lt; &quot;b&quot; &amp; c",
            "nominal=\"812\"",
        ] {
            assert!(described.contains(wanted), "{wanted}: {described}");
        }
        assert!(!described.contains("nominal=\"0\""));
        assert_ne!(guid(&plain), guid(&described));
    }

    #[test]
    fn a_choice_is_given_by_name_or_number_and_a_slip_is_told_with_the_nearest() {
        let element = Model::contact();
        let number = |name, text| element.number(name, text).map_err(|e| format!("{e:#}"));
        assert_eq!((number("adhesion_form", "leaving"), number("adhesion_form", "3")), (Ok(3.0), Ok(3.0)));
        assert_eq!(number("stiffness", "2e9"), Ok(2e9));
        let refused = |name, text, wanted: &str| {
            let e = number(name, text).unwrap_err();
            assert!(e.contains(wanted), "{e}");
        };
        refused("adhesion_form", "leavin", "adhesion_form \"leavin\" is not known; did you mean \"leaving\"?");
        refused("adhesion_from", "1", "did you mean \"adhesion_form\"?");
        refused("stiffness", "hard", "stiffness is \"hard\": give a number");
        assert_eq!(
            (item("adhesion_form", 4.0), item("adhesion_form", 5.0), item("stiffness", 1.0)),
            (Some("growing"), None, None)
        );
    }
}
