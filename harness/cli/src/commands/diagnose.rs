//! `touchdown diagnose`.

use super::batch::Batch;
use super::fmus::Fmus;
use super::form::Form;
use crate::campaign::{content, of_campaign};
use crate::place;
use crate::print;
use crate::progress::{catch_interrupts, deadline, hand_out, interrupted, interruption, Progress};
use anyhow::{anyhow, Context, Result};
use diagnose::run::{self as diagnosis, Failure, Outcome, Settings};
use diagnose::sensors::are_of_same_impacts;
use diagnose::verdict::Verdict;
use estimate::Budget;
use host::Isolation;
use output::{hexadecimal, Entry, Manifest};
use plant::machine::Machine;
use record::Campaign;
use report::diagnosis as answer;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::mpsc::{channel, RecvTimeoutError};
use std::sync::Arc;
use std::time::Duration;

const EXAMPLES: &str = "Examples:
  touchdown diagnose my_drops --out answer               # then open answer/my_drops/report.html
  touchdown diagnose drops_a drops_b --out answers --jobs 2
  touchdown diagnose drops_* --out answers --resume      # only those that have no answer yet, or were changed
  touchdown diagnose my_drops --out answer --bootstrap 99  # the false-alarm probability by 99 simulated campaigns";

#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Campaign folders of format recordings/1
    #[arg(required = true)]
    campaigns: Vec<PathBuf>,
    /// Folder the answers go to, one subfolder a campaign
    #[arg(long)]
    pub out: PathBuf,
    /// Folder of the element's libraries for other platforms, DIR/PLATFORM/LIBRARY as in an FMU's binaries/ (default:
    /// lib/platforms beside the command, or those that pack --all-platforms has left)
    #[arg(long, value_name = "DIR")]
    platforms: Option<PathBuf>,
    /// Threads (default: one a processor)
    #[arg(long)]
    jobs: Option<usize>,
    /// Simulate and judge N whole campaigns without the effect for the false-alarm probability, some seconds each
    /// (default: nulls made of the residual)
    #[arg(long, value_name = "N", default_value_t = 0)]
    bootstrap: usize,
    /// Seconds that a campaign may take; one that is not judged by then is answered as not judged (default: any number)
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
    /// Leave campaigns alone whose answer is there, whole, and of the same recordings, campaign.toml, options and version
    #[arg(long)]
    resume: bool,
    #[command(flatten)]
    fmus: Fmus,
    #[command(flatten)]
    form: Form,
}

/// What simulates each campaign where no rig of ours does.
type Machines = Vec<Option<Arc<dyn Machine>>>;

/// Time between looks at whether the user has ended the command.
const LOOK: Duration = Duration::from_millis(50);
/// Time that a diagnosis has to end by itself, then.
const GRACE: Duration = Duration::from_millis(500);

/// The campaign in `dir`, to be answered below `out` beside the answers of `others`, and what simulates it.
fn taken_in(
    dir: &Path,
    out: &Path,
    others: &[Campaign],
    isolation: &Isolation,
) -> Result<(Campaign, Option<Arc<dyn Machine>>)> {
    let mut c = crate::campaign::load(dir)?;
    if let Some(other) = others.iter().find(|o| o.folder == c.folder) {
        return Err(anyhow!(
            "{}: {} is called {} as well, and their answers would overwrite each other; rename one folder",
            dir.display(),
            other.dir.display(),
            c.folder
        ));
    }
    let answer = out.join(&c.folder);
    answer::check_folder(&answer).with_context(|| place::unwritten(&answer))?;
    let machine = crate::campaign::machine(&mut c, isolation)?;
    Ok((c, machine))
}

