//! cyclic_softening: the stiffness falls with the order of the recordings

use crate::load_history::LoadHistory;
use crate::mechanism::*;
use crate::part::{Part, Wear};
use crate::physics::Physics;
use crate::wear::{forms, CyclicChange, Direction};

/// k_i = k (1 - s (1 - exp(-(i - 1)/n))) (Mullins 1948; Landgraf, Morrow and Endo 1969), or with the
/// impulse or the energy taken before in place of the count (a linear sum of damage: Miner 1945).
pub const MECHANISM: Mechanism = Mechanism {
    name: "cyclic_softening",
    origin: Origin::Contact,
    named: true,
    equation: "k_i = k (1 - s (1 - exp(-(i - 1)/n))), or k (1 - s ((i - 1)/10)^q)",
    source: "Mullins 1948; Landgraf, Morrow and Endo 1969; Andrade 1910 (a power)",
    sentence: "the stiffness falls with the order of the recordings",
    cure: "The element holds the contact as it was when new; condition the contact first, or lower its stiffness from recording to recording as given here.",
    forms: forms::<CyclicSoftening>,
    acts: Acts::Reading,
    hints: Hints {
        starts_from: StartsFrom::Drift,
        depends_on_history: true,
        opposite_of: &["cyclic_hardening"],
        ..Hints::PLAIN
    },
};

/// Share of the stiffness that is left at least.
const LEAST: f64 = 0.05;

/// Stiffness lost with the load taken before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CyclicSoftening(pub CyclicChange);

impl Part for CyclicSoftening {
    fn wear(&self, history: &LoadHistory) -> Wear {
        self.0.wear(-1.0, LEAST, history)
    }
}

impl Direction for CyclicSoftening {
    const MOST: f64 = 0.9;
    const SHARE: &'static str = "softening_share";
    const ORDERS: &'static str = "softening_orders";
    const PER_TEN: &'static str = "softening_share_per_ten";
    const POWER: &'static str = "softening_power";
    const PER_DECADE: &'static str = "softening_share_per_decade";
    fn part(p: &mut Physics) -> &mut CyclicChange {
        &mut p.cyclic_softening.0
    }
}
