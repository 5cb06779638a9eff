//! Reads a campaign folder.

use crate::error::Section;
use crate::keys::{self, Document, Entries, Value};
use crate::samples::{self, short};
use crate::{
    fmus, words, Campaign, Channel, FmuSystem, Kind, RecordError, RecordErrors, Recording, Setting, Simulation, GRAVITY,
};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;

/// Share of a speed that stands for its std where none is given.
const SPEED_STD: f64 = 0.01;
/// The same of a speed worked out from a drop height.
const FALL_STD: f64 = 0.03;

/// Reads and checks the campaign in `dir`. `terms`: what `[simulation]` may list.
///
/// # Errors
/// Everything that the format `recordings/1` does not allow, each with file, line and cure.
pub fn load(dir: &Path, terms: &[&str]) -> Result<Campaign, RecordErrors> {
    let path = dir.join("campaign.toml");
    let text = input::text(&path, input::TEXT).map_err(|e| {
        let cure = input::cure(&e).unwrap_or("name a folder that holds a campaign.toml of format recordings/1");
        RecordErrors(vec![RecordError::new(Section::FormatKey, &path, 0, format!("cannot be read ({e})"), cure)])
    })?;
    let (document, errors) = keys::read(&path, &text).map_err(|e| RecordErrors::first(e, &path))?;
    let mut c = Check { path: &path, errors };
    let kind = c.head(&document);
    let (rig, sim) = (&document.rig, &document.simulation);
    c.rig(rig, kind);
    let system = fmus::read(&path, &document, kind, &mut c.errors);
    for (term, line) in sim.texts("terms").unwrap_or_default() {
        if !terms.contains(&term.as_str()) {
            c.error(Section::Simulation, *line, format!("term {term:?} is not known"), words::instead(term, terms));
        }
    }
    if document.recordings.is_empty() {
        c.error(Section::Recording, 0, "no [[recording]] is listed", "list each CSV file under [[recording]]");
    }
    let mut seen = BTreeMap::new();
    let mut listed: Vec<Listed> = Vec::new();
    for (i, r) in document.recordings.iter().enumerate() {
        if let Some(mut l) = c.recording(r, i, kind, &mut seen) {
            l.take_settings(document.sets.get(i).map_or(&[][..], Vec::as_slice), r.given("level"));
            listed.push(l);
        }
    }
    c.errors.sort_by_key(|e| e.line);
    let (mut recordings, mut warnings) = (Vec::new(), Vec::new());
    let (levels, level_of) = levels(&listed);
    let read: Vec<_> = listed.par_iter().map(|l| samples::read(dir, &l.file, kind)).collect();
    for ((l, level), read) in listed.iter().zip(level_of).zip(read) {
        match read {
            Ok(s) => {
                warnings.extend(s.notes);
                let r = Recording {
                    file: l.file.clone(),
                    order: l.order,
                    level,
                    drop_height: l.drop_height,
                    impact_speed: l.impact_speed,
                    start_speed: l.start_speed,
                    spring_preload: l.spring_preload,
                    set: l.set.clone(),
                    time: s.time,
                    whole: None,
                    channels: s.channels,
                    columns: s.columns,
                    rows: s.rows,
                };
                if r.impact_speed.is_none() && r.start_speed.is_some() && r.begins() < r.time[0] {
                    let at = short(r.time[0]);
                    warnings
                        .push(format!("{}: start_speed is taken as that at {at} s, the first sample kept.", l.file));
                }
                recordings.push(r);
            }
            Err(e) => c.errors.extend(e),
        }
    }
    let Some(kind) = kind.filter(|_| c.errors.is_empty()) else { return Err(RecordErrors::first(c.errors, &path)) };
    let folder = dir
        .canonicalize()
        .ok()
        .and_then(|d| d.file_name().map(|n| n.to_string_lossy().into_owned()))
        .unwrap_or_else(|| "campaign".into());
    let names: Vec<&str> = recordings.iter().map(|r| r.file.as_str()).collect();
    let own = system.as_ref().map(|s| s.file.text.as_str());
    warnings.extend(unlisted(dir, &names.into_iter().chain(own).collect::<Vec<_>>()));
    warnings.extend(same_order(&document.recordings));
    let terms: Vec<String> = match sim.texts("terms") {
        Some(given) => given.iter().map(|t| t.0.clone()).collect(),
        None => kind.usual_terms().iter().map(|t| t.to_string()).collect(),
    };
    if let Some(s) = &system {
        warnings.extend(keep_channels_of(s, &mut recordings));
    }
    if sim.texts("terms").is_none() && !terms.is_empty() {
        warnings.push(format!(
            "[simulation] lists no terms: it is taken to hold {}. Write terms = [] where it holds k x^p alone.",
            terms.join(" and ")
        ));
    }
    let head = &document.campaign;
    Ok(Campaign {
        dir: dir.to_path_buf(),
        name: head.text("name").unwrap_or(&folder).to_string(),
        folder,
        kind,
        material: head.text("material").map(str::to_string),
        operator: head.text("operator").map(str::to_string),
        columns: document.columns.clone(),
        moving_mass: rig.number("moving_mass"),
        travel: rig.number("travel"),
        return_spring_rate: rig.number("return_spring_rate"),
        simulation: Simulation { terms, k: sim.number("k"), p: sim.number("p"), mu_d: sim.number("mu_d") },
        system,
        levels,
        recordings,
        warnings,
    })
}

