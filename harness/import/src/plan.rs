//! From what files hold to the recordings of a campaign: which, of what kind, in which order, and what is missing.

use crate::amount::{amount, brief, digits};
use crate::cut::{around, Cut, Span};
use crate::facts::{folded, key, Fact, Facts, Value, KEYS};
use crate::names::{by_count, guess, orders, GUESSED};
use crate::survey::{File, Seen, Stretch};
use crate::table::Table;
use crate::Options;
use instruments::Group;
use record::{Channel, Kind, GRAVITY};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Samples up to which a recording without a plain impact is taken as it is.
const SHORT: u64 = 4000;
/// Step of time from which on, s, and length of a contact from which on force and penetration are an indentation's.
const SLOW_STEP: f64 = 5e-3;
const SLOW: f64 = 0.3;
/// Factor between neighbouring speeds that parts two levels.
const LEVELS: f64 = 1.05;

/// A recording to be taken.
#[derive(Clone, Debug)]
pub struct Planned {
    /// Index of its file, of its track, and of the stretch in that.
    pub file: usize,
    pub seen: usize,
    pub stretch: usize,
    pub span: Span,
    /// Its CSV.
    pub name: String,
    /// What distinguishes it from others of its file.
    pub label: String,
    pub facts: Facts,
}

/// A value of the rig and where it is from.
#[derive(Clone, Debug, PartialEq)]
pub struct Given {
    pub key: &'static str,
    pub value: f64,
    pub unit: &'static str,
    pub from: String,
}

/// What no file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Missing {
    /// A key of `[rig]`, or of a recording.
    pub key: &'static str,
    /// Its quantity in the table of units, and the unit.
    pub quantity: &'static str,
    pub unit: &'static str,
    /// The files it is missing of; empty where it is of the rig.
    pub files: Vec<PathBuf>,
    /// Flags that give it.
    pub cure: String,
}

/// A campaign to be written.
#[derive(Clone, Debug)]
pub struct Plan {
    pub kind: Kind,
    /// What the kind was taken by.
    pub kind_from: String,
    pub rig: Vec<Given>,
    pub recordings: Vec<Planned>,
    pub missing: Vec<Missing>,
    /// What a reader should know: guesses, and impacts left out.
    pub notes: Vec<String>,
    /// Files that hold no recording, and why.
    pub faults: Vec<String>,
}

/// Keys of [rig]: the key, its quantity, its unit, the flag, and the kinds that need it.
const RIG: [(&str, &str, &str, &str, &[Kind]); 3] = [
    ("moving_mass", "mass", "kg", "--mass", &[Kind::DropTest, Kind::ContactorOpening]),
    ("travel", "penetration", "m", "--travel", &[Kind::ContactorOpening]),
    ("return_spring_rate", "spring rate", "N/m", "--spring-rate", &[Kind::ContactorOpening]),
];

/// Names of properties that hold keys of [rig], as engineers write them, folded.
const WORDS: [(&str, &[&str]); 3] = [
    (
        "moving_mass",
        &[
            "moving_mass",
            "mass",
            "drop_mass",
            "impactor_mass",
            "masse",
            "fallmasse",
            "bewegte_masse",
            "fallgewicht",
            "stoessermasse",
            "masse_mobile",
            "masse_en_mouvement",
            "masse_tombante",
            "masa",
            "masa_movil",
            "massa",
            "massa_mobile",
            "massa_battente",
            "质量",
            "落锤质量",
            "运动质量",
            "質量",
            "可動質量",
            "落下質量",
            "錘質量",
        ],
    ),
    (
        "travel",
        &["travel", "hub", "schaltweg", "oeffnungsweg", "course", "carrera", "corsa", "行程", "开距", "ストローク"],
    ),
    (
        "return_spring_rate",
        &[
            "return_spring_rate",
            "spring_rate",
            "federrate",
            "federkonstante",
            "federsteifigkeit",
            "raideur",
            "raideur_du_ressort",
            "rigidez",
            "rigidez_del_muelle",
            "constante_del_muelle",
            "rigidezza",
            "rigidezza_della_molla",
            "costante_della_molla",
            "弹簧刚度",
            "ばね定数",
            "バネ定数",
        ],
    ),
];

