//! The C names.

/// Exports the C functions of FMI 2.0 for co-simulation over a [`crate::Model`]: called once, in the library of the
/// model, at its root.
#[macro_export]
macro_rules! export {
    ($model:ty) => {
        /// The C functions of FMI 2.0 for co-simulation.
        #[allow(non_snake_case)]
        pub mod exported {
            use super::*;
            use std::os::raw::{c_char, c_int, c_uint, c_void};

            /// fmi2GetTypesPlatform.
            #[no_mangle]
            pub extern "C" fn fmi2GetTypesPlatform() -> *const c_char {
                $crate::fmi2::get_types_platform()
            }

            /// fmi2GetVersion.
            #[no_mangle]
            pub extern "C" fn fmi2GetVersion() -> *const c_char {
                $crate::fmi2::get_version()
            }

            $crate::forward! { $model;
                fmi2SetDebugLogging = set_debug_logging(c: *mut c_void, on: c_int, n: usize, categories: *const *const c_char) -> c_int;
                fmi2Instantiate = instantiate(
                    name: *const c_char, kind: c_int, guid: *const c_char, resources: *const c_char,
                    functions: *const $crate::fmi2::CallbackFunctions, visible: c_int, logging_on: c_int
                ) -> *mut c_void;
                fmi2FreeInstance = free_instance(c: *mut c_void) -> ();
                fmi2SetupExperiment = setup_experiment(
                    c: *mut c_void, tolerance_defined: c_int, tolerance: f64, start: f64, stop_defined: c_int, stop: f64
                ) -> c_int;
                fmi2EnterInitializationMode = enter_initialization_mode(c: *mut c_void) -> c_int;
                fmi2ExitInitializationMode = exit_initialization_mode(c: *mut c_void) -> c_int;
                fmi2Terminate = terminate(c: *mut c_void) -> c_int;
                fmi2Reset = reset(c: *mut c_void) -> c_int;
                fmi2GetReal = get_real(c: *mut c_void, vr: *const c_uint, n: usize, values: *mut f64) -> c_int;
                fmi2GetInteger = get_integer(c: *mut c_void, vr: *const c_uint, n: usize, values: *mut c_int) -> c_int;
                fmi2GetBoolean = get_boolean(c: *mut c_void, vr: *const c_uint, n: usize, values: *mut c_int) -> c_int;
                fmi2GetString = get_string(c: *mut c_void, vr: *const c_uint, n: usize, values: *mut *const c_char) -> c_int;
                fmi2SetReal = set_real(c: *mut c_void, vr: *const c_uint, n: usize, values: *const f64) -> c_int;
                fmi2SetInteger = set_integer(c: *mut c_void, vr: *const c_uint, n: usize, values: *const c_int) -> c_int;
                fmi2SetBoolean = set_boolean(c: *mut c_void, vr: *const c_uint, n: usize, values: *const c_int) -> c_int;
                fmi2SetString = set_string(c: *mut c_void, vr: *const c_uint, n: usize, values: *const *const c_char) -> c_int;
                fmi2GetFMUstate = get_fmu_state(c: *mut c_void, p: *mut *mut c_void) -> c_int;
                fmi2SetFMUstate = set_fmu_state(c: *mut c_void, p: *mut c_void) -> c_int;
                fmi2FreeFMUstate = free_fmu_state(c: *mut c_void, p: *mut *mut c_void) -> c_int;
                fmi2SerializedFMUstateSize = serialized_fmu_state_size(c: *mut c_void, p: *mut c_void, size: *mut usize) -> c_int;
                fmi2SerializeFMUstate = serialize_fmu_state(c: *mut c_void, p: *mut c_void, bytes: *mut u8, size: usize) -> c_int;
                fmi2DeSerializeFMUstate = de_serialize_fmu_state(
                    c: *mut c_void, bytes: *const u8, size: usize, p: *mut *mut c_void
                ) -> c_int;
                fmi2GetDirectionalDerivative = get_directional_derivative(
                    c: *mut c_void, unknown: *const c_uint, n_unknown: usize, known: *const c_uint, n_known: usize,
                    seed: *const f64, sensitivity: *mut f64
                ) -> c_int;
                fmi2SetRealInputDerivatives = set_real_input_derivatives(
                    c: *mut c_void, vr: *const c_uint, n: usize, order: *const c_int, values: *const f64
                ) -> c_int;
                fmi2GetRealOutputDerivatives = get_real_output_derivatives(
                    c: *mut c_void, vr: *const c_uint, n: usize, order: *const c_int, values: *mut f64
                ) -> c_int;
                fmi2DoStep = do_step(c: *mut c_void, time: f64, step: f64, no_set_state_before: c_int) -> c_int;
                fmi2CancelStep = cancel_step(c: *mut c_void) -> c_int;
                fmi2GetStatus = get_status(c: *mut c_void, kind: c_int, value: *mut c_int) -> c_int;
                fmi2GetRealStatus = get_real_status(c: *mut c_void, kind: c_int, value: *mut f64) -> c_int;
                fmi2GetIntegerStatus = get_integer_status(c: *mut c_void, kind: c_int, value: *mut c_int) -> c_int;
                fmi2GetBooleanStatus = get_boolean_status(c: *mut c_void, kind: c_int, value: *mut c_int) -> c_int;
                fmi2GetStringStatus = get_string_status(c: *mut c_void, kind: c_int, value: *mut *const c_char) -> c_int;
            }
        }
    };
}

/// A C function each, that calls the generic one.
#[doc(hidden)]
#[macro_export]
macro_rules! forward {
    ($model:ty; $($c_name:ident = $name:ident($($argument:ident: $kind:ty),*) -> $answer:ty;)*) => {
        $(
            #[doc = concat!(stringify!($c_name), ".\n\n# Safety\nAs [`face::fmi2::", stringify!($name), "`](::face::fmi2::", stringify!($name), ") says.")]
            #[no_mangle]
            pub unsafe extern "C" fn $c_name($($argument: $kind),*) -> $answer {
                $crate::fmi2::$name::<$model>($($argument),*)
            }
        )*
    };
}
