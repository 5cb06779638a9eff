//! What several formats share: bytes and lines of a file, cells of text, heads of tables, dates, blocks of samples.

pub(crate) mod binary;
pub(crate) mod block;
pub(crate) mod cell;
pub(crate) mod clock;
pub(crate) mod date;
pub(crate) mod exact;
pub(crate) mod guard;
pub(crate) mod half;
pub(crate) mod head;
pub(crate) mod interpolate;
pub(crate) mod lines;
pub(crate) mod memory;
pub(crate) mod stamp;
pub(crate) mod unit;
