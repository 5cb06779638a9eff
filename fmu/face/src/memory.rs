//! Memory that may be refused: an FMU that ends its host's process because the host has no memory left takes the host's work
//! with it. What a call needs is asked for here; where there is none, an instance or a state is not made, and a message for
//! the log is cut short.

use std::alloc::{alloc, Layout};
use std::fmt::{self, Write};

/// `value` in a box of its own; None where there is no memory for it.
pub(crate) fn boxed<T>(value: T) -> Option<Box<T>> {
    let layout = Layout::new::<T>();
    if layout.size() == 0 {
        return Some(Box::new(value));
    }
    // SAFETY: the layout is of no zero size; what comes back is null or room for one T, written before the box owns it
    unsafe {
        let p = alloc(layout).cast::<T>();
        if p.is_null() {
            return None;
        }
        p.write(value);
        Some(Box::from_raw(p))
    }
}

/// Bytes with a 0 at their end, as C has its strings, and none within them (a space stands in its place); every % twice where
/// `doubled`. None where there is no memory for them.
pub(crate) fn c_string(bytes: &[u8], doubled: bool) -> Option<Vec<u8>> {
    let more = if doubled { bytes.iter().filter(|b| **b == b'%').count() } else { 0 };
    let mut v = Vec::new();
    v.try_reserve_exact(bytes.len() + more + 1).ok()?;
    for b in bytes {
        v.push(if *b == 0 { b' ' } else { *b });
        if doubled && *b == b'%' {
            v.push(b'%');
        }
    }
    v.push(0);
    Some(v)
}

/// A copy of bytes; None where there is no memory for it.
pub(crate) fn copied(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut v = Vec::new();
    v.try_reserve_exact(bytes.len()).ok()?;
    v.extend_from_slice(bytes);
    Some(v)
}

/// A message as far as there is memory for it.
struct Message(String);

impl Write for Message {
    fn write_str(&mut self, s: &str) -> fmt::Result {
        self.0.try_reserve(s.len()).map_err(|_| fmt::Error)?;
        self.0.push_str(s);
        Ok(())
    }
}

/// What [`crate::text!`] writes.
#[doc(hidden)]
pub fn written(what: fmt::Arguments<'_>) -> String {
    let mut message = Message(String::new());
    // where there is no memory for it the log has less to say
    let _ = message.write_fmt(what);
    message.0
}

/// As `format!`, but cut short where there is no memory for it.
#[macro_export]
macro_rules! text {
    ($($what:tt)*) => {
        $crate::memory::written(format_args!($($what)*))
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_c_string_ends_with_0_and_holds_none() {
        assert_eq!(c_string(b"5 % of\0all", true).unwrap(), b"5 %% of all\0");
        assert_eq!(c_string(b"%", false).unwrap(), b"%\0");
        assert_eq!(c_string(b"", true).unwrap(), b"\0");
    }

    #[test]
    fn a_text_is_what_format_writes() {
        assert_eq!(crate::text!("{} is {:?}: {x}", 1.5, "a", x = 3), format!("{} is {:?}: {x}", 1.5, "a", x = 3));
        assert_eq!(*boxed(()).unwrap(), ());
        assert_eq!(*boxed([1u64; 9]).unwrap(), [1; 9]);
    }
}
