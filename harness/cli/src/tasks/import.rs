//! A campaign made out of the files that instruments write.

use super::Follow;
use crate::campaign::hashed;
use crate::print::Shown;
use crate::typed::COMMIT;
use anyhow::{anyhow, bail, ensure, Context, Result};
use import::{amount, look_at, parse_map, plan, File, Missing, Outcome, Pattern, Plan, Table};
use record::Kind;
use report::trace::{self, Made};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Which files, and what is known of them; texts as the flags of `touchdown import` have them.
#[derive(Clone, Debug)]
pub struct Options {
    pub files: Vec<PathBuf>,
    /// Folder for the campaign; it must not be there yet.
    pub out: Option<PathBuf>,
    /// CHANNEL=COLUMN[:UNIT or sensitivity][:negative or :positive], parted by commas.
    pub map: Vec<String>,
    /// Samples per second, where no column is time; above 0.
    pub rate: Option<f64>,
    /// What the files' names say.
    pub names: Option<String>,
    /// CSV with what is known of each file.
    pub table: Option<PathBuf>,
    /// Drop height of all recordings, m or with its unit.
    pub height: Option<String>,
    /// Speed at touch of all recordings, m/s or with its unit.
    pub speed: Option<String>,
    /// Preload of the return spring in all recordings, N or with its unit.
    pub preload: Option<String>,
    /// drop-test, contactor-opening or indentation; None: guessed.
    pub kind: Option<String>,
    /// Moving mass, kg or with its unit.
    pub mass: Option<String>,
    /// Travel of a contactor from rest to the stop, m or with its unit.
    pub travel: Option<String>,
    /// Rate of a contactor's return spring, N/m or with its unit.
    pub spring_rate: Option<String>,
    /// What the simulation holds beside k x^p.
    pub terms: Option<Vec<String>>,
    /// Name of the campaign; None: that of the folder.
    pub name: Option<String>,
    /// Free text.
    pub material: Option<String>,
    /// Whether recordings are taken whole.
    pub keep_all: bool,
    /// Whether columns of one kind are recordings of their own.
    pub split_columns: bool,
    /// Share of a file's hardest impact that another has to reach to be a recording, 0 to 1.
    pub least: f64,
    /// Whether files that hold no recording are left out, instead of refusing them all.
    pub skip_bad: bool,
    /// The command as typed.
    pub command: String,
}

/// A flag's amount.
fn value(flag: &str, text: &Option<String>, quantity: &str) -> Result<Option<f64>> {
    let Some(text) = text else { return Ok(None) };
    let v = amount(text, quantity).map_err(|e| anyhow!("{flag}: {e}"))?;
    ensure!(v.is_finite() && v > 0.0, "{flag} {text}: give a number above 0");
    Ok(Some(v))
}

impl Options {
    /// The same, read.
    ///
    /// # Errors
    /// The first text that cannot be read, with its flag.
    pub fn read(&self) -> Result<import::Options> {
        let mut o = import::Options {
            rate: self.rate,
            mass: value("--mass", &self.mass, "mass")?,
            travel: value("--travel", &self.travel, "penetration")?,
            spring_rate: value("--spring-rate", &self.spring_rate, "spring rate")?,
            keep_all: self.keep_all,
            split_columns: self.split_columns,
            least: self.least,
            skip_bad: self.skip_bad,
            material: self.material.clone(),
            terms: self.terms.clone(),
            ..import::Options::default()
        };
        ensure!(self.rate.is_none_or(|r| r.is_finite() && r > 0.0), "--rate: give samples per second, above 0");
        ensure!((0.0..=1.0).contains(&self.least), "--least {}: give a share from 0 to 1", self.least);
        for m in &self.map {
            o.map.extend(parse_map(m).map_err(|e| anyhow!(e))?);
        }
        o.names = self.names.as_deref().map(Pattern::parse).transpose().map_err(|e| anyhow!(e))?;
        o.table = self.table.as_deref().map(Table::read).transpose().map_err(|e| anyhow!(e.join("\n")))?;
        for (flag, key, text) in [
            ("--height", "drop_height", &self.height),
            ("--speed", "impact_speed", &self.speed),
            ("--preload", "spring_preload", &self.preload),
        ] {
            if let Some(text) = text {
                o.all.read(key, text, "", flag).map_err(|e| anyhow!("{flag}: {e}"))?;
            }
        }
        if let Some(k) = &self.kind {
            let names = Kind::BUILT_IN.map(Kind::name);
            o.kind = Some(
                Kind::named(k)
                    .filter(|k| Kind::BUILT_IN.contains(k))
                    .ok_or_else(|| anyhow!("--kind {k:?} is not known; {}", record::words::instead(k, &names)))?,
            );
        }
        let known = mechanisms::terms();
        if let Some(t) = self.terms.iter().flatten().find(|t| !known.contains(&t.as_str())) {
            bail!("--terms: {t:?} is not known; {}", record::words::instead(t, &known));
        }
        let folder = self.out.as_deref().and_then(std::path::Path::file_name);
        let folder = folder.map_or("campaign".into(), |n| n.to_string_lossy().into_owned());
        o.name = self.name.clone().unwrap_or(folder);
        Ok(o)
    }
}

