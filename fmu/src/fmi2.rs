//! The C functions of FMI 2.0 for co-simulation (Modelica Association 2014, FMI 2.0, sections 2.1 and 4.2).
//!
//! Any model with an `instance`, a `state`, a `start` and `variables` can stand behind it: `moving_bar` does too.
//!
//! Invariant: a panic ends here as fmi2Error, never in the host; a null or foreign pointer is refused.
#![allow(non_snake_case)]

use crate::instance::{Instance, Outcome, Refusal};
use crate::start;
use crate::state::{self, State};
use crate::variables::{Kind, LOG_CATEGORIES};
use std::ffi::{CStr, CString};
use std::os::raw::{c_char, c_int, c_uint, c_void};
use std::panic::{catch_unwind, AssertUnwindSafe};

/// fmi2Status.
pub type Status = c_int;
const OK: Status = 0;
const DISCARD: Status = 2;
const ERROR: Status = 3;
/// fmi2CoSimulation of fmi2Type.
const CO_SIMULATION: c_int = 1;
/// fmi2LastSuccessfulTime and fmi2Terminated of fmi2StatusKind.
const LAST_SUCCESSFUL_TIME: c_int = 2;
const TERMINATED: c_int = 3;
/// More values than any host hands over in one call; beyond it a count is taken for garbage.
const MOST_VALUES: usize = 1 << 20;

/// fmi2CallbackLogger.
pub type Logger = Option<unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, ...)>;

/// fmi2CallbackFunctions. Memory is our own allocator's: the model says canNotUseMemoryManagementFunctions.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct CallbackFunctions {
    logger: Logger,
    allocate_memory: Option<unsafe extern "C" fn(usize, usize) -> *mut c_void>,
    free_memory: Option<unsafe extern "C" fn(*mut c_void)>,
    step_finished: Option<unsafe extern "C" fn(*mut c_void, Status)>,
    component_environment: *mut c_void,
}

const COMPONENT: u64 = 0x746f_7563_6864_776e;
const KEPT_STATE: u64 = 0x6b65_7074_5f73_7461;

/// What an fmi2Component points to.
struct Component {
    magic: u64,
    instance: Instance,
    name: CString,
    logger: Logger,
    environment: *mut c_void,
    /// Which of [`LOG_CATEGORIES`] are told; discards and errors always are.
    told: [bool; 4],
}

/// What an fmi2FMUstate points to.
struct Kept {
    magic: u64,
    state: State,
}

/// Hands a line to a host's logger, formatted here, with every % doubled: safe for a host that prints it as a format,
/// readable in one whose callback takes no further arguments and would show a bare "%s".
fn tell(logger: Logger, environment: *mut c_void, name: &CStr, status: Status, category: usize, message: &str) {
    let log = match logger {
        Some(log) => log,
        None => return,
    };
    let clean = |s: &str| CString::new(s.replace('\0', " ")).unwrap_or_default();
    let (category, message) = (clean(LOG_CATEGORIES[category]), clean(&message.replace('%', "%%")));
    // SAFETY: the host gave the logger for this; every pointer is to a string that ends with 0 and outlives the call
    unsafe { log(environment, name.as_ptr(), status, category.as_ptr(), message.as_ptr()) }
}

impl Component {
    fn tell(&self, status: Status, category: usize, message: &str) {
        tell(self.logger, self.environment, &self.name, status, category, message);
    }

    fn answer(&self, outcome: Outcome<()>) -> Status {
        match outcome {
            Ok(()) => OK,
            Err(Refusal::Discard(m)) => {
                self.tell(DISCARD, 1, &m);
                DISCARD
            }
            Err(Refusal::Error(m)) => {
                self.tell(ERROR, 2, &m);
                ERROR
            }
        }
    }
}

/// Runs a call on a component, refusing what is none, keeping panics in.
#[inline]
fn call(c: *mut c_void, f: impl FnOnce(&mut Component) -> Outcome<()>) -> Status {
    // SAFETY: a host hands back what fmi2Instantiate gave it; null and what does not carry the magic is refused
    let component = match unsafe { c.cast::<Component>().as_mut() } {
        Some(component) if component.magic == COMPONENT => component,
        _ => return ERROR,
    };
    match catch_unwind(AssertUnwindSafe(|| {
        let outcome = f(component);
        component.answer(outcome)
    })) {
        Ok(status) => status,
        Err(_) => ERROR,
    }
}

