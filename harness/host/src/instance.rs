//! One slave of an FMU, in this process or in one of its own.

use super::apart::{Apart, NotMade};
use super::error::{CallError, Discarded, HostError};
use super::fmu::Fmu;
use super::here::{Here, Making};
use super::log::{Log, LogLine};
use super::status::Status;
use super::trouble::Trouble;
use std::ffi::{c_int, CString};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::Arc;
use std::time::Duration;

/// How long an asynchronous step may take where nothing else is said.
const PATIENCE: Duration = Duration::from_secs(60);

static IDS: AtomicU64 = AtomicU64::new(0);

/// Where a slave is.
pub(super) enum Component {
    Here(Here),
    Apart(Box<Apart>),
}

/// Calls a function of the component, and makes an error of what is not well.
macro_rules! call {
    ($self:ident, $f:literal, $method:ident($($a:expr),*)) => {{
        $self.alive()?;
        $self.log.begin();
        match &mut $self.component {
            Some($crate::instance::Component::Here(c)) => c.$method($($a),*),
            Some($crate::instance::Component::Apart(c)) => c.$method($($a),*),
            None => Ok(Default::default()),
        }
        .map_err(|t| $self.error($f, *t))
    }};
}
pub(super) use call;

/// A co-simulation slave. Freed when dropped, with its saved states, before its callbacks, its log and the FMU's
/// folder go. Not `Send`: FMI 2.0 promises nothing about an instance that changes threads; make one in each thread.
pub struct Instance {
    /// There until this is dropped.
    pub(super) component: Option<Component>,
    /// Slots of saved states there are, and those that hold none.
    pub(super) slots: usize,
    pub(super) free_slots: Vec<usize>,
    pub(super) id: u64,
    name: String,
    /// Simulation time reached, s.
    time: Option<f64>,
    /// An instance that shares its process has answered fmi2Fatal: none may be called any more.
    fatal: Arc<AtomicBool>,
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
        if let Some(Component::Apart(a)) = self.component.take() {
            // after fmi2Fatal nothing may be called, freeing included
            if self.is_dead() {
                return;
            }
            if let Err((function, how)) = a.end() {
                loaded.complain(self.died(function, how).to_string());
            }
        }
    }
}

impl Fmu {
    /// Makes a slave called `name`, without a window; `logging`: whether it is asked to log more than errors.
    ///
    /// # Errors
    /// Where the FMU makes none (a GUID that does not match its binary is the usual cause), allows one instance only,
    /// or lacks fmi2Instantiate; with what it logged. In a process of its own: where the binary does not load, or the
    /// process dies.
    pub fn instantiate(&self, name: &str, logging: bool) -> Result<Instance, HostError> {
        let refuse = |why: String| HostError::Use { instance: name.to_string(), why };
        let loaded = self.loaded();
        let here = loaded.binding.as_ref();
        if here.is_some() && loaded.fatal.load(Ordering::Relaxed) {
            return Err(refuse("an instance of this FMU answered fmi2Fatal: none may be made any more".into()));
        }
        let once = loaded.capabilities.can_be_instantiated_only_once_per_process;
        if loaded.alive.fetch_add(1, Ordering::Relaxed) > 0 && once && here.is_some() {
            loaded.alive.fetch_sub(1, Ordering::Relaxed);
            return Err(refuse("this FMU allows one instance in a process, and there is one; drop it first".into()));
        }
        let made = self.make(name, logging);
        if made.is_err() {
            loaded.alive.fetch_sub(1, Ordering::Relaxed);
        }
        made
    }