/// Plans a campaign out of files that were understood. `files` are put in the order in which people count their names.
pub fn plan(files: &mut [File], o: &Options) -> Plan {
    files.sort_by(|a, b| by_count(&a.name(), &b.name()).then_with(|| a.path.cmp(&b.path)));
    let (kind, kind_from) = kind(files, o);
    let mut p = Plan {
        kind,
        kind_from,
        rig: Vec::new(),
        recordings: Vec::new(),
        missing: Vec::new(),
        notes: Vec::new(),
        faults: Vec::new(),
    };
    for i in 0..files.len() {
        let before = p.recordings.len();
        let mut why = Vec::new();
        for (k, seen) in files[i].seen.iter().enumerate() {
            for (j, stretch) in seen.stretches.iter().enumerate() {
                recordings(&mut p, &files[i], (i, k, j), (seen, stretch), o, &mut why);
            }
        }
        if p.recordings.len() == before {
            p.faults.extend(why.iter().map(|w| format!("{}: {w}", files[i].path.display())));
        } else {
            // a plan may be made again, once what was missing is known
            why.retain(|w| !files[i].left.contains(w));
            files[i].left.extend(why);
        }
    }
    facts(&mut p, files, o);
    names(&mut p, files.len());
    order(&mut p, files);
    levels(&mut p);
    rig(&mut p, files, o);
    missing(&mut p, files);
    p
}

/// What was done: as the user says, or as the channels and the rig say.
fn kind(files: &[File], o: &Options) -> (Kind, String) {
    if let Some(k) = o.kind {
        return (k, "--kind".into());
    }
    if o.travel.is_some() || o.spring_rate.is_some() {
        return (Kind::ContactorOpening, "guessed: a travel or the rate of a return spring is given".into());
    }
    if let Some(said) = of_a_drop(files, o) {
        return (Kind::DropTest, format!("guessed: {said} is given"));
    }
    let slow = |s: &Stretch| s.step >= SLOW_STEP || s.found.drops.iter().any(|d| d.length >= SLOW);
    let mut seen = files.iter().flat_map(|f| &f.seen).peekable();
    let imposed = |s: &Seen| {
        let [force, acceleration, penetration] = s.track.channels.each_ref().map(Option::is_some);
        force && penetration && !acceleration && s.stretches.iter().all(slow)
    };
    if seen.peek().is_some() && seen.all(imposed) {
        (Kind::Indentation, "guessed: force and penetration alone, and slow".into())
    } else {
        (Kind::DropTest, "guessed: short impacts, and no travel is given".into())
    }
}

/// The mass, the speed or the height that the user gives, in words: only a drop test has one. None where none is given.
fn of_a_drop(files: &[File], o: &Options) -> Option<&'static str> {
    if o.mass.is_some() {
        return Some("a mass");
    }
    let of_table = |t: &Table| files.iter().filter_map(|f| t.of(&f.path, 0, 1).ok()).collect::<Vec<_>>();
    let mut said = o.asked.values().cloned().chain(o.table.iter().flat_map(of_table)).chain([o.all.clone()]);
    let words = |k: &&'static str| match *k {
        "impact_speed" => Some("an impact speed"),
        "start_speed" => Some("a start speed"),
        "drop_height" => Some("a drop height"),
        _ => None,
    };
    said.find_map(|f| f.0.keys().find_map(words))
}

