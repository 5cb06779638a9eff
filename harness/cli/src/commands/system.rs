//! `touchdown run` on a system of FMUs, and `touchdown export-ssp`.

use super::fmus::Fmus;
use super::form::Form;
use crate::place;
use crate::print;
use crate::progress::{catch_interrupts, hand_out, interrupted, interrupted_code, Progress};
use anyhow::{Context, Result};
use host::master::{build, export_ssp, run as step, Sink, System};
use host::Isolation;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Runs a system file or an SSP archive: results.csv (or .parquet), log.txt, summary.json. Rows are in
/// results.partial.csv.part while it runs, and in results.partial.csv where it ends with an error; the answer before stays
/// then.
pub fn run(path: &Path, out: &Path, parquet: bool, isolation: Isolation, form: Form) -> Result<ExitCode> {
    let mut s = System::load(path)?;
    s.isolation = isolation;
    catch_interrupts();
    let mut b = build(&s)?;
    for n in &b.notes {
        print::warning(n);
    }
    let (name, partial) = match parquet || b.parquet {
        true => ("results.parquet", "results.partial.parquet"),
        false => ("results.csv", "results.partial.csv"),
    };
    let rows = out.join(partial);
    let mut head: Vec<String> = vec!["time [s]".into()];
    head.extend(b.columns.iter().map(|c| c.head.clone()));
    let mut sink = Sink::new(&rows, &head, parquet || b.parquet)?;
    let whole = 1000u64;
    let progress = Progress::new("run", whole);
    let (start, stop) = (b.options.start, b.options.stop);
    let (mut shown, mut since) = (0u64, 0u64);
    let mut row = Vec::with_capacity(head.len());
    let (columns, every) = (&b.columns, b.every);
    let done = step(&mut b.network, &b.options, b.start.clone(), &mut |network, m| {
        let last = m.time >= stop;
        if m.touch || last || since % every == 0 {
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
            progress.add(now - shown);
            shown = now;
        }
        Ok(!interrupted())
    });
    drop(progress);
    hand_out();
    // what was computed stays, whatever came between
    sink.finish()?;
    let mut log = String::new();
    for p in &b.network.parts {
        for line in p.slave.log() {
            log += &format!("{}: {line}\n", p.name);
        }
    }
    if done.is_err() && !log.is_empty() {
        let path = out.join("log.partial.txt");
        output::write(&path, log.as_bytes()).with_context(|| place::unwritten(&path))?;
    }
    let order: Vec<String> = b.network.stepping_order().into_iter().map(String::from).collect();
    let notes = std::mem::take(&mut b.notes);
    for c in b.end() {
        print::warning(&format!("{c}; the results are not touched by it"));
    }
    let so_far = || format!("the results so far are in {}", rows.display());
    let done = match done {
        Err(_) if interrupted() => {
            print::beside(&format!("interrupted; {}\n", so_far()));
            return Ok(interrupted_code());
        }
        done => done.with_context(|| format!("{}: {}", path.display(), so_far()))?,
    };
    let summary = serde_json::json!({
        "system": s.title(),
        "order": order,
        "end": done.time,
        "interrupted": done.interrupted,
        "macro_steps": done.steps,
        "macro_steps_taken_back": done.rejected,
        "do_step_calls": done.slave_steps,
        "touches": done.touches,
        "energy_made_up": done.created,
        "notes": notes,
    });
    let text = serde_json::to_string_pretty(&summary)? + "\n";
    let written = output::Answer::begin(out, "run").and_then(|mut a| {
        a.take(&rows, name);
        if !log.is_empty() {
            a.write("log.txt", log.as_bytes())?;
        }
        a.write("summary.json", text.as_bytes())?;
        a.commit()
    });
    place::tell(out, &written.with_context(|| place::unwritten(out))?);
    let words = |_: &serde_json::Value| {
        let mut said = format!(
            "{}: to {} s in {} macro-steps ({} taken back), {} calls of fmi2DoStep, order {}\n",
            s.title(),
            done.time,
            done.steps,
            done.rejected,
            done.slave_steps,
            order.join(", ")
        );
        if !done.touches.is_empty() {
            said += &format!("touches located: {}\n", done.touches.len());
        }
        for (bond, e) in s.bond.iter().zip(&done.created) {
            said += &format!("energy created by the coupling at {}: {e:.6e} J\n", bond.force.get_ref());
        }
        said += &format!("results: {}\n", out.join(name).display());
        if done.interrupted {
            said += &format!("interrupted at {} s\n", done.time);
        }
        said
    };
    print::beside(&form.of(&summary, words)?);
    Ok(if done.interrupted { interrupted_code() } else { ExitCode::SUCCESS })
}

const EXAMPLES: &str = "Examples:
  touchdown export-ssp harness/examples/contactor_system.toml --out contactor.ssp
  touchdown export-ssp machine.toml --out machine.ssp    # then: touchdown run machine.ssp --out machine";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct ExportArguments {
    /// System file (TOML) or SSP archive
    system: PathBuf,
    /// The archive to write
    #[arg(long)]
    pub out: PathBuf,
    #[command(flatten)]
    fmus: Fmus,
}

pub fn export(a: &ExportArguments) -> Result<ExitCode> {
    let mut s = System::load(&a.system)?;
    s.isolation = a.fmus.isolation()?;
    export_ssp(&s, &a.out)?;
    print::beside(&format!("{}\n", a.out.display()));
    Ok(ExitCode::SUCCESS)
}
