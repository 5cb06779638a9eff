//! Start values and GUID: one block in the library that a packer may overwrite in place, so that an FMU with values
//! of its own needs no file at run time and no host has to pass it any.

use crate::variables::{Settings, PARAMETERS, PARAMETER_TABLE};

/// First bytes of the block.
pub const MARKER: [u8; 16] = *b"touchdown start\n";
/// Length of a GUID with its braces.
pub const GUID_LENGTH: usize = 38;
/// GUID of a library that was never packed.
pub const UNPACKED_GUID: [u8; GUID_LENGTH] = *b"{00000000-0000-0000-0000-000000000000}";

/// The block: marker, GUID, number of parameters, then one f64 a parameter (NaN: its default), in the order of the table.
#[repr(C)]
pub struct Block {
    marker: [u8; 16],
    guid: [u8; GUID_LENGTH],
    count: [u8; 2],
    values: [f64; PARAMETERS],
}

/// Bytes from the start of the block to its GUID.
pub const GUID_OFFSET: usize = 16;
/// Bytes from the start of the block to its number of parameters, u16, little-endian.
pub const COUNT_OFFSET: usize = GUID_OFFSET + GUID_LENGTH;
/// Bytes from the start of the block to its values.
pub const VALUES_OFFSET: usize = COUNT_OFFSET + 2;
/// The number of parameters as the block has it.
pub const COUNT: [u8; 2] = (PARAMETERS as u16).to_le_bytes();

#[used]
static BLOCK: Block = Block { marker: MARKER, guid: UNPACKED_GUID, count: COUNT, values: [f64::NAN; PARAMETERS] };

/// What the block says, read as the file holds it and not as the compiler saw it.
fn block() -> Block {
    // SAFETY: BLOCK is a valid, aligned static that nothing writes to
    unsafe { core::ptr::read_volatile(&BLOCK) }
}

/// The GUID that a host has to show.
pub fn guid() -> [u8; GUID_LENGTH] {
    block().guid
}

/// Start values.
pub fn settings() -> Settings {
    let mut s = Settings::default();
    let values = block().values;
    for i in 0..PARAMETER_TABLE.len() {
        if values[i].is_finite() {
            s.set(i, values[i]);
        }
    }
    s
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_block_lies_as_the_packer_expects() {
        let b = block();
        let at = |p: *const u8| p as usize - (&b as *const Block as usize);
        assert_eq!(at(b.guid.as_ptr()), GUID_OFFSET);
        assert_eq!(at(b.count.as_ptr()), COUNT_OFFSET);
        assert_eq!(at(b.values.as_ptr().cast()), VALUES_OFFSET);
        assert_eq!(settings(), Settings::default());
    }
}
