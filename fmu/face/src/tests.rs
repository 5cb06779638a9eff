//! The C functions over a model that panics, refuses and reports events on demand, driven as a host drives them.
// `const { }` blocks came with Rust 1.79
#![allow(clippy::missing_const_for_thread_local)]

use crate::bytes::{number, Layout, HEADER};
use crate::fmi2::{self, CallbackFunctions, Status, DISCARD, ERROR, FATAL, OK};
use crate::start::{GUID_LENGTH, UNPACKED_GUID};
use crate::{checked, error, Kind, Life, Model, Outcome, Phase, Refusal};
use std::cell::{Cell, RefCell};
use std::ffi::{CStr, CString};
use std::os::raw::{c_char, c_int, c_uint, c_void};
use std::ptr::{null, null_mut};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Input, Real.
const X: u32 = 0;
/// Output, Real: twice the input.
const Y: u32 = 1;
/// Parameter, Integer: what the model does next.
const DEMAND: u32 = 2;
/// Length of a state in bytes.
const LENGTH: usize = <Probe<0> as Model>::LAYOUT.length;
/// Input, Boolean; refuses nothing.
const FLAG: u32 = 3;

// demands
const PANIC_IN_STEP: f64 = 1.0;
const PANIC_IN_GET: f64 = 2.0;
const PANIC_IN_SET: f64 = 3.0;
const PANIC_WITH_NUMBER: f64 = 4.0;
const PANIC_IN_DROP: f64 = 5.0;
const REPORT_EVENT: f64 = 6.0;
const PANIC_AT_ONCE: f64 = 7.0;
const ANSWER_AT_ONCE: f64 = 8.0;

thread_local! {
    static PANIC_IN_DEFAULT: Cell<bool> = Cell::new(false);
    /// Calls into the model under way.
    static INSIDE: Cell<u32> = Cell::new(0);
}

/// Counts a call into the model while it lives.
struct Inside;
impl Inside {
    fn new() -> Inside {
        INSIDE.with(|i| i.set(i.get() + 1));
        Inside
    }
}
impl Drop for Inside {
    fn drop(&mut self) {
        INSIDE.with(|i| i.set(i.get() - 1));
    }
}

#[derive(Clone)]
struct Probe<const N: usize> {
    life: Life,
    x: f64,
    flag: f64,
    demand: f64,
    /// Only an instance that a host was given panics when dropped, no copy of it.
    armed: bool,
}

impl<const N: usize> Default for Probe<N> {
    fn default() -> Self {
        assert!(!PANIC_IN_DEFAULT.with(Cell::get), "no instance today");
        Probe { life: Life::default(), x: 0.0, flag: 0.0, demand: 0.0, armed: false }
    }
}

impl<const N: usize> Drop for Probe<N> {
    fn drop(&mut self) {
        assert!(!self.armed, "dropped");
    }
}

fn variable(reference: u32, kind: Kind) -> Outcome<()> {
    let known = [("x", Kind::Real), ("y", Kind::Real), ("demand", Kind::Integer), ("flag", Kind::Boolean)];
    checked(known.get(reference as usize).map(|(n, k)| (*n, *k, ())), reference, kind).map(|_| ())
}

