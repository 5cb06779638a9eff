//! Reads a campaign folder.

use super::*;
use std::collections::BTreeMap;
use std::path::Path;

/// What is wrong with a campaign: where, what, and the cure.
#[derive(Debug, thiserror::Error)]
#[error("{file}{}: {what}; {cure}", if *.line > 0 { format!(":{}", .line) } else { String::new() })]
pub struct RecordError {
    pub file: String,
    /// Counted from 1; 0 where no line is to blame.
    pub line: usize,
    pub what: String,
    pub cure: String,
}

fn err(file: &Path, line: usize, what: impl Into<String>, cure: impl Into<String>) -> RecordError {
    RecordError { file: file.display().to_string(), line, what: what.into(), cure: cure.into() }
}

fn unit_of(channel: &str, unit: &str) -> Option<f64> {
    let v = match (channel, unit) {
        ("time", "s")
        | ("force", "N")
        | ("acceleration", "m/s^2" | "m/s2" | "m/s²" | "m/s/s")
        | ("penetration", "m") => 1.0,
        ("time", "ms") | ("force", "mN") | ("penetration", "mm") | ("acceleration", "mm/s^2") => 1e-3,
        ("time", "us") | ("time", "µs") | ("force", "uN") | ("force", "µN") => 1e-6,
        ("penetration", "um") | ("penetration", "µm") => 1e-6,
        ("time", "ns") | ("force", "nN") | ("penetration", "nm") => 1e-9,
        ("force", "pN") | ("penetration", "pm") => 1e-12,
        ("time", "min") => 60.0,
        ("force", "kN") | ("acceleration", "km/s^2") => 1e3,
        ("force", "MN") => 1e6,
        ("penetration", "cm") | ("acceleration", "cm/s^2") => 1e-2,
        ("acceleration", "g" | "gn" | "g0") => 9.80665,
        ("force", "lbf") => 4.4482216152605,
        ("penetration", "in") => 0.0254,
        ("force", "kgf") => 9.80665,
        _ => return None,
    };
    Some(v)
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    format: toml::Spanned<String>,
    campaign: Head,
    #[serde(default)]
    rig: Rig,
    #[serde(default)]
    simulation: Sim,
    #[serde(default)]
    recording: Vec<toml::Spanned<Rec>>,
}

#[derive(serde::Deserialize)]
struct Head {
    #[serde(default)]
    name: Option<String>,
    kind: toml::Spanned<String>,
    #[serde(default)]
    material: Option<String>,
}

#[derive(serde::Deserialize, Default)]
struct Rig {
    moving_mass: Option<toml::Spanned<f64>>,
    travel: Option<toml::Spanned<f64>>,
    return_spring_rate: Option<toml::Spanned<f64>>,
}

#[derive(serde::Deserialize, Default)]
struct Sim {
    #[serde(default)]
    terms: Vec<toml::Spanned<String>>,
    k: Option<toml::Spanned<f64>>,
    p: Option<toml::Spanned<f64>>,
    mu_d: Option<toml::Spanned<f64>>,
}

#[derive(serde::Deserialize)]
struct Rec {
    file: toml::Spanned<String>,
    order: Option<f64>,
    level: Option<toml::Value>,
    drop_height: Option<f64>,
    impact_speed: Option<f64>,
    impact_speed_std: Option<f64>,
    start_speed: Option<f64>,
    start_speed_std: Option<f64>,
    spring_preload: Option<f64>,
}

