//! A share of a fleet: its campaigns diagnosed each in a process of its own, so that what ends one process loses one campaign.

use super::batch::Batch;
use super::Follow;
use crate::place;
use crate::print::{self, Shown};
use anyhow::{bail, ensure, Context, Result};
use fleet::register::{self, Member};
use fleet::shard::Shard;
use report::diagnosis as answer;
use serde::Serialize;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// What to diagnose, and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// All campaigns of the fleet, folders of format recordings/1, or folders of such folders.
    pub campaigns: Vec<PathBuf>,
    pub shard: Shard,
    /// Folder the answers go to, one subfolder a campaign; the same of every share, or one of each.
    pub out: PathBuf,
    /// Processes at once, 1 or more.
    pub processes: usize,
    /// The program and its first arguments, before `diagnose`.
    pub program: Vec<OsString>,
    /// Options of every diagnosis, and variables of its environment.
    pub with: Vec<OsString>,
    pub environment: Vec<(OsString, OsString)>,
    /// Seconds that a campaign may take; its process is killed some time after.
    pub seconds: Option<f64>,
}

/// What came of a share.
#[derive(Debug, Default, Serialize)]
pub struct Share {
    pub batch: Batch,
    /// Campaigns of the whole fleet.
    pub fleet: usize,
    /// Seconds it took, and campaigns that a process has worked on to an end in them.
    pub seconds: f64,
    pub worked: usize,
    /// Most memory that one of the processes had resident, bytes; None where the platform does not report it.
    pub memory: Option<f64>,
}

/// Time that a process has beyond its seconds to answer that they were up: a share of them, and seconds.
const BEYOND: (f64, f64) = (0.5, 5.0);
/// Time between looks at a process.
const LOOK: Duration = Duration::from_millis(20);
/// Time that a process has to end by itself where the user ends the command.
const GRACE: Duration = Duration::from_millis(500);
/// Bytes kept of what a process prints.
const KEPT: usize = 1 << 16;
/// Why a campaign is lost while nobody knows better.
const BEGUN: &str = "its process had begun and has not come to an end: what ran it was ended first, or still runs";

/// What starts the command line where it is not the program that runs: the program and its first arguments.
static STARTED_BY: OnceLock<Vec<OsString>> = OnceLock::new();

/// From here on processes are started by these words, as where Python runs the command line.
pub fn started_by(words: Vec<OsString>) {
    // whoever came first runs this process
    drop(STARTED_BY.set(words));
}

/// The program and its first arguments, by which a process of the command line is started.
///
/// # Errors
/// Where the program's own path is not known.
pub fn program() -> Result<Vec<OsString>> {
    match STARTED_BY.get() {
        Some(words) => Ok(words.clone()),
        None => Ok(vec![std::env::current_exe().context("the program's own path is not known")?.into()]),
    }
}

/// The campaigns in `given`, sorted by name: folders with a campaign.toml, and those directly below a folder that has none.
///
/// # Errors
/// Two campaigns of one name; a folder that cannot be read.
pub fn campaigns(given: &[PathBuf]) -> Result<Vec<Member>> {
    let mut folders: Vec<PathBuf> = Vec::new();
    for dir in given {
        let mut below = Vec::new();
        if dir.is_dir() && !dir.join("campaign.toml").exists() {
            for entry in std::fs::read_dir(dir).with_context(|| dir.shown())? {
                let path = entry.with_context(|| dir.shown())?.path();
                if path.join("campaign.toml").is_file() {
                    below.push(path);
                }
            }
        }
        // what is no campaign is one that cannot be read: its diagnosis says why
        folders.extend(if below.is_empty() { vec![dir.clone()] } else { below });
    }
    let mut named: BTreeMap<String, PathBuf> = BTreeMap::new();
    for folder in folders {
        let whole = folder.canonicalize().unwrap_or_else(|_| folder.clone());
        let Some(name) = whole.file_name().map(|n| n.to_string_lossy().into_owned()) else {
            bail!("{}: is no campaign; give the folder of one", folder.shown());
        };
        match named.get(&name) {
            // named twice: once as itself and once below its folder
            Some(other) if *other == whole => {}
            Some(other) => bail!(
                "{}: {} is called {name} as well, and their answers would overwrite each other; rename one folder",
                whole.shown(),
                other.shown()
            ),
            None => drop(named.insert(name, whole)),
        }
    }
    ensure!(!named.is_empty(), "no campaign is given");
    Ok(named.into_iter().map(|(campaign, folder)| Member { campaign, folder }).collect())
}

