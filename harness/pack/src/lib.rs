//! Packs a model into an FMU: description, binaries with their start values, icon, documentation, licence.
//!
//! The same input gives the same bytes: no clock, no path, no order of a file system gets in.

mod description;
pub mod generate;
mod library;

pub use library::{library, Binary};

use anyhow::{bail, ensure, Context, Result};
use hysteresis_contact::variables::{self, Role, Settings, LOG_CATEGORIES, MODEL, PARAMETERS, PARAMETER_TABLE};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};

/// The description's source.
pub const DESCRIPTION: &str = include_str!("../../../modelDescription/modelDescription.xml");

/// What goes in as it stands: path inside the FMU, bytes.
const ATTACHED: [(&str, &[u8]); 5] = [
    ("documentation/cosimulation.html", include_bytes!("../../../modelDescription/documentation/cosimulation.html")),
    ("documentation/index.html", include_bytes!("../../../modelDescription/documentation/index.html")),
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
    documentation: Option<&'static [u8]>,
    table: Vec<Entry>,
    categories: &'static [&'static str],
    defaults: Vec<f64>,
    validate: fn(&[f64]) -> Result<(), String>,
}

impl Model {
    /// The contact element.
    pub fn contact() -> Model {
        let table = variables::all().map(|v| Entry {
            name: v.name,
            reference: v.reference,
            kind: format!("{:?}", v.kind),
            unit: v.unit,
            parameter: match v.role {
                Role::Parameter(i) => Some((i, PARAMETER_TABLE[i].tunable)),
                _ => None,
            },
        });
        Model {
            name: MODEL,
            stem: "hysteresis_contact",
            description: DESCRIPTION,
            documentation: None,
            table: table.collect(),
            categories: &LOG_CATEGORIES,
            defaults: (0..PARAMETERS).map(|i| Settings::default().get(i)).collect(),
            validate: |values| {
                let mut s = Settings::default();
                for (i, v) in values.iter().enumerate() {
                    s.set(i, *v);
                }
                s.validate()
            },
        }
    }

    /// The moving bar, the contact's partner.
    pub fn moving_bar() -> Model {
        use moving_bar_variables as bar;
        let signals = (0..bar::SIGNALS.len()).map(|i| (i as u32, None));
        let parameters = (0..bar::PARAMETERS).map(|i| (bar::FIRST_PARAMETER + i as u32, Some((i, false))));
        let entry = |(reference, parameter)| {
            let v = bar::by_reference(reference)?;
            Some(Entry { name: v.name, reference, kind: format!("{:?}", v.kind), unit: v.unit, parameter })
        };
        Model {
            name: bar::MODEL,
            stem: "moving_bar",
            description: include_str!("../../../fmu/moving_bar/modelDescription.xml"),
            documentation: Some(include_bytes!("../../../fmu/moving_bar/documentation/index.html")),
            table: signals.chain(parameters).filter_map(entry).collect(),
            categories: &bar::LOG_CATEGORIES,
            defaults: bar::PARAMETER_TABLE.iter().map(|p| p.start).collect(),
            validate: |values| {
                let mut s = bar::Settings::default();
                for (i, v) in values.iter().enumerate() {
                    s.set(i, *v);
                }
                s.validate()
            },
        }
    }

    /// The model of a name given on the command line: contact or moving-bar.
    ///
    /// # Errors
    /// Another name.
    pub fn named(name: &str) -> Result<Model> {
        match name {
            "contact" => Ok(Model::contact()),
            "moving-bar" => Ok(Model::moving_bar()),
            _ => bail!("{name} is no model; {}", record::words::instead(name, &["contact", "moving-bar"])),
        }
    }

    fn place(&self, parameter: &str) -> Option<usize> {
        self.table.iter().find(|e| e.name == parameter).and_then(|e| e.parameter).map(|p| p.0)
    }