impl<const N: usize> Model for Probe<N> {
    type State = (Life, f64);
    const NAME: &'static str = if N == 0 { "Probe" } else { "Other" };
    const LOG_CATEGORIES: [&'static str; 4] = ["warnings", "discards", "errors", "events"];
    const LAYOUT: Layout = Layout::new(Self::NAME, 1, 8);

    fn guid() -> [u8; GUID_LENGTH] {
        UNPACKED_GUID
    }
    fn state(&self) -> Self::State {
        (self.life, self.x)
    }
    fn restore(&mut self, (life, x): Self::State) {
        self.life = life;
        self.x = x;
    }
    fn write(state: &Self::State, bytes: &mut [u8]) {
        bytes[HEADER..HEADER + 8].copy_from_slice(&state.1.to_le_bytes());
        Self::LAYOUT.seal(bytes);
    }
    fn read(bytes: &[u8]) -> Result<Self::State, &'static str> {
        let own = Self::LAYOUT.unseal(bytes)?;
        Ok((Life { phase: Phase::Stepping, ..Life::default() }, number(own, 0)))
    }
    fn life(&self) -> &Life {
        &self.life
    }
    fn life_mut(&mut self) -> &mut Life {
        &mut self.life
    }
    fn exit_initialization(&mut self) -> Outcome<()> {
        self.life.require("fmi2ExitInitializationMode", &[Phase::Initialization])?;
        self.life.phase = Phase::Stepping;
        Ok(())
    }
    fn set(&mut self, reference: u32, kind: Kind, value: f64) -> Outcome<()> {
        let _inside = Inside::new();
        variable(reference, kind)?;
        assert!(self.demand != PANIC_IN_SET, "set to {}", value);
        match reference {
            X if !value.is_finite() => {
                self.life.refused = 1;
                return Err(Refusal::Discard("x is 100 % no number".into()));
            }
            X => self.x = value,
            DEMAND => {
                self.demand = value;
                self.armed = value == PANIC_IN_DROP;
            }
            FLAG => self.flag = value,
            _ => return error("y is an output".into()),
        }
        Ok(())
    }
    fn get(&self, reference: u32, kind: Kind) -> Outcome<f64> {
        let _inside = Inside::new();
        variable(reference, kind)?;
        assert!(self.demand != PANIC_IN_GET, "got");
        Ok([self.x, 2.0 * self.x, self.demand, self.flag][reference as usize])
    }
    fn set_reals(&mut self, references: &[u32], values: &[f64]) -> bool {
        let _inside = Inside::new();
        assert!(self.demand != PANIC_AT_ONCE, "set at once");
        if self.demand != ANSWER_AT_ONCE || references != [X] || !values[0].is_finite() {
            return false;
        }
        self.x = 10.0 * values[0];
        true
    }
    fn real_at_once(&self, reference: u32) -> Option<f64> {
        let _inside = Inside::new();
        assert!(self.demand != PANIC_AT_ONCE, "got at once");
        if self.demand == ANSWER_AT_ONCE && reference == Y {
            Some(-self.x)
        } else {
            None
        }
    }
    fn directional(&self, _unknown: u32, _known: u32) -> Outcome<f64> {
        Ok(2.0)
    }
    fn set_input_derivative(&mut self, _reference: u32, order: i32, value: f64) -> Outcome<()> {
        if order != 1 {
            return error("only order 1 is taken".into());
        }
        self.x = value;
        Ok(())
    }
    fn output_derivative(&self, _reference: u32, _order: i32) -> Outcome<f64> {
        Ok(2.0 * self.x)
    }
    fn do_step(&mut self, time: f64, step: f64) -> Outcome<Option<&'static str>> {
        let _inside = Inside::new();
        self.life.step_is_good(time, step)?;
        self.life.time = time + step;
        match self.demand {
            d if d == PANIC_IN_STEP => panic!("half-way"),
            d if d == PANIC_WITH_NUMBER => std::panic::panic_any(7),
            d if d == REPORT_EVENT => Ok(Some("something begins")),
            _ => Ok(None),
        }
    }
}

/// What a host keeps of its logger's calls: (status, category, message); and the instance its logger calls.
#[derive(Default)]
struct Host {
    lines: RefCell<Vec<(Status, String, String)>>,
    component: Cell<*mut c_void>,
    /// What reading and setting answered inside the logger, and the value read.
    inside: RefCell<Vec<(Status, Status, f64)>>,
}

unsafe extern "C" fn logger(
    environment: *mut c_void,
    name: *const c_char,
    status: Status,
    category: *const c_char,
    message: *const c_char,
) {
    let host = &*environment.cast::<Host>();
    assert_eq!(INSIDE.with(Cell::get), 0, "logged from inside a call of the model");
    assert!(!CStr::from_ptr(name).to_bytes().contains(&b'%'));
    let text = |p| CStr::from_ptr(p).to_str().unwrap().to_string();
    host.lines.borrow_mut().push((status, text(category), text(message)));
    let c = host.component.get();
    if !c.is_null() {
        // a host whose logger reads the instance and changes it
        host.component.set(null_mut());
        let mut y = f64::NAN;
        let read = fmi2::get_real::<Probe<0>>(c, &Y, 1, &mut y);
        let set = fmi2::set_real::<Probe<0>>(c, &X, 1, &(y + 1.0));
        host.inside.borrow_mut().push((read, set, y));
        host.component.set(c);
    }
}

