//! The bounce table: impacts as either file shows them.

use assess::bounces::{by_events, by_force, by_position, noise_reach, Bounces};
use record::{largest, Channel, Signals};
use serde::Serialize;

/// Share of the largest force above which there is contact, where noise does not reach higher.
const THRESHOLD: f64 = 0.02;

/// One impact; SI, None where it cannot be had.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ImpactFigures {
    pub touch: f64,
    pub contact: Option<f64>,
    pub approach_speed: Option<f64>,
    pub rebound_speed: Option<f64>,
    pub restitution: Option<f64>,
    /// Time in flight after over time in flight before.
    pub flight_ratio: Option<f64>,
}

/// Impacts of one file.
#[derive(Clone, Debug, Serialize)]
pub struct BounceFigures {
    /// The column that shows contact: closed, penetration or force.
    pub by: &'static str,
    /// Time of the first impact, s.
    pub first: f64,
    /// Time of the last impact, s.
    pub last: f64,
    pub count: usize,
    /// From the first touch to the last, s, where the body then rests.
    pub bounce_time: Option<f64>,
    pub impacts: Vec<ImpactFigures>,
}

impl BounceFigures {
    fn new(by: &'static str, b: Bounces) -> BounceFigures {
        let impacts = b.impacts.iter().map(|i| ImpactFigures {
            touch: i.touch,
            contact: i.separation.map(|s| s - i.touch),
            approach_speed: i.approach,
            rebound_speed: i.rebound,
            restitution: i.restitution,
            flight_ratio: i.flight_ratio,
        });
        BounceFigures {
            by,
            first: b.first(),
            last: b.last(),
            count: b.impacts.len(),
            bounce_time: b.bounce_time,
            impacts: impacts.collect(),
        }
    }

    /// Of a file, by its events, else its penetration, else its force, unfiltered. None without any, or without a
    /// touch.
    fn of(s: &Signals) -> Option<BounceFigures> {
        let channel = |c: Channel| s.channels[c.index()].as_deref();
        let (by, found) = if let Some(closed) = &s.closed {
            ("closed", by_events(&s.time, closed))
        } else if let Some(x) = channel(Channel::Penetration) {
            (Channel::Penetration.name(), by_position(&s.time, x, noise_reach(&s.time, x)))
        } else {
            let f = channel(Channel::Force)?;
            let threshold = (THRESHOLD * largest(f)).max(noise_reach(&s.time, f));
            (Channel::Force.name(), by_force(&s.time, f, threshold))
        };
        found.map(|b| BounceFigures::new(by, b))
    }
}

/// Impacts of both files.
#[derive(Clone, Debug, Serialize)]
pub struct BounceTable {
    pub recording: Option<BounceFigures>,
    pub simulation: Option<BounceFigures>,
}

impl BounceTable {
    pub fn new(recording: &Signals, simulation: &Signals) -> BounceTable {
        BounceTable { recording: BounceFigures::of(recording), simulation: BounceFigures::of(simulation) }
    }
    /// Whether both files show an impact.
    pub fn of_both(&self) -> bool {
        self.recording.is_some() && self.simulation.is_some()
    }
}