    /// Values of all parameters, those named as given, the rest as by default.
    ///
    /// # Errors
    /// No such parameter (names those there are); out of its range; not a whole number where one is wanted.
    pub fn values(&self, starts: &[(String, f64)]) -> Result<Vec<f64>> {
        let mut values = self.defaults.clone();
        for (name, value) in starts {
            let Some(e) = self.table.iter().find(|e| e.name == name && e.parameter.is_some()) else {
                let names: Vec<&str> = self.table.iter().filter(|e| e.parameter.is_some()).map(|e| e.name).collect();
                bail!("{name} is no parameter; {}", record::words::instead(name, &names));
            };
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

    /// Writes an FMU to `out` with the libraries given and `starts` as start values.
    ///
    /// # Errors
    /// As [`Model::archive`]; a file that cannot be written (none is left half-written).
    pub fn pack(&self, out: &Path, starts: &[(String, f64)], binaries: &[Binary]) -> Result<()> {
        let bytes = self.archive(starts, binaries)?;
        output::write(out, &bytes).with_context(|| format!("{}: cannot be written", out.display()))
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

    /// The bytes of the FMU that [`Model::pack`] writes.
    ///
    /// # Errors
    /// As [`Model::values`]; a library that is not the model's; description and variable table at odds.
    pub fn archive(&self, starts: &[(String, f64)], binaries: &[Binary]) -> Result<Vec<u8>> {
        ensure!(!binaries.is_empty(), "no library to pack: give one at least");
        self.check(self.description)?;
        let values = self.values(starts)?;
        let guid = guid(self.description, &values);
        let mut files: BTreeMap<String, Vec<u8>> = BTreeMap::new();
        for (path, bytes) in ATTACHED {
            files.insert(path.into(), bytes.to_vec());
        }
        if let Some(page) = self.documentation {
            files.insert("documentation/index.html".into(), page.to_vec());
        }
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
        zip.write_all(self.described(&guid, &values)?.as_bytes())?;
        for (path, bytes) in &files {
            zip.start_file(path.as_str(), options(if path.starts_with("binaries") { 0o755 } else { 0o644 }))?;
            zip.write_all(bytes)?;
        }
        Ok(zip.finish()?.into_inner())
    }
}

/// The element's library of this machine, as cargo left it beside the running program.
///
/// # Errors
/// Where it is not there: says where it was looked for.
pub fn built_library() -> Result<Binary> {
    Model::contact().built_library()
}

/// The bytes of the element's FMU.
///
/// # Errors
/// As [`Model::archive`].
pub fn archive(starts: &[(String, f64)], binaries: &[Binary]) -> Result<Vec<u8>> {
    Model::contact().archive(starts, binaries)
}

/// A GUID that changes with the description or a start value.
fn guid(description: &str, values: &[f64]) -> String {
    let mut h = Sha256::new();
    h.update(description.as_bytes());
    for v in values {
        h.update(v.to_le_bytes());
    }
    let hex: String = h.finalize().iter().take(16).map(|b| format!("{b:02x}")).collect();
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
        let mut library = vec![7u8; 100];
        library.extend(face::start::MARKER);
        library.extend(face::start::UNPACKED_GUID);
        library.extend(face::start::count(PARAMETERS));
        library.extend(vec![0u8; 8 * PARAMETERS + 50]);
        let b = Binary { platform: "linux64".into(), bytes: library };
        let starts = [("stiffness".to_string(), 2.5e9), ("plastic_form".to_string(), 1.0)];
        let (one, again) =
            (archive(&starts, std::slice::from_ref(&b)).unwrap(), archive(&starts, std::slice::from_ref(&b)).unwrap());
        assert_eq!(one, again);
        let other = archive(&[], std::slice::from_ref(&b)).unwrap();
        let text = |bytes: Vec<u8>| {
            let mut z = zip::ZipArchive::new(Cursor::new(bytes)).unwrap();
            std::io::read_to_string(z.by_name("modelDescription.xml").unwrap()).unwrap()
        };
        let (one, other) = (text(one), text(other));
        assert!(one.contains("start=\"2.5e9\"") && !other.contains("start=\"2.5e9\""), "{one}");
        let guid = |t: &str| t.split("guid=\"").nth(1).unwrap()[..38].to_string();
        assert_ne!(guid(&one), guid(&other));
        assert!(archive(&[("stiffnes".into(), 1.0)], std::slice::from_ref(&b)).is_err());
        assert!(archive(&[("stiffness".into(), -1.0)], std::slice::from_ref(&b)).is_err());
        let mut older = b.clone();
        assert!(archive(&[("plastic_form".into(), 0.5)], &[b]).is_err());
        let at = older.bytes.windows(16).position(|w| w == face::start::MARKER).unwrap();
        older.bytes[at + face::start::COUNT_OFFSET] -= 1;
        let e = format!("{:#}", archive(&[], &[older]).unwrap_err());
        assert!(e.contains(&format!("has {} parameters", PARAMETERS - 1)), "{e}");
        let foreign = Binary { platform: "linux64".into(), bytes: vec![0; 1000] };
        assert!(archive(&[], &[foreign]).is_err());
    }
}
