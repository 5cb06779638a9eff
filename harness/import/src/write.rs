//! Writes a campaign: its CSV files in SI, campaign.toml with where each value is from, and the preview page.

use crate::amount::digits;
use crate::cut::{cut, Samples};
use crate::plan::{Plan, Planned};
use crate::split::{parted, Track};
use crate::survey::File;
use crate::{join, page};
use crate::{Open, Options};
use output::Answer;
use rayon::prelude::*;
use record::{Channel, Kind};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// Digits of time behind those of a step.
const TIME_DIGITS: i32 = 6;

/// A recording as it was written.
#[derive(Clone, Debug)]
pub struct Written {
    /// Index among the planned.
    pub recording: usize,
    pub samples: usize,
    /// First and last time, s.
    pub times: (f64, f64),
    pub touch: Option<(f64, f64)>,
    pub turned: Vec<Channel>,
    /// How plainly its readings alone show the sign of each channel, in multiples of the noise; negative: to be turned.
    pub(crate) shown: [f64; 3],
    pub notes: Vec<String>,
    /// Its charts.
    pub charts: Vec<chart::Chart>,
}

/// What is left of a campaign once it is written.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    pub recordings: Vec<Written>,
    /// Recordings that turned out to be none, each with its file.
    pub faults: Vec<String>,
    pub notes: Vec<String>,
}

/// Text without what ends a comment.
pub(crate) fn comment(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

/// Cuts every recording of the plan and writes the campaign into `answer`.
///
/// # Errors
/// Where a file cannot be read or written, or a recording is none and the bad ones are not skipped; all of them at once.
pub fn fill(answer: &Answer, files: &[File], plan: &Plan, o: &Options, open: Open) -> Result<Outcome, Vec<String>> {
    let mut out = Outcome::default();
    let all: Vec<usize> = (0..plan.recordings.len()).collect();
    let of_files = |which: &[usize], signs: &Signs| -> Vec<_> {
        files.par_iter().enumerate().map(|file| of_file(answer, file, plan, which, signs, open)).collect()
    };
    for of in of_files(&all, &Signs::new()) {
        match of {
            Ok((written, faults)) => {
                out.recordings.extend(written);
                out.faults.extend(faults);
            }
            Err(e) => out.faults.push(e),
        }
    }
    // all recordings are of the same sensors: those whose own readings show another sign are written once more
    let signs = agreed(&out.recordings, plan, files);
    let others: Vec<usize> =
        out.recordings.iter().filter(|w| disagrees(w, &signs, plan, files)).map(|w| w.recording).collect();
    if !others.is_empty() {
        for of in of_files(&others, &signs) {
            let (written, faults) = of.unwrap_or_else(|e| (Vec::new(), vec![e]));
            out.faults.extend(faults);
            for mut w in written {
                let Some(was) = out.recordings.iter_mut().find(|o| o.recording == w.recording) else { continue };
                w.shown = was.shown;
                *was = w;
            }
        }
    }
    if !out.faults.is_empty() && (!o.skip_bad || out.recordings.is_empty()) {
        return Err(out.faults);
    }
    out.recordings.sort_by_key(|w| w.recording);
    out.notes = said(&out.recordings, plan, files);
    let text = campaign(files, plan, &out, o);
    let html = page::preview(files, plan, &out, o).html();
    for (name, bytes) in [("campaign.toml", &text), (page::NAME, &html)] {
        answer.write(name, bytes.as_bytes()).map_err(|e| vec![unwritten(name, &e)])?;
    }
    Ok(out)
}

/// That a file of the campaign cannot be written, with what to do.
pub fn unwritten(name: &str, e: &std::io::Error) -> String {
    format!("{name}: cannot be written ({e}); {}", input::cure(e).unwrap_or("give another --out"))
}

/// The sign of each column that the readings of all recordings show together, -1 or 1.
type Signs = BTreeMap<(usize, String), f64>;

/// The column that a channel of a recording is read from, as one of `Signs`: columns whose names differ by a number are of
/// one sensor. None where it has none, or the user says the sign.
fn sensor(track: &Track, c: Channel) -> Option<(usize, String)> {
    let taken = track.channels[c.index()].as_ref().filter(|t| t.sign.is_none())?;
    Some((c.index(), parted(&taken.name).0))
}

/// The track of a planned recording.
fn track<'a>(plan: &Plan, files: &'a [File], recording: usize) -> &'a Track {
    let r = &plan.recordings[recording];
    &files[r.file].seen[r.seen].track
}