/// Takes recorded channels out that no output of the FMUs is; says which.
fn keep_channels_of(system: &FmuSystem, recordings: &mut [Recording]) -> Vec<String> {
    let without = Channel::ALL.into_iter().filter(|c| system.channels[c.index()].is_none());
    let mut notes = Vec::new();
    for c in without {
        let taken = recordings.iter_mut().filter_map(|r| r.channels[c.index()].take()).count();
        if taken > 0 {
            notes.push(format!(
                "{} is recorded, but [simulation.channels] names no output for it: it was left out.",
                c.name()
            ));
        }
    }
    notes
}

/// A recording as campaign.toml lists it.
struct Listed {
    file: String,
    order: f64,
    /// Value and text of its level.
    level: (f64, String),
    drop_height: Option<f64>,
    impact_speed: Option<(f64, f64)>,
    start_speed: Option<(f64, f64)>,
    spring_preload: Option<f64>,
    set: Vec<Setting>,
}

impl Listed {
    /// Takes the values of FMUs' variables; where nothing else names the level, they do.
    fn take_settings(&mut self, set: &[Setting], named: bool) {
        self.set = set.to_vec();
        if named || self.drop_height.is_some() || self.spring_preload.is_some() || set.is_empty() {
            return;
        }
        let texts: Vec<String> = set.iter().map(|s| format!("{} = {}", s.variable, s.value)).collect();
        self.level = (set[0].value, texts.join(", "));
    }
}

/// The levels, ascending, and for each recording the index of its own.
fn levels(listed: &[Listed]) -> (Vec<(f64, String)>, Vec<usize>) {
    let mut levels: Vec<(f64, String)> = Vec::new();
    for l in listed {
        if !levels.iter().any(|k| k.1 == l.level.1) {
            levels.push(l.level.clone());
        }
    }
    levels.sort_by(|a, b| a.0.total_cmp(&b.0));
    let of = |l: &Listed| levels.iter().position(|k| k.1 == l.level.1).unwrap_or(0);
    let each = listed.iter().map(of).collect();
    (levels, each)
}

/// campaign.toml under examination.
struct Check<'a> {
    path: &'a Path,
    errors: Vec<RecordError>,
}

