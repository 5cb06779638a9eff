//! The recordings that lie side by side in a group: its columns, parted.

use crate::guess::{example, listed, Columns, Taken};
use crate::words::Role;
use instruments::{Clock, Group};
use record::Channel;

/// Where the time of a recording is from.
#[derive(Clone, Debug, PartialEq)]
pub enum Time {
    /// Equal steps; and what they are from.
    Steps(Clock, String),
    Column(Taken),
}

/// The columns of one recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// What distinguishes it from the others of its group; empty where it is alone.
    pub label: String,
    pub time: Time,
    /// By `record::Channel::index`.
    pub channels: [Option<Taken>; 3],
}

impl Track {
    /// The channels it has.
    pub fn has(&self) -> impl Iterator<Item = Channel> + '_ {
        Channel::ALL.into_iter().filter(|c| self.channels[c.index()].is_some())
    }
}

/// A name without its digits, and its digits.
pub(crate) fn parted(name: &str) -> (String, String) {
    let numbers: String = name.chars().map(|c| if c.is_ascii_digit() { c } else { ' ' }).collect();
    let rest: String = name.chars().filter(|c| !c.is_ascii_digit()).collect();
    (rest, numbers.split_whitespace().collect::<Vec<_>>().join("."))
}

/// Words for one of many runs.
const RUNS: [&str; 14] = [
    "drop", "test", "run", "trial", "shot", "hit", "impact", "specimen", "versuch", "messung", "probe", "essai",
    "ensayo", "prueba",
];

/// Whether the names of columns of one role differ by a number alone, or not at all.
fn numbered(columns: &[&Taken]) -> bool {
    columns.windows(2).all(|w| parted(&w[0].name).0 == parted(&w[1].name).0)
}

/// Parts the columns of a group into recordings; none where it holds no channel of a campaign. `rate`: samples per second,
/// where the user gives it. `all_split`: the user says that columns of one kind are recordings.
///
/// # Errors
/// Where columns are not clear, with what to say.
pub fn tracks(group: &Group, columns: &Columns, rate: Option<f64>, all_split: bool) -> Result<Vec<Track>, String> {
    let of = Channel::ALL.map(|c| columns.of(Role::Reading(c)));
    let times = columns.of(Role::Time);
    let count = of.iter().map(Vec::len).max().unwrap_or(0);
    if count == 0 {
        return match columns.unclear.iter().find(|u| u.0 != Role::Time) {
            Some((_, what)) => Err(format!("{what}. Its columns are {}", listed(group))),
            None => Ok(Vec::new()),
        };
    }
    if count > 1 {
        several(group, columns, &of, times.len(), count, all_split)?;
    }
    let mut tracks = Vec::new();
    for i in 0..count {
        let channels = of.each_ref().map(|c| c.get(i).map(|t| (*t).clone()));
        let label = match channels.iter().flatten().next() {
            Some(t) if count > 1 => label(&t.name, i),
            _ => String::new(),
        };
        tracks.push(Track { label, time: time(group, columns, &times, i, rate)?, channels });
    }
    Ok(tracks)
}

/// What distinguishes the `i`-th recording from the others.
fn label(name: &str, i: usize) -> String {
    let number = parted(name).1;
    if number.is_empty() {
        format!("column {} of {name}", i + 1)
    } else {
        name.to_string()
    }
}

/// Whether `count` columns of one kind are as many recordings.
fn several(
    group: &Group,
    columns: &Columns,
    of: &[Vec<&Taken>; 3],
    times: usize,
    count: usize,
    all_split: bool,
) -> Result<(), String> {
    let many: Vec<&Vec<&Taken>> = of.iter().filter(|c| !c.is_empty()).collect();
    let alike = many.iter().all(|c| c.len() == count) && (times <= 1 || times == count);
    let by_map = many.iter().all(|c| c.iter().all(|t| t.why.starts_with("by --map")));
    let named = many.iter().all(|c| numbered(c));
    let runs = |t: &Taken| RUNS.iter().any(|r| t.name.to_lowercase().contains(r));
    let plain = count >= 3 || times == count || many.len() >= 2 || many.iter().all(|c| c.iter().all(|t| runs(t)));
    if alike && (by_map || all_split || (named && plain)) {
        return Ok(());
    }
    let worst = of.iter().find(|c| c.len() > 1).map_or(&of[0], |c| c);
    let names: Vec<String> = worst.iter().map(|t| format!("{:?}", t.name)).collect();
    let role = worst.first().map_or(Role::Time, |t| t.role);
    let unit = worst.first().map_or("", |t| group.channels[t.column].unit.as_str());
    let first = worst.first().map_or("", |t| t.name.as_str());
    let more = if alike { ", or --split-columns where each is a recording of its own" } else { "" };
    let its_columns =
        if columns.taken.len() > 8 { String::new() } else { format!(". Its columns are {}", listed(group)) };
    Err(format!(
        "{} may be {}: say which, such as {}{more}{its_columns}",
        names.join(", "),
        role.name(),
        example_of(role, first, unit)
    ))
}

