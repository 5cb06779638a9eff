//! When an effect acts: its own share in approach, loading, unloading and after.

use super::candidate::Candidate;
use super::mechanism::{Acts, Origin};
use super::search::Search;
use crate::model::estimate::{Model, Problem};
use crate::model::simulate::{simulate, Local, Setup, Trace};
use crate::record::{Channel, Kind};

impl Search<'_> {
    /// Share of a term's own action in approach, loading, unloading and after, over all recordings.
    pub fn acts(&self, chosen: &Candidate, term: usize) -> [f64; 4] {
        let model: Model<'_> = self.model(&chosen.make_up, 1.0, 1.0, 0.0);
        let problem = Problem::new(self.data, &model);
        let t = &chosen.make_up.terms[term];
        let (without, theta) = self.drop_term(&model, &chosen.make_up, &chosen.fit.point.theta, term);
        let base_model = self.model(&without, 1.0, 1.0, 0.0);
        let base_problem = Problem::new(self.data, &base_model);
        let (with, bare) = (problem.physics(&chosen.fit.point.theta), base_problem.physics(&theta));
        let mut share = [0.0; 4];
        for (r, rec) in self.data.records.iter().enumerate() {
            let local = &chosen.fit.point.locals[r];
            let (trace, y) = problem.predict(&chosen.fit.point.theta, r, local);
            if !trace.ok {
                continue;
            }
            let n = trace.force.len();
            let strength: Vec<f64> = match t.mechanism.acts {
                Acts::Force(f) => (0..n).map(|i| f(trace.position[i], trace.velocity[i], &with).abs()).collect(),
                Acts::Struck => {
                    let body = with.mass - with.loose_mass;
                    let borne = if with.loose_borne { with.loose_mass * with.gravity } else { 0.0 };
                    let drive = |x: f64| rec.setup.preload - rec.setup.rate * (x + rec.setup.travel);
                    (0..n)
                        .map(|i| {
                            (body * trace.acceleration[i] + trace.force[i] - drive(trace.position[i]) - borne).abs()
                        })
                        .collect()
                }
                Acts::Push => trace.force.iter().map(|f| f.abs()).collect(),
                Acts::Reading if t.mechanism.origin == Origin::Chain => {
                    let c = if self.data.has(Channel::Force) { Channel::Force } else { Channel::Acceleration };
                    let z = crate::model::chain::readings(&bare, &trace, &rec.setup.time);
                    y[c.index()].iter().zip(&z[c.index()]).map(|(a, b)| (a - b).abs()).collect()
                }
                Acts::Reading => {
                    // both laws along the same path
                    let imposed = Setup {
                        kind: Kind::Indentation,
                        imposed: trace.position.clone(),
                        imposed_rate: trace.velocity.clone(),
                        ..rec.setup.clone()
                    };
                    let l = Local { start: 0.0, speed: 0.0, stiffness: 0.0, offset: 0.0 };
                    let (a, b) = (simulate(&with, &imposed, &l), simulate(&bare, &imposed, &l));
                    a.force.iter().zip(&b.force).map(|(a, b)| (a - b).abs()).collect()
                }
            };
            for (i, s) in strength.iter().enumerate() {
                share[phase(&trace, rec.setup.time[i])] += s;
            }
        }
        let sum: f64 = share.iter().sum();
        if sum > 0.0 {
            share.iter_mut().for_each(|s| *s /= sum);
        }
        share
    }
}

/// Index of the phase an instant lies in: approach, loading, unloading, after.
pub fn phase(t: &Trace, time: f64) -> usize {
    if time < t.touch {
        0
    } else if time < t.deepest {
        1
    } else if time < t.leave {
        2
    } else {
        3
    }
}

/// Words for the phases.
pub const PHASES: [&str; 4] = ["approach", "loading", "unloading", "after"];
