//! MATLAB's conventions in HDF5: text as numbers, cells and arrays of structs as references.

use super::Dialect;
use hdf5_reader::reference::read_object_references;
use hdf5_reader::{Dataset, Datatype, Hdf5File};
use std::collections::HashMap;

/// References of one cell array that are followed, at most.
const FOLLOWED: u64 = 4096;
/// Characters of a text, at most.
const TEXT: u64 = 1 << 16;

/// What references point at: the datasets of the hidden group `#refs#`, by address.
pub(super) struct References(Option<(HashMap<u64, Dataset>, u8)>);

impl References {
    pub(super) fn of(file: &Hdf5File, dialect: Dialect) -> References {
        if dialect == Dialect::Plain {
            return References(None);
        }
        let hidden = file.group("#refs#").and_then(|g| g.datasets()).unwrap_or_default();
        References(Some((hidden.into_iter().map(|d| (d.address(), d)).collect(), file.superblock().offset_size)))
    }

    /// The named datasets behind `dataset`: itself, or what its references point at, as `name{1}`, `name{2}` ...
    pub(super) fn resolve(&self, dataset: &Dataset, notes: &mut Vec<String>) -> Vec<(String, Dataset)> {
        let name = dataset.name().to_string();
        let Some((known, address_size)) = self.0.as_ref() else { return vec![(name, dataset.clone())] };
        if is_empty(dataset) {
            return Vec::new();
        }
        if !matches!(dataset.dtype(), Datatype::Reference { .. }) {
            return vec![(name, dataset.clone())];
        }
        let followed = dataset.num_elements().is_ok_and(|n| n <= FOLLOWED);
        let bytes = if followed { dataset.read_raw_bytes().unwrap_or_default() } else { Vec::new() };
        let targets = read_object_references(&bytes, *address_size).unwrap_or_default();
        let found: Vec<(String, Dataset)> = (1..)
            .zip(&targets)
            .filter_map(|(i, address)| Some((format!("{name}{{{i}}}"), known.get(address)?.clone())))
            .filter(|(_, d)| !is_empty(d) && !matches!(d.dtype(), Datatype::Reference { .. }))
            .collect();
        if found.is_empty() {
            notes.push(format!(
                "\"{name}\" left out: a cell array or an array of structs whose contents are not arrays"
            ));
        }
        found
    }
}

/// An empty array stores its size in place of its elements.
fn is_empty(dataset: &Dataset) -> bool {
    dataset.attribute("MATLAB_empty").is_ok_and(|a| a.read_as_f64().is_ok_and(|n| n != 0.0))
}

/// The text of a char array, in UTF-16; rows follow each other.
pub(super) fn text(dataset: &Dataset) -> Option<String> {
    let class = dataset.attribute("MATLAB_class").ok()?.read_string().ok()?;
    if class.trim_end_matches('\0') != "char" || dataset.num_elements().ok()? > TEXT {
        return None;
    }
    let codes: Vec<u16> = dataset.read_array::<u16>().ok()?.t().iter().copied().collect();
    Some(String::from_utf16_lossy(&codes))
}
