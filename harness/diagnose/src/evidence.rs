//! The evidence of a structure, with a discrepancy of every size in the likelihood; and that of a cause in no vocabulary.

use crate::posterior::ln_sum;
use estimate::discrepancy::Disturbance;
use estimate::evidence::{Evidence, Reduced};
use estimate::fitted::Fitted;
use estimate::response::Place;
use rayon::prelude::*;

/// Sizes of the discrepancy that all recordings share, as a share of force and readings.
pub const SIZES: [f64; 6] = [0.0, 0.001, 0.003, 0.01, 0.03, 0.1];
/// Sizes of what each recording has of its own, where the cause is in no vocabulary.
pub const OWN_SIZES: [f64; 4] = [0.01, 0.03, 0.1, 0.3];
/// Sizes of the shared discrepancy beside it.
const SHARED_BESIDE: [f64; 2] = [0.0, 0.01];

/// A structure, weighed.
#[derive(Clone, Debug, PartialEq)]
pub struct Weighed {
    pub names: Vec<&'static str>,
    pub forms: Vec<&'static str>,
    /// False where a term stands in for physics that nobody has named.
    pub named: bool,
    /// Parameters of the mechanisms added.
    pub parameters: usize,
    pub chi2: f64,
    /// ln evidence by [`SIZES`], of instruments that only have noise, and of disturbed ones, every combination of
    /// [`Disturbance::ALL`] being as likely; NaN where the normal matrix is singular.
    pub ln: [Vec<f64>; 2],
    /// Overdispersion of the residual, and of what the likeliest discrepancy leaves of it.
    pub overdispersion: f64,
    pub left: f64,
    /// Whether a parameter of a mechanism rests at a bound.
    pub at_bound: bool,
    /// Misfit over range on levels its fit did not see, where it was worked out.
    pub heldout: Option<f64>,
}

impl Weighed {
    /// A fit of which no evidence is known.
    pub fn without_evidence(f: &Fitted) -> Weighed {
        Weighed {
            names: f.names(),
            forms: f.structure.terms().iter().map(|t| t.form.label).collect(),
            named: f.is_named(),
            parameters: f.parameters() as usize,
            chi2: f.chi2(),
            overdispersion: f.overdispersion(),
            left: f64::NAN,
            at_bound: !f.at_bounds().is_empty(),
            heldout: None,
            ln: [Vec::new(), Vec::new()],
        }
    }
}

/// A cause outside the vocabulary, beside a structure, weighed.
#[derive(Clone, Debug, PartialEq)]
pub struct Unknown {
    pub beside: Vec<&'static str>,
    pub place: Place,
    /// ln evidence by [`OWN_SIZES`], for each size of the shared discrepancy beside it.
    pub ln: Vec<f64>,
}

/// What a decision is weighed by.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Evidences {
    /// The simulation as given first.
    pub structures: Vec<Weighed>,
    pub unknown: Vec<Unknown>,
    /// Levels of the campaign.
    pub levels: usize,
    /// Whether recordings of different levels end in one and the same reading, several samples long.
    pub flat: bool,
}

impl Evidences {
    /// Nothing weighed yet of the campaign that `base` is fitted to.
    pub fn of(base: &Fitted) -> Evidences {
        let flat = base.structure.base().context.flat.is_some();
        Evidences { levels: base.data.levels().len(), flat, ..Evidences::default() }
    }

    /// ln of how many times better structure `i` predicts levels not seen than the simulation as given; None where that was
    /// not worked out, and of the simulation itself.
    pub fn better(&self, i: usize) -> Option<f64> {
        let given = self.structures.first()?.heldout?;
        let with = self.structures[i].heldout.filter(|_| i > 0)?;
        (given > 0.0 && with > 0.0).then(|| (given / with).ln())
    }

    /// Whether it predicts them worse.
    pub fn is_worse(&self, i: usize) -> bool {
        self.better(i).is_some_and(|b| b < 0.0)
    }
}

fn finite(v: Option<f64>) -> f64 {
    v.unwrap_or(f64::NAN)
}

/// The evidence of one fit; None where it cannot be simulated.
pub fn weighed(f: &Fitted) -> Option<Weighed> {
    let evidence = Evidence::new(f, &[])?;
    let reduced: Vec<Option<Reduced<'_>>> =
        combinations().par_iter().map(|disturbed| evidence.beside(None, disturbed)).collect();
    // by combination, then by size
    let all: Vec<[f64; SIZES.len()]> =
        reduced.iter().map(|r| SIZES.map(|size| finite(r.as_ref().and_then(|r| r.ln(size))))).collect();
    let mean = |size: usize| {
        let of: Vec<f64> = all[1..].iter().map(|ln| ln[size]).filter(|ln| ln.is_finite()).collect();
        ln_sum(&of) - (all.len() as f64 - 1.0).ln()
    };
    let ln = [all[0].to_vec(), (0..SIZES.len()).map(mean).collect()];
    let each = reduced.iter().zip(&all).flat_map(|(r, ln)| ln.iter().zip(SIZES).map(move |(ln, size)| (r, size, *ln)));
    let (likeliest, size, _) = each.filter(|(_, _, ln)| ln.is_finite()).max_by(|a, b| a.2.total_cmp(&b.2))?;
    let left = likeliest.as_ref().and_then(|r| r.overdispersion(size));
    Some(Weighed { left: finite(left), ln, ..Weighed::without_evidence(f) })
}

/// Every combination of the disturbances, none first.
fn combinations() -> Vec<Vec<Disturbance>> {
    let with = |bits: usize| Disturbance::ALL.into_iter().enumerate().filter(move |(i, _)| bits >> i & 1 == 1);
    (0..1 << Disturbance::ALL.len()).map(|bits| with(bits).map(|(_, d)| d).collect()).collect()
}

/// The evidence of a cause in no vocabulary beside `f`, by the place at which it enters.
pub fn unknown(f: &Fitted) -> Vec<Unknown> {
    let places = Place::all(&f.data);
    let Some(evidence) = Evidence::new(f, &places) else { return Vec::new() };
    let at = |(i, place): (usize, &Place)| {
        let reduced = OWN_SIZES.map(|own| evidence.beside(Some((i, own)), &[]));
        let of = |size: f64| reduced.iter().map(move |r| finite(r.as_ref().and_then(|r| r.ln(size))));
        Unknown { beside: f.names(), place: *place, ln: SHARED_BESIDE.into_iter().flat_map(of).collect() }
    };
    places.par_iter().enumerate().map(at).collect()
}
