//! The element in a host that has no memory left: every request for memory of a run is refused once, alone and with all that
//! come after it. No call may end the process; an instance or a state that could not be made is refused, and whatever was made
//! goes on.

use face::fmi2::{self, CallbackFunctions, Logger, Status, ERROR, OK};
use face::Model;
use hysteresis_contact::instance::Instance;
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::ffi::CStr;
use std::os::raw::{c_char, c_void};
use std::ptr::{null, null_mut};
use std::thread::LocalKey;

/// The system's memory, but for requests that are to be refused.
struct Refusing;

thread_local! {
    /// Requests until one is refused; negative: none is.
    static UNTIL: Cell<i64> = const { Cell::new(-1) };
    /// Whether those after it are refused as well.
    static ALL: Cell<bool> = const { Cell::new(false) };
    static REFUSED: Cell<u32> = const { Cell::new(0) };
    static LOGGED: Cell<u32> = const { Cell::new(0) };
}

fn set<T>(cell: &'static LocalKey<Cell<T>>, value: T) {
    cell.with(|c| c.set(value));
}

// SAFETY: what is not refused is the system allocator's
unsafe impl GlobalAlloc for Refusing {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let left = UNTIL.with(Cell::get);
        if left > 0 {
            set(&UNTIL, left - 1);
        } else if left == 0 {
            set(&UNTIL, if ALL.with(Cell::get) { 0 } else { -1 });
            set(&REFUSED, REFUSED.with(Cell::get) + 1);
            return null_mut();
        }
        System.alloc(layout)
    }

    unsafe fn dealloc(&self, p: *mut u8, layout: Layout) {
        System.dealloc(p, layout);
    }
}

#[global_allocator]
static MEMORY: Refusing = Refusing;

unsafe extern "C" fn log(
    _: *mut c_void,
    name: *const c_char,
    _: Status,
    category: *const c_char,
    message: *const c_char,
) {
    for s in [name, category, message] {
        assert!(CStr::from_ptr(s).to_bytes().len() < 1000);
    }
    set(&LOGGED, LOGGED.with(Cell::get) + 1);
}

/// A host's run: an instance, calls that are right and calls that are refused, a state kept, given as bytes and taken back.
/// Whether an instance and both states could be made, and the force at the end.
fn run(guid: &[u8], inputs: [u32; 2], output: u32) -> (bool, bool, f64) {
    type M = Instance;
    // SAFETY: on the platforms of these tests a function of five pointers can be called as one of five and more
    let logger: Logger = unsafe { std::mem::transmute::<*const (), Logger>(log as *const ()) };
    let functions = CallbackFunctions {
        logger,
        allocate_memory: None,
        free_memory: None,
        step_finished: None,
        component_environment: null_mut(),
    };
    // SAFETY: strings that end with 0, arrays of the length passed, a component that is freed last
    unsafe {
        let c = fmi2::instantiate::<M>(b"element\0".as_ptr().cast(), 1, guid.as_ptr().cast(), null(), &functions, 0, 1);
        if c.is_null() {
            return (false, false, f64::NAN);
        }
        assert_eq!(fmi2::setup_experiment::<M>(c, 0, 0.0, 0.0, 0, 0.0), OK);
        assert_eq!(fmi2::enter_initialization_mode::<M>(c), OK);
        assert_eq!(fmi2::exit_initialization_mode::<M>(c), OK);
        // refused, with a word for the log
        assert_eq!(fmi2::set_real::<M>(c, [987_654].as_ptr(), 1, [1.0].as_ptr()), ERROR);
        assert_eq!(fmi2::do_step::<M>(c, 5.0, -1.0, 0), ERROR);
        let (mut kept, mut again, mut size) = (null_mut(), null_mut(), 0);
        let mut whole = fmi2::get_fmu_state::<M>(c, &mut kept) == OK;
        assert_eq!(whole, !kept.is_null());
        if whole {
            assert_eq!(fmi2::serialized_fmu_state_size::<M>(c, kept, &mut size), OK);
            let mut bytes = [0u8; 4096];
            assert_eq!(fmi2::serialize_fmu_state::<M>(c, kept, bytes.as_mut_ptr(), size), OK);
            whole = fmi2::de_serialize_fmu_state::<M>(c, bytes.as_ptr(), size, &mut again) == OK;
            assert_eq!(whole, !again.is_null());
            assert_eq!(fmi2::set_fmu_state::<M>(c, kept), OK);
        }
        for p in [&mut kept, &mut again] {
            assert_eq!(fmi2::free_fmu_state::<M>(c, p), OK);
        }
        let mut force = f64::NAN;
        assert_eq!(fmi2::set_real::<M>(c, inputs.as_ptr(), 2, [1e-4, 0.1].as_ptr()), OK);
        assert_eq!(fmi2::do_step::<M>(c, 0.0, 1e-5, 0), OK);
        assert_eq!(fmi2::get_real::<M>(c, [output].as_ptr(), 1, &mut force), OK);
        fmi2::free_instance::<M>(c);
        (true, whole, force)
    }
}

#[test]
fn no_memory_ends_no_host() {
    let mut guid = Instance::guid().to_vec();
    guid.push(0);
    let of = |name: &str| hysteresis_contact::variables::all().find(|v| v.name == name).unwrap().reference;
    let (inputs, force_of) = ([of("penetration"), of("velocity")], of("force"));
    let (made, whole, force) = run(&guid, inputs, force_of);
    assert!(made && whole && force > 0.0);
    for all in [false, true] {
        let (mut requests, mut no_instance, mut no_state) = (0, 0, 0);
        loop {
            set(&REFUSED, 0);
            set(&LOGGED, 0);
            set(&ALL, all);
            set(&UNTIL, requests);
            let (made, whole, same) = run(&guid, inputs, force_of);
            set(&UNTIL, -1);
            if REFUSED.with(Cell::get) == 0 {
                break;
            }
            requests += 1;
            no_instance += i32::from(!made);
            no_state += i32::from(made && !whole);
            assert!(LOGGED.with(Cell::get) > 0, "request {requests}: nothing was logged");
            assert!(!made || same == force, "request {requests}: {same} N in the place of {force} N");
        }
        assert!(requests > 10 && no_instance >= 3 && no_state >= 2, "{requests} {no_instance} {no_state}");
    }
}