fn callbacks(host: &Host) -> CallbackFunctions {
    type Fixed = unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char);
    type Variadic = unsafe extern "C" fn(*mut c_void, *const c_char, Status, *const c_char, *const c_char, ...);
    // SAFETY: the calling conventions that the tests run on pass the fixed arguments of both alike
    let logger = unsafe { std::mem::transmute::<Fixed, Variadic>(logger) };
    CallbackFunctions {
        logger: Some(logger),
        allocate_memory: None,
        free_memory: None,
        step_finished: None,
        component_environment: host as *const Host as *mut c_void,
    }
}

/// Panics are counted once a library: the tests that make instances take turns.
fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}

unsafe fn instance<const N: usize>(host: &Host) -> *mut c_void {
    let guid = CString::new(UNPACKED_GUID.to_vec()).unwrap();
    let name = CString::new("probe").unwrap();
    let c = fmi2::instantiate::<Probe<N>>(name.as_ptr(), 1, guid.as_ptr(), null(), &callbacks(host), 0, 1);
    assert!(!c.is_null());
    c
}

/// An instance that may step and does as demanded.
unsafe fn stepping(host: &Host, demand: f64) -> *mut c_void {
    let c = instance::<0>(host);
    assert_eq!(fmi2::setup_experiment::<Probe<0>>(c, 0, 0.0, 0.0, 0, 0.0), OK);
    assert_eq!(fmi2::enter_initialization_mode::<Probe<0>>(c), OK);
    assert_eq!(fmi2::exit_initialization_mode::<Probe<0>>(c), OK);
    assert_eq!(fmi2::set_integer::<Probe<0>>(c, &DEMAND, 1, &(demand as c_int)), OK);
    c
}

/// Every function that takes a component, with good arguments: its name and what it answers.
unsafe fn every(c: *mut c_void) -> Vec<(&'static str, Status)> {
    type P = Probe<0>;
    let (mut d, mut n, mut size, mut state, mut s) = (0.0, 0, 0, null_mut(), null());
    let mut bytes = [0u8; LENGTH];
    P::write(&(Life::default(), 1.5), &mut bytes);
    let one = 1.0;
    vec![
        ("SetDebugLogging", fmi2::set_debug_logging::<P>(c, 1, 0, null())),
        ("SetupExperiment", fmi2::setup_experiment::<P>(c, 0, 0.0, 0.0, 0, 0.0)),
        ("EnterInitializationMode", fmi2::enter_initialization_mode::<P>(c)),
        ("ExitInitializationMode", fmi2::exit_initialization_mode::<P>(c)),
        ("GetReal", fmi2::get_real::<P>(c, &Y, 1, &mut d)),
        ("GetInteger", fmi2::get_integer::<P>(c, &DEMAND, 1, &mut n)),
        ("GetBoolean", fmi2::get_boolean::<P>(c, &FLAG, 1, &mut n)),
        ("GetString", fmi2::get_string::<P>(c, null(), 0, &mut s)),
        ("SetReal", fmi2::set_real::<P>(c, &X, 1, &one)),
        ("SetInteger", fmi2::set_integer::<P>(c, &DEMAND, 1, &0)),
        ("SetBoolean", fmi2::set_boolean::<P>(c, &FLAG, 1, &1)),
        ("SetString", fmi2::set_string::<P>(c, null(), 0, null())),
        ("GetFMUstate", fmi2::get_fmu_state::<P>(c, &mut state)),
        ("SerializedFMUstateSize", fmi2::serialized_fmu_state_size::<P>(c, state, &mut size)),
        ("SerializeFMUstate", fmi2::serialize_fmu_state::<P>(c, state, bytes.as_mut_ptr(), LENGTH)),
        ("DeSerializeFMUstate", fmi2::de_serialize_fmu_state::<P>(c, bytes.as_ptr(), LENGTH, &mut state)),
        ("GetDirectionalDerivative", fmi2::get_directional_derivative::<P>(c, &Y, 1, &X, 1, &one, &mut d)),
        ("SetRealInputDerivatives", fmi2::set_real_input_derivatives::<P>(c, &X, 1, &1, &one)),
        ("GetRealOutputDerivatives", fmi2::get_real_output_derivatives::<P>(c, &Y, 1, &1, &mut d)),
        ("DoStep", fmi2::do_step::<P>(c, 0.0, 1.0, 1)),
        ("GetRealStatus", fmi2::get_real_status::<P>(c, 2, &mut d)),
        ("GetBooleanStatus", fmi2::get_boolean_status::<P>(c, 3, &mut n)),
        ("SetFMUstate", fmi2::set_fmu_state::<P>(c, state)),
        ("FreeFMUstate", fmi2::free_fmu_state::<P>(c, &mut state)),
        ("Terminate", fmi2::terminate::<P>(c)),
        ("Reset", fmi2::reset::<P>(c)),
    ]
}

