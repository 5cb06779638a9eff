//! NI's scaling Strain: from the voltage of a Wheatstone bridge to the strain of its gauges.
//!
//! With r the bridge's voltage over its excitation, G the gauge factor and ν Poisson's ratio, each wiring follows from
//! r = R3 / (R3 + R4) - R2 / (R1 + R2) and from which resistors are gauges under which strain.

/// A bridge and its gauges.
#[derive(Clone, Debug)]
pub(super) struct Strain {
    pub(super) bridge: Bridge,
    /// V
    pub(super) excitation: f64,
    /// Voltage without strain, V.
    pub(super) initial: f64,
    pub(super) gauge_factor: f64,
    pub(super) poisson: f64,
    /// Resistance of the leads over that of a gauge.
    pub(super) leads: f64,
    /// Factor from a shunt calibration.
    pub(super) gain: f64,
}

/// How the gauges are wired.
#[derive(Clone, Copy, Debug)]
pub(super) enum Bridge {
    /// Four gauges in bending.
    Full1,
    /// Two gauges in bending, two across.
    Full2,
    /// Two gauges along an axial load, two across.
    Full3,
    /// A gauge along an axial load, one across.
    Half1,
    /// Two gauges in bending.
    Half2,
    Quarter,
}

impl Bridge {
    /// The bridge that NI's property numbers so.
    pub(super) fn of(number: f64) -> Option<Bridge> {
        Some(match number as u32 {
            10183 => Bridge::Full1,
            10184 => Bridge::Full2,
            10185 => Bridge::Full3,
            10188 => Bridge::Half1,
            10189 => Bridge::Half2,
            10271 | 10272 => Bridge::Quarter,
            _ => return None,
        })
    }
}

impl Strain {
    /// The strain at a voltage in V.
    pub(super) fn of(&self, voltage: f64) -> f64 {
        let r = (voltage - self.initial) / self.excitation;
        let (sum, difference) = (1.0 + self.poisson, 1.0 - self.poisson);
        let leads = 1.0 + self.leads;
        let of_unit_factor = match self.bridge {
            Bridge::Full1 => -r,
            Bridge::Full2 => -2.0 * r / sum,
            Bridge::Full3 => -2.0 * r / (sum + r * difference),
            Bridge::Half1 => -4.0 * r / (sum + 2.0 * r * difference) * leads,
            Bridge::Half2 => -2.0 * r * leads,
            Bridge::Quarter => -4.0 * r / (1.0 + 2.0 * r) * leads,
        };
        of_unit_factor * self.gain / self.gauge_factor
    }
}
