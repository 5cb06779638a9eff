//! The first look at a file: its groups, what their columns are, and where the impacts lie. Read once, in bounded memory.

use crate::amount::brief;
use crate::cut::is_reading;
use crate::envelope::Envelope;
use crate::find::{find, Found};
use crate::guess::{self, columns};
use crate::join::{meant, Joined};
use crate::split::{tracks, Time, Track};
use crate::words::Role;
use crate::Options;
use instruments::{Group, Source};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Fewest samples of a recording.
const FEWEST: u64 = 16;
/// Share of a stretch by which time has to go back to begin anew.
const ANEW: f64 = 0.5;
/// Stretches of one group, at most: more are no recordings.
const MOST_STRETCHES: usize = 1000;
/// Points of a course that is drawn.
const DRAWN: usize = 400;
/// Steps of time of which the middle one is taken.
const STEPS: usize = 4096;

/// A course in which time does not begin anew.
#[derive(Clone, Debug)]
pub struct Stretch {
    /// Rows of the group: the first, and the one behind the last.
    pub rows: (u64, u64),
    /// Time of the first and the last, s.
    pub times: (f64, f64),
    /// Middle step from row to row, s.
    pub step: f64,
    /// Rows in which a sample is missing.
    pub missing: u64,
    pub found: Found,
    /// Each channel's course: time, least and largest reading, SI, signs as in the file.
    pub curves: [Vec<[f64; 3]>; 3],
    /// Rows that one bucket of the search holds.
    pub bucket: u64,
}

/// A track of a group with its stretches.
#[derive(Clone, Debug)]
pub struct Seen {
    /// Index of the group in its file.
    pub group: usize,
    pub track: Track,
    pub stretches: Vec<Stretch>,
}

/// A file as it was understood.
#[derive(Clone, Debug)]
pub struct File {
    pub path: PathBuf,
    pub groups: Vec<Group>,
    pub seen: Vec<Seen>,
    /// What was taken, and by what.
    pub taken: Vec<String>,
    /// What was left out, and why.
    pub left: Vec<String>,
    /// Its groups as they were joined.
    pub(crate) joined: Option<Joined>,
}

impl File {
    /// Its name without the folder; a question mark stands for what steers a terminal, or breaks a line.
    pub fn name(&self) -> String {
        let name = self.path.file_name().unwrap_or(self.path.as_os_str());
        name.to_string_lossy().replace(char::is_control, "?")
    }

    /// The group's name in front of what is said of it, where the file has several.
    pub fn of_group(&self, group: usize) -> String {
        place(&self.groups, group)
    }
}

fn place(groups: &[Group], group: usize) -> String {
    match groups.len() {
        1 => String::new(),
        _ if groups[group].name.is_empty() => format!("group {}: ", group + 1),
        _ => format!("{:?}: ", groups[group].name),
    }
}

