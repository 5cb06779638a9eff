//! A law that was learned: which classes it is made of, their shapes, and what it predicts.

use crate::classes::{elastic, Class, ALL};
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

    /// The force along a recording, of its motion alone but for where its surface is, m. A contact that does not stick does not
    /// pull.
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
        for part in &parts {
            all.iter_mut().zip(part).for_each(|(f, p)| *f += p);
        }
        if !self.classes().any(|c| c.mechanism == Some("adhesion")) {
            all.iter_mut().for_each(|f| *f = f.max(0.0));
        }
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
