//! The coordinates in which the free variables of FMUs are fitted.
//!
//! Stiffness and exponent of a contact trade off along a narrow valley, and a damping coefficient with either. As in the
//! rigs built in, the fit goes by the force at the reference depth, the exponent and the ratio of damping to stiffness:
//! the variable of the exponent takes that of the stiffness along, so that the force stays; and the variable of the
//! damping follows both, so that the ratio stays. All other variables are their own coordinates.

use plant::machine::{Facts, FreeFacts, NearLaw};

/// Change of the exponent with a variable from which that is taken to bend the law: a mass or a stiffness does a little, as its law
/// is found from steps of some length.
const BENDS: f64 = 0.05;
/// Least change of ln force, and share of the damping, with a variable that is taken to move it.
const MOVES: f64 = 1e-3;
/// How far off its bounds the exponent stays where a fit starts.
const MARGIN: f64 = 0.05;
/// Least share of its exponent that a law is bent to.
const LEAST: f64 = 0.1;
/// How far the coordinate of the stiffness may go, ln of the force.
const WIDEST: f64 = 60.0;

/// Which free variables make the law of a contact, and how.
#[derive(Clone, Debug)]
pub(super) struct Coordinates {
    free: Vec<FreeFacts>,
    /// The law; None where nothing touches: every variable is its own coordinate.
    law: Option<NearLaw>,
    /// ln of the reference depth, m.
    ln_x: f64,
    /// The variable that scales the force and does not bend the law.
    pub scale: Option<usize>,
    /// The variable that bends the law.
    pub exponent: Option<usize>,
    /// The variable that moves the ratio of damping to stiffness and little else.
    pub damping: Option<usize>,
}

impl Coordinates {
    /// Of the free variables of `facts`, about the contact at `bond`; `x_ref`: the reference depth, m.
    pub fn new(facts: &Facts, bond: usize, x_ref: f64) -> Coordinates {
        let law = facts.bonds.get(bond).and_then(|b| b.law);
        let none =
            Coordinates { free: facts.free.clone(), law, ln_x: x_ref.ln(), scale: None, exponent: None, damping: None };
        let Some(law) = law else { return none };
        let bends = |i: &usize| law.exponent.slopes[*i].abs() > BENDS;
        let force = |i: usize| none.force(i).abs();
        let scales = |i: &usize| {
            law.exponent.slopes[*i].abs() <= MOVES && facts.free[*i].tolerance.is_none() && force(*i) > MOVES
        };
        let damps = |i: &usize| {
            let alone = !bends(i) && law.stiffness.slopes[*i].abs() < BENDS;
            alone && law.damping.at > 0.0 && law.damping.slopes[*i].abs() > MOVES * law.damping.at
        };
        let all = || 0..facts.free.len();
        Coordinates {
            scale: all().filter(scales).max_by(|a, b| force(*a).total_cmp(&force(*b))),
            exponent: all().find(bends),
            damping: all().find(damps),
            ..none
        }
    }

    /// Change of ln of the force at the reference depth with variable `i`.
    pub fn force(&self, i: usize) -> f64 {
        self.law.map_or(0.0, |l| l.stiffness.slopes[i] + self.ln_x * l.exponent.slopes[i])
    }

    /// By how much variable `e` of the exponent, `away` from where the system file has it, raises ln of the force at the reference
    /// depth, where nothing makes up for it.
    fn risen(&self, e: usize, away: f64) -> f64 {
        let law = |l: NearLaw| l.stiffness.slopes[e] * away + self.ln_x * l.exponent.at * (l.bent(e, away) - 1.0);
        self.law.map_or(0.0, law)
    }

    /// The coordinate of the exponent, and where it has to be for the exponent to be `by` above that of the coordinates `at`; None
    /// where no variable bends the law.
    pub fn bent(&self, at: &[f64], by: f64) -> Option<(usize, f64)> {
        let (i, law) = (self.exponent?, self.law?);
        let margin = MARGIN / law.exponent.slopes[i].abs();
        let (lower, upper) = self.bounds(i);
        let factor = law.bent(i, at[i]) + by / law.exponent.at;
        (upper - lower >= 2.0 * margin).then_some(())?;
        Some((i, law.bent_by(i, factor.max(LEAST)).clamp(lower + margin, upper - margin)))
    }

    /// Bounds of coordinate `i`.
    pub fn bounds(&self, i: usize) -> (f64, f64) {
        if Some(i) == self.scale && self.exponent.is_some() {
            return (-WIDEST, WIDEST);
        }
        self.own_bounds(i)
    }

    /// Bounds of variable `i` itself, in its measure.
    fn own_bounds(&self, i: usize) -> (f64, f64) {
        let f = &self.free[i];
        (f.away(f.bounds.0), f.away(f.bounds.1))
    }

