//! Values of variables, and their derivatives.

use super::component::{at_once, call, refuse};
use super::Status;
use crate::arrays::{slice, slice_mut, MOST_VALUES};
use crate::life::{Outcome, Refusal};
use crate::model::{Kind, Model};
use crate::text;
use std::os::raw::{c_char, c_int, c_uint, c_void};

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

/// fmi2GetReal.
///
/// # Safety
/// As [the module](super) says of `c`; `vr` is null or points to `n` references, `values` is null or to `n`
/// values to write, apart from them.
#[inline]
pub unsafe fn get_real<M: Model>(c: *mut c_void, vr: *const c_uint, n: usize, values: *mut f64) -> Status {
    // one value, as most hosts ask
    if n == 1 && !vr.is_null() && !values.is_null() {
        let get = |m: &mut M| match m.real_at_once(*vr) {
            Some(value) => {
                *values = value;
                true
            }
            None => false,
        };
        if let Some(status) = at_once(c, get) {
            return status;
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
/// As [the module](super) says of `c`; `vr` is null or points to `n` references, `values` is null or to `n`
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
/// As [the module](super) says of `c`; `vr` is null or points to `n` references, `values` is null or to `n`
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
/// As [the module](super) says of `c`.
unsafe fn no_strings<M: Model>(c: *mut c_void, n: usize) -> Status {
    call::<M>(c, |_| if n == 0 { Ok(()) } else { refuse("the model has no String variable") })
}

/// fmi2GetString: no model has any.
///
/// # Safety
/// As [the module](super) says of `c`. No other pointer is read.
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
/// As [the module](super) says of `c`; `vr` is null or points to `n` references, `values` is null or to `n`
/// values.
#[inline]
pub unsafe fn set_real<M: Model>(c: *mut c_void, vr: *const c_uint, n: usize, values: *const f64) -> Status {
    // what hosts set at every step
    if n > 0 && n <= MOST_VALUES && !vr.is_null() && !values.is_null() {
        let (references, values) = (std::slice::from_raw_parts(vr, n), std::slice::from_raw_parts(values, n));
        if let Some(status) = at_once(c, |m: &mut M| m.set_reals(references, values)) {
            return status;
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
/// As [the module](super) says of `c`; `vr` is null or points to `n` references, `values` is null or to `n`
/// values.
pub unsafe fn set_integer<M: Model>(c: *mut c_void, vr: *const c_uint, n: usize, values: *const c_int) -> Status {
    call::<M>(c, |c| set_all(&mut c.model, Kind::Integer, slice(vr, n, "vr")?, slice(values, n, "value")?))
}

/// fmi2SetBoolean.
///
/// # Safety
/// As [the module](super) says of `c`; `vr` is null or points to `n` references, `values` is null or to `n`
/// values.
pub unsafe fn set_boolean<M: Model>(c: *mut c_void, vr: *const c_uint, n: usize, values: *const c_int) -> Status {
    call::<M>(c, |c| set_all(&mut c.model, Kind::Boolean, slice(vr, n, "vr")?, slice(values, n, "value")?))
}

/// fmi2SetString: no model has any.
///
/// # Safety
/// As [the module](super) says of `c`. No other pointer is read.
pub unsafe fn set_string<M: Model>(
    c: *mut c_void,
    _vr: *const c_uint,
    n: usize,
    _values: *const *const c_char,
) -> Status {
    no_strings::<M>(c, n)
}

/// fmi2GetDirectionalDerivative.
///
/// # Safety
/// As [the module](super) says of `c`; `unknown` is null or points to `n_unknown` references, `known` and `seed` are null
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
/// As [the module](super) says of `c`; `vr`, `order` and `values` are null or point to `n` references, orders, numbers.
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
/// As [the module](super) says of `c`; `vr` and `order` are null or point to `n` references and orders, `values` is null
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
