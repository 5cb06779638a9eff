//! States that a host keeps, and their bytes.

use super::component::{call, refuse, Magic};
use super::Status;
use crate::arrays::{slice, slice_mut, target};
use crate::life::{Outcome, Refusal};
use crate::memory::boxed;
use crate::model::Model;
use crate::text;
use std::os::raw::c_void;

/// What an fmi2FMUstate points to.
#[repr(C)]
struct Kept<S> {
    magic: u64,
    state: S,
}

/// The state behind an fmi2FMUstate.
///
/// # Safety
/// `p` is null, or points to 8 readable bytes; where these are those of a state of this model, to one that is not
/// freed and that nobody else uses during the call.
unsafe fn kept<'a, M: Model>(p: *mut c_void) -> Outcome<&'a mut Kept<M::State>> {
    if p.is_null() || p.cast::<u64>().read_unaligned() != Magic::<M>::STATE {
        return refuse("FMUstate is null or not one of this model's");
    }
    Ok(&mut *p.cast())
}

/// That `p` is the address of a state: fmusim 0.0.39 passes the state itself, and what lies there is its magic number,
/// which is no address.
///
/// # Safety
/// `p` is null, or points to a pointer or to what [`kept`] takes.
unsafe fn address<M: Model>(p: *mut *mut c_void) -> Outcome<()> {
    // of an address there is one word to read
    if !p.is_null() && p.cast::<usize>().read_unaligned() == Magic::<M>::STATE as usize {
        return refuse("FMUstate is a state: pass its address");
    }
    Ok(())
}

/// Puts a state where a host wants it: into its own, or into a new one.
///
/// # Safety
/// `p` is null, or points to null or to what [`kept`] takes.
unsafe fn keep<M: Model>(p: *mut *mut c_void, state: M::State) -> Outcome<()> {
    address::<M>(p)?;
    let p = target(p, "FMUstate")?;
    if p.is_null() {
        let kept = boxed(Kept { magic: Magic::<M>::STATE, state });
        *p = Box::into_raw(kept.ok_or_else(|| Refusal::Error(text!("no memory for a state")))?).cast();
    } else {
        kept::<M>(*p)?.state = state;
    }
    Ok(())
}

/// fmi2GetFMUstate.
///
/// # Safety
/// As [the module](super) says of `c`; `p` is null, or points to null or to a state that [`get_fmu_state`] or
/// [`de_serialize_fmu_state`] gave for the same model and [`free_fmu_state`] has not freed.
pub unsafe fn get_fmu_state<M: Model>(c: *mut c_void, p: *mut *mut c_void) -> Status {
    call::<M>(c, |c| keep::<M>(p, c.model.state()))
}

/// fmi2SetFMUstate.
///
/// # Safety
/// As [the module](super) says of `c`; `p` is null or what [`get_fmu_state`] or [`de_serialize_fmu_state`] gave for the
/// same model and [`free_fmu_state`] has not freed.
pub unsafe fn set_fmu_state<M: Model>(c: *mut c_void, p: *mut c_void) -> Status {
    call::<M>(c, |c| {
        c.model.restore(kept::<M>(p)?.state);
        Ok(())
    })
}

/// fmi2FreeFMUstate.
///
/// # Safety
/// As [the module](super) says of `c`; `p` is null, or points to null or to a state that [`get_fmu_state`] or
/// [`de_serialize_fmu_state`] gave for the same model and [`free_fmu_state`] has not freed.
pub unsafe fn free_fmu_state<M: Model>(c: *mut c_void, p: *mut *mut c_void) -> Status {
    call::<M>(c, |_| {
        address::<M>(p)?;
        let p = match p.as_mut() {
            Some(p) if !p.is_null() => p,
            _ => return Ok(()),
        };
        let k = kept::<M>(*p)?;
        k.magic = 0;
        drop(Box::from_raw(k as *mut Kept<M::State>));
        *p = std::ptr::null_mut();
        Ok(())
    })
}

/// fmi2SerializedFMUstateSize.
///
/// # Safety
/// As [the module](super) says of `c`; `p` is null or what [`get_fmu_state`] or [`de_serialize_fmu_state`] gave for the
/// same model and [`free_fmu_state`] has not freed; `size` is null or points to a number to write.
pub unsafe fn serialized_fmu_state_size<M: Model>(c: *mut c_void, p: *mut c_void, size: *mut usize) -> Status {
    call::<M>(c, |_| {
        kept::<M>(p)?;
        *target(size, "size")? = M::LAYOUT.length;
        Ok(())
    })
}

/// fmi2SerializeFMUstate.
///
/// # Safety
/// As [the module](super) says of `c`; `p` is null or what [`get_fmu_state`] or [`de_serialize_fmu_state`] gave for the
/// same model and [`free_fmu_state`] has not freed; `bytes` is null or points to `size` bytes to write.
pub unsafe fn serialize_fmu_state<M: Model>(c: *mut c_void, p: *mut c_void, bytes: *mut u8, size: usize) -> Status {
    call::<M>(c, |_| {
        let k = kept::<M>(p)?;
        if bytes.is_null() || size < M::LAYOUT.length {
            return Err(Refusal::Error(text!("serializedState is null or {} bytes: give {}", size, M::LAYOUT.length)));
        }
        M::write(&k.state, slice_mut(bytes, M::LAYOUT.length, "serializedState")?);
        Ok(())
    })
}

/// fmi2DeSerializeFMUstate.
///
/// # Safety
/// As [the module](super) says of `c`; `bytes` is null or points to `size` bytes; `p` as for [`get_fmu_state`].
pub unsafe fn de_serialize_fmu_state<M: Model>(
    c: *mut c_void,
    bytes: *const u8,
    size: usize,
    p: *mut *mut c_void,
) -> Status {
    call::<M>(c, |_| {
        let state = M::read(slice(bytes, size, "serializedState")?)
            .map_err(|m| Refusal::Error(text!("serializedState is {}", m)))?;
        keep::<M>(p, state)
    })
}
