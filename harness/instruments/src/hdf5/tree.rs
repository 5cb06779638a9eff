//! All groups and datasets of a file, each group once however often it is linked.

use super::attributes::{self, Value};
use super::Dialect;
use hdf5_reader::error::Result;
use hdf5_reader::group::Group;
use hdf5_reader::{Dataset, Hdf5File};
use std::collections::HashSet;

/// A group and what lies directly in it.
pub(super) struct Folder {
    /// Without `/` at its start; empty for the root.
    pub path: String,
    pub attributes: Vec<Value>,
    /// Index of the folder above; None for the root.
    pub above: Option<usize>,
    pub datasets: Vec<Dataset>,
}

/// The folders of a file, each before those in it, in the file's order.
pub(super) fn folders(file: &Hdf5File, dialect: Dialect) -> Result<Vec<Folder>> {
    let mut all = Vec::new();
    let mut seen = HashSet::new();
    let mut next: Vec<(Group, String, Option<usize>)> = vec![(file.root_group()?, String::new(), None)];
    while let Some((group, path, above)) = next.pop() {
        if !seen.insert(group.address()) {
            continue;
        }
        let (groups, datasets) = group.members()?;
        let here = all.len();
        let of = |g: Group| {
            let name = g.name().to_string();
            (!is_hidden(&name, dialect)).then(|| (g, join(&path, &name), Some(here)))
        };
        next.extend(groups.into_iter().filter_map(of).rev());
        all.push(Folder { path, attributes: attributes::values(&group.attributes()?), above, datasets });
    }
    Ok(all)
}

/// MATLAB keeps the contents of cells and objects in groups of its own.
fn is_hidden(name: &str, dialect: Dialect) -> bool {
    dialect == Dialect::Matlab && name.starts_with('#')
}

pub(super) fn join(path: &str, name: &str) -> String {
    if path.is_empty() {
        name.to_string()
    } else {
        format!("{path}/{name}")
    }
}
