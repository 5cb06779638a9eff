//! The search over structures: every mechanism fitted jointly with the base, forward selection with swaps.

use estimate::prepare::Prepared;
use estimate::problem::Data;
use estimate::structure::{Structure, Term};
use std::sync::Arc;

/// What the search holds fixed.
pub struct Search {
    pub data: Arc<Data>,
    /// The simulation as given.
    pub structure: Structure,
}

impl Search {
    /// Of a prepared campaign.
    pub fn new(prepared: &Prepared) -> Search {
        Search { data: prepared.data.clone(), structure: prepared.structure.clone() }
    }

    /// All terms that could be added, in forms that stand for themselves.
    pub fn candidates(&self) -> Vec<Term> {
        self.structure.base().candidates()
    }
}