/// Functions that answer no good argument with fmi2OK.
unsafe fn refusing(c: *mut c_void) -> Vec<Status> {
    type P = Probe<0>;
    let (mut n, mut s) = (0, null());
    vec![
        fmi2::cancel_step::<P>(c),
        fmi2::get_status::<P>(c, 0, &mut n),
        fmi2::get_integer_status::<P>(c, 0, &mut n),
        fmi2::get_string_status::<P>(c, 1, &mut s),
    ]
}

#[test]
fn an_instance_lives_its_life() {
    let _turn = turn();
    let host = Host::default();
    unsafe {
        let c = instance::<0>(&host);
        for (name, status) in every(c) {
            assert_eq!(status, OK, "{}", name);
        }
        assert_eq!(refusing(c), [ERROR, DISCARD, DISCARD, DISCARD]);
        fmi2::free_instance::<Probe<0>>(c);
        assert_eq!(CStr::from_ptr(fmi2::get_version()).to_bytes(), b"2.0");
        assert_eq!(CStr::from_ptr(fmi2::get_types_platform()).to_bytes(), b"default");
    }
    assert_eq!(host.lines.borrow().len(), 4);
}

#[test]
fn no_component_a_foreign_one_and_another_models_are_refused_by_every_function() {
    let _turn = turn();
    let host = Host::default();
    unsafe {
        let mut zeros = [0u64; 64];
        let other = instance::<1>(&host);
        for c in [null_mut(), zeros.as_mut_ptr().cast(), other] {
            for (name, status) in every(c) {
                assert_eq!(status, ERROR, "{}", name);
            }
            assert_eq!(refusing(c), [ERROR; 4]);
            fmi2::free_instance::<Probe<0>>(c);
        }
        // the other one is as it was, and frees
        assert_eq!(fmi2::terminate::<Probe<1>>(other), ERROR);
        fmi2::free_instance::<Probe<1>>(other);
    }
    assert_eq!(host.lines.borrow().len(), 1);
}