/// The recordings of one stretch; what is none says why in `why`.
fn recordings(
    p: &mut Plan,
    file: &File,
    (i, k, j): (usize, usize, usize),
    (seen, stretch): (&Seen, &Stretch),
    o: &Options,
    why: &mut Vec<String>,
) {
    let place = |of: &str| {
        let stretches = if seen.stretches.len() > 1 { format!("part {}", j + 1) } else { String::new() };
        let group = if file.groups.len() > 1 { file.of_group(seen.group) } else { String::new() };
        let all = [group.trim_end_matches(": "), &seen.track.label, &stretches, of];
        all.iter().filter(|s| !s.is_empty()).copied().collect::<Vec<_>>().join(", ")
    };
    let mut take = |rows: (u64, u64), cut: Cut, label: String| {
        let span = Span { group: seen.group, track: k, rows, cut, level: stretch.found.level };
        p.recordings.push(Planned {
            file: i,
            seen: k,
            stretch: j,
            span,
            name: String::new(),
            label,
            facts: Facts::default(),
        });
    };
    let drops = &stretch.found.drops;
    let before = |what: &str| {
        let at = place("");
        if at.is_empty() {
            what.to_string()
        } else {
            format!("{at}: {what}")
        }
    };
    if o.keep_all || p.kind == Kind::Indentation {
        return take(stretch.rows, Cut::Whole, place(""));
    }
    why.extend(stretch.found.left.iter().map(|l| before(l)));
    let forced = seen.track.has().any(|c| c != Channel::Penetration);
    if drops.is_empty() {
        if !forced {
            why.push(before("penetration alone is not cut"));
            return take(stretch.rows, Cut::Whole, place(""));
        }
        if stretch.rows.1 - stretch.rows.0 <= SHORT {
            why.push(before("no impact stands out of the noise: it is short, and was taken whole"));
            return take(stretch.rows, Cut::Whole, place(""));
        }
        let read: Vec<String> = seen.track.has().map(|c| format!("{} {}", c.name(), range(stretch, c))).collect();
        return why.push(before(&format!(
            "no impact stands out of the noise ({}); look at its columns with --list, say others with --map, or take it \
             whole with --keep-all",
            read.join(", ")
        )));
    }
    if p.kind == Kind::ContactorOpening {
        if drops.len() > 1 {
            return why.push(before(&format!(
                "{} openings follow one another, and where each begins is not known; give a file for each opening that \
                 begins with its release",
                drops.len()
            )));
        }
        let end = around(&drops[0].contacts, stretch.rows, stretch.bucket, stretch.rows).1;
        return take((stretch.rows.0, end), Cut::Behind, place(""));
    }
    for (n, d) in drops.iter().enumerate() {
        let ended = drops[..n].last().and_then(|d| d.contacts.last()).map_or(stretch.rows.0, |c| c.1);
        let next = drops.get(n + 1).map_or(stretch.rows.1, |next| next.contacts[0].0);
        let until = d.until.map_or(next, |row| row.min(next));
        let rows = around(&d.contacts, stretch.rows, stretch.bucket, (ended, until));
        let of = if drops.len() > 1 { format!("impact at {} s", brief(d.at)) } else { String::new() };
        take(rows, Cut::Around, place(&of));
    }
}

/// Least and largest reading of a channel.
pub(crate) fn range(s: &Stretch, c: Channel) -> String {
    let (low, high) =
        s.curves[c.index()].iter().fold((f64::INFINITY, f64::NEG_INFINITY), |m, p| (m.0.min(p[1]), m.1.max(p[2])));
    format!("{} to {} {}", brief(low), brief(high), c.unit())
}

/// What tables, names and files say of each recording.
fn facts(p: &mut Plan, files: &[File], o: &Options) {
    let paths: Vec<&std::path::Path> = files.iter().map(|f| f.path.as_path()).collect();
    p.notes.extend(o.table.iter().flat_map(|t| t.strangers(&paths)));
    let mut counts = vec![0; files.len()];
    p.recordings.iter().for_each(|r| counts[r.file] += 1);
    let mut at = vec![0; files.len()];
    for r in &mut p.recordings {
        let file = &files[r.file];
        let name = file.name();
        let mut known = Facts::default();
        let mut take = |read: Result<Facts, String>| match read {
            Ok(f) => known = std::mem::take(&mut known).or(&f),
            Err(e) if !p.faults.contains(&e) => p.faults.push(e),
            Err(_) => {}
        };
        if let Some(t) = &o.table {
            take(t.of(&file.path, at[r.file], counts[r.file]));
        }
        if let Some(n) = &o.names {
            take(n.read(&name));
        }
        take(Ok(o.asked.get(&file.path).cloned().unwrap_or_default()));
        take(Ok(o.all.clone()));
        let group = &file.groups[r.span.group];
        let (said, unread) = properties(group, &name);
        take(Ok(said));
        p.notes.extend(unread.into_iter().filter(|n| !p.notes.contains(n)).collect::<Vec<_>>());
        let of = |text: &str| {
            let mut g = guess(text);
            g.0.retain(|k, _| match p.kind {
                Kind::DropTest => *k != "spring_preload",
                Kind::ContactorOpening => *k == "spring_preload",
                Kind::Indentation | Kind::System => false,
            });
            Ok(g)
        };
        take(of(&files[r.file].seen[r.seen].track.label));
        take(of(&group.name));
        take(of(file.path.file_stem().and_then(|s| s.to_str()).unwrap_or("")));
        if let Some(h) = unlikely_height(&known) {
            known.0.remove("drop_height");
            let note = format!(
                "{}: {} m in a name are no drop height, for a fall from there does not reach the speed given; say --height \
                 where they are",
                file.path.display(),
                brief(h)
            );
            p.notes.extend(Some(note).filter(|n| !p.notes.contains(n)));
        }
        r.facts = known;
        at[r.file] += 1;
    }
}

