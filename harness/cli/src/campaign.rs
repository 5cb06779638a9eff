//! A campaign taken in, and what is wrong with it reported, for every command alike.

use anyhow::{Context, Result};
use host::{Fmus, Isolation};
use plant::machine::Machine;
use record::Campaign;
use sha2::{Digest, Sha256};
use std::fmt::Display;
use std::path::Path;
use std::sync::Arc;

/// Reads the campaign in `dir`, leaves out the recordings without an impact, and of long ones what the impact does not
/// reach.
///
/// # Errors
/// Everything wrong with it, a line each; or that no recording is left.
pub fn load(dir: &Path) -> Result<Campaign> {
    let c = record::load(dir, &mechanisms::terms())?;
    let c = estimate::usable::usable(c).with_context(|| dir.display().to_string())?;
    Ok(estimate::window::windowed(c))
}

/// Opens the FMUs that simulate `c` where it is of kind `system`; its moving mass becomes the one that a force at its first
/// bond moves. Recordings that they do not run through are left out, and named in the warnings. None of another kind.
///
/// # Errors
/// What is wrong with what campaign.toml says of them, with the system file, or with an FMU.
pub fn machine(c: &mut Campaign, isolation: &Isolation) -> Result<Option<Arc<dyn Machine>>> {
    let opened = match Fmus::open(c, isolation) {
        Ok(m) => m,
        Err(e) => {
            let refused = Fmus::refused(c, isolation)?;
            if refused.is_empty() || refused.len() == c.recordings.len() {
                return Err(e);
            }
            // what the other FMUs describe stays
            let files: Vec<String> = refused.iter().map(|(r, _)| c.recordings[*r].file.clone()).collect();
            let notes = files.iter().zip(&refused).map(|(f, (_, why))| format!("{f}: {why:#}: it was left out."));
            c.warnings.extend(notes.collect::<Vec<_>>());
            c.retain(|r| !files.contains(&r.file));
            Fmus::open(c, isolation)?
        }
    };
    let Some(m) = opened else { return Ok(None) };
    let bonds = &m.facts().bonds;
    let first = bonds.iter().find(|b| b.takes_force && b.is_contact).or(bonds.iter().find(|b| b.takes_force));
    c.moving_mass = first.map(|b| b.mass.at.exp());
    Ok(Some(m))
}

/// What is wrong with the campaign in `dir`: each line of `e` with the folder before it.
pub fn of_campaign(dir: &Path, e: &dyn Display) -> String {
    let lines: Vec<String> = e.to_string().lines().map(|l| format!("{}: {l}", dir.display())).collect();
    lines.join("\n")
}

/// Hash of the files of the campaign in `dir` as they are: campaign.toml, the recordings that it lists, also those that are
/// left out, and the system with its FMUs where it names one. None where one of them cannot be read.
pub fn content(dir: &Path) -> Option<String> {
    let text = input::text(&dir.join("campaign.toml"), input::TEXT).ok()?;
    let described: toml::Table = text.parse().ok()?;
    let mut hash = Sha256::new();
    hash.update(Sha256::digest(&text));
    for recording in described.get("recording")?.as_array()? {
        let file = dir.join(recording.get("file")?.as_str()?);
        hash.update(Sha256::digest(input::bytes(&file, input::RECORDING).ok()?));
    }
    if let Some(system) = described.get("simulation").and_then(|s| s.get("system")) {
        for file in host::master::files_of(&dir.join(system.as_str()?)).ok()? {
            hash.update(Sha256::digest(input::bytes(&file, input::LIBRARY).ok()?));
        }
    }
    Some(output::hexadecimal(&hash.finalize()))
}