    fn make(&self, name: &str, logging: bool) -> Result<Instance, HostError> {
        let refuse = |why: String| HostError::Use { instance: name.to_string(), why };
        let loaded = self.loaded();
        let making = Making {
            name: CString::new(name).map_err(|_| refuse("the name holds a zero byte".into()))?,
            guid: loaded.guid.clone(),
            resources: loaded.resources.clone(),
            logging,
            asynchronous: loaded.capabilities.can_run_asynchronuously,
            patience: PATIENCE,
        };
        let log = Arc::new(Log::new());
        let not_made = |why: String| refuse(format!("{why}; {}", log.said()));
        let mut fatal = loaded.fatal.clone();
        let component = match (&loaded.binding, loaded.limits.as_ref()) {
            (Some(binding), _) => {
                Component::Here(Here::new(binding.clone(), &making, log.clone(), fatal.clone()).map_err(not_made)?)
            }
            (None, limits) => {
                fatal = Arc::new(AtomicBool::new(false));
                let path = || self.path().to_path_buf();
                let limits = limits.ok_or_else(|| refuse("its binary is not loaded".into()))?;
                let made = Apart::start(&loaded.library, making, limits, log.clone());
                Component::Apart(Box::new(made.map_err(|e| match e {
                    NotMade::NotLoaded(why) => HostError::Open { path: path(), why },
                    NotMade::Refused(why) => not_made(why),
                    NotMade::Died(function, how) => {
                        HostError::Died { path: path(), instance: name.to_string(), function, time: None, how }
                    }
                })?))
            }
        };
        Ok(Instance {
            component: Some(component),
            slots: 0,
            free_slots: Vec::new(),
            id: IDS.fetch_add(1, Ordering::Relaxed),
            name: name.to_string(),
            time: None,
            fatal,
            log,
            fmu: self.clone(),
        })
    }
}

impl Instance {
    /// The FMU it is of.
    pub fn fmu(&self) -> &Fmu {
        &self.fmu
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether it is in a process of its own.
    pub fn is_apart(&self) -> bool {
        matches!(self.component, Some(Component::Apart(_)))
    }

    /// What it has logged so far: the last thousand lines, at most 1 MiB.
    pub fn log(&self) -> Vec<LogLine> {
        self.log.all()
    }

    /// Lines it has logged that are not kept any more.
    pub fn log_dropped(&self) -> u64 {
        self.log.dropped()
    }

    /// How long an asynchronous step may take, 60 s unless set; then it is cancelled and an error.
    ///
    /// # Errors
    /// Where the FMU's process died.
    pub fn set_patience(&mut self, patience: Duration) -> Result<(), HostError> {
        call!(self, "the setting of its patience", set_patience(patience))
    }

    /// Gives every call from now on `longest` at most where that is less than the limit of [`crate::Limits`]. Nothing ends a
    /// call of an instance in this process.
    ///
    /// # Errors
    /// Where the FMU's process died.
    pub fn hurry(&mut self, longest: Duration) -> Result<(), HostError> {
        call!(self, "the setting of its longest time", hurry(longest))
    }

    #[inline]
    fn is_dead(&self) -> bool {
        self.fatal.load(Ordering::Relaxed)
    }

    #[inline]
    pub(super) fn alive(&self) -> Result<(), HostError> {
        if self.is_dead() {
            let why = "after fmi2Fatal or its process' end nothing of this FMU may be called any more; start again";
            return Err(self.misuse(why));
        }
        Ok(())
    }

    /// Notes the simulation time reached, s.
    pub(super) fn reached(&mut self, time: f64) {
        self.time = Some(time);
    }

    #[cold]
    pub(super) fn misuse(&self, why: impl Into<String>) -> HostError {
        HostError::Use { instance: self.name.clone(), why: why.into() }
    }

    fn died(&self, function: &'static str, how: String) -> HostError {
        let path = self.fmu.path().to_path_buf();
        HostError::Died { path, instance: self.name.clone(), function, time: self.time, how }
    }

    /// The error of a call that is not well; warnings stay in the log.
    #[cold]
    pub(super) fn error(&self, function: &'static str, t: Trouble) -> HostError {
        match t {
            Trouble::Missing => {
                self.misuse(format!("its binary has no {function}, which FMI 2.0 requires; export it again"))
            }
            Trouble::Misuse(why) => self.misuse(why),
            Trouble::Died(mut how) => {
                self.fatal.store(true, Ordering::Relaxed);
                if let Some(last) = self.log.of_call().last() {
                    how += &format!("; it logged \"{}\"", last.message);
                }
                self.died(function, how)
            }
            Trouble::Answered { status, detail, discarded } => {
                if Status::from(status) == Status::Fatal {
                    self.fatal.store(true, Ordering::Relaxed);
                }
                self.failed(function, status, detail, discarded)
            }
        }
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
        call!(self, "fmi2SetDebugLogging", set_debug_logging(on, &names))
    }

    /// Gives start, stop and tolerance of the simulation; times in s.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn setup_experiment(&mut self, tolerance: Option<f64>, start: f64, stop: Option<f64>) -> Result<(), HostError> {
        self.time = Some(start);
        call!(self, "fmi2SetupExperiment", setup_experiment(tolerance, start, stop))
    }