/// Reads the file once. Of all its groups those are taken that hold channels of a campaign.
///
/// # Errors
/// Everything that is not clear or cannot be read, each with the file, the place and the cure.
pub fn survey(path: &Path, source: &mut dyn Source, o: &Options, joined: Option<&Joined>) -> Result<File, Vec<String>> {
    let groups = source.groups().to_vec();
    let originals = joined.map_or(groups.clone(), |j| j.originals.clone());
    let left: Vec<String> = source.notes().to_vec();
    let taken_so_far = joined.map_or(Vec::new(), |j| j.notes.clone());
    let joined = joined.cloned();
    let mut file =
        File { path: path.to_path_buf(), groups, seen: Vec::new(), taken: taken_so_far, left, joined: joined.clone() };
    let mut faults = Vec::new();
    let mapped: Vec<bool> = o.map.iter().map(|m| originals.iter().any(|g| m.column(g).is_some())).collect();
    for i in 0..file.groups.len() {
        let group = file.groups[i].clone();
        let at = place(&file.groups, i);
        let of_file = |e: String| format!("{}: {at}{e}", path.display());
        let own = joined.as_ref().and_then(|j| j.columns(i)).cloned();
        if own.is_none() && !meant(&group, &o.map) {
            file.left.push(format!("{at}--map names no column of it"));
            continue;
        }
        let found = match own.map_or_else(|| columns(&group, &o.map), Ok) {
            Ok(c) => c,
            Err(e) => {
                faults.extend(e.into_iter().map(of_file));
                continue;
            }
        };
        match tracks(&group, &found, o.rate, o.split_columns) {
            Ok(t) if t.is_empty() => {
                let columns = guess::listed(&group);
                file.left.push(format!("{at}no column of it is force, acceleration or penetration: {columns}"));
            }
            Ok(t) => {
                let names: Vec<&str> =
                    t.iter().flat_map(|t| t.channels.iter().flatten()).map(|c| c.name.as_str()).collect();
                let lost = found
                    .taken
                    .iter()
                    .filter(|c| matches!(c.role, Role::Reading(_)) && !names.contains(&c.name.as_str()));
                let lost: Vec<String> = lost
                    .map(|c| format!("{at}{:?}: another column is more plainly {}", c.name, c.role.name()))
                    .collect();
                file.left.extend(lost);
                file.left.extend(found.left.iter().map(|l| format!("{at}{:?}: {}", l.0, l.1)));
                file.taken.extend(taken(&at, &t));
                match scan(source, i, &t, o) {
                    Ok(seen) => file.seen.extend(seen),
                    Err(e) => faults.push(e),
                }
            }
            Err(e) => faults.push(of_file(e)),
        }
    }
    for (m, _) in o.map.iter().zip(&mapped).filter(|m| !m.1) {
        let columns: Vec<String> = originals.iter().map(|g| guess::listed_in(g, originals.len() > 1)).collect();
        let names: Vec<&String> = originals.iter().flat_map(|g| &g.channels).map(|c| &c.name).collect();
        let column = m.text().split(':').next().unwrap_or_default();
        faults.push(format!(
            "{}: --map {}={}: there is no such column; its columns are {}{}",
            path.display(),
            m.role.name(),
            m.text(),
            columns.join("; "),
            record::words::meant(column, &names)
        ));
    }
    faults.extend(apart(&file).map(|e| format!("{}: {e}", path.display())));
    if faults.is_empty() && file.seen.is_empty() {
        let several = originals.len() > 1;
        let columns: Vec<String> = originals.iter().map(|g| guess::listed_in(g, several)).collect();
        // a sensor's output is scaled, and most files hold the force first
        let mut outputs = originals.iter().flat_map(|g| g.channels.iter().enumerate().map(move |(k, c)| (g, k, c)));
        let output = outputs.find(|(_, _, c)| record::units::output(&c.unit).is_some());
        let such = match output {
            Some((_, k, c)) => {
                let named = guess::label(c, k);
                let of = |role| guess::example(role, &named, &c.unit);
                format!(
                    "{} or {}",
                    of(Role::Reading(record::Channel::Force)),
                    of(Role::Reading(record::Channel::Acceleration))
                )
            }
            None => "--map force=COLUMN:kN or --map acceleration=COLUMN:10mV/g".to_string(),
        };
        faults.push(format!(
            "{}: no column is known to be force, acceleration or penetration; say which, such as {such}. Its columns are {}",
            path.display(),
            columns.join("; ")
        ));
    }
    let short = |s: &Seen| {
        let label = if s.track.label.is_empty() { String::new() } else { format!("{}: ", s.track.label) };
        format!("{}{label}it holds fewer than {FEWEST} samples in a row", place(&file.groups, s.group))
    };
    let shorts: Vec<String> = file.seen.iter().filter(|s| s.stretches.is_empty()).map(short).collect();
    // a short block of a file, beside others, is no recording
    if shorts.len() < file.seen.len() {
        file.left.extend(shorts);
    } else {
        faults.extend(shorts.into_iter().map(|s| format!("{}: {s}; record more", path.display())));
    }
    if faults.is_empty() {
        Ok(file)
    } else {
        Err(faults)
    }
}

/// Channels of one recording that lie in two groups, sampled apart: taken as two recordings they would be wrong.
fn apart(file: &File) -> Option<String> {
    let span = |s: &Seen| Some((s.stretches.first()?.times.0, s.stretches.last()?.times.1));
    let together = |a: &Seen, b: &Seen| {
        let (Some(x), Some(y)) = (span(a), span(b)) else { return false };
        x.0 < y.1 && y.0 < x.1
    };
    let pairs = file.seen.iter().enumerate().flat_map(|(i, a)| file.seen[i + 1..].iter().map(move |b| (a, b)));
    let (a, b) = pairs
        .filter(|(a, b)| a.group != b.group && together(a, b))
        .find(|(a, b)| a.track.has().all(|c| b.track.has().all(|d| c != d)))?;
    let of = |s: &Seen| s.track.channels.iter().flatten().next().map_or(String::new(), |t| t.name.clone());
    let names = |s: &Seen| s.track.has().map(record::Channel::name).collect::<Vec<_>>().join(" and ");
    Some(format!(
        "{}{}, but {}{}: they are sampled apart; write them into one table, or take those of one group, such as --map \
         '{}={}'",
        file.of_group(a.group),
        names(a),
        file.of_group(b.group),
        names(b),
        a.track.has().next().map_or("", record::Channel::name),
        of(a)
    ))
}