/// Diagnoses the campaigns of a share. Those whose answer is there and of the same input are not done again.
///
/// # Errors
/// Campaigns that cannot be distinguished, and a folder of answers that cannot be written.
pub fn diagnose(o: &Options, follow: &Arc<dyn Follow>) -> Result<Share> {
    let fleet = campaigns(&o.campaigns)?;
    let part: Vec<&Member> = fleet.iter().enumerate().filter(|(i, _)| o.shard.holds(*i)).map(|(_, m)| m).collect();
    register::enlist(&o.out, &fleet).with_context(|| place::unwritten(&o.out))?;
    follow.looks();
    follow.begin(&format!("shard {}", o.shard), part.len() as u64);
    let began = Instant::now();
    let next = Mutex::new(part.iter());
    let share = Mutex::new(Share { fleet: fleet.len(), ..Share::default() });
    let unregistered = AtomicBool::new(false);
    let work = || loop {
        let member = next.lock().unwrap_or_else(PoisonError::into_inner).next();
        let Some(m) = member else { break };
        let came = if follow.stopped() { Came::NotBegun } else { one(o, m, &unregistered, follow) };
        let mut s = share.lock().unwrap_or_else(PoisonError::into_inner);
        s.worked += usize::from(!matches!(came, Came::Left | Came::NotBegun | Came::UpToDate));
        let list = match came {
            Came::Finished => &mut s.batch.finished,
            Came::UpToDate => &mut s.batch.up_to_date,
            Came::Unjudged => &mut s.batch.unjudged,
            Came::Waits => &mut s.batch.waiting,
            Came::Lost => &mut s.batch.failed,
            Came::Left => &mut s.batch.left,
            Came::NotBegun => &mut s.batch.not_begun,
        };
        list.push(m.campaign.clone());
        drop(s);
        follow.add(1);
    };
    std::thread::scope(|threads| {
        // this thread watches one process; as many more as there are threads to be had
        let more = 1..o.processes.clamp(1, part.len().max(1));
        more.map_while(|_| std::thread::Builder::new().spawn_scoped(threads, work).ok()).for_each(drop);
        work();
    });
    follow.end();
    let mut share = share.into_inner().unwrap_or_else(PoisonError::into_inner);
    share.seconds = began.elapsed().as_secs_f64();
    share.memory = memory_of_children();
    share.batch.sort();
    share.batch.unlisted = unregistered.into_inner();
    Ok(share)
}

/// What came of one campaign.
enum Came {
    Finished,
    UpToDate,
    Unjudged,
    /// For other replicates.
    Waits,
    Lost,
    Left,
    NotBegun,
}

/// Diagnoses a campaign in a process of its own, and writes down why where it is lost.
fn one(o: &Options, m: &Member, unregistered: &AtomicBool, follow: &Arc<dyn Follow>) -> Came {
    let registered = |written: std::io::Result<()>| {
        if let Err(e) = written {
            unregistered.store(true, Ordering::Relaxed);
            follow.error(&print::cured(format!("{}: {e}", place::unwritten(&o.out)), &e));
        }
    };
    let lose = |why: &str| registered(register::lose(&o.out, &m.campaign, why));
    if let Err(e) = answer::check_folder(&o.out.join(&m.campaign)) {
        lose(&e.to_string());
        follow.error(&format!("{}: {e}", o.out.join(&m.campaign).shown()));
        return Came::Lost;
    }
    lose(BEGUN);
    let ended = match process(o, m, follow) {
        Ok(ended) => ended,
        Err(e) => {
            lose(&format!("{e:#}"));
            follow.error(&format!("{}: {e:#}", m.campaign));
            return Came::Lost;
        }
    };
    if ended.left {
        lose("the command that ran its process was ended by its user");
        return Came::Left;
    }
    let has = |kind: &str| ended.said.lines().any(|l| l.starts_with(kind));
    let came = match ended.status.code() {
        Some(0) if has("waiting for other replicates") => Came::Waits,
        Some(0) if has("up to date") => Came::UpToDate,
        Some(0) => Came::Finished,
        Some(3) => Came::Unjudged,
        _ => Came::Lost,
    };
    match came {
        Came::Lost => {
            let why = why(&ended, o.seconds);
            lose(&why);
            follow.error(&format!("{}: {why}", m.campaign));
        }
        Came::Waits => lose("its other replicates are not there yet"),
        _ => registered(register::find(&o.out, &m.campaign)),
    }
    came
}

