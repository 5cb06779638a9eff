//! Which processor an FMU's process works on. Host and process take turns, so one processor is enough for both. On two of them each
//! finds the other awake, and a message costs less than a microsecond; but where other work holds the processors it waits for its
//! turn there, some tens of microseconds. On one of them handing on costs some microseconds, always. So two of them are right while
//! every answer finds the host awake. Where one does not, which way is cheaper now is measured: both are tried in turn, and the
//! cheaper one is kept for a while.

use super::memory::Shared;
use rustix::process::Pid;
use rustix::thread::{sched_getaffinity, sched_getcpu, sched_setaffinity, CpuSet};
use std::time::{Duration, Instant};

/// Messages by which a way is judged.
const TRIED: u32 = 64;
/// Messages for which the cheaper one is kept.
const KEPT: u32 = 1 << 14;

/// Where the process works.
#[derive(Clone, Copy, PartialEq)]
enum Way {
    /// On any processor that it may have.
    Any,
    /// On the host's.
    Same,
}

/// How far the comparison of the two ways is.
#[derive(Clone, Copy)]
enum Stage {
    /// A way is tried, the time of the other being known or not.
    Tries(Option<Duration>),
    Keeps,
}

/// Where an FMU's process works, and how that does.
pub(super) struct Processor {
    pid: Option<Pid>,
    /// Those that the process may have by itself; None where the system does not say.
    own: Option<CpuSet>,
    way: Way,
    stage: Stage,
    /// Messages until the stage is over, and the time of those before.
    left: u32,
    time: Duration,
    /// Whether the host was awake at every answer of the stage.
    awake: bool,
    /// The processor that the process is held on.
    held: Option<usize>,
}

impl Processor {
    /// Of the process `pid`, which works on any.
    pub(super) fn new(pid: Option<Pid>) -> Processor {
        let own = pid.and_then(|p| sched_getaffinity(Some(p)).ok());
        let stage = Stage::Tries(None);
        Processor { pid, own, way: Way::Any, stage, left: TRIED, time: Duration::ZERO, awake: true, held: None }
    }

    /// Before a message is handed on: the process goes where the host is, if that is the way. The time now, where the message is to
    /// be timed: reading the clock is a good share of a short one.
    pub(super) fn meet(&mut self) -> Option<Instant> {
        if self.way == Way::Same {
            let here = sched_getcpu();
            if self.held != Some(here) {
                let mut one = CpuSet::new();
                one.set(here);
                // where it is not allowed, the process stays where it is
                let _ = sched_setaffinity(self.pid, &one);
                self.held = Some(here);
            }
        }
        matches!(self.stage, Stage::Tries(_)).then(Instant::now)
    }

    /// After the answer to a message that began at the time that [`Processor::meet`] gave, and whether the host was
    /// awake at it.
    pub(super) fn answered(&mut self, began: Option<Instant>, awake: bool, shared: &Shared) {
        self.left -= 1;
        self.awake &= awake;
        self.time += began.map_or(Duration::ZERO, |b| b.elapsed());
        if self.left > 0 {
            return;
        }
        let whole = std::mem::take(&mut self.time);
        let awake = std::mem::replace(&mut self.awake, true);
        let other = if self.way == Way::Any { Way::Same } else { Way::Any };
        (self.left, self.stage) = match self.stage {
            Stage::Tries(Some(of_other)) => {
                if of_other < whole {
                    self.take(other, shared);
                }
                (KEPT, Stage::Keeps)
            }
            Stage::Tries(None) if awake => (KEPT, Stage::Keeps),
            // threads of its own want processors of their own
            Stage::Tries(None) if self.has_threads() => {
                self.take(Way::Any, shared);
                (KEPT, Stage::Keeps)
            }
            Stage::Tries(None) => {
                self.take(other, shared);
                (TRIED, Stage::Tries(Some(whole)))
            }
            Stage::Keeps => (TRIED, Stage::Tries(None)),
        };
    }

    fn take(&mut self, way: Way, shared: &Shared) {
        self.way = way;
        shared.set_takes_turns(way == Way::Same);
        if let (Way::Any, Some(own)) = (way, &self.own) {
            if let Some(here) = self.held.take() {
                // away from the host first: the system leaves it where it is for long
                let mut others = *own;
                others.unset(here);
                let _ = sched_setaffinity(self.pid, &others);
            }
            let _ = sched_setaffinity(self.pid, own);
        }
    }

    /// Whether the process has threads beside the one that answers, or nobody knows.
    fn has_threads(&self) -> bool {
        let (Some(pid), Some(_)) = (self.pid, &self.own) else { return true };
        let tasks = std::fs::read_dir(format!("/proc/{}/task", pid.as_raw_nonzero()));
        tasks.map_or(true, |t| t.take(2).count() > 1)
    }
}
