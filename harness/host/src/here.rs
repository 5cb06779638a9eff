//! One slave of an FMU in this process, on the raw binding of the crate `fmi`.
//!
//! The crate's own instance type panics on fmi2Pending, has no input or output derivatives and no logger of one's own,
//! and lets instances outlive the folder they were unpacked to; this one does not.

use super::arithmetic;
use super::error::Discarded;
use super::log::{step_finished, touchdown_host_logger, HandedOut, Log};
use super::missing;
use super::trouble::{judge, misuse, Answer, Trouble};
use fmi::fmi2::binding::{self, Fmi2Binding};
use fmi::fmi2::CallbackFunctions;
use std::ffi::{c_char, c_int, CStr, CString};
use std::path::Path;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Longest sleep between two looks at an asynchronous step.
const NAP: Duration = Duration::from_millis(1);

/// Calls a C function with the component first, and turns its status into a result.
macro_rules! call {
    ($self:ident, $f:ident $(, $a:expr)*) => {
        match &$self.binding.$f {
            // SAFETY: the component is alive until drop, pointers and lengths are of slices alive during the call
            Ok(f) => {
                let status = unsafe { f($self.component $(, $a)*) };
                arithmetic::restore();
                match status {
                    0 => Ok(()),
                    status => judge(status),
                }
            }
            Err(_) => Err(Box::new(Trouble::Missing)),
        }
    };
}

/// What an instance is made with.
#[derive(Clone, Debug, serde::Serialize, serde::Deserialize)]
pub(super) struct Making {
    /// Its name.
    pub(super) name: CString,
    /// GUID of the description.
    pub(super) guid: CString,
    /// URI of the resources.
    pub(super) resources: CString,
    /// Whether it is asked to log more than errors.
    pub(super) logging: bool,
    /// Whether its steps may answer fmi2Pending.
    pub(super) asynchronous: bool,
    /// How long such a step may take.
    pub(super) patience: Duration,
}

/// A slave of a binary loaded in this process. Freed when dropped, with its saved states, before its callbacks, its
/// log and the binary go.
pub(super) struct Here {
    component: binding::fmi2Component,
    states: Vec<binding::fmi2FMUstate>,
    asynchronous: bool,
    patience: Duration,
    /// Set where fmi2Fatal was answered: nothing may be called after it, freeing included.
    fatal: Arc<AtomicBool>,
    _callbacks: Rc<CallbackFunctions>,
    _handed_out: HandedOut,
    log: Arc<Log>,
    binding: Arc<Fmi2Binding>,
}

impl Drop for Here {
    fn drop(&mut self) {
        if self.fatal.load(Ordering::Relaxed) {
            return;
        }
        if let Ok(free) = &self.binding.fmi2FreeFMUstate {
            for s in &mut self.states {
                if !s.is_null() {
                    // SAFETY: handed out by this component, not freed yet
                    unsafe { free(self.component, s) };
                }
            }
        }
        if let Ok(free) = &self.binding.fmi2FreeInstance {
            // SAFETY: alive until here
            unsafe { free(self.component) };
        }
        arithmetic::restore();
    }
}

/// The text a function without arguments hands out.
fn answer(f: &Result<unsafe extern "C" fn() -> *const c_char, impl std::fmt::Display>) -> Option<String> {
    let f = f.as_ref().ok()?;
    // SAFETY: FMI 2.0 section 2.1.4: a terminated string, callable at any time
    let s = unsafe { f() };
    if s.is_null() {
        return None;
    }
    // SAFETY: not null, terminated
    Some(unsafe { CStr::from_ptr(s) }.to_string_lossy().into_owned())
}

/// Loads a binary into this process.
///
/// # Errors
/// It does not load, or speaks another version of FMI or other types.
pub(super) fn load(library: &Path) -> Result<Fmi2Binding, String> {
    // SAFETY: loading runs the binary's initializers; whoever loads it here trusts it to run in this process
    let binding = unsafe { Fmi2Binding::new(library) }.map_err(|e| {
        let why = with_cause(&e);
        format!("its binary does not load: {why}; {}", missing::cure(&why, library))
    })?;
    arithmetic::restore();
    if let Some(version) = answer(&binding.fmi2GetVersion).filter(|v| v != "2.0" && !v.starts_with("2.0.")) {
        return Err(format!("its description says FMI 2.0 and its binary FMI {version}; export it again"));
    }
    if let Some(types) = answer(&binding.fmi2GetTypesPlatform).filter(|t| t != "default") {
        return Err(format!("its binary is built for the types of platform {types}, this host has the default ones"));
    }
    Ok(binding)
}

