//! `touchdown run` on a system of FMUs, and `touchdown export-ssp`.

use super::fmus::Fmus;
use super::form::Form;
use crate::print;
use crate::progress::{catch_interrupts, interrupted, Progress, INTERRUPTED_CODE};
use anyhow::{Context, Result};
use host::master::{build, export_ssp, run as step, Sink, System};
use host::Isolation;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Runs a system file or an SSP archive: results.csv (or .parquet) while it runs, log.txt, summary.json.
pub fn run(path: &Path, out: &Path, parquet: bool, isolation: Isolation, form: Form) -> Result<ExitCode> {
    let mut s = System::load(path)?;
    s.isolation = isolation;
    catch_interrupts();
    let mut b = build(&s)?;
    for n in &b.notes {
        print::warning(n);
    }
    let name = if parquet || b.parquet { "results.parquet" } else { "results.csv" };
    let mut head: Vec<String> = vec!["time [s]".into()];
    head.extend(b.columns.iter().map(|c| c.head.clone()));
    let mut sink = Sink::new(&out.join(name), &head, parquet || b.parquet)?;
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
    // what was computed stays, whatever came between
    sink.finish()?;
    let mut log = String::new();
    for p in &b.network.parts {
        for line in p.slave.log() {
            log += &format!("{}: {line}\n", p.name);
        }
    }
    if !log.is_empty() {
        let path = out.join("log.txt");
        output::write(&path, log.as_bytes()).with_context(|| format!("{}: cannot be written", path.display()))?;
    }
    let order: Vec<String> = b.network.stepping_order().into_iter().map(String::from).collect();
    let notes = std::mem::take(&mut b.notes);
    for c in b.end() {
        print::warning(&format!("{c}; the results are not touched by it"));
    }
    let done = match done {
        Err(_) if interrupted() => {
            print::beside(&format!("interrupted; the results so far are in {}\n", out.join(name).display()));
            return Ok(ExitCode::from(INTERRUPTED_CODE));
        }
        done => done,
    };
    let done =
        done.with_context(|| format!("{}: the results so far are in {}", path.display(), out.join(name).display()))?;
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
    let file = out.join("summary.json");
    let text = serde_json::to_string_pretty(&summary)? + "\n";
    output::write(&file, text.as_bytes()).with_context(|| format!("{}: cannot be written", file.display()))?;
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
    Ok(if done.interrupted { ExitCode::from(INTERRUPTED_CODE) } else { ExitCode::SUCCESS })
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
