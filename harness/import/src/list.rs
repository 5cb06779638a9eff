//! What a file holds, for a reader: groups, channels, ranges, and what each would be taken as.

use crate::amount::brief;
use crate::guess::{columns, label};
use crate::split::{tracks, Time};
use crate::{Open, Options};
use std::fmt::Write;
use std::ops::ControlFlow;
use std::path::Path;

/// Properties of a group that are shown.
const PROPERTIES: usize = 12;

/// Describes a file.
///
/// # Errors
/// Where it cannot be read.
pub fn list(path: &Path, o: &Options, open: Open) -> Result<String, String> {
    let mut source = open(path).map_err(|e| e.to_string())?;
    let mut text = format!("{}\n", path.display());
    // writing to a String cannot fail
    for i in 0..source.groups().len() {
        let g = source.groups()[i].clone();
        let name = if g.name.is_empty() { format!("group {}", i + 1) } else { format!("group {:?}", g.name) };
        let steps = g
            .clock
            .map_or(String::new(), |c| format!(", steps of {} s ({} per second)", brief(c.step), brief(1.0 / c.step)));
        let _ = writeln!(text, "  {name}: {} channels, {} samples{steps}", g.channels.len(), g.samples);
        for (key, value) in g.properties.iter().take(PROPERTIES) {
            let _ = writeln!(text, "    {key}: {}", value.lines().next().unwrap_or(""));
        }
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
        for (k, c) in g.channels.iter().enumerate() {
            let role = match &found {
                Ok(f) => match f.taken.iter().find(|t| t.column == k) {
                    Some(t) => format!("{}, {}", t.role.name(), t.why),
                    None => {
                        let why = f.left.iter().find(|l| l.0 == label(c, k)).map_or("", |l| l.1.as_str());
                        format!("left out: {why}")
                    }
                },
                Err(_) => String::new(),
            };
            let unit = if c.unit.is_empty() { String::new() } else { format!(" [{}]", c.unit) };
            let (low, high, n) = ranges[k];
            let _ = writeln!(
                text,
                "    #{} {:?}{unit}: {n} samples, {} to {}: {role}",
                k + 1,
                c.name,
                brief(low),
                brief(high)
            );
        }
        let judged = found.map_err(|e| e.join("; ")).and_then(|f| tracks(&g, &f, o.rate, o.split_columns));
        let said = match judged {
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
        let _ = writeln!(text, "    {said}");
    }
    source.notes().iter().for_each(|n| {
        let _ = writeln!(text, "  note: {n}");
    });
    Ok(text)
}