fn with_cause(e: &dyn std::error::Error) -> String {
    let mut text = e.to_string();
    if let Some(cause) = e.source() {
        text += &format!(" ({cause})");
    }
    text
}

impl Here {
    /// Makes a slave; `fatal` is shared by the FMU's slaves.
    ///
    /// # Errors
    /// The binary has no fmi2Instantiate, or makes none; the log may say why.
    pub(super) fn new(
        binding: Arc<Fmi2Binding>,
        making: &Making,
        log: Arc<Log>,
        fatal: Arc<AtomicBool>,
    ) -> Result<Here, String> {
        let Ok(instantiate) = &binding.fmi2Instantiate else {
            return Err("its binary has no fmi2Instantiate; export it again".into());
        };
        let handed_out = HandedOut::new(&log, &making.name);
        let callbacks = Rc::new(CallbackFunctions {
            logger: Some(touchdown_host_logger),
            step_finished: Some(step_finished),
            component_environment: handed_out.environment(),
            ..CallbackFunctions::default()
        });
        log.begin();
        // SAFETY: the strings live during the call, callbacks and log as long as the instance; CallbackFunctions is
        // repr(C) with the fields of fmi2CallbackFunctions
        let component = unsafe {
            instantiate(
                making.name.as_ptr(),
                binding::fmi2Type_fmi2CoSimulation,
                making.guid.as_ptr(),
                making.resources.as_ptr(),
                Rc::as_ptr(&callbacks).cast(),
                0,
                c_int::from(making.logging),
            )
        };
        arithmetic::restore();
        if component.is_null() {
            return Err(format!(
                "fmi2Instantiate made no instance; the usual cause is a binary that does not belong to this description \
                 (GUID {}): export the FMU again",
                making.guid.to_string_lossy()
            ));
        }
        Ok(Here {
            component,
            states: Vec::new(),
            asynchronous: making.asynchronous,
            patience: making.patience,
            fatal,
            _callbacks: callbacks,
            _handed_out: handed_out,
            log,
            binding,
        })
    }

    /// Numbers the call that begins, for the log.
    pub(super) fn begin(&self) {
        self.log.begin();
    }

    /// Nothing ends a call in this process.
    #[allow(clippy::unused_self, clippy::unnecessary_wraps)]
    pub(super) fn hurry(&mut self, _: Duration) -> Answer {
        Ok(())
    }

    pub(super) fn set_patience(&mut self, patience: Duration) -> Answer {
        self.patience = patience;
        Ok(())
    }

    pub(super) fn set_debug_logging(&mut self, on: bool, categories: &[CString]) -> Answer {
        let pointers: Vec<_> = categories.iter().map(|s| s.as_ptr()).collect();
        call!(self, fmi2SetDebugLogging, c_int::from(on), pointers.len(), pointers.as_ptr())
    }

    pub(super) fn setup_experiment(&mut self, tolerance: Option<f64>, start: f64, stop: Option<f64>) -> Answer {
        let (tol, end) = (tolerance.unwrap_or(0.0), stop.unwrap_or(0.0));
        let (has_tol, has_end) = (c_int::from(tolerance.is_some()), c_int::from(stop.is_some()));
        call!(self, fmi2SetupExperiment, has_tol, tol, start, has_end, end)
    }

    pub(super) fn enter_initialization(&mut self) -> Answer {
        call!(self, fmi2EnterInitializationMode)
    }

    pub(super) fn exit_initialization(&mut self) -> Answer {
        call!(self, fmi2ExitInitializationMode)
    }

    pub(super) fn cancel_step(&mut self) -> Answer {
        call!(self, fmi2CancelStep)
    }

    pub(super) fn terminate(&mut self) -> Answer {
        call!(self, fmi2Terminate)
    }

    pub(super) fn reset(&mut self) -> Answer {
        call!(self, fmi2Reset)
    }

