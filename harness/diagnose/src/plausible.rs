//! Whether channels and speeds agree at all: a wrong unit is no physics, nor are two campaigns in one folder.

use crate::agreement::{agreement, Agreement};
use estimate::condition::Invalid;
use estimate::problem::{Data, Record};
use nalgebra::{DMatrix, DVector};
use record::statistics::median;
use record::{Campaign, Kind, Recording, GRAVITY};

/// Factor beyond which two measurements of one thing are in different units: the smallest step between neighbouring
/// SI prefixes is 1000, g and m/s^2 differ by 9.8, mm and cm by 10.
const APART: f64 = 6.0;

fn refused(file: &str, what: String, cure: &str) -> Invalid {
    Invalid(format!("{file}: {what}; {cure}"))
}

/// Checks force against mass times acceleration and against a calibrated simulation, what the push adds up to against
/// the speed of the impact, that against the height of the fall, and that the recordings are of one campaign. Gives what was compared
/// over all recordings.
///
/// # Errors
/// Everything that disagrees, a line each: the recording, what disagrees and by what factor, and the cure; or over all recordings, a
/// unit that was taken for another.
pub fn check(c: &Campaign, data: &Data) -> Result<Agreement, Invalid> {
    let mut found: Vec<Invalid> = against_given(c, data).err().into_iter().collect();
    if c.kind != Kind::Indentation {
        found.extend(c.recordings.iter().filter_map(|r| against_height(r).err()));
        for rec in &data.records {
            let alike = || if data.are_of_one_body() { force_against_acceleration(data, rec) } else { Ok(()) };
            let of = [alike(), way_against_speed(rec), push_against_speed(data, rec)];
            // one wrong unit shows in all of them
            found.extend(of.into_iter().find_map(Result::err));
        }
    }
    if !found.is_empty() {
        return Err(Invalid(found.into_iter().map(|e| e.0).collect::<Vec<_>>().join("\n")));
    }
    // what is a smaller factor off than the checks above see, and yet a unit
    let agreed = agreement(c);
    if !agreed.units.is_empty() {
        return Err(Invalid(agreed.units.join("\n")));
    }
    one_campaign(c, data)?;
    Ok(agreed)
}

/// Factor between a measured speed of impact and that of a free fall beyond which one of them is in another unit: guides
/// take some of the speed, nothing adds to it.
const FALL_APART: f64 = 3.0;

/// The speed of the impact against the height of the fall, where both are given.
fn against_height(r: &Recording) -> Result<(), Invalid> {
    let (Some(h), Some((v, _))) = (r.drop_height, r.impact_speed) else { return Ok(()) };
    let fall = (2.0 * GRAVITY * h).sqrt();
    if fall > 0.0 && v > 0.0 && !(1.0 / FALL_APART..=FALL_APART).contains(&(v / fall)) {
        return Err(refused(
            &r.file,
            format!("a free fall of {h} m ends at {fall:.3} m/s, impact_speed is {v} m/s"),
            "correct drop_height (m) or impact_speed (m/s) in campaign.toml",
        ));
    }
    Ok(())
}

/// Readings less what the channel reads at rest.
fn centred(y: &[f64]) -> Vec<f64> {
    let quiet = (y.len() / 20).max(4);
    let mut start = y[..quiet].to_vec();
    start.sort_by(f64::total_cmp);
    y.iter().map(|v| v - start[quiet / 2]).collect()
}

/// Force against mass times acceleration.
fn force_against_acceleration(data: &Data, rec: &Record) -> Result<(), Invalid> {
    let (Some(f), Some(a)) = (&rec.y[0], &rec.y[1]) else { return Ok(()) };
    let (f, a, n) = (centred(f), centred(a), f.len());
    let mut sorted = f.clone();
    sorted.sort_by(f64::total_cmp);
    // the middle of the ratios while the push is strong: a spike does not move it
    let strong = 0.3 * sorted[n - 1 - n / 100];
    let pairs = f.iter().zip(&a).filter(|(f, _)| **f > strong);
    let mut ratios: Vec<f64> = pairs.map(|(f, a)| f / (-data.mass * a)).filter(|q| q.is_finite()).collect();
    ratios.sort_by(f64::total_cmp);
    if ratios.len() < 5 {
        return Ok(());
    }
    let ratio = ratios[ratios.len() / 2];
    if ratio < 0.0 && ratios[ratios.len() * 9 / 10] < 0.0 {
        return Err(refused(
            &rec.file,
            "acceleration is positive while the stop pushes back".into(),
            "turn the sign of acceleration (negative while the stop pushes) or of force",
        ));
    }
    if ratio > 0.0 && !(1.0 / APART..=APART).contains(&ratio) {
        return Err(refused(
            &rec.file,
            format!("force is {ratio:.3e} times mass times acceleration"),
            "correct the unit of force or acceleration in its header, or moving_mass (kg) in campaign.toml",
        ));
    }
    Ok(())
}

