//! `touchdown init`.

use crate::print;
use anyhow::{bail, ensure, Context, Result};
use record::Kind;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const EXAMPLES: &str = "Examples:
  touchdown init my_drops --kind drop-test               # then fill in my_drops/campaign.toml
  touchdown init openings --kind contactor-opening";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Folder with the recordings, a CSV file each; campaign.toml is written into it
    folder: PathBuf,
    /// What was done: drop-test, contactor-opening or indentation
    #[arg(long)]
    kind: String,
}

/// The name of the file that describes a campaign.
const NAME: &str = "campaign.toml";

/// The recordings' files in a folder, by name.
fn recordings(folder: &Path) -> Result<Vec<String>> {
    let list = std::fs::read_dir(folder).with_context(|| format!("{}: no folder to read", folder.display()))?;
    let mut files = Vec::new();
    for entry in list {
        let name = entry.with_context(|| format!("{}: cannot be read", folder.display()))?.file_name();
        let name = name.to_string_lossy();
        if Path::new(&*name).extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
            files.push(name.into_owned());
        }
    }
    ensure!(
        !files.is_empty(),
        "{}: no CSV file is in it; put the recordings there first, a file each",
        folder.display()
    );
    files.sort();
    Ok(files)
}

/// The keys of the rig, and of a recording, that a kind needs; each to be filled in.
fn keys(kind: Kind) -> (&'static str, &'static str) {
    match kind {
        Kind::DropTest => (
            "# moving_mass =            # kg, all that falls with the sensors on it",
            "# impact_speed =           # m/s at touch, where it was measured; impact_speed_std = its standard deviation\n\
             # drop_height =            # m; names the level, and gives the speed where none was measured",
        ),
        Kind::ContactorOpening => (
            "# moving_mass =            # kg, the bar with what moves with it\n\
             # travel =                 # m, from rest to the stop\n\
             # return_spring_rate =     # N/m",
            "# spring_preload =         # N, the return spring at rest; names the level",
        ),
        Kind::Indentation => ("# nothing is needed of it: the penetration is imposed", "# level =                  # what the recordings differ by, a number or a text"),
    }
}

/// The description of a campaign with what has to be filled in.
fn template(kind: Kind, name: &str, files: &[String]) -> String {
    let (rig, recording) = keys(kind);
    let mut s = format!(
        "# A campaign of recordings; plain SI. Give every key below its value, take its # away, then run `touchdown check`.\n\
         # Every key: docs/src/formats/recordings.md.\n\
         format = \"recordings/1\"\n\n\
         [campaign]\n\
         name = {name:?}\n\
         kind = \"{}\"\n\
         # material = \"\"            # free text\n\n\
         [rig]\n{rig}\n\n\
         [simulation]               # what your simulation holds, and its values where it is calibrated\n\
         terms = {:?}   # beside k x^p; names from `touchdown mechanisms`\n\
         # k =                      # N/m^p: F = k x^p + mu_d x^p v\n\
         # p =\n\
         # mu_d =                   # N s/m^(p+1)\n",
        kind.name(),
        kind.usual_terms()
    );
    for (i, file) in files.iter().enumerate() {
        let order = i + 1;
        let more = if i == 0 { "              # in the order in which they were taken" } else { "" };
        // writing to a String cannot fail
        let _ = write!(s, "\n[[recording]]\nfile = {file:?}\norder = {order}{more}\n{recording}\n");
    }
    s
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let Some(kind) = Kind::named(&a.kind) else {
        bail!("kind {:?} is not known; {}", a.kind, record::words::instead(&a.kind, &Kind::ALL.map(Kind::name)));
    };
    let files = recordings(&a.folder)?;
    let path = a.folder.join(NAME);
    ensure!(!path.exists(), "{}: is there already; move it away, or edit it", path.display());
    let folder = a.folder.canonicalize().unwrap_or_else(|_| a.folder.clone());
    let name = folder.file_name().map_or("campaign".into(), |n| n.to_string_lossy());
    output::write_new(&path, template(kind, &name, &files).as_bytes())
        .with_context(|| format!("{}: cannot be written", path.display()))?;
    print::beside(&format!(
        "{}: {} recordings listed; fill in what is left open, then run `touchdown check {}`\n",
        path.display(),
        files.len(),
        a.folder.display()
    ));
    Ok(ExitCode::SUCCESS)
}