/// Reads and checks the campaign in `dir`.
///
/// # Errors
/// Anything the format `recordings/1` does not allow, with file, line and cure.
pub fn load(dir: &Path) -> Result<Campaign, RecordError> {
    let path = dir.join("campaign.toml");
    let text = std::fs::read_to_string(&path).map_err(|e| {
        err(
            &path,
            0,
            format!("cannot be read ({e})"),
            "name a folder that holds a campaign.toml of format recordings/1",
        )
    })?;
    let line = |at: usize| text[..at.min(text.len())].matches('\n').count() + 1;
    let f: File = toml::from_str(&text).map_err(|e| {
        let l = e.span().map_or(0, |s| line(s.start));
        err(&path, l, e.message().to_string(), "correct this entry as the format recordings/1 says")
    })?;
    if f.format.get_ref() != "recordings/1" {
        return Err(err(
            &path,
            line(f.format.span().start),
            format!("format {:?} is not known", f.format.get_ref()),
            "write format = \"recordings/1\"",
        ));
    }
    let named = f.campaign.kind.get_ref();
    let kind = Kind::ALL.into_iter().find(|k| k.name() == named).ok_or_else(|| {
        err(
            &path,
            line(f.campaign.kind.span().start),
            format!("kind {named:?} is not known"),
            "use drop-test, contactor-opening or indentation",
        )
    })?;
    let positive = |v: &Option<toml::Spanned<f64>>, name: &str, zero: bool| -> Result<Option<f64>, RecordError> {
        match v {
            None => Ok(None),
            Some(s) => {
                let x = *s.get_ref();
                if x.is_finite() && (x > 0.0 || zero && x == 0.0) {
                    Ok(Some(x))
                } else {
                    Err(err(
                        &path,
                        line(s.span().start),
                        format!("{name} = {x} is not a positive number"),
                        format!("give {name} in SI units, or leave it out"),
                    ))
                }
            }
        }
    };
    let moving_mass = positive(&f.rig.moving_mass, "moving_mass", false)?;
    let travel = positive(&f.rig.travel, "travel", false)?;
    let return_spring_rate = positive(&f.rig.return_spring_rate, "return_spring_rate", true)?;
    let k = positive(&f.simulation.k, "k", false)?;
    let p = positive(&f.simulation.p, "p", false)?;
    let mu_d = positive(&f.simulation.mu_d, "mu_d", true)?;
    if kind != Kind::Indentation && moving_mass.is_none() {
        return Err(err(&path, 0, "moving_mass is missing under [rig]", "add moving_mass in kg"));
    }
    if kind == Kind::ContactorOpening && (travel.is_none() || return_spring_rate.is_none()) {
        return Err(err(&path, 0, "travel or return_spring_rate is missing under [rig]", "add both, in m and N/m"));
    }
    if f.recording.is_empty() {
        return Err(err(&path, 0, "no [[recording]] is listed", "list each CSV file under [[recording]]"));
    }
    let mut recordings = Vec::new();
    let mut labels: Vec<(f64, String)> = Vec::new();
    let mut seen = BTreeMap::new();
    for (i, r) in f.recording.iter().enumerate() {
        let at = line(r.span().start);
        let r = r.get_ref();
        let name = r.file.get_ref().clone();
        if name.contains('/') || name.contains('\\') || name.is_empty() {
            return Err(err(
                &path,
                at,
                format!("file {name:?} is not a plain file name"),
                "keep recordings beside campaign.toml",
            ));
        }
        if let Some(before) = seen.insert(name.clone(), at) {
            return Err(err(
                &path,
                at,
                format!("{name} is listed twice (first at line {before})"),
                "list every recording once; two campaigns belong in two folders",
            ));
        }
        let number = |v: Option<f64>, what: &str| match v {
            Some(x) if !x.is_finite() || x < 0.0 => Err(err(
                &path,
                at,
                format!("{what} = {x} is not a number from 0 on"),
                format!("give {what} in SI units"),
            )),
            v => Ok(v),
        };
        let drop_height = number(r.drop_height, "drop_height")?;
        let spring_preload = number(r.spring_preload, "spring_preload")?;
        let pair = |v: Option<f64>, s: Option<f64>, what: &str| -> Result<Option<(f64, f64)>, RecordError> {
            let s = number(s, &format!("{what}_std"))?;
            Ok(number(v, what)?.map(|v| (v, s.filter(|s| *s > 0.0).unwrap_or(0.01 * v))))
        };
        let mut impact_speed = pair(r.impact_speed, r.impact_speed_std, "impact_speed")?;
        let start_speed = pair(r.start_speed, r.start_speed_std, "start_speed")?;
        if kind == Kind::DropTest && impact_speed.is_none() && start_speed.is_none() {
            match drop_height {
                Some(h) if h > 0.0 => {
                    let v = (2.0 * crate::GRAVITY * h).sqrt();
                    impact_speed = Some((v, 0.03 * v));
                }
                _ => {
                    return Err(err(
                        &path,
                        at,
                        format!("{name}: neither impact_speed, start_speed nor drop_height is given"),
                        "add impact_speed in m/s",
                    ))
                }
            }
        }
        if kind == Kind::ContactorOpening && spring_preload.is_none() {
            return Err(err(&path, at, format!("{name}: spring_preload is missing"), "add spring_preload in N"));
        }
        let label = match (kind, drop_height, spring_preload, &r.level) {
            (_, _, _, Some(toml::Value::Float(x))) => (*x, format!("{x}")),
            (_, _, _, Some(toml::Value::Integer(x))) => (*x as f64, format!("{x}")),
            (_, _, _, Some(toml::Value::String(s))) => (s.parse().unwrap_or(f64::NAN), s.clone()),
            (_, Some(h), _, _) => (h, format!("{h} m")),
            (_, _, Some(s), _) => (s, format!("{s} N")),
            _ => (0.0, "all".to_string()),
        };
        let level = match labels.iter().position(|l| l.1 == label.1) {
            Some(i) => i,
            None => {
                labels.push(label);
                labels.len() - 1
            }
        };
        let (time, channels, columns) = read_csv(&dir.join(&name))?;
        recordings.push(Recording {
            file: name,
            order: r.order.unwrap_or(i as f64 + 1.0),
            level,
            drop_height,
            impact_speed,
            start_speed,
            spring_preload,
            time,
            channels,
            columns,
        });
    }
    // levels ascending
    let mut perm: Vec<usize> = (0..labels.len()).collect();
    perm.sort_by(|a, b| labels[*a].0.total_cmp(&labels[*b].0));
    let levels: Vec<_> = perm.iter().map(|i| labels[*i].clone()).collect();
    for r in &mut recordings {
        r.level = perm.iter().position(|i| *i == r.level).unwrap_or(0);
    }
    for r in &recordings {
        let need: &[Channel] = if kind == Kind::Indentation { &[Channel::Force, Channel::Penetration] } else { &[] };
        for c in need {
            if r.channels[c.index()].is_none() {
                return Err(err(
                    &dir.join(&r.file),
                    1,
                    format!("an indentation needs the channel {}", c.name()),
                    "record both force and penetration",
                ));
            }
        }
        if r.channels.iter().all(Option::is_none) {
            return Err(err(
                &dir.join(&r.file),
                1,
                "there is no channel besides time",
                "record force [N], acceleration [m/s^2] or penetration [m]",
            ));
        }
    }
    let folder = dir
        .canonicalize()
        .ok()
        .and_then(|d| d.file_name().map(|n| n.to_string_lossy().into_owned()))
        .unwrap_or_else(|| "campaign".into());
    let listed: Vec<&str> = recordings.iter().map(|r| r.file.as_str()).collect();
    let mut warnings = unlisted(dir, &listed);
    let orders: Vec<(f64, &str)> =
        f.recording.iter().filter_map(|r| Some((r.get_ref().order?, r.get_ref().file.get_ref().as_str()))).collect();
    let again = |i: usize| orders[..i].iter().find(|o| o.0 == orders[i].0).map(|o| (o.1, orders[i].1, o.0));
    if let Some((a, b, order)) = (0..orders.len()).find_map(again) {
        warnings.push(format!(
            "{a} and {b} both have order {order}: give orders as they were taken; two campaigns belong in two folders."
        ));
    }
    Ok(Campaign {
        dir: dir.to_path_buf(),
        name: f.campaign.name.clone().unwrap_or_else(|| folder.clone()),
        folder,
        kind,
        material: f.campaign.material,
        moving_mass,
        travel,
        return_spring_rate,
        simulation: Simulation { terms: f.simulation.terms.iter().map(|s| s.get_ref().clone()).collect(), k, p, mu_d },
        levels,
        recordings,
        warnings,
    })
}

