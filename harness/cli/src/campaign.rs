//! A campaign taken in, and what is wrong with it reported, for every command alike.

use crate::print::Shown;
use anyhow::{bail, Context, Result};
use diagnose::verdict::Input;
use host::{Fmus, Isolation};
use output::Entry;
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
    of_folder(dir)?;
    let c = record::load(dir, &mechanisms::terms())?;
    let c = estimate::usable::usable(c).with_context(|| dir.shown())?;
    Ok(estimate::window::windowed(c))
}

/// Whether `dir` may be a campaign.
///
/// # Errors
/// A file of an instrument, or a folder of such files: with the line that makes a campaign of them.
pub fn of_folder(dir: &Path) -> Result<()> {
    let is_of_instrument = |f: &Path| {
        let ends = f.extension().map_or(String::new(), |e| e.to_string_lossy().to_lowercase());
        f.is_file() && ENDS.contains(&ends.as_str())
    };
    let (what, files) = if dir.is_file() {
        if dir.file_name().is_some_and(|n| n == "campaign.toml") {
            let folder = dir.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
            bail!("{}: this is a file; give its folder, {}", dir.shown(), folder.shown());
        }
        ("this is a file, no campaign", quoted(dir))
    } else {
        let found = || std::fs::read_dir(dir).into_iter().flatten().flatten().map(|e| e.path());
        if !dir.is_dir() || dir.join("campaign.toml").exists() || !found().any(|f| is_of_instrument(&f)) {
            return Ok(());
        }
        let mut ends: Vec<String> = found()
            .filter(|f| is_of_instrument(f))
            .filter_map(|f| Some(f.extension()?.to_string_lossy().into_owned()))
            .collect();
        ends.sort_unstable();
        ends.dedup();
        let quoted = quoted(dir);
        let all: Vec<String> = ends.iter().map(|e| format!("{quoted}/*.{e}")).collect();
        ("there is no campaign.toml in it, but files of instruments", all.join(" "))
    };
    bail!(
        "{}: {what}; make a campaign of it: touchdown import {files} --height 200mm --mass 500g --out campaign (with your \
         height and mass; --list shows what it holds)",
        dir.shown()
    )
}

/// A path as a shell takes it.
fn quoted(path: &Path) -> String {
    crate::typed::quoted(&path.display().to_string())
}

/// Ends of the names of files that instruments write.
const ENDS: [&str; 21] = [
    "csv", "txt", "tsv", "dat", "asc", "tdms", "lvm", "mat", "h5", "hdf5", "mf4", "mdf", "wav", "uff", "unv", "xlsx",
    "xls", "xlsb", "ods", "parquet", "prn",
];

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
    let lines: Vec<String> = e.to_string().lines().map(|l| format!("{}: {l}", dir.shown())).collect();
    lines.join("\n")
}

/// Hash of the files of a campaign as they are.
pub fn content(inputs: &[Input]) -> String {
    let mut hash = Sha256::new();
    inputs.iter().for_each(|i| hash.update(&i.sha256));
    output::hexadecimal(&hash.finalize())
}

/// A file of any size with its hash; None where it cannot be read.
pub fn hashed(file: &Path) -> Option<Input> {
    let name = file.file_name()?.to_string_lossy().into_owned();
    Some(Input { file: name, sha256: Entry::of(file, "").ok()?.sha256 })
}

/// The files of the campaign in `dir`, each with its hash: campaign.toml, the recordings that it lists, also those that are
/// left out, and the system with its FMUs where it names one. None where one of them cannot be read.
pub fn inputs(dir: &Path) -> Option<Vec<Input>> {
    let text = input::text(&dir.join("campaign.toml"), input::TEXT).ok()?;
    let described: toml::Table = text.parse().ok()?;
    let of =
        |file: &str, bytes: &[u8]| Input { file: file.into(), sha256: output::hexadecimal(&Sha256::digest(bytes)) };
    let mut all = vec![of("campaign.toml", text.as_bytes())];
    for recording in described.get("recording")?.as_array()? {
        let file = recording.get("file")?.as_str()?;
        all.push(of(file, &input::bytes(&dir.join(file), input::RECORDING).ok()?));
    }
    if let Some(system) = described.get("simulation").and_then(|s| s.get("system")) {
        for file in host::master::files_of(&dir.join(system.as_str()?)).ok()? {
            let name = file.strip_prefix(dir).unwrap_or(&file).display().to_string();
            all.push(of(&name, &input::bytes(&file, input::LIBRARY).ok()?));
        }
    }
    Some(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_file_of_a_campaign_has_its_hash() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("campaign.toml"), "[[recording]]\nfile = \"a.csv\"\n").unwrap();
        assert!(inputs(dir.path()).is_none());
        std::fs::write(dir.path().join("a.csv"), "abc").unwrap();
        let all = inputs(dir.path()).unwrap();
        assert_eq!(all.iter().map(|i| i.file.as_str()).collect::<Vec<_>>(), ["campaign.toml", "a.csv"]);
        // FIPS 180-4
        assert_eq!(all[1].sha256, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
        let before = content(&all);
        std::fs::write(dir.path().join("a.csv"), "abd").unwrap();
        assert_ne!(content(&inputs(dir.path()).unwrap()), before);
    }

    #[test]
    fn files_of_instruments_are_answered_with_the_line_to_type() {
        let dir = tempfile::tempdir().unwrap();
        let file = dir.path().join("drop 1.tdms");
        std::fs::write(&file, "x").unwrap();
        let said = |p: &Path| of_folder(p).unwrap_err().to_string();
        assert!(said(&file).contains("touchdown import '") && said(&file).contains("drop 1.tdms' --height"));
        assert!(said(dir.path()).contains("/*.tdms --height"), "{}", said(dir.path()));
        std::fs::write(dir.path().join("campaign.toml"), "").unwrap();
        assert!(of_folder(dir.path()).is_ok());
        assert!(said(&dir.path().join("campaign.toml")).contains("give its folder"));
    }
}