    /// How far away every variable is where the coordinates are `at`, within its own bounds.
    pub fn free(&self, at: &[f64]) -> Vec<f64> {
        let mut free = at[..self.free.len()].to_vec();
        let within = |i: usize, away: f64| {
            let (lower, upper) = self.own_bounds(i);
            away.clamp(lower, upper)
        };
        if let (Some(s), Some(e)) = (self.scale, self.exponent) {
            free[s] = within(s, free[s] - self.risen(e, free[e]) / self.force(s));
        }
        if let (Some(d), Some(law)) = (self.damping, &self.law) {
            let others: f64 = (0..free.len()).filter(|i| *i != d).map(|i| law.damped(i, free[i])).product();
            if others > 0.0 {
                free[d] = within(d, law.damped_by(d, law.damped(d, free[d]) / others));
            }
        }
        free
    }

    /// The coordinate of the damping at which the ratio is `ratio`, s/m; None where no variable moves it alone.
    pub fn damping_of(&self, ratio: f64) -> Option<(usize, f64)> {
        let (i, law) = (self.damping?, self.law?);
        let (lower, upper) = self.bounds(i);
        Some((i, law.damped_by(i, ratio / law.damping.at).clamp(lower, upper)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mechanisms::physics::FREE;
    use plant::machine::{Along, BondFacts};

    /// A contact of 1e8 N/m^1.5 and a damping coefficient a quarter of that: stiffness by its logarithm, exponent by its own,
    /// coefficient straight.
    fn facts() -> Facts {
        let free = |name: &str, by_logarithm, nominal: f64| FreeFacts {
            name: name.into(),
            unit: "1".into(),
            nominal,
            by_logarithm,
            size: nominal,
            bounds: (0.0f64.max(nominal * 1e-12), nominal * 1e12),
            tolerance: None,
        };
        let mut law = NearLaw::default();
        (law.stiffness.at, law.exponent.at, law.damping.at) = (1e8f64.ln(), 1.5, 0.25);
        law.stiffness.slopes[0] = 1.0;
        law.damping.slopes[0] = -0.25;
        law.exponent.slopes[1] = 1.5;
        (law.damping.slopes[2], law.straight[2]) = (0.25, true);
        let bond = BondFacts {
            name: "stop".into(),
            is_contact: true,
            takes_force: true,
            turned: false,
            inside: false,
            reported: true,
            fed: false,
            mass: Along::default(),
            spring: (0.0, 0.0),
            law: Some(law),
        };
        let free = vec![free("k", true, 1e8), free("p", true, 1.5), free("mu", false, 2.5e7)];
        Facts { bonds: vec![bond], free, ..Facts::default() }
    }

    #[test]
    fn the_exponent_moves_neither_the_force_at_depth_nor_the_ratio_of_damping_and_the_stiffness_no_ratio() {
        let (facts, x) = (facts(), 1e-4f64);
        let c = Coordinates::new(&facts, 0, x);
        assert_eq!((c.scale, c.exponent, c.damping), (Some(0), Some(1), Some(2)));
        let of = |at: [f64; 3]| {
            let mut free = [0.0; FREE];
            free[..3].copy_from_slice(&c.free(&at));
            let law = facts.bonds[0].law.unwrap().of(&free);
            let (k, p) = (law.elastic.stiffness, law.elastic.exponent);
            (k * x.powf(p), p, law.hysteresis_damping.coefficient / k)
        };
        let (force, p, ratio) = of([0.0; 3]);
        for (at, by) in [([0.0, 0.2, 0.0], 1.0), ([0.3, 0.0, 0.0], 0.3f64.exp()), ([-1.0, -0.3, 0.0], (-1f64).exp())] {
            let moved = of(at);
            assert!((moved.0 / force / by - 1.0).abs() < 1e-9 && (moved.2 / ratio - 1.0).abs() < 1e-9, "{moved:?}");
            assert!((moved.1 - p * at[1].exp()).abs() < 1e-12);
        }
        let (place, at) = c.bent(&[0.0, 0.1, 0.0], 0.25).unwrap();
        assert!(place == 1 && (of([0.0, at, 0.0]).1 - of([0.0, 0.1, 0.0]).1 - 0.25).abs() < 1e-12);
        let (place, at) = c.damping_of(0.1).unwrap();
        let mut coordinates = [0.5, 0.1, 0.0];
        coordinates[place] = at;
        assert!((of(coordinates).2 - 0.1).abs() < 1e-12);
        assert_eq!(c.free(&[0.0; 3]), [0.0; 3]);
    }

    #[test]
    fn where_nothing_touches_every_variable_is_its_own_coordinate() {
        let mut facts = facts();
        facts.bonds[0].law = None;
        let c = Coordinates::new(&facts, 0, 1e-4);
        assert_eq!((c.scale, c.exponent, c.damping, c.damping_of(0.1)), (None, None, None, None));
        assert_eq!(c.free(&[0.1, 0.2, 0.3]), [0.1, 0.2, 0.3]);
    }
}
