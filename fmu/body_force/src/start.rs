//! Start values and GUID of this library: see [`face::start`].

use face::start::{Block, GUID_LENGTH};
use variables::{Settings, PARAMETERS};

#[used]
static BLOCK: Block<PARAMETERS> = Block::unpacked();

/// The GUID that a host has to give.
pub fn guid() -> [u8; GUID_LENGTH] {
    BLOCK.guid()
}

/// Start values.
pub fn settings() -> Settings {
    BLOCK.settings(Settings::set)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_library_never_packed_starts_with_the_defaults() {
        assert_eq!(settings(), Settings::default());
        assert_eq!(guid(), face::start::UNPACKED_GUID);
    }
}
