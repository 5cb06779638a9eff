//! How far the simulation's own parameters had been biased by what it leaves out.

use estimate::fitted::Fitted;

/// One parameter of the base, as calibrated without and with the mechanisms found.
#[derive(Clone, Debug, PartialEq)]
pub struct Bias {
    pub name: &'static str,
    pub unit: String,
    pub before: f64,
    pub after: f64,
    /// (before - after) / after in per cent; NaN where `after` is zero.
    pub percent: f64,
    /// before - after in standard deviations of the calibration after.
    pub sigmas: f64,
}

/// Stiffness, exponent and damping before and after, with the force at the reference depth, in which the first two
/// do not trade off. `overdispersion` inflates the noise's variance.
pub fn biases(base: &Fitted, chosen: &Fitted, overdispersion: f64) -> Vec<Bias> {
    let covariance = chosen.problem().covariance(&chosen.fit.point);
    let hysteresis = base.structure.base().hysteresis;
    let (b, a) = (&base.fit.point.theta, &chosen.fit.point.theta);
    let s = base.data.scales;
    // value of a quantity at the parameters, and its deviation carried through differences
    let quantity = |name: &'static str, unit: String, of: &dyn Fn(&[f64]) -> f64| {
        let (before, after) = (of(b), of(a));
        let n = if hysteresis { 3 } else { 2 };
        let sd = covariance.as_ref().map_or(f64::NAN, |c| {
            let g: Vec<f64> = (0..n)
                .map(|j| {
                    let mut v = a.clone();
                    v[j] += 1e-5;
                    (of(&v) - after) / 1e-5
                })
                .collect();
            let var: f64 = (0..n).map(|i| (0..n).map(|j| g[i] * c[(i, j)] * g[j]).sum::<f64>()).sum();
            (var.max(0.0) * overdispersion.max(1.0)).sqrt()
        });
        Bias {
            name,
            unit,
            before,
            after,
            percent: if after == 0.0 { f64::NAN } else { 100.0 * (before - after) / after },
            sigmas: (before - after) / sd,
        }
    };
    let stiffness = move |t: &[f64]| (t[0] - t[1] * s.x_ref.ln()).exp();
    let mut out = vec![
        quantity("force at reference depth", "N".into(), &|t| t[0].exp()),
        quantity("k", "N/m^p".into(), &stiffness),
        quantity("p", "1".into(), &|t| t[1]),
    ];
    if hysteresis {
        out.push(quantity("mu_d", "N s/m^(p+1)".into(), &move |t| t[2] * stiffness(t) / s.v_ref));
    }
    out
}