fn refuse<T>(message: &str) -> Outcome<T> {
    Err(Refusal::Error(message.to_string()))
}

/// A host's array.
///
/// # Safety
/// `p` is null or points to `n` values.
#[inline]
unsafe fn slice<'a, T>(p: *const T, n: usize, what: &str) -> Outcome<&'a [T]> {
    if n == 0 {
        Ok(&[])
    } else if p.is_null() || n > MOST_VALUES {
        Err(Refusal::Error(format!("{} is null, or {} are too many", what, n)))
    } else {
        Ok(std::slice::from_raw_parts(p, n))
    }
}

/// A host's array to write to.
///
/// # Safety
/// `p` is null or points to `n` values.
#[inline]
unsafe fn slice_mut<'a, T>(p: *mut T, n: usize, what: &str) -> Outcome<&'a mut [T]> {
    if n == 0 {
        Ok(&mut [])
    } else if p.is_null() || n > MOST_VALUES {
        Err(Refusal::Error(format!("{} is null, or {} are too many", what, n)))
    } else {
        Ok(std::slice::from_raw_parts_mut(p, n))
    }
}

/// A host's single value to write to.
///
/// # Safety
/// `p` is null or points to a value.
unsafe fn target<'a, T>(p: *mut T, what: &str) -> Outcome<&'a mut T> {
    p.as_mut().ok_or_else(|| Refusal::Error(format!("{} is null", what)))
}

/// Sets values one by one; where one is refused, those before it are taken back.
fn set_all(c: &mut Component, kind: Kind, references: &[c_uint], values: impl Iterator<Item = f64>) -> Outcome<()> {
    if references.len() == 1 {
        return values.take(1).try_for_each(|value| c.instance.set(references[0], kind, value));
    }
    let before = c.instance.clone();
    for (r, value) in references.iter().zip(values) {
        if let Err(e) = c.instance.set(*r, kind, value) {
            let refused = c.instance.state.refused;
            c.instance = before;
            c.instance.state.refused = refused;
            return Err(e);
        }
    }
    Ok(())
}

/// fmi2GetTypesPlatform.
#[no_mangle]
pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
    b"default\0".as_ptr().cast()
}

/// fmi2GetVersion.
#[no_mangle]
pub extern "C" fn fmi2GetVersion() -> *const c_char {
    b"2.0\0".as_ptr().cast()
}

/// fmi2SetDebugLogging.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2SetDebugLogging(
    c: *mut c_void,
    on: c_int,
    n: usize,
    categories: *const *const c_char,
) -> Status {
    call(c, |c| {
        let mut told = [on != 0 && n == 0; 4];
        for p in slice(categories, n, "categories")? {
            if p.is_null() {
                return refuse("a category is null");
            }
            let name = CStr::from_ptr(*p).to_string_lossy();
            match LOG_CATEGORIES.iter().position(|k| *k == name) {
                Some(i) => told[i] = on != 0,
                None => return Err(Refusal::Error(format!("{} is no log category: give {:?}", name, LOG_CATEGORIES))),
            }
        }
        c.told = told;
        Ok(())
    })
}

