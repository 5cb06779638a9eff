//! `touchdown demo`: the main job on data of the repository, every step a command that can be run again by hand.

use crate::place;
use crate::print::{self, Shown};
use crate::progress::{catch_interrupts, interrupted, interrupted_code};
use crate::typed;
use anyhow::{ensure, Context, Result};
use chart::{card, lead, linked, picture, Page};
use report::trace::Made;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

const EXAMPLES: &str = "Examples:
  touchdown demo --out demo                              # then open demo/index.html
  touchdown demo --out demo --quiet                      # without progress";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Folder for everything the demo makes
    #[arg(long)]
    pub out: PathBuf,
}

macro_rules! input {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_bytes!(concat!("../../../examples/", $name)))),*]
    };
}

/// What the steps read: written beside their answers, so that a step can be changed and run again.
const INPUT: [(&str, &[u8]); 24] = input![
    "drop_test.toml",
    "contactor_opening.toml",
    "bench_drop/campaign.toml",
    "bench_drop/r01.csv",
    "bench_drop/r02.csv",
    "bench_drop/r03.csv",
    "bench_drop/r04.csv",
    "bench_drop/r05.csv",
    "bench_drop/r06.csv",
    "bench_drop/r07.csv",
    "bench_drop/r08.csv",
    "bench_drop/r09.csv",
    "bench_drop/r10.csv",
    "bench_contactor/campaign.toml",
    "bench_contactor/system.toml",
    "bench_contactor/r01.csv",
    "bench_contactor/r02.csv",
    "bench_contactor/r03.csv",
    "bench_contactor/r04.csv",
    "bench_contactor/r05.csv",
    "bench_contactor/r06.csv",
    "bench_contactor/r07.csv",
    "bench_contactor/r08.csv",
    "bench_contactor/r09.csv",
];

/// A step: what it does, the words of its command (`{}` is the demo's folder), the report it leaves.
struct Step {
    title: &'static str,
    words: &'static [&'static str],
    report: Option<&'static str>,
}

const STEPS: [Step; 7] = [
    Step { title: "Pack the element as an FMU", words: &["pack", "--out", "{}/HysteresisContact.fmu"], report: None },
    Step {
        title: "Run a drop test through the FMU",
        words: &["run", "{}/input/drop_test.toml", "--fmu", "{}/HysteresisContact.fmu", "--out", "{}/drop_test"],
        report: Some("drop_test/report.html"),
    },
    Step {
        title: "Open a magnetic contactor, its stop the FMU",
        words: &[
            "run",
            "{}/input/contactor_opening.toml",
            "--fmu",
            "{}/HysteresisContact.fmu",
            "--out",
            "{}/contactor",
        ],
        report: Some("contactor/report.html"),
    },
    Step {
        title: "Estimate the law from recordings",
        words: &["fit", "{}/input/bench_drop", "--out", "{}/fit"],
        report: Some("fit/report.html"),
    },
    Step {
        title: "Say what physics that simulation leaves out",
        words: &["diagnose", "{}/input/bench_drop", "--out", "{}/diagnosis"],
        report: Some("diagnosis/bench_drop/report.html"),
    },
    Step {
        title: "Run the same drops through the FMU that holds it",
        words: &["run", "{}/input/same_drops.toml", "--out", "{}/same_drops"],
        report: Some("same_drops/report.html"),
    },
    Step {
        title: "Say what a system of FMUs leaves out, and hand it back with that",
        words: &["diagnose", "{}/input/bench_contactor", "--out", "{}/fmus"],
        report: Some("fmus/bench_contactor/report.html"),
    },
];

/// The drops of bench_drop; law and missing physics are the FMU's start values.
const DROPS: &str = "\
# the drops of bench_drop on the FMU that the diagnosis wrote: no parameter of the contact is given here
kind = \"drop_test\"
mass = 0.32622          # kg
drop_heights = [0.005, 0.01, 0.02, 0.035, 0.12]   # m
gravity = true

[contact]
fmu = \"../diagnosis/bench_drop/HysteresisContact.fmu\"
";

/// Bytes of a report at most.
const PAGE: u64 = 1 << 28;

/// The demo's folder in a word of a command.
fn fill(word: &str, out: &Path) -> String {
    word.replace("{}", &out.display().to_string())
}