/// The sign of each column, by the sum of what its recordings show; of one that none shows, none.
fn agreed(written: &[Written], plan: &Plan, files: &[File]) -> Signs {
    let mut sums = Signs::new();
    for w in written {
        for c in Channel::ALL {
            if let Some(key) = sensor(track(plan, files, w.recording), c) {
                *sums.entry(key).or_insert(0.0) += w.shown[c.index()];
            }
        }
    }
    sums.retain(|_, sum| *sum != 0.0);
    sums.values_mut().for_each(|sum| *sum = if *sum < 0.0 { -1.0 } else { 1.0 });
    sums
}

/// Whether a recording was written with another sign than its column has.
fn disagrees(w: &Written, signs: &Signs, plan: &Plan, files: &[File]) -> bool {
    let own = |c: &Channel| if w.turned.contains(c) { -1.0 } else { 1.0 };
    let of = |c: &Channel| sensor(track(plan, files, w.recording), *c).and_then(|key| signs.get(&key).copied());
    Channel::ALL.iter().any(|c| of(c).is_some_and(|sign| sign != own(c)))
}

/// The recordings of one file that are among `which`, a group at a time; and those that are none. `signs`: of the columns
/// whose sign is agreed; the others have the sign that each recording's readings show.
fn of_file(
    answer: &Answer,
    (i, file): (usize, &File),
    plan: &Plan,
    which: &[usize],
    signs: &Signs,
    open: Open,
) -> Result<(Vec<Written>, Vec<String>), String> {
    let (mut written, mut faults) = (Vec::new(), Vec::new());
    if !which.iter().any(|r| plan.recordings[*r].file == i) {
        return Ok((written, faults));
    }
    let inner = open(&file.path).map_err(|e| e.to_string())?;
    let mut source: Box<dyn instruments::Source + '_> = match &file.joined {
        Some(joined) => Box::new(join::opened(&file.path, inner, open, joined.clone())),
        None => inner,
    };
    for group in 0..file.groups.len() {
        let of: Vec<(usize, &Planned)> = which
            .iter()
            .map(|n| (*n, &plan.recordings[*n]))
            .filter(|r| r.1.file == i && r.1.span.group == group)
            .collect();
        if of.is_empty() {
            continue;
        }
        let tracks: Vec<Track> = of
            .iter()
            .map(|(_, r)| {
                let mut track = file.seen[r.seen].track.clone();
                for c in Channel::ALL {
                    let sign = sensor(&track, c).and_then(|key| signs.get(&key));
                    if let (Some(sign), Some(t)) = (sign, &mut track.channels[c.index()]) {
                        t.sign = Some(*sign);
                    }
                }
                track
            })
            .collect();
        let spans: Vec<_> = of.iter().zip(&tracks).map(|((_, r), t)| (&r.span, t)).collect();
        let samples = cut(source.as_mut(), group, &spans, plan.kind)?;
        for ((n, r), s) in of.into_iter().zip(samples) {
            match s {
                Ok(mut s) => {
                    let own = &file.seen[r.seen].track;
                    s.turned.extend(Channel::ALL.into_iter().filter(|c| {
                        sensor(own, *c).is_some_and(|key| signs.get(&key).is_some_and(|sign| *sign < 0.0))
                    }));
                    let step = file.seen[r.seen].stretches[r.stretch].step;
                    let text = csv(&s, step);
                    // with the signs agreed it is written for the second time
                    let write = if signs.is_empty() { Answer::write } else { Answer::rewrite };
                    write(answer, &r.name, text.as_bytes()).map_err(|e| unwritten(&r.name, &e))?;
                    written.push(Written {
                        recording: n,
                        samples: s.time.len(),
                        times: (s.time[0], s.time[s.time.len() - 1]),
                        touch: s.touch,
                        charts: page::charts(&s),
                        turned: s.turned,
                        shown: s.shown,
                        notes: s.notes,
                    });
                }
                Err(e) => {
                    let label = if r.label.is_empty() { String::new() } else { format!("{}: ", r.label) };
                    faults.push(format!("{}: {label}{e}", file.path.display()));
                }
            }
        }
    }
    Ok((written, faults))
}

