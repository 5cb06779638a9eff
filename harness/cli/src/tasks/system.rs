//! A system of FMUs simulated.

use super::run::{Options, Ran, Summed};
use super::Follow;
use crate::place;
use crate::print::{self, Shown};
use anyhow::{Context, Result};
use host::master::{are_rows, build, run as step, Sink, System, TIME};
use sha2::{Digest, Sha256};
use std::io::Read;

/// What FMUs have logged of a run that ended with an error, and its first line.
const PARTIAL_LOG: &str = "log.partial.txt";
const LOG: &str = "What the FMUs have logged until the run ended with an error; SHA-256 of the lines below: ";

/// The text of a log that stays after an error: its first line holds the hash of the others.
fn partial_log(lines: &str) -> String {
    format!("{LOG}{}\n{lines}", output::hexadecimal(&Sha256::digest(lines)))
}

/// Bytes of a log that are read at most to see whose it is.
const LONGEST_LOG: u64 = 1 << 28;

/// Whether a file is such a log, as it was written.
fn is_partial_log(file: std::fs::File) -> bool {
    let mut text = String::new();
    let read = file.take(LONGEST_LOG).read_to_string(&mut text);
    read.is_ok() && text.split_once('\n').is_some_and(|(_, lines)| text == partial_log(lines))
}

/// Runs a system file or an SSP archive: results.csv (or .parquet), log.txt, summary.json. Rows are in
/// results.partial.csv.part while it runs, and in results.partial.csv where it ends with an error; the answer before stays
/// then.
///
/// # Errors
/// What is wrong with the file or with an FMU; a place that cannot be written.
pub(super) fn simulated(o: &Options, follow: &dyn Follow) -> Result<Ran> {
    let (path, out, parquet) = (&o.scenario, &o.out, o.parquet);
    let mut s = System::load(path)?;
    s.isolation = o.isolation.clone();
    s.master.step = o.step.or(s.master.step);
    s.master.stop = o.stop.unwrap_or(s.master.stop);
    follow.looks();
    let mut b = build(&s)?;
    for n in &b.notes {
        follow.warning(n);
    }
    let (name, partial) = match parquet || b.parquet {
        true => ("results.parquet", "results.partial.parquet"),
        false => ("results.csv", "results.partial.csv"),
    };
    let rows = out.join(partial);
    let mut head: Vec<String> = vec![TIME.into()];
    head.extend(b.columns.iter().map(|c| c.head.clone()));
    let mut sink = Sink::new(&rows, &head, parquet || b.parquet)?;
    sink.kept().iter().for_each(|k| follow.warning(&format!("{}: {}", out.shown(), k.note())));
    let whole = 1000u64;
    follow.begin("run", whole);
    let (start, stop) = (b.options.start, b.options.stop);
    let (mut shown, mut since) = (0u64, 0u64);
    let mut row = Vec::with_capacity(head.len());
    let (columns, every) = (&b.columns, b.every);
    let done = step(&mut b.network, &b.options, b.start.clone(), &mut |network, m| {
        if m.touch || m.last || since % every == 0 {
            row.clear();
            row.push(m.time);
            for c in columns {
                row.push(network.parts[c.part].slave.read(c.kind, c.reference)?);
            }
            sink.row(&row)?;
        }
        since += u64::from(!m.touch);
        let now = (whole as f64 * (m.time - start) / (stop - start)) as u64;
        if now > shown {
            follow.add(now - shown);
            shown = now;
        }
        Ok(!follow.stopped())
    });
    follow.end();
    follow.hands_out();
    // what was computed stays, whatever came between
    let (part, written) = sink.finish();
    let mut log = String::new();
    for p in &b.network.parts {
        for line in p.slave.log() {
            log += &format!("{}: {}\n", p.name, print::spelled_out(&line.to_string()));
        }
    }
    let has_rows = part.is_some();
    let left = if done.is_err() || written.is_err() {
        let kept = part.map(|p| p.leave(are_rows)).transpose().with_context(|| place::unwritten(&rows))?;
        kept.iter().flatten().for_each(|k| follow.warning(&format!("{}: {}", out.shown(), k.note())));
        if !log.is_empty() {
            let kept = output::write_keeping(out, PARTIAL_LOG, partial_log(&log).as_bytes(), is_partial_log)
                .with_context(|| place::unwritten(&out.join(PARTIAL_LOG)))?;
            kept.iter().for_each(|k| follow.warning(&format!("{}: {}", out.shown(), k.note())));
        }
        None
    } else {
        part
    };
    let order: Vec<String> = b.network.stepping_order().into_iter().map(String::from).collect();
    let notes = std::mem::take(&mut b.notes);
    for c in b.end() {
        follow.warning(&format!("{c}; the results are not touched by it"));
    }
    let so_far = || match has_rows {
        true => format!("the results so far are in {}", rows.shown()),
        false => "the results so far are lost".to_string(),
    };
    let done = match done {
        Err(_) if follow.stopped() => {
            let words = format!("interrupted; {}\n", so_far());
            return Ok(Ran { summary: None, words, interrupted: true, failure: None });
        }
        done => done.with_context(|| format!("{}: {}", path.shown(), so_far()))?,
    };
    written.with_context(|| format!("{}; {}", place::unwritten(out), so_far()))?;
    let summary = serde_json::json!({
        "system": s.title(),
        "order": order,
        "end": done.time,
        "interrupted": done.interrupted,
        "ended": done.ended,
        "macro_steps": done.steps,
        "macro_steps_taken_back": done.rejected,
        "do_step_calls": done.slave_steps,
        "touches": done.touches,
        "energy_made_up": done.created,
        "notes": notes,
    });
    let text = serde_json::to_string_pretty(&summary)? + "\n";
    let written = output::Answer::begin(out, "run").and_then(|mut a| {
        if let Some(rows) = left {
            a.take(rows, name);
        }
        if !log.is_empty() {
            a.write("log.txt", log.as_bytes())?;
        }
        a.write("summary.json", text.as_bytes())?;
        a.commit()
    });
    let committed = written.with_context(|| place::unwritten(out))?;
    place::notes(out, &committed).for_each(|n| follow.warning(&n));
    let mut words = format!(
        "{}: to {} s in {} macro-steps ({} taken back), {} calls of fmi2DoStep, order {}\n",
        print::spelled_out(&s.title()),
        done.time,
        done.steps,
        done.rejected,
        done.slave_steps,
        order.join(", ")
    );
    if !done.touches.is_empty() {
        words += &format!("touches located: {}\n", done.touches.len());
    }
    for (bond, e) in s.bond.iter().zip(&done.created) {
        words += &format!("energy created by the coupling at {}: {e:.6e} J\n", bond.force.get_ref());
    }
    if let Some(why) = done.ended.as_ref().filter(|_| !done.interrupted) {
        words += &format!("{why}\n");
    }
    words += &format!("results: {}\n", out.join(name).shown());
    if done.interrupted {
        words += &format!("interrupted at {} s\n", done.time);
    }
    Ok(Ran { summary: Some(Summed::System(summary)), words, interrupted: done.interrupted, failure: None })
}