/// The way to the deepest point against the speed of the impact.
fn way_against_speed(rec: &Record) -> Result<(), Invalid> {
    let (Some((v, _)), Some(x)) = (rec.speed, &rec.y[2]) else { return Ok(()) };
    // from the start to 0.8 of the deepest point the body covers that distance at most at impact speed
    let deep = x.iter().cloned().fold(f64::MIN, f64::max);
    let reach = x[0] + 0.8 * (deep - x[0]);
    let Some(i) = x.iter().position(|x| *x >= reach) else { return Ok(()) };
    let t = rec.setup.time[i] - rec.setup.time[0];
    let ratio = (x[i] - x[0]) / (v * t).max(1e-300);
    if i > 4 && !(1.0 / (3.0 * APART)..=APART).contains(&ratio) {
        return Err(refused(
            &rec.file,
            format!("penetration moves {ratio:.3e} times as fast as the speed given, {v} m/s"),
            "correct the unit of penetration or time in its header, or the speed (m/s) in campaign.toml",
        ));
    }
    Ok(())
}

/// What the push adds up to against the speed of the impact.
fn push_against_speed(data: &Data, rec: &Record) -> Result<(), Invalid> {
    let Some((v, _)) = rec.speed else { return Ok(()) };
    let (what, mass, y) = match (&rec.y[1], &rec.y[0]) {
        (Some(a), _) => ("acceleration", -data.mass, a),
        (None, Some(f)) => ("force", 1.0, f),
        _ => return Ok(()),
    };
    let (time, n) = (&rec.setup.time, y.len());
    let dt = (time[n - 1] - time[0]) / (n - 1) as f64;
    let pushes: Vec<f64> = centred(y).iter().map(|u| mass * u).collect();
    let (mut speed, mut most): (f64, f64) = (0.0, 0.0);
    // beyond the weight, which a body at rest is pushed by as long as it is recorded
    let (mut gained, mut beyond): (f64, f64) = (0.0, 0.0);
    for u in &pushes {
        speed += u / data.mass * dt;
        most = most.max(speed);
        gained = (gained + (u / data.mass - GRAVITY) * dt).max(0.0);
        beyond = beyond.max(gained);
    }
    let [ratio, beyond] = [most, beyond].map(|u| u / v.max(1e-300));
    // a push recorded to its end stops the body at least; the speed may be more than there was by what guides take of a fall
    let top = (0..n).max_by(|a, b| pushes[*a].total_cmp(&pushes[*b])).unwrap_or(0);
    let ends = pushes[top..].iter().any(|u| *u < 0.1 * pushes[top]);
    let least = if ends { 1.0 / FALL_APART } else { 0.1 / APART };
    if ratio >= least && beyond <= 2.0 * APART {
        return Ok(());
    }
    Err(refused(
        &rec.file,
        format!("{what} adds up to {ratio:.3e} times the speed given, {v} m/s"),
        &format!(
            "correct the unit of {what} or time in its header, moving_mass (kg) or the speed (m/s) in campaign.toml, or \
             leave a recording out in which no impact stops the body"
        ),
    ))
}

/// Force against what the simulation as given makes of the penetration.
fn against_given(c: &Campaign, data: &Data) -> Result<(), Invalid> {
    let (Some(k), Some(p)) = (c.simulation.k, c.simulation.p) else { return Ok(()) };
    let ratio = |rec: &Record| of_given(rec.y[0].as_ref()?, rec.y[2].as_ref()?, |x| k * x.powf(p));
    let ratios: Vec<(&Record, f64)> = data.records.iter().filter_map(|r| Some((r, ratio(r)?))).collect();
    let Some(i) = wrong_unit(&ratios.iter().map(|(r, q)| (r.level, *q)).collect::<Vec<_>>()) else { return Ok(()) };
    let (rec, ratio) = ratios[i];
    Err(refused(
        &rec.file,
        format!("force is {ratio:.3e} times the k x^p of [simulation]"),
        "correct the unit of force or penetration in its header, or k (N/m^p) and p in campaign.toml; without k and p the \
         simulation counts as not calibrated yet",
    ))
}