/// fmi2Instantiate.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2Instantiate(
    name: *const c_char,
    kind: c_int,
    guid: *const c_char,
    _resources: *const c_char,
    functions: *const CallbackFunctions,
    _visible: c_int,
    logging_on: c_int,
) -> *mut c_void {
    let made = catch_unwind(|| {
        let functions = match functions.as_ref() {
            Some(f) => *f,
            None => return std::ptr::null_mut(),
        };
        let text = |p: *const c_char| if p.is_null() { CString::default() } else { CStr::from_ptr(p).to_owned() };
        let name = text(name);
        let wanted = start::guid();
        let given = text(guid);
        let complaint = if name.as_bytes().is_empty() {
            Some("instanceName is empty: give one".to_string())
        } else if kind != CO_SIMULATION {
            Some("fmuType is fmi2ModelExchange: only fmi2CoSimulation is here".to_string())
        } else if given.as_bytes() != wanted {
            let wanted = String::from_utf8_lossy(&wanted);
            Some(format!("fmuGUID is {:?}: give {}, as modelDescription.xml of this FMU says", given, wanted))
        } else {
            None
        };
        if let Some(m) = complaint {
            tell(functions.logger, functions.component_environment, &name, ERROR, 2, &m);
            return std::ptr::null_mut();
        }
        Box::into_raw(Box::new(Component {
            magic: COMPONENT,
            instance: Instance::default(),
            name,
            logger: functions.logger,
            environment: functions.component_environment,
            told: [logging_on != 0; 4],
        }))
        .cast()
    });
    made.unwrap_or(std::ptr::null_mut())
}

/// fmi2FreeInstance.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2FreeInstance(c: *mut c_void) {
    let _ = catch_unwind(|| {
        let p = c.cast::<Component>();
        if let Some(component) = p.as_mut() {
            if component.magic == COMPONENT {
                component.magic = 0;
                drop(Box::from_raw(p));
            }
        }
    });
}

/// fmi2SetupExperiment.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2SetupExperiment(
    c: *mut c_void,
    _tolerance_defined: c_int,
    _tolerance: f64,
    start: f64,
    stop_defined: c_int,
    stop: f64,
) -> Status {
    call(c, |c| c.instance.setup_experiment(start, if stop_defined != 0 { Some(stop) } else { None }))
}

/// fmi2EnterInitializationMode.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2EnterInitializationMode(c: *mut c_void) -> Status {
    call(c, |c| c.instance.enter_initialization())
}

/// fmi2ExitInitializationMode.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2ExitInitializationMode(c: *mut c_void) -> Status {
    call(c, |c| c.instance.exit_initialization())
}

/// fmi2Terminate.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2Terminate(c: *mut c_void) -> Status {
    call(c, |c| c.instance.terminate())
}

/// fmi2Reset.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2Reset(c: *mut c_void) -> Status {
    call(c, |c| {
        c.instance.reset();
        Ok(())
    })
}

/// fmi2GetReal.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2GetReal(c: *mut c_void, vr: *const c_uint, n: usize, values: *mut f64) -> Status {
    call(c, |c| {
        let (references, values) = (slice(vr, n, "vr")?, slice_mut(values, n, "value")?);
        for (r, value) in references.iter().zip(values) {
            *value = c.instance.get(*r, Kind::Real)?;
        }
        Ok(())
    })
}

/// fmi2GetInteger.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2GetInteger(c: *mut c_void, vr: *const c_uint, n: usize, values: *mut c_int) -> Status {
    call(c, |c| {
        let (references, values) = (slice(vr, n, "vr")?, slice_mut(values, n, "value")?);
        for (r, value) in references.iter().zip(values) {
            *value = c.instance.get(*r, Kind::Integer)? as c_int;
        }
        Ok(())
    })
}

/// fmi2GetBoolean.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2GetBoolean(c: *mut c_void, vr: *const c_uint, n: usize, values: *mut c_int) -> Status {
    call(c, |c| {
        let (references, values) = (slice(vr, n, "vr")?, slice_mut(values, n, "value")?);
        for (r, value) in references.iter().zip(values) {
            *value = c_int::from(c.instance.get(*r, Kind::Boolean)? != 0.0);
        }
        Ok(())
    })
}

/// What a call for strings comes to: the model has none.
fn no_strings(c: *mut c_void, n: usize) -> Status {
    call(c, |_| if n == 0 { Ok(()) } else { refuse("the model has no String variable") })
}

/// fmi2GetString: the model has none.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2GetString(
    c: *mut c_void,
    _vr: *const c_uint,
    n: usize,
    _values: *mut *const c_char,
) -> Status {
    no_strings(c, n)
}

/// fmi2SetReal.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2SetReal(c: *mut c_void, vr: *const c_uint, n: usize, values: *const f64) -> Status {
    call(c, |c| set_all(c, Kind::Real, slice(vr, n, "vr")?, slice(values, n, "value")?.iter().copied()))
}

