//! One slave of an FMU in a process of its own: what it does there, a crash, an endless loop or an exit, is an error
//! here and no more.
//!
//! A call crosses as bytes in memory that both processes share. Each side waits awake for some microseconds and asleep
//! after that, so that a call costs about a microsecond where both are at it. Where other work holds the processors both go to one,
//! and take turns there.

mod memory;
mod message;
mod process;
mod processor;
mod ring;
mod serve;

pub use serve::serve;

use super::batch::Call;
use super::here::Making;
use super::isolation::Limits;
use super::log::Log;
use super::trouble::{misuse, Answer, Trouble};
use memory::{Patience, Shared, LONGEST};
use message::{Reply, Request};
use process::Process;
use processor::Processor;
use ring::Ring;
use std::borrow::Cow::Borrowed;
use std::ffi::CString;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long freeing and unloading may take at most.
const ENDING: Duration = Duration::from_secs(10);

/// A slave in a process of its own, which ends when this is dropped.
pub(super) struct Apart {
    process: Process,
    shared: Shared,
    limits: Limits,
    /// How much longer than any other call a step may take: what an asynchronous one is waited for.
    patience: Duration,
    /// Longest time of one call where less than the limit was asked for.
    sooner: Option<Duration>,
    waiting: Patience,
    processor: Processor,
    number: u32,
    bytes: Vec<u8>,
    log: Arc<Log>,
    over: bool,
}

/// Why no slave was made.
pub(super) enum NotMade {
    /// The binary does not load.
    NotLoaded(String),
    /// It makes no instance.
    Refused(String),
    /// Its process died, in this function.
    Died(&'static str, String),
}

fn garbled() -> Box<Trouble> {
    Box::new(Trouble::Died("its process answered what makes no sense: the FMU wrote beyond its memory".into()))
}

impl Apart {
    /// Starts a process, loads `library` there and makes an instance.
    ///
    /// # Errors
    /// See [`NotMade`].
    pub(super) fn start(library: &Path, making: Making, limits: &Limits, log: Arc<Log>) -> Result<Apart, NotMade> {
        let system = |e: std::io::Error| {
            let cure = match e.kind() {
                std::io::ErrorKind::WouldBlock => "raise the limit of processes, as with ulimit -u",
                _ => input::cure(&e).unwrap_or("end other programs, or run it with --in-process"),
            };
            NotMade::Refused(format!("no process of its own can be started ({e}); {cure}"))
        };
        let shared = Shared::new().map_err(system)?;
        let process = Process::start(limits, &shared).map_err(system)?;
        let patience = if making.asynchronous { making.patience } else { Duration::ZERO };
        let processor = Processor::new(process.id());
        let mut a = Apart {
            process,
            shared,
            limits: limits.clone(),
            patience,
            sooner: None,
            waiting: Patience::new(),
            processor,
            number: 0,
            bytes: Vec::new(),
            log,
            over: false,
        };
        let load = Request::Load { library: library.to_path_buf(), memory: limits.memory };
        let made = |reply, function| {
            match reply {
                Ok(Reply::Done) => Ok(()),
                Ok(Reply::NotMade(why)) => Err(why),
                Ok(_) => Err("its process answered what makes no sense".into()),
                Err(Trouble::Died(how)) => return Err(NotMade::Died(function, how)),
                Err(_) => Err("its process cannot be asked".into()),
            }
            .map_err(|why| if function == LOADING { NotMade::NotLoaded(why) } else { NotMade::Refused(why) })
        };
        let reply = a.ask(&load, limits.time).map_err(|t| *t);
        made(reply, LOADING)?;
        a.log.begin();
        let reply = a.ask(&Request::Instantiate(making), limits.time).map_err(|t| *t);
        made(reply, "fmi2Instantiate")?;
        Ok(a)
    }

    fn ask(&mut self, request: &Request, longest: Duration) -> Result<Reply, Box<Trouble>> {
        self.ask_in_calls(request, longest, 0)
    }

