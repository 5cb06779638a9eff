//! The C functions of FMI 2.0 for co-simulation (Modelica Association 2014, FMI 2.0, sections 2.1 and 4.2), each over
//! a [`Model`]; [`crate::export!`] gives them their C names.
//!
//! Invariant: a panic ends here: it is logged, the call returns fmi2Fatal, and every instance alive then answers
//! fmi2Fatal to whatever a host calls but fmi2FreeInstance (FMI 2.0, section 2.1.3: fmi2Fatal is of all instances). A
//! null or foreign pointer is refused. The host's logger is called while nothing of the instance is borrowed, so that
//! it may call the instance.
//!
//! # Safety of all of them
//! `c` is null, or points to 8 readable bytes. Where these are those of a component, it is one that [`instantiate`]
//! returned for the same model and that [`free_instance`] has not freed, and no other thread calls it meanwhile. A null
//! pointer and an unknown component get fmi2Error.

mod component;
mod states;
mod values;

use crate::arrays::{slice, target};
use crate::life::{Outcome, Refusal};
use crate::log::Log;
pub use crate::log::Logger;
use crate::memory::c_string;
use crate::model::Model;
use crate::text;
use component::{call, fatal, log_of, log_panic, made, refuse, Component, Magic, ERRORS, EVENTS};
pub use states::*;
use std::ffi::CStr;
use std::os::raw::{c_char, c_int, c_void};
use std::panic::{catch_unwind, AssertUnwindSafe};
pub use values::*;

/// fmi2Status.
pub type Status = c_int;
/// fmi2OK.
pub const OK: Status = 0;
/// fmi2Discard.
pub const DISCARD: Status = 2;
/// fmi2Error.
pub const ERROR: Status = 3;
/// fmi2Fatal.
pub const FATAL: Status = 4;
/// fmi2LastSuccessfulTime and fmi2Terminated of fmi2StatusKind.
const LAST_SUCCESSFUL_TIME: c_int = 2;
const TERMINATED: c_int = 3;

/// fmi2CallbackFunctions. Memory is our own allocator's: the models say canNotUseMemoryManagementFunctions.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct CallbackFunctions {
    /// Takes a line for the log.
    pub logger: Logger,
    /// Not called.
    pub allocate_memory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    /// Not called.
    pub free_memory: Option<unsafe extern "C" fn(*mut c_void)>,
    /// Not called: fmi2DoStep returns when the step is done.
    pub step_finished: Option<unsafe extern "C" fn(*mut c_void, Status)>,
    /// The host's own, handed back to the logger.
    pub component_environment: *mut c_void,
}

/// A string of nothing.
// SAFETY: the bytes end with 0 and hold no other
const EMPTY: &CStr = unsafe { CStr::from_bytes_with_nul_unchecked(b"\0") };

/// fmi2GetTypesPlatform.
pub fn get_types_platform() -> *const c_char {
    b"default\0".as_ptr().cast()
}

/// fmi2GetVersion.
pub fn get_version() -> *const c_char {
    b"2.0\0".as_ptr().cast()
}

/// fmi2SetDebugLogging.
///
/// # Safety
/// As [the module](self) says of `c`; `categories` is null or points to `n` pointers, each null or to a string that
/// ends with 0.
pub unsafe fn set_debug_logging<M: Model>(
    c: *mut c_void,
    on: c_int,
    n: usize,
    categories: *const *const c_char,
) -> Status {
    call::<M>(c, |c| {
        let mut logged = [on != 0 && n == 0; 4];
        for p in slice(categories, n, "categories")? {
            if p.is_null() {
                return refuse("a category is null");
            }
            let name = CStr::from_ptr(*p);
            match M::LOG_CATEGORIES.iter().position(|k| k.as_bytes() == name.to_bytes()) {
                Some(i) => logged[i] = on != 0,
                None => {
                    let message = text!("{:?} is no log category: give {:?}", name, M::LOG_CATEGORIES);
                    return Err(Refusal::Error(message));
                }
            }
        }
        c.logged = logged;
        Ok(())
    })
}

/// fmi2Instantiate. Null where the arguments are refused, there is no memory or the model panics; the log says why.
///
/// # Safety
/// `name` and `guid` are null or point to strings that end with 0; `functions` is null or points to the callbacks,
/// whose logger is null or a function of that type, callable with `component_environment` until the instance is freed.
pub unsafe fn instantiate<M: Model>(
    name: *const c_char,
    kind: c_int,
    guid: *const c_char,
    _resources: *const c_char,
    functions: *const CallbackFunctions,
    _visible: c_int,
    logging_on: c_int,
) -> *mut c_void {
    let functions = match functions.as_ref() {
        Some(f) => *f,
        None => return std::ptr::null_mut(),
    };
    let given = |p: *const c_char| if p.is_null() { EMPTY } else { CStr::from_ptr(p) };
    let name = c_string(given(name).to_bytes(), false);
    let log =
        Log { logger: functions.logger, environment: functions.component_environment, name: name.unwrap_or_default() };
    match catch_unwind(AssertUnwindSafe(|| made::<M>(&log, kind, given(guid), logging_on != 0))) {
        Ok(Ok(component)) => return Box::into_raw(component).cast(),
        Ok(Err(message)) => log.line(ERROR, M::LOG_CATEGORIES[ERRORS], &message),
        Err(panic) => log_panic::<M>(&log, panic),
    }
    std::ptr::null_mut()
}

