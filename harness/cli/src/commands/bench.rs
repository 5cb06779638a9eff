//! `touchdown bench`.

use crate::bench::calls::{against_direct, Ask};
use crate::bench::fit::{base_fit, BaseFit, SHARE};
use crate::bench::table::{figure, markdown, Aim, Row};
use crate::bench::{self, diagnosis, pow, Inputs, Pair, Python, Spread, FMPY_SIDE};
use crate::print::{self, Shown};
use crate::progress::Progress;
use anyhow::{Context, Result};
use host::{Fmu, Isolation, Limits};
use plant::recipe::{write_campaign, Recipe};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

const EXAMPLES: &str = "Examples:
  touchdown bench --rounds 3                             # ours alone, on campaigns made here
  touchdown bench my_drops --python bench_venv/bin/python  # beside scipy, numba and fmpy on a campaign of your own";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// A drop-test campaign to fit and to diagnose instead of ones made here
    campaign: Option<PathBuf>,
    /// A Python with what tests/bench/requirements.txt lists, to measure against (tests/bench/run sets one up)
    #[arg(long)]
    python: Option<PathBuf>,
    /// Rounds, ours and theirs in turn
    #[arg(long, default_value_t = 15, value_parser = clap::value_parser!(u64).range(1..=1000))]
    rounds: u64,
    /// Samples of each recording of the dense campaign made here
    #[arg(long, default_value_t = 70_000, value_parser = clap::value_parser!(u64).range(7_000..=1_000_000))]
    dense: u64,
    /// CPU seconds after which the fit by Nelder-Mead is given up
    #[arg(long, default_value_t = 120.0)]
    patience: f64,
}

/// Diagnoses timed.
const DIAGNOSES: usize = 3;
/// Steps and calls a round.
const STEPS: usize = 200_000;
/// What setting, stepping and reading an FMU in a process of its own may take, us.
const APART: f64 = 3.0;

/// Folders of the campaigns.
struct Campaigns {
    /// To fit: its simulation holds all its physics.
    to_fit: PathBuf,
    /// To diagnose: with hidden friction.
    to_diagnose: PathBuf,
    /// As that, with many more samples a recording, so many, that together say no more; none beside a campaign that is
    /// given.
    dense: Option<(PathBuf, usize)>,
}

fn campaigns(given: Option<&Path>, samples: usize, folder: &Path) -> Result<Campaigns> {
    if let Some(c) = given {
        return Ok(Campaigns { to_fit: c.into(), to_diagnose: c.into(), dense: None });
    }
    let plain = Recipe::default();
    let mut rubbing = plain;
    rubbing.physics.guide_friction.coulomb = 0.8;
    let denser = samples as f64 / rubbing.samples as f64;
    let (interval, noise) = (rubbing.interval / denser, rubbing.noise.map(|sd| sd * denser.sqrt()));
    let make = |name: &str, recipe: &Recipe| {
        let dir = folder.join(name);
        write_campaign(&dir, recipe).with_context(|| format!("{}: cannot be written", dir.shown())).map(|()| dir)
    };
    Ok(Campaigns {
        to_fit: make("base", &plain)?,
        to_diagnose: make("hidden-friction", &rubbing)?,
        dense: Some((make("dense", &Recipe { samples, interval, noise, ..rubbing })?, samples)),
    })
}

/// "diagnose 10 recordings of 700 samples, 2 threads"
fn diagnosis_of(recordings: usize, samples: usize) -> String {
    format!("diagnose {recordings} recordings of {samples} samples, {} threads", diagnosis::JOBS)
}