/// Factor by which the speed of a free fall and a speed that was given differ where they are not of one drop.
const NO_FALL: f64 = 2.0;

/// A drop height that was guessed from a name, m, and does not lead to the speed that is given; None where it may.
fn unlikely_height(f: &Facts) -> Option<f64> {
    let guessed = |k: &str| f.0.get(k).is_some_and(|f| f.from.starts_with(GUESSED));
    let speed = ["impact_speed", "start_speed"].into_iter().find_map(|k| f.number(k).filter(|_| !guessed(k)))?;
    let height = f.number("drop_height").filter(|_| guessed("drop_height"))?;
    let ratio = speed / (2.0 * GRAVITY * height).sqrt();
    (!(1.0 / NO_FALL..=NO_FALL).contains(&ratio)).then_some(height)
}

/// What a group's properties say, and what of them could not be read.
fn properties(group: &Group, file: &str) -> (Facts, Vec<String>) {
    let (mut facts, mut unread) = (Facts::default(), Vec::new());
    for (name, text) in &group.properties {
        let (bare, unit) = name.split_once(['[', '(']).unwrap_or((name, ""));
        let unit = unit.trim_end_matches([']', ')', ' ']);
        let Some(key) = key(bare) else { continue };
        let quantity = KEYS.iter().find(|k| k.0 == key).map_or("", |k| k.1);
        let from = format!("property {name:?} of {file}");
        if !quantity.is_empty() && unit.is_empty() && text.trim().replacen(',', ".", 1).parse::<f64>().is_ok() {
            unread.push(format!("{from} is {text:?} without a unit: left out"));
        } else if let Err(e) = facts.read(key, text, unit, &from) {
            unread.push(format!("{from}: {e}: left out"));
        }
    }
    (facts, unread)
}

/// Names of the recordings' CSV files, by file and place in it.
fn names(p: &mut Plan, files: usize) {
    let many: Vec<usize> = (0..files).map(|f| p.recordings.iter().filter(|r| r.file == f).count()).collect();
    let mut at = vec![0usize; files];
    for r in &mut p.recordings {
        at[r.file] += 1;
        let (f, n) = (r.file + 1, at[r.file]);
        r.name = match (files, many[r.file]) {
            (1, _) => format!("r{n:02}.csv"),
            (_, 1) => format!("r{f:02}.csv"),
            (_, k) if k <= 26 => format!("r{f:02}{}.csv", (b'a' + (n - 1) as u8) as char),
            _ => format!("r{f:02}-{n:02}.csv"),
        };
    }
}