/// What is missing, as an error says it.
fn message(m: &Missing) -> String {
    let most = 3;
    let mut names: Vec<String> = m.files.iter().take(most).map(|f| f.shown()).collect();
    if m.files.len() > most {
        names.push(format!("{} more", m.files.len() - most));
    }
    let of = if names.is_empty() { String::new() } else { format!(" of {}", names.join(", ")) };
    let what = if m.key == "impact_speed" { "impact_speed or drop_height" } else { m.key };
    format!("{what}{of} is missing: no file has it; give {}", m.cure)
}

/// What was taken and left out.
#[derive(Serialize)]
pub struct Taken {
    /// Its folder.
    pub campaign: PathBuf,
    pub kind: &'static str,
    /// How the kind is known.
    pub kind_from: String,
    pub files: Vec<TakenFile>,
    pub recordings: Vec<TakenRecording>,
    pub notes: Vec<String>,
    pub left_out: Vec<String>,
    /// The page that shows it.
    pub pictures: PathBuf,
}

/// What was taken of a file, and what was left out, a line each.
#[derive(Serialize)]
pub struct TakenFile {
    pub file: String,
    pub taken: Vec<String>,
    pub left_out: Vec<String>,
}

/// A recording of the campaign.
#[derive(Serialize)]
pub struct TakenRecording {
    pub recording: String,
    /// The file it is of.
    pub file: String,
    /// What distinguishes it from others of its file; empty where it is the only one.
    pub label: String,
    pub samples: usize,
    /// When it touches and for how long, s.
    pub touch: Option<(f64, f64)>,
    pub notes: Vec<String>,
}

fn taken(campaign: &Path, files: &[File], p: &Plan, out: &Outcome, faults: &[String]) -> Taken {
    let of_file = |f: &File| TakenFile { file: f.name(), taken: f.taken.clone(), left_out: f.left.clone() };
    let of = |w: &import::Written| {
        let r = &p.recordings[w.recording];
        TakenRecording {
            recording: r.name.clone(),
            file: files[r.file].name(),
            label: r.label.clone(),
            samples: w.samples,
            touch: w.touch,
            notes: w.notes.clone(),
        }
    };
    Taken {
        campaign: campaign.to_path_buf(),
        kind: p.kind.name(),
        kind_from: p.kind_from.clone(),
        files: files.iter().map(of_file).collect(),
        recordings: out.recordings.iter().map(of).collect(),
        notes: p.notes.iter().chain(&out.notes).cloned().collect(),
        left_out: faults.iter().chain(&out.faults).cloned().collect(),
        pictures: campaign.join(import::PAGE),
    }
}

