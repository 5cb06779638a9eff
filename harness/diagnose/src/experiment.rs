//! Names that these recordings cannot distinguish (collinear effects): how sure the choice is, and the experiment that
//! would distinguish them.

use super::decide::Decision;
use super::search::Search;
use estimate::fitted::Fitted;
use estimate::problem::{Data, Model, Nuisance, Options, Point, Problem};
use mechanisms::load_history::LoadHistory;
use mechanisms::physics::Physics;
use plant::chain::readings;
use plant::simulate::Trace;
use rayon::prelude::*;
use record::{Channel, Kind};

/// A proposal with what it promises.
#[derive(Clone, Debug, PartialEq)]
pub struct Proposal {
    pub name: &'static str,
    /// What to do, in words.
    pub text: String,
    /// Distance of the two names in the proposed recordings, in standard deviations of noise, after the wrong one
    /// has been refitted to them; the least over the tie set.
    pub sigmas: f64,
    /// Probability of naming the right one with these recordings beside the present ones.
    pub p_right: f64,
}

/// A tie: names that fit as well.
#[derive(Clone, Debug, PartialEq)]
pub struct Tie {
    /// The chosen name first.
    pub set: Vec<&'static str>,
    /// sqrt(lambda): trace left after refit, in sigmas; rho: cosine of the projected signatures (of the closest pair).
    pub trace: f64,
    pub rho: f64,
    /// Phi(sqrt(lambda (1 - rho)/2)).
    pub p_right: f64,
    /// Best first.
    pub proposals: Vec<Proposal>,
}

/// Standard normal distribution function.
pub fn phi(z: f64) -> f64 {
    0.5 * statrs::function::erf::erfc(-z / std::f64::consts::SQRT_2)
}

/// Probability of choosing right between two whose traces are `lambda` (squared sigmas) long with cosine `rho`.
pub fn p_right(lambda: f64, rho: f64) -> f64 {
    phi((lambda.max(0.0) * (1.0 - rho).max(0.0) / 2.0).sqrt())
}

/// A changed rig.
struct Rig {
    name: &'static str,
    text: String,
    data: Data,
    mass: f64,
    speed: f64,
}

/// The ties of a decision, worked out term by term; at most two rivals each are simulated.
pub fn ties(search: &Search, d: &Decision) -> Vec<Option<Tie>> {
    if !d.detected || d.unexplained {
        return Vec::new();
    }
    (0..d.chosen.structure.terms().len())
        .map(|i| {
            let names = d.ties.get(i).filter(|n| !n.is_empty())?;
            let rest = d.chosen.without(i, &Options::default())?;
            let rivals: Vec<Fitted> = names.iter().filter_map(|n| alternative(search, d, &rest, n)).take(2).collect();
            if rivals.is_empty() {
                return None;
            }
            let overdispersion = d.overdispersion.1.max(1.0);
            let (mut worst, mut lambda, mut rho) = (2.0, 0.0, 0.0);
            for b in &rivals {
                let (l, c) = likeness(&rest, &d.chosen, b)?;
                let p = p_right(l / overdispersion, c);
                if p < worst {
                    (worst, lambda, rho) = (p, l / overdispersion, c);
                }
            }
            let now = lambda * (1.0 - rho) * 2.0;
            let mut proposals: Vec<Proposal> = rigs(d)
                .into_par_iter()
                .filter_map(|rig| {
                    let sigmas = rivals
                        .iter()
                        .map(|b| separation(&d.chosen, b, &rig).map(|s| s / overdispersion.sqrt()))
                        .collect::<Option<Vec<f64>>>()?
                        .into_iter()
                        .fold(f64::INFINITY, f64::min);
                    let p_right = phi(0.5 * (now + sigmas * sigmas).sqrt());
                    Some(Proposal { name: rig.name, text: rig.text, sigmas, p_right })
                })
                .collect();
            proposals.extend(rivals.iter().map(|b| hammer(&d.chosen, b)).reduce(f64::min).map(|s| {
                let s = s / overdispersion.sqrt();
                Proposal {
                    name: "hammer calibration",
                    text: "strike the transducer with an instrumented hammer (hard tip, pulse an eighth as long as a \
                           contact) on the same chain and clock"
                        .into(),
                    sigmas: s,
                    p_right: phi(0.5 * (now + s * s).sqrt()),
                }
            }));
            proposals.sort_by(|a, b| b.sigmas.total_cmp(&a.sigmas).then(a.name.cmp(b.name)));
            let set = std::iter::once(d.chosen.names()[i]).chain(names.iter().copied()).collect();
            Some(Tie { set, trace: lambda.max(0.0).sqrt(), rho, p_right: worst, proposals })
        })
        .collect()
}