/// How a process came to its end.
struct Ended {
    status: ExitStatus,
    /// Whether it was killed, its time being up; and whether it was ended with the command.
    late: bool,
    left: bool,
    /// What it printed: its answer, and what was wrong.
    said: String,
    errors: String,
}

/// Why an answer is not there, in words.
fn why(ended: &Ended, seconds: Option<f64>) -> String {
    let errors: Vec<&str> = ended.errors.lines().filter_map(|l| l.strip_prefix("error: ")).collect();
    if ended.late {
        return format!(
            "its {} s were up, it did not come to an end, and its process was killed",
            seconds.unwrap_or(0.0)
        );
    }
    match ended.status.code() {
        Some(2) if !errors.is_empty() => errors.join("; "),
        Some(code) => {
            let last = ended.errors.lines().rev().find(|l| !l.trim().is_empty()).unwrap_or("it said nothing");
            format!("its process ended with code {code}: {last}")
        }
        None => format!("its process was ended by {}", signal(ended.status)),
    }
}

#[cfg(unix)]
fn signal(status: ExitStatus) -> String {
    use std::os::unix::process::ExitStatusExt;
    let Some(n) = status.signal() else { return "an unknown signal".into() };
    match signal_hook::low_level::signal_name(n) {
        Some("SIGKILL") => "SIGKILL (of who runs it, or of the system for want of memory)".into(),
        Some(name) => name.into(),
        None => format!("signal {n}"),
    }
}

#[cfg(not(unix))]
fn signal(_: ExitStatus) -> String {
    "the system".into()
}

fn process(o: &Options, m: &Member, follow: &Arc<dyn Follow>) -> Result<Ended> {
    let (program, first) = o.program.split_first().context("the program's own path is not known")?;
    let mut command = Command::new(program);
    command.args(first).arg("diagnose").arg(&m.folder).arg("--out").arg(&o.out);
    command.args(["--alone", "--resume", "--jobs", "1"]).args(&o.with);
    if let Some(s) = o.seconds {
        command.arg("--seconds").arg(s.to_string());
    }
    command.envs(o.environment.iter().map(|(name, value)| (name, value)));
    command.env("NO_COLOR", "1").stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().with_context(|| {
        let cure = "the limit of processes may be too small; raise it, as with ulimit -u";
        format!("{} does not start; {cure}", program.to_string_lossy())
    })?;
    let (mut said, mut errors) = (Heard::of(child.stdout.take())?, Heard::of(child.stderr.take())?);
    let late = o.seconds.map(|s| Instant::now() + Duration::from_secs_f64(s * (1.0 + BEYOND.0) + BEYOND.1));
    let (mut was_late, mut left) = (false, false);
    let status = loop {
        // elsewhere reading waits: what it prints is read at its end
        if cfg!(unix) {
            said.listen();
            errors.listen();
        }
        if let Some(status) = child.try_wait()? {
            break status;
        }
        if late.is_some_and(|l| Instant::now() > l) {
            was_late = true;
            child.kill()?;
            break child.wait()?;
        }
        if follow.stopped() {
            left = true;
            break ended(&mut child)?;
        }
        std::thread::sleep(LOOK);
    };
    Ok(Ended { status, late: was_late, left: left && !status.success(), said: said.text(), errors: errors.text() })
}

/// Asks a process to end, and kills it where it does not.
fn ended(child: &mut Child) -> std::io::Result<ExitStatus> {
    #[cfg(unix)]
    {
        use rustix::process::{kill_process, Pid, Signal};
        if let Some(pid) = i32::try_from(child.id()).ok().and_then(Pid::from_raw) {
            // it may have ended since
            let _ = kill_process(pid, Signal::TERM);
        }
        let until = Instant::now() + GRACE;
        while Instant::now() < until {
            if let Some(status) = child.try_wait()? {
                return Ok(status);
            }
            std::thread::sleep(LOOK);
        }
    }
    child.kill()?;
    child.wait()
}

/// What a process has printed, the last of it. Nobody waits for its end, which what the process has started may put off.
struct Heard<R> {
    from: Option<R>,
    kept: Vec<u8>,
}

