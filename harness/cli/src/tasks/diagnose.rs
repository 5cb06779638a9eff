//! Campaigns diagnosed one after the other, each into a folder of its own.

use super::batch::Batch;
use super::Follow;
use crate::campaign::{content, inputs, of_campaign};
use crate::place;
use crate::print::{self, Shown};
use crate::progress::deadline;
use crate::typed::COMMIT;
use anyhow::{anyhow, ensure, Context, Result};
use diagnose::bootstrap::Null;
use diagnose::run::{self as diagnosis, Failure, Outcome, Replicates, Settings};
use diagnose::sensors::are_of_same_impacts;
use diagnose::verdict::{Input, Verdict};
use estimate::Budget;
use fleet::{register, shard::Shard};
use host::Isolation;
use output::{hexadecimal, Entry, Folder, Manifest};
use plant::machine::Machine;
use rayon::ThreadPool;
use record::Campaign;
use report::diagnosis::{self as answer, Foot};
use report::trace::{of_campaign as of_campaign_read, Made};
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{channel, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// What to diagnose, and how.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Campaign folders of format recordings/1.
    pub campaigns: Vec<PathBuf>,
    /// Folder the answers go to, one subfolder a campaign.
    pub out: PathBuf,
    /// Folder of the element's libraries for other platforms; None: where [`pack::Model::libraries`] looks.
    pub platforms: Option<PathBuf>,
    /// Threads, 1 or more; None: one a processor.
    pub jobs: Option<usize>,
    /// Whole campaigns simulated without the effect for the false-alarm probability; 0: nulls made of the residual.
    pub bootstrap: usize,
    /// The share of these that is judged here; None: all. The process that finds all shares there writes the answer.
    pub replicates: Option<Shard>,
    /// Whether each campaign is diagnosed as if it were the only one: no sensors are held against those of another, and no page
    /// lists the answers.
    pub alone: bool,
    /// Seconds that a campaign may take, above 0; None: any number.
    pub seconds: Option<f64>,
    /// Whether to leave campaigns alone whose answer is there, whole, and of the same input.
    pub resume: bool,
    /// Where somebody else's FMUs run.
    pub isolation: Isolation,
    /// The command as typed, for the pages to say; empty where there was none.
    pub command: String,
}

/// What came of the campaigns.
#[derive(Default)]
pub struct Answers {
    /// Whether none of them could be read.
    pub unread: bool,
    /// One of every campaign that has an answer, in the order given.
    pub answers: Vec<Answer>,
    pub batch: Batch,
    /// The page that lists the answers; or why it could not be written. None where there is no answer.
    pub page: Option<Result<PathBuf>>,
}

/// A campaign answered.
#[derive(Serialize)]
pub struct Answer {
    pub campaign: PathBuf,
    /// Folder of the answer.
    pub answer: PathBuf,
    pub verdict: Answered,
}

/// A verdict of this run, or that of an earlier one.
#[derive(Serialize)]
#[serde(untagged)]
pub enum Answered {
    New(Box<Verdict>),
    Earlier(serde_json::Value),
}

/// What simulates each campaign where no rig of ours does.
type Machines = Vec<Option<Arc<dyn Machine>>>;

/// Time between looks at whether the user has ended the command.
const LOOK: Duration = Duration::from_millis(50);
/// Bytes of a file of an answer that is read at most.
const ANSWER: u64 = 1 << 28;
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
            dir.shown(),
            other.dir.shown(),
            c.folder
        ));
    }
    if [Manifest::NAME, fleet::table::FILE, fleet::SUMMARY, report::fleet::INDEX].contains(&c.folder.as_str()) {
        return Err(anyhow!(
            "{}: files of all answers are called {} as well; rename the folder",
            dir.shown(),
            c.folder
        ));
    }
    let answer = out.join(&c.folder);
    answer::check_folder(&answer).with_context(|| place::unwritten(&answer))?;
    let machine = crate::campaign::machine(&mut c, isolation)?;
    Ok((c, machine))
}