/// The page at `report`, now with a link to the demo's index.
fn below_index(out: &Path, report: &str) -> Result<String> {
    let path = out.join(report);
    let html = input::text(&path, PAGE).with_context(|| format!("{}: cannot be read", path.shown()))?;
    let up = "../".repeat(report.matches('/').count()) + "index.html";
    let html = linked(&html, &up, "The demo's steps");
    let (folder, name) = report.rsplit_once('/').unwrap_or(("", report));
    print::warnings(&place::amend(&out.join(folder), "demo", &[(name, html.as_bytes())])?);
    Ok(html)
}

/// What the demo writes: folders, each an answer, and files beside them.
const FOLDERS: [&str; 7] = ["input", "drop_test", "contactor", "fit", "diagnosis", "same_drops", "fmus"];
const FMU: &str = "HysteresisContact.fmu";
const INDEX: &str = "index.html";

/// Sees that nothing of somebody else's lies where the demo writes: no link, and no file that it has not written.
fn check(out: &Path) -> Result<()> {
    let there = |name: &str| std::fs::symlink_metadata(out.join(name)).ok();
    let in_the_way =
        |name: &str, what: &str| format!("{}: {what}; move it away, or give another --out", out.join(name).shown());
    for name in FOLDERS {
        let is_folder = there(name).is_none_or(|m| m.is_dir());
        ensure!(is_folder, in_the_way(name, "is no folder, and the demo writes one"));
    }
    for name in [FMU, INDEX].into_iter().filter(|n| there(n).is_some()) {
        let is_ours = output::Manifest::read(out).is_some_and(|m| m.has(out, name));
        ensure!(is_ours, in_the_way(name, "is not as a demo wrote it"));
    }
    Ok(())
}

/// Whether the folder holds a demo, or the beginning of one.
fn is_begun(out: &Path) -> bool {
    output::Manifest::read(&out.join("input")).is_some_and(|m| m.command == "demo")
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    ensure!(
        !a.out.exists() || is_begun(&a.out) || std::fs::read_dir(&a.out)?.next().is_none(),
        "{}: holds files that are no demo of touchdown; give another --out",
        a.out.shown()
    );
    check(&a.out)?;
    catch_interrupts();
    let made = Made::now(typed::COMMIT, &typed::line())?;
    let input: Vec<_> = INPUT.iter().copied().chain([("same_drops.toml", DROPS.as_bytes())]).collect();
    print::warnings(&place::write(&a.out.join("input"), "demo", &input)?);
    let mut finding = None;
    let mut page = Page::new("");
    for (i, step) in STEPS.iter().enumerate() {
        let words: Vec<String> = step.words.iter().map(|w| fill(w, &a.out)).collect();
        print::beside(&format!("\n{} of {}: {}\n$ touchdown {}\n", i + 1, STEPS.len(), step.title, words.join(" ")));
        let code = super::dispatch(words.iter().map(String::as_str))?;
        if interrupted() {
            return Ok(interrupted_code());
        }
        if code != ExitCode::SUCCESS {
            return Ok(code);
        }
        if i == 0 {
            // listed, so that a later demo knows it
            let path = a.out.join(FMU);
            let fmu = input::bytes(&path, input::LIBRARY).with_context(|| path.shown())?;
            print::warnings(&place::amend(&a.out, "demo", &[(FMU, &fmu)])?);
        }
        page = page.section(&format!("{}. {}", i + 1, step.title)).code(&format!("touchdown {}", words.join(" ")));
        if let Some(report) = step.report {
            let html = below_index(&a.out, report)?;
            if let Some(text) = lead(&html) {
                page = page.paragraph(&text);
            }
            page = page.picture_of(&picture(&html).unwrap_or_default()).link(report, "The whole report");
            finding = finding.or(card(&html));
        }
    }
    let page = Page::new("touchdown: the main job, step by step")
        .card_of(&finding.unwrap_or_default())
        .paragraph(
            "This is what step 5 found. Every step below is one command; its input lies in input/ beside this page.",
        )
        .then(page)
        .trace(&made.rows());
    print::warnings(&place::amend(&a.out, "demo", &[(INDEX, page.html().as_bytes())])?);
    print::beside(&format!("\npictures: {}\n", a.out.join(INDEX).shown()));
    Ok(ExitCode::SUCCESS)
}
