//! HDF5, as scripts and instruments write it: <https://docs.hdfgroup.org/documentation/hdf5/latest/_f_m_t3.html>.
//!
//! A dataset of one axis is a channel, one of two axes a channel for each place on the shorter axis, a table of
//! compound records a group with a channel for each field. Datasets of one parent, length and clock form a group. Read
//! in blocks. A file that was cut is refused: its index may lie anywhere in it.

mod attributes;
mod clock;
mod element;
mod layout;
mod lzf;
mod matlab;
mod source;
mod tree;

pub(crate) use source::open;

use crate::Format;

const SIGNATURE: &[u8] = b"\x89HDF\r\n\x1a\n";

pub(crate) const FORMAT: Format = Format { name: "HDF5", is, open: |path| open(path, Dialect::Plain) };

/// Who wrote the file: MATLAB has conventions of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Dialect {
    Plain,
    Matlab,
}

/// The signature stands at the start, or behind a block of the writer's own of 512, 1024, 2048 ... bytes.
pub(crate) fn is(head: &[u8], _extension: &str) -> bool {
    [0, 512, 1024, 2048].iter().any(|&at| head.get(at..).is_some_and(|rest| rest.starts_with(SIGNATURE)))
}