    /// Asks what the FMU's process answers in calls that it notes, each at most `longest`, `further` of them after the first.
    fn ask_in_calls(&mut self, request: &Request, longest: Duration, further: usize) -> Result<Reply, Box<Trouble>> {
        self.bytes.clear();
        let encoded = postcard::to_extend(request, std::mem::take(&mut self.bytes));
        self.bytes = encoded.map_err(|e| misuse(format!("what is asked cannot be written ({e})")))?;
        self.number = self.number.wrapping_add(1);
        let began = self.processor.meet();
        if !self.shared.ask(self.number, &self.bytes) {
            self.number = self.number.wrapping_sub(1);
            let n = self.bytes.len();
            return Err(misuse(format!("{n} bytes, and {LONGEST} at most cross to an FMU; run it with --in-process")));
        }
        let (process, limits, sooner, shared) = (&self.process, &self.limits, self.sooner, &self.shared);
        let mut since = None;
        // whatever the FMU writes there, no more calls than were asked for get a time of their own
        let (mut further, mut at) = (further, 0);
        let ended = || {
            let since = since.get_or_insert_with(Instant::now);
            if further > 0 && shared.noted() != at {
                (further, at, *since) = (further - 1, shared.noted(), Instant::now());
            }
            if let Some(how) = process.ended() {
                return Err(how);
            }
            if since.elapsed() >= longest {
                let how = if sooner.is_some() {
                    ", much longer than its whole runs before"
                } else {
                    "; give it more with --fmu-seconds where it needs more"
                };
                return Err(format!("no answer for {} s{how}", longest.as_secs_f64()));
            }
            match limits.stop {
                Some(stop) if stop.load(Ordering::SeqCst) => Err("it was asked to end".into()),
                _ => Ok(()),
            }
        };
        let answered = self.shared.reply(self.number, &mut self.bytes, &mut self.waiting, ended);
        self.processor.answered(began, matches!(answered, Ok(true)), &self.shared);
        let ring = Ring(&self.shared);
        if !ring.is_empty() {
            let dropped = ring.take(|l| self.log.push(l));
            self.log.count_dropped(dropped);
        }
        if let Err(mut how) = answered {
            self.over = true;
            if let Some(bytes) = self.limits.memory.filter(|_| how.contains("ended by")) {
                how += &format!("; it may take {} MB of memory, more with --fmu-memory", bytes >> 20);
            }
            return Err(Box::new(Trouble::Died(how)));
        }
        match Reply::of(&self.bytes, request.asked()) {
            Some(Reply::Refused(t)) => Err(t),
            Some(reply) => Ok(reply),
            None => Err(self.nonsense()),
        }
    }

    fn nonsense(&mut self) -> Box<Trouble> {
        self.over = true;
        garbled()
    }

    fn call(&mut self, request: &Request) -> Answer {
        self.call_within(request, self.longest())
    }

    /// Longest time of one call.
    fn longest(&self) -> Duration {
        self.sooner.unwrap_or(self.limits.time)
    }

    /// Longest time of one step.
    fn longest_step(&self) -> Duration {
        self.sooner.unwrap_or(self.limits.time + self.patience)
    }

    /// Gives every call from now on this time at most, where it is less than the limit.
    pub(super) fn hurry(&mut self, longest: Duration) -> Answer {
        self.sooner = Some(longest).filter(|l| *l < self.limits.time);
        Ok(())
    }

    fn call_within(&mut self, request: &Request, longest: Duration) -> Answer {
        match self.ask(request, longest)? {
            Reply::Done => Ok(()),
            _ => Err(self.nonsense()),
        }
    }

    fn reals(&mut self, request: &Request, values: &mut [f64]) -> Answer {
        match self.ask(request, self.longest())? {
            Reply::Reals(v) if v.len() == values.len() => {
                values.copy_from_slice(&v);
                Ok(())
            }
            _ => Err(self.nonsense()),
        }
    }

    fn integers(&mut self, request: &Request, values: &mut [i32]) -> Answer {
        match self.ask(request, self.longest())? {
            Reply::Integers(v) if v.len() == values.len() => {
                values.copy_from_slice(&v);
                Ok(())
            }
            _ => Err(self.nonsense()),
        }
    }

    /// Frees the instance, unloads the binary, and waits for the process' end. What happened instead: while what was
    /// done, and how it ended.
    pub(super) fn end(mut self) -> Result<(), (&'static str, String)> {
        if self.over {
            return Ok(());
        }
        let longest = self.limits.time.min(ENDING);
        for (request, what) in [(Request::Free, "fmi2FreeInstance"), (Request::Unload, UNLOADING)] {
            if let Err(t) = self.ask(&request, longest) {
                return Err((what, if let Trouble::Died(how) = *t { how } else { String::new() }));
            }
        }
        match self.process.wait(longest) {
            Some(how) if how.is_empty() => {
                self.process.has_ended_well();
                Ok(())
            }
            Some(how) => Err((UNLOADING, how)),
            None => Err((UNLOADING, format!("its process did not end within {} s", longest.as_secs_f64()))),
        }
    }

    pub(super) fn set_patience(&mut self, patience: Duration) -> Answer {
        self.patience = patience;
        self.call(&Request::Patience(patience))
    }

    pub(super) fn set_debug_logging(&mut self, on: bool, categories: &[CString]) -> Answer {
        self.call(&Request::SetDebugLogging(on, Borrowed(categories)))
    }

    pub(super) fn setup_experiment(&mut self, tolerance: Option<f64>, start: f64, stop: Option<f64>) -> Answer {
        self.call(&Request::SetupExperiment(tolerance, start, stop))
    }

    pub(super) fn enter_initialization(&mut self) -> Answer {
        self.call(&Request::EnterInitialization)
    }

