//! Arrays and single values that a host passes by pointer.

use crate::life::{Outcome, Refusal};
use crate::text;

/// More values than any host passes in one call; beyond it a count is taken for garbage.
pub(crate) const MOST_VALUES: usize = 1 << 20;

#[cold]
fn no_array<T>(what: &str, n: usize) -> Outcome<T> {
    Err(Refusal::Error(text!("{} is null, or {} are too many", what, n)))
}

/// A host's array.
///
/// # Safety
/// `p` is null or points to `n` values that nobody writes to during the call.
#[inline]
pub(crate) unsafe fn slice<'a, T>(p: *const T, n: usize, what: &str) -> Outcome<&'a [T]> {
    if n == 0 {
        Ok(&[])
    } else if p.is_null() || n > MOST_VALUES {
        no_array(what, n)
    } else {
        Ok(std::slice::from_raw_parts(p, n))
    }
}

/// A host's array to write to.
///
/// # Safety
/// `p` is null or points to `n` values that nobody else reads or writes during the call.
#[inline]
pub(crate) unsafe fn slice_mut<'a, T>(p: *mut T, n: usize, what: &str) -> Outcome<&'a mut [T]> {
    if n == 0 {
        Ok(&mut [])
    } else if p.is_null() || n > MOST_VALUES {
        no_array(what, n)
    } else {
        Ok(std::slice::from_raw_parts_mut(p, n))
    }
}

/// A host's single value to write to.
///
/// # Safety
/// `p` is null or points to a value that nobody else reads or writes during the call.
pub(crate) unsafe fn target<'a, T>(p: *mut T, what: &str) -> Outcome<&'a mut T> {
    p.as_mut().ok_or_else(|| Refusal::Error(text!("{} is null", what)))
}
