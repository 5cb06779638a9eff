//! The preview page: what was taken of each file, and what was left out.

use crate::amount::brief;
use crate::cut::Samples;
use crate::plan::Plan;
use crate::survey::File;
use crate::write::{origin, Outcome, Written};
use crate::Options;
use chart::{Chart, Page, Style};
use record::Channel;

/// The page's file.
pub const NAME: &str = "import.html";
/// Pixels of a chart.
const SIZE: (u32, u32) = (410, 210);
/// Least share of a chart's width that a window is drawn with.
const SEEN: f64 = 0.02;

fn axis(c: Channel) -> String {
    format!("{} [{}]", c.name(), c.unit())
}

/// Charts of a recording as it was written.
pub fn charts(s: &Samples) -> Vec<Chart> {
    let of = |c: Channel| {
        let y = s.channels[c.index()].as_ref()?;
        let chart = Chart::new("", "time [s]", &axis(c)).size(SIZE.0, SIZE.1).without_names();
        Some(chart.series("", &s.time, y, Style::After))
    };
    Channel::ALL.into_iter().filter_map(of).collect()
}

/// Charts of a stretch as it was read, the windows taken from it marked.
fn as_read(page: Page, file: &File, k: usize, j: usize, windows: &[(f64, f64)]) -> Page {
    let (track, s) = (&file.seen[k].track, &file.seen[k].stretches[j]);
    let mut page = page;
    for (c, t) in Channel::ALL.into_iter().filter_map(|c| Some((c, track.channels[c.index()].as_ref()?))) {
        let curve = &s.curves[c.index()];
        let x: Vec<f64> = curve.iter().flat_map(|p| [p[0], p[0]]).collect();
        let y: Vec<f64> = curve.iter().flat_map(|p| [p[1], p[2]]).collect();
        let (low, high) = y.iter().fold((f64::MAX, f64::MIN), |m, v| (m.0.min(*v), m.1.max(*v)));
        let wide = SEEN * (s.times.1 - s.times.0);
        let mut chart = Chart::new("", "time [s]", &axis(c)).size(SIZE.0, SIZE.1).without_names();
        for w in windows {
            let more = (wide - (w.1 - w.0)).max(0.0) / 2.0;
            chart = chart.band(&[w.0 - more, w.1 + more], &[low, low], &[high, high]);
        }
        let chart = chart.series("", &x, &y, Style::After);
        page = page.chart(&chart, &format!("{:?} as read; shaded: taken", t.name));
    }
    page
}

/// One row of the table of recordings.
fn row(files: &[File], plan: &Plan, w: &Written) -> Vec<String> {
    let r = &plan.recordings[w.recording];
    let known: Vec<String> = r.facts.lines().iter().map(|l| l.split("   #").next().unwrap_or("").to_string()).collect();
    let touch = w.touch.map_or(("-".into(), "-".into()), |(a, l)| (brief(a), brief(l)));
    let mut notes = w.notes.clone();
    if !w.turned.is_empty() {
        let names: Vec<&str> = w.turned.iter().map(|c| c.name()).collect();
        notes.insert(0, format!("sign turned: {}", names.join(", ")));
    }
    vec![
        r.name.clone(),
        origin(files, plan, w),
        known.join("; "),
        w.samples.to_string(),
        format!("{} to {}", brief(w.times.0), brief(w.times.1)),
        touch.0,
        touch.1,
        notes.join("; "),
    ]
}

/// The page.
pub(crate) fn preview(files: &[File], plan: &Plan, out: &Outcome, o: &Options) -> Page {
    let mut page = Page::new(&format!("{}: what was imported", o.name))
        .sentence(&format!("{} recordings of {} files, a {}.", out.recordings.len(), files.len(), plan.kind.name()))
        .paragraph(&format!("Kind: {}.", plan.kind_from));
    for g in &plan.rig {
        page = page.paragraph(&format!("{}: {} {}, {}.", g.key, brief(g.value), g.unit, g.from));
    }
    for n in plan.notes.iter().chain(&out.notes).chain(&plan.faults).chain(&out.faults) {
        page = page.paragraph(n);
    }
    let rows: Vec<Vec<String>> = out.recordings.iter().map(|w| row(files, plan, w)).collect();
    let head = ["recording", "from", "known of it", "samples", "time [s]", "touch at [s]", "contact [s]", "notes"];
    page = page.table(&head, &rows);
    for (i, file) in files.iter().enumerate() {
        page = page.section(&file.name());
        for t in &file.taken {
            page = page.paragraph(&format!("Taken: {t}."));
        }
        for l in &file.left {
            page = page.paragraph(&format!("Left out: {l}."));
        }
        for (k, seen) in file.seen.iter().enumerate() {
            for j in 0..seen.stretches.len() {
                let here = |w: &&Written| {
                    let r = &plan.recordings[w.recording];
                    (r.file, r.seen, r.stretch) == (i, k, j)
                };
                let of: Vec<&Written> = out.recordings.iter().filter(here).collect();
                let windows: Vec<(f64, f64)> = of.iter().map(|w| w.times).collect();
                page = as_read(page, file, k, j, &windows);
                for w in of {
                    let name = &plan.recordings[w.recording].name;
                    page = w.charts.iter().fold(page, |p, c| p.chart(c, &format!("{name} as written")));
                }
            }
        }
    }
    page.trace(&o.trace)
}