/// `rest` with the mechanism `name` in its best form.
fn alternative(search: &Search, d: &Decision, rest: &Fitted, name: &str) -> Option<Fitted> {
    if rest.structure.terms().is_empty() {
        if let Some(s) = d.singles.iter().find(|s| s.names() == [name]) {
            return Some(s.clone());
        }
    }
    search
        .candidates()
        .into_iter()
        .filter(|t| t.name() == name && rest.structure.is_at_one_bond_with(t))
        .filter_map(|t| rest.add(&t, 2, &Options::default()))
        .min_by(|a, b| a.chi2().total_cmp(&b.chi2()))
}

/// (lambda, rho) of two candidates against what they share: squared length of the shorter trace after refit, cosine.
fn likeness(rest: &Fitted, a: &Fitted, b: &Fitted) -> Option<(f64, f64)> {
    let data = &rest.data;
    let problem = rest.problem();
    let linear = problem.linearise(&rest.fit.point)?;
    let trace = |c: &Fitted| -> Option<Vec<Vec<f64>>> {
        (0..data.records.len())
            .map(|r| {
                let (t, y) = c.predict(r);
                let (u, z) = rest.predict(r);
                (t.ok && u.ok).then(|| {
                    data.compared(r)
                        .flat_map(|ch| {
                            let i = ch.index();
                            let e: Vec<f64> = y[i].iter().zip(&z[i]).map(|(a, b)| a - b).collect();
                            data.whitened(r, ch, &e)
                        })
                        .collect()
                })
            })
            .collect()
    };
    let (s, t) = (trace(a)?, trace(b)?);
    let mix = |sign: f64| -> Vec<Vec<f64>> {
        s.iter().zip(&t).map(|(s, t)| s.iter().zip(t).map(|(s, t)| s + sign * t).collect()).collect()
    };
    let (ss, tt) = (linear.score(&s).1, linear.score(&t).1);
    let st = 0.25 * (linear.score(&mix(1.0)).1 - linear.score(&mix(-1.0)).1);
    Some((ss.min(tt), (st / (ss * tt).sqrt()).clamp(-1.0, 1.0)))
}

/// Speeds or preloads of the campaign times `factor`, mass times `mass`, record `longer` times as long.
fn changed(data: &Data, factor: f64, longer: f64, order: Option<f64>) -> Data {
    let mut d = data.clone();
    for rec in &mut d.records {
        let s = &mut rec.setup;
        s.speed *= factor;
        s.depth *= factor;
        s.preload *= if data.kind == Kind::ContactorOpening { factor } else { 1.0 };
        if let Some(o) = order {
            s.history = LoadHistory::alike(o - 1.0);
        }
        if let Some(v) = &mut rec.speed {
            v.0 *= factor;
            v.1 *= factor;
        }
        for x in s.imposed.iter_mut().chain(&mut s.imposed_rate) {
            *x *= factor;
        }
        let n = s.time.len();
        if longer > 1.0 {
            let dt = (s.time[n - 1] - s.time[0]) / (n - 1) as f64;
            let last = s.time[n - 1];
            let more = ((longer - 1.0) * n as f64) as usize;
            s.time.extend((1..=more).map(|i| last + dt * i as f64));
        }
        let n = s.time.len();
        for w in &mut rec.weight {
            let last = if data.kind == Kind::Indentation { w.last().copied().unwrap_or(1.0) } else { 1.0 };
            w.resize(n, last);
        }
    }
    d
}

