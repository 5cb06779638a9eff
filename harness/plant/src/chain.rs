//! The measuring chain: what the instruments make of the true signals, stage after stage.

use crate::simulate::Trace;
use mechanisms::part::Sampling;
use mechanisms::physics::Physics;

/// The readings a chain gives of a trace at the sample times `time`, s: force N, acceleration m/s^2, penetration m,
/// without the offsets of their zeros.
pub fn readings(p: &Physics, trace: &Trace, time: &[f64]) -> [Vec<f64>; 3] {
    let dt = (time[time.len() - 1] - time[0]) / (time.len() - 1) as f64;
    let [f, a, x] = &trace.read;
    let read = |own: &Vec<f64>, other: &Option<Vec<f64>>| other.as_ref().unwrap_or(own).clone();
    let mut y = [read(&trace.force, f), read(&trace.acceleration, a), read(&trace.position, x)];
    p.measure(&mut y, &Sampling { dt, before: trace.before });
    y
}