impl Check<'_> {
    fn error(&mut self, section: Section, line: usize, what: impl Into<String>, cure: impl Into<String>) {
        self.errors.push(RecordError::new(section, self.path, line, what, cure));
    }

    /// Format and kind; the kind where it is known.
    fn head(&mut self, d: &Document) -> Option<Kind> {
        let right = "write format = \"recordings/1\"";
        match d.top.text("format") {
            Some("recordings/1") => {}
            Some(f) => {
                self.error(Section::FormatKey, d.top.line_of("format"), format!("format {f:?} is not known"), right)
            }
            None if d.top.given("format") => {}
            None => self.error(Section::FormatKey, 0, "format is missing", right),
        }
        let names = Kind::ALL.map(Kind::name);
        let Some(named) = d.campaign.text("kind") else {
            if !d.campaign.given("kind") {
                let cure = format!("add kind = ..., one of {}", names.join(", "));
                self.error(Section::Campaign, d.campaign.line, "kind is missing under [campaign]", cure);
            }
            return None;
        };
        let kind = Kind::named(named);
        if kind.is_none() {
            let cure = words::instead(named, &names);
            self.error(Section::Campaign, d.campaign.line_of("kind"), format!("kind {named:?} is not known"), cure);
        }
        kind
    }

    /// What the kind needs to know of the rig.
    fn rig(&mut self, rig: &Entries, kind: Option<Kind>) {
        let needs: &[(&str, &str)] = match kind {
            Some(Kind::DropTest) => &[("moving_mass", "kg")],
            Some(Kind::ContactorOpening) => &[("moving_mass", "kg"), ("travel", "m"), ("return_spring_rate", "N/m")],
            _ => &[],
        };
        for (key, unit) in needs.iter().filter(|n| !rig.given(n.0)) {
            self.error(Section::Rig, rig.line, format!("{key} is missing under [rig]"), format!("add {key} in {unit}"));
        }
    }

    /// One [[recording]], the `i`-th; None where its file cannot be looked for.
    fn recording(
        &mut self,
        r: &Entries,
        i: usize,
        kind: Option<Kind>,
        seen: &mut BTreeMap<String, usize>,
    ) -> Option<Listed> {
        let Some(file) = r.text("file") else {
            if !r.given("file") {
                self.error(Section::Recording, r.line, "this [[recording]] names no file", "add file = \"r01.csv\"");
            }
            return None;
        };
        let at = r.line_of("file");
        if file.contains('/') || file.contains('\\') || file.is_empty() {
            let cure = "keep recordings beside campaign.toml";
            self.error(Section::Recording, at, format!("file {file:?} is not a plain file name"), cure);
            return None;
        }
        if let Some(before) = seen.insert(file.to_string(), at) {
            let cure = "list every recording once; two campaigns belong in two folders";
            self.error(Section::Recording, at, format!("{file} is listed twice (first at line {before})"), cure);
            return None;
        }
        let speed = |key: &str| {
            let v = r.number(key)?;
            let std = r.number(&format!("{key}_std")).filter(|s| *s > 0.0);
            Some((v, std.unwrap_or(SPEED_STD * v)))
        };
        let (drop_height, spring_preload) = (r.number("drop_height"), r.number("spring_preload"));
        let (mut impact_speed, start_speed) = (speed("impact_speed"), speed("start_speed"));
        if kind == Some(Kind::DropTest) && !r.given("impact_speed") && !r.given("start_speed") {
            match drop_height {
                Some(h) if h > 0.0 => {
                    let v = (2.0 * GRAVITY * h).sqrt();
                    impact_speed = Some((v, FALL_STD * v));
                }
                _ => self.error(
                    Section::SpeedsAndHeights,
                    r.line,
                    format!("{file}: neither impact_speed, start_speed nor drop_height is given"),
                    "add impact_speed in m/s",
                ),
            }
        }
        if kind == Some(Kind::ContactorOpening) && !r.given("spring_preload") {
            self.error(
                Section::Recording,
                r.line,
                format!("{file}: spring_preload is missing"),
                "add spring_preload in N",
            );
        }
        let level = match (r.value("level"), drop_height, spring_preload) {
            (Some(Value::Number(x)), ..) => (*x, format!("{x}")),
            (Some(Value::Text(s)), ..) => (s.parse().unwrap_or(f64::NAN), s.clone()),
            (_, Some(h), _) => (h, format!("{h} m")),
            (_, _, Some(s)) => (s, format!("{s} N")),
            _ => (0.0, "all".to_string()),
        };
        let order = r.number("order").unwrap_or(i as f64 + 1.0);
        let file = file.to_string();
        let set = Vec::new();
        Some(Listed { file, order, level, drop_height, impact_speed, start_speed, spring_preload, set })
    }
}

/// Two recordings that say they were taken at once.
fn same_order(recordings: &[Entries]) -> Option<String> {
    let mut first: BTreeMap<u64, &str> = BTreeMap::new();
    let mut orders = recordings.iter().filter_map(|r| Some((r.number("order")?, r.text("file")?)));
    // zero is one order, whatever its sign
    let again = |(order, file): (f64, _)| Some((first.insert((order + 0.0).to_bits(), file)?, file, order));
    let (a, b, order) = orders.find_map(again)?;
    Some(format!(
        "{a} and {b} both have order {order}: give orders as they were taken; two campaigns belong in two folders."
    ))
}

/// Recordings and campaign files in the folder that campaign.toml does not list.
fn unlisted(dir: &Path, listed: &[&str]) -> Option<String> {
    let mut names: Vec<String> = std::fs::read_dir(dir)
        .into_iter()
        .flatten()
        .filter_map(|e| e.ok()?.file_name().into_string().ok())
        .filter(|n| {
            let l = n.to_lowercase();
            (l.ends_with(".csv") && !listed.contains(&n.as_str()))
                || (l.ends_with(".toml") && n != "campaign.toml" && !listed.contains(&n.as_str()))
        })
        .collect();
    names.sort();
    let rest = names.len().saturating_sub(3);
    let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
    match names.len() {
        0 => None,
        1 => Some(format!("{} lies in the folder but campaign.toml does not list it: it was left out.", names[0])),
        n => Some(format!(
            "{}{more} lie in the folder but campaign.toml does not list them: they were left out.",
            names[..n.min(3)].join(", ")
        )),
    }
}
