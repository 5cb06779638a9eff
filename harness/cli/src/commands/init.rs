//! `touchdown init`.

use super::fmus::Fmus;
use crate::print::{self, Shown};
use anyhow::{anyhow, bail, ensure, Context, Result};
use host::{propose, Proposal};
use record::{Channel, Kind};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const EXAMPLES: &str = "Examples:
  touchdown init my_drops --kind drop-test               # then fill in my_drops/campaign.toml
  touchdown init openings --kind contactor-opening
  touchdown init my_machine/system.toml                  # for recordings beside a system of FMUs, an .ssp or an .fmu";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Folder with the recordings, a CSV file each; campaign.toml is written into it. Or the system of FMUs that simulates
    /// them, which lies beside them: a system file, an SSP archive or one FMU
    #[arg(value_name = "FOLDER|SYSTEM")]
    folder: PathBuf,
    /// What was done: drop-test, contactor-opening or indentation; of a system it is not needed
    #[arg(long)]
    kind: Option<String>,
    #[command(flatten)]
    fmus: Fmus,
}

/// The name of the file that describes a campaign.
const NAME: &str = "campaign.toml";

/// The name of a file as campaign.toml has it.
fn name(path: &Path) -> Result<String> {
    let name = path.file_name().unwrap_or_default();
    let plain = || format!("{}: its name is no text in UTF-8, which campaign.toml is; rename it", path.shown());
    Ok(name.to_str().with_context(plain)?.to_string())
}

/// A text as TOML has it, on one line.
fn quoted(text: &str) -> String {
    let mut s = String::from('"');
    for c in text.chars() {
        match c {
            '"' | '\\' => s.extend(['\\', c]),
            // writing to a String cannot fail
            c if c.is_control() => drop(write!(s, "\\u{:04X}", u32::from(c))),
            c => s.push(c),
        }
    }
    s + "\""
}

/// The recordings' files in a folder, by name.
fn recordings(folder: &Path) -> Result<Vec<String>> {
    let list = std::fs::read_dir(folder).with_context(|| format!("{}: no folder to read", folder.shown()))?;
    let mut files = Vec::new();
    for entry in list {
        let path = entry.with_context(|| format!("{}: cannot be read", folder.shown()))?.path();
        if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
            files.push(name(&path)?);
        }
    }
    ensure!(!files.is_empty(), "{}: no CSV file is in it; put the recordings there first, a file each", folder.shown());
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
        // a system describes itself
        Kind::System => ("", "# level =                  # what the recordings differ by, a number or a text"),
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
         name = {}\n\
         kind = \"{}\"\n\
         # material = \"\"            # free text\n\
         # operator = \"\"            # who took the recordings, for the report\n\n\
         [rig]\n{rig}\n\n\
         [simulation]               # what your simulation holds, and its values where it is calibrated\n\
         terms = {:?}   # beside k x^p; names from `touchdown mechanisms`\n\
         # k =                      # N/m^p: F = k x^p + mu_d x^p v\n\
         # p =\n\
         # mu_d =                   # N s/m^(p+1)\n",
        quoted(name),
        kind.name(),
        kind.usual_terms()
    );
    for (i, file) in files.iter().enumerate() {
        let order = i + 1;
        let more = if i == 0 { "              # in the order in which they were taken" } else { "" };
        // writing to a String cannot fail
        let _ = write!(s, "\n[[recording]]\nfile = {}\norder = {order}{more}\n{recording}\n", quoted(file));
    }
    s
}

/// A number as TOML has it.
fn number(x: f64) -> String {
    let text = x.to_string();
    if text.contains(['.', 'e', 'E']) {
        text
    } else {
        text + ".0"
    }
}