#[test]
fn null_arguments_are_refused_and_change_nothing() {
    let _turn = turn();
    let host = Host::default();
    type P = Probe<0>;
    unsafe {
        let c = stepping(&host, 0.0);
        let (mut d, mut n, mut size, one, order) = (0.0, 0, 0, 1.0, 1);
        let mut state = null_mut();
        let mut bytes = [0u8; LENGTH];
        assert_eq!(fmi2::get_fmu_state::<P>(c, &mut state), OK);
        let many = (1 << 20) + 1;
        let got = [
            fmi2::set_debug_logging::<P>(c, 1, 1, null()),
            fmi2::set_debug_logging::<P>(c, 1, 1, [null()].as_ptr()),
            fmi2::get_real::<P>(c, null(), 1, &mut d),
            fmi2::get_real::<P>(c, &Y, 1, null_mut()),
            fmi2::get_real::<P>(c, &Y, many, &mut d),
            fmi2::get_integer::<P>(c, null(), 1, &mut n),
            fmi2::get_integer::<P>(c, &DEMAND, 1, null_mut()),
            fmi2::get_boolean::<P>(c, null(), 1, &mut n),
            fmi2::get_boolean::<P>(c, &FLAG, 1, null_mut()),
            fmi2::get_string::<P>(c, null(), 1, null_mut()),
            fmi2::set_real::<P>(c, null(), 1, &one),
            fmi2::set_real::<P>(c, &X, 1, null()),
            fmi2::set_real::<P>(c, &X, many, &one),
            fmi2::set_integer::<P>(c, null(), 1, &n),
            fmi2::set_integer::<P>(c, &DEMAND, 1, null()),
            fmi2::set_boolean::<P>(c, null(), 1, &n),
            fmi2::set_boolean::<P>(c, &FLAG, 1, null()),
            fmi2::set_string::<P>(c, null(), 1, null()),
            fmi2::get_fmu_state::<P>(c, null_mut()),
            fmi2::set_fmu_state::<P>(c, null_mut()),
            fmi2::set_fmu_state::<P>(c, bytes.as_mut_ptr().cast()),
            fmi2::serialized_fmu_state_size::<P>(c, null_mut(), &mut size),
            fmi2::serialized_fmu_state_size::<P>(c, state, null_mut()),
            fmi2::serialize_fmu_state::<P>(c, null_mut(), bytes.as_mut_ptr(), LENGTH),
            fmi2::serialize_fmu_state::<P>(c, state, null_mut(), LENGTH),
            fmi2::serialize_fmu_state::<P>(c, state, bytes.as_mut_ptr(), LENGTH - 1),
            fmi2::de_serialize_fmu_state::<P>(c, null(), LENGTH, &mut state),
            fmi2::de_serialize_fmu_state::<P>(c, bytes.as_ptr(), LENGTH, &mut state),
            fmi2::get_directional_derivative::<P>(c, null(), 1, &X, 1, &one, &mut d),
            fmi2::get_directional_derivative::<P>(c, &Y, 1, null(), 1, &one, &mut d),
            fmi2::get_directional_derivative::<P>(c, &Y, 1, &X, 1, null(), &mut d),
            fmi2::get_directional_derivative::<P>(c, &Y, 1, &X, 1, &one, null_mut()),
            fmi2::set_real_input_derivatives::<P>(c, null(), 1, &order, &one),
            fmi2::set_real_input_derivatives::<P>(c, &X, 1, null(), &one),
            fmi2::set_real_input_derivatives::<P>(c, &X, 1, &order, null()),
            fmi2::get_real_output_derivatives::<P>(c, null(), 1, &order, &mut d),
            fmi2::get_real_output_derivatives::<P>(c, &Y, 1, null(), &mut d),
            fmi2::get_real_output_derivatives::<P>(c, &Y, 1, &order, null_mut()),
            fmi2::get_real_status::<P>(c, 2, null_mut()),
            fmi2::get_boolean_status::<P>(c, 3, null_mut()),
        ];
        assert!(got.iter().all(|s| *s == ERROR), "{:?}", got);
        assert_eq!(host.lines.borrow().len(), got.len());
        assert_eq!((d, n, size, bytes), (0.0, 0, 0, [0; LENGTH]));
        // a state is not taken for a component, nor a component for a state
        assert_eq!(fmi2::get_real::<P>(state, &Y, 1, &mut d), ERROR);
        assert_eq!(fmi2::set_fmu_state::<P>(c, c), ERROR);
        let mut none = null_mut();
        // nor a state for its address
        assert_eq!(fmi2::free_fmu_state::<P>(c, state.cast()), ERROR);
        assert_eq!(fmi2::get_fmu_state::<P>(c, state.cast()), ERROR);
        assert_eq!(fmi2::de_serialize_fmu_state::<P>(c, bytes.as_ptr(), LENGTH, state.cast()), ERROR);
        assert_eq!(fmi2::free_fmu_state::<P>(c, null_mut()), OK);
        assert_eq!(fmi2::free_fmu_state::<P>(c, &mut none), OK);
        assert_eq!(fmi2::free_fmu_state::<P>(c, &mut state), OK);
        assert!(state.is_null());
        assert_eq!(fmi2::get_real::<P>(c, &Y, 1, &mut d), OK);
        fmi2::free_instance::<P>(c);
    }
}

