//! Back into the simulator: the element packed with what was found as its start values, and the recordings run
//! through that very FMU.

use super::heldout::HeldOut;
use super::predictions::Predictions;
use anyhow::{ensure, Context, Result};
use estimate::fitted::Fitted;
use estimate::problem::{Data, Problem};
use host::{Fmu, FmuElement, Names};
use hysteresis_contact::variables::{Settings, PARAMETER_TABLE};
use law::Parameters;
use plant::element::Element;
use record::range;

/// The packed element and what it does.
pub struct Packed {
    /// The bytes of HysteresisContact.fmu.
    pub fmu: Vec<u8>,
    /// Start values that differ from the element's defaults: name, value, unit.
    pub starts: Vec<(&'static str, f64, &'static str)>,
    /// The recordings predicted through it.
    pub through: Option<Through>,
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

/// Packs the element with `law`; with `after`, predicts its recordings through the FMU.
///
/// # Errors
/// Where the element's library is not beside the program, the law cannot be a start value (says which parameter),
/// the FMU refuses, or the FMU and the diagnosis' own simulation part.
pub fn packed(data: &Data, law: &Parameters, after: Option<(&Fitted, &HeldOut)>) -> Result<Packed> {
    let mass = if data.mass > 0.0 { data.mass } else { 1.0 };
    let all = starts(law, mass);
    let fmu = pack::archive(&all, &[pack::built_library()?])?;
    let plain = starts(&Parameters::default(), 1.0);
    let changed = PARAMETER_TABLE
        .iter()
        .zip(all.iter().zip(&plain))
        .filter(|(p, (a, b))| a.1 != b.1 || ["stiffness", "exponent"].contains(&p.name))
        .map(|(p, (a, _))| (p.name, a.1, p.unit))
        .collect();
    let through = match after {
        Some((c, h)) => Some(through(c, h, &fmu)?),
        None => None,
    };
    Ok(Packed { fmu, starts: changed, through })
}

/// Every recording through the FMU, with the parameters it was predicted with.
fn through(c: &Fitted, h: &HeldOut, fmu: &[u8]) -> Result<Through> {
    let folder = tempfile::tempdir().context("no temporary folder to unpack the FMU in")?;
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
