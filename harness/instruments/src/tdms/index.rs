//! The raw data index of an object: of which form its samples are in a chunk of a segment.

use super::object::Stored;
use crate::shared::binary::{Number, Order, Walk, EXPORT};
use crate::Fault;
use std::sync::Arc;

pub(super) const FORMAT_CHANGING: u32 = 0x1269;
pub(super) const DIGITAL_LINE: u32 = 0x126A;
pub(super) const STRING: u32 = 0x20;
pub(super) const TIMESTAMP: u32 = 0x44;

/// Where the raw data of an object lie in a chunk of a segment.
#[derive(Clone, Debug)]
pub(super) enum Index {
    Plain { form: Form, values: u64, bytes: u64 },
    Daqmx { values: u64, scalers: Arc<[Scaler]>, widths: Arc<[u32]> },
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Form {
    Read(Stored),
    Text,
    /// Complex numbers of that many bytes.
    Complex(u64),
}

#[derive(Clone, Copy, Debug)]
pub(super) struct Scaler {
    pub(super) stored: Option<Stored>,
    pub(super) buffer: usize,
    /// Bytes from the start of a row of the buffer.
    pub(super) offset: u64,
    pub(super) size: u64,
    pub(super) id: u32,
}

impl Form {
    /// Bytes of one value; 1 for text, whose bytes the index claims.
    pub(super) fn size(self) -> u64 {
        match self {
            Form::Read(Stored::Number(number)) => number.size(),
            Form::Read(Stored::Line(_)) | Form::Text => 1,
            Form::Read(Stored::Time) => 16,
            Form::Complex(size) => size,
        }
    }
}

impl Index {
    pub(super) fn values(&self) -> u64 {
        match self {
            Index::Plain { values, .. } | Index::Daqmx { values, .. } => *values,
        }
    }

    /// Bytes in a chunk of contiguous data; None where they are more than any file's.
    pub(super) fn bytes(&self) -> Option<u64> {
        match self {
            Index::Plain { form: Form::Text, bytes, .. } => Some(*bytes),
            Index::Plain { form, values, .. } => values.checked_mul(form.size()),
            Index::Daqmx { .. } => Some(0),
        }
    }
}

/// Reads the index of data that are stored as they are.
pub(super) fn plain(walk: &mut Walk) -> Result<Index, Fault> {
    let (kind, dimension, values) = (walk.u32()?, walk.u32()?, walk.u64()?);
    if dimension != 1 {
        return Err(walk.fault(format!("an array of {dimension} dimensions is claimed"), EXPORT));
    }
    let form = match kind {
        STRING => Form::Text,
        TIMESTAMP => Form::Read(Stored::Time),
        0x0008_000C => Form::Complex(8),
        0x0010_000D => Form::Complex(16),
        _ => match number(kind) {
            Some(number) => Form::Read(Stored::Number(number)),
            None => return Err(walk.fault(format!("data of type {kind:#x} are not read"), "save the channel as DBL")),
        },
    };
    let bytes = if form == Form::Text { walk.u64()? } else { 0 };
    Ok(Index::Plain { form, values, bytes })
}

/// Reads the index of DAQmx data: of numbers, or of lines of a digital port.
pub(super) fn daqmx(walk: &mut Walk, lines: bool) -> Result<Index, Fault> {
    let (_kind, dimension, values) = (walk.u32()?, walk.u32()?, walk.u64()?);
    if dimension != 1 {
        return Err(walk.fault(format!("an array of {dimension} dimensions is claimed"), EXPORT));
    }
    let mut scalers = Vec::new();
    for _ in 0..walk.u32()? {
        scalers.push(if lines { line_scaler(walk)? } else { scaler(walk)? });
    }
    let mut widths = Vec::new();
    for _ in 0..walk.u32()? {
        widths.push(walk.u32()?);
    }
    Ok(Index::Daqmx { values, scalers: scalers.into(), widths: widths.into() })
}

fn scaler(walk: &mut Walk) -> Result<Scaler, Fault> {
    let (kind, buffer, offset, _bitmap, id) = (walk.u32()?, walk.u32()?, walk.u32()?, walk.u32()?, walk.u32()?);
    let number = daqmx_number(kind);
    let size = number.map_or(1, Number::size);
    Ok(Scaler { stored: number.map(Stored::Number), buffer: buffer as usize, offset: offset.into(), size, id })
}

/// A line of a digital port: one bit.
fn line_scaler(walk: &mut Walk) -> Result<Scaler, Fault> {
    let (kind, buffer, bits, _bitmap, id) = (walk.u32()?, walk.u32()?, walk.u32()?, walk.u8()?, walk.u32()?);
    let size = daqmx_number(kind).map_or(1, Number::size);
    let byte = u64::from(bits / 8);
    // the bit lies in the lowest byte of the number that begins at that byte
    let offset = if walk.order == Order::Big { byte + size - 1 } else { byte };
    Ok(Scaler { stored: Some(Stored::Line(bits % 8)), buffer: buffer as usize, offset, size: 1, id })
}

fn daqmx_number(kind: u32) -> Option<Number> {
    use Number::*;
    [U8, I8, U16, I16, U32, I32, U64, I64, F32, F64].get(kind as usize).copied()
}

/// How a type of TDMS is stored; None where it is no number.
pub(super) fn number(kind: u32) -> Option<Number> {
    Some(match kind {
        1 => Number::I8,
        2 => Number::I16,
        3 => Number::I32,
        4 => Number::I64,
        5 | 0x21 => Number::U8,
        6 => Number::U16,
        7 => Number::U32,
        8 => Number::U64,
        9 | 0x19 => Number::F32,
        10 | 0x1A => Number::F64,
        _ => return None,
    })
}