#[test]
fn an_instance_is_refused_with_a_reason_where_it_cannot_be_made() {
    let _turn = turn();
    let host = Host::default();
    let good = CString::new(UNPACKED_GUID.to_vec()).unwrap();
    let (name, wrong, empty) = (CString::new("a").unwrap(), CString::new("{other}").unwrap(), CString::default());
    let with = callbacks(&host);
    let make = |name: *const c_char, kind, guid: *const c_char, with: *const CallbackFunctions| unsafe {
        fmi2::instantiate::<Probe<0>>(name, kind, guid, null(), with, 0, 0)
    };
    assert!(make(name.as_ptr(), 1, good.as_ptr(), null()).is_null());
    assert!(make(null(), 1, good.as_ptr(), &with).is_null());
    assert!(make(empty.as_ptr(), 1, good.as_ptr(), &with).is_null());
    assert!(make(name.as_ptr(), 0, good.as_ptr(), &with).is_null());
    assert!(make(name.as_ptr(), 1, wrong.as_ptr(), &with).is_null());
    assert!(make(name.as_ptr(), 1, null(), &with).is_null());
    PANIC_IN_DEFAULT.with(|p| p.set(true));
    assert!(make(name.as_ptr(), 1, good.as_ptr(), &with).is_null());
    PANIC_IN_DEFAULT.with(|p| p.set(false));
    let lines = host.lines.borrow();
    let statuses: Vec<Status> = lines.iter().map(|l| l.0).collect();
    assert_eq!(statuses, [ERROR, ERROR, ERROR, ERROR, ERROR, FATAL]);
    assert!(lines[3].2.contains("{other}") && lines[5].2.contains("no instance today"), "{:?}", lines);
    // without a logger nothing is said, and nothing breaks
    let silent = CallbackFunctions { logger: None, ..with };
    assert!(make(name.as_ptr(), 1, wrong.as_ptr(), &silent).is_null());
    let c = make(name.as_ptr(), 1, good.as_ptr(), &silent);
    unsafe {
        assert_eq!(fmi2::do_step::<Probe<0>>(c, 0.0, 1.0, 1), ERROR);
        fmi2::free_instance::<Probe<0>>(c);
    }
}

#[test]
fn a_panic_is_logged_and_fatal_and_every_instance_alive_then_is_out_of_use() {
    let _turn = turn();
    type P = Probe<0>;
    let cases = [
        (PANIC_IN_STEP, "half-way"),
        (PANIC_IN_GET, "got;"),
        (PANIC_IN_SET, "set to 1"),
        (PANIC_AT_ONCE, "got at once"),
        (PANIC_AT_ONCE, "set at once"),
        (PANIC_WITH_NUMBER, "it does not say why"),
    ];
    for (demand, words) in cases {
        let host = Host::default();
        unsafe {
            let (c, bystander) = (stepping(&host, demand), stepping(&host, 0.0));
            // the logger reads and sets while the panic is logged: refused already
            host.component.set(c);
            let mut d = 0.0;
            let status = match &words[..3] {
                "got" => fmi2::get_real::<P>(c, &Y, 1, &mut d),
                "set" => fmi2::set_real::<P>(c, &X, 1, &1.0),
                _ => fmi2::do_step::<P>(c, 0.0, 1.0, 1),
            };
            host.component.set(null_mut());
            assert_eq!(status, FATAL, "{}", words);
            {
                let lines = host.lines.borrow();
                assert_eq!((lines.len(), lines[0].0, lines[0].1.as_str()), (1, FATAL, "errors"));
                assert!(lines[0].2.contains(words), "{:?}", lines);
            }
            let inside = host.inside.borrow()[0];
            assert_eq!((inside.0, inside.1, inside.2.is_nan()), (FATAL, FATAL, true));
            for lost in [c, bystander] {
                for (name, status) in every(lost) {
                    assert_eq!(status, FATAL, "{}", name);
                }
                assert_eq!(refusing(lost), [FATAL; 4]);
            }
            assert_eq!(host.lines.borrow().len(), 1, "refused without a line");
            // one made afterwards is sound
            let fresh = stepping(&host, 0.0);
            assert_eq!(fmi2::do_step::<P>(fresh, 0.0, 1.0, 1), OK);
            for c in [c, bystander, fresh] {
                fmi2::free_instance::<P>(c);
            }
        }
    }
}

