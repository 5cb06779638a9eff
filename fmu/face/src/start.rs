//! Start values and GUID: one block in a library that a packer may overwrite in place, so that an FMU with values
//! of its own needs no file at run time and no host has to pass it any.

/// First bytes of the block.
pub const MARKER: [u8; 16] = *b"touchdown start\n";
/// Length of a GUID with its braces.
pub const GUID_LENGTH: usize = 38;
/// GUID of a library that was never packed.
pub const UNPACKED_GUID: [u8; GUID_LENGTH] = *b"{00000000-0000-0000-0000-000000000000}";

/// Bytes from the start of the block to its GUID.
pub const GUID_OFFSET: usize = 16;
/// Bytes from the start of the block to its number of parameters, u16, little-endian.
pub const COUNT_OFFSET: usize = GUID_OFFSET + GUID_LENGTH;
/// Bytes from the start of the block to its values.
pub const VALUES_OFFSET: usize = COUNT_OFFSET + 2;

/// The block of a model with `N` parameters: marker, GUID, number of parameters, then one f64 a parameter (NaN: its
/// default), in the order of the model's table. A model keeps it in a `#[used] static`.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct Block<const N: usize> {
    marker: [u8; 16],
    guid: [u8; GUID_LENGTH],
    count: [u8; 2],
    values: [f64; N],
}

impl<const N: usize> Block<N> {
    /// The block of a library that was never packed.
    pub const fn unpacked() -> Self {
        Block { marker: MARKER, guid: UNPACKED_GUID, count: count(N), values: [f64::NAN; N] }
    }

    /// The block as the file holds it and not as the compiler saw it.
    fn in_file(&self) -> Self {
        // SAFETY: a reference is valid and aligned, and the block holds plain bytes and numbers
        unsafe { core::ptr::read_volatile(self) }
    }

    /// The GUID that a host has to give.
    pub fn guid(&self) -> [u8; GUID_LENGTH] {
        self.in_file().guid
    }

    /// Start values: the defaults, with what the block holds put over them by `set` (settings, place, value).
    pub fn settings<S: Default>(&self, set: fn(&mut S, usize, f64)) -> S {
        let mut s = S::default();
        for (i, value) in self.values().iter().enumerate() {
            if let Some(v) = value {
                set(&mut s, i, *v);
            }
        }
        s
    }

    /// Start value of each parameter; None: its default.
    fn values(&self) -> [Option<f64>; N] {
        self.in_file().values.map(|v| if v.is_finite() { Some(v) } else { None })
    }
}

/// The block of a library, with its GUID and start values as `guid` and `settings`: called once, in the module `start` of a
/// model, with the type of its settings (which has `set` by place) and its number of parameters.
#[macro_export]
macro_rules! start_block {
    ($settings:ty, $parameters:expr) => {
        #[used]
        static BLOCK: $crate::start::Block<{ $parameters }> = $crate::start::Block::unpacked();

        /// The GUID that a host has to give.
        pub fn guid() -> [u8; $crate::start::GUID_LENGTH] {
            BLOCK.guid()
        }

        /// Start values.
        pub fn settings() -> $settings {
            BLOCK.settings(<$settings>::set)
        }

        #[cfg(test)]
        #[test]
        fn a_library_never_packed_starts_with_the_defaults() {
            assert_eq!(settings(), <$settings>::default());
            assert_eq!(guid(), $crate::start::UNPACKED_GUID);
        }
    };
}

/// A number of parameters as the block has it.
pub const fn count(parameters: usize) -> [u8; 2] {
    (parameters as u16).to_le_bytes()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_block_lies_as_the_packer_expects() {
        let b = Block::<3>::unpacked();
        let at = |p: *const u8| p as usize - (&b as *const Block<3> as usize);
        assert_eq!(at(b.marker.as_ptr()), 0);
        assert_eq!(at(b.guid.as_ptr()), GUID_OFFSET);
        assert_eq!(at(b.count.as_ptr()), COUNT_OFFSET);
        assert_eq!(at(b.values.as_ptr().cast()), VALUES_OFFSET);
        assert_eq!(std::mem::size_of_val(&b), VALUES_OFFSET + 3 * 8);
        assert_eq!((b.count, b.guid()), ([3, 0], UNPACKED_GUID));
        assert_eq!(b.values(), [None; 3]);
        assert_eq!(Block { values: [1.5, f64::NAN, f64::INFINITY], ..b }.values(), [Some(1.5), None, None]);
    }
}