pub fn run(a: &Arguments) -> Result<ExitCode> {
    if let Some(n) = a.jobs {
        if n == 0 {
            return Err(anyhow!("--jobs 0 leaves no thread; give 1 or more"));
        }
        rayon::ThreadPoolBuilder::new().num_threads(n).build_global().ok();
    }
    // wrong seconds are told before anything is read
    deadline(a.seconds)?;
    // all input is read before any answer is written; a bad campaign does not stop the others
    let mut campaigns: Vec<Campaign> = Vec::new();
    let mut contents: Vec<Option<String>> = Vec::new();
    let mut machines: Machines = Vec::new();
    let isolation = a.fmus.isolation()?;
    let mut batch = Batch::default();
    for dir in &a.campaigns {
        // before they are read: an answer is never taken to be of files that were changed since
        let content = content(dir);
        match taken_in(dir, &a.out, &campaigns, &isolation) {
            Ok((c, machine)) => {
                campaigns.push(c);
                machines.push(machine);
                contents.push(content);
            }
            Err(e) => {
                batch.failed.push(dir.display().to_string());
                print::error(&format!("{e:#}"));
            }
        }
    }
    if campaigns.is_empty() {
        return Ok(ExitCode::from(2));
    }
    for c in &campaigns {
        for w in &c.warnings {
            print::warning(&format!("{}: {w}", c.dir.display()));
        }
    }
    catch_interrupts();
    let campaigns = Arc::new(campaigns);
    let progress = Arc::new(Progress::new("diagnose", campaigns.len() as u64));
    let mut answers: Vec<Answer> = Vec::new();
    let tool = tool(a);
    for (i, c) in campaigns.iter().enumerate() {
        let dir = a.out.join(&c.folder);
        let input = tool.as_ref().and_then(|tool| input(i, &campaigns, &contents, tool));
        if let Some(there) = a.resume.then(|| finished(c, &dir, input.as_deref())).flatten() {
            batch.up_to_date.push(c.folder.clone());
            answers.push(there);
            progress.add(1);
            continue;
        }
        match alone(&campaigns, i, machines[i].clone(), a, &progress) {
            Some(Ok(o)) => match answer::write(c, &o, &dir, input) {
                Ok(committed) => {
                    // what is to be one JSON text is printed at the end
                    progress.aside(|| {
                        place::tell(&dir, &committed);
                        if !a.form.json {
                            print::beside(&print::with_lead(&answer::summary(&o)));
                        }
                    });
                    let answered = if o.verdict.invalid.is_some() { &mut batch.unjudged } else { &mut batch.finished };
                    answered.push(c.folder.clone());
                    answers.push(Answer {
                        campaign: c.dir.clone(),
                        answer: dir,
                        verdict: Told::New(Box::new(o.verdict)),
                    });
                }
                Err(e) => {
                    batch.failed.push(c.folder.clone());
                    progress.aside(|| print::error(&format!("{}: {e}", place::unwritten(&dir))));
                }
            },
            Some(Err(Failure::Interrupted)) => {
                hand_out();
                batch.left = campaigns[i..].iter().map(|c| c.folder.clone()).collect();
                break;
            }
            Some(Err(e)) => {
                batch.failed.push(c.folder.clone());
                progress.aside(|| print::error(&of_campaign(&c.dir, &e)));
            }
            None => {
                batch.failed.push(c.folder.clone());
                let fault = "the diagnosis ended by a fault of the program, which is told above; please report it";
                progress.aside(|| print::error(&of_campaign(&c.dir, &fault)));
            }
        }
        progress.add(1);
    }
    progress.end();
    if !batch.left.is_empty() {
        print::error(&batch.unfinished(&a.out));
    }
    finish(a, &answers, &batch)?;
    Ok(batch.exit_code())
}

/// What every answer of this run depends on besides its campaign: hashes of the program and of the element's libraries that
/// it hands out, and the options. None where one of these files cannot be read.
fn tool(a: &Arguments) -> Option<String> {
    let program = Entry::of(&std::env::current_exe().ok()?, "").ok()?.sha256;
    let libraries = pack::Model::contact().libraries(a.platforms.as_deref()).unwrap_or_default();
    let library = |b: &pack::Binary| format!("{} {}", b.platform, hexadecimal(&Sha256::digest(&b.bytes)));
    let libraries: Vec<String> = libraries.iter().map(library).collect();
    Some(format!("{program} {} {} {:?}", libraries.join(" "), a.bootstrap, a.seconds))
}