/// The same for a terminal.
pub fn words(t: &Taken) -> String {
    let mut lines = Vec::new();
    let mut before: Option<&TakenFile> = None;
    for f in &t.files {
        if before.is_some_and(|b| (&b.taken, &b.left_out) == (&f.taken, &f.left_out)) {
            lines.push(format!("{}: the same", f.file));
            continue;
        }
        lines.push(f.file.clone());
        lines.extend(f.taken.iter().map(|t| format!("  {t}")));
        lines.extend(f.left_out.iter().map(|l| format!("  left out: {l}")));
        before = Some(f);
    }
    lines.push(format!("{}: {}", t.kind, t.kind_from));
    for r in &t.recordings {
        let label = if r.label.is_empty() { String::new() } else { format!(", {}", r.label) };
        let touch = r.touch.map_or(String::new(), |(at, length)| {
            format!(", touch at {} for {}", diagnose::figure::figure(at, "s"), diagnose::figure::figure(length, "s"))
        });
        lines.push(format!("  {} of {}{label}: {} samples{touch}", r.recording, r.file, r.samples));
        lines.extend(r.notes.iter().map(|n| format!("    {n}")));
    }
    lines.extend(t.notes.iter().map(|n| format!("  note: {n}")));
    lines.push(format!(
        "{}: {} recordings; look at {}, then run `touchdown check {}`\n",
        t.campaign.shown(),
        t.recordings.len(),
        t.pictures.shown(),
        t.campaign.shown()
    ));
    lines.join("\n")
}

/// Sees that no file is given twice, by whatever path: it would count as another recording.
///
/// # Errors
/// The first that is.
fn given_once(files: &[PathBuf]) -> Result<()> {
    let mut seen = BTreeSet::new();
    let again = |f: &&PathBuf| f.canonicalize().is_ok_and(|there| !seen.insert(there));
    match files.iter().find(again) {
        Some(f) => bail!("{}: is given twice; give every file once, for each is a recording of its own", f.shown()),
        None => Ok(()),
    }
}

/// Asks the user for what no file holds; whether everything was answered.
pub type Ask<'a> = &'a mut dyn FnMut(&[Missing], &mut import::Options) -> Result<bool>;

/// Makes a campaign. What no file holds is asked by `ask` where that is given.
///
/// # Errors
/// Everything wrong with the options and the files, and what is missing, a line each; a place that cannot be written.
pub fn imported(options: &Options, ask: Option<Ask<'_>>, follow: &dyn Follow) -> Result<Taken> {
    let mut o = options.read()?;
    let out = options.out.as_deref().context("give a folder for the campaign")?;
    ensure!(!out.exists(), "{}: is there already; give another --out, or move it away", out.shown());
    given_once(&options.files)?;
    let made = Made::now(COMMIT, &options.command)?;
    follow.begin("import: looking at files", options.files.len() as u64);
    let mut files = Vec::new();
    let mut faults = Vec::new();
    for looked in look_at(&options.files, &o, &instruments::open, &|_| follow.add(1)) {
        match looked {
            Ok(file) => files.push(file),
            Err(e) => faults.extend(e),
        }
    }
    follow.end();
    let mut planned = plan(&mut files, &o);
    if let Some(ask) = ask.filter(|_| !planned.missing.is_empty() && (faults.is_empty() || o.skip_bad)) {
        if ask(&planned.missing, &mut o)? {
            planned = plan(&mut files, &o);
        }
    }
    faults.extend(planned.faults.iter().cloned());
    let mut missing: Vec<String> = planned.missing.iter().map(message).collect();
    if o.kind.is_none() && !missing.is_empty() && !files.is_empty() {
        missing.push(format!("taken as {}, {}; --kind says another", planned.kind.name(), planned.kind_from));
    }
    if !missing.is_empty() || planned.recordings.is_empty() || (!faults.is_empty() && !o.skip_bad) {
        let skip = !faults.is_empty() && !o.skip_bad && !planned.recordings.is_empty();
        let cure = "nothing was written; --skip-bad leaves out the files that hold no recording";
        let cure = Some(cure.to_string()).filter(|_| skip);
        bail!(faults.iter().chain(&missing).chain(&cure).cloned().collect::<Vec<_>>().join("\n"));
    }
    let read: Vec<_> = options.files.iter().filter_map(|f| hashed(f)).collect();
    o.trace = made.rows().into_iter().chain(trace::files(&read)).collect();
    follow.begin("import: writing recordings", files.len() as u64);
    let outcome = import::write(out, &files, &planned, &o, &|path| {
        follow.add(1);
        instruments::open(path)
    });
    follow.end();
    let outcome = outcome.map_err(|faults| anyhow!(faults.join("\n")))?;
    let taken = taken(out, &files, &planned, &outcome, &faults);
    taken.left_out.iter().for_each(|f| follow.warning(&format!("left out: {f}")));
    Ok(taken)
}
