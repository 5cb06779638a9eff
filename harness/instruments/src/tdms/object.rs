//! Objects of a TDMS file: the file itself, groups and channels, their properties and where their samples lie.

use super::index::{number, Index, STRING, TIMESTAMP};
use crate::shared::binary::{Number, Order, Walk, EXPORT};
use crate::Fault;
use std::collections::HashMap;

/// Seconds from 1904-01-01, from which timestamps count, to 1970-01-01.
const EPOCH: i64 = 2_082_844_800;

/// How samples of a channel are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Stored {
    Number(Number),
    /// Seconds and parts of 2^-64 s.
    Time,
    /// A bit of a byte.
    Line(u32),
}

/// Samples that lie in runs: `run` samples each `stride` bytes after the last, each run `pitch` bytes after the last.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) at: u64,
    pub(super) run: u64,
    pub(super) stride: u64,
    pub(super) pitch: u64,
    pub(super) count: u64,
    pub(super) stored: Stored,
    pub(super) order: Order,
}

/// The samples of a channel, or of one of its DAQmx scalers.
#[derive(Debug)]
pub(super) struct Track {
    pub(super) scaler: Option<u32>,
    pub(super) pieces: Vec<Piece>,
}

/// A property's value.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Number(f64),
    Text(String),
    /// Seconds from 1904 and parts of 2^-64 s.
    Time((i64, u64)),
}

/// The file, a group or a channel.
#[derive(Default, Debug)]
pub(super) struct Object {
    pub(super) path: String,
    /// The path of the channel's group; empty where this is no channel.
    pub(super) group: String,
    properties: Vec<(String, Value)>,
    places: HashMap<String, usize>,
    /// That of its last segment with one.
    pub(super) index: Option<Index>,
    pub(super) tracks: Vec<Track>,
    pub(super) samples: u64,
    /// The first timestamp of a channel of timestamps.
    pub(super) origin: (i64, u64),
    /// Why its samples are not read.
    pub(super) left_out: Option<String>,
}

/// Names in a path such as `/'Group'/'It''s'`.
fn names(path: &str) -> Option<Vec<String>> {
    let mut names = Vec::new();
    let mut rest = path.chars().peekable();
    while rest.next_if_eq(&'/').is_some() {
        if rest.next_if_eq(&'\'').is_none() {
            return (rest.peek().is_none() && names.is_empty()).then_some(names);
        }
        let mut name = String::new();
        loop {
            match rest.next()? {
                '\'' if rest.next_if_eq(&'\'').is_some() => name.push('\''),
                '\'' => break,
                other => name.push(other),
            }
        }
        names.push(name);
    }
    rest.peek().is_none().then_some(names)
}

pub(super) fn path_of_group(name: &str) -> String {
    format!("/'{}'", name.replace('\'', "''"))
}

impl Object {
    pub(super) fn new(path: String) -> Object {
        let group = match names(&path).as_deref() {
            Some([group, _]) => path_of_group(group),
            _ => String::new(),
        };
        Object { path, group, ..Object::default() }
    }

    /// The group's and the channel's name; None where this is no channel.
    pub(super) fn names(&self) -> Option<(String, String)> {
        let [group, channel] = <[String; 2]>::try_from(names(&self.path)?).ok()?;
        Some((group, channel))
    }

    pub(super) fn is_daqmx(&self) -> bool {
        self.tracks.iter().any(|t| t.scaler.is_some())
    }

    pub(super) fn stored(&self) -> Option<Stored> {
        Some(self.tracks.first()?.pieces.first()?.stored)
    }

    fn value(&self, name: &str) -> Option<&Value> {
        self.places.get(name).map(|i| &self.properties[*i].1)
    }

    pub(super) fn number(&self, name: &str) -> Option<f64> {
        match self.value(name)? {
            Value::Number(n) => Some(*n),
            Value::Text(_) | Value::Time(_) => None,
        }
    }

    pub(super) fn text(&self, name: &str) -> Option<&str> {
        match self.value(name)? {
            Value::Text(t) => Some(t),
            Value::Number(_) | Value::Time(_) => None,
        }
    }

