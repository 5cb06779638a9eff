//! What the way through the FMU costs beside the law called directly: the same element, the same inputs.

use super::{cpu_seconds, parameters, Pair, Walk};
use anyhow::Result;
use host::{Direct, Element, Fmu, FmuElement, Names};
use law::Parameters;
use std::hint::black_box;

/// What is asked of the element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ask {
    /// A force at a point tried: fmi2SetReal, fmi2GetReal.
    Force,
    /// A step to a point and the force there: fmi2SetReal, fmi2DoStep, fmi2GetReal.
    Step,
}

/// Nanoseconds of CPU time an answer.
fn cost(element: &mut dyn Element, walk: &Walk, ask: Ask, count: usize) -> Result<f64> {
    let points = walk.touching();
    let mut from = points[0];
    let mut sum = element.force(from.0, from.1)?;
    let start = cpu_seconds();
    for to in points.iter().cycle().take(count) {
        if ask == Ask::Step {
            element.advance(from, *to, walk.h)?;
            from = *to;
        }
        sum += element.force(to.0, to.1)?;
    }
    let ns = (cpu_seconds() - start) * 1e9 / count as f64;
    black_box(sum);
    Ok(ns)
}

/// Through `fmu` beside directly, ns, `rounds` times in turn; points in contact.
///
/// # Errors
/// Where the FMU refuses.
pub fn against_direct(fmu: &Fmu, exponent: f64, ask: Ask, rounds: usize, count: usize) -> Result<Pair> {
    let given = parameters(exponent);
    let named: Vec<(String, f64)> = given.iter().map(|(n, x)| (n.to_string(), *x)).collect();
    let law = Parameters::power_law(given[0].1, exponent, given[2].1);
    let walk = Walk::default();
    let mut pair = Pair::default();
    for round in 0..=rounds {
        // new ones a round: a step begins where the last one ended
        let mut through = FmuElement::new(fmu, &named, &Names::default())?;
        let mut direct = Direct::new(law);
        let both = (cost(&mut through, &walk, ask, count)?, cost(&mut direct, &walk, ask, count)?);
        if round > 0 {
            pair.rounds.push(both);
        }
    }
    Ok(pair)
}