/// Diagnoses campaigns, and writes the answer of each as it is there. A bad campaign does not stop the others: it is reported
/// to `follow`, and counted as failed.
///
/// # Errors
/// Options that cannot be followed.
pub fn diagnose(o: &Options, follow: &Arc<dyn Follow>) -> Result<Answers> {
    let pool = threads(o.jobs)?;
    // a date that is none is reported before anything is read, too
    let made = Made::now(COMMIT, &o.command)?;
    // wrong seconds are reported before anything is read
    deadline(o.seconds)?;
    // all input is read before any answer is written
    let mut campaigns: Vec<Campaign> = Vec::new();
    let mut read: Vec<Option<Vec<Input>>> = Vec::new();
    let mut machines: Machines = Vec::new();
    let mut batch = Batch::default();
    for dir in &o.campaigns {
        // before they are read: an answer is never taken to be of files that were changed since
        let files = inputs(dir);
        match within(pool.as_deref(), || taken_in(dir, &o.out, &campaigns, &o.isolation)) {
            Ok((c, machine)) => {
                campaigns.push(c);
                machines.push(machine);
                read.push(files);
            }
            Err(e) => {
                batch.failed.push(dir.shown());
                follow.error(&format!("{e:#}"));
            }
        }
    }
    if campaigns.is_empty() {
        ensure!(!batch.failed.is_empty(), "no campaign is given; name folders, or list them");
        return Ok(Answers { unread: true, batch, ..Answers::default() });
    }
    for c in &campaigns {
        for w in &c.warnings {
            follow.warning(&format!("{}: {w}", c.dir.shown()));
        }
    }
    if !o.alone {
        // before anything is computed
        report::fleet::check(&o.out).with_context(|| place::unwritten(&o.out.join(report::fleet::INDEX)))?;
    }
    follow.looks();
    let campaigns = Arc::new(campaigns);
    follow.begin("diagnose", campaigns.len() as u64);
    let mut answers: Vec<Answer> = Vec::new();
    let contents: Vec<Option<String>> = read.iter().map(|f| f.as_deref().map(content)).collect();
    let writes_page = !o.alone && has_others(&campaigns, o);
    // of answers that are there on their own `merge` writes the page
    let foot = Foot { made: &made, is_listed: o.alone || writes_page };
    let tool = tool(o);
    for (i, c) in campaigns.iter().enumerate() {
        let dir = o.out.join(&c.folder);
        let beside = if o.alone { &campaigns[i..=i] } else { &campaigns[..] };
        let of_beside = if o.alone { &contents[i..=i] } else { &contents[..] };
        let input = tool.as_ref().and_then(|tool| input(c, contents[i].as_ref(), beside, of_beside, tool));
        if let Some(there) = o.resume.then(|| finished(c, &dir, input.as_deref()?, o.seconds)).flatten() {
            batch.up_to_date.push(c.folder.clone());
            answers.push(there);
            follow.add(1);
            continue;
        }
        match alone(&campaigns, i, machines[i].clone(), o, pool.clone(), input.clone(), follow) {
            Some(Ok(mut outcome)) => {
                outcome.verdict.trace = Some(of_campaign_read(c, read[i].as_deref().unwrap_or_default()));
                let input = input.map(|i| of_time(&outcome, i, o.seconds));
                match answer::write(c, &outcome, &dir, input, &foot) {
                    Ok(committed) => {
                        place::notes(&dir, &committed).for_each(|n| follow.warning(&n));
                        follow.answer(&answer::summary(&outcome));
                        let judged = outcome.verdict.invalid.is_none();
                        let answered = if judged { &mut batch.finished } else { &mut batch.unjudged };
                        answered.push(c.folder.clone());
                        answers.push(Answer {
                            campaign: c.dir.clone(),
                            answer: dir,
                            verdict: Answered::New(Box::new(outcome.verdict)),
                        });
                    }
                    Err(e) => {
                        batch.failed.push(c.folder.clone());
                        follow.error(&print::cured(format!("{}: {e}", place::unwritten(&dir)), &e));
                    }
                }
            }
            Some(Err(Failure::Interrupted)) => {
                follow.hands_out();
                batch.left.push(c.folder.clone());
                batch.not_begun = campaigns[i + 1..].iter().map(|c| c.folder.clone()).collect();
                break;
            }
            Some(Err(Failure::Waits { .. })) => batch.waiting.push(c.folder.clone()),
            Some(Err(e)) => {
                batch.failed.push(c.folder.clone());
                follow.error(&of_campaign(&c.dir, &e));
            }
            None => {
                batch.failed.push(c.folder.clone());
                let fault = "the diagnosis ended by a fault of the program, which is printed above; please report it";
                follow.error(&of_campaign(&c.dir, &fault));
            }
        }
        follow.add(1);
    }
    follow.end();
    let page = (!answers.is_empty() && writes_page).then(|| {
        let written = answer::write_index(&o.out, &made)?;
        place::notes(&o.out, &written).for_each(|n| follow.warning(&n));
        Ok(o.out.join("index.html"))
    });
    batch.unlisted = matches!(page, Some(Err(_)));
    Ok(Answers { unread: false, answers, batch, page })
}

