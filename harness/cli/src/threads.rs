//! Threads where there are any to be had: where the system gives none, the thread that is there does the work.

use rayon::{ThreadBuilder, ThreadPool, ThreadPoolBuilder};
use std::sync::mpsc::{channel, Sender};
use std::sync::{Mutex, PoisonError};
use std::thread::{available_parallelism, Builder};

/// Threads of a pool at most: more than there are processors gain nothing, and a system that runs out of memory for them says so too
/// late.
const MOST: usize = 256;

/// Threads that wait for their work in a pool; as many of `most` as the system gives, which may be none, and [`MOST`] at most.
fn waiting(most: usize) -> Vec<Sender<ThreadBuilder>> {
    let start = |_| {
        let (to, work) = channel::<ThreadBuilder>();
        // who gets no work, the pool not being made, ends
        let started = Builder::new().spawn(move || work.recv().into_iter().for_each(ThreadBuilder::run));
        started.ok().map(|_| to)
    };
    (0..most.min(MOST)).map_while(start).collect()
}

/// Hands each thread that waits its part of a pool.
fn hand(mut waiting: Vec<Sender<ThreadBuilder>>) -> impl FnMut(ThreadBuilder) -> std::io::Result<()> {
    move |part| {
        let to = waiting.pop().ok_or(std::io::ErrorKind::WouldBlock)?;
        to.send(part).map_err(|_| std::io::ErrorKind::BrokenPipe.into())
    }
}

/// Who has made the threads.
struct Owner {
    process: u32,
    /// Whether there are none, and the one that called works alone.
    is_alone: bool,
}

static OWNER: Mutex<Option<Owner>> = Mutex::new(None);

/// Why there are no threads to work on.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum NoThreads {
    #[error(
        "the system gives no thread; raise the limit of processes, as with ulimit -u, or of memory, as with ulimit -v"
    )]
    Given,
    #[error(
        "this process was forked from one in which touchdown had worked, whose threads it does not have; start processes by \
         spawn or forkserver, or before the first call"
    )]
    Forked,
}

/// Makes the threads that all work is shared by: one a processor, or as many as `RAYON_NUM_THREADS` says; fewer where the
/// system gives no more. Where it gives none at all and `may_be_alone`, the calling thread works alone, and must be the one
/// that calls for work from then on.
///
/// # Errors
/// Where there are none.
pub fn get_ready(may_be_alone: bool) -> Result<(), NoThreads> {
    let mut owner = OWNER.lock().unwrap_or_else(PoisonError::into_inner);
    match &*owner {
        Some(o) if o.process == std::process::id() => return Ok(()),
        Some(_) => return Err(NoThreads::Forked),
        None => {}
    }
    let asked = std::env::var("RAYON_NUM_THREADS").ok().and_then(|n| n.parse().ok()).filter(|n| *n > 0);
    let most = asked.or(available_parallelism().ok().map(usize::from)).unwrap_or(1);
    let waiting = waiting(most);
    let is_alone = waiting.is_empty();
    // making it fails where there is a pool already, which then does the work
    match is_alone {
        true if !may_be_alone => return Err(NoThreads::Given),
        true => drop(ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global()),
        false => {
            let pool = ThreadPoolBuilder::new().num_threads(waiting.len());
            drop(pool.spawn_handler(hand(waiting)).build_global());
        }
    }
    *owner = Some(Owner { process: std::process::id(), is_alone });
    Ok(())
}

/// Whether the thread that called [`get_ready`] works alone.
pub fn is_alone() -> bool {
    OWNER.lock().unwrap_or_else(PoisonError::into_inner).as_ref().is_some_and(|o| o.is_alone)
}

/// A pool of `most` threads, or of fewer where the system gives no more; None where it gives none.
pub fn pool(most: usize) -> Option<ThreadPool> {
    let waiting = waiting(most);
    if waiting.is_empty() {
        return None;
    }
    let pool = ThreadPoolBuilder::new().num_threads(waiting.len());
    pool.spawn_handler(hand(waiting)).build().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    #[test]
    fn a_pool_of_threads_that_waited_works() {
        let pool = pool(3).unwrap();
        assert_eq!(pool.current_num_threads(), 3);
        assert_eq!(pool.install(|| (0..1000u64).into_par_iter().sum::<u64>()), 499_500);
    }
}
