//! One slave of an FMU, on the raw binding of the crate `fmi`.
//!
//! The crate's own instance type panics on fmi2Pending, has no input or output derivatives and no logger of one's own,
//! and lets instances outlive the folder they were unpacked to; this one does not.

use super::error::{CallError, Discarded, HostError};
use super::fmu::Fmu;
use super::log::{step_finished, touchdown_host_logger, Log, LogLine};
use super::status::Status;
use fmi::fmi2::binding;
use fmi::fmi2::CallbackFunctions;
use std::ffi::{c_int, c_void, CStr, CString};
use std::rc::Rc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How long an asynchronous step may take where nothing else is said.
const PATIENCE: Duration = Duration::from_secs(60);
/// Longest sleep between two looks at an asynchronous step.
const NAP: Duration = Duration::from_millis(1);

static IDS: AtomicU64 = AtomicU64::new(0);

/// Calls a C function with the component first, and turns its status into a result.
macro_rules! call {
    ($self:ident, $f:ident $(, $a:expr)*) => {{
        if $self.is_dead() {
            Err($self.misuse("an instance of this FMU answered fmi2Fatal: none may be called any more, start again"))
        } else {
            $self.log.begin();
            match &$self.fmu.loaded().binding.$f {
                // SAFETY: the component is alive until drop, pointers and lengths are of slices alive during the call
                Ok(f) => {
                    let status = unsafe { f($self.component $(, $a)*) };
                    if status == 0 { Ok(()) } else { $self.judge(stringify!($f), status) }
                }
                Err(_) => Err($self.missing(stringify!($f))),
            }
        }
    }};
}
pub(super) use call;

/// A co-simulation slave. Freed when dropped, with its saved states, before its callbacks, its log and the FMU's
/// folder go. Not `Send`: FMI 2.0 promises nothing about an instance that changes threads; make one in each thread.
pub struct Instance {
    pub(super) component: binding::fmi2Component,
    pub(super) states: Vec<binding::fmi2FMUstate>,
    pub(super) free_slots: Vec<usize>,
    pub(super) id: u64,
    name: String,
    patience: Duration,
    _callbacks: Rc<CallbackFunctions>,
    pub(super) log: Arc<Log>,
    pub(super) fmu: Fmu,
}

impl std::fmt::Debug for Instance {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Instance({})", self.name)
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        let loaded = self.fmu.loaded();
        loaded.alive.fetch_sub(1, Ordering::Relaxed);
        // after fmi2Fatal nothing may be called, freeing included
        if self.is_dead() {
            return;
        }
        if let Ok(free) = &loaded.binding.fmi2FreeFMUstate {
            for s in &mut self.states {
                if !s.is_null() {
                    // SAFETY: handed out by this component, not freed yet
                    unsafe { free(self.component, s) };
                }
            }
        }
        if let Ok(free) = &loaded.binding.fmi2FreeInstance {
            // SAFETY: alive until here
            unsafe { free(self.component) };
        }
    }
}

impl Fmu {
    /// Makes a slave called `name`, without a window; `logging`: whether it is asked to log more than errors.
    ///
    /// # Errors
    /// Where the FMU makes none (a GUID that does not match its binary is the usual cause), allows one instance only,
    /// or lacks fmi2Instantiate; with what it logged.
    pub fn instantiate(&self, name: &str, logging: bool) -> Result<Instance, HostError> {
        Instance::new(self, name, logging)
    }
}

impl Instance {
    fn new(fmu: &Fmu, name: &str, logging: bool) -> Result<Instance, HostError> {
        let refuse = |why: String| HostError::Use { instance: name.to_string(), why };
        let loaded = fmu.loaded();
        if loaded.fatal.load(Ordering::Relaxed) {
            return Err(refuse("an instance of this FMU answered fmi2Fatal: none may be made any more".into()));
        }
        if loaded.alive.fetch_add(1, Ordering::Relaxed) > 0
            && loaded.capabilities.can_be_instantiated_only_once_per_process
        {
            loaded.alive.fetch_sub(1, Ordering::Relaxed);
            return Err(refuse("this FMU allows one instance in a process, and there is one; drop it first".into()));
        }
        let made = Instance::make(fmu, name, logging);
        if made.is_err() {
            loaded.alive.fetch_sub(1, Ordering::Relaxed);
        }
        made.map_err(refuse)
    }

