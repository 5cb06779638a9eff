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

use crate::arrays::{slice, slice_mut, target, MOST_VALUES};
use crate::life::{Outcome, Refusal};
use crate::log::Log;
pub use crate::log::Logger;
use crate::memory::{boxed, c_string, copied};
use crate::model::{Kind, Model};
use crate::text;
use std::any::Any;
use std::ffi::CStr;
use std::os::raw::{c_char, c_int, c_uint, c_void};
use std::panic::{catch_unwind, AssertUnwindSafe};
use std::sync::atomic::{AtomicU32, Ordering};

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
/// fmi2CoSimulation of fmi2Type.
const CO_SIMULATION: c_int = 1;
/// fmi2LastSuccessfulTime and fmi2Terminated of fmi2StatusKind.
const LAST_SUCCESSFUL_TIME: c_int = 2;
const TERMINATED: c_int = 3;
/// Places in [`Model::LOG_CATEGORIES`].
const DISCARDS: usize = 1;
const ERRORS: usize = 2;
const EVENTS: usize = 3;

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

/// Panics of this library's calls. An instance made before the last one is out of use.
static PANICS: AtomicU32 = AtomicU32::new(0);

/// What an fmi2Component points to.
#[repr(C)]
struct Component<M> {
    /// First, so that it can be read of whatever a host passes.
    magic: u64,
    /// [`PANICS`] when the instance was made.
    panics: u32,
    /// Which of [`Model::LOG_CATEGORIES`] are logged; discards and errors always are.
    logged: [bool; 4],
    model: M,
    name: Vec<u8>,
    logger: Logger,
    environment: *mut c_void,
}

/// What an fmi2FMUstate points to.
#[repr(C)]
struct Kept<S> {
    magic: u64,
    state: S,
}

/// First bytes of a model's components and of its kept states: another model's, and another version's, are foreign.
struct Magic<M>(std::marker::PhantomData<M>);

impl<M: Model> Magic<M> {
    const COMPONENT: u64 = 0x746f_7563_6864_776e ^ M::LAYOUT.mark();
    const STATE: u64 = 0x6b65_7074_5f73_7461 ^ M::LAYOUT.mark();
}

/// A string of nothing.
// SAFETY: the bytes end with 0 and hold no other
const EMPTY: &CStr = unsafe { CStr::from_bytes_with_nul_unchecked(b"\0") };

/// The component that a host passes, or the status it gets.
///
/// # Safety
/// As [the module](self) says.
#[inline]
unsafe fn component<M: Model>(c: *mut c_void) -> Result<*mut Component<M>, Status> {
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
unsafe fn log_of<M: Model>(p: *mut Component<M>) -> Log {
    let c = &*p;
    Log { logger: c.logger, environment: c.environment, name: copied(&c.name).unwrap_or_default() }
}

/// What a panic says.
fn words(panic: &(dyn Any + Send)) -> String {
    let said = panic.downcast_ref::<&str>().copied().or_else(|| panic.downcast_ref::<String>().map(String::as_str));
    text!("the model has panicked: {}; free its instances", said.unwrap_or("it does not say why"))
}

/// Logs a refusal or a panic and gives its status.
///
/// # Safety
/// `p` is a component, and nothing of it is borrowed.
#[cold]
#[inline(never)]
unsafe fn conclude<M: Model>(p: *mut Component<M>, what: Result<Refusal, Box<dyn Any + Send>>) -> Status {
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
        Err(panic) => {
            PANICS.fetch_add(1, Ordering::Relaxed);
            log.line(FATAL, M::LOG_CATEGORIES[ERRORS], &words(&*panic));
            // what it carries may panic when dropped
            std::mem::forget(panic);
            FATAL
        }
    }
}