/// Whether there are answers other than that of a single campaign, or a page that lists them.
fn has_others(campaigns: &[Campaign], o: &Options) -> bool {
    let others = || answer::answers(&o.out).into_iter().any(|a| campaigns.iter().all(|c| c.folder != a));
    campaigns.len() > 1 || o.out.join(report::fleet::INDEX).exists() || others()
}

/// So many threads; None where none are given: those of the process.
fn threads(jobs: Option<usize>) -> Result<Option<Arc<ThreadPool>>> {
    let Some(n) = jobs else { return Ok(None) };
    if n == 0 {
        return Err(anyhow!("--jobs 0 leaves no thread; give 1 or more"));
    }
    // as many as there are; where there are none, those of the process
    if crate::threads::is_alone() {
        return Ok(None);
    }
    Ok(crate::threads::pool(n).map(Arc::new))
}

/// What `work` comes to on the threads given, or on those of the process.
fn within<T: Send>(pool: Option<&ThreadPool>, work: impl FnOnce() -> T + Send) -> T {
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

/// What every answer of this run depends on besides its campaign: hashes of the program and of the libraries that it hands
/// out, and the options. None where one of these files cannot be read.
fn tool(o: &Options) -> Option<String> {
    let program = Entry::of(&pack::program().ok()?, "").ok()?.sha256;
    let platforms = o.platforms.as_deref();
    let libraries = [pack::Model::contact().libraries(platforms), diagnose::body::libraries(platforms)];
    let libraries = libraries.into_iter().flat_map(Result::unwrap_or_default);
    let library = |b: &pack::Binary| format!("{} {}", b.platform, hexadecimal(&Sha256::digest(&b.bytes)));
    let libraries: Vec<String> = libraries.map(|b| library(&b)).collect();
    Some(format!("{program} {} {}", libraries.join(" "), o.bootstrap))
}

/// The hash of an answer's input with the time that it had: an answer that is judged within any time is the same in any other, and
/// one that is not may be judged in more.
fn timed(input: &str, seconds: Option<f64>) -> String {
    seconds.map_or(input.into(), |s| hexadecimal(&Sha256::digest(format!("{input} {s:?}"))))
}

/// Hash of all that the answer of campaign `c` depends on: the `tool`, its files, and those of the campaigns `beside` it whose
/// sensors it is held against. None where the contents of one of them are not known.
fn input(
    c: &Campaign,
    content: Option<&String>,
    beside: &[Campaign],
    contents: &[Option<String>],
    tool: &str,
) -> Option<String> {
    let mut all = vec![tool.to_string(), content?.clone()];
    let others = beside.iter().zip(contents).filter(|(o, _)| are_of_same_impacts(c, o));
    let mut beside =
        others.map(|(o, content)| Some(format!("{} {}", o.folder, content.as_ref()?))).collect::<Option<Vec<_>>>()?;
    beside.sort();
    all.extend(beside);
    Some(hexadecimal(&Sha256::digest(all.join("\n"))))
}

/// The hash that an answer carries: with its time where that was up.
fn of_time(o: &Outcome, input: String, seconds: Option<f64>) -> String {
    match o.verdict.invalid.is_some() {
        true => timed(&input, seconds),
        false => input,
    }
}

/// The answer of an earlier run in `dir`; None where it is not whole, or not of this `input`, in these `seconds` where it is not
/// judged.
fn finished(c: &Campaign, dir: &Path, input: &str, seconds: Option<f64>) -> Option<Answer> {
    let m = Manifest::read(dir).filter(|m| m.is_whole(dir))?;
    let had = m.input.as_deref()?;
    if had != input && had != timed(input, seconds) {
        return None;
    }
    // what the manifest does not list may be anybody's
    m.files.get("verdict.json")?;
    let text = input::text(&dir.join("verdict.json"), ANSWER).ok()?;
    let verdict = serde_json::from_str(&text).ok().filter(|_| m.command == "diagnose")?;
    Some(Answer { campaign: c.dir.clone(), answer: dir.to_path_buf(), verdict: Answered::Earlier(verdict) })
}

/// Nulls of a campaign that several processes judge, by files that each leaves for the others.
struct Nulls {
    of: Shard,
    out: PathBuf,
    /// Below it.
    folder: PathBuf,
}

/// The folder of a campaign's nulls below the answers; of each input another.
fn nulls_of(campaign: &str, input: Option<String>) -> PathBuf {
    let of_input = input.map_or("unknown".into(), |i| i[..i.len().min(16)].to_string());
    Path::new(register::FOLDER).join("replicates").join(campaign).join(of_input)
}

impl Nulls {
    fn file(&self, of: Shard) -> PathBuf {
        self.folder.join(format!("{}-of-{}.json", of.index, of.of))
    }

    /// Those of `of` that are there; none where they are not, or the file is none of ours.
    fn read(&self, of: Shard) -> Vec<Null> {
        let bytes = Folder::open(&self.out).and_then(|f| f.bytes(self.file(of), ANSWER)).unwrap_or_default();
        serde_json::from_slice(&bytes).unwrap_or_default()
    }

    /// Those judged here before.
    fn own(&self) -> Vec<Null> {
        self.read(self.of)
    }

    /// Leaves those judged here, and takes what all have left: so the last to come finds them all.
    fn exchange(&self, of_here: &[Null]) -> std::io::Result<Vec<Null>> {
        output::write_below(&self.out, self.file(self.of), (serde_json::to_string(of_here)? + "\n").as_bytes())?;
        Ok((1..=self.of.of).flat_map(|index| self.read(Shard { index, ..self.of })).collect())
    }
}

/// Diagnoses campaign `i` on a thread of its own and waits for it; None where that thread panics. Where the user ends the
/// command the thread is given [`GRACE`] to come to the end of its stage, which puts its temporary files away, and is left
/// alone then: what it works out is written by nobody, and it ends with the process.
fn alone(
    campaigns: &Arc<Vec<Campaign>>,
    i: usize,
    machine: Option<Arc<dyn Machine>>,
    o: &Options,
    pool: Option<Arc<ThreadPool>>,
    input: Option<String>,
    follow: &Arc<dyn Follow>,
) -> Option<Result<Outcome, Failure>> {
    let (campaigns, following) = (campaigns.clone(), follow.clone());
    let (bootstrap, platforms, is_alone) = (o.bootstrap, o.platforms.clone(), o.alone);
    let nulls = o.replicates.map(|of| Nulls { of, out: o.out.clone(), folder: nulls_of(&campaigns[i].folder, input) });
    let budget = Budget { stop: Some(follow.stop()), deadline: deadline(o.seconds).unwrap_or_default() };
    let (done, outcome) = channel();
    let work = move || {
        let c = &campaigns[i];
        let stage = |text: &str| following.stage(&format!("{}: {text}", c.folder));
        let others = if is_alone { &[] } else { &campaigns[..] };
        let platforms = platforms.as_deref();
        let known = nulls.as_ref().map_or(Vec::new(), Nulls::own);
        let exchange = |of_here: &[Null]| match &nulls {
            Some(n) => n.exchange(of_here).map_err(|e| format!("{}: {e}", place::unwritten(&n.out.join(&n.folder)))),
            None => Ok(of_here.to_vec()),
        };
        let holds = |i: usize| nulls.as_ref().is_none_or(|n| n.of.holds(i));
        let replicates = nulls.as_ref().map(|_| Replicates { holds: &holds, known: &known, exchange: &exchange });
        let settings =
            Settings { bootstrap, replicates, element: true, platforms, others, stage: &stage, machine, budget };
        // nobody listens any more where the user has ended the command
        drop(done.send(within(pool.as_deref(), || diagnosis::diagnose_with(c, &settings))));
    };
    let work = Arc::new(Mutex::new(Some(work)));
    let take = |work: &Mutex<Option<_>>| work.lock().unwrap_or_else(PoisonError::into_inner).take();
    let taken = work.clone();
    let start = || std::thread::Builder::new().spawn(move || take(&taken).map(|work| work())).is_ok();
    if crate::threads::is_alone() || !start() {
        // no thread is to be had: then on this one
        drop(std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| take(&work).map(|work| work()))));
    }
    // with it what the thread answers by: where it panics nobody waits for it
    drop(work);
    let mut left = GRACE;
    loop {
        match outcome.recv_timeout(LOOK) {
            // what was finished while the user ended the command is finished
            Ok(o) => return Some(o),
            Err(RecvTimeoutError::Timeout) if follow.stopped() && left.is_zero() => {
                return Some(Err(Failure::Interrupted))
            }
            Err(RecvTimeoutError::Timeout) if follow.stopped() => left = left.saturating_sub(LOOK),
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return None,
        }
    }
}
