//! Where a scenario's contact comes from: our own FMU, one given, or the law called directly.

use crate::host::{Direct, Element};
use anyhow::{bail, Result};
use hysteresis_contact::law::Parameters;
use std::path::PathBuf;

/// What the contact's force is asked from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Through {
    /// The FMU this command packs of itself.
    Own,
    /// An FMU given.
    Fmu(PathBuf),
    /// The law, called directly.
    Direct,
}

/// The contact element of `law`, and the name of what stands behind it.
///
/// # Errors
/// Where an FMU cannot be loaded.
pub fn element_for(through: &Through, law: &Parameters) -> Result<(Box<dyn Element>, String)> {
    match through {
        Through::Direct | Through::Own => Ok((Box::new(Direct::new(*law)), "the law called directly".into())),
        Through::Fmu(path) => {
            bail!("{}: this build cannot load FMUs yet; use --direct", path.display())
        }
    }
}