/// The order in which the recordings were taken.
fn order(p: &mut Plan, files: &[File]) {
    let given: Vec<Option<f64>> = p.recordings.iter().map(|r| r.facts.number("order")).collect();
    let some = given.iter().flatten().count();
    let keys: Vec<f64> = if some == given.len() {
        let mut sorted: Vec<f64> = given.iter().flatten().copied().collect();
        sorted.sort_by(f64::total_cmp);
        sorted.dedup();
        if sorted.len() == given.len() {
            return;
        }
        p.notes.push("recordings of one order are counted on in the order of their files".into());
        given.into_iter().flatten().collect()
    } else if some > 0 {
        let without: Vec<String> =
            p.recordings.iter().zip(&given).filter(|r| r.1.is_none()).map(|r| files[r.0.file].name()).collect();
        p.faults.push(format!(
            "order is given of some recordings only, not of {}: give it of all, or of none",
            without.join(", ")
        ));
        return;
    } else {
        let names: Vec<String> = files.iter().map(File::name).collect();
        match orders(&names) {
            Some(v) => {
                p.notes.push("order: the number that differs in all names".into());
                p.recordings.iter().map(|r| v[r.file]).collect()
            }
            None => {
                if files.len() > 1 {
                    p.notes.push(
                        "order: that of the files' names; wear and softening follow it, --names or --table say another"
                            .into(),
                    );
                }
                p.recordings.iter().map(|r| r.file as f64 + 1.0).collect()
            }
        }
    };
    let mut by: Vec<usize> = (0..keys.len()).collect();
    by.sort_by(|a, b| keys[*a].total_cmp(&keys[*b]).then(a.cmp(b)));
    // the names' own numbers count recordings that are not there as well
    let own = by.windows(2).all(|w| keys[w[0]] < keys[w[1]]) && some == 0 && keys.iter().all(|k| *k > 0.0);
    for (n, i) in by.into_iter().enumerate() {
        let from = match p.recordings[i].facts.0.get("order") {
            Some(f) => f.from.clone(),
            None => "by the files' names".to_string(),
        };
        let value = Value::Number(if own { keys[i] } else { n as f64 + 1.0 });
        p.recordings[i].facts.0.insert("order", Fact { value, from });
    }
}

/// Levels of drops whose speeds alone are known: speeds that differ by some per cent are of one.
fn levels(p: &mut Plan) {
    let bare = |f: &Facts| !f.0.contains_key("level") && !f.0.contains_key("drop_height");
    if p.kind != Kind::DropTest || !p.recordings.iter().all(|r| bare(&r.facts)) {
        return;
    }
    let speed = |f: &Facts| f.number("impact_speed").or(f.number("start_speed"));
    let mut speeds: Vec<(f64, usize)> =
        p.recordings.iter().enumerate().filter_map(|(i, r)| Some((speed(&r.facts)?, i))).collect();
    if speeds.len() < p.recordings.len() {
        return;
    }
    speeds.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut groups: Vec<Vec<(f64, usize)>> = Vec::new();
    for s in speeds {
        match groups.last_mut() {
            Some(g) if g.last().is_some_and(|l| s.0 <= LEVELS * l.0) => g.push(s),
            _ => groups.push(vec![s]),
        }
    }
    for g in groups {
        let mean = g.iter().map(|s| s.0).sum::<f64>() / g.len() as f64;
        let value = Value::Number(digits_of(mean));
        for (_, i) in g {
            let from = "the mean of speeds within 5 % of their neighbours, m/s".to_string();
            p.recordings[i].facts.0.insert("level", Fact { value: value.clone(), from });
        }
    }
}

/// Three digits of a number.
fn digits_of(v: f64) -> f64 {
    format!("{v:.2e}").parse().unwrap_or(v)
}

