//! A campaign taken in, and what is wrong with it told, for every command alike.

use anyhow::{Context, Result};
use record::Campaign;
use sha2::{Digest, Sha256};
use std::fmt::Display;
use std::path::Path;

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

/// What is wrong with the campaign in `dir`: each line of `e` with the folder before it.
pub fn of_campaign(dir: &Path, e: &dyn Display) -> String {
    let lines: Vec<String> = e.to_string().lines().map(|l| format!("{}: {l}", dir.display())).collect();
    lines.join("\n")
}

/// Hash of the files of the campaign in `dir` as they are: campaign.toml, and the recordings that it lists, also those that
/// are left out. None where one of them cannot be read.
pub fn content(dir: &Path) -> Option<String> {
    let text = input::text(&dir.join("campaign.toml"), input::TEXT).ok()?;
    let described: toml::Table = text.parse().ok()?;
    let mut hash = Sha256::new();
    hash.update(Sha256::digest(&text));
    for recording in described.get("recording")?.as_array()? {
        let file = dir.join(recording.get("file")?.as_str()?);
        hash.update(Sha256::digest(input::bytes(&file, input::RECORDING).ok()?));
    }
    Some(output::hexadecimal(&hash.finalize()))
}