    #[inline]
    pub(super) fn set_real(&mut self, references: &[u32], values: &[f64]) -> Answer {
        call!(self, fmi2SetReal, references.as_ptr(), references.len(), values.as_ptr())
    }

    #[inline]
    pub(super) fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Answer {
        call!(self, fmi2GetReal, references.as_ptr(), references.len(), values.as_mut_ptr())
    }

    pub(super) fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Answer {
        call!(self, fmi2SetInteger, references.as_ptr(), references.len(), values.as_ptr())
    }

    pub(super) fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Answer {
        call!(self, fmi2GetInteger, references.as_ptr(), references.len(), values.as_mut_ptr())
    }

    pub(super) fn set_boolean(&mut self, references: &[u32], values: &[c_int]) -> Answer {
        call!(self, fmi2SetBoolean, references.as_ptr(), references.len(), values.as_ptr())
    }

    pub(super) fn get_boolean(&mut self, references: &[u32], values: &mut [c_int]) -> Answer {
        call!(self, fmi2GetBoolean, references.as_ptr(), references.len(), values.as_mut_ptr())
    }

    pub(super) fn set_string(&mut self, references: &[u32], values: &[CString]) -> Answer {
        let pointers: Vec<_> = values.iter().map(|s| s.as_ptr()).collect();
        call!(self, fmi2SetString, references.as_ptr(), references.len(), pointers.as_ptr())
    }

    pub(super) fn get_string(&mut self, references: &[u32]) -> Result<Vec<String>, Box<Trouble>> {
        let mut pointers = vec![std::ptr::null(); references.len()];
        call!(self, fmi2GetString, references.as_ptr(), references.len(), pointers.as_mut_ptr())?;
        let copy = |p: *const c_char| {
            if p.is_null() {
                return String::new();
            }
            // SAFETY: FMI 2.0 section 2.1.7: a terminated string, good until the next call
            unsafe { CStr::from_ptr(p) }.to_string_lossy().into_owned()
        };
        Ok(pointers.into_iter().map(copy).collect())
    }

    pub(super) fn set_real_input_derivatives(&mut self, references: &[u32], orders: &[i32], values: &[f64]) -> Answer {
        let n = references.len();
        call!(self, fmi2SetRealInputDerivatives, references.as_ptr(), n, orders.as_ptr(), values.as_ptr())
    }