/// What is known of the rig: flags, then properties of the files that agree.
fn rig(p: &mut Plan, files: &[File], o: &Options) {
    for (key, quantity, unit, flag, kinds) in RIG {
        let flagged = match key {
            "moving_mass" => o.mass,
            "travel" => o.travel,
            _ => o.spring_rate,
        };
        if let Some(value) = flagged {
            p.rig.push(Given { key, value, unit, from: flag.into() });
            continue;
        }
        let words = WORDS.iter().find(|w| w.0 == key).map_or(&[][..], |w| w.1);
        let mut said: BTreeMap<String, String> = BTreeMap::new();
        for f in files {
            for (name, text) in f.groups.iter().flat_map(|g| &g.properties) {
                let (bare, in_name) = name.split_once(['[', '(']).unwrap_or((name, ""));
                let in_name = in_name.trim_end_matches([']', ')', ' ']);
                let plain = folded(bare);
                let with = if in_name.is_empty() { text.clone() } else { format!("{text} {in_name}") };
                let bare_number = with.trim().replacen(',', ".", 1).parse::<f64>().is_ok();
                if let (true, false, Ok(v)) = (words.contains(&plain.as_str()), bare_number, amount(&with, quantity)) {
                    if v > 0.0 {
                        said.insert(digits(v), format!("property {name:?} of {}", f.name()));
                    }
                }
            }
        }
        match said.len() {
            1 => {
                let (value, from) = said.into_iter().next().unwrap_or_default();
                p.rig.push(Given { key, value: value.parse().unwrap_or(0.0), unit, from });
            }
            0 => {}
            _ => p.notes.push(format!("{key}: the files' properties differ; {flag} says which")),
        }
        if kinds.contains(&p.kind) && !p.rig.iter().any(|g| g.key == key) {
            let cure = format!("{flag} VALUE ({unit}, or with its unit)");
            p.missing.push(Missing { key, quantity, unit, files: Vec::new(), cure });
        }
    }
}

