//! Descent and probing of a fit on a campaign written by the plant.

use diagnose::run::ready;
use diagnose::search::Search;
use estimate::descent::{descend, gained, polish, probe};
use estimate::problem::{Nuisance, Problem};
use estimate::Watch;
use plant::recipe::{write_campaign, Recipe};
use std::sync::atomic::AtomicBool;

#[test]
fn a_touch_moved_by_samples_comes_back_and_the_rest_is_probed_uphill() {
    let dir = tempfile::tempdir().unwrap();
    write_campaign(dir.path(), &Recipe::default()).unwrap();
    let campaign = record::load(dir.path()).unwrap();
    let (data, guess) = ready(&campaign).unwrap();
    let search = Search::new(&campaign, &data);
    let case = search.case(&campaign, guess);
    let model = (case.model)(guess.k, guess.p, 0.2 * guess.k);
    let problem = Problem::new(&data, &model);
    let stop = AtomicBool::new(false);
    let watch = Watch { stop: &stop, deadline: None, say: &|_| {} };
    let d = descend(&problem, problem.start(), &watch);
    assert!(d.rested && d.objective.windows(2).all(|w| w[1] <= w[0]));
    let covariance = problem.covariance(&d.point).unwrap();
    let p = probe(&problem, &d.point, &covariance, 0.3).unwrap();
    // a parabola rises by 0.09
    assert!(p.rise > 0.0 && p.rise < 0.2, "{}", p.rise);
    let at = problem.nuisances().iter().position(|n| *n == Nuisance::Start).unwrap();
    let mut locals = d.point.locals.clone();
    locals[3][at] += 2.4 * data.scales.dt;
    let moved = problem.evaluate(d.point.theta.clone(), locals);
    assert!(moved.chi2 > d.point.chi2 + 10.0);
    let back = polish(&problem, &moved);
    assert!(!gained(&data, back.chi2, d.point.chi2), "{} against {}", back.chi2, d.point.chi2);
    // a point beside the minimum is not taken for one
    let mut theta = d.point.theta.clone();
    theta[1] += 2.0 * covariance[(1, 1)].sqrt();
    let beside = problem.evaluate(theta, d.point.locals.clone());
    assert!(probe(&problem, &beside, &covariance, 0.3).unwrap().rise < 0.0);
    stop.store(true, std::sync::atomic::Ordering::SeqCst);
    assert!(!descend(&problem, problem.start(), &watch).rested);
}