/// What was taken of a group, a line for each kind of column.
fn taken(at: &str, tracks: &[Track]) -> Vec<String> {
    let mut lines = Vec::new();
    if let [_, _, ..] = tracks {
        lines.push(format!("{at}{} recordings lie side by side in its columns", tracks.len()));
    }
    let Some(first) = tracks.first() else { return lines };
    lines.push(match &first.time {
        Time::Steps(c, from) => format!("{at}time: steps of {} s, {from}", brief(c.step)),
        Time::Column(t) => format!("{at}time: {:?}, {}", t.name, t.why),
    });
    for c in first.has() {
        let of: Vec<_> = tracks.iter().filter_map(|t| t.channels[c.index()].as_ref()).collect();
        let names = match of.as_slice() {
            [one] => format!("{:?}", one.name),
            [one, .., last] => format!("{:?} to {:?}", one.name, last.name),
            [] => continue,
        };
        lines.push(format!("{at}{}: {names}, {}", c.name(), of[0].why));
    }
    lines
}

/// A stretch that is being read.
struct Open {
    from: u64,
    end: u64,
    first: f64,
    last: f64,
    missing: u64,
    steps: Vec<f64>,
    envelope: Envelope,
}

/// Stretches of a track as they are read.
struct Scan<'a> {
    track: &'a Track,
    least: f64,
    open: Option<Open>,
    done: Vec<Stretch>,
}

impl Scan<'_> {
    fn add(&mut self, row: u64, time: f64, y: [f64; 3]) {
        if let Some(o) = &self.open {
            if o.last - time > ANEW * (o.last - o.first) && time < o.last {
                self.close();
            }
        }
        let has = self.track.channels.each_ref().map(Option::is_some);
        let whole = is_reading(time) && y.iter().zip(has).all(|(v, h)| !h || is_reading(*v));
        if !whole {
            if let Some(o) = &mut self.open {
                let last = o.last;
                o.envelope.add(last, [f64::NAN; 3]);
                o.missing += 1;
            }
            return;
        }
        let o = self.open.get_or_insert_with(|| Open {
            from: row,
            end: row,
            first: time,
            last: time,
            missing: 0,
            steps: Vec::new(),
            envelope: Envelope::new(has),
        });
        if o.steps.len() < STEPS && row > o.from {
            o.steps.push(time - o.last);
        }
        (o.end, o.last) = (row + 1, time);
        o.envelope.add(time, y);
    }

    fn close(&mut self) {
        let Some(mut o) = self.open.take() else { return };
        if o.end - o.from < FEWEST {
            return;
        }
        o.steps.sort_by(f64::total_cmp);
        let middle = o.steps[o.steps.len() / 2];
        let step = if middle > 0.0 { middle } else { (o.last - o.first) / (o.end - o.from) as f64 };
        // what is missing at the end is no gap: the column is shorter
        let behind = o.envelope.rows_added() - (o.end - o.from);
        self.done.push(Stretch {
            rows: (o.from, o.end),
            times: (o.first, o.last),
            step,
            missing: o.missing.saturating_sub(behind),
            found: find(&o.envelope, o.from, self.least),
            curves: [0, 1, 2].map(|c| o.envelope.curve(c, DRAWN)),
            bucket: o.envelope.rows,
        });
    }
}

/// The rows of a group as a track reads them: SI, signs as in the file.
pub(crate) fn rows(track: &Track, block: &[&[f64]], from: u64, mut each: impl FnMut(u64, f64, [f64; 3])) {
    let count = block.first().map_or(0, |c| c.len());
    for i in 0..count {
        let row = from + i as u64;
        let time = match &track.time {
            Time::Steps(c, _) => c.start + c.step * row as f64,
            Time::Column(t) => t.factor * block[t.column][i],
        };
        let y = track.channels.each_ref().map(|c| c.as_ref().map_or(f64::NAN, |c| c.factor * block[c.column][i]));
        each(row, time, y);
    }
}

