//! Where a scenario's contact comes from: our own FMU, one given, or the law called directly.

use super::contact::{named, Variables};
use super::plan::Case;
use anyhow::{Context, Result};
use host::{Causality, Direct, Element, Fmu, FmuElement, Isolation, Kind, Names, Start};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// What the contact's force is asked from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Through {
    /// The FMU this command packs of itself, into a temporary folder.
    Own,
    /// An FMU given.
    Fmu(PathBuf),
    /// The law, called directly.
    Direct,
}

/// Opens every FMU once, and makes elements of it.
#[derive(Default)]
pub struct Source {
    // dropped in this order: binaries are unloaded before the folder goes
    own: Option<Fmu>,
    given: HashMap<PathBuf, Fmu>,
    folder: Option<output::Scratch>,
    isolation: Isolation,
}

impl Source {
    /// Nothing is opened yet; somebody else's FMUs will run where `isolation` says.
    pub fn new(isolation: Isolation) -> Source {
        Source { isolation, ..Source::default() }
    }

    /// What went wrong while FMUs were freed and unloaded, each reported once; after their elements were dropped.
    pub fn complaints(&self) -> Vec<String> {
        self.given.values().flat_map(Fmu::complaints).collect()
    }

    /// The contact element of a case, and the name of what stands behind it. An FMU given gets the parameters the
    /// file gives, no others, so that what was packed into it stays; where the file gives no stiffness, that of the
    /// FMU is noted in the case, as a measure of depth.
    ///
    /// # Errors
    /// Where an FMU cannot be packed or loaded, lacks a variable, or has no parameter the file gives.
    pub fn element(&mut self, through: &Through, case: &mut Case) -> Result<(Box<dyn Element>, String)> {
        match through {
            Through::Direct => Ok((Box::new(Direct::new(case.law)), "the law called directly".into())),
            Through::Own => {
                let fmu = self.own()?;
                let e = FmuElement::new(&fmu, &named(&case.law), &Names::default())?;
                Ok((Box::new(e), format!("our own FMU, {}", fmu.description().model_name)))
            }
            Through::Fmu(path) => {
                let fmu = match self.given.get(path) {
                    Some(f) => f.clone(),
                    None => {
                        let f = Fmu::open_in(path, &self.isolation)?;
                        self.given.insert(path.clone(), f.clone());
                        f
                    }
                };
                other(&fmu, path, case)
            }
        }
    }

    fn own(&mut self) -> Result<Fmu> {
        if let Some(f) = &self.own {
            return Ok(f.clone());
        }
        let folder =
            output::Scratch::new("own").context("a temporary folder for our FMU cannot be made; see TMPDIR")?;
        let fmu = Fmu::open(&pack::into_folder(folder.path(), &[])?)?;
        self.folder = Some(folder);
        self.own = Some(fmu.clone());
        Ok(fmu)
    }
}

/// An element of somebody's FMU.
fn other(fmu: &Fmu, path: &Path, case: &mut Case) -> Result<(Box<dyn Element>, String)> {
    let d = fmu.description();
    let parameters = d.names(Causality::Parameter);
    let mut passed = Vec::new();
    let mut estimates = Vec::new();
    for (name, value) in &case.given {
        let measure = name == "stiffness" || name == "exponent";
        if measure && !parameters.contains(&name.as_str()) {
            estimates.push(name.as_str());
        } else {
            passed.push((name.clone(), *value));
        }
    }
    for (name, value) in &case.parameters {
        passed.push((name.clone(), d.number(name, value).map_err(anyhow::Error::msg)?));
    }
    let start = |name: &str| match d.variable(name).filter(|v| v.kind == Kind::Real).and_then(|v| v.start.clone()) {
        Some(Start::Real(x)) if x.is_finite() && x > 0.0 => Some(x),
        _ => None,
    };
    for (name, place) in [("stiffness", &mut case.law.elastic.stiffness), ("exponent", &mut case.law.elastic.exponent)]
    {
        let set = passed.iter().find(|(n, _)| n == name).map(|p| p.1);
        if case.given.iter().all(|(n, _)| n != name) {
            *place = set.or(start(name)).unwrap_or(*place);
        }
    }
    case.fmu = Some(path.to_path_buf());
    let names = names(&case.variables);
    let e = match case.macro_step {
        Some(step) => FmuElement::held(fmu, &passed, &names, step)?,
        None => FmuElement::new(fmu, &passed, &names)?,
    };
    let mut name = format!("{}, {}", path.display(), d.model_name);
    if !estimates.is_empty() {
        name += &format!(" (it has no parameter {}: the scenario's only estimates its depth)", estimates.join(" nor "));
    }
    Ok((Box::new(e), name))
}

fn names(v: &Variables) -> Names {
    let plain = Names::default();
    let velocity = match &v.velocity {
        None => plain.velocity,
        Some(s) if s.is_empty() => None,
        some => some.clone(),
    };
    Names {
        penetration: v.penetration.clone().unwrap_or(plain.penetration),
        velocity,
        force: v.force.clone().unwrap_or(plain.force),
    }
}