/// fmi2SetInteger.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2SetInteger(c: *mut c_void, vr: *const c_uint, n: usize, values: *const c_int) -> Status {
    call(c, |c| {
        let values = slice(values, n, "value")?.iter().map(|v| f64::from(*v));
        set_all(c, Kind::Integer, slice(vr, n, "vr")?, values)
    })
}

/// fmi2SetBoolean.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2SetBoolean(c: *mut c_void, vr: *const c_uint, n: usize, values: *const c_int) -> Status {
    call(c, |c| {
        let values = slice(values, n, "value")?.iter().map(|v| f64::from(*v));
        set_all(c, Kind::Boolean, slice(vr, n, "vr")?, values)
    })
}

/// fmi2SetString: the model has none.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2SetString(
    c: *mut c_void,
    _vr: *const c_uint,
    n: usize,
    _values: *const *const c_char,
) -> Status {
    no_strings(c, n)
}

/// The state behind an fmi2FMUstate.
///
/// # Safety
/// `p` is null or what fmi2GetFMUstate or fmi2DeSerializeFMUstate gave.
unsafe fn kept<'a>(p: *mut c_void) -> Outcome<&'a mut Kept> {
    match p.cast::<Kept>().as_mut() {
        Some(k) if k.magic == KEPT_STATE => Ok(k),
        _ => refuse("FMUstate is null or not one of this model's"),
    }
}

/// Puts a state where a host wants it: into its own, or into a new one.
///
/// # Safety
/// `p` is null, or points to null or to a state of this model's.
unsafe fn keep(p: *mut *mut c_void, state: State) -> Outcome<()> {
    let p = target(p, "FMUstate")?;
    if p.is_null() {
        *p = Box::into_raw(Box::new(Kept { magic: KEPT_STATE, state })).cast();
    } else {
        kept(*p)?.state = state;
    }
    Ok(())
}

/// fmi2GetFMUstate.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2GetFMUstate(c: *mut c_void, p: *mut *mut c_void) -> Status {
    call(c, |c| keep(p, c.instance.state))
}

/// fmi2SetFMUstate.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2SetFMUstate(c: *mut c_void, p: *mut c_void) -> Status {
    call(c, |c| {
        c.instance.restore(kept(p)?.state);
        Ok(())
    })
}

/// fmi2FreeFMUstate.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2FreeFMUstate(c: *mut c_void, p: *mut *mut c_void) -> Status {
    call(c, |_| {
        let p = match p.as_mut() {
            Some(p) if !p.is_null() => p,
            _ => return Ok(()),
        };
        let k = kept(*p)?;
        k.magic = 0;
        drop(Box::from_raw(k as *mut Kept));
        *p = std::ptr::null_mut();
        Ok(())
    })
}

/// fmi2SerializedFMUstateSize.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2SerializedFMUstateSize(c: *mut c_void, p: *mut c_void, size: *mut usize) -> Status {
    call(c, |_| {
        kept(p)?;
        *target(size, "size")? = state::BYTES;
        Ok(())
    })
}

/// fmi2SerializeFMUstate.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2SerializeFMUstate(c: *mut c_void, p: *mut c_void, bytes: *mut u8, size: usize) -> Status {
    call(c, |_| {
        let k = kept(p)?;
        if bytes.is_null() || size < state::BYTES {
            return Err(Refusal::Error(format!("serializedState is null or {} bytes: give {}", size, state::BYTES)));
        }
        slice_mut(bytes, state::BYTES, "serializedState")?.copy_from_slice(&state::to_bytes(&k.state));
        Ok(())
    })
}

/// fmi2DeSerializeFMUstate.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2DeSerializeFMUstate(
    c: *mut c_void,
    bytes: *const u8,
    size: usize,
    p: *mut *mut c_void,
) -> Status {
    call(c, |_| {
        let state = state::from_bytes(slice(bytes, size, "serializedState")?)
            .map_err(|m| Refusal::Error(format!("serializedState is {}", m)))?;
        keep(p, state)
    })
}