/// Factor by which that ratio may change from half the depth to the whole of it: what a law is off by more is no unit.
const BENT: f64 = 3.0;

/// Force over what is given for the penetration, where that is near enough the same at every depth, as a wrong unit leaves
/// it. None where it is not (a second stop, a law of another shape), and where too few samples are deep.
fn of_given(force: &[f64], penetration: &[f64], given: impl Fn(f64) -> f64) -> Option<f64> {
    let deepest = penetration.iter().cloned().fold(f64::MIN, f64::max);
    let between = |from: f64, to: f64| {
        let at = force.iter().zip(penetration).filter(|(_, x)| (from..to).contains(&(*x / deepest)));
        let ratios: Vec<f64> = at.map(|(f, x)| f / given(*x)).filter(|r| r.is_finite()).collect();
        (ratios.len() >= 5).then(|| median(ratios))
    };
    let whole = between(0.7, 1.1)?;
    let is_same = |half: f64| (1.0 / BENT..=BENT).contains(&(half / whole));
    between(0.35, 0.7).is_none_or(is_same).then_some(whole)
}

/// The first of (level, force over the given simulation's) that a wrong unit must have made: far off where the campaign
/// as a whole is, or where others of its level are not. Some levels alone are off where the given law is a bad one.
fn wrong_unit(ratios: &[(usize, f64)]) -> Option<usize> {
    let off = |ratio: f64| !(1.0 / GIVEN..=GIVEN).contains(&ratio);
    let all_off = !ratios.is_empty() && off(median(ratios.iter().map(|t| t.1).collect()));
    let mate_fine = |level: usize| ratios.iter().any(|(l, q)| *l == level && !off(*q));
    ratios.iter().position(|(level, ratio)| off(*ratio) && (all_off || mate_fine(*level)))
}

/// Factor between force and a calibrated k x^p that no physics left out makes.
const GIVEN: f64 = 100.0;
/// Natural logarithm of the factor by which the peaks of two sets have to differ before they count as two campaigns: the
/// smallest step between units in use is 2.2, from pound to kilogram. A contact that changes from one impact to the next
/// does less, and is for the diagnosis to say.
const SETS_APART: f64 = std::f64::consts::LN_2;

/// Refuses recordings that fall into two sets: at the same speed, preload or depth their peaks differ by a factor
/// while within a set they agree. Nothing that happens to one contact does that by so much.
fn one_campaign(c: &Campaign, data: &Data) -> Result<(), Invalid> {
    let mut points: Vec<(f64, f64, &str)> = Vec::new();
    for (rec, r) in data.records.iter().zip(&c.recordings) {
        let drive = match c.kind {
            Kind::DropTest => rec.speed.map(|v| v.0),
            Kind::ContactorOpening => r.spring_preload,
            // what FMUs are set to may be anything
            Kind::System => None,
            Kind::Indentation => rec.y[2].as_ref().map(|x| x.iter().cloned().fold(f64::MIN, f64::max)),
        };
        let peak = match (&rec.y[0], &rec.y[1]) {
            (Some(f), _) => f.iter().cloned().fold(f64::MIN, f64::max),
            (None, Some(a)) => data.mass * a.iter().fold(f64::MIN, |m, a| m.max(-a)),
            _ => continue,
        };
        if let Some(d) = drive.filter(|d| *d > 0.0 && peak > 0.0) {
            points.push((d.ln(), peak.ln(), &rec.file));
        }
    }
    let Some((groups, factor)) = two_sets(&points.iter().map(|p| (p.0, p.1)).collect::<Vec<_>>()) else {
        return Ok(());
    };
    let list = |which: bool| -> String {
        let names: Vec<&str> = points.iter().zip(&groups).filter(|(_, g)| **g == which).map(|(p, _)| p.2).collect();
        match names.len() {
            0..=3 => names.join(", "),
            n => format!("{}, {} and {} more", names[0], names[1], n - 2),
        }
    };
    Err(Invalid(format!(
        "the recordings fall into two sets, {} and {}: driven alike, their peaks differ by a factor of {factor:.2}; put \
         two campaigns in two folders, correct the units of one set, or leave it out",
        list(false),
        list(true)
    )))
}