    /// When the waveform begins, seconds from 1904 and parts of 2^-64 s; None where it does not say so.
    pub(super) fn begin(&self) -> Option<(i64, u64)> {
        match self.value("wf_start_time")? {
            // LabVIEW writes 0 where it does not know
            Value::Time(t) => Some(*t).filter(|t| t.0 != 0),
            _ => None,
        }
    }

    pub(super) fn property_names(&self) -> impl Iterator<Item = &str> {
        self.properties.iter().map(|(n, _)| n.as_str())
    }

    /// The properties that a person wrote, as texts.
    pub(super) fn texts(&self, before: &str) -> impl Iterator<Item = (String, String)> + '_ {
        let before = before.to_string();
        let of_machine =
            |n: &str| n.starts_with("NI_") || n == "unit_string" || n.starts_with("wf_") && n != "wf_start_time";
        self.properties.iter().filter(move |(n, _)| !of_machine(n)).map(move |(n, v)| {
            let text = match v {
                Value::Number(x) => x.to_string(),
                Value::Text(t) => t.clone(),
                Value::Time(t) => date(*t),
            };
            (format!("{before}{n}"), text)
        })
    }

    pub(super) fn set(&mut self, name: String, value: Value) {
        match self.places.get(&name) {
            Some(i) => self.properties[*i].1 = value,
            None => {
                self.places.insert(name.clone(), self.properties.len());
                self.properties.push((name, value));
            }
        }
    }

    /// Adds samples, as a longer run of the last piece where they follow its pattern.
    pub(super) fn push(&mut self, scaler: Option<u32>, piece: Piece) {
        if piece.count == 0 {
            return;
        }
        let at = self.tracks.iter().position(|t| t.scaler == scaler).unwrap_or_else(|| {
            self.tracks.push(Track { scaler, pieces: Vec::new() });
            self.tracks.len() - 1
        });
        let pieces = &mut self.tracks[at].pieces;
        if let Some(last) = pieces.last_mut() {
            let alike = (last.run, last.stride, last.stored, last.order)
                == (piece.run, piece.stride, piece.stored, piece.order);
            let whole = last.count % last.run == 0;
            let next = piece.at.saturating_sub(last.at);
            let pitch = if last.count == last.run { next } else { last.pitch };
            let inside = piece.count <= piece.run || piece.pitch == pitch;
            if alike && whole && inside && next > 0 && next == last.count / last.run * pitch {
                last.pitch = pitch;
                last.count += piece.count;
                return;
            }
        }
        pieces.push(piece);
    }
}

/// Reads a property's name and value.
pub(super) fn property(walk: &mut Walk) -> Result<(String, Value), Fault> {
    let size = walk.u32()?;
    let name = walk.text(size.into())?;
    let value = match walk.u32()? {
        STRING => {
            let size = walk.u32()?;
            Value::Text(walk.text(size.into())?)
        }
        TIMESTAMP => {
            let order = walk.order;
            Value::Time(timestamp(walk.array()?, order))
        }
        kind => match number(kind) {
            Some(number) => Value::Number(walk.number(number)?),
            None => return Err(walk.fault(format!("property \"{name}\" is of the unknown type {kind:#x}"), EXPORT)),
        },
    };
    Ok((name, value))
}

/// Seconds from 1904 and parts of 2^-64 s.
pub(super) fn timestamp(bytes: [u8; 16], order: Order) -> (i64, u64) {
    let whole = match order {
        Order::Little => u128::from_le_bytes(bytes),
        Order::Big => u128::from_be_bytes(bytes),
    };
    ((whole >> 64) as i64, whole as u64)
}

/// Seconds from one timestamp to another.
pub(super) fn seconds((whole, parts): (i64, u64), (whole_from, parts_from): (i64, u64)) -> f64 {
    let parts = i128::from(parts) - i128::from(parts_from);
    (i128::from(whole) - i128::from(whole_from)) as f64 + parts as f64 / 2f64.powi(64)
}

/// The date and time of a timestamp, in UTC.
pub(super) fn date((whole, parts): (i64, u64)) -> String {
    crate::shared::date::utc(whole.saturating_sub(EPOCH), (parts >> 32) as f64 / 2f64.powi(32))
}
