//! A law that was learned: which classes it is made of, their shapes, and what it predicts.

use crate::classes::{elastic, Class, ALL, RELAXES, SLOW};
use crate::press::{Path, Press, Recording};

/// A sum of classes with the shapes that were learned.
#[derive(Clone, Debug, PartialEq)]
pub struct Law {
    /// Indices into [`ALL`], increasing.
    pub classes: Vec<usize>,
    /// Coefficients of the elastic law's shapes, then of each class's, share of the range of force.
    pub coefficients: Vec<Vec<f64>>,
    pub press: Press,
    /// Which of [`Recording::surfaces`] is the surface; and where it was in each recording that it was learned from, m.
    pub surface: usize,
    pub surfaces: Vec<f64>,
}

/// The force of a law along a recording, N.
#[derive(Clone, Debug, PartialEq)]
pub struct Force {
    pub all: Vec<f64>,
    /// Of each class, in the law's order.
    pub parts: Vec<Vec<f64>>,
}

impl Law {
    /// The classes it is made of.
    pub fn classes(&self) -> impl Iterator<Item = &'static Class> + '_ {
        self.classes.iter().map(|c| &ALL[*c])
    }

    /// Other classes that may be there in the place of these, and how likely, 0 to 1: a branch that relaxes slower than the recordings
    /// last leaves what a permanent set leaves, and one touch of a place cannot part the two. A set beside relaxation may be such a
    /// branch, and as much of relaxation as such branches are may be a set; both are as likely beforehand. None where nothing of the
    /// kind is there.
    pub fn instead(&self) -> Option<(Vec<usize>, f64)> {
        let of = |name: &str| ALL.iter().position(|c| c.mechanism == Some(name));
        let (relaxation, plasticity) = (of("viscoelastic_relaxation")?, of("plastic_indentation")?);
        let at = self.classes.iter().position(|c| *c == relaxation)?;
        if self.classes.contains(&plasticity) {
            return Some((self.classes.iter().copied().filter(|c| *c != plasticity).collect(), 0.5));
        }
        let (mut slow, mut whole) = (0.0, 0.0);
        for branches in self.coefficients[at + 1].chunks(RELAXES) {
            whole += branches.iter().sum::<f64>();
            slow += branches.iter().rev().take(SLOW).sum::<f64>();
        }
        let mut classes: Vec<usize> = self.classes.iter().copied().filter(|c| *c != relaxation).collect();
        classes.push(plasticity);
        classes.sort_unstable();
        (slow > 0.0).then_some((classes, 0.5 * slow / whole))
    }

    /// Whether the contact of such classes sticks, so that it may pull.
    pub(crate) fn sticks(classes: &[usize]) -> bool {
        Law::holds(classes, "adhesion")
    }

    /// Whether the contact of such classes relaxes, so that its law would pull on a fast return.
    pub(crate) fn relaxes(classes: &[usize]) -> bool {
        Law::holds(classes, "viscoelastic_relaxation")
    }

    fn holds(classes: &[usize], mechanism: &str) -> bool {
        classes.iter().any(|c| ALL[*c].mechanism == Some(mechanism))
    }

    /// The force along a recording, of its motion alone but for where its surface is, m. A contact that does not stick does not
    /// pull; what acts on the body beside it may.
    pub fn force(&self, r: &Recording, surface: f64) -> Force {
        let path = Path::of(r, surface, &self.press);
        let sum = |shapes: Vec<Vec<f64>>, by: &[f64]| {
            let mut f = vec![0.0; r.time.len()];
            for (shape, c) in shapes.iter().zip(by).filter(|(_, c)| **c != 0.0) {
                f.iter_mut().zip(shape).for_each(|(f, s)| *f += c * self.press.force * s);
            }
            f
        };
        let mut all = sum(elastic(&path, &self.press), &self.coefficients[0]);
        let parts: Vec<Vec<f64>> = self
            .classes()
            .zip(&self.coefficients[1..])
            .map(|(c, by)| sum((c.shapes)(&path, &self.press), by))
            .collect();
        let add = |on_body: bool, all: &mut [f64]| {
            for (_, part) in self.classes().zip(&parts).filter(|(c, _)| c.on_body == on_body) {
                all.iter_mut().zip(part).for_each(|(f, p)| *f += p);
            }
        };
        add(false, &mut all);
        if !Law::sticks(&self.classes) {
            all.iter_mut().for_each(|f| *f = f.max(0.0));
        }
        add(true, &mut all);
        Force { all, parts }
    }

    /// The force along a recording that it has not seen, and where its surface is, m: where that explains most of it.
    pub fn predict(&self, r: &Recording) -> (Force, f64) {
        let left =
            |f: &Force| (0..f.all.len()).filter(|i| r.counts(*i)).map(|i| (r.force[i] - f.all[i]).powi(2)).sum::<f64>();
        let of = |surface: f64| {
            let f = self.force(r, surface);
            (left(&f), f, surface)
        };
        let surfaces = r.surfaces();
        let mut best = of(surfaces[self.surface]);
        for surface in surfaces {
            let other = of(surface);
            if other.0 < best.0 {
                best = other;
            }
        }
        (best.1, best.2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_permanent_set_beside_relaxation_may_be_a_slow_branch_and_slow_branches_a_set() {
        let at = |name: &str| ALL.iter().position(|c| c.name == name).unwrap();
        let (relaxation, plasticity, adhesion) = (at("relaxation"), at("plasticity"), at("adhesion"));
        let law = |classes: &[usize], branches: &[(usize, f64)]| {
            let of = |c: &usize| {
                let mut by = vec![0.0; 3 * RELAXES];
                branches.iter().filter(|_| *c == relaxation).for_each(|(i, b)| by[*i] = *b);
                by
            };
            Law {
                classes: classes.to_vec(),
                coefficients: std::iter::once(vec![1.0]).chain(classes.iter().map(of)).collect(),
                press: Press {
                    depth: 1.0,
                    force: 1.0,
                    rate: 1.0,
                    lasts: (1.0, 1.0),
                    pull: None,
                    orders: (0.0, 0.0),
                    levels: vec![0],
                    values: None,
                },
                surface: 0,
                surfaces: vec![0.0],
            }
        };
        let fast = [(1, 1.0)];
        let both = law(&[relaxation, adhesion, plasticity], &fast).instead();
        assert_eq!(both, Some((vec![relaxation, adhesion], 0.5)));
        assert!(law(&[adhesion, plasticity], &[]).instead().is_none() && law(&[relaxation], &fast).instead().is_none());
        // three quarters of the spectrum hardly fade
        let (classes, share) = law(&[relaxation, adhesion], &[(1, 1.0), (6, 2.0), (12, 1.0)]).instead().unwrap();
        assert_eq!((classes, share), (vec![adhesion, plasticity], 0.375));
    }
}
