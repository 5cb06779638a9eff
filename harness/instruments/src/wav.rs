//! WAV: PCM of 8 to 32 bits and float, in blocks. Samples are parts of the full scale, which is 1.
//!
//! Our own reader: hound 3.5.1 refuses floats of 64 bits, chunks of odd length and data whose length was never written.
//! Source: Microsoft, Multiple Channel Audio Data and WAVE Files, 2007.

use crate::shared::binary::{Bytes, Number, Order, Walk};
use crate::shared::block::{hand, spans};
use crate::{Channel, Clock, Fault, Format, Group, Sink, Source};
use std::path::Path;

pub(crate) const FORMAT: Format = Format { name: "WAV", is, open };

/// Bytes that the sizes in a RIFF file can hold.
const LARGEST: u64 = u32::MAX as u64 + 8;
const PCM: u16 = 1;
const FLOAT: u16 = 3;
const EXTENSIBLE: u16 = 0xFFFE;

fn is(head: &[u8], _: &str) -> bool {
    matches!(head.get(..4), Some(b"RIFF" | b"RF64" | b"BW64")) && head.get(8..12) == Some(b"WAVE")
}

/// How a sample is stored; integers are parts of the full scale.
#[derive(Clone, Copy)]
enum Sample {
    /// Unsigned, of 8 bits.
    U8,
    I16,
    I24,
    I32,
    Float(Number),
}

impl Sample {
    fn of(tag: u16, size: u64) -> Option<Sample> {
        match (tag, size) {
            (PCM, 1) => Some(Sample::U8),
            (PCM, 2) => Some(Sample::I16),
            (PCM, 3) => Some(Sample::I24),
            (PCM, 4) => Some(Sample::I32),
            (FLOAT, 4) => Some(Sample::Float(Number::F32)),
            (FLOAT, 8) => Some(Sample::Float(Number::F64)),
            _ => None,
        }
    }

    fn read(self, bytes: &mut Bytes, at: u64, stride: u64, out: &mut [f64]) -> Result<(), Fault> {
        let full = |bits: i32| 0.5f64.powi(bits - 1);
        match self {
            Sample::U8 => bytes.each(at, stride, out, |[b]| (f64::from(b) - 128.0) * full(8)),
            Sample::I16 => bytes.each(at, stride, out, |b| f64::from(i16::from_le_bytes(b)) * full(16)),
            // the 24 bits are the upper ones of 32
            Sample::I24 => {
                bytes.each(at, stride, out, |[a, b, c]| f64::from(i32::from_le_bytes([0, a, b, c])) * full(32))
            }
            Sample::I32 => bytes.each(at, stride, out, |b| f64::from(i32::from_le_bytes(b)) * full(32)),
            Sample::Float(number) => bytes.numbers(at, stride, number, Order::Little, out),
        }
    }
}

/// What the chunk `fmt ` says.
struct Layout {
    sample: Sample,
    bits: u16,
    channels: u16,
    rate: u32,
    /// Bytes of one sample of all channels.
    frame: u64,
}

struct Wav {
    bytes: Bytes,
    layout: Layout,
    /// Byte of the first sample.
    data: u64,
    groups: Vec<Group>,
    notes: Vec<String>,
}

fn open(path: &Path) -> Result<Box<dyn Source>, Fault> {
    let mut bytes = Bytes::open(path)?;
    let length = bytes.length();
    if bytes.bytes(0, 4)? != b"RIFF" || length > LARGEST {
        let cure = "write files below 4 GB as RIFF, or export it as TDMS or HDF5";
        return Err(Fault::new(path, "a WAV of 64-bit sizes (RF64) or over 4 GB is not read", cure));
    }
    let mut walk = Walk { bytes: &mut bytes, at: 12, end: length, order: Order::Little };
    let (layout, data, claimed) = chunks(&mut walk)?;
    let frames = claimed.min(length - data) / layout.frame;
    if frames == 0 {
        return Err(bytes.fault(data, "the file holds no samples", "record or export it again"));
    }
    let mut notes = Vec::new();
    if claimed > length - data {
        notes.push(format!("the file ends before its data do: the {frames} samples that are there are read"));
    }
    let kind = if matches!(layout.sample, Sample::Float(_)) { "float" } else { "integer" };
    let properties =
        [("bits per sample", format!("{} ({kind})", layout.bits)), ("sampling rate", format!("{} Hz", layout.rate))];
    let group = Group {
        name: String::new(),
        channels: (1..=layout.channels)
            .map(|c| Channel { name: format!("channel {c}"), ..Channel::default() })
            .collect(),
        samples: frames,
        clock: Some(Clock { start: 0.0, step: 1.0 / f64::from(layout.rate) }),
        properties: properties.map(|(n, t)| (n.to_string(), t)).into(),
    };
    Ok(Box::new(Wav { bytes, layout, data, groups: vec![group], notes }))
}

/// The layout, the first byte of the data and the bytes that they claim.
fn chunks(walk: &mut Walk) -> Result<(Layout, u64, u64), Fault> {
    let mut found = None;
    loop {
        if !walk.has(8) {
            return Err(walk.fault("the file ends without a chunk \"data\"", "record or export it again"));
        }
        let (name, size) = (walk.array::<4>()?, walk.u32()?);
        let next = walk.at + u64::from(size) + u64::from(size % 2);
        match (&name, found) {
            (b"data", Some(layout)) => {
                // a recorder that stopped before it wrote the length leaves 0
                let claimed = if size == 0 { u64::from(u32::MAX) } else { u64::from(size) };
                return Ok((layout, walk.at, claimed));
            }
            (b"fmt ", _) => found = Some(layout(walk, size)?),
            (_, before) => found = before,
        }
        walk.at = next;
    }
}

fn layout(walk: &mut Walk, size: u32) -> Result<Layout, Fault> {
    let start = walk.at;
    let mut tag = walk.u16()?;
    let (channels, rate, _bytes_per_second, frame) = (walk.u16()?, walk.u32()?, walk.u32()?, walk.u16()?);
    let mut bits = walk.u16()?;
    if tag == EXTENSIBLE && size >= 40 {
        walk.skip(2)?;
        let valid = walk.u16()?;
        walk.skip(4)?;
        tag = walk.u16()?;
        bits = if valid > 0 { valid } else { bits };
    }
    let size = u64::from(frame.checked_div(channels).unwrap_or(0));
    let refused = |what: String| walk.bytes.fault(start, what, "export it as PCM of 16, 24 or 32 bits or as float");
    let sample =
        Sample::of(tag, size).ok_or_else(|| refused(format!("WAV of format {tag} with {bits} bits is not read")))?;
    if rate == 0 || frame % channels != 0 || u64::from(bits) > 8 * size {
        return Err(refused(format!("{channels} channels of {bits} bits in {frame} bytes at {rate} Hz cannot be")));
    }
    Ok(Layout { sample, bits, channels, rate, frame: u64::from(frame) })
}

impl Source for Wav {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn read(&mut self, group: usize, sink: &mut Sink) -> Result<(), Fault> {
        let (samples, layout) = (self.groups[group].samples, &self.layout);
        let size = layout.frame / u64::from(layout.channels);
        let mut block = vec![Vec::new(); layout.channels.into()];
        for (first, count) in spans(samples, layout.frame) {
            for (c, out) in block.iter_mut().enumerate() {
                out.resize(count, 0.0);
                let at = self.data + first * layout.frame + c as u64 * size;
                layout.sample.read(&mut self.bytes, at, layout.frame, out)?;
            }
            if hand(&block, sink).is_break() {
                return Ok(());
            }
        }
        Ok(())
    }
}