/// The deepest point of an imposed path held for as long as the recording lasts.
fn held(data: &Data) -> Data {
    let mut d = data.clone();
    for rec in &mut d.records {
        let s = &mut rec.setup;
        let n = s.time.len();
        let deep = (0..n).max_by(|a, b| s.imposed[*a].total_cmp(&s.imposed[*b])).unwrap_or(0);
        let dt = (s.time[n - 1] - s.time[0]) / (n - 1) as f64;
        let (x, t0) = (s.imposed[deep], s.time[deep]);
        let tail_x: Vec<f64> = s.imposed[deep + 1..].to_vec();
        let tail_v: Vec<f64> = s.imposed_rate[deep + 1..].to_vec();
        s.imposed.truncate(deep + 1);
        s.imposed_rate.truncate(deep + 1);
        s.imposed.extend(std::iter::repeat_n(x, n));
        s.imposed_rate.extend(std::iter::repeat_n(0.0, n));
        s.imposed.extend(tail_x);
        s.imposed_rate.extend(tail_v);
        s.time.truncate(deep + 1);
        let total = s.imposed.len();
        s.time.extend((1..total - deep).map(|i| t0 + dt * i as f64));
        for w in &mut rec.weight {
            let top = w[deep];
            let tail: Vec<f64> = w[deep + 1..].to_vec();
            w.truncate(deep + 1);
            w.extend(std::iter::repeat_n(top, n));
            w.extend(tail);
        }
    }
    d
}

/// An imposed path run `factor` times faster.
fn faster(data: &Data, factor: f64) -> Data {
    let mut d = data.clone();
    for rec in &mut d.records {
        let s = &mut rec.setup;
        let t0 = s.time[0];
        s.time.iter_mut().for_each(|t| *t = t0 + (*t - t0) / factor);
        s.imposed_rate.iter_mut().for_each(|v| *v *= factor);
        s.duration /= factor;
    }
    d
}

fn rigs(d: &Decision) -> Vec<Rig> {
    let data = &*d.chosen.data;
    let rig = |name, text: String, data, mass, speed| Rig { name, text, data, mass, speed };
    let mut v = vec![rig("repeat", "repeat the campaign as it is".into(), data.clone(), 1.0, 1.0)];
    let tied = d.ties.iter().flatten().copied().chain(d.chosen.names());
    if tied.filter_map(mechanisms::named).any(|m| m.hints.depends_on_history) {
        let fresh = changed(data, 1.0, 1.0, Some(1.0));
        v.push(rig("fresh spot", "repeat every level on a fresh spot".into(), fresh, 1.0, 1.0));
    }
    match data.kind {
        Kind::Indentation => {
            v.push(rig("hold", "hold the deepest point for as long as a recording lasts".into(), held(data), 1.0, 1.0));
            v.push(rig("other rate", "indent five times faster".into(), faster(data, 5.0), 1.0, 1.0));
            v.push(rig("other rate", "indent five times slower".into(), faster(data, 0.2), 1.0, 1.0));
            v.push(rig("other depths", "indent twice as deep".into(), changed(data, 2.0, 1.0, None), 1.0, 1.0));
        }
        // what else of a user's machine may be changed is not known
        Kind::System => {
            let long = changed(data, 1.0, 3.0, None);
            v.push(rig("longer record", "record three times as long".into(), long, 1.0, 1.0));
        }
        kind => {
            let mass = data.mass;
            for f in [3.0, 1.0 / 3.0] {
                let text = format!("the same recordings with a body of {:.3} kg", f * mass);
                v.push(rig("other mass", text, data.clone(), f, 1.0));
            }
            let (name, what, half) = if kind == Kind::DropTest {
                ("other heights", "drop from four times the heights", "drop from a quarter of the heights")
            } else {
                ("other preloads", "open with twice the spring preloads", "open with half the spring preloads")
            };
            v.push(rig(name, what.into(), changed(data, 2.0, 1.0, None), 1.0, 2.0));
            v.push(rig(name, half.into(), changed(data, 0.5, 1.0, None), 1.0, 0.5));
            let n = data.records.iter().map(|r| r.setup.time.len()).max().unwrap_or(0);
            if n < 1500 {
                let long = changed(data, 1.0, 3.0, None);
                v.push(rig("longer record", "record three times as long".into(), long, 1.0, 1.0));
            }
        }
    }
    v
}

/// A candidate's model with the body's mass times `mass`.
fn model_of(c: &Fitted, mass: f64) -> Model<'_> {
    let m = c.structure.model();
    Model::new(m.parameters.clone(), move |t: &[f64], p: &mut Physics| {
        m.apply(t, p);
        p.mass *= mass;
    })
}

