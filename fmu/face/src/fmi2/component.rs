//! What an fmi2Component points to, and how a call on it is run: refused where it is none, panics kept in, refusals logged.

use super::{Status, DISCARD, ERROR, FATAL, OK};
use crate::life::{Outcome, Refusal};
use crate::log::{Log, Logger};
use crate::memory::{boxed, copied};
use crate::model::Model;
use crate::text;
use std::any::Any;
use std::ffi::CStr;
use std::os::raw::{c_int, c_void};
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::atomic::{AtomicU32, Ordering};

/// fmi2CoSimulation of fmi2Type.
const CO_SIMULATION: c_int = 1;
/// Places in [`Model::LOG_CATEGORIES`].
const DISCARDS: usize = 1;
pub(super) const ERRORS: usize = 2;
pub(super) const EVENTS: usize = 3;

/// Panics of this library's calls. An instance made before the last one is out of use.
static PANICS: AtomicU32 = AtomicU32::new(0);

/// What an fmi2Component points to.
#[repr(C)]
pub(super) struct Component<M> {
    /// First, so that it can be read of whatever a host passes.
    pub(super) magic: u64,
    /// [`PANICS`] when the instance was made.
    panics: u32,
    /// Which of [`Model::LOG_CATEGORIES`] are logged; discards and errors always are.
    pub(super) logged: [bool; 4],
    pub(super) model: M,
    name: Vec<u8>,
    logger: Logger,
    environment: *mut c_void,
}

/// First bytes of a model's components and of its kept states: another model's, and another version's, are foreign.
pub(super) struct Magic<M>(std::marker::PhantomData<M>);

impl<M: Model> Magic<M> {
    pub(super) const COMPONENT: u64 = 0x746f_7563_6864_776e ^ M::LAYOUT.mark();
    pub(super) const STATE: u64 = 0x6b65_7074_5f73_7461 ^ M::LAYOUT.mark();
}

/// A new component, or why there is none.
pub(super) fn made<M: Model>(
    log: &Log,
    kind: c_int,
    given: &CStr,
    logging_on: bool,
) -> Result<Box<Component<M>>, String> {
    let wanted = M::guid();
    let no_memory = || text!("no memory for an instance");
    match log.name.len() {
        0 => return Err(no_memory()),
        1 => return Err(text!("instanceName is empty: give one")),
        _ => {}
    }
    if kind != CO_SIMULATION {
        return Err(text!("fmuType is fmi2ModelExchange: only fmi2CoSimulation is here"));
    }
    if given.to_bytes() != wanted {
        let wanted = std::str::from_utf8(&wanted).unwrap_or("another");
        return Err(text!("fmuGUID is {:?}: give {}, as modelDescription.xml of this FMU says", given, wanted));
    }
    let name = copied(&log.name).ok_or_else(no_memory)?;
    boxed(Component {
        magic: Magic::<M>::COMPONENT,
        panics: PANICS.load(Ordering::Relaxed),
        logged: [logging_on; 4],
        model: M::default(),
        name,
        logger: log.logger,
        environment: log.environment,
    })
    .ok_or_else(no_memory)
}

/// The component that a host passes, or the status it gets.
///
/// # Safety
/// As [the module](super) says.
#[inline]
pub(super) unsafe fn component<M: Model>(c: *mut c_void) -> Result<*mut Component<M>, Status> {
    if c.is_null() || c.cast::<u64>().read_unaligned() != Magic::<M>::COMPONENT {
        return Err(ERROR);
    }
    let p = c.cast::<Component<M>>();
    if (*p).panics != PANICS.load(Ordering::Relaxed) {
        return Err(FATAL);
    }
    Ok(p)
}

/// Who logs for a component.
///
/// # Safety
/// `p` is a component, and nothing of it is mutably borrowed.
pub(super) unsafe fn log_of<M: Model>(p: *mut Component<M>) -> Log {
    let c = &*p;
    Log { logger: c.logger, environment: c.environment, name: copied(&c.name).unwrap_or_default() }
}

/// What a panic says.
fn words(panic: &(dyn Any + Send)) -> String {
    let said = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text!("the model has panicked: {}; free its instances", said.unwrap_or("it does not say why"))
}

/// Logs a panic.
#[cold]
pub(super) fn log_panic<M: Model>(log: &Log, panic: Box<dyn Any + Send>) {
    log.line(FATAL, M::LOG_CATEGORIES[ERRORS], &words(&*panic));
    // what it carries may panic when dropped
    std::mem::forget(panic);
}

/// Logs a panic that puts every instance alive out of use, and gives its status.
#[cold]
pub(super) fn fatal<M: Model>(log: &Log, panic: Box<dyn Any + Send>) -> Status {
    PANICS.fetch_add(1, Ordering::Relaxed);
    log_panic::<M>(log, panic);
    FATAL
}

/// Logs a refusal or a panic and gives its status.
///
/// # Safety
/// `p` is a component, and nothing of it is borrowed.
#[cold]
#[inline(never)]
pub(super) unsafe fn conclude<M: Model>(p: *mut Component<M>, what: Result<Refusal, Box<dyn Any + Send>>) -> Status {
    let log = log_of(p);
    match what {
        Ok(Refusal::Discard(m)) => {
            log.line(DISCARD, M::LOG_CATEGORIES[DISCARDS], &m);
            DISCARD
        }
        Ok(Refusal::Error(m)) => {
            log.line(ERROR, M::LOG_CATEGORIES[ERRORS], &m);
            ERROR
        }
        Err(panic) => fatal::<M>(&log, panic),
    }
}

/// Runs a call on a component, refusing what is none, keeping panics in, logging after the borrow has ended.
///
/// # Safety
/// As [the module](super) says.
#[inline]
pub(super) unsafe fn call<M: Model>(c: *mut c_void, f: impl FnOnce(&mut Component<M>) -> Outcome<()>) -> Status {
    let p = match component::<M>(c) {
        Ok(p) => p,
        Err(status) => return status,
    };
    // a model that panicked half-way is not looked at again, but to be dropped
    match catch_unwind(AssertUnwindSafe(|| f(&mut *p))) {
        Ok(Ok(())) => OK,
        Ok(Err(refusal)) => conclude(p, Ok(refusal)),
        Err(panic) => conclude(p, Err(panic)),
    }
}

/// Runs what hosts ask at every step, without the way through Results: `f` says whether it has done it. None where it has
/// not, or where `c` is no component in use: the call has to be run by [`call`].
///
/// # Safety
/// As [the module](super) says.
#[inline]
pub(super) unsafe fn at_once<M: Model>(c: *mut c_void, f: impl FnOnce(&mut M) -> bool) -> Option<Status> {
    let p = component::<M>(c).ok()?;
    match catch_unwind(AssertUnwindSafe(|| f(&mut (*p).model))) {
        Ok(true) => Some(OK),
        Ok(false) => None,
        Err(panic) => Some(conclude(p, Err(panic))),
    }
}

/// An error with this message.
#[cold]
pub(super) fn refuse<T>(message: &str) -> Outcome<T> {
    Err(Refusal::Error(text!("{}", message)))
}
