//! The pulse of the first impact as a channel reads it: its place, its integral and its duration.

use estimate::problem::Record;
use record::Channel;

/// Share of its largest reading below which a pulse has not begun, or is over: above noise and an offset of zero, and so low that
/// it takes little of the integrals.
const FOOT: f64 = 0.1;

/// The first impact of a recording in one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pulse {
    /// Index of the first sample after it.
    pub end: usize,
    /// Its middle, where half of its integral is before and half behind, to the first moment, s.
    pub middle: f64,
    /// Its largest magnitude, unit of the channel.
    pub largest: f64,
    /// Its integral with its sign, unit of the channel times s.
    pub impulse: f64,
    /// Square of the integral over the integral of the square, s: of pulses of one shape in proportion to their duration.
    pub duration: f64,
}

impl Pulse {
    /// None where the channel was not read, or holds no pulse that begins.
    pub fn new(r: &Record, channel: Channel) -> Option<Pulse> {
        let (y, weight, time) = (r.y[channel.index()].as_deref()?, &r.weight[channel.index()], &r.setup.time);
        let counts = |i: usize| weight[i] > 0.0 && y[i].is_finite();
        let top = (0..y.len()).filter(|i| counts(*i)).max_by(|a, b| y[*a].abs().total_cmp(&y[*b].abs()))?;
        let (sign, foot) = (y[top].signum(), FOOT * y[top].abs());
        let is_outside = |i: &usize| sign * y[*i] < foot;
        let first = (0..top).rev().find(is_outside)?;
        let end = (top..y.len()).find(is_outside).unwrap_or(y.len() - 1);
        let (mut sum, mut squares, mut moment) = (0.0, 0.0, 0.0);
        for i in first..end {
            let (a, b, dt) = (sign * y[i], sign * y[i + 1], time[i + 1] - time[i]);
            // of an interval in which a straight line crosses the foot, what is above it
            let above = if a.min(b) < foot { (a.max(b) - foot) / (a - b).abs() } else { 1.0 };
            let (a, b, dt) = (a.max(foot), b.max(foot), above * dt);
            sum += 0.5 * dt * (a + b);
            squares += dt * (a * a + a * b + b * b) / 3.0;
            moment += 0.25 * dt * (a + b) * (time[i] + time[i + 1]);
        }
        let largest = y[top].abs();
        let pulse = Pulse { end, largest, middle: moment / sum, impulse: sign * sum, duration: sum * sum / squares };
        (sum > 0.0 && pulse.duration.is_finite() && pulse.middle.is_finite()).then_some(pulse)
    }
}
