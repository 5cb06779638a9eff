//! A model of this workspace packed as an FMU.

use crate::place;
use anyhow::{Context, Result};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// What to pack.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// contact, moving-bar or body-force.
    pub model: String,
    /// The FMU to write.
    pub out: PathBuf,
    /// Start values of parameters: name, and a number or the name of a choice.
    pub starts: Vec<(String, String)>,
    /// Libraries to pack, PLATFORM=FILE; empty: those that lie ready and this machine's.
    pub binaries: Vec<String>,
    /// Whether to build the libraries of the other platforms.
    pub all_platforms: bool,
    /// Folder of libraries that lie ready; None: where [`pack::Model::libraries`] looks.
    pub platforms: Option<PathBuf>,
}

/// What was packed.
#[derive(Serialize)]
pub struct Packed {
    pub fmu: PathBuf,
    pub platforms: Vec<String>,
    /// Start values given, SI.
    pub starts: BTreeMap<String, f64>,
    /// That a file in its place was none of ours, and what it is called now.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub kept: Option<String>,
}

/// Packs a model.
///
/// # Errors
/// No such model, parameter or choice; a value out of its range; a library that is not there; a place that cannot be
/// written.
pub fn packed(o: &Options) -> Result<Packed> {
    let model = pack::Model::named(&o.model)?;
    let number = |(name, value): &(String, String)| {
        let number = model.number(name, value).with_context(|| format!("--set {name}={value}"))?;
        Ok((name.clone(), number))
    };
    let starts = o.starts.iter().map(number).collect::<Result<Vec<(String, f64)>>>()?;
    let binaries = if o.all_platforms {
        model.libraries_everywhere()?
    } else if o.binaries.is_empty() {
        model.libraries(o.platforms.as_deref())?
    } else {
        o.binaries.iter().map(|b| pack::library(b)).collect::<Result<Vec<_>>>()?
    };
    let files = o.binaries.iter().filter_map(|b| Some(PathBuf::from(b.split_once('=')?.1)));
    place::is_none_of(&o.out, files)?;
    let kept = model.pack(&o.out, &starts, &binaries)?.map(|k| k.note());
    let platforms = binaries.into_iter().map(|b| b.platform).collect();
    Ok(Packed { fmu: o.out.clone(), platforms, starts: starts.into_iter().collect(), kept })
}
