//! A file whose format is read whole, kept in memory.

use super::block::hand;
use crate::{Fault, Group, Sink, Source, BLOCK};

/// Groups with all their samples.
#[derive(Debug, Default)]
pub struct Memory {
    pub groups: Vec<Group>,
    /// Of each group, of each channel: its samples; a channel may be shorter than the group.
    pub samples: Vec<Vec<Vec<f64>>>,
    pub notes: Vec<String>,
}

impl Source for Memory {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn read(&mut self, group: usize, sink: &mut Sink) -> Result<(), Fault> {
        let channels = &self.samples[group];
        let longest = channels.iter().map(Vec::len).max().unwrap_or(0);
        for at in (0..longest).step_by(BLOCK) {
            let end = (at + BLOCK).min(longest);
            let blocks: Vec<Vec<f64>> =
                channels.iter().map(|c| (at..end).map(|i| c.get(i).copied().unwrap_or(f64::NAN)).collect()).collect();
            if hand(&blocks, sink).is_break() {
                return Ok(());
            }
        }
        Ok(())
    }
}
