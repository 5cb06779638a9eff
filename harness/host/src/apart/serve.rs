//! The other side: what an FMU's process does.

use super::memory::{Patience, Shared, LONGEST, WHOLE};
use super::message::{Reply, Request};
use super::process::kill_below;
use super::ring::Ring;
use crate::batch::Call;
use crate::here::{self, Here, Making};
use crate::log::Log;
use crate::trouble::{misuse, Answer};
use fmi::fmi2::binding::Fmi2Binding;
use rustix::process::{getpid, getppid, set_child_subreaper, set_parent_process_death_signal, setrlimit, setsid};
use rustix::process::{waitid, Resource, Rlimit, Signal, WaitId, WaitIdOptions};
use std::fs::File;
use std::os::fd::AsFd;
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;
use std::sync::Arc;

/// Exit code where the host has gone, or there never was one.
const ALONE: u8 = 2;

/// Serves an FMU's calls until the host has enough, or is gone. The memory it shares with the host is its standard
/// input.
pub fn serve() -> ExitCode {
    let Ok(shared) = memory() else {
        eprintln!("error: this starts by itself, for somebody's FMU; see --in-process of `touchdown run --help`");
        return ExitCode::from(ALONE);
    };
    let host = getppid();
    // each fails only where the system forbids it; the FMU is then served with less around it
    let _ = set_parent_process_death_signal(Some(Signal::KILL));
    let _ = setsid();
    // what loses its parent becomes a child of this process, and is found at its end
    let _ = set_child_subreaper(Some(getpid()));
    let _ = setrlimit(Resource::Core, Rlimit { current: Some(0), maximum: Some(0) });
    // where memory runs out, this process goes first
    let _ = std::fs::write("/proc/self/oom_score_adj", "1000");
    let shared: &'static Shared = Box::leak(Box::new(shared));
    let mut server = Server { shared, binding: None, slave: None };
    let (mut patience, mut bytes, mut number) = (Patience::new(), Vec::new(), 0u32);
    loop {
        number = number.wrapping_add(1);
        let gone = || if getppid() == host { Ok(()) } else { Err(()) };
        if shared.request(number, &mut bytes, &mut patience, gone).is_err() {
            return ExitCode::from(ALONE);
        }
        let Ok(request) = postcard::from_bytes::<Request>(&bytes) else { return ExitCode::from(ALONE) };
        let last = matches!(request, Request::Unload);
        let reply = server.answer(request);
        if last {
            end_children();
        }
        bytes.clear();
        let Ok(encoded) = postcard::to_extend(&reply, std::mem::take(&mut bytes)) else {
            return ExitCode::from(ALONE);
        };
        bytes = encoded;
        if !shared.answer(number, &bytes) {
            let long = Reply::Refused(misuse(format!(
                "its answer has {} bytes, and {LONGEST} at most cross to the host; run it with --in-process",
                bytes.len()
            )));
            let Ok(encoded) = postcard::to_stdvec(&long) else { return ExitCode::from(ALONE) };
            shared.answer(number, &encoded);
        }
        if last {
            return ExitCode::SUCCESS;
        }
    }
}

/// Ends what the FMU has started and left.
fn end_children() {
    // no child at all is an error; it is looked for no further then
    let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
    if waitid(WaitId::All, options).is_ok() {
        kill_below(getpid());
    }
}

fn memory() -> std::io::Result<Shared> {
    let stdin = std::io::stdin();
    let shared = Shared::of(File::from(stdin.as_fd().try_clone_to_owned()?))?;
    rustix::stdio::dup2_stdin(File::open("/dev/null")?)?;
    Ok(shared)
}

struct Server {
    shared: &'static Shared,
    slave: Option<Here>,
    binding: Option<Arc<Fmi2Binding>>,
}

fn done(a: Answer) -> Reply {
    a.map_or_else(Reply::Refused, |()| Reply::Done)
}

/// Reads values into a vector as long as the references.
fn read<T: Clone + Default>(n: usize, reply: fn(Vec<T>) -> Reply, get: impl FnOnce(&mut [T]) -> Answer) -> Reply {
    let mut values = vec![T::default(); n];
    get(&mut values).map_or_else(Reply::Refused, |()| reply(values))
}

impl Server {
    fn load(&mut self, library: &std::path::Path, memory: Option<u64>) -> Reply {
        if let Some(bytes) = memory {
            let limit = Some(bytes.saturating_add(WHOLE as u64));
            if let Err(e) = setrlimit(Resource::As, Rlimit { current: limit, maximum: limit }) {
                return Reply::NotMade(format!("the limit of its memory cannot be set ({e})"));
            }
        }
        match here::load(library) {
            Ok(b) => {
                self.binding = Some(Arc::new(b));
                Reply::Done
            }
            Err(why) => Reply::NotMade(why),
        }
    }

