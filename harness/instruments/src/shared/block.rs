//! Blocks of samples on their way to a sink.

use crate::{Sink, BLOCK};
use std::ops::ControlFlow;

/// Samples of all columns in a block, at most: tables with many columns get shorter blocks.
const CELLS: usize = 1 << 22;
/// Bytes of the file that a block is read from, at most: they fit into the pages that are kept.
const SPAN: u64 = 8 << 20;

/// Samples of a block of so many columns, at most.
pub(crate) fn most(columns: usize) -> usize {
    BLOCK.min(CELLS / columns.max(1)).max(1)
}

/// The blocks in which `samples` are read that lie `stride` bytes apart: first sample and count.
pub(crate) fn spans(samples: u64, stride: u64) -> impl Iterator<Item = (u64, usize)> {
    let most = (SPAN / stride.max(1)).clamp(1, BLOCK as u64);
    (0..samples).step_by(most as usize).map(move |first| (first, most.min(samples - first) as usize))
}

/// Hands columns of one length to a sink.
pub(crate) fn hand(columns: &[Vec<f64>], sink: &mut Sink) -> ControlFlow<()> {
    let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    sink(&slices)
}

/// Columns of equal length that are handed to a sink when they are full.
pub(crate) struct Block {
    pub columns: Vec<Vec<f64>>,
    /// Samples that make it full.
    pub most: usize,
}

impl Block {
    pub fn new(columns: usize) -> Block {
        Block { columns: vec![Vec::new(); columns], most: most(columns) }
    }

    /// Hands a full block to the sink.
    pub fn hand_full(&mut self, sink: &mut Sink) -> ControlFlow<()> {
        if self.columns.first().is_some_and(|c| c.len() >= self.most) {
            self.hand(sink)
        } else {
            ControlFlow::Continue(())
        }
    }

    /// Hands over what there is.
    pub fn hand(&mut self, sink: &mut Sink) -> ControlFlow<()> {
        if self.columns.iter().all(Vec::is_empty) {
            return ControlFlow::Continue(());
        }
        let flow = hand(&self.columns, sink);
        self.columns.iter_mut().for_each(Vec::clear);
        flow
    }
}