/// fmi2GetDirectionalDerivative.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2GetDirectionalDerivative(
    c: *mut c_void,
    unknown: *const c_uint,
    n_unknown: usize,
    known: *const c_uint,
    n_known: usize,
    seed: *const f64,
    sensitivity: *mut f64,
) -> Status {
    call(c, |c| {
        let known = slice(known, n_known, "vKnown_ref")?;
        let seed = slice(seed, n_known, "dvKnown")?;
        let unknown = slice(unknown, n_unknown, "vUnknown_ref")?;
        let sensitivity = slice_mut(sensitivity, n_unknown, "dvUnknown")?;
        for (u, value) in unknown.iter().zip(sensitivity) {
            let mut sum = 0.0;
            for (k, d) in known.iter().zip(seed) {
                sum += c.instance.directional(*u, *k)? * d;
            }
            *value = sum;
        }
        Ok(())
    })
}

/// fmi2SetRealInputDerivatives.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2SetRealInputDerivatives(
    c: *mut c_void,
    vr: *const c_uint,
    n: usize,
    order: *const c_int,
    values: *const f64,
) -> Status {
    call(c, |c| {
        let (order, values) = (slice(order, n, "order")?, slice(values, n, "value")?);
        for (i, r) in slice(vr, n, "vr")?.iter().enumerate() {
            c.instance.set_input_derivative(*r, order[i], values[i])?;
        }
        Ok(())
    })
}

/// fmi2GetRealOutputDerivatives.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2GetRealOutputDerivatives(
    c: *mut c_void,
    vr: *const c_uint,
    n: usize,
    order: *const c_int,
    values: *mut f64,
) -> Status {
    call(c, |c| {
        let (order, values) = (slice(order, n, "order")?, slice_mut(values, n, "value")?);
        for (i, r) in slice(vr, n, "vr")?.iter().enumerate() {
            values[i] = c.instance.output_derivative(*r, order[i])?;
        }
        Ok(())
    })
}

/// fmi2DoStep.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2DoStep(c: *mut c_void, time: f64, step: f64, _no_set_state_before: c_int) -> Status {
    call(c, |c| {
        if let Some(event) = c.instance.do_step(time, step)? {
            if c.told[3] {
                c.tell(OK, 3, &format!("{} between {} s and {} s", event, time, c.instance.state.time));
            }
        }
        Ok(())
    })
}

/// fmi2CancelStep: steps are done when they return, there is none to cancel.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2CancelStep(c: *mut c_void) -> Status {
    call(c, |_| refuse("no step is pending: fmi2DoStep returns when it is done"))
}

/// What a question that has no answer comes to.
fn not_told(kind: c_int) -> Outcome<()> {
    Err(Refusal::Discard(format!("status kind {} has no answer here: fmi2DoStep never returns fmi2Pending", kind)))
}

/// fmi2GetStatus.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2GetStatus(c: *mut c_void, kind: c_int, _value: *mut Status) -> Status {
    call(c, |_| not_told(kind))
}

/// fmi2GetRealStatus: the last successful time.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2GetRealStatus(c: *mut c_void, kind: c_int, value: *mut f64) -> Status {
    call(c, |c| {
        if kind != LAST_SUCCESSFUL_TIME {
            return not_told(kind);
        }
        *target(value, "value")? = c.instance.state.time;
        Ok(())
    })
}

/// fmi2GetIntegerStatus.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2GetIntegerStatus(c: *mut c_void, kind: c_int, _value: *mut c_int) -> Status {
    call(c, |_| not_told(kind))
}

/// fmi2GetBooleanStatus: the element never asks to end the simulation.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2GetBooleanStatus(c: *mut c_void, kind: c_int, value: *mut c_int) -> Status {
    call(c, |_| {
        if kind != TERMINATED {
            return not_told(kind);
        }
        *target(value, "value")? = 0;
        Ok(())
    })
}

/// fmi2GetStringStatus.
///
/// # Safety
/// As FMI 2.0 says.
#[no_mangle]
pub unsafe extern "C" fn fmi2GetStringStatus(c: *mut c_void, kind: c_int, _value: *mut *const c_char) -> Status {
    call(c, |_| not_told(kind))
}
