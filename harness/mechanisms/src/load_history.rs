//! What the recordings before have done to a contact.

/// What of the recordings before wears a contact.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Dose {
    Recordings,
    Impulse,
    Energy,
}

/// What a contact had taken before a recording, each in units of the campaign's mean recording.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LoadHistory {
    pub recordings: f64,
    pub impulse: f64,
    pub energy: f64,
}

impl LoadHistory {
    /// After `n` recordings that are all alike.
    pub fn alike(n: f64) -> LoadHistory {
        let n = n.max(0.0);
        LoadHistory { recordings: n, impulse: n, energy: n }
    }

    /// What was taken before each recording of a campaign: `order` from 1, and `severity`, which impulse goes with
    /// (impact speed, depth; energy goes with its square). A place in the order that no recording fills counts as a
    /// mean one.
    pub fn before(order: &[f64], severity: &[f64]) -> Vec<LoadHistory> {
        let n = severity.len().max(1) as f64;
        let mean = severity.iter().sum::<f64>() / n;
        let square = severity.iter().map(|s| s * s).sum::<f64>() / n;
        let at = |o: f64| {
            let mut taken = LoadHistory::alike(o - 1.0);
            for (_, s) in order.iter().zip(severity).filter(|(p, _)| **p < o) {
                taken.impulse += s / mean - 1.0;
                taken.energy += s * s / square - 1.0;
            }
            taken
        };
        order.iter().map(|o| at(*o)).collect()
    }

    /// How much of it counts by that dose.
    pub fn by(&self, dose: Dose) -> f64 {
        match dose {
            Dose::Recordings => self.recordings,
            Dose::Impulse => self.impulse,
            Dose::Energy => self.energy,
        }
        .max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn alike_recordings_count_alike_by_every_dose() {
        let orders = [3.0, 1.0, 2.0, 6.0];
        for (t, o) in LoadHistory::before(&orders, &[0.4; 4]).iter().zip(orders) {
            for dose in [Dose::Recordings, Dose::Impulse, Dose::Energy] {
                assert!((t.by(dose) - (o - 1.0)).abs() < 1e-12, "{t:?}");
            }
        }
    }

    #[test]
    fn impulse_goes_with_the_speeds_before_and_energy_with_their_squares() {
        let taken = LoadHistory::before(&[1.0, 2.0, 3.0], &[1.0, 2.0, 3.0]);
        assert_eq!(taken[0], LoadHistory::alike(0.0));
        assert!((taken[2].by(Dose::Impulse) - 3.0 / 2.0).abs() < 1e-12, "{taken:?}");
        assert!((taken[2].by(Dose::Energy) - 5.0 / (14.0 / 3.0)).abs() < 1e-12, "{taken:?}");
    }
}