    pub(super) fn exit_initialization(&mut self) -> Answer {
        self.call(&Request::ExitInitialization)
    }

    pub(super) fn cancel_step(&mut self) -> Answer {
        self.call(&Request::CancelStep)
    }

    pub(super) fn terminate(&mut self) -> Answer {
        self.call(&Request::Terminate)
    }

    pub(super) fn reset(&mut self) -> Answer {
        self.call(&Request::Reset)
    }

    pub(super) fn set_real(&mut self, references: &[u32], values: &[f64]) -> Answer {
        self.call(&Request::SetReal(Borrowed(references), Borrowed(values)))
    }

    pub(super) fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Answer {
        self.reals(&Request::GetReal(Borrowed(references)), values)
    }

    pub(super) fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Answer {
        self.call(&Request::SetInteger(Borrowed(references), Borrowed(values)))
    }

    pub(super) fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Answer {
        self.integers(&Request::GetInteger(Borrowed(references)), values)
    }

    pub(super) fn set_boolean(&mut self, references: &[u32], values: &[i32]) -> Answer {
        self.call(&Request::SetBoolean(Borrowed(references), Borrowed(values)))
    }

    pub(super) fn get_boolean(&mut self, references: &[u32], values: &mut [i32]) -> Answer {
        self.integers(&Request::GetBoolean(Borrowed(references)), values)
    }

    pub(super) fn set_string(&mut self, references: &[u32], values: &[CString]) -> Answer {
        self.call(&Request::SetString(Borrowed(references), Borrowed(values)))
    }

    pub(super) fn get_string(&mut self, references: &[u32]) -> Result<Vec<String>, Box<Trouble>> {
        match self.ask(&Request::GetString(Borrowed(references)), self.longest())? {
            Reply::Texts(t) if t.len() == references.len() => Ok(t),
            _ => Err(self.nonsense()),
        }
    }

    pub(super) fn set_real_input_derivatives(&mut self, r: &[u32], orders: &[i32], values: &[f64]) -> Answer {
        self.call(&Request::SetRealInputDerivatives(Borrowed(r), Borrowed(orders), Borrowed(values)))
    }

    pub(super) fn get_real_output_derivatives(&mut self, r: &[u32], orders: &[i32], values: &mut [f64]) -> Answer {
        self.reals(&Request::GetRealOutputDerivatives(Borrowed(r), Borrowed(orders)), values)
    }

    pub(super) fn get_directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        direction: &[f64],
        answer: &mut [f64],
    ) -> Answer {
        let request = Request::GetDirectionalDerivative(Borrowed(unknowns), Borrowed(knowns), Borrowed(direction));
        self.reals(&request, answer)
    }

    pub(super) fn do_step(&mut self, time: f64, step: f64, never_back: bool) -> Answer {
        self.call_within(&Request::DoStep { time, step, never_back }, self.longest_step())
    }

    /// Makes the calls in order and reads Reals after them; an error comes with the place of the call it is of, that of the
    /// reading being their number.
    pub(super) fn batch(
        &mut self,
        calls: &[Call],
        never_back: bool,
        references: &[u32],
        values: &mut [f64],
    ) -> Result<(), (usize, Box<Trouble>)> {
        self.shared.note(0);
        let read = Borrowed(references);
        let of_call = |at: usize| at.min(calls.len());
        let request = Request::Batch { calls: Borrowed(calls), never_back, read };
        match self.ask_in_calls(&request, self.longest_step(), calls.len()) {
            Ok(Reply::Reals(v)) if v.len() == values.len() => {
                values.copy_from_slice(&v);
                Ok(())
            }
            Ok(Reply::RefusedAt(at, t)) => Err((of_call(at), t)),
            Ok(_) => Err((of_call(self.shared.noted()), self.nonsense())),
            Err(t) => Err((of_call(self.shared.noted()), t)),
        }
    }

    pub(super) fn get_state(&mut self, slot: usize) -> Answer {
        self.call(&Request::GetState(slot))
    }

    pub(super) fn set_state(&mut self, slot: usize) -> Answer {
        self.call(&Request::SetState(slot))
    }

    pub(super) fn free_state(&mut self, slot: usize) -> Answer {
        self.call(&Request::FreeState(slot))
    }

    pub(super) fn serialize(&mut self, slot: usize) -> Result<Vec<u8>, Box<Trouble>> {
        match self.ask(&Request::Serialize(slot), self.longest())? {
            Reply::Bytes(b) => Ok(b),
            _ => Err(self.nonsense()),
        }
    }

    pub(super) fn deserialize(&mut self, slot: usize, bytes: &[u8]) -> Answer {
        self.call(&Request::Deserialize(slot, Borrowed(bytes)))
    }
}

const LOADING: &str = "the loading of its binary";
const UNLOADING: &str = "the unloading of its binary";
