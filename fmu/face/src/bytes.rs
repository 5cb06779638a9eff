//! States as bytes: a checksum at the end, numbers little endian, the same on every platform.

/// Fowler, Noll and Vo's hash FNV-1a, 64 bits: finds bytes that were cut or changed.
pub(crate) const fn checksum(bytes: &[u8]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325u64;
    let mut i = 0;
    while i < bytes.len() {
        hash = (hash ^ bytes[i] as u64).wrapping_mul(0x0100_0000_01b3);
        i += 1;
    }
    hash
}

/// Writes the checksum of all but the last eight bytes into the last eight; nothing where there are fewer than eight.
pub fn seal(bytes: &mut [u8]) {
    if let Some(at) = bytes.len().checked_sub(8) {
        let sum = checksum(&bytes[..at]);
        bytes[at..].copy_from_slice(&sum.to_le_bytes());
    }
}

/// Holds bytes against their length, their first eight and the checksum of [`seal`].
///
/// # Errors
/// What is wrong with them.
pub fn unseal(b: &[u8], length: usize, magic: [u8; 8]) -> Result<(), &'static str> {
    if b.len() != length || length < 16 {
        return Err("not as long as a state of this version");
    }
    if b[..8] != magic {
        return Err("not a state of this model and version");
    }
    if u64::from_le_bytes(eight(b, length - 8)) != checksum(&b[..length - 8]) {
        return Err("changed since they were written");
    }
    Ok(())
}

/// The number in the eight bytes from `at` on, little endian; NaN beyond the end.
pub fn number(b: &[u8], at: usize) -> f64 {
    if b.len() < 8 || at > b.len() - 8 {
        return f64::NAN;
    }
    f64::from_le_bytes(eight(b, at))
}

fn eight(b: &[u8], at: usize) -> [u8; 8] {
    let mut eight = [0u8; 8];
    eight.copy_from_slice(&b[at..at + 8]);
    eight
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_changed_byte_is_found() {
        let mut b = *b"a state.12345678________";
        seal(&mut b);
        let magic = *b"a state.";
        assert_eq!(unseal(&b, b.len(), magic), Ok(()));
        for i in 0..b.len() {
            let mut changed = b;
            changed[i] ^= 1;
            assert!(unseal(&changed, b.len(), magic).is_err(), "byte {}", i);
        }
        assert!(unseal(&b[..23], 24, magic).is_err() && unseal(&b[..9], 9, magic).is_err());
        assert_eq!(number(&1.5f64.to_le_bytes(), 0), 1.5);
        assert!(number(&b, 17).is_nan() && number(&b, usize::MAX).is_nan());
        seal(&mut [1, 2]);
        // test vectors that Fowler, Noll and Vo give
        assert_eq!(checksum(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(checksum(b"foobar"), 0x8594_4171_f739_67e8);
    }
}