    fn make(fmu: &Fmu, name: &str, logging: bool) -> Result<Instance, String> {
        let loaded = fmu.loaded();
        let c_name = CString::new(name).map_err(|_| "the name holds a zero byte".to_string())?;
        let Ok(instantiate) = &loaded.binding.fmi2Instantiate else {
            return Err("its binary has no fmi2Instantiate; export it again".into());
        };
        let log = Arc::new(Log::new());
        let callbacks = Rc::new(CallbackFunctions {
            logger: Some(touchdown_host_logger),
            step_finished: Some(step_finished),
            component_environment: Arc::as_ptr(&log).cast_mut().cast::<c_void>(),
            ..CallbackFunctions::default()
        });
        log.begin();
        // SAFETY: the strings live during the call, callbacks and log as long as the instance; CallbackFunctions is
        // repr(C) with the fields of fmi2CallbackFunctions
        let component = unsafe {
            instantiate(
                c_name.as_ptr(),
                binding::fmi2Type_fmi2CoSimulation,
                loaded.guid.as_ptr(),
                loaded.resources.as_ptr(),
                Rc::as_ptr(&callbacks).cast(),
                0,
                c_int::from(logging),
            )
        };
        if component.is_null() {
            let lines: Vec<String> = log.all().into_iter().map(|l| format!("\"{}\"", l.message)).collect();
            let said =
                if lines.is_empty() { "it logged nothing".into() } else { format!("it logged {}", lines.join(", ")) };
            return Err(format!(
                "fmi2Instantiate made no instance; {said}; the usual cause is a binary that does not belong to this \
                 description (GUID {}): export the FMU again",
                loaded.description.guid
            ));
        }
        Ok(Instance {
            component,
            states: Vec::new(),
            free_slots: Vec::new(),
            id: IDS.fetch_add(1, Ordering::Relaxed),
            name: name.to_string(),
            patience: PATIENCE,
            _callbacks: callbacks,
            log,
            fmu: fmu.clone(),
        })
    }

    /// The FMU it is of.
    pub fn fmu(&self) -> &Fmu {
        &self.fmu
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What it has logged so far, the last thousand lines.
    pub fn log(&self) -> Vec<LogLine> {
        self.log.all()
    }

    /// How long an asynchronous step may take, 60 s unless set; then it is cancelled and an error.
    pub fn set_patience(&mut self, patience: Duration) {
        self.patience = patience;
    }

    #[inline]
    pub(super) fn is_dead(&self) -> bool {
        self.fmu.loaded().fatal.load(Ordering::Relaxed)
    }

    #[cold]
    pub(super) fn misuse(&self, why: impl Into<String>) -> HostError {
        HostError::Use { instance: self.name.clone(), why: why.into() }
    }

    #[cold]
    pub(super) fn missing(&self, function: &str) -> HostError {
        self.misuse(format!("its binary has no {function}, which FMI 2.0 requires; export it again"))
    }

    /// The error of a call that answered anything but fmi2OK; warnings stay in the log.
    #[cold]
    pub(super) fn judge(&self, function: &'static str, status: u32) -> Result<(), HostError> {
        match Status::from(status) {
            Status::Ok | Status::Warning => return Ok(()),
            Status::Fatal => self.fmu.loaded().fatal.store(true, Ordering::Relaxed),
            _ => {}
        }
        Err(self.failed(function, status, String::new(), None))
    }

    fn failed(&self, function: &'static str, status: u32, detail: String, discarded: Option<Discarded>) -> HostError {
        HostError::Call(Box::new(CallError {
            instance: self.name.clone(),
            function,
            status: Status::from(status),
            detail,
            log: self.log.of_call(),
            discarded,
        }))
    }

    #[inline]
    fn same_length(&self, references: usize, values: usize) -> Result<(), HostError> {
        if references == values {
            return Ok(());
        }
        Err(self.misuse(format!("{references} value references and {values} values; give one value each")))
    }

    /// Switches logging on or off, for the categories given or for all.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn set_debug_logging(&mut self, on: bool, categories: &[&str]) -> Result<(), HostError> {
        let names = self.c_strings(categories)?;
        let pointers: Vec<_> = names.iter().map(|s| s.as_ptr()).collect();
        call!(self, fmi2SetDebugLogging, c_int::from(on), pointers.len(), pointers.as_ptr())
    }