/// Runs a call on a component, refusing what is none, keeping panics in, logging after the borrow has ended.
///
/// # Safety
/// As [the module](self) says.
#[inline]
unsafe fn call<M: Model>(c: *mut c_void, f: impl FnOnce(&mut Component<M>) -> Outcome<()>) -> Status {
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

#[cold]
fn refuse<T>(message: &str) -> Outcome<T> {
    Err(Refusal::Error(text!("{}", message)))
}

/// Does `one` for each of `n` entries; where one is refused, those before it are undone.
fn all_or_none<M: Model>(m: &mut M, n: usize, mut one: impl FnMut(&mut M, usize) -> Outcome<()>) -> Outcome<()> {
    if n == 1 {
        return one(m, 0);
    }
    let before = m.clone();
    for i in 0..n {
        if let Err(e) = one(m, i) {
            let refused = m.life().refused;
            *m = before;
            m.life_mut().refused = refused;
            return Err(e);
        }
    }
    Ok(())
}

/// Sets values, all or none.
#[inline(never)]
fn set_all<M: Model, T: Copy + Into<f64>>(m: &mut M, kind: Kind, references: &[c_uint], values: &[T]) -> Outcome<()> {
    all_or_none(m, references.len(), |m, i| m.set(references[i], kind, values[i].into()))
}

/// A number that a host may be given.
///
/// # Errors
/// Discard where it is not finite; `what` says what it is.
fn finite(value: f64, what: impl FnOnce() -> String) -> Outcome<f64> {
    if value.is_finite() {
        Ok(value)
    } else {
        Err(Refusal::Discard(text!("{} is {}: the inputs or parameters are too large for it", what(), value)))
    }
}

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

/// A new component, or why there is none.
fn made<M: Model>(log: &Log, kind: c_int, given: &CStr, logging_on: bool) -> Result<Box<Component<M>>, String> {
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
    let errors = M::LOG_CATEGORIES[ERRORS];
    match catch_unwind(AssertUnwindSafe(|| made::<M>(&log, kind, given(guid), logging_on != 0))) {
        Ok(Ok(component)) => return Box::into_raw(component).cast(),
        Ok(Err(message)) => log.line(ERROR, errors, &message),
        Err(panic) => {
            log.line(FATAL, errors, &words(&*panic));
            std::mem::forget(panic);
        }
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
        PANICS.fetch_add(1, Ordering::Relaxed);
        log.line(FATAL, M::LOG_CATEGORIES[ERRORS], &words(&*panic));
        std::mem::forget(panic);
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

/// fmi2GetReal.
///
/// # Safety
/// As [the module](self) says of `c`; `vr` is null or points to `n` references, `values` is null or to `n`
/// values to write, apart from them.
#[inline]
pub unsafe fn get_real<M: Model>(c: *mut c_void, vr: *const c_uint, n: usize, values: *mut f64) -> Status {
    // one value, as most hosts ask, without the way through Results
    if n == 1 && !vr.is_null() && !values.is_null() {
        if let Ok(p) = component::<M>(c) {
            match catch_unwind(AssertUnwindSafe(|| (*p).model.real_at_once(*vr))) {
                Ok(Some(value)) => {
                    *values = value;
                    return OK;
                }
                Ok(None) => {}
                Err(panic) => return conclude(p, Err(panic)),
            }
        }
    }
    get_reals::<M>(c, vr, n, values)
}

/// Gets Reals one by one.
///
/// # Safety
/// As [`get_real`].
#[inline(never)]
unsafe fn get_reals<M: Model>(c: *mut c_void, vr: *const c_uint, n: usize, values: *mut f64) -> Status {
    call::<M>(c, |c| {
        let (references, values) = (slice(vr, n, "vr")?, slice_mut(values, n, "value")?);
        for (r, value) in references.iter().zip(values) {
            *value = finite(c.model.get(*r, Kind::Real)?, || text!("the value of reference {}", r))?;
        }
        Ok(())
    })
}

/// fmi2GetInteger.
///
/// # Safety
/// As [the module](self) says of `c`; `vr` is null or points to `n` references, `values` is null or to `n`
/// values to write, apart from them.
pub unsafe fn get_integer<M: Model>(c: *mut c_void, vr: *const c_uint, n: usize, values: *mut c_int) -> Status {
    call::<M>(c, |c| {
        let (references, values) = (slice(vr, n, "vr")?, slice_mut(values, n, "value")?);
        for (r, value) in references.iter().zip(values) {
            *value = c.model.get(*r, Kind::Integer)? as c_int;
        }
        Ok(())
    })
}

/// fmi2GetBoolean.
///
/// # Safety
/// As [the module](self) says of `c`; `vr` is null or points to `n` references, `values` is null or to `n`
/// values to write, apart from them.
pub unsafe fn get_boolean<M: Model>(c: *mut c_void, vr: *const c_uint, n: usize, values: *mut c_int) -> Status {
    call::<M>(c, |c| {
        let (references, values) = (slice(vr, n, "vr")?, slice_mut(values, n, "value")?);
        for (r, value) in references.iter().zip(values) {
            *value = c_int::from(c.model.get(*r, Kind::Boolean)? != 0.0);
        }
        Ok(())
    })
}

/// What a call for strings comes to: no model has any.
///
/// # Safety
/// As [the module](self) says of `c`.
unsafe fn no_strings<M: Model>(c: *mut c_void, n: usize) -> Status {
    call::<M>(c, |_| if n == 0 { Ok(()) } else { refuse("the model has no String variable") })
}

/// fmi2GetString: no model has any.
///
/// # Safety
/// As [the module](self) says of `c`. No other pointer is read.
pub unsafe fn get_string<M: Model>(
    c: *mut c_void,
    _vr: *const c_uint,
    n: usize,
    _values: *mut *const c_char,
) -> Status {
    no_strings::<M>(c, n)
}

/// fmi2SetReal.
///
/// # Safety
/// As [the module](self) says of `c`; `vr` is null or points to `n` references, `values` is null or to `n`
/// values.
#[inline]
pub unsafe fn set_real<M: Model>(c: *mut c_void, vr: *const c_uint, n: usize, values: *const f64) -> Status {
    // what hosts set at every step, without the way through Results
    if n > 0 && n <= MOST_VALUES && !vr.is_null() && !values.is_null() {
        if let Ok(p) = component::<M>(c) {
            let (references, values) = (std::slice::from_raw_parts(vr, n), std::slice::from_raw_parts(values, n));
            match catch_unwind(AssertUnwindSafe(|| (*p).model.set_reals(references, values))) {
                Ok(true) => return OK,
                Ok(false) => {}
                Err(panic) => return conclude(p, Err(panic)),
            }
        }
    }
    set_reals::<M>(c, vr, n, values)
}

/// Sets Reals one by one.
///
/// # Safety
/// As [`set_real`].
#[inline(never)]
unsafe fn set_reals<M: Model>(c: *mut c_void, vr: *const c_uint, n: usize, values: *const f64) -> Status {
    call::<M>(c, |c| {
        let (references, values) = (slice(vr, n, "vr")?, slice(values, n, "value")?);
        set_all(&mut c.model, Kind::Real, references, values)
    })
}

/// fmi2SetInteger.
///
/// # Safety
/// As [the module](self) says of `c`; `vr` is null or points to `n` references, `values` is null or to `n`
/// values.
pub unsafe fn set_integer<M: Model>(c: *mut c_void, vr: *const c_uint, n: usize, values: *const c_int) -> Status {
    call::<M>(c, |c| set_all(&mut c.model, Kind::Integer, slice(vr, n, "vr")?, slice(values, n, "value")?))
}

/// fmi2SetBoolean.
///
/// # Safety
/// As [the module](self) says of `c`; `vr` is null or points to `n` references, `values` is null or to `n`
/// values.
pub unsafe fn set_boolean<M: Model>(c: *mut c_void, vr: *const c_uint, n: usize, values: *const c_int) -> Status {
    call::<M>(c, |c| set_all(&mut c.model, Kind::Boolean, slice(vr, n, "vr")?, slice(values, n, "value")?))
}

/// fmi2SetString: no model has any.
///
/// # Safety
/// As [the module](self) says of `c`. No other pointer is read.
pub unsafe fn set_string<M: Model>(
    c: *mut c_void,
    _vr: *const c_uint,
    n: usize,
    _values: *const *const c_char,
) -> Status {
    no_strings::<M>(c, n)
}

/// The state behind an fmi2FMUstate.
///
/// # Safety
/// `p` is null, or points to 8 readable bytes; where these are those of a state of this model, to one that is not
/// freed and that nobody else uses during the call.
unsafe fn kept<'a, M: Model>(p: *mut c_void) -> Outcome<&'a mut Kept<M::State>> {
    if p.is_null() || p.cast::<u64>().read_unaligned() != Magic::<M>::STATE {
        return refuse("FMUstate is null or not one of this model's");
    }
    Ok(&mut *p.cast())
}

/// Puts a state where a host wants it: into its own, or into a new one.
///
/// # Safety
/// `p` is null, or points to null or to what [`kept`] takes.
unsafe fn keep<M: Model>(p: *mut *mut c_void, state: M::State) -> Outcome<()> {
    let p = target(p, "FMUstate")?;
    if p.is_null() {
        let kept = boxed(Kept { magic: Magic::<M>::STATE, state });
        *p = Box::into_raw(kept.ok_or_else(|| Refusal::Error(text!("no memory for a state")))?).cast();
    } else {
        kept::<M>(*p)?.state = state;
    }
    Ok(())
}

/// fmi2GetFMUstate.
///
/// # Safety
/// As [the module](self) says of `c`; `p` is null, or points to null or to a state that [`get_fmu_state`] or
/// [`de_serialize_fmu_state`] gave for the same model and [`free_fmu_state`] has not freed.
pub unsafe fn get_fmu_state<M: Model>(c: *mut c_void, p: *mut *mut c_void) -> Status {
    call::<M>(c, |c| keep::<M>(p, c.model.state()))
}

/// fmi2SetFMUstate.
///
/// # Safety
/// As [the module](self) says of `c`; `p` is null or what [`get_fmu_state`] or [`de_serialize_fmu_state`] gave for the
/// same model and [`free_fmu_state`] has not freed.
pub unsafe fn set_fmu_state<M: Model>(c: *mut c_void, p: *mut c_void) -> Status {
    call::<M>(c, |c| {
        c.model.restore(kept::<M>(p)?.state);
        Ok(())
    })
}

/// fmi2FreeFMUstate.
///
/// # Safety
/// As [the module](self) says of `c`; `p` is null, or points to null or to a state that [`get_fmu_state`] or
/// [`de_serialize_fmu_state`] gave for the same model and [`free_fmu_state`] has not freed.
pub unsafe fn free_fmu_state<M: Model>(c: *mut c_void, p: *mut *mut c_void) -> Status {
    call::<M>(c, |_| {
        let p = match p.as_mut() {
            Some(p) if !p.is_null() => p,
            _ => return Ok(()),
        };
        let k = kept::<M>(*p)?;
        k.magic = 0;
        drop(Box::from_raw(k as *mut Kept<M::State>));
        *p = std::ptr::null_mut();
        Ok(())
    })
}

/// fmi2SerializedFMUstateSize.
///
/// # Safety
/// As [the module](self) says of `c`; `p` is null or what [`get_fmu_state`] or [`de_serialize_fmu_state`] gave for the
/// same model and [`free_fmu_state`] has not freed; `size` is null or points to a number to write.
pub unsafe fn serialized_fmu_state_size<M: Model>(c: *mut c_void, p: *mut c_void, size: *mut usize) -> Status {
    call::<M>(c, |_| {
        kept::<M>(p)?;
        *target(size, "size")? = M::LAYOUT.length;
        Ok(())
    })
}

/// fmi2SerializeFMUstate.
///
/// # Safety
/// As [the module](self) says of `c`; `p` is null or what [`get_fmu_state`] or [`de_serialize_fmu_state`] gave for the
/// same model and [`free_fmu_state`] has not freed; `bytes` is null or points to `size` bytes to write.
pub unsafe fn serialize_fmu_state<M: Model>(c: *mut c_void, p: *mut c_void, bytes: *mut u8, size: usize) -> Status {
    call::<M>(c, |_| {
        let k = kept::<M>(p)?;
        if bytes.is_null() || size < M::LAYOUT.length {
            return Err(Refusal::Error(text!("serializedState is null or {} bytes: give {}", size, M::LAYOUT.length)));
        }
        M::write(&k.state, slice_mut(bytes, M::LAYOUT.length, "serializedState")?);
        Ok(())
    })
}

/// fmi2DeSerializeFMUstate.
///
/// # Safety
/// As [the module](self) says of `c`; `bytes` is null or points to `size` bytes; `p` as for [`get_fmu_state`].
pub unsafe fn de_serialize_fmu_state<M: Model>(
    c: *mut c_void,
    bytes: *const u8,
    size: usize,
    p: *mut *mut c_void,
) -> Status {
    call::<M>(c, |_| {
        let state = M::read(slice(bytes, size, "serializedState")?)
            .map_err(|m| Refusal::Error(text!("serializedState is {}", m)))?;
        keep::<M>(p, state)
    })
}

/// fmi2GetDirectionalDerivative.
///
/// # Safety
/// As [the module](self) says of `c`; `unknown` is null or points to `n_unknown` references, `known` and `seed` are null
/// or to `n_known` references and numbers, `sensitivity` is null or to `n_unknown` numbers to write, apart from them.
pub unsafe fn get_directional_derivative<M: Model>(
    c: *mut c_void,
    unknown: *const c_uint,
    n_unknown: usize,
    known: *const c_uint,
    n_known: usize,
    seed: *const f64,
    sensitivity: *mut f64,
) -> Status {
    call::<M>(c, |c| {
        let known = slice(known, n_known, "vKnown_ref")?;
        let seed = slice(seed, n_known, "dvKnown")?;
        let unknown = slice(unknown, n_unknown, "vUnknown_ref")?;
        let sensitivity = slice_mut(sensitivity, n_unknown, "dvUnknown")?;
        for (u, value) in unknown.iter().zip(sensitivity) {
            let mut sum = 0.0;
            for (k, d) in known.iter().zip(seed) {
                sum += c.model.directional(*u, *k)? * d;
            }
            *value = finite(sum, || text!("the directional derivative of reference {}", u))?;
        }
        Ok(())
    })
}

/// fmi2SetRealInputDerivatives.
///
/// # Safety
/// As [the module](self) says of `c`; `vr`, `order` and `values` are null or point to `n` references, orders, numbers.
pub unsafe fn set_real_input_derivatives<M: Model>(
    c: *mut c_void,
    vr: *const c_uint,
    n: usize,
    order: *const c_int,
    values: *const f64,
) -> Status {
    call::<M>(c, |c| {
        let (order, values) = (slice(order, n, "order")?, slice(values, n, "value")?);
        let references = slice(vr, n, "vr")?;
        all_or_none(&mut c.model, n, |m, i| m.set_input_derivative(references[i], order[i], values[i]))
    })
}

/// fmi2GetRealOutputDerivatives.
///
/// # Safety
/// As [the module](self) says of `c`; `vr` and `order` are null or point to `n` references and orders, `values` is null
/// or to `n` numbers to write, apart from them.
pub unsafe fn get_real_output_derivatives<M: Model>(
    c: *mut c_void,
    vr: *const c_uint,
    n: usize,
    order: *const c_int,
    values: *mut f64,
) -> Status {
    call::<M>(c, |c| {
        let (order, values) = (slice(order, n, "order")?, slice_mut(values, n, "value")?);
        for (i, r) in slice(vr, n, "vr")?.iter().enumerate() {
            let rate = c.model.output_derivative(*r, order[i])?;
            values[i] = finite(rate, || text!("the derivative of reference {}", r))?;
        }
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