/// Whole diagnoses of a campaign and of the dense one, in turn.
fn diagnoses(of: &Campaigns, folder: &Path, rows: &mut Vec<Row>, progress: &Progress) -> Result<()> {
    let (mut taken, mut beside, mut memory) = (Vec::new(), Vec::new(), Vec::new());
    let campaign = crate::campaign::load(&of.to_diagnose)?;
    let recordings = campaign.recordings.len();
    let samples: usize = campaign.recordings.iter().map(|r| r.time.len()).sum();
    for _ in 0..DIAGNOSES {
        progress.stage("a whole diagnosis");
        let plain = diagnosis::diagnose(&of.to_diagnose, &folder.join("answer"))?;
        if let Some((dense, _)) = &of.dense {
            progress.stage("a diagnosis of dense recordings");
            let start = Instant::now();
            drop(crate::campaign::load(dense)?);
            let reading = start.elapsed().as_secs_f64();
            let many = diagnosis::diagnose(dense, &folder.join("answer"))?;
            beside.push((many.wall - reading, plain.wall));
            memory.push(many.memory / 1e6);
        }
        taken.push(plain);
        progress.add(1);
    }
    let what = diagnosis_of(recordings, samples / recordings);
    let figures = |f: fn(&bench::Taken) -> f64| Spread::of(taken.iter().map(f));
    rows.push(Row::limit(&format!("{what}: wall time"), figures(|t| t.wall), "s", diagnosis::SECONDS));
    rows.push(Row::limit(
        &format!("{what}: CPU time of both threads, halved"),
        figures(|t| t.cpu / diagnosis::JOBS as f64),
        "s",
        diagnosis::SECONDS,
    ));
    rows.push(Row::limit(&format!("{what}: peak memory"), figures(|t| t.memory / 1e6), "MB", diagnosis::BYTES / 1e6));
    if let Some((_, samples)) = of.dense {
        let what = diagnosis_of(recordings, samples);
        let pair = Pair { rounds: beside };
        let limit = Aim::Below(diagnosis::DENSE);
        rows.push(Row::of(&format!("{what}: wall time less reading"), "the campaign above", &pair, "s", limit));
        let memory = Spread::of(memory);
        rows.push(Row::limit(&format!("{what}: peak memory"), memory, "MB", diagnosis::DENSE_BYTES / 1e6));
    }
    Ok(())
}

fn steps(fmu: &Fmu, folder: &Path, rounds: usize, rows: &mut Vec<Row>, progress: &Progress) -> Result<()> {
    let path = bench::empty_fmu(folder)?;
    let empty = Fmu::open(&path)?;
    for (law, p) in bench::LAWS {
        for (inputs, what) in [
            (Inputs::Held, "doStep + getReal, inputs held"),
            (Inputs::Contact, "setReal + doStep + getReal, in contact"),
            (Inputs::Moving, "setReal + doStep + getReal, to and fro"),
        ] {
            progress.stage(&format!("{what}, {law}"));
            let pair = bench::against_empty(fmu, &empty, p, inputs, rounds, STEPS, || ())?;
            rows.push(Row::of(
                &format!("{what}, {law}"),
                "an empty FMU, both through our host",
                &pair,
                "ns",
                Aim::Below(2.0),
            ));
            progress.add(1);
        }
    }
    progress.stage("an FMU in a process of its own");
    let apart = Fmu::open_in(&path, &Isolation::Process(Limits::new()))?;
    let pair = bench::apart_against_here(&apart, &empty, rounds, STEPS / 10)?;
    let what = "setReal + doStep + getReal, an empty FMU in a process of its own, wall time";
    rows.push(Row::of(what, "the same FMU inside our process", &pair, "ns", Aim::None));
    let us = Spread::of(pair.rounds.iter().map(|r| r.0 * 1e-3));
    rows.push(Row::limit("the three calls to a process of its own", us, "us", APART));
    progress.add(1);
    for (law, p) in bench::LAWS {
        for (ask, what) in [(Ask::Force, "force tried"), (Ask::Step, "step and force")] {
            progress.stage(&format!("{what}, {law}"));
            let pair = against_direct(fmu, p, ask, rounds, STEPS)?;
            rows.push(Row::of(
                &format!("{what} through the FMU, {law}"),
                "the law called directly",
                &pair,
                "ns",
                Aim::None,
            ));
            progress.add(1);
        }
    }
    Ok(())
}

fn powers(rounds: usize, rows: &mut Vec<Row>, progress: &Progress) {
    for (exponents, aim) in [(pow::COMMON.as_slice(), Aim::Below(1.0)), (pow::OTHERS.as_slice(), Aim::Below(2.0))] {
        for p in exponents {
            progress.stage(&format!("x^{p}"));
            for (chained, how) in [(true, "one after another"), (false, "independent")] {
                let pair = pow::against_platform(*p, chained, rounds);
                rows.push(Row::of(&format!("x^{p}, calls {how}"), "the platform's pow", &pair, "ns", aim));
            }
            progress.add(1);
        }
    }
}

fn fits(f: &BaseFit, rows: &mut Vec<Row>) {
    let what = format!("base fit, {} parameters, {} samples", f.parameters, f.size.1);
    let mut row = |other: &str, t: &bench::fit::Theirs, times: f64| {
        let ours = Spread { min: f.seconds.min * 1e3, median: f.seconds.median * 1e3, max: f.seconds.max * 1e3 };
        rows.push(Row::one(&what, other, ours, (t.seconds * 1e3, t.arrived), "ms", times));
    };
    row("scipy: solve_ivp + Nelder-Mead", &f.simplex, 500.0);
    row("scipy: least_squares over numba", &f.plain, 5.0);
    row("scipy: least_squares over numba, its Jacobian's blocks given", &f.structured, 5.0);
}

