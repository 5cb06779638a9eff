//! Conversions of a channel's raw numbers to values in its unit.

use super::block::{self, Block};
use crate::shared::binary::{Bytes, EXPORT};
use crate::Fault;

/// Conversions that refer to each other, at most.
const DEPTH: usize = 8;
/// The links before the references.
const LINKS: usize = 4;

/// What becomes of a raw number.
#[derive(Clone, Debug)]
pub(super) enum Conversion {
    Identity,
    Linear {
        offset: f64,
        factor: f64,
    },
    /// (p0 x² + p1 x + p2) / (p3 x² + p4 x + p5)
    Rational([f64; 6]),
    /// Linear between the points, constant beyond them.
    Interpolated {
        from: Vec<f64>,
        to: Vec<f64>,
    },
    /// The value of the nearest point.
    Nearest {
        from: Vec<f64>,
        to: Vec<f64>,
    },
    /// Values of ranges, else the last.
    Ranges {
        ranges: Vec<[f64; 3]>,
        otherwise: f64,
    },
    /// Conversions of ranges, else the last; NaN where the file gives a text.
    Choice {
        ranges: Vec<([f64; 2], Option<Conversion>)>,
        otherwise: Option<Box<Conversion>>,
    },
}

/// A conversion with what is to be said of it; or why the channel cannot be converted.
type Answer = Result<(Conversion, Option<String>), String>;

/// Parameters that the conversions of a file may have yet, so that shared ones do not fill the memory.
pub(super) struct Budget(u64);

impl Default for Budget {
    fn default() -> Budget {
        Budget(4_000_000)
    }
}

/// The conversion at `at`; the identity where there is none.
pub(super) fn read(bytes: &mut Bytes, budget: &mut Budget, at: u64) -> Result<Answer, Fault> {
    nested(bytes, budget, at, 0)
}

/// The unit that the conversion at `at` gives.
pub(super) fn unit(bytes: &mut Bytes, at: u64) -> Result<String, Fault> {
    let link = if at == 0 { 0 } else { Block::read(bytes, at)?.link(1) };
    block::text(bytes, link)
}

fn nested(bytes: &mut Bytes, budget: &mut Budget, at: u64, depth: usize) -> Result<Answer, Fault> {
    if at == 0 {
        return Ok(Ok((Conversion::Identity, None)));
    }
    let block = Block::read(bytes, at)?;
    if &block.id != b"##CC" || depth > DEPTH {
        return Err(bytes.fault(at, "a conversion is expected here, and none of endless references", EXPORT));
    }
    let mut walk = block.walk(bytes);
    let kind = walk.u8()?;
    walk.skip(5)?;
    let count = u64::from(walk.u16()?);
    walk.skip(16)?;
    if !walk.has(8 * count) {
        return Err(walk.fault(format!("{count} parameters of a conversion are claimed"), EXPORT));
    }
    let Some(left) = budget.0.checked_sub(1 + count) else {
        return Ok(Err("the conversions of the file are too large".to_string()));
    };
    budget.0 = left;
    let p = (0..count).map(|_| walk.f64()).collect::<Result<Vec<f64>, Fault>>()?;
    let text = |note: &str| Ok(Ok((Conversion::Identity, Some(note.to_string()))));
    let conversion = match (kind, p.as_slice()) {
        (0, _) => Some(Conversion::Identity),
        (1, [offset, factor, ..]) => Some(Conversion::Linear { offset: *offset, factor: *factor }),
        (2, _) => p.get(..6).and_then(|p| p.try_into().ok()).map(Conversion::Rational),
        (3, _) => return Ok(Err("its conversion is a formula; export it with values in its unit".to_string())),
        (4 | 5, _) => table(kind, &p),
        (6, _) => ranges(&p),
        (7, _) => return choice(bytes, budget, &block, p.iter().map(|v| [*v, *v]).collect(), depth),
        (8, _) => return choice(bytes, budget, &block, p.chunks_exact(2).map(|v| [v[0], v[1]]).collect(), depth),
        (9 | 10, _) => return Ok(Err("it holds text".to_string())),
        (11, _) => return text("has texts for its bits: its numbers are read as they are"),
        _ => return Ok(Err(format!("its conversion is of the unknown type {kind}"))),
    };
    match conversion {
        Some(conversion) => Ok(Ok((conversion, None))),
        None => Err(bytes.fault(at, format!("a conversion of type {kind} has wrong parameters"), EXPORT)),
    }
}

