//! The evidence of every structure that the search came to, with a discrepancy of every size in the likelihood.

use crate::candidate::Candidate;
use crate::decide::Decision;
use estimate::discrepancy::{instruments, own, shared, Columns};
use estimate::evidence::{Beside, Evidence};
use estimate::fitted::Fitted;
use estimate::problem::Options;
use estimate::response::Place;
use rayon::prelude::*;
use record::{Channel, Kind};

/// Sizes of the discrepancy that all recordings share, as a share of force and readings.
pub const SIZES: [f64; 6] = [0.0, 0.001, 0.003, 0.01, 0.03, 0.1];
/// Sizes of what each recording has of its own, where the cause is in no vocabulary.
pub const OWN_SIZES: [f64; 4] = [0.01, 0.03, 0.1, 0.3];
/// Sizes of the shared discrepancy beside it.
const SHARED_BESIDE: [f64; 2] = [0.0, 0.01];
/// Structures of one mechanism, and of two, that are weighed.
const SINGLES: usize = 8;
const PAIRS: usize = 4;

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
    /// ln evidence by [`SIZES`], without drift and hum of the instruments and with it; NaN where the normal matrix is
    /// singular.
    pub ln: [Vec<f64>; 2],
    /// Overdispersion of the residual, and of what the likeliest discrepancy leaves of it.
    pub overdispersion: f64,
    pub left: f64,
    /// Whether a parameter of a mechanism rests at a bound.
    pub at_bound: bool,
    /// Misfit over range on levels its fit did not see, where it was worked out.
    pub heldout: Option<f64>,
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
}

impl Evidences {
    /// Whether structure `i` predicts levels not seen worse than the simulation as given does.
    pub fn is_worse(&self, i: usize) -> bool {
        let given = self.structures.first().and_then(|w| w.heldout);
        matches!((self.structures[i].heldout, given), (Some(with), Some(without)) if i > 0 && with > without)
    }
}

fn finite(v: Option<f64>) -> f64 {
    v.unwrap_or(f64::NAN)
}

/// The evidence of one fit; None where it cannot be simulated.
pub fn weighed(f: &Fitted) -> Option<Weighed> {
    let evidence = Evidence::new(f, &shared(f)?, None, Some(&instruments(f)?))?;
    let beside = |instruments: bool| SIZES.map(|size| Beside { size, instruments, ..Beside::default() });
    let all = [beside(false), beside(true)];
    let ln = all.map(|of| of.iter().map(|b| finite(evidence.ln(*b))).collect::<Vec<f64>>());
    let each = all.iter().flatten().zip(ln.iter().flatten()).filter(|(_, ln)| ln.is_finite());
    let (best, _) = each.max_by(|a, b| a.1.total_cmp(b.1))?;
    Some(Weighed {
        names: f.names(),
        forms: f.structure.terms().iter().map(|t| t.form.label).collect(),
        named: f.is_named(),
        parameters: f.parameters() as usize,
        chi2: f.chi2(),
        overdispersion: f.overdispersion(),
        left: finite(evidence.overdispersion(*best)),
        at_bound: !f.at_bounds().is_empty(),
        heldout: None,
        ln,
    })
}

fn unknown(f: &Fitted, together: &Columns, place: Place) -> Option<Unknown> {
    let evidence = Evidence::new(f, together, Some(&own(f, place)?), None)?;
    let of = |size: f64, own: f64| finite(evidence.ln(Beside { size, own, instruments: false }));
    let ln = SHARED_BESIDE.iter().flat_map(|s| OWN_SIZES.map(|u| of(*s, u))).collect();
    Some(Unknown { beside: f.names(), place, ln })
}

/// Weighs what `d` chose and what it chose from; with the fits, in the order of the structures weighed.
pub fn weigh(d: &Decision) -> (Vec<Fitted>, Evidences) {
    // of several names, each may do without one of them
    let several = std::iter::once(&d.chosen).chain(d.pairs.first()).filter(|f| f.structure.terms().len() > 1);
    let fewer: Vec<Fitted> = several
        .flat_map(|f| (0..f.structure.terms().len()).filter_map(|i| f.without(i, &Options::default())))
        .collect();
    let singles = d.singles.iter().take(SINGLES).chain(d.singles.iter().filter(|s| s.calibrates()));
    let all = [&d.base, &d.chosen].into_iter().chain(&d.doubted).chain(singles);
    let mut pool: Vec<&Fitted> = Vec::new();
    for f in all.chain(d.pairs.iter().take(PAIRS)).chain(&fewer) {
        if pool.iter().all(|g| g.structure.forms() != f.structure.forms()) {
            pool.push(f);
        }
    }
    let (fits, structures): (Vec<Fitted>, Vec<Weighed>) =
        pool.into_par_iter().filter_map(|f| Some((f.clone(), weighed(f)?))).collect::<Vec<_>>().into_iter().unzip();
    let data = &d.base.data;
    let places: Vec<Place> = if data.kind == Kind::Indentation {
        vec![Place::Contact]
    } else {
        let channels = Channel::ALL.into_iter().filter(|c| data.has(*c)).map(Place::Reading);
        [Place::Contact, Place::Motion].into_iter().chain(channels).collect()
    };
    let named = d.singles.iter().find(|s| s.is_named());
    let mut beside: Vec<&Fitted> = vec![&d.base];
    beside.extend(named);
    let unknown = beside
        .into_iter()
        .filter_map(|f| Some((f, shared(f)?)))
        .flat_map(|(f, together)| places.par_iter().filter_map(|p| unknown(f, &together, *p)).collect::<Vec<_>>())
        .collect();
    let mut levels: Vec<usize> = data.records.iter().map(|r| r.level).collect();
    levels.sort_unstable();
    levels.dedup();
    (fits, Evidences { structures, unknown, levels: levels.len() })
}
