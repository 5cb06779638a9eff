//! Lines for the host's log.

use crate::memory::c_string;
use std::os::raw::{c_char, c_int, c_void};

/// fmi2CallbackLogger.
pub type Logger = Option<unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char, ...)>;

/// Who is called to log, all of it owned: nothing of an instance is borrowed while a host's logger runs. The name ends with
/// 0; it is empty where there was no memory for it.
pub(crate) struct Log {
    pub logger: Logger,
    pub environment: *mut c_void,
    pub name: Vec<u8>,
}

/// What is logged in the place of a string that there is no memory for.
const NO_MEMORY: &[u8] = b"out of memory\0";

impl Log {
    /// Passes a line to the host's logger, formatted here, with every % doubled: safe for a host that prints it as a
    /// format, readable in one whose callback takes no further arguments and would show a bare "%s".
    pub fn line(&self, status: c_int, category: &str, message: &str) {
        let log = match self.logger {
            Some(log) => log,
            None => return,
        };
        let (category, message) = (c_string(category.as_bytes(), false), c_string(message.as_bytes(), true));
        let at = |s: &Option<Vec<u8>>| s.as_deref().unwrap_or(NO_MEMORY).as_ptr().cast();
        let name = if self.name.is_empty() { NO_MEMORY } else { &self.name };
        // SAFETY: the host gave the logger for this; every pointer is to a string that ends with 0 and outlives the call
        unsafe { log(self.environment, name.as_ptr().cast(), status, at(&category), at(&message)) }
    }
}