fn table(kind: u8, p: &[f64]) -> Option<Conversion> {
    let (from, to): (Vec<f64>, Vec<f64>) = p.chunks_exact(2).map(|p| (p[0], p[1])).unzip();
    if from.is_empty() || !from.windows(2).all(|w| w[0] < w[1]) {
        return None;
    }
    Some(if kind == 4 { Conversion::Interpolated { from, to } } else { Conversion::Nearest { from, to } })
}

fn ranges(p: &[f64]) -> Option<Conversion> {
    let (otherwise, triples) = p.split_last()?;
    let ranges: Vec<[f64; 3]> = triples.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
    rising(ranges.iter().map(|r| [r[0], r[1]])).then_some(Conversion::Ranges { ranges, otherwise: *otherwise })
}

/// Whether the ranges follow each other.
fn rising(ranges: impl Iterator<Item = [f64; 2]>) -> bool {
    let mut last = f64::NEG_INFINITY;
    ranges.into_iter().all(|[low, high]| {
        let follows = last <= low && low <= high;
        last = high;
        follows
    })
}

/// A conversion of texts, where some references may be conversions of numbers.
fn choice(
    bytes: &mut Bytes,
    budget: &mut Budget,
    block: &Block,
    keys: Vec<[f64; 2]>,
    depth: usize,
) -> Result<Answer, Fault> {
    let of = "has texts for some numbers";
    let mut references = Vec::new();
    for i in 0..=keys.len() {
        let at = block.link(LINKS + i);
        let numeric = at != 0 && &Block::read(bytes, at)?.id == b"##CC";
        references.push(match numeric.then(|| nested(bytes, budget, at, depth + 1)).transpose()? {
            None => None,
            Some(Ok((conversion, _))) => Some(conversion),
            Some(Err(why)) => return Ok(Err(why)),
        });
    }
    if references.iter().all(Option::is_none) {
        return Ok(Ok((Conversion::Identity, Some(format!("{of}: its numbers are read as they are")))));
    }
    let otherwise = references.pop().flatten().map(Box::new);
    let mut ranges: Vec<([f64; 2], Option<Conversion>)> = keys.into_iter().zip(references).collect();
    ranges.sort_by(|a, b| a.0[0].total_cmp(&b.0[0]));
    if !rising(ranges.iter().map(|r| r.0)) {
        return Ok(Err("the ranges of its conversion overlap".to_string()));
    }
    Ok(Ok((Conversion::Choice { ranges, otherwise }, Some(format!("{of}: these are missing")))))
}

impl Conversion {
    /// Offset and factor, where the conversion is a line.
    pub(super) fn line(&self) -> Option<(f64, f64)> {
        match self {
            Conversion::Identity => Some((0.0, 1.0)),
            Conversion::Linear { offset, factor } => Some((*offset, *factor)),
            _ => None,
        }
    }

    /// Converts raw numbers; `whole`: they are stored as integers, for which a range holds its upper end.
    pub(super) fn apply(&self, values: &mut [f64], whole: bool) {
        if !matches!(self, Conversion::Identity) {
            values.iter_mut().for_each(|x| *x = self.of(*x, whole));
        }
    }

    fn of(&self, x: f64, whole: bool) -> f64 {
        match self {
            Conversion::Identity => x,
            Conversion::Linear { offset, factor } => factor * x + offset,
            Conversion::Rational(p) => ((p[0] * x + p[1]) * x + p[2]) / ((p[3] * x + p[4]) * x + p[5]),
            Conversion::Interpolated { from, to } => crate::shared::interpolate::linear(from, to, x),
            Conversion::Nearest { from, to } => crate::shared::interpolate::nearest(from, to, x),
            Conversion::Ranges { .. } | Conversion::Choice { .. } if x.is_nan() => x,
            Conversion::Ranges { ranges, otherwise } => {
                range(ranges, |r| [r[0], r[1]], x, whole).map_or(*otherwise, |r| r[2])
            }
            Conversion::Choice { ranges, otherwise } => {
                let chosen = match range(ranges, |r| r.0, x, whole) {
                    Some((_, conversion)) => conversion.as_ref(),
                    None => otherwise.as_deref(),
                };
                chosen.map_or(f64::NAN, |c| c.of(x, whole))
            }
        }
    }
}

/// The range that holds `x`, of rising ranges.
fn range<T>(ranges: &[T], ends: impl Fn(&T) -> [f64; 2], x: f64, whole: bool) -> Option<&T> {
    let after = ranges.partition_point(|r| ends(r)[0] <= x);
    let found = ranges.get(after.checked_sub(1)?)?;
    let [low, high] = ends(found);
    (x < high || x == high && (whole || low == high)).then_some(found)
}