/// What no file holds of recordings.
fn missing(p: &mut Plan, files: &[File]) {
    let lacking = |p: &Plan, lacks: &dyn Fn(&Facts) -> bool| -> Vec<PathBuf> {
        let mut of: Vec<PathBuf> =
            p.recordings.iter().filter(|r| lacks(&r.facts)).map(|r| files[r.file].path.clone()).collect();
        of.dedup();
        of
    };
    match p.kind {
        Kind::DropTest => {
            let of = lacking(p, &|f| {
                let speed = f.number("impact_speed").or(f.number("start_speed"));
                speed.or(f.number("drop_height").filter(|h| *h > 0.0)).is_none()
            });
            if !of.is_empty() {
                let cure =
                    "--names 'drop_{height:mm}_{order}.csv' where names hold them, --table levels.csv (columns file, \
                            impact_speed [m/s] or drop_height [mm]), or --speed or --height where all are alike"
                        .into();
                p.missing.push(Missing { key: "impact_speed", quantity: "speed", unit: "m/s", files: of, cure });
            }
        }
        Kind::ContactorOpening => {
            let of = lacking(p, &|f| f.number("spring_preload").is_none());
            if !of.is_empty() {
                let cure = "--names 'open_{preload:N}_{order}.csv', --table levels.csv (columns file, spring_preload [N]), or \
                            --preload where all are alike"
                    .into();
                p.missing.push(Missing { key: "spring_preload", quantity: "force", unit: "N", files: of, cure });
            }
        }
        // what FMUs simulate is described by hand
        Kind::System => {}
        Kind::Indentation => {
            for r in &p.recordings {
                let track = &files[r.file].seen[r.seen].track;
                for c in [Channel::Force, Channel::Penetration].into_iter().filter(|c| !track.has().any(|h| h == *c)) {
                    p.faults.push(format!(
                        "{}: an indentation needs {}; say its column, such as --map {}=COLUMN:{}",
                        files[r.file].path.display(),
                        c.name(),
                        c.name(),
                        c.unit()
                    ));
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::find::tests::noise;
    use crate::guess::tests::group;
    use crate::names::Pattern;
    use crate::survey::survey;
    use instruments::Memory;
    use std::path::Path;

    /// A file of force over 3 s at 20 kHz with impacts of those peaks every second or so.
    fn file(name: &str, peaks: &[f64], properties: &[(&str, &str)]) -> File {
        let n = 60_000u64;
        let t = (0..n).map(|i| 5e-5 * i as f64).collect();
        let at = |k: usize| 8000 + 24_000 * k as u64;
        let f = (0..n)
            .map(|i| {
                let pulse = peaks.iter().enumerate().find(|(k, _)| (at(*k)..at(*k) + 40).contains(&i));
                let shape = |k: usize, p: f64| p * (std::f64::consts::PI * (i - at(k)) as f64 / 40.0).sin();
                noise(i) + pulse.map_or(0.0, |(k, p)| shape(k, *p))
            })
            .collect();
        let mut g = group(&[("t", "s"), ("F", "N")]);
        g.properties = properties.iter().map(|p| (p.0.to_string(), p.1.to_string())).collect();
        let mut m = Memory { groups: vec![g], samples: vec![vec![t, f]], notes: Vec::new() };
        survey(Path::new(name), &mut m, &Options::default(), None).unwrap()
    }

    fn said(p: &Plan) -> Vec<(&str, f64, f64)> {
        let number = |r: &Planned, k: &str| r.facts.number(k).unwrap_or(f64::NAN);
        p.recordings.iter().map(|r| (r.name.as_str(), number(r, "order"), number(r, "drop_height"))).collect()
    }

    #[test]
    fn names_give_levels_and_order_and_what_is_missing_is_reported() {
        let mut files = vec![
            file("drop_200mm_10.csv", &[500.0], &[]),
            file("drop_200mm_2.csv", &[500.0], &[]),
            file("drop_400mm_1.csv", &[900.0], &[]),
        ];
        let p = plan(&mut files, &Options::default());
        assert_eq!(p.kind, Kind::DropTest);
        assert_eq!(said(&p), [("r01.csv", 2.0, 0.2), ("r02.csv", 10.0, 0.2), ("r03.csv", 1.0, 0.4)]);
        let keys: Vec<&str> = p.missing.iter().map(|m| m.key).collect();
        assert_eq!(keys, ["moving_mass"]);
        let o = Options { mass: Some(0.5), names: Some(Pattern::parse("x{order}").unwrap()), ..Options::default() };
        assert_eq!(plan(&mut files, &o).faults.len(), 3);
    }

    #[test]
    fn several_impacts_of_a_file_are_counted_on() {
        let mut files =
            vec![file("b1.csv", &[500.0, 700.0], &[]), file("b2.csv", &[600.0], &[("Mass", "509 g"), ("Order", "x")])];
        let o = Options {
            asked: [("b2.csv".into(), {
                let mut f = Facts::default();
                f.read("impact_speed", "0.4", "", "asked").unwrap();
                f
            })]
            .into(),
            ..Options::default()
        };
        let p = plan(&mut files, &o);
        let names: Vec<&str> = p.recordings.iter().map(|r| r.name.as_str()).collect();
        assert_eq!(names, ["r01a.csv", "r01b.csv", "r02.csv"]);
        assert_eq!(said(&p).iter().map(|s| s.1).collect::<Vec<_>>(), [1.0, 2.0, 3.0]);
        assert_eq!(p.recordings[1].label, "impact at 1.6 s");
        assert_eq!((p.rig[0].value, p.rig[0].from.as_str()), (0.509, "property \"Mass\" of b2.csv"));
        assert_eq!((p.missing.len(), p.missing[0].files.clone()), (1, vec![PathBuf::from("b1.csv")]));
        assert!(p.notes.iter().any(|n| n.contains("property \"Order\"")), "{:?}", p.notes);
    }

    #[test]
    fn speeds_alone_make_levels_and_noise_alone_is_refused() {
        let mut files = vec![file("a.csv", &[500.0], &[]), file("b.csv", &[500.0], &[]), file("c.csv", &[], &[])];
        let mut o = Options { mass: Some(1.0), ..Options::default() };
        for (f, v) in [("a.csv", "0.445"), ("b.csv", "0.4449"), ("c.csv", "0.6")] {
            let mut facts = Facts::default();
            facts.read("impact_speed", v, "", "asked").unwrap();
            o.asked.insert(f.into(), facts);
        }
        let p = plan(&mut files, &o);
        assert!(p.faults.len() == 1 && p.faults[0].contains("c.csv: no impact stands out"), "{:?}", p.faults);
        let level: Vec<Option<f64>> = p.recordings.iter().map(|r| r.facts.number("level")).collect();
        assert_eq!(level, [Some(0.445), Some(0.445)]);
        o.keep_all = true;
        let p = plan(&mut files, &o);
        assert_eq!((p.recordings.len(), p.faults.len()), (3, 0));
        assert_eq!(p.recordings[2].facts.number("level"), Some(0.6));
    }
}
