//! A ratio that should be 1, weighed: is it off by what sensors are off by, by what a rig may do, or by a unit?
//!
//! Each explanation is a density over the logarithm of the ratio; the likeliest one, weighed with how often it is met, is
//! the answer (Jeffreys 1961, Theory of Probability). No ratio is a limit by itself.

use record::statistics::median;

/// Standard deviations of calibrations, as shares: force and acceleration, penetration, mass (docs, formats of recordings).
pub const GAIN: f64 = 0.007;
pub const WAY: f64 = 0.003;
pub const MASS: f64 = 0.002;
/// Standard deviation of the logarithm by which parts that do not move along, gains or guides move such a ratio.
const RIG: f64 = 0.15;
/// Natural logarithm of the largest slip that is thought of: ten to the power of 7.
const WIDEST: f64 = 16.1;
/// How often each explanation is met: sensors, the rig, one of the units, anything else.
const MET: [f64; 4] = [0.9, 0.08, 0.01, 0.01];

/// A ratio of several recordings: its middle and the standard error of its logarithm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ratio {
    /// Natural logarithm.
    pub log: f64,
    pub error: f64,
    pub count: usize,
}

impl Ratio {
    /// The middle of ratios above 0; None without any. One alone is given an error of one calibration.
    pub fn of(all: &[f64]) -> Option<Ratio> {
        let logs: Vec<f64> = all.iter().filter(|r| r.is_finite() && **r > 0.0).map(|r| r.ln()).collect();
        if logs.is_empty() {
            return None;
        }
        let (count, log) = (logs.len(), median(logs.clone()));
        // 1.4826: from the median distance to a standard deviation; 1.2533: of a median over that of a mean
        let spread = 1.4826 * median(logs.iter().map(|l| (l - log).abs()).collect());
        let error = if count > 2 { 1.2533 * spread / (count as f64).sqrt() } else { GAIN };
        Some(Ratio { log, error, count })
    }

    pub fn value(&self) -> f64 {
        self.log.exp()
    }

    /// 95 %.
    pub fn interval(&self) -> [f64; 2] {
        [-1.96, 1.96].map(|z| (self.log + z * self.error).exp())
    }
}

/// A unit taken for another.
#[derive(Clone, Copy, Debug)]
pub struct Slip {
    /// Factor on the ratio where it was made.
    pub factor: f64,
    pub words: &'static str,
}

/// What explains a ratio best.
#[derive(Clone, Copy, Debug)]
pub enum Answer {
    Sensors,
    Rig,
    Unit(Slip),
    Nothing,
}

/// Weighs explanations of a ratio that is within `right` (both 1, or an interval) where all is right; `tolerance`: standard
/// deviation of its logarithm by calibrations; `below`: by which standard deviation a rig moves it downwards, where that is
/// more than upwards.
pub fn weighed(ratio: &Ratio, right: [f64; 2], tolerance: f64, below: f64, slips: &[Slip]) -> Answer {
    let [low, high] = right.map(f64::ln);
    let density = |at: f64, sd: f64| {
        let sd = sd.hypot(ratio.error);
        let off = (low + at - ratio.log).max(ratio.log - high - at).max(0.0);
        (-0.5 * (off / sd).powi(2)).exp() / (high - low + sd * (2.0 * std::f64::consts::PI).sqrt())
    };
    let rig = if ratio.log < low { below.max(RIG) } else { RIG };
    let mut best = (MET[0] * density(0.0, tolerance), Answer::Sensors);
    let mut try_one = |weight: f64, answer: Answer| {
        if weight > best.0 {
            best = (weight, answer);
        }
    };
    try_one(MET[1] * density(0.0, rig), Answer::Rig);
    for s in slips {
        // a unit that is wrong does not make the rest right to a calibration
        try_one(MET[2] / slips.len() as f64 * density(s.factor.ln(), 0.5 * RIG), Answer::Unit(*s));
    }
    try_one(MET[3] / (2.0 * WIDEST), Answer::Nothing);
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLIPS: [Slip; 3] = [
        Slip { factor: 1.0 / 4.448, words: "lbf" },
        Slip { factor: 9.807, words: "g" },
        Slip { factor: 1e-3, words: "kN" },
    ];

    fn answer(ratio: f64) -> String {
        let ratio = Ratio { log: ratio.ln(), error: 0.002, count: 8 };
        match weighed(&ratio, [1.0, 1.0], 0.01, 0.0, &SLIPS) {
            Answer::Sensors => "sensors".into(),
            Answer::Rig => "rig".into(),
            Answer::Unit(s) => s.words.into(),
            Answer::Nothing => "nothing".into(),
        }
    }

    #[test]
    fn a_ratio_is_explained_by_what_is_likeliest() {
        for (ratio, by) in [
            (1.0, "sensors"),
            (0.98, "sensors"),
            (1.1, "rig"),
            (0.9, "rig"),
            (0.2248, "lbf"),
            (0.23, "lbf"),
            (9.807, "g"),
            (1.02e-3, "kN"),
            (37.0, "nothing"),
        ] {
            assert_eq!(answer(ratio), by, "{ratio}");
        }
    }

    #[test]
    fn a_middle_has_the_error_of_its_scatter() {
        let r = Ratio::of(&[1.0, 1.01, 0.99, 1.0, 1.02, 0.98, 1.0, f64::NAN, -1.0]).unwrap();
        assert!(r.log.abs() < 1e-9 && r.count == 7 && (0.003..0.01).contains(&r.error), "{r:?}");
        assert!(Ratio::of(&[]).is_none());
    }
}
