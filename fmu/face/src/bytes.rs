//! States as bytes: a header that names model, version and length, a checksum at the end, numbers little endian, the same
//! on every platform.

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

/// First bytes of every state.
const MARK: [u8; 8] = *b"FMUstate";
/// Bytes that a model's name takes, zeros behind it.
const NAME: usize = 32;
/// Places of version and length, u32 each.
const VERSION: usize = MARK.len() + NAME;
const LENGTH: usize = VERSION + 4;
/// Bytes before a model's own: mark, name, version, length.
pub const HEADER: usize = LENGTH + 4;
/// Bytes behind a model's own: the checksum of all before them.
pub const CHECKSUM: usize = 8;

/// What the bytes of a model's states look like. No other model's, and no other version's, are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layout {
    /// Name of the model, of at most 32 bytes.
    pub model: &'static str,
    /// Counts up whenever the model's own bytes mean something else.
    pub version: u32,
    /// Length of a state in bytes, header and checksum with it.
    pub length: usize,
}

impl Layout {
    /// Of a model whose own bytes are `own` long.
    pub const fn new(model: &'static str, version: u32, own: usize) -> Layout {
        assert!(model.len() <= NAME, "a model's name is longer than its place in a state");
        Layout { model, version, length: HEADER + own + CHECKSUM }
    }

    /// A number that differs between models and versions.
    pub(crate) const fn mark(&self) -> u64 {
        checksum(self.model.as_bytes()) ^ ((self.version as u64) << 32) ^ self.length as u64
    }

    fn header(&self) -> [u8; HEADER] {
        let mut h = [0u8; HEADER];
        h[..MARK.len()].copy_from_slice(&MARK);
        h[MARK.len()..MARK.len() + self.model.len()].copy_from_slice(self.model.as_bytes());
        h[VERSION..LENGTH].copy_from_slice(&self.version.to_le_bytes());
        h[LENGTH..].copy_from_slice(&(self.length as u32).to_le_bytes());
        h
    }

    /// Writes header and checksum around the model's own bytes, which are there already. Nothing where `bytes` are not
    /// as long as a state.
    pub fn seal(&self, bytes: &mut [u8]) {
        if bytes.len() == self.length {
            bytes[..HEADER].copy_from_slice(&self.header());
            let at = self.length - CHECKSUM;
            let sum = checksum(&bytes[..at]);
            bytes[at..].copy_from_slice(&sum.to_le_bytes());
        }
    }

    /// The model's own bytes.
    ///
    /// # Errors
    /// What is wrong with `bytes`.
    pub fn unseal<'b>(&self, bytes: &'b [u8]) -> Result<&'b [u8], &'static str> {
        let header = self.header();
        if bytes.len() < HEADER || bytes[..MARK.len()] != MARK {
            return Err("no state of an FMU of touchdown");
        }
        if bytes[MARK.len()..VERSION] != header[MARK.len()..VERSION] {
            return Err("a state of another model");
        }
        if bytes[VERSION..HEADER] != header[VERSION..HEADER] {
            return Err("a state of another version of this model");
        }
        if bytes.len() != self.length {
            return Err("not as long as a state of this model");
        }
        let at = self.length - CHECKSUM;
        if u64::from_le_bytes(eight(bytes, at)) != checksum(&bytes[..at]) {
            return Err("changed since it was written");
        }
        Ok(&bytes[HEADER..at])
    }
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

    const LAYOUT: Layout = Layout::new("a model", 3, 12);

    #[test]
    fn every_changed_byte_is_found_and_every_other_length_refused() {
        let mut b = [7u8; LAYOUT.length];
        LAYOUT.seal(&mut b);
        assert_eq!(LAYOUT.unseal(&b), Ok(&[7u8; 12][..]));
        for i in 0..b.len() {
            let mut changed = b;
            changed[i] ^= 1;
            assert!(LAYOUT.unseal(&changed).is_err(), "byte {}", i);
            assert!(LAYOUT.unseal(&b[..i]).is_err() && LAYOUT.unseal(&b[i + 1..]).is_err(), "byte {}", i);
        }
        assert!(LAYOUT.unseal(&[&b[..], &[0]].concat()).is_err());
        LAYOUT.seal(&mut [1, 2]);
    }

    #[test]
    fn states_of_other_models_versions_and_sizes_are_told_apart() {
        let others = [Layout::new("a modem", 3, 12), Layout::new("a model", 4, 12), Layout::new("a model", 3, 13)];
        let said = ["a state of another model", "a state of another version of this model"];
        for (other, said) in others.iter().zip([said[0], said[1], said[1]]) {
            let mut b = vec![7u8; other.length];
            other.seal(&mut b);
            assert_eq!(LAYOUT.unseal(&b), Err(said));
            assert_ne!(LAYOUT.mark(), other.mark());
        }
    }

    #[test]
    fn numbers_are_read_and_the_checksum_is_the_published_one() {
        assert_eq!(number(&1.5f64.to_le_bytes(), 0), 1.5);
        assert!(number(&[0; 24], 17).is_nan() && number(&[0; 24], usize::MAX).is_nan());
        // test vectors that Fowler, Noll and Vo give
        assert_eq!(checksum(b"a"), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(checksum(b"foobar"), 0x8594_4171_f739_67e8);
    }
}