/// fmi2FreeInstance, after fmi2Fatal too.
///
/// # Safety
/// As [the module](self) says; a component is freed by this and must not be passed again.
pub unsafe fn free_instance<M: Model>(c: *mut c_void) {
    if c.is_null() || c.cast::<u64>().read_unaligned() != Magic::<M>::COMPONENT {
        return;
    }
    let p = c.cast::<Component<M>>();
    let log = log_of(p);
    (*p).magic = 0;
    if let Err(panic) = catch_unwind(AssertUnwindSafe(|| drop(Box::from_raw(p)))) {
        fatal::<M>(&log, panic);
    }
}

/// fmi2SetupExperiment.
///
/// # Safety
/// As [the module](self) says of `c`.
pub unsafe fn setup_experiment<M: Model>(
    c: *mut c_void,
    _tolerance_defined: c_int,
    _tolerance: f64,
    start: f64,
    stop_defined: c_int,
    stop: f64,
) -> Status {
    call::<M>(c, |c| c.model.setup_experiment(start, if stop_defined != 0 { Some(stop) } else { None }))
}

/// fmi2EnterInitializationMode.
///
/// # Safety
/// As [the module](self) says of `c`.
pub unsafe fn enter_initialization_mode<M: Model>(c: *mut c_void) -> Status {
    call::<M>(c, |c| c.model.enter_initialization())
}

/// fmi2ExitInitializationMode.
///
/// # Safety
/// As [the module](self) says of `c`.
pub unsafe fn exit_initialization_mode<M: Model>(c: *mut c_void) -> Status {
    call::<M>(c, |c| c.model.exit_initialization())
}

/// fmi2Terminate.
///
/// # Safety
/// As [the module](self) says of `c`.
pub unsafe fn terminate<M: Model>(c: *mut c_void) -> Status {
    call::<M>(c, |c| c.model.terminate())
}

/// fmi2Reset.
///
/// # Safety
/// As [the module](self) says of `c`.
pub unsafe fn reset<M: Model>(c: *mut c_void) -> Status {
    call::<M>(c, |c| {
        c.model.reset();
        Ok(())
    })
}

/// fmi2DoStep.
///
/// # Safety
/// As [the module](self) says of `c`.
#[inline]
pub unsafe fn do_step<M: Model>(c: *mut c_void, time: f64, step: f64, _no_set_state_before: c_int) -> Status {
    let mut event = None;
    let status = call::<M>(c, |c| {
        event = c.model.do_step(time, step)?;
        Ok(())
    });
    if let (OK, Some(event)) = (status, event) {
        log_event::<M>(c, event, time, step);
    }
    status
}

/// Logs what began or ended in a step, where the host wants to know.
///
/// # Safety
/// `c` is a component that has just done a step from `time` over `step`.
#[cold]
unsafe fn log_event<M: Model>(c: *mut c_void, event: &str, time: f64, step: f64) {
    let p = c.cast::<Component<M>>();
    if (*p).logged[EVENTS] {
        let message = text!("{} between {} s and {} s", event, time, time + step);
        log_of(p).line(OK, M::LOG_CATEGORIES[EVENTS], &message);
    }
}

/// fmi2CancelStep: steps are done when they return, there is none to cancel.
///
/// # Safety
/// As [the module](self) says of `c`.
pub unsafe fn cancel_step<M: Model>(c: *mut c_void) -> Status {
    call::<M>(c, |_| refuse("no step is pending: fmi2DoStep returns when it is done"))
}

/// What a question that has no answer comes to.
fn no_answer(kind: c_int) -> Outcome<()> {
    Err(Refusal::Discard(text!("status kind {} has no answer here: fmi2DoStep never returns fmi2Pending", kind)))
}

/// fmi2GetStatus.
///
/// # Safety
/// As [the module](self) says of `c`. No other pointer is read.
pub unsafe fn get_status<M: Model>(c: *mut c_void, kind: c_int, _value: *mut Status) -> Status {
    call::<M>(c, |_| no_answer(kind))
}

/// fmi2GetRealStatus: the last successful time.
///
/// # Safety
/// As [the module](self) says of `c`; `value` is null or points to a number to write.
pub unsafe fn get_real_status<M: Model>(c: *mut c_void, kind: c_int, value: *mut f64) -> Status {
    call::<M>(c, |c| {
        if kind != LAST_SUCCESSFUL_TIME {
            return no_answer(kind);
        }
        *target(value, "value")? = c.model.life().time;
        Ok(())
    })
}

/// fmi2GetIntegerStatus.
///
/// # Safety
/// As [the module](self) says of `c`. No other pointer is read.
pub unsafe fn get_integer_status<M: Model>(c: *mut c_void, kind: c_int, _value: *mut c_int) -> Status {
    call::<M>(c, |_| no_answer(kind))
}

/// fmi2GetBooleanStatus: no model asks to end the simulation.
///
/// # Safety
/// As [the module](self) says of `c`; `value` is null or points to a number to write.
pub unsafe fn get_boolean_status<M: Model>(c: *mut c_void, kind: c_int, value: *mut c_int) -> Status {
    call::<M>(c, |_| {
        if kind != TERMINATED {
            return no_answer(kind);
        }
        *target(value, "value")? = 0;
        Ok(())
    })
}

/// fmi2GetStringStatus.
///
/// # Safety
/// As [the module](self) says of `c`. No other pointer is read.
pub unsafe fn get_string_status<M: Model>(c: *mut c_void, kind: c_int, _value: *mut *const c_char) -> Status {
    call::<M>(c, |_| no_answer(kind))
}
