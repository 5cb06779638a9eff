//! cyclic_hardening: the stiffness grows with the order of the recordings

use crate::load_history::LoadHistory;
use crate::mechanism::*;
use crate::part::{Part, Wear};
use crate::physics::Physics;
use crate::wear::{forms, CyclicChange, Direction};

/// k_i = k (1 + s (1 - exp(-(i - 1)/n))): a face that beds in or work-hardens (Morrow 1965; Johnson 1985, 9.2, on
/// shakedown), with the count of recordings, or with the impulse or the energy taken before.
pub const MECHANISM: Mechanism = Mechanism {
    name: "cyclic_hardening",
    origin: Origin::Contact,
    named: true,
    equation: "k_i = k (1 + s (1 - exp(-(i - 1)/n))), or k (1 + s ((i - 1)/10)^q)",
    source: "Morrow 1965; Johnson 1985, 9.2 (shakedown); Andrade 1910 (a power)",
    sentence: "the stiffness grows with the order of the recordings",
    cure: "The element holds the contact as it was when new; run the contact in first, or raise its stiffness from recording to recording as given here.",
    forms: forms::<CyclicHardening>,
    acts: Acts::Reading,
    hints: Hints {
        starts_from: StartsFrom::Drift,
        depends_on_history: true,
        opposite_of: &["cyclic_softening"],
        ..Hints::PLAIN
    },
};

/// Stiffness gained with the load taken before.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CyclicHardening(pub CyclicChange);

impl Part for CyclicHardening {
    fn wear(&self, history: &LoadHistory) -> Wear {
        self.0.wear(1.0, 1.0, history)
    }
}

impl Direction for CyclicHardening {
    const MOST: f64 = 9.0;
    const SHARE: &'static str = "hardening_share";
    const ORDERS: &'static str = "hardening_orders";
    const PER_TEN: &'static str = "hardening_share_per_ten";
    const POWER: &'static str = "hardening_power";
    const PER_DECADE: &'static str = "hardening_share_per_decade";
    fn part(p: &mut Physics) -> &mut CyclicChange {
        &mut p.cyclic_hardening.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wear::Course;

    #[test]
    fn stiffness_and_damping_grow_with_every_recording_towards_the_share() {
        let mut p = Physics::default();
        assert_eq!(p.wear(&LoadHistory::alike(5.0)), Wear { stiffness: 1.0, damping: 1.0 });
        p.cyclic_hardening.0 = CyclicChange { share: 0.2, course: Course::Saturating(3.0), ..CyclicChange::default() };
        let after = |n: f64| p.wear(&LoadHistory::alike(n)).stiffness;
        assert_eq!(after(0.0), 1.0);
        assert!((after(3.0) - (1.0 + 0.2 * (1.0 - (-1f64).exp()))).abs() < 1e-15);
        assert!(after(1.0) < after(2.0) && after(100.0) <= 1.2 && after(100.0) > 1.2 - 1e-9);
        p.cyclic_hardening.0.spares_damping = true;
        assert_eq!(p.wear(&LoadHistory::alike(3.0)).damping, 1.0);
    }
}