/// The `--map` that names the column, whose unit is known.
fn example_of(role: Role, column: &str, unit: &str) -> String {
    if record::units::measured(unit).is_some() {
        let entry = format!("{}={column}", role.name());
        if entry.contains(' ') {
            format!("--map '{entry}'")
        } else {
            format!("--map {entry}")
        }
    } else {
        example(role, column, unit)
    }
}

/// The time of the `i`-th recording.
fn time(group: &Group, columns: &Columns, times: &[&Taken], i: usize, rate: Option<f64>) -> Result<Time, String> {
    if let Some(rate) = rate {
        return Ok(Time::Steps(Clock { start: 0.0, step: 1.0 / rate }, format!("--rate {rate}")));
    }
    let said = times.first().is_some_and(|t| t.why.starts_with("by --map"));
    match (group.clock, times.get(i).or(times.first())) {
        (Some(c), _) if !said => Ok(Time::Steps(c, "the steps that the file gives".into())),
        (_, Some(t)) => Ok(Time::Column((*t).clone())),
        _ => {
            let unclear = columns.unclear.iter().find(|u| u.0 == Role::Time).map(|u| format!("{}. ", u.1));
            Err(format!(
                "{}no column is time, and the file gives no steps of it: say --rate SAMPLES_PER_SECOND or --map time=COLUMN:ms. \
                 Its columns are {}",
                unclear.unwrap_or_default(),
                listed(group)
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guess::{columns, tests::group};
    use crate::map::parse;

    fn split(names: &[(&str, &str)], map: &str, all: bool) -> Result<Vec<Track>, String> {
        let g = group(names);
        let map = if map.is_empty() { Vec::new() } else { parse(map).unwrap() };
        tracks(&g, &columns(&g, &map).unwrap(), None, all)
    }

    fn taken(t: &Track) -> Vec<&str> {
        t.channels.iter().flatten().map(|c| c.name.as_str()).collect()
    }

    #[test]
    fn columns_of_several_recordings_are_parted() {
        let pairs = [("t1", "ms"), ("Force 1", "kN"), ("t2", "ms"), ("Force 2", "kN")];
        let two = split(&pairs, "", false).unwrap();
        assert_eq!((two.len(), taken(&two[1])), (2, vec!["Force 2"]));
        assert!(matches!(&two[1].time, Time::Column(t) if t.name == "t2"));
        let shared = [("t", "s"), ("F1", "N"), ("a1", "g"), ("F2", "N"), ("a2", "g")];
        let two = split(&shared, "", false).unwrap();
        assert_eq!((taken(&two[0]), taken(&two[1])), (vec!["F1", "a1"], vec!["F2", "a2"]));
        assert_eq!(two[1].label, "F2");
        let same = [("t", "s"), ("Force", "N"), ("t", "s"), ("Force", "N")];
        assert_eq!(split(&same, "", false).unwrap().len(), 2);
        assert_eq!(split(&[("t", "s"), ("Drop 1", "N"), ("Drop 2", "N")], "", false).unwrap().len(), 2);
    }

    #[test]
    fn two_of_a_kind_are_asked_about() {
        let two = [("t", "s"), ("Force 1", "N"), ("Force 2", "N")];
        let e = split(&two, "", false).unwrap_err();
        assert!(e.contains("--map 'force=Force 1'") && e.contains("--split-columns"), "{e}");
        assert_eq!(split(&two, "", true).unwrap().len(), 2);
        assert_eq!(taken(&split(&two, "force=Force 2", false).unwrap()[0]), ["Force 2"]);
        assert_eq!(split(&two, "force=Force 2,force=Force 1", false).unwrap().len(), 2);
        assert!(split(&[("t", "s"), ("Fx", "N"), ("Fy", "N"), ("Fz", "N")], "", false).is_err());
    }

    #[test]
    fn without_time_or_meaning_an_error_lists_the_columns() {
        let e = split(&[("ai0", "kN")], "", false).unwrap_err();
        assert!(e.contains("--rate") && e.contains("\"ai0\" [kN]"), "{e}");
        let e = split(&[("Zeit", ""), ("ai0", "kN")], "", false).unwrap_err();
        assert!(e.contains("--map time=Zeit:ms"), "{e}");
        assert_eq!(split(&[("ai0", "V"), ("ai1", "V")], "", false), Ok(Vec::new()));
        let e = split(&[("t", "s"), ("Kraft", "V")], "", false).unwrap_err();
        assert!(e.contains("--map force=Kraft:2.5mV/N"), "{e}");
    }
}