#[test]
fn a_panic_while_freeing_stays_inside() {
    let _turn = turn();
    let host = Host::default();
    unsafe {
        let c = stepping(&host, PANIC_IN_DROP);
        fmi2::free_instance::<Probe<0>>(c);
        let lines = host.lines.borrow();
        assert_eq!((lines.len(), lines[0].0), (1, FATAL));
        assert!(lines[0].2.contains("dropped"));
    }
}

#[test]
fn a_logger_may_call_the_instance_that_logs() {
    let _turn = turn();
    type P = Probe<0>;
    let host = Host::default();
    unsafe {
        let c = stepping(&host, REPORT_EVENT);
        host.component.set(c);
        let mut y = 0.0;
        // an event, a discard, an error: each time the logger reads y and sets x to y + 1
        assert_eq!(fmi2::do_step::<P>(c, 0.0, 0.5, 1), OK);
        assert_eq!(fmi2::set_real::<P>(c, &X, 1, &f64::NAN), DISCARD);
        assert_eq!(fmi2::do_step::<P>(c, 9.0, 0.5, 1), ERROR);
        host.component.set(null_mut());
        assert_eq!(fmi2::get_real::<P>(c, &Y, 1, &mut y), OK);
        assert_eq!(y, 14.0);
        assert_eq!(*host.inside.borrow(), [(OK, OK, 0.0), (OK, OK, 2.0), (OK, OK, 6.0)]);
        {
            let lines = host.lines.borrow();
            assert_eq!(lines[0], (OK, "events".into(), "something begins between 0 s and 0.5 s".into()));
            // a host that prints it as a format reads one %
            assert_eq!(lines[1], (DISCARD, "discards".into(), "x is 100 %% no number".into()));
            assert_eq!(lines[2].0, ERROR);
        }
        // events are for hosts that asked, discards and errors for all
        assert_eq!(fmi2::set_debug_logging::<P>(c, 0, 0, null()), OK);
        assert_eq!(fmi2::do_step::<P>(c, 0.5, 0.5, 1), OK);
        assert_eq!(fmi2::do_step::<P>(c, 9.0, 0.5, 1), ERROR);
        assert_eq!(host.lines.borrow().len(), 4);
        let events = CString::new("events").unwrap();
        assert_eq!(fmi2::set_debug_logging::<P>(c, 1, 1, [events.as_ptr()].as_ptr()), OK);
        assert_eq!(fmi2::do_step::<P>(c, 1.0, 0.5, 1), OK);
        assert_eq!(host.lines.borrow().len(), 5);
        fmi2::free_instance::<P>(c);
    }
}

#[test]
fn a_model_may_answer_at_once_what_it_likes_and_is_asked_the_long_way_else() {
    let _turn = turn();
    type P = Probe<0>;
    let host = Host::default();
    unsafe {
        let c = stepping(&host, ANSWER_AT_ONCE);
        let (mut x, mut y, both) = (0.0, 0.0, [X, Y]);
        assert_eq!(fmi2::set_real::<P>(c, &X, 1, &2.0), OK);
        assert_eq!(fmi2::get_real::<P>(c, &X, 1, &mut x), OK);
        assert_eq!(fmi2::get_real::<P>(c, &Y, 1, &mut y), OK);
        assert_eq!((x, y), (20.0, -20.0));
        let mut values = [0.0; 2];
        assert_eq!(fmi2::get_real::<P>(c, both.as_ptr(), 2, values.as_mut_ptr()), OK);
        assert_eq!(values, [20.0, 40.0]);
        assert_eq!(fmi2::set_real::<P>(c, &X, 1, &f64::NAN), DISCARD);
        assert_eq!(fmi2::set_real::<P>(c, null(), 0, null()), OK);
        assert_eq!(fmi2::get_real::<P>(c, null(), 0, null_mut()), OK);
        fmi2::free_instance::<P>(c);
    }
}