fn scan(source: &mut dyn Source, group: usize, tracks: &[Track], o: &Options) -> Result<Vec<Seen>, String> {
    let mut scans: Vec<Scan> =
        tracks.iter().map(|track| Scan { track, least: o.least, open: None, done: Vec::new() }).collect();
    let mut at = 0;
    let mut torn = false;
    let read = source.read(group, &mut |block| {
        for s in &mut scans {
            let track = s.track;
            rows(track, block, at, |row, time, y| s.add(row, time, y));
            torn |= s.done.len() > MOST_STRETCHES;
        }
        at += block.first().map_or(0, |c| c.len()) as u64;
        if torn {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    read.map_err(|e| e.to_string())?;
    if torn {
        return Err(format!(
            "the column that was taken as time goes back more than {MOST_STRETCHES} times; say --map time=COLUMN:s or --rate"
        ));
    }
    let close = |mut s: Scan| {
        s.close();
        Seen { group, track: s.track.clone(), stretches: s.done }
    };
    Ok(scans.into_iter().map(close).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guess::tests::group;
    use instruments::Memory;

    fn seen(columns: &[(&str, &str)], samples: Vec<Vec<f64>>) -> Result<File, Vec<String>> {
        let groups = vec![group(columns)];
        let mut m = Memory { groups, samples: vec![samples], notes: Vec::new() };
        survey(Path::new("a.csv"), &mut m, &Options::default(), None)
    }

    #[test]
    fn time_that_begins_anew_begins_another_recording() {
        let time: Vec<f64> = (0..300).map(|i| f64::from(i % 100)).collect();
        let f = seen(&[("t", "ms"), ("F", "kN")], vec![time, vec![1.0; 300]]).unwrap();
        let rows: Vec<(u64, u64)> = f.seen[0].stretches.iter().map(|s| s.rows).collect();
        assert_eq!(rows, [(0, 100), (100, 200), (200, 300)]);
        assert!((f.seen[0].stretches[1].step - 1e-3).abs() < 1e-12);
        assert_eq!(f.seen[0].stretches[1].curves[0][5], [0.005, 1000.0, 1000.0]);
    }

    #[test]
    fn a_shorter_column_ends_earlier_and_a_gap_is_counted() {
        let t: Vec<f64> = (0..100).map(f64::from).collect();
        let mut a = vec![1.0; 60];
        a[10] = f64::NAN;
        let f = seen(&[("t", "s"), ("F1", "N"), ("F2", "N"), ("F3", "N")], vec![t, a, vec![2.0; 100], vec![3.0; 100]])
            .unwrap();
        assert_eq!((f.seen.len(), f.seen[0].stretches[0].rows, f.seen[0].stretches[0].missing), (3, (0, 60), 1));
        assert_eq!(f.taken[0], "3 recordings lie side by side in its columns");
        assert!(f.taken[2].contains("\"F1\" to \"F3\", by its unit N and its name"), "{:?}", f.taken);
    }

    #[test]
    fn channels_of_two_groups_are_no_two_recordings() {
        let t: Vec<f64> = (0..100).map(f64::from).collect();
        let mut m = Memory {
            groups: vec![group(&[("t", "ms"), ("F", "N")]), group(&[("t", "ms"), ("a", "g")])],
            samples: vec![vec![t.clone(), t.clone()], vec![t.clone(), t]],
            notes: Vec::new(),
        };
        let e = survey(Path::new("a.mf4"), &mut m, &Options::default(), None).unwrap_err();
        assert!(e[0].contains("sampled apart") && e[0].contains("--map 'force=F'"), "{e:?}");
        let map = crate::map::parse("force=F").unwrap();
        let f = survey(Path::new("a.mf4"), &mut m, &Options { map, ..Options::default() }, None).unwrap();
        assert_eq!((f.seen.len(), f.left.len()), (1, 1));
    }

    #[test]
    fn a_short_block_beside_others_is_left_out() {
        let block = |n: u32| vec![(0..n).map(f64::from).collect::<Vec<f64>>(), vec![1.0; n as usize]];
        let mut blocks = [group(&[("t", "s"), ("F", "N")]), group(&[("t", "s"), ("F", "N")])];
        blocks.iter_mut().enumerate().for_each(|(i, g)| g.name = format!("table {}", i + 1));
        let mut m = Memory { groups: blocks.to_vec(), samples: vec![block(10), block(40)], notes: Vec::new() };
        let f = survey(Path::new("a.csv"), &mut m, &Options::default(), None).unwrap();
        assert_eq!(f.seen.iter().map(|s| s.stretches.len()).collect::<Vec<_>>(), [0, 1]);
        assert!(f.left.iter().any(|l| l == "\"table 1\": it holds fewer than 16 samples in a row"), "{:?}", f.left);
    }

    #[test]
    fn a_file_without_a_channel_lists_its_columns() {
        let e = seen(&[("ai0", "V"), ("ai1", "V")], vec![vec![0.0; 20], vec![0.0; 20]]).unwrap_err();
        assert!(e[0].contains("such as --map force=ai0:2.5mV/N or --map acceleration=ai0:10mV/g"), "{e:?}");
        assert!(e[0].starts_with("a.csv: no column is known") && e[0].contains("\"ai0\" [V], \"ai1\" [V]"), "{e:?}");
        let e = seen(&[("t", "s"), ("F", "N")], vec![vec![0.0; 9], vec![0.0; 9]]).unwrap_err();
        assert!(e[0].contains("fewer than 16 samples"), "{e:?}");
    }
}