    fn instantiate(&mut self, making: &Making) -> Reply {
        let Some(binding) = self.binding.clone() else { return Reply::NotMade("nothing is loaded".into()) };
        let shared = self.shared;
        let log = Arc::new(Log::forwarding(Box::new(move |line| Ring(shared).push(&line))));
        match Here::new(binding, making, log, Arc::new(AtomicBool::new(false))) {
            Ok(slave) => {
                self.slave = Some(slave);
                Reply::Done
            }
            Err(why) => Reply::NotMade(why),
        }
    }

    fn answer(&mut self, request: Request) -> Reply {
        match request {
            Request::Load { library, memory } => self.load(&library, memory),
            Request::Instantiate(making) => self.instantiate(&making),
            Request::Free => {
                self.slave = None;
                Reply::Done
            }
            Request::Unload => {
                self.binding = None;
                Reply::Done
            }
            request => match &mut self.slave {
                Some(slave) => match request {
                    Request::Batch { calls, never_back, read } => batch(slave, self.shared, &calls, never_back, &read),
                    request => call(slave, request),
                },
                None => Reply::Refused(misuse("there is no instance")),
            },
        }
    }
}

/// Makes the calls in order, each noted before it is made, and reads.
fn batch(s: &mut Here, shared: &Shared, calls: &[Call], never_back: bool, references: &[u32]) -> Reply {
    s.begin();
    for (at, c) in calls.iter().enumerate() {
        shared.note(at);
        let done = match c {
            Call::SetReal(r, v) => s.set_real(r, v),
            Call::SetRealInputDerivatives(r, v) => s.set_real_input_derivatives(r, &vec![1; r.len()], v),
            Call::DoStep { time, step } => s.do_step(*time, *step, never_back),
        };
        if let Err(t) = done {
            return Reply::RefusedAt(at, t);
        }
    }
    shared.note(calls.len());
    let mut values = vec![0.0; references.len()];
    if !references.is_empty() {
        if let Err(t) = s.get_real(references, &mut values) {
            return Reply::RefusedAt(calls.len(), t);
        }
    }
    Reply::Reals(values)
}

fn call(s: &mut Here, request: Request) -> Reply {
    s.begin();
    match request {
        Request::Load { .. } | Request::Instantiate(_) | Request::Free | Request::Unload | Request::Batch { .. } => {
            Reply::Done
        }
        Request::Patience(p) => done(s.set_patience(p)),
        Request::SetDebugLogging(on, categories) => done(s.set_debug_logging(on, &categories)),
        Request::SetupExperiment(tolerance, start, stop) => done(s.setup_experiment(tolerance, start, stop)),
        Request::EnterInitialization => done(s.enter_initialization()),
        Request::ExitInitialization => done(s.exit_initialization()),
        Request::CancelStep => done(s.cancel_step()),
        Request::Terminate => done(s.terminate()),
        Request::Reset => done(s.reset()),
        Request::SetReal(r, v) => done(s.set_real(&r, &v)),
        Request::GetReal(r) => read(r.len(), Reply::Reals, |v| s.get_real(&r, v)),
        Request::SetInteger(r, v) => done(s.set_integer(&r, &v)),
        Request::GetInteger(r) => read(r.len(), Reply::Integers, |v| s.get_integer(&r, v)),
        Request::SetBoolean(r, v) => done(s.set_boolean(&r, &v)),
        Request::GetBoolean(r) => read(r.len(), Reply::Integers, |v| s.get_boolean(&r, v)),
        Request::SetString(r, v) => done(s.set_string(&r, &v)),
        Request::GetString(r) => s.get_string(&r).map_or_else(Reply::Refused, Reply::Texts),
        Request::SetRealInputDerivatives(r, o, v) => done(s.set_real_input_derivatives(&r, &o, &v)),
        Request::GetRealOutputDerivatives(r, o) => {
            read(r.len(), Reply::Reals, |v| s.get_real_output_derivatives(&r, &o, v))
        }
        Request::GetDirectionalDerivative(unknowns, knowns, direction) => {
            read(unknowns.len(), Reply::Reals, |v| s.get_directional_derivative(&unknowns, &knowns, &direction, v))
        }
        Request::DoStep { time, step, never_back } => done(s.do_step(time, step, never_back)),
        Request::GetState(slot) => done(s.get_state(slot)),
        Request::SetState(slot) => done(s.set_state(slot)),
        Request::FreeState(slot) => done(s.free_state(slot)),
        Request::Serialize(slot) => s.serialize(slot).map_or_else(Reply::Refused, Reply::Bytes),
        Request::Deserialize(slot, bytes) => done(s.deserialize(slot, &bytes)),
    }
}