    pub(super) fn get_real_output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &mut [f64],
    ) -> Answer {
        let n = references.len();
        call!(self, fmi2GetRealOutputDerivatives, references.as_ptr(), n, orders.as_ptr(), values.as_mut_ptr())
    }

    pub(super) fn get_directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        direction: &[f64],
        answer: &mut [f64],
    ) -> Answer {
        call!(
            self,
            fmi2GetDirectionalDerivative,
            unknowns.as_ptr(),
            unknowns.len(),
            knowns.as_ptr(),
            knowns.len(),
            direction.as_ptr(),
            answer.as_mut_ptr()
        )
    }

    #[inline]
    pub(super) fn do_step(&mut self, time: f64, step: f64, never_back: bool) -> Answer {
        let Ok(f) = &self.binding.fmi2DoStep else { return Err(Box::new(Trouble::Missing)) };
        if self.asynchronous {
            self.log.forget_finished();
        }
        // SAFETY: the component is alive
        let status = unsafe { f(self.component, time, step, c_int::from(never_back)) };
        arithmetic::restore();
        if status == binding::fmi2Status_fmi2OK {
            return Ok(());
        }
        self.step_not_ok(status)
    }

    #[cold]
    fn step_not_ok(&mut self, mut status: u32) -> Answer {
        if status == binding::fmi2Status_fmi2Pending {
            let waited = self.wait();
            arithmetic::restore();
            status = waited?;
        }
        if status != binding::fmi2Status_fmi2Discard {
            return judge(status);
        }
        let (mut time, mut end) = (0.0, 0);
        let b = &self.binding;
        // SAFETY: the component is alive, the pointers are to locals
        let (timed, ended) = unsafe {
            (
                b.fmi2GetRealStatus
                    .as_ref()
                    .is_ok_and(|f| f(self.component, binding::fmi2StatusKind_fmi2LastSuccessfulTime, &mut time) == 0),
                b.fmi2GetBooleanStatus
                    .as_ref()
                    .is_ok_and(|f| f(self.component, binding::fmi2StatusKind_fmi2Terminated, &mut end) == 0),
            )
        };
        arithmetic::restore();
        let discarded = Discarded { last_successful_time: timed.then_some(time), terminated: ended && end != 0 };
        Err(Box::new(Trouble::Answered { status, detail: String::new(), discarded: Some(discarded) }))
    }

    /// Waits for an asynchronous step: the FMU rings stepFinished or answers fmi2GetStatus. Its status.
    fn wait(&mut self) -> Result<u32, Box<Trouble>> {
        let until = Instant::now() + self.patience;
        loop {
            let rung = self.log.wait_finished(NAP);
            let mut status = 0;
            if let Ok(f) = &self.binding.fmi2GetStatus {
                // SAFETY: the component is alive, the pointer is to a local
                let answer = unsafe { f(self.component, binding::fmi2StatusKind_fmi2DoStepStatus, &mut status) };
                if answer <= 1 && status != binding::fmi2Status_fmi2Pending {
                    return Ok(status);
                }
            }
            if let Some(status) = rung.filter(|&s| s != binding::fmi2Status_fmi2Pending) {
                return Ok(status);
            }
            if Instant::now() >= until {
                let cancelled = self.binding.fmi2CancelStep.as_ref().is_ok_and(|f| {
                    // SAFETY: the component is alive
                    unsafe { f(self.component) == 0 }
                });
                let end = if cancelled { "it was cancelled" } else { "it could not be cancelled" };
                let detail = format!("the step was not done after {} s, {end}", self.patience.as_secs_f64());
                let status = binding::fmi2Status_fmi2Pending;
                return Err(Box::new(Trouble::Answered { status, detail, discarded: None }));
            }
        }
    }

    /// The state of a slot; null where none was saved.
    fn slot(&mut self, slot: usize) -> &mut binding::fmi2FMUstate {
        if self.states.len() <= slot {
            self.states.resize(slot + 1, std::ptr::null_mut());
        }
        &mut self.states[slot]
    }

    /// Saves the state in a slot, over what was there.
    pub(super) fn get_state(&mut self, slot: usize) -> Answer {
        let mut raw = *self.slot(slot);
        let done = call!(self, fmi2GetFMUstate, &mut raw);
        // the FMU may have replaced it whatever it answered
        *self.slot(slot) = raw;
        self.handed_out(slot, done)
    }

    fn handed_out(&mut self, slot: usize, done: Answer) -> Answer {
        done?;
        if self.slot(slot).is_null() {
            return Err(misuse("the FMU answered fmi2OK and handed out no state"));
        }
        Ok(())
    }

    pub(super) fn set_state(&mut self, slot: usize) -> Answer {
        let raw = *self.slot(slot);
        call!(self, fmi2SetFMUstate, raw)
    }

    pub(super) fn free_state(&mut self, slot: usize) -> Answer {
        let mut raw = std::mem::replace(self.slot(slot), std::ptr::null_mut());
        call!(self, fmi2FreeFMUstate, &mut raw)
    }

    pub(super) fn serialize(&mut self, slot: usize) -> Result<Vec<u8>, Box<Trouble>> {
        let raw = *self.slot(slot);
        let mut size = 0;
        call!(self, fmi2SerializedFMUstateSize, raw, &mut size)?;
        let mut bytes = Vec::new();
        if bytes.try_reserve_exact(size).is_err() {
            return Err(misuse(format!("a state of {size} bytes, more than there is memory")));
        }
        bytes.resize(size, 0u8);
        call!(self, fmi2SerializeFMUstate, raw, bytes.as_mut_ptr().cast::<c_char>(), size)?;
        Ok(bytes)
    }

    pub(super) fn deserialize(&mut self, slot: usize, bytes: &[u8]) -> Answer {
        let mut raw = *self.slot(slot);
        let done = call!(self, fmi2DeSerializeFMUstate, bytes.as_ptr().cast::<c_char>(), bytes.len(), &mut raw);
        *self.slot(slot) = raw;
        self.handed_out(slot, done)
    }
}