    /// Tells start, stop and tolerance of the simulation; times in s.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn setup_experiment(&mut self, tolerance: Option<f64>, start: f64, stop: Option<f64>) -> Result<(), HostError> {
        let (tol, end) = (tolerance.unwrap_or(0.0), stop.unwrap_or(0.0));
        let (has_tol, has_end) = (c_int::from(tolerance.is_some()), c_int::from(stop.is_some()));
        call!(self, fmi2SetupExperiment, has_tol, tol, start, has_end, end)
    }

    /// Begins initialization.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn enter_initialization(&mut self) -> Result<(), HostError> {
        call!(self, fmi2EnterInitializationMode)
    }

    /// Ends initialization; steps may follow.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn exit_initialization(&mut self) -> Result<(), HostError> {
        call!(self, fmi2ExitInitializationMode)
    }

    /// Sets Reals, a value for each reference, in the variables' units.
    ///
    /// # Errors
    /// Where lengths differ or the FMU refuses.
    #[inline]
    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Result<(), HostError> {
        self.same_length(references.len(), values.len())?;
        call!(self, fmi2SetReal, references.as_ptr(), references.len(), values.as_ptr())
    }

    /// Reads Reals into `values`, in the variables' units.
    ///
    /// # Errors
    /// Where lengths differ or the FMU refuses.
    #[inline]
    pub fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), HostError> {
        self.same_length(references.len(), values.len())?;
        call!(self, fmi2GetReal, references.as_ptr(), references.len(), values.as_mut_ptr())
    }

    /// Reads one Real.
    ///
    /// # Errors
    /// Where the FMU refuses.
    #[inline]
    pub fn real(&mut self, reference: u32) -> Result<f64, HostError> {
        let mut value = [0.0];
        self.get_real(&[reference], &mut value)?;
        Ok(value[0])
    }

    /// Sets Integers and Enumerations.
    ///
    /// # Errors
    /// Where lengths differ or the FMU refuses.
    pub fn set_integer(&mut self, references: &[u32], values: &[i32]) -> Result<(), HostError> {
        self.same_length(references.len(), values.len())?;
        call!(self, fmi2SetInteger, references.as_ptr(), references.len(), values.as_ptr())
    }

    /// Reads Integers and Enumerations.
    ///
    /// # Errors
    /// Where lengths differ or the FMU refuses.
    pub fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), HostError> {
        self.same_length(references.len(), values.len())?;
        call!(self, fmi2GetInteger, references.as_ptr(), references.len(), values.as_mut_ptr())
    }

    /// Sets Booleans.
    ///
    /// # Errors
    /// Where lengths differ or the FMU refuses.
    pub fn set_boolean(&mut self, references: &[u32], values: &[bool]) -> Result<(), HostError> {
        self.same_length(references.len(), values.len())?;
        let values: Vec<c_int> = values.iter().map(|&b| c_int::from(b)).collect();
        call!(self, fmi2SetBoolean, references.as_ptr(), references.len(), values.as_ptr())
    }

    /// Reads Booleans.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn get_boolean(&mut self, references: &[u32]) -> Result<Vec<bool>, HostError> {
        let mut values: Vec<c_int> = vec![0; references.len()];
        call!(self, fmi2GetBoolean, references.as_ptr(), references.len(), values.as_mut_ptr())?;
        Ok(values.into_iter().map(|b| b != 0).collect())
    }

    /// Sets Strings.
    ///
    /// # Errors
    /// Where lengths differ, a text holds a zero byte or the FMU refuses.
    pub fn set_string(&mut self, references: &[u32], values: &[&str]) -> Result<(), HostError> {
        self.same_length(references.len(), values.len())?;
        let texts = self.c_strings(values)?;
        let pointers: Vec<_> = texts.iter().map(|s| s.as_ptr()).collect();
        call!(self, fmi2SetString, references.as_ptr(), references.len(), pointers.as_ptr())
    }

    /// Reads Strings, copied at once; what is not UTF-8 is replaced.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn get_string(&mut self, references: &[u32]) -> Result<Vec<String>, HostError> {
        let mut pointers = vec![std::ptr::null(); references.len()];
        call!(self, fmi2GetString, references.as_ptr(), references.len(), pointers.as_mut_ptr())?;
        let copy = |p: *const std::ffi::c_char| {
            if p.is_null() {
                return String::new();
            }
            // SAFETY: FMI 2.0 section 2.1.7: a terminated string, good until the next call
            unsafe { CStr::from_ptr(p) }.to_string_lossy().into_owned()
        };
        Ok(pointers.into_iter().map(copy).collect())
    }

    fn c_strings(&self, texts: &[&str]) -> Result<Vec<CString>, HostError> {
        let turn = |t: &&str| CString::new(*t).map_err(|_| self.misuse(format!("{t:?} holds a zero byte")));
        texts.iter().map(turn).collect()
    }

    /// Sets time derivatives of Real inputs for the next step; orders from 1 on.
    ///
    /// # Errors
    /// Where the FMU declares no canInterpolateInputs, lengths differ or it refuses.
    pub fn set_real_input_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &[f64],
    ) -> Result<(), HostError> {
        if !self.fmu.capabilities().can_interpolate_inputs {
            return Err(self.misuse("this FMU declares no canInterpolateInputs, so inputs have no derivatives"));
        }
        self.same_length(references.len(), orders.len())?;
        self.same_length(references.len(), values.len())?;
        call!(
            self,
            fmi2SetRealInputDerivatives,
            references.as_ptr(),
            references.len(),
            orders.as_ptr(),
            values.as_ptr()
        )
    }

    /// Reads time derivatives of Real outputs; orders from 1 to maxOutputDerivativeOrder.
    ///
    /// # Errors
    /// Where an order is beyond that, lengths differ or the FMU refuses.
    pub fn get_real_output_derivatives(
        &mut self,
        references: &[u32],
        orders: &[i32],
        values: &mut [f64],
    ) -> Result<(), HostError> {
        let most = self.fmu.capabilities().max_output_derivative_order;
        if let Some(n) = orders.iter().find(|&&n| n < 1 || n as u32 > most) {
            return Err(self.misuse(format!("order {n} of an output derivative; this FMU has orders from 1 to {most}")));
        }
        self.same_length(references.len(), orders.len())?;
        self.same_length(references.len(), values.len())?;
        call!(
            self,
            fmi2GetRealOutputDerivatives,
            references.as_ptr(),
            references.len(),
            orders.as_ptr(),
            values.as_mut_ptr()
        )
    }

    /// The derivative of each of `unknowns` along `direction` in `knowns`, into `answer`.
    ///
    /// # Errors
    /// Where the FMU declares no providesDirectionalDerivative, lengths differ or it refuses.
    pub fn get_directional_derivative(
        &mut self,
        unknowns: &[u32],
        knowns: &[u32],
        direction: &[f64],
        answer: &mut [f64],
    ) -> Result<(), HostError> {
        if !self.fmu.capabilities().provides_directional_derivative {
            return Err(self.misuse("this FMU declares no providesDirectionalDerivative; take differences"));
        }
        self.same_length(knowns.len(), direction.len())?;
        self.same_length(unknowns.len(), answer.len())?;
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

    /// Steps from `time` s over `step` s, > 0, and waits where the FMU steps asynchronously.
    ///
    /// # Errors
    /// Where the step is not done: with [`Discarded`] where it was discarded, with status fmi2Pending where it
    /// lasted longer than the patience and was cancelled.
    #[inline]
    pub fn do_step(&mut self, time: f64, step: f64) -> Result<(), HostError> {
        if self.is_dead() {
            return Err(self.misuse("an instance of this FMU answered fmi2Fatal: none may be called any more"));
        }
        self.log.begin();
        let Ok(f) = &self.fmu.loaded().binding.fmi2DoStep else { return Err(self.missing("fmi2DoStep")) };
        let never_back = c_int::from(!self.holds_states());
        if self.fmu.capabilities().can_run_asynchronuously {
            self.log.forget_finished();
        }
        // SAFETY: the component is alive
        let status = unsafe { f(self.component, time, step, never_back) };
        if status == binding::fmi2Status_fmi2OK {
            return Ok(());
        }
        self.step_not_ok(status)
    }

    #[cold]
    fn step_not_ok(&mut self, mut status: u32) -> Result<(), HostError> {
        if status == binding::fmi2Status_fmi2Pending {
            status = self.wait()?;
        }
        if status != binding::fmi2Status_fmi2Discard {
            return self.judge("fmi2DoStep", status);
        }
        let (mut time, mut end) = (0.0, 0);
        let b = &self.fmu.loaded().binding;
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
        let discarded = Discarded { last_successful_time: timed.then_some(time), terminated: ended && end != 0 };
        Err(self.failed("fmi2DoStep", status, String::new(), Some(discarded)))
    }

    /// Waits for an asynchronous step: the FMU rings stepFinished or answers fmi2GetStatus. Its status.
    fn wait(&mut self) -> Result<u32, HostError> {
        let until = Instant::now() + self.patience;
        loop {
            let rung = self.log.wait_finished(NAP);
            let mut status = 0;
            if let Ok(f) = &self.fmu.loaded().binding.fmi2GetStatus {
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
                let cancelled = self.fmu.loaded().binding.fmi2CancelStep.as_ref().is_ok_and(|f| {
                    // SAFETY: the component is alive
                    unsafe { f(self.component) == 0 }
                });
                let end = if cancelled { "it was cancelled" } else { "it could not be cancelled" };
                let detail = format!("the step was not done after {} s, {end}", self.patience.as_secs_f64());
                return Err(self.failed("fmi2DoStep", binding::fmi2Status_fmi2Pending, detail, None));
            }
        }
    }

    /// Gives up an asynchronous step. The instance can then only be reset or dropped.
    ///
    /// # Errors
    /// Where there is none, or the FMU refuses.
    pub fn cancel_step(&mut self) -> Result<(), HostError> {
        call!(self, fmi2CancelStep)
    }

    /// Ends the simulation; values can still be read.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn terminate(&mut self) -> Result<(), HostError> {
        call!(self, fmi2Terminate)
    }

    /// Back to as made: every value at its start, saved states kept.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn reset(&mut self) -> Result<(), HostError> {
        call!(self, fmi2Reset)
    }
}