/// How far `b`, refitted, stays from what `a` would read on the changed rig, in sigmas; None where it cannot be run.
fn separation(a: &Fitted, b: &Fitted, rig: &Rig) -> Option<f64> {
    let mut data = rig.data.clone();
    let model = model_of(a, rig.mass);
    let locals = |c: &Fitted, d: &Data| -> Vec<Vec<f64>> {
        let names = d.nuisances();
        let each = |l: &Vec<f64>| {
            l.iter().zip(&names).map(|(v, n)| if *n == Nuisance::Speed { v * rig.speed } else { *v }).collect()
        };
        c.fit.point.locals.iter().map(each).collect()
    };
    let of_a = locals(a, &data);
    let mut readings_of_a = Vec::new();
    for r in 0..data.records.len() {
        let problem = Problem::new(&data, &model);
        let (t, y) = problem.predict(&a.fit.point.theta, r, &of_a[r]);
        if !t.ok {
            return None;
        }
        readings_of_a.push((y, t.first_speed));
    }
    let names = data.nuisances();
    let at_speed = names.iter().position(|n| *n == Nuisance::Speed);
    for (r, (y, first)) in readings_of_a.into_iter().enumerate() {
        let rec = &mut data.records[r];
        if let Some(v) = &mut rec.speed {
            v.0 = match at_speed {
                Some(i) if !rec.at_first => of_a[r][i],
                _ => first,
            };
        }
        for (read, y) in rec.y.iter_mut().zip(y) {
            if read.is_some() {
                *read = Some(y);
            }
        }
    }
    let model = model_of(b, rig.mass);
    let problem = Problem::new(&data, &model);
    let start: Point = problem.evaluate(b.fit.point.theta.clone(), locals(b, &data));
    if !start.chi2.is_finite() {
        return None;
    }
    // priors cost a little even where the fit is perfect: what `a` itself pays is not separation
    let own = {
        let model = model_of(a, rig.mass);
        Problem::new(&data, &model).evaluate(a.fit.point.theta.clone(), of_a).chi2
    };
    let fit = problem.fit(start, &Options { iterations: 12, ..Options::default() });
    Some((fit.point.chi2 - own.min(fit.point.chi2)).sqrt())
}

/// Distance of two chains under one known pulse, in sigmas of the force (or acceleration) channel.
fn hammer(a: &Fitted, b: &Fitted) -> f64 {
    let data = &a.data;
    if data.kind == Kind::Indentation {
        return 0.0;
    }
    let Some(rec) = data.records.first() else { return 0.0 };
    let time = rec.setup.time.clone();
    let s = data.scales;
    let length = (s.duration / 8.0).max(6.0 * s.dt);
    let start = time[0] + 0.2 * s.length;
    let pulse: Vec<f64> = time
        .iter()
        .map(|t| {
            let u = (t - start) / length;
            if (0.0..1.0).contains(&u) {
                0.5 * s.peak * (std::f64::consts::PI * u).sin().powi(2)
            } else {
                0.0
            }
        })
        .collect();
    let trace = Trace {
        acceleration: pulse.iter().map(|f| -f / data.mass).collect(),
        force: pulse,
        position: vec![0.0; time.len()],
        velocity: vec![0.0; time.len()],
        ok: true,
        ..Trace::default()
    };
    let read = |c: &Fitted| readings(&c.physics(), &trace, &time);
    let (ya, yb) = (read(a), read(b));
    let mut sum = 0.0;
    for c in data.compared(0).filter(|c| *c != Channel::Penetration) {
        let e: Vec<f64> = ya[c.index()].iter().zip(&yb[c.index()]).map(|(a, b)| a - b).collect();
        sum += data.whitened(0, c, &e).iter().map(|v| v * v).sum::<f64>();
    }
    sum.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_chance_of_naming_right_is_what_the_formula_says() {
        // rho = 0.99 and 10 sigma: 0.76
        assert!((p_right(100.0, 0.99) - 0.7602).abs() < 5e-4, "{}", p_right(100.0, 0.99));
        assert_eq!(p_right(100.0, 1.0), 0.5);
        assert!((phi(1.959964) - 0.975).abs() < 1e-6);
    }
}