/// Hash of all that the answer of campaign `i` depends on: the `tool`, its files, and those of the campaigns whose sensors it
/// is held against. None where the contents of one of them are not known.
fn input(i: usize, campaigns: &[Campaign], contents: &[Option<String>], tool: &str) -> Option<String> {
    let mut all = vec![tool.to_string(), contents[i].clone()?];
    let others = campaigns.iter().zip(contents).filter(|(o, _)| are_of_same_impacts(&campaigns[i], o));
    let mut beside =
        others.map(|(o, content)| Some(format!("{} {}", o.folder, content.as_ref()?))).collect::<Option<Vec<_>>>()?;
    beside.sort();
    all.extend(beside);
    Some(hexadecimal(&Sha256::digest(all.join("\n"))))
}

/// The answer of an earlier run in `dir`; None where it is not whole, or not of this `input`.
fn finished(c: &Campaign, dir: &Path, input: Option<&str>) -> Option<Answer> {
    let m = Manifest::read(dir).filter(|m| input.is_some() && m.input.as_deref() == input && m.is_whole(dir))?;
    let text = std::fs::read_to_string(dir.join("verdict.json")).ok()?;
    let verdict = serde_json::from_str(&text).ok().filter(|_| m.command == "diagnose")?;
    Some(Answer { campaign: c.dir.clone(), answer: dir.to_path_buf(), verdict: Told::Earlier(verdict) })
}

/// Diagnoses campaign `i` on a thread of its own and waits for it; None where that thread panics. Where the user ends the
/// command the thread is given [`GRACE`] to come to the end of its stage, which puts its temporary files away, and is left
/// alone then: what it works out is written by nobody, and it ends with the process.
fn alone(
    campaigns: &Arc<Vec<Campaign>>,
    i: usize,
    machine: Option<Arc<dyn Machine>>,
    a: &Arguments,
    progress: &Arc<Progress>,
) -> Option<Result<Outcome, Failure>> {
    let (campaigns, progress) = (campaigns.clone(), progress.clone());
    let (bootstrap, platforms) = (a.bootstrap, a.platforms.clone());
    let budget = Budget { stop: Some(interruption()), deadline: deadline(a.seconds).unwrap_or_default() };
    let (done, outcome) = channel();
    std::thread::spawn(move || {
        let c = &campaigns[i];
        let stage = |text: &str| progress.stage(&format!("{}: {text}", c.folder));
        let others = &campaigns[..];
        let platforms = platforms.as_deref();
        let settings = Settings { bootstrap, element: true, platforms, others, stage: &stage, machine, budget };
        // nobody listens any more where the user has ended the command
        drop(done.send(diagnosis::diagnose_with(c, &settings)));
    });
    let mut left = GRACE;
    loop {
        match outcome.recv_timeout(LOOK) {
            // what was finished while the user ended the command is finished
            Ok(o) => return Some(o),
            Err(RecvTimeoutError::Timeout) if interrupted() && left.is_zero() => {
                return Some(Err(Failure::Interrupted))
            }
            Err(RecvTimeoutError::Timeout) if interrupted() => left = left.saturating_sub(LOOK),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return None,
        }
    }
}

/// A campaign answered.
#[derive(Serialize)]
struct Answer {
    campaign: PathBuf,
    /// Folder of the answer.
    answer: PathBuf,
    verdict: Told,
}

/// A verdict of this run, or that of an earlier one.
#[derive(Serialize)]
#[serde(untagged)]
enum Told {
    New(Box<Verdict>),
    Earlier(serde_json::Value),
}

/// Writes the page that lists the answers, and says where it is, or what all of them are; of several campaigns also which
/// came to what.
fn finish(a: &Arguments, answers: &[Answer], batch: &Batch) -> Result<()> {
    let page = a.out.join("index.html");
    let listed = if answers.is_empty() { Ok(()) } else { answer::write_index(&a.out) };
    if let Err(e) = &listed {
        print::warning(&format!("{}: {e}", page.display()));
    }
    let words = |all: &&[Answer]| {
        let place = match &listed {
            _ if all.is_empty() => String::new(),
            Ok(()) => format!("answers: {}\n", page.display()),
            Err(_) => format!("answers, each with a report.html: {}\n", a.out.display()),
        };
        batch.summary() + &place
    };
    print::beside(&a.form.of(&answers, words)?);
    Ok(())
}
