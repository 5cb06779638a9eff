//! Back into the simulator: the element packed with what was found as its start values, and the recordings run
//! through that very FMU: its libraries and start values; its description of itself is put in when the answer is written.

use super::heldout::HeldOut;
use super::predictions::Predictions;
use crate::bias::of_element;
use crate::intervals::Interval;
use anyhow::{ensure, Context, Result};
use estimate::fitted::Fitted;
use estimate::problem::{Data, Problem};
use host::{Fmu, FmuElement, Names};
use hysteresis_contact::variables::{Settings, PARAMETER_TABLE};
use law::Parameters;
use pack::{Binary, Label, Model};
use plant::element::Element;
use record::range;

/// The packed element and what it does.
pub struct Packed {
    /// Value of every parameter of the element.
    values: Vec<(String, f64)>,
    /// Libraries, one for each platform.
    binaries: Vec<Binary>,
    /// Typical sizes of the element's inputs and outputs, SI.
    nominals: Vec<(&'static str, f64)>,
    /// The simulation's own parameters as calibrated, by the element's names.
    pub calibrated: Vec<Interval>,
    /// Start values that differ from the element's defaults: name, value, unit.
    pub starts: Vec<(&'static str, f64, &'static str)>,
    /// The recordings predicted through it.
    pub through: Option<Through>,
}

impl Packed {
    /// The bytes of HysteresisContact.fmu, described as `label` says.
    ///
    /// # Errors
    /// As [`Model::labelled`].
    pub fn fmu(&self, label: Label) -> Result<Vec<u8>> {
        let label = Label { nominals: self.nominals.clone(), ..label };
        Model::contact().labelled(&self.values, &self.binaries, &label)
    }

    /// The bytes of HysteresisContact.fmu with no description but its start values.
    ///
    /// # Errors
    /// As [`Model::archive`].
    pub fn plain(&self) -> Result<Vec<u8>> {
        Model::contact().archive(&self.values, &self.binaries)
    }

    /// The platforms it runs on, as FMI 2.0 names them.
    pub fn platforms(&self) -> Vec<&str> {
        self.binaries.iter().map(|b| b.platform.as_str()).collect()
    }
}

/// Recordings predicted with the FMU as the contact.
pub struct Through {
    pub predictions: Predictions,
    /// Largest difference from the diagnosis' own simulation, over the range of its channel.
    pub difference: f64,
}

/// Difference, over range, beyond which the FMU does not do what the diagnosis simulated.
const AGREES: f64 = 2e-3;

/// Share of that from which steps are shortened; steps a contact gets at first, and at most.
const CLOSE: f64 = 0.5;
const STEPS: f64 = 400.0;
const MOST_STEPS: f64 = 40_000.0;

/// Start values of the element for a law and the mass that rides on it, kg.
fn starts(law: &Parameters, mass: f64) -> Vec<(String, f64)> {
    let s = Settings { law: *law, effective_mass: mass, ..Settings::default() };
    PARAMETER_TABLE.iter().enumerate().map(|(i, p)| (p.name.to_string(), s.get(i))).collect()
}

/// Typical sizes of the element's inputs and outputs in these recordings, SI.
fn nominals(data: &Data, law: &Parameters, mass: f64) -> Vec<(&'static str, f64)> {
    let s = &data.scales;
    let energy = 0.5 * mass * s.speed * s.speed;
    vec![
        ("penetration", s.depth),
        ("velocity", s.speed),
        ("force", s.force),
        ("force_at_inputs", s.force),
        ("stored_energy", energy),
        ("dissipated_energy", energy),
        ("deepest_penetration", s.depth),
        ("permanent_set", s.depth),
        ("recommended_step", law.recommended_step(mass, s.speed, 0.0)),
    ]
}

/// Packs the element with `law`, which `calibrated` has, and the libraries given; with `after`, predicts its recordings
/// through the FMU. `overdispersion` inflates the noise's variance.
///
/// # Errors
/// Where the law cannot be a start value (says which parameter), a library is not the element's, the FMU refuses, or
/// the FMU and the diagnosis' own simulation part.
pub fn packed(
    binaries: Vec<Binary>,
    calibrated: &Fitted,
    overdispersion: f64,
    law: &Parameters,
    after: Option<(&Fitted, &HeldOut)>,
) -> Result<Packed> {
    let data = &*calibrated.data;
    let mass = if data.mass > 0.0 { data.mass } else { 1.0 };
    let all = starts(law, mass);
    let plain = starts(&Parameters::default(), 1.0);
    let changed = PARAMETER_TABLE
        .iter()
        .zip(all.iter().zip(&plain))
        .filter(|(p, (a, b))| a.1 != b.1 || ["stiffness", "exponent"].contains(&p.name))
        .map(|(p, (a, _))| (p.name, a.1, p.unit))
        .collect();
    let through = match after {
        Some((c, h)) => Some(through(c, h, &Model::contact().archive(&all, &binaries)?)?),
        None => None,
    };
    let (nominals, calibrated) = (nominals(data, law, mass), of_element(calibrated, overdispersion));
    Ok(Packed { values: all, binaries, nominals, calibrated, starts: changed, through })
}

/// Every recording through the FMU, with the parameters it was predicted with.
fn through(c: &Fitted, h: &HeldOut, fmu: &[u8]) -> Result<Through> {
    let folder = output::Scratch::new("element").context("no temporary folder to unpack the FMU in")?;
    let path = folder.path().join("HysteresisContact.fmu");
    output::write(&path, fmu)?;
    let fmu = Fmu::open(&path)?;
    let data = &*c.data;
    let problem = c.problem();
    let make = |law: &Parameters| -> Result<Box<dyn Element>> {
        Ok(Box::new(FmuElement::new(&fmu, &starts(law, data.mass.max(1e-9)), &Names::default())?))
    };
    let run = |steps: f64| -> Result<(Vec<[Vec<f64>; 3]>, f64)> {
        let mut readings = Vec::new();
        let mut difference: f64 = 0.0;
        for (r, (theta, local)) in h.points.iter().enumerate() {
            let file = &data.records[r].file;
            let (trace, y) = problem.predict_on(theta, r, local, &make, steps).with_context(|| file.clone())?;
            ensure!(trace.ok, "{file}: the motion on the FMU does not reach the recording's end");
            for ((own, of_fmu), read) in h.predictions.judged[r].iter().zip(&y).zip(&data.records[r].y) {
                let Some(read) = read else { continue };
                let range = range(read).max(1e-300);
                for (a, b) in own.iter().zip(of_fmu) {
                    difference = difference.max((a - b).abs() / range);
                }
            }
            readings.push(y);
        }
        Ok((readings, difference))
    };
    let mut steps = STEPS;
    let (mut readings, mut difference) = run(steps)?;
    // a branch that relaxes within a few steps wants shorter ones
    while difference > CLOSE * AGREES && steps < MOST_STEPS {
        steps *= 10.0;
        (readings, difference) = run(steps)?;
    }
    ensure!(
        difference < AGREES,
        "the FMU's readings part from the simulation's by {:.1e} of range, more than {AGREES:e}, at {steps} steps a contact",
        difference
    );
    let of = |data: &Data, r: usize| -> Result<[Vec<f64>; 3]> {
        let (theta, local) = &h.points[r];
        let through = Problem::new(data, c.structure.model()).predict_on(theta, r, local, &make, steps);
        Ok(through.with_context(|| data.records[r].file.clone())?.1)
    };
    Ok(Through { predictions: Predictions::new(readings, data, of)?, difference })
}
