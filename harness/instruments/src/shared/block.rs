//! Samples collected until they make a block.

use crate::{Sink, BLOCK};
use std::ops::ControlFlow;

/// Samples of all columns in a block, at most: tables with many columns get shorter blocks.
const CELLS: usize = 1 << 22;

/// Columns of equal length that are handed to a sink when they are full.
pub(crate) struct Block {
    pub columns: Vec<Vec<f64>>,
    /// Samples that make it full.
    pub most: usize,
}

impl Block {
    pub fn new(columns: usize) -> Block {
        let most = BLOCK.min(CELLS / columns.max(1)).max(1);
        Block { columns: vec![Vec::new(); columns], most }
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
        let slices: Vec<&[f64]> = self.columns.iter().map(Vec::as_slice).collect();
        let flow = sink(&slices);
        self.columns.iter_mut().for_each(Vec::clear);
        flow
    }
}