/// Where the base fits ended, as a table.
fn found(f: &BaseFit) -> String {
    let mut s = format!(
        "\nWhere the base fits ended (k N/m^p, mu_d N s/m^(p+1); chi^2 at the start {:.0}):\n\n\
         | | chi^2 | k | p | mu_d |\n|---|---|---|---|---|\n",
        f.start
    );
    for (name, x) in [
        ("touchdown", f.found),
        ("solve_ivp + Nelder-Mead", f.simplex.found),
        ("least_squares over numba", f.plain.found),
        ("least_squares, blocks given", f.structured.found),
    ] {
        s += &format!("| {name} | {:.1} | {:.5e} | {:.6} | {:.5e} |\n", x.chi2, x.k, x.p, x.mu_d);
    }
    s + &format!(
        "\nNelder-Mead's clock stops when chi^2 is within {} % of ours, the others' when they have converged.\n",
        SHARE * 100.0
    )
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    let rounds = a.rounds as usize;
    let folder = output::Scratch::new("bench").context("no temporary folder; see TMPDIR")?;
    let campaigns = campaigns(a.campaign.as_deref(), a.dense as usize, folder.path())?;
    let campaign = crate::campaign::load(&campaigns.to_fit)?;
    let ours = bench::our_fmu(folder.path())?;
    let fmu = Fmu::open(&ours)?;
    let parts = DIAGNOSES + 1 + 5 * bench::LAWS.len() + pow::COMMON.len() + pow::OTHERS.len();
    let progress = Progress::new("bench", (parts + if a.python.is_some() { 3 } else { 0 }) as u64);
    let mut rows = Vec::new();
    let mut words = Vec::new();
    diagnoses(&campaigns, folder.path(), &mut rows, &progress)?;
    let mut fitted = None;
    if let Some(python) = &a.python {
        let f = base_fit(&campaign, python, folder.path(), rounds, a.patience, &|s| progress.stage(s))?;
        progress.add(1);
        fits(&f, &mut rows);
        let mut side = Python::start(python, FMPY_SIDE, &[&ours, &bench::empty_fmu(folder.path())?])?;
        progress.stage("stepping loops");
        let (looped, simulated) = bench::against_fmpy(&fmu, &mut side, rounds, || ())?;
        progress.add(1);
        let loops = "stepping loop: set, step, read";
        rows.push(Row::of(loops, "fmpy's slave in a Python loop", &looped, "ns", Aim::Times(30.0)));
        rows.push(Row::of(loops, "fmpy.simulate_fmu", &simulated, "ns", Aim::Times(30.0)));
        let beside = bench::against_empty_in_fmpy(&mut side, rounds)?;
        let what = "doStep + getReal through fmpy, inputs held, p = 1.5";
        rows.push(Row::of(what, "an empty FMU through fmpy", &beside, "ns", Aim::Below(2.0)));
        progress.stage("a drop test");
        let dropped = bench::drop_test(&ours, python, &mut side, folder.path(), rounds)?;
        progress.add(1);
        let what = format!("drop test through the FMU, {} impacts", bench::DropTest::IMPACTS);
        let inside = format!("{what}: loaded and stepped");
        rows.push(Row::of(&inside, "fmpy and scipy's DOP853, imports done", &dropped.inside, "ms", Aim::Times(50.0)));
        let whole = format!("{what}: `run`, the whole process");
        rows.push(Row::of(
            &whole,
            "a Python process, fmpy and scipy's DOP853",
            &dropped.process,
            "ms",
            Aim::Times(50.0),
        ));
        let apart = |(name, x, y): &(&str, f64, f64)| format!("{name} {}", figure(((x - y) / y).abs() * 1e9));
        words.push(format!(
            "The drop test's last impact, both sides apart in parts of 1e9: {}.",
            dropped.figures.iter().map(apart).collect::<Vec<_>>().join(", ")
        ));
        words.push(format!("Beside: {}; {}.", f.versions, side.versions));
        fitted = Some(f);
    }
    steps(&fmu, folder.path(), rounds, &mut rows, &progress)?;
    powers(rounds, &mut rows, &progress);
    drop(progress);
    let mut said = markdown(&rows);
    match &fitted {
        Some(f) => said += &found(f),
        None => words
            .push("With --python PYTHON it also measures against scipy, numba and fmpy: see tests/bench/run.".into()),
    }
    said +=
        &format!("\n{rounds} rounds of each, ours and theirs in turn; medians; all but the wall time is CPU time.\n");
    said.extend(words.iter().map(|w| format!("{w}\n")));
    print::answer(&said)?;
    Ok(ExitCode::SUCCESS)
}
