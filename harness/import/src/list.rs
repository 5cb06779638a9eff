//! What a file holds, for a reader: groups, channels, ranges, and what each would be taken as.

use crate::amount::brief;
use crate::guess::{columns, label};
use crate::join;
use crate::split::{tracks, Time};
use crate::{Open, Options};
use instruments::Source;
use serde::Serialize;
use std::fmt::{Display, Formatter};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Properties of a group that are shown.
const PROPERTIES: usize = 12;

/// What a file holds.
#[derive(Clone, Debug, Serialize)]
pub struct Listed {
    pub file: PathBuf,
    pub groups: Vec<ListedGroup>,
    /// What its reader had to put right or leave out.
    pub notes: Vec<String>,
}

/// A group of channels that share their time.
#[derive(Clone, Debug, Serialize)]
pub struct ListedGroup {
    /// As in the file; empty where it has none.
    pub name: String,
    pub samples: u64,
    /// Time between samples, s, where the file gives it beside its columns.
    pub step: Option<f64>,
    /// The first few of its properties.
    pub properties: Vec<(String, String)>,
    pub channels: Vec<ListedChannel>,
    /// What would be taken of it as a whole, or why nothing would.
    pub taken: String,
}

/// A channel.
#[derive(Clone, Debug, Serialize)]
pub struct ListedChannel {
    pub name: String,
    /// As in the file; empty where it has none.
    pub unit: String,
    /// Readings that are numbers, the least and the largest of them.
    pub samples: u64,
    pub range: Option<[f64; 2]>,
    /// What it would be taken as and why, or why it would be left out; empty where the group as a whole is none.
    pub taken: String,
}

/// Describes a file.
///
/// # Errors
/// Where it cannot be read.
pub fn list(path: &Path, o: &Options, open: Open) -> Result<Listed, String> {
    let mut source = open(path).map_err(|e| e.to_string())?;
    let groups = (0..source.groups().len()).map(|i| group(&mut *source, i, o)).collect::<Result<_, _>>()?;
    let mut notes = source.notes().to_vec();
    match join::plan(&mut *source, o) {
        Ok(joined) => notes.extend(joined.notes),
        Err(e) => notes.push(e),
    }
    Ok(Listed { file: path.into(), groups, notes })
}

fn group(source: &mut dyn Source, i: usize, o: &Options) -> Result<ListedGroup, String> {
    let g = source.groups()[i].clone();
    let mut ranges = vec![(f64::INFINITY, f64::NEG_INFINITY, 0u64); g.channels.len()];
    let read = source.read(i, &mut |block| {
        for (r, y) in ranges.iter_mut().zip(block) {
            for v in y.iter().filter(|v| v.is_finite()) {
                *r = (r.0.min(*v), r.1.max(*v), r.2 + 1);
            }
        }
        ControlFlow::Continue(())
    });
    read.map_err(|e| e.to_string())?;
    let found = columns(&g, &o.map);
    let role = |k: usize, name: &str| match &found {
        Ok(f) => match f.taken.iter().find(|t| t.column == k) {
            Some(t) => format!("{}, {}", t.role.name(), t.why),
            None => format!("left out: {}", f.left.iter().find(|l| l.0 == name).map_or("", |l| l.1.as_str())),
        },
        Err(_) => String::new(),
    };
    let channels = g.channels.iter().zip(&ranges).enumerate().map(|(k, (c, r))| ListedChannel {
        name: c.name.clone(),
        unit: c.unit.clone(),
        samples: r.2,
        range: (r.2 > 0).then_some([r.0, r.1]),
        taken: role(k, &label(c, k)),
    });
    let channels = channels.collect();
    let judged = found.map_err(|e| e.join("; ")).and_then(|f| tracks(&g, &f, o.rate, o.split_columns));
    let taken = match judged {
        Ok(t) if t.is_empty() => "no recording: no column is force, acceleration or penetration".into(),
        Ok(t) => {
            let time = match &t[0].time {
                Time::Steps(_, from) => format!("time by {from}"),
                Time::Column(c) => format!("time is {:?}", c.name),
            };
            let sides = if t.len() == 1 { String::new() } else { format!(", {} recordings side by side", t.len()) };
            format!("{time}{sides}")
        }
        Err(e) => e,
    };
    let properties = g.properties.iter().take(PROPERTIES).cloned().collect();
    Ok(ListedGroup {
        name: g.name.clone(),
        samples: g.samples,
        step: g.clock.map(|c| c.step),
        properties,
        channels,
        taken,
    })
}

impl Display for Listed {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "{}", self.file.display())?;
        for (i, g) in self.groups.iter().enumerate() {
            let name = if g.name.is_empty() { format!("group {}", i + 1) } else { format!("group {:?}", g.name) };
            let steps =
                g.step.map_or(String::new(), |s| format!(", steps of {} s ({} per second)", brief(s), brief(1.0 / s)));
            writeln!(f, "  {name}: {} channels, {} samples{steps}", g.channels.len(), g.samples)?;
            for (key, value) in &g.properties {
                writeln!(f, "    {key}: {}", value.lines().next().unwrap_or(""))?;
            }
            for (k, c) in g.channels.iter().enumerate() {
                let unit = if c.unit.is_empty() { String::new() } else { format!(" [{}]", c.unit) };
                let range = c.range.map_or(String::new(), |[low, high]| format!(", {} to {}", brief(low), brief(high)));
                writeln!(f, "    #{} {:?}{unit}: {} samples{range}: {}", k + 1, c.name, c.samples, c.taken)?;
            }
            writeln!(f, "    {}", g.taken)?;
        }
        self.notes.iter().try_for_each(|n| writeln!(f, "  note: {n}"))
    }
}
