//! How far the simulation's own parameters had been biased by what it leaves out.

use super::intervals::Interval;
use estimate::fitted::Fitted;
use plant::machine::FreeFacts;

/// One parameter of the base, as calibrated without and with the mechanisms found.
#[derive(Clone, Debug, PartialEq)]
pub struct Bias {
    pub name: String,
    pub unit: String,
    pub before: f64,
    pub after: f64,
    /// (before - after) / after in per cent; NaN where `after` is zero.
    pub percent: f64,
    /// before - after in standard deviations of the calibration after.
    pub sigmas: f64,
}

/// How a quantity follows from the parameters fitted.
type Value = Box<dyn Fn(&[f64]) -> f64>;

/// A quantity of the simulation's own parameters.
struct Quantity {
    /// Name in a report, and in the element; the latter empty where the element has no such parameter.
    name: String,
    parameter: &'static str,
    parameter_unit: &'static str,
    unit: String,
    value: Value,
}

/// Force at the reference depth, in which stiffness and exponent do not trade off, these two, and the damping. Of FMUs, their
/// free variables.
fn quantities(f: &Fitted) -> Vec<Quantity> {
    if let Some(m) = &f.structure.base().machine {
        let free = m.facts().free.iter().cloned().enumerate();
        let of = |(i, v): (usize, FreeFacts)| Quantity {
            name: v.name.clone(),
            parameter: "",
            parameter_unit: "",
            unit: v.unit.clone(),
            value: {
                let structure = f.structure.clone();
                Box::new(move |t: &[f64]| v.value(structure.free(t)[i]))
            },
        };
        return free.map(of).collect();
    }
    let s = f.data.scales;
    let stiffness = move |t: &[f64]| (t[0] - t[1] * s.x_ref.ln()).exp();
    let quantity = |name: &str, parameter, unit, value| Quantity {
        name: name.into(),
        parameter,
        parameter_unit: unit,
        unit: unit.into(),
        value,
    };
    let mut all = vec![
        quantity("force at reference depth", "", "N", Box::new(|t: &[f64]| t[0].exp()) as Value),
        quantity("k", "stiffness", "N/m^p", Box::new(stiffness)),
        quantity("p", "exponent", "1", Box::new(|t| t[1])),
    ];
    if f.structure.base().hysteresis {
        let damping = move |t: &[f64]| t[2] * stiffness(t) / s.v_ref;
        all.push(quantity("mu_d", "hysteresis_damping", "N s/m^(p+1)", Box::new(damping)));
    }
    all
}

/// Standard deviation of every quantity at the parameters of `f`, carried through differences; `overdispersion`
/// inflates the noise's variance.
fn deviations(f: &Fitted, of: &[Quantity], overdispersion: f64) -> Vec<f64> {
    let covariance = f.problem().covariance(&f.fit.point);
    let base = f.structure.base();
    let n = match &base.machine {
        Some(m) => m.facts().free.len(),
        None if base.hysteresis => 3,
        None => 2,
    };
    let theta = &f.fit.point.theta;
    let deviation = |q: &Quantity| {
        let Some(c) = &covariance else { return f64::NAN };
        let g: Vec<f64> = (0..n)
            .map(|j| {
                let mut v = theta.clone();
                v[j] += 1e-5;
                ((q.value)(&v) - (q.value)(theta)) / 1e-5
            })
            .collect();
        let var: f64 = (0..n).map(|i| (0..n).map(|j| g[i] * c[(i, j)] * g[j]).sum::<f64>()).sum();
        (var.max(0.0) * overdispersion.max(1.0)).sqrt()
    };
    of.iter().map(deviation).collect()
}

/// Stiffness, exponent and damping before and after, with the force at the reference depth, in which the first two
/// do not trade off. `overdispersion` inflates the noise's variance.
pub fn biases(base: &Fitted, chosen: &Fitted, overdispersion: f64) -> Vec<Bias> {
    let (b, a) = (&base.fit.point.theta, &chosen.fit.point.theta);
    let all = quantities(base);
    let sds = deviations(chosen, &all, overdispersion);
    let bias = |(q, sd): (&Quantity, f64)| {
        let (before, after) = ((q.value)(b), (q.value)(a));
        Bias {
            name: q.name.clone(),
            unit: q.unit.clone(),
            before,
            after,
            percent: if after == 0.0 { f64::NAN } else { 100.0 * (before - after) / after },
            sigmas: (before - after) / sd,
        }
    };
    all.iter().zip(sds).map(bias).collect()
}

/// The simulation's own parameters as `f` has them, by the element's names, with 95 % intervals from the covariance.
pub fn of_element(f: &Fitted, overdispersion: f64) -> Vec<Interval> {
    let all = quantities(f);
    let sds = deviations(f, &all, overdispersion);
    let interval = |(q, sd): (&Quantity, f64)| {
        let value = (q.value)(&f.fit.point.theta);
        Interval {
            name: q.parameter,
            value,
            unit: q.parameter_unit,
            low: value - 1.96 * sd,
            high: value + 1.96 * sd,
            held: false,
        }
    };
    all.iter().zip(sds).map(interval).filter(|i| !i.name.is_empty() && i.ends().is_some()).collect()
}