    /// Begins initialization.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn enter_initialization(&mut self) -> Result<(), HostError> {
        call!(self, "fmi2EnterInitializationMode", enter_initialization())
    }

    /// Ends initialization; steps may follow.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn exit_initialization(&mut self) -> Result<(), HostError> {
        call!(self, "fmi2ExitInitializationMode", exit_initialization())
    }

    /// Sets Reals, a value for each reference, in the variables' units.
    ///
    /// # Errors
    /// Where lengths differ or the FMU refuses.
    #[inline]
    pub fn set_real(&mut self, references: &[u32], values: &[f64]) -> Result<(), HostError> {
        self.same_length(references.len(), values.len())?;
        call!(self, "fmi2SetReal", set_real(references, values))
    }

    /// Reads Reals into `values`, in the variables' units.
    ///
    /// # Errors
    /// Where lengths differ or the FMU refuses.
    #[inline]
    pub fn get_real(&mut self, references: &[u32], values: &mut [f64]) -> Result<(), HostError> {
        self.same_length(references.len(), values.len())?;
        call!(self, "fmi2GetReal", get_real(references, values))
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
        call!(self, "fmi2SetInteger", set_integer(references, values))
    }

    /// Reads Integers and Enumerations.
    ///
    /// # Errors
    /// Where lengths differ or the FMU refuses.
    pub fn get_integer(&mut self, references: &[u32], values: &mut [i32]) -> Result<(), HostError> {
        self.same_length(references.len(), values.len())?;
        call!(self, "fmi2GetInteger", get_integer(references, values))
    }

    /// Sets Booleans.
    ///
    /// # Errors
    /// Where lengths differ or the FMU refuses.
    pub fn set_boolean(&mut self, references: &[u32], values: &[bool]) -> Result<(), HostError> {
        self.same_length(references.len(), values.len())?;
        let values: Vec<c_int> = values.iter().map(|&b| c_int::from(b)).collect();
        call!(self, "fmi2SetBoolean", set_boolean(references, &values))
    }

    /// Reads Booleans.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn get_boolean(&mut self, references: &[u32]) -> Result<Vec<bool>, HostError> {
        let mut values: Vec<c_int> = vec![0; references.len()];
        call!(self, "fmi2GetBoolean", get_boolean(references, &mut values))?;
        Ok(values.into_iter().map(|b| b != 0).collect())
    }

    /// Sets Strings.
    ///
    /// # Errors
    /// Where lengths differ, a text holds a zero byte or the FMU refuses.
    pub fn set_string(&mut self, references: &[u32], values: &[&str]) -> Result<(), HostError> {
        self.same_length(references.len(), values.len())?;
        let texts = self.c_strings(values)?;
        call!(self, "fmi2SetString", set_string(references, &texts))
    }

    /// Reads Strings, copied at once; what is not UTF-8 is replaced.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn get_string(&mut self, references: &[u32]) -> Result<Vec<String>, HostError> {
        call!(self, "fmi2GetString", get_string(references))
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
        call!(self, "fmi2SetRealInputDerivatives", set_real_input_derivatives(references, orders, values))
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
        call!(self, "fmi2GetRealOutputDerivatives", get_real_output_derivatives(references, orders, values))
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
        call!(self, "fmi2GetDirectionalDerivative", get_directional_derivative(unknowns, knowns, direction, answer))
    }

    /// Steps from `time` s over `step` s, > 0, and waits where the FMU steps asynchronously.
    ///
    /// # Errors
    /// Where the step is not done: with [`Discarded`] where it was discarded, with status fmi2Pending where it
    /// lasted longer than the patience and was cancelled.
    #[inline]
    pub fn do_step(&mut self, time: f64, step: f64) -> Result<(), HostError> {
        let never_back = !self.holds_states();
        self.time = Some(time);
        call!(self, "fmi2DoStep", do_step(time, step, never_back))?;
        self.time = Some(time + step);
        Ok(())
    }

    /// Gives up an asynchronous step. The instance can then only be reset or dropped.
    ///
    /// # Errors
    /// Where there is none, or the FMU refuses.
    pub fn cancel_step(&mut self) -> Result<(), HostError> {
        call!(self, "fmi2CancelStep", cancel_step())
    }

    /// Ends the simulation; values can still be read.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn terminate(&mut self) -> Result<(), HostError> {
        call!(self, "fmi2Terminate", terminate())
    }

    /// Back to as made: every value at its start, saved states kept.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn reset(&mut self) -> Result<(), HostError> {
        call!(self, "fmi2Reset", reset())
    }
}