/// Membership in the upper of two parallel lines, and the factor between them, where two lines explain
/// (ln drive, ln peak) and one parabola does not.
fn two_sets(points: &[(f64, f64)]) -> Option<(Vec<bool>, f64)> {
    let n = points.len();
    if n < 6 {
        return None;
    }
    let mean = points.iter().map(|p| p.0).sum::<f64>() / n as f64;
    // least squares on 1, x, x^2 and, with groups, membership; the residuals and the last coefficient
    let fit = |groups: Option<&[bool]>| -> Option<(Vec<f64>, f64)> {
        let spread = points.iter().map(|p| (p.0 - mean).abs()).fold(0.0, f64::max);
        let powers = if spread < 1e-6 { 1 } else { 3 };
        let m = powers + usize::from(groups.is_some());
        let a = DMatrix::from_fn(n, m, |i, j| match (j < powers, groups) {
            (true, _) => ((points[i].0 - mean) / spread.max(1e-6)).powi(j as i32),
            (false, Some(g)) => f64::from(u8::from(g[i])),
            _ => 0.0,
        });
        let y = DVector::from_fn(n, |i, _| points[i].1);
        let x = a.clone().svd(true, true).solve(&y, 1e-9).ok()?;
        Some(((&y - a * &x).iter().cloned().collect(), x[m - 1]))
    };
    let rms = |r: &[f64]| (r.iter().map(|v| v * v).sum::<f64>() / n as f64).sqrt();
    let (single, _) = fit(None)?;
    if rms(&single) < 0.1 {
        return None;
    }
    // above and below the one curve, then by the nearer of the two lines until nothing moves
    let mut groups: Vec<bool> = single.iter().map(|r| *r > 0.0).collect();
    let mut last = fit(Some(&groups))?;
    for _ in 0..20 {
        let (residual, step) = &last;
        let next: Vec<bool> = (0..n)
            .map(|i| {
                let low = residual[i] + if groups[i] { *step } else { 0.0 };
                (low - step).abs() < low.abs()
            })
            .collect();
        if next == groups {
            break;
        }
        groups = next;
        last = fit(Some(&groups))?;
    }
    let (residual, step) = last;
    let members = groups.iter().filter(|g| **g).count();
    let both = members >= 2 && n - members >= 2;
    (both && step.abs() > SETS_APART && rms(&residual) < 0.2 * rms(&single)).then(|| (groups, step.abs().exp()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_unit_is_off_everywhere_or_among_its_like_a_bad_law_at_some_levels() {
        assert_eq!(wrong_unit(&[(0, 2e3), (0, 1.5e3), (1, 1.1e3)]), Some(0));
        assert_eq!(wrong_unit(&[(0, 1.2), (0, 1.1e3), (1, 0.9)]), Some(1));
        assert_eq!(wrong_unit(&[(0, 130.0), (0, 140.0), (1, 12.0), (1, 11.0), (2, 1.5), (2, 1.6)]), None);
        assert_eq!(wrong_unit(&[]), None);
    }

    #[test]
    fn a_wrong_unit_is_as_far_off_at_every_depth_and_another_law_is_not() {
        let depth: Vec<f64> = (0..100).map(|i| 1e-5 * i as f64).collect();
        let of = |force: &dyn Fn(f64) -> f64| {
            of_given(&depth.iter().map(|x| force(*x)).collect::<Vec<_>>(), &depth, |x| 1e6 * x)
        };
        assert!((of(&|x| 1e9 * x).unwrap() - 1e3).abs() < 1.0);
        assert_eq!(of(&|x| 1e6 * x + 5e8 * (x - 6e-4).max(0.0)), None);
        assert_eq!(of(&|x| 1e15 * x.powi(4)), None);
    }

    #[test]
    fn two_parallel_lines_are_two_sets_and_one_bent_line_is_one() {
        let line = |i: usize, shift: f64| {
            let x = 0.3 * (i / 2) as f64;
            (x, 1.2 * x + 0.05 * x * x + shift + 0.004 * ((i * 7919) % 13) as f64)
        };
        let one: Vec<(f64, f64)> = (0..10).map(|i| line(i, 0.0)).collect();
        assert_eq!(two_sets(&one), None);
        let bent: Vec<(f64, f64)> = one.iter().map(|(x, y)| (*x, y + if *x > 0.8 { x - 0.8 } else { 0.0 })).collect();
        assert_eq!(two_sets(&bent), None);
        let both: Vec<(f64, f64)> = one.iter().copied().chain((0..8).map(|i| line(i, 0.7))).collect();
        let (groups, factor) = two_sets(&both).unwrap();
        assert!(groups[..10].iter().all(|g| !g) && groups[10..].iter().all(|g| *g));
        assert!((factor.ln() - 0.7).abs() < 0.02, "{factor}");
    }
}