/// The description of a campaign that the system `file` simulates, as its FMUs propose it.
fn of_system(p: &Proposal, file: &str, name: &str, files: &[String]) -> String {
    let mut s = format!(
        "# A campaign of recordings that FMUs simulate. What stands here is proposed from their descriptions: correct it, then run\n\
         # `touchdown check`. Every key: docs/src/formats/recordings.md.\n\
         format = \"recordings/1\"\n\n[campaign]\nname = {}\nkind = \"system\"\n\n[simulation]\nsystem = {}\n\
         terms = []                 # what the system holds already; names from `touchdown mechanisms`\n",
        quoted(name),
        quoted(file)
    );
    for (variable, tolerance) in &p.free {
        s += &format!("\n[[simulation.free]]         # calibration may move it\nvariable = {}\n", quoted(variable));
        s += &tolerance
            .map_or(String::new(), |t| format!("tolerance = {t}          # relative, one standard deviation\n"));
    }
    for b in &p.bonds {
        s += &format!(
            "\n[[simulation.bond]]         # physics may be missing here\nname = {}\nkind = \"contact\"           # or \"body\"\n",
            quoted(&b.name)
        );
        s += &match &b.force {
            Some(f) => format!("force = {}\n", quoted(f)),
            None => {
                "# force =                  # the FMUs have no input in N: only their outputs can be judged\n".into()
            }
        };
        s += &format!("penetration = {}\nvelocity = {}\n", quoted(&b.penetration), quoted(&b.velocity));
    }
    s += "\n[simulation.channels]       # which output each recorded channel is\n";
    for (c, output) in Channel::ALL.into_iter().zip(&p.channels) {
        s += &match output {
            Some(o) => format!("{} = {}\n", c.name(), quoted(o)),
            None => format!("# {} =\n", c.name()),
        };
    }
    for (i, file) in files.iter().enumerate() {
        s += &format!("\n[[recording]]\nfile = {}\norder = {}\n", quoted(file), i + 1);
        if !p.settings.is_empty() {
            s += "[recording.set]            # what differs from recording to recording; leave out what does not\n";
        }
        for (variable, value) in &p.settings {
            s += &format!("# {} = {}\n", quoted(variable), number(*value));
        }
    }
    s
}

/// Whether a path is a system of FMUs, and not the folder of recordings.
fn is_system(path: &Path) -> bool {
    path.is_file()
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let names = Kind::ALL.map(Kind::name);
    let system = is_system(&a.folder);
    let kind = match a.kind.as_deref() {
        None if system => Kind::System,
        None => bail!("--kind is missing: give one of {}, or name the system of FMUs", names.join(", ")),
        Some(k) => {
            Kind::named(k).with_context(|| format!("kind {k:?} is not known; {}", record::words::instead(k, &names)))?
        }
    };
    let given = if system { a.folder.parent().unwrap_or(Path::new("")) } else { &a.folder };
    let given = if given.as_os_str().is_empty() { Path::new(".") } else { given };
    ensure!(
        system == (kind == Kind::System),
        "{}: a campaign of kind system is written beside its system; name a system file, an .ssp or an .fmu, and no other kind",
        a.folder.shown()
    );
    let files = recordings(given)?;
    let path = given.join(NAME);
    let there = || anyhow!("{}: is there already; move it away, or edit it", path.shown());
    // a link that leads nowhere is there too
    ensure!(path.symlink_metadata().is_err(), there());
    let folder = given.canonicalize().unwrap_or_else(|_| given.to_path_buf());
    let title = folder.file_name().map_or("campaign".into(), |n| n.to_string_lossy());
    let text = if system {
        of_system(&propose(&a.folder, &a.fmus.isolation()?)?, &name(&a.folder)?, &title, &files)
    } else {
        template(kind, &title, &files)
    };
    output::write_new(&path, text.as_bytes()).map_err(|e| match e.kind() {
        // by another who began at the same time
        std::io::ErrorKind::AlreadyExists => there(),
        _ => anyhow::Error::from(e).context(format!("{}: cannot be written", path.shown())),
    })?;
    print::beside(&format!(
        "{}: {} recordings listed; fill in what is left open, then run `touchdown check {}`\n",
        path.shown(),
        files.len(),
        given.shown()
    ));
    Ok(ExitCode::SUCCESS)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_init_writes_is_toml_whatever_files_and_variables_are_called() {
        let name = "a \"b\" \\ \n\u{1b}[31m\u{0}\u{7f}\u{9b}\u{200b}' # = \u{e4}.csv".to_string();
        let of = |text: &str, path: &[&str]| {
            let table: toml::Table = text.parse().unwrap_or_else(|e| panic!("{e}: {text}"));
            let found = path.iter().fold(toml::Value::Table(table), |v, key| match key.parse::<usize>() {
                Ok(i) => v[i].clone(),
                Err(_) => v[*key].clone(),
            });
            found.as_str().map(String::from)
        };
        let text = template(Kind::DropTest, &name, std::slice::from_ref(&name));
        assert_eq!(of(&text, &["campaign", "name"]).as_ref(), Some(&name));
        assert_eq!(of(&text, &["recording", "0", "file"]).as_ref(), Some(&name));
        assert_eq!(quoted("bar.F[1,2]"), "\"bar.F[1,2]\"");
    }
}
