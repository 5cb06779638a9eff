//! Elements of datasets as numbers.

use crate::shared::half::half;
use hdf5_reader::error::{ByteOrder, Error, Result};
use hdf5_reader::{dtype_element_size, Datatype, H5Type};

/// One number, of any of the numeric types of HDF5.
#[derive(Clone, Copy, Debug)]
pub(super) struct Number(pub f64);

/// One integer, with all its digits.
#[derive(Clone, Copy, Debug)]
pub(super) struct Whole(pub i128);

/// Whether an element of this type is an integer of 8 bytes: a double does not hold each of them.
pub(super) fn is_long(of: &Datatype) -> bool {
    matches!(of, Datatype::FixedPoint { size: 8, .. })
}

/// The numeric fields of a compound record, in order, arrays element by element.
#[derive(Clone, Debug)]
pub(super) struct Record(pub Vec<f64>);

/// Whether an element of this type is one number: an integer of up to 8 bytes, an IEEE float of 2, 4 or 8 bytes, a bit
/// field, or an enumeration (also the booleans that h5py writes).
pub(super) fn is_number(of: &Datatype) -> bool {
    match of {
        Datatype::FixedPoint { size, .. } | Datatype::Bitfield { size, .. } => (1..=8).contains(size),
        Datatype::FloatingPoint { size, .. } => matches!(size, 2 | 4 | 8),
        Datatype::Enum { base, .. } => matches!(**base, Datatype::FixedPoint { size: 1..=8, .. }),
        _ => false,
    }
}

/// Whether the bits of a type as stored are those of plain integers and IEEE floats: no padding, no other exponent.
pub(super) fn is_plain(stored: &[u8]) -> bool {
    let field = |at: usize| stored.get(at..at + 2).map_or(0, |b| u16::from_le_bytes([b[0], b[1]]));
    let bits = u64::from(field(4)) * 8;
    let float = |exponent: u8, mantissa: u8| stored.get(12..16) == Some(&[mantissa, exponent, 0, mantissa]);
    match (stored.first().map(|b| b & 0x0f), bits) {
        (Some(0), _) => field(8) == 0 && u64::from(field(10)) == bits,
        (Some(1), 16) => float(5, 10),
        (Some(1), 32) => float(8, 23),
        (Some(1), 64) => float(11, 52),
        _ => true,
    }
}

/// The numbers of a compound field: how many, of what type; None where it holds none.
pub(super) fn numbers_of(field: &Datatype) -> Option<(u64, &Datatype)> {
    match field {
        Datatype::Array { base, dims } if is_number(base) => {
            Some((dims.iter().try_fold(1u64, |n, d| n.checked_mul(*d))?, base))
        }
        _ => is_number(field).then_some((1, field)),
    }
}

/// The number in `bytes`, which hold an element of that type.
fn number(bytes: &[u8], of: &Datatype) -> f64 {
    match of {
        Datatype::FixedPoint { signed, byte_order, .. } => integer(bytes, *byte_order, *signed),
        Datatype::Bitfield { byte_order, .. } => integer(bytes, *byte_order, false),
        Datatype::Enum { base, .. } => number(bytes, base),
        Datatype::FloatingPoint { byte_order, .. } => float(bytes, *byte_order),
        _ => f64::NAN,
    }
}

fn integer(bytes: &[u8], order: ByteOrder, signed: bool) -> f64 {
    let value = unsigned(bytes, order);
    if signed {
        let unused = 64 - 8 * bytes.len().min(8) as u32;
        (((value << unused) as i64) >> unused) as f64
    } else {
        value as f64
    }
}

fn unsigned(bytes: &[u8], order: ByteOrder) -> u64 {
    let add = |value: u64, byte: &u8| value << 8 | u64::from(*byte);
    match order {
        ByteOrder::LittleEndian => bytes.iter().rev().fold(0, add),
        ByteOrder::BigEndian => bytes.iter().fold(0, add),
    }
}

fn float(bytes: &[u8], order: ByteOrder) -> f64 {
    let bits = unsigned(bytes, order);
    match bytes.len() {
        2 => half(bits as u16),
        4 => f64::from(f32::from_bits(bits as u32)),
        8 => f64::from_bits(bits),
        _ => f64::NAN,
    }
}

/// The first `count` elements of `size` bytes in `raw`; None where they are not all there.
fn elements(raw: &[u8], size: usize, count: usize) -> Option<impl Iterator<Item = &[u8]>> {
    (size > 0).then(|| raw.get(..size.checked_mul(count)?)).flatten().map(|all| all.chunks_exact(size))
}

impl H5Type for Number {
    fn hdf5_type() -> Datatype {
        f64::hdf5_type()
    }

    fn from_bytes(bytes: &[u8], of: &Datatype) -> Result<Number> {
        let element = bytes.get(..Number::element_size(of)).ok_or_else(|| short("a number"))?;
        Ok(Number(number(element, of)))
    }

    fn element_size(of: &Datatype) -> usize {
        dtype_element_size(of).unwrap_or(0)
    }

    fn decode_vec(raw: &[u8], of: &Datatype, count: usize) -> Option<Result<Vec<Number>>> {
        let each = elements(raw, Number::element_size(of), count)?;
        Some(Ok(each.map(|bytes| Number(number(bytes, of))).collect()))
    }
}

impl H5Type for Whole {
    fn hdf5_type() -> Datatype {
        f64::hdf5_type()
    }

    fn from_bytes(bytes: &[u8], of: &Datatype) -> Result<Whole> {
        let Datatype::FixedPoint { signed, byte_order, .. } = of else {
            return Err(Error::InvalidData("integers of another type".into()));
        };
        let element = bytes.get(..Whole::element_size(of)).ok_or_else(|| short("a number"))?;
        let value = unsigned(element, *byte_order);
        Ok(Whole(if *signed { i128::from(value as i64) } else { i128::from(value) }))
    }

    fn element_size(of: &Datatype) -> usize {
        dtype_element_size(of).unwrap_or(0)
    }
}

impl H5Type for Record {
    fn hdf5_type() -> Datatype {
        Datatype::Compound { size: 0, fields: Vec::new() }
    }

    fn from_bytes(bytes: &[u8], of: &Datatype) -> Result<Record> {
        let Datatype::Compound { fields, .. } = of else {
            return Err(Error::InvalidData("a table of records without fields".into()));
        };
        let mut all = Vec::new();
        for field in fields {
            let Some((count, base)) = numbers_of(&field.datatype) else { continue };
            let size = dtype_element_size(base)?;
            let rest = bytes.get(field.byte_offset as usize..).ok_or_else(|| short("a record"))?;
            let each = elements(rest, size, count as usize).ok_or_else(|| short("a record"))?;
            all.extend(each.map(|b| number(b, base)));
        }
        Ok(Record(all))
    }

    fn element_size(of: &Datatype) -> usize {
        dtype_element_size(of).unwrap_or(0)
    }
}

fn short(what: &str) -> Error {
    Error::InvalidData(format!("{what} reaches beyond its bytes"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_of_odd_sizes_keep_their_sign() {
        assert_eq!(integer(&[0xff, 0xff, 0xff], ByteOrder::LittleEndian, true), -1.0);
        assert_eq!(integer(&[0x00, 0x01, 0x00], ByteOrder::BigEndian, true), 256.0);
        assert_eq!(integer(&[0xff; 8], ByteOrder::LittleEndian, true), -1.0);
        assert_eq!(integer(&[0xff; 2], ByteOrder::BigEndian, false), 65535.0);
    }
}