#[test]
fn input_derivatives_set_in_one_call_are_set_all_or_none() {
    let _turn = turn();
    type P = Probe<0>;
    let host = Host::default();
    unsafe {
        let c = stepping(&host, 0.0);
        assert_eq!(fmi2::set_real_input_derivatives::<P>(c, &X, 1, &1, &3.0), OK);
        let (references, orders) = ([X, X], [1, 2]);
        let set = |c, orders: [c_int; 2]| {
            fmi2::set_real_input_derivatives::<P>(c, references.as_ptr(), 2, orders.as_ptr(), [5.0, 7.0].as_ptr())
        };
        assert_eq!(set(c, orders), ERROR);
        let mut x = 0.0;
        assert_eq!(fmi2::get_real::<P>(c, &X, 1, &mut x), OK);
        assert_eq!(x, 3.0);
        assert_eq!(set(c, [1, 1]), OK);
        assert_eq!(fmi2::get_real::<P>(c, &X, 1, &mut x), OK);
        assert_eq!(x, 7.0);
        fmi2::free_instance::<P>(c);
    }
}

#[test]
fn no_number_that_is_not_finite_is_handed_out_with_ok() {
    let _turn = turn();
    type P = Probe<0>;
    let host = Host::default();
    unsafe {
        let c = stepping(&host, 0.0);
        assert_eq!(fmi2::set_real::<P>(c, &X, 1, &1e308), OK);
        let (mut out, both) = ([0.0; 2], [X, Y]);
        assert_eq!(fmi2::get_real::<P>(c, both.as_ptr(), 2, out.as_mut_ptr()), DISCARD);
        assert_eq!(fmi2::get_real_output_derivatives::<P>(c, &Y, 1, &1, &mut out[0]), DISCARD);
        for seed in [1e308, f64::NAN] {
            assert_eq!(fmi2::get_directional_derivative::<P>(c, &Y, 1, &X, 1, &seed, &mut out[0]), DISCARD);
        }
        assert!(out.iter().all(|v| v.is_finite()));
        assert_eq!(host.lines.borrow().len(), 4);
        assert!(host.lines.borrow()[0].2.contains("reference 1 is inf"), "{:?}", host.lines.borrow());
        fmi2::free_instance::<P>(c);
    }
}

#[test]
fn values_set_in_one_call_are_set_all_or_none() {
    let _turn = turn();
    type P = Probe<0>;
    let host = Host::default();
    unsafe {
        let c = stepping(&host, 0.0);
        assert_eq!(fmi2::set_real::<P>(c, &X, 1, &3.0), OK);
        let references: [c_uint; 2] = [X, Y];
        assert_eq!(fmi2::set_real::<P>(c, references.as_ptr(), 2, [5.0, 1.0].as_ptr()), ERROR);
        let mut x = 0.0;
        assert_eq!(fmi2::get_real::<P>(c, &X, 1, &mut x), OK);
        assert_eq!(x, 3.0);
        let state = &mut null_mut();
        assert_eq!(fmi2::get_fmu_state::<P>(c, state), OK);
        assert_eq!(fmi2::set_real::<P>(c, &X, 1, &4.0), OK);
        assert_eq!(fmi2::set_fmu_state::<P>(c, *state), OK);
        assert_eq!(fmi2::get_real::<P>(c, &X, 1, &mut x), OK);
        assert_eq!(x, 3.0);
        let (mut size, mut bytes) = (0, [0u8; LENGTH]);
        assert_eq!(fmi2::serialized_fmu_state_size::<P>(c, *state, &mut size), OK);
        assert_eq!(size, bytes.len());
        assert_eq!(fmi2::serialize_fmu_state::<P>(c, *state, bytes.as_mut_ptr(), size), OK);
        let read = &mut null_mut();
        assert_eq!(fmi2::set_real::<P>(c, &X, 1, &4.0), OK);
        assert_eq!(fmi2::de_serialize_fmu_state::<P>(c, bytes.as_ptr(), size, read), OK);
        assert_eq!(fmi2::set_fmu_state::<P>(c, *read), OK);
        assert_eq!(fmi2::get_real::<P>(c, &X, 1, &mut x), OK);
        assert_eq!(x, 3.0);
        for s in [state, read] {
            assert_eq!(fmi2::free_fmu_state::<P>(c, s), OK);
        }
        fmi2::free_instance::<P>(c);
    }
}
