//! The phases of an impact, and the share of an effect's action in each: approach, loading, unloading and after.

use estimate::fitted::Fitted;
use estimate::problem::{Data, Problem};
use mechanisms::mechanism::{Acts, Origin};
use plant::chain::readings;
use plant::simulate::{force_on_body, simulate, Local, Setup, Trace};
use record::{Channel, Kind};

/// Share of the action of `chosen`'s term `term` in approach, loading, unloading and after: of the square of the force or,
/// for the measuring chain, of the reading over its noise that it adds; every recording weighs alike.
pub fn shares(chosen: &Fitted, term: usize) -> [f64; 4] {
    let data = &chosen.data;
    let problem = chosen.problem();
    let t = &chosen.structure.terms()[term];
    let without = chosen.structure.without(term);
    let theta = chosen.structure.theta_without(&chosen.fit.point.theta, term);
    let (with, bare) = (chosen.physics(), Problem::new(data, without.model()).physics(&theta));
    let mut share = [0.0; 4];
    for (r, rec) in data.records.iter().enumerate() {
        let local = &chosen.fit.point.locals[r];
        let (trace, _) = chosen.predict(r);
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
            Acts::Rider => {
                let (body, borne) = (with.body_mass(), with.borne_weight());
                (0..n)
                    .map(|i| {
                        (body * trace.acceleration[i] + trace.force[i] - rec.setup.drive(trace.position[i]) - borne)
                            .powi(2)
                    })
                    .collect()
            }
            Acts::Push => trace.force.iter().map(|f| f * f).collect(),
            Acts::Reading if t.mechanism.origin == Origin::Chain => {
                let (y, z) = (readings(&with, &trace, &rec.setup.time), readings(&bare, &trace, &rec.setup.time));
                let mut sum = vec![0.0; n];
                for c in data.compared(r).map(|c| c.index()) {
                    let sigma = data.noise[c].marginal();
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
            for (s, p) in squared.iter().zip(phases(&trace, data)) {
                share[p] += s / sum;
            }
        }
    }
    over_their_sum(share)
}

/// Parts over their sum; zero where there are none.
pub fn over_their_sum(parts: [f64; 4]) -> [f64; 4] {
    let sum: f64 = parts.iter().sum();
    parts.map(|s| if sum > 0.0 { s / sum } else { 0.0 })
}

/// Share of the square of the contact's force in each phase, every recording weighing alike: where a stiffness that differs
/// between recordings acts.
pub fn of_force(chosen: &Fitted) -> [f64; 4] {
    let mut share = [0.0; 4];
    for r in 0..chosen.data.records.len() {
        let (trace, _) = chosen.predict(r);
        let sum: f64 = trace.force.iter().map(|f| f * f).sum();
        if trace.ok && sum > 0.0 {
            for (f, p) in trace.force.iter().zip(phases(&trace, &chosen.data)) {
                share[p] += f * f / sum;
            }
        }
    }
    over_their_sum(share)
}

/// The phase of most action, of the shares of one effect.
pub fn strongest(shares: &[f64; 4]) -> usize {
    (0..4).max_by(|a, b| shares[*a].total_cmp(&shares[*b])).unwrap_or(1)
}

/// The effects by their shares, as indices; first the one whose strongest phase is the one in which most acts of all.
pub fn by_strongest(each: &[[f64; 4]]) -> Vec<usize> {
    let of_all = |i: &usize| each.iter().map(|s| s[strongest(&each[*i])]).sum::<f64>();
    let mut order: Vec<usize> = (0..each.len()).collect();
    order.sort_by(|a, b| of_all(b).total_cmp(&of_all(a)));
    order
}

/// The phase each sample lies in, as an index into [`PHASES`]: every time in contact loads up to its deepest point and
/// unloads from there to where it leaves the nominal surface. An imposed path that is held at its depth is deepest where it
/// has come there but for its noise, and not where that noise happens to be largest.
pub fn phases(t: &Trace, data: &Data) -> Vec<usize> {
    let imposed = data.kind == Kind::Indentation;
    phases_within(&t.position, if imposed { data.noise[Channel::Penetration.index()].marginal() } else { 0.0 })
}

/// The phases of a penetration whose depth counts as reached within `slack`, m.
fn phases_within(x: &[f64], slack: f64) -> Vec<usize> {
    let mut out = Vec::with_capacity(x.len());
    let mut at = 0;
    while at < x.len() {
        let inside = x[at] > 0.0;
        let end = (at..x.len()).find(|i| (x[*i] > 0.0) != inside).unwrap_or(x.len());
        if inside {
            let depth = x[at..end].iter().cloned().fold(0.0, f64::max);
            let deepest = (at..end).find(|i| x[*i] >= depth - slack).unwrap_or(at);
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
    fn of_several_effects_the_one_in_the_phase_of_most_action_comes_first() {
        // softening acts alike in loading and unloading, a loose part while unloading
        assert_eq!(by_strongest(&[[0.0, 0.51, 0.49, 0.0], [0.0, 0.1, 0.9, 0.0]]), [1, 0]);
        assert_eq!(by_strongest(&[[0.0, 0.1, 0.9, 0.0], [0.0, 0.51, 0.49, 0.0]]), [0, 1]);
        assert_eq!(by_strongest(&[[0.3, 0.2, 0.2, 0.3]]), [0]);
    }

    #[test]
    fn every_contact_loads_and_unloads() {
        let position = vec![-2.0, -1.0, 1.0, 2.0, 2.0, 1.0, -1.0, -0.5, 0.5, 0.7, 0.3, -0.1];
        assert_eq!(phases_within(&position, 0.0), [0, 0, 1, 1, 2, 2, 3, 3, 1, 1, 2, 3]);
    }

    #[test]
    fn what_is_held_at_its_depth_no_longer_loads() {
        let position = [-1.0, 1.0, 2.9, 3.0, 3.02, 2.99, 3.03, 1.0, -1.0];
        assert_eq!(phases_within(&position, 0.05), [0, 1, 1, 1, 2, 2, 2, 2, 3]);
    }
}
