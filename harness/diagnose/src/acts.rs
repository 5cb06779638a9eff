//! When an effect acts: its own share in approach, loading, unloading and after.

use super::candidate::Candidate;
use super::search::Search;
use estimate::problem::{Model, Problem};
use mechanisms::mechanism::{Acts, Origin};
use plant::chain::readings;
use plant::simulate::{force_on_body, simulate, Local, Setup, Trace};
use record::Kind;

impl Search<'_> {
    /// Share of a term's own action in approach, loading, unloading and after: of the square of the force or, for the
    /// measuring chain, of the reading over its noise that it adds; every recording weighs alike.
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
            let (trace, _) = problem.predict(&chosen.fit.point.theta, r, local);
            if !trace.ok {
                continue;
            }
            let n = trace.force.len();
            let squared: Vec<f64> = match t.mechanism.acts {
                Acts::Force => {
                    let start = problem.local(local).start;
                    (0..n)
                        .map(|i| {
                            let (t, x, v) = (rec.setup.time[i] - start, trace.position[i], trace.velocity[i]);
                            let f = |p| force_on_body(p, &rec.setup, t.max(0.0), x, v);
                            (f(&with) - f(&bare)).powi(2)
                        })
                        .collect()
                }
                Acts::Struck => {
                    let (body, borne) = (with.body_mass(), with.borne_weight());
                    let drive = |x: f64| rec.setup.preload - rec.setup.rate * (x + rec.setup.travel);
                    (0..n)
                        .map(|i| {
                            (body * trace.acceleration[i] + trace.force[i] - drive(trace.position[i]) - borne).powi(2)
                        })
                        .collect()
                }
                Acts::Push => trace.force.iter().map(|f| f * f).collect(),
                Acts::Reading if t.mechanism.origin == Origin::Chain => {
                    let (y, z) = (readings(&with, &trace, &rec.setup.time), readings(&bare, &trace, &rec.setup.time));
                    let mut sum = vec![0.0; n];
                    for c in self.data.compared(r).map(|c| c.index()) {
                        let sigma = self.data.noise[c].marginal();
                        for (s, (a, b)) in sum.iter_mut().zip(y[c].iter().zip(&z[c])) {
                            *s += ((a - b) / sigma).powi(2);
                        }
                    }
                    sum
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
                    a.force.iter().zip(&b.force).map(|(a, b)| (a - b).powi(2)).collect()
                }
            };
            let sum: f64 = squared.iter().sum();
            if sum > 0.0 {
                for (s, p) in squared.iter().zip(phases(&trace)) {
                    share[p] += s / sum;
                }
            }
        }
        let sum: f64 = share.iter().sum();
        if sum > 0.0 {
            share.iter_mut().for_each(|s| *s /= sum);
        }
        share
    }
}

/// The phase each sample lies in, as an index into [`PHASES`]: every time in contact loads up to its deepest point and
/// unloads from there to where it leaves the nominal surface.
pub fn phases(t: &Trace) -> Vec<usize> {
    let x = &t.position;
    let mut out = Vec::with_capacity(x.len());
    let mut at = 0;
    while at < x.len() {
        let inside = x[at] > 0.0;
        let end = (at..x.len()).find(|i| (x[*i] > 0.0) != inside).unwrap_or(x.len());
        if inside {
            let deepest = (at..end).rev().max_by(|a, b| x[*a].total_cmp(&x[*b])).unwrap_or(at);
            out.extend((at..end).map(|i| if i <= deepest { 1 } else { 2 }));
        } else {
            out.extend((at..end).map(|_| if at == 0 { 0 } else { 3 }));
        }
        at = end;
    }
    out
}

/// Words for the phases.
pub const PHASES: [&str; 4] = ["approach", "loading", "unloading", "after"];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_contact_loads_and_unloads() {
        let position = vec![-2.0, -1.0, 1.0, 2.0, 2.0, 1.0, -1.0, -0.5, 0.5, 0.7, 0.3, -0.1];
        let t = Trace { position, ..Trace::default() };
        assert_eq!(phases(&t), [0, 0, 1, 1, 2, 2, 3, 3, 1, 1, 2, 3]);
    }
}
