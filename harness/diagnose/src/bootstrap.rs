//! How often noise alone would look as bad: parametric bootstrap of the whole detection on the campaign itself.

use super::decide::Decision;
use super::search::Search;
use estimate::condition::Guess;
use estimate::fitted::Fitted;
use estimate::prepare::Prepared;
use estimate::problem::{Data, Nuisance};
use estimate::structure::Structure;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use record::Campaign;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Nulls drawn and judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bootstrap {
    /// Nulls judged.
    pub nulls: usize,
    /// Nulls in which the pipeline saw a mismatch at all.
    pub detected: usize,
    /// Nulls that looked at least as bad as the campaign.
    pub as_bad: usize,
}

impl Bootstrap {
    /// (1 + as bad) / (1 + nulls): never zero, for N nulls say nothing below 1/N (Davison and Hinkley 1997, eq. 4.11).
    pub fn probability(&self) -> f64 {
        (1 + self.as_bad) as f64 / (1 + self.nulls) as f64
    }
}

/// A campaign as the base fit would give it: noise in the fitted colours, speeds measured with their scatter.
pub fn null(base: &Fitted, seed: u64) -> Data {
    let problem = base.problem();
    let mut data = (*base.data).clone();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let at_speed = problem.nuisances().iter().position(|n| *n == Nuisance::Speed);
    for r in 0..data.records.len() {
        let (trace, y) = problem.predict(&base.fit.point.theta, r, &base.fit.point.locals[r]);
        let noise = data.noise;
        let rec = &mut data.records[r];
        // what is drawn is drawn on the smoothed path
        rec.off_path.clear();
        for c in 0..3 {
            let Some(read) = &mut rec.y[c] else { continue };
            if y[c].len() != read.len() || (base.data.kind == record::Kind::Indentation && c == 2) {
                continue;
            }
            let mut w: Vec<f64> = (0..read.len()).map(|_| rng.sample(StandardNormal)).collect();
            noise[c].colour(&mut w);
            for k in 0..read.len() {
                read[k] = y[c][k] + if rec.weight[c][k] > 0.0 { w[k] / rec.weight[c][k] } else { w[k] };
            }
        }
        if let Some(s) = &mut rec.speed {
            let z: f64 = rng.sample(StandardNormal);
            let drawn = match at_speed {
                Some(i) if !rec.at_first => base.fit.point.locals[r][i],
                _ => trace.first_speed,
            };
            s.0 = drawn + s.1 * z;
        }
    }
    data
}

/// What one null came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Null {
    /// Its number, from 0 on, by which it is drawn.
    pub number: usize,
    /// Whether the pipeline saw a mismatch at all.
    pub detected: bool,
    /// Whether it looked at least as bad as the campaign.
    pub as_bad: bool,
}

impl Bootstrap {
    /// Of nulls judged anywhere, each counted once.
    pub fn of(nulls: &[Null]) -> Bootstrap {
        let count = |f: fn(&Null) -> bool| nulls.iter().filter(|n| f(n)).count();
        Bootstrap { nulls: nulls.len(), detected: count(|n| n.detected), as_bad: count(|n| n.as_bad) }
    }
}

/// Judges the nulls of these `numbers`; `observed` is the campaign's own [`Decision::strength`]. Stops early where `each` says
/// no.
pub fn bootstrap(
    c: &Campaign,
    guess: &Guess,
    base: &Fitted,
    numbers: impl Iterator<Item = usize>,
    observed: f64,
    each: &dyn Fn(usize) -> bool,
) -> Vec<Null> {
    let mut out = Vec::new();
    for i in numbers {
        if !each(i) {
            break;
        }
        let data = Arc::new(null(base, 1 + i as u64));
        let structure = Structure::given(c, &data);
        let simulation = Fitted::base(&data, &structure, guess);
        let search = Search::new(&Prepared { data, guess: *guess, structure });
        let d = Decision::new(search.propose(simulation));
        out.push(Null { number: i, detected: d.detected, as_bad: d.strength() >= observed });
    }
    out
}