/// Signs that were turned, a line for each channel; where they were not turned in all recordings alike, or a recording's own
/// readings show another sign than its column has, that is said.
fn said(written: &[Written], plan: &Plan, files: &[File]) -> Vec<String> {
    let mut notes = Vec::new();
    for c in Channel::ALL {
        let having: Vec<&Written> = written
            .iter()
            .filter(|w| {
                let r = &plan.recordings[w.recording];
                files[r.file].seen[r.seen].track.channels[c.index()].as_ref().is_some_and(|t| t.sign.is_none())
            })
            .collect();
        let turned = having.iter().filter(|w| w.turned.contains(&c)).count();
        let way = match c {
            Channel::Acceleration => "negative while the stop pushes back",
            Channel::Force => "positive in compression",
            Channel::Penetration => "positive into the stop",
        };
        if turned > 0 && turned == having.len() {
            notes.push(format!("the sign of {} was turned: it is {way}", c.name()));
        } else if turned > 0 {
            let others: Vec<&str> = having
                .iter()
                .filter(|w| w.turned.contains(&c) == (2 * turned < having.len()))
                .map(|w| plan.recordings[w.recording].name.as_str())
                .collect();
            notes.push(format!(
                "the sign of {} was turned in {turned} of {} recordings only: look at {}, or say the sign with --map",
                c.name(),
                having.len(),
                others.join(", ")
            ));
        }
        let against: Vec<&str> = having
            .iter()
            .filter(|w| w.shown[c.index()] * if w.turned.contains(&c) { -1.0 } else { 1.0 } < 0.0)
            .map(|w| plan.recordings[w.recording].name.as_str())
            .collect();
        if !against.is_empty() {
            notes.push(format!(
                "the sign of {} is that of its column in all recordings together; {} by itself shows the other one: look there, \
                 or say the sign with --map",
                c.name(),
                against.join(", ")
            ));
        }
    }
    notes
}

/// The CSV of a recording.
fn csv(s: &Samples, step: f64) -> String {
    let mut text = String::from("time [s]");
    for c in Channel::ALL.into_iter().filter(|c| s.channels[c.index()].is_some()) {
        // writing to a String cannot fail
        let _ = write!(text, ",{} [{}]", c.name(), c.unit());
    }
    text.push('\n');
    let decimals = (TIME_DIGITS - step.max(1e-12).log10().floor() as i32).clamp(0, 15) as usize;
    for (i, t) in s.time.iter().enumerate() {
        let time = format!("{t:.decimals$}");
        text.push_str(if time.contains('.') { time.trim_end_matches('0').trim_end_matches('.') } else { &time });
        for y in s.channels.iter().flatten() {
            text.push(',');
            text.push_str(&digits(y[i]));
        }
        text.push('\n');
    }
    text
}

/// A text as TOML has it.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_string()).to_string()
}

/// Where a recording is from, in a line.
pub(crate) fn origin(files: &[File], plan: &Plan, w: &Written) -> String {
    let r = &plan.recordings[w.recording];
    let label = if r.label.is_empty() { String::new() } else { format!(", {}", r.label) };
    format!("{}{label}", files[r.file].name())
}

/// campaign.toml.
fn campaign(files: &[File], plan: &Plan, out: &Outcome, o: &Options) -> String {
    let mut s = String::from("# written by `touchdown import`; plain SI. Every key: docs/src/formats/recordings.md\nformat = \"recordings/1\"\n\n[campaign]\n");
    let mut line = |text: String| {
        s += &text;
        s.push('\n');
    };
    line(format!("name = {}", quoted(&o.name)));
    line(format!("kind = \"{}\"   # {}", plan.kind.name(), comment(&plan.kind_from)));
    if let Some(m) = &o.material {
        line(format!("material = {}", quoted(m)));
    }
    line("\n[rig]".into());
    for g in &plan.rig {
        line(format!("{} = {}   # {}, {}", g.key, digits(g.value), g.unit, comment(&g.from)));
    }
    line(
        "\n[simulation]   # what your simulation holds beside k x^p, and its k, p and mu_d where it is calibrated"
            .into(),
    );
    let (terms, from): (Vec<String>, _) = match &o.terms {
        Some(given) => (given.iter().map(|t| quoted(t)).collect(), ""),
        None => {
            let usual = plan.kind.usual_terms().iter().map(|t| quoted(t)).collect();
            (usual, "   # as such simulations do; names of `touchdown mechanisms`; --terms")
        }
    };
    line(format!("terms = [{}]{from}", terms.join(", ")));
    for w in &out.recordings {
        let r = &plan.recordings[w.recording];
        line(format!("\n[[recording]]\nfile = \"{}\"   # {}", r.name, comment(&origin(files, plan, w))));
        let track = &files[r.file].seen[r.seen].track;
        for t in track.channels.iter().flatten() {
            let turned = w.turned.iter().any(|c| c.name() == t.role.name());
            let sign = if turned { ", sign turned" } else { "" };
            line(format!("# {}: {:?}, {}{sign}", t.role.name(), comment(&t.name), comment(&t.why)));
        }
        w.notes.iter().for_each(|n| line(format!("# {}", comment(n))));
        let of_kind = |l: &&String| plan.kind == Kind::ContactorOpening || !l.starts_with("spring_preload");
        r.facts.lines().iter().filter(of_kind).for_each(|l| line(l.clone()));
    }
    s
}