/// Recordings and campaign files in the folder that campaign.toml does not list.
fn unlisted(dir: &Path, listed: &[&str]) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(dir)
        .into_iter()
        .flatten()
        .filter_map(|e| e.ok()?.file_name().into_string().ok())
        .filter(|n| {
            let l = n.to_lowercase();
            (l.ends_with(".csv") && !listed.contains(&n.as_str())) || (l.ends_with(".toml") && n != "campaign.toml")
        })
        .collect();
    names.sort();
    let rest = names.len().saturating_sub(3);
    let more = if rest > 0 { format!(" and {rest} more") } else { String::new() };
    match names.len() {
        0 => Vec::new(),
        1 => vec![format!("{} lies in the folder but campaign.toml does not list it: it was left out.", names[0])],
        n => vec![format!(
            "{}{more} lie in the folder but campaign.toml does not list them: they were left out.",
            names[..n.min(3)].join(", ")
        )],
    }
}

type Columns = (Vec<f64>, [Option<Vec<f64>>; 3], Vec<Column>);

/// Fewest samples a recording may have.
const FEWEST: usize = 16;

fn read_csv(path: &Path) -> Result<Columns, RecordError> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_path(path).map_err(|e| {
        err(
            path,
            0,
            format!("cannot be read ({e})"),
            "put the recording beside campaign.toml, or take it out of the list",
        )
    })?;
    let head =
        reader.headers().map_err(|e| err(path, 1, e.to_string(), "write a header of columns \"name [unit]\""))?.clone();
    let mut columns = Vec::new();
    for h in &head {
        let (name, unit) = match h.split_once('[') {
            Some((n, u)) if u.ends_with(']') => (n.trim().to_string(), u[..u.len() - 1].trim().to_string()),
            _ => return Err(err(path, 1, format!("column {h:?} has no unit"), "write it as \"name [unit]\"")),
        };
        if !["time", "force", "acceleration", "penetration"].contains(&name.as_str()) {
            return Err(err(
                path,
                1,
                format!("column {name:?} is not known"),
                "use time, force, acceleration, penetration",
            ));
        }
        if columns.iter().any(|c: &Column| c.name == name) {
            return Err(err(path, 1, format!("column {name:?} stands twice"), "keep one of them"));
        }
        let Some(to_si) = unit_of(&name, &unit) else {
            return Err(err(
                path,
                1,
                format!("unit {unit:?} does not measure {name}"),
                "use s/ms, N/kN, m/mm/um, m/s^2/g or their like",
            ));
        };
        columns.push(Column { name, unit, to_si });
    }
    let Some(ti) = columns.iter().position(|c| c.name == "time") else {
        return Err(err(path, 1, "there is no column time", "add time [s]"));
    };
    let mut data: Vec<Vec<f64>> = vec![Vec::new(); columns.len()];
    // the line each row stood on: blank lines are skipped, not counted away
    let mut lines: Vec<usize> = Vec::new();
    for row in reader.records() {
        let row = row.map_err(|e| {
            let l = e.position().map_or(0, |p| p.line() as usize);
            err(path, l, "this row has another number of cells than the header", "complete or remove it")
        })?;
        let l = row.position().map_or(0, |p| p.line() as usize);
        for (i, cell) in row.iter().enumerate() {
            let v: f64 = cell.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| {
                err(
                    path,
                    l,
                    format!("{} holds {cell:?}, not a finite number", columns[i].name),
                    "remove the rows of the gap, or cut the recording there",
                )
            })?;
            data[i].push(v * columns[i].to_si);
        }
        lines.push(l);
    }
    let n = data[ti].len();
    if n < FEWEST {
        return Err(err(
            path,
            lines.last().copied().unwrap_or(1),
            format!("{n} samples are too few to judge anything"),
            format!("record at least {FEWEST} samples"),
        ));
    }
    for i in 1..n {
        if data[ti][i] <= data[ti][i - 1] {
            return Err(err(
                path,
                lines[i],
                "time does not increase here",
                "sort the rows by time, remove repeats, and keep one recording a file",
            ));
        }
    }
    let mut steps: Vec<f64> = data[ti].windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_by(f64::total_cmp);
    let median = steps[steps.len() / 2];
    for i in 1..n {
        if data[ti][i] - data[ti][i - 1] > 5.0 * median {
            return Err(err(
                path,
                lines[i],
                format!("a gap of {:.3} s against {:.3e} s a sample", data[ti][i] - data[ti][i - 1], median),
                "cut the recording at the gap",
            ));
        }
    }
    let time = data[ti].clone();
    let mut channels: [Option<Vec<f64>>; 3] = [None, None, None];
    for c in Channel::ALL {
        if let Some(i) = columns.iter().position(|k| k.name == c.name()) {
            channels[c.index()] = Some(std::mem::take(&mut data[i]));
        }
    }
    Ok((time, channels, columns))
}
