//! Campaigns in the format `recordings/1`: read, checked, converted to SI.

mod load;
pub use load::{load, RecordError};
use std::path::PathBuf;

/// Gravity, m/s^2, as the format has it; that of every simulation.
pub const GRAVITY: f64 = 9.81;

/// What was done with the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    DropTest,
    ContactorOpening,
    Indentation,
}

impl Kind {
    pub const ALL: [Kind; 3] = [Kind::DropTest, Kind::ContactorOpening, Kind::Indentation];
    /// As campaign.toml has it.
    pub fn name(self) -> &'static str {
        match self {
            Kind::DropTest => "drop-test",
            Kind::ContactorOpening => "contactor-opening",
            Kind::Indentation => "indentation",
        }
    }
}

/// A measured channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Channel {
    Force,
    Acceleration,
    Penetration,
}

impl Channel {
    pub const ALL: [Channel; 3] = [Channel::Force, Channel::Acceleration, Channel::Penetration];
    pub fn name(self) -> &'static str {
        match self {
            Channel::Force => "force",
            Channel::Acceleration => "acceleration",
            Channel::Penetration => "penetration",
        }
    }
    /// SI unit of its readings.
    pub fn unit(self) -> &'static str {
        match self {
            Channel::Force => "N",
            Channel::Acceleration => "m/s^2",
            Channel::Penetration => "m",
        }
    }
    pub fn index(self) -> usize {
        self as usize
    }
}

/// One column as the file had it: `value_in_file * to_si = SI`.
#[derive(Clone, Debug)]
pub struct Column {
    pub name: String,
    pub unit: String,
    pub to_si: f64,
}

/// One recording, SI.
#[derive(Clone, Debug)]
pub struct Recording {
    pub file: String,
    pub order: f64,
    /// Index into `Campaign::levels`; recordings of one level share it.
    pub level: usize,
    pub drop_height: Option<f64>,
    /// Speed at touch, m/s, and its std.
    pub impact_speed: Option<(f64, f64)>,
    /// Speed at the first sample, m/s, and its std.
    pub start_speed: Option<(f64, f64)>,
    pub spring_preload: Option<f64>,
    /// s, strictly increasing
    pub time: Vec<f64>,
    /// Indexed by `Channel::index`.
    pub channels: [Option<Vec<f64>>; 3],
    /// The file's columns in order, to write predictions in the same units.
    pub columns: Vec<Column>,
}

/// The simulation as the user has it.
#[derive(Clone, Debug, Default)]
pub struct Simulation {
    pub terms: Vec<String>,
    pub k: Option<f64>,
    pub p: Option<f64>,
    pub mu_d: Option<f64>,
}

/// A campaign, checked and in SI.
#[derive(Clone, Debug)]
pub struct Campaign {
    pub dir: PathBuf,
    /// The folder's name (names the output), and the name in the file.
    pub folder: String,
    pub name: String,
    pub kind: Kind,
    pub material: Option<String>,
    pub moving_mass: Option<f64>,
    pub travel: Option<f64>,
    pub return_spring_rate: Option<f64>,
    pub simulation: Simulation,
    /// Value and text of each level, ascending.
    pub levels: Vec<(f64, String)>,
    pub recordings: Vec<Recording>,
    /// What a reader should know about the folder that is no error: files it holds and does not list.
    pub warnings: Vec<String>,
}

/// Largest reading less the least, in the readings' unit; below zero where there are none.
pub fn range(y: &[f64]) -> f64 {
    let (low, high) = y.iter().fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(*v), b.max(*v)));
    high - low
}

/// Largest magnitude, in the readings' unit; zero where there are none.
pub fn largest(y: &[f64]) -> f64 {
    y.iter().fold(0.0, |m, v| v.abs().max(m))
}