impl<R: Read + Pipe> Heard<R> {
    fn of(from: Option<R>) -> std::io::Result<Heard<R>> {
        from.as_ref().map_or(Ok(()), Pipe::never_wait)?;
        Ok(Heard { from, kept: Vec::new() })
    }

    /// Takes what is there now.
    fn listen(&mut self) {
        let mut block = [0; 4096];
        // a process that prints without an end is listened to again later
        for _ in 0..64 {
            match self.from.as_mut().map(|f| f.read(&mut block)) {
                Some(Ok(n)) if n > 0 => self.kept.extend_from_slice(&block[..n]),
                Some(Err(e)) if e.kind() == std::io::ErrorKind::Interrupted => {}
                _ => break,
            }
            if self.kept.len() > 2 * KEPT {
                self.kept.drain(..self.kept.len() - KEPT);
            }
        }
    }

    /// All of it, once the process has ended.
    fn text(mut self) -> String {
        self.listen();
        String::from_utf8_lossy(&self.kept).into_owned()
    }
}

/// A pipe that is read.
trait Pipe {
    /// From here on reading gives an error where nothing is there.
    fn never_wait(&self) -> std::io::Result<()>;
}

#[cfg(unix)]
impl<T: std::os::fd::AsFd> Pipe for T {
    fn never_wait(&self) -> std::io::Result<()> {
        use rustix::fs::{fcntl_getfl, fcntl_setfl, OFlags};
        Ok(fcntl_setfl(self, fcntl_getfl(self)? | OFlags::NONBLOCK)?)
    }
}

#[cfg(not(unix))]
impl<T> Pipe for T {
    fn never_wait(&self) -> std::io::Result<()> {
        Ok(())
    }
}

/// Most memory that a process of ours, waited for, had resident, bytes.
#[cfg(unix)]
fn memory_of_children() -> Option<f64> {
    // SAFETY: all zero is a value of rusage, and the pointer is to this frame
    let usage = unsafe {
        let mut usage: libc::rusage = std::mem::zeroed();
        (libc::getrusage(libc::RUSAGE_CHILDREN, &mut usage) == 0).then_some(usage)
    }?;
    let unit = if cfg!(target_os = "macos") { 1.0 } else { 1024.0 };
    Some(usage.ru_maxrss as f64 * unit)
}

#[cfg(not(unix))]
fn memory_of_children() -> Option<f64> {
    None
}

/// The campaigns that a file lists, a path a line; empty lines and those that begin with # are none.
///
/// # Errors
/// As the file system gives them.
pub fn listed(file: &Path) -> Result<Vec<PathBuf>> {
    let text = input::text(file, input::TEXT).with_context(|| file.shown())?;
    let lines = text.lines().map(str::trim).filter(|l| !l.is_empty() && !l.starts_with('#'));
    Ok(lines.map(PathBuf::from).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fleet_is_the_same_in_whatever_order_and_form_it_is_given() {
        let t = tempfile::tempdir().unwrap();
        for name in ["b", "a", "c"] {
            std::fs::create_dir_all(t.path().join("all").join(name)).unwrap();
            std::fs::write(t.path().join("all").join(name).join("campaign.toml"), "").unwrap();
        }
        std::fs::create_dir_all(t.path().join("all/notes")).unwrap();
        let all = campaigns(&[t.path().join("all")]).unwrap();
        assert_eq!(all.iter().map(|m| m.campaign.as_str()).collect::<Vec<_>>(), ["a", "b", "c"]);
        let each = ["c", "a", "b", "a"].map(|n| t.path().join("all").join(n));
        assert_eq!(campaigns(&each).unwrap(), all);
        std::fs::create_dir_all(t.path().join("other/a")).unwrap();
        let twice = campaigns(&[t.path().join("all"), t.path().join("other/a")]).unwrap_err().to_string();
        assert!(twice.contains("is called a as well"), "{twice}");
        assert!(campaigns(&[]).is_err());
    }

    #[test]
    fn a_list_of_campaigns_is_a_path_a_line() {
        let t = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(t.path(), "# my fleet\n/data/a\n\n  b c  \n").unwrap();
        assert_eq!(listed(t.path()).unwrap(), [PathBuf::from("/data/a"), PathBuf::from("b c")]);
    }
}
