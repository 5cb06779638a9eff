//! The diagnosis on campaigns made by the harness itself: silent when nothing is missing, the right name when something is.

use touchdown::demo::{write_campaign, Recipe};
use touchdown::diagnose::run::{diagnose, Outcome};
use touchdown::record;

fn outcome(recipe: &Recipe) -> Outcome {
    let dir = tempfile::tempdir().unwrap();
    write_campaign(dir.path(), recipe).unwrap();
    diagnose(&record::load(dir.path()).unwrap()).unwrap()
}

fn names(o: &Outcome) -> Vec<String> {
    o.verdict["missing"].as_array().unwrap().iter().map(|m| m["mechanism"].as_str().unwrap().to_string()).collect()
}

#[test]
fn nothing_is_reported_where_nothing_is_missing() {
    for seed in [1, 2] {
        let o = outcome(&Recipe { seed, ..Recipe::default() });
        assert_eq!(o.verdict["mismatch"]["detected"], false, "{:?}", o.candidates.first());
        assert!(names(&o).is_empty() && o.after.is_none());
    }
}

#[test]
fn hidden_friction_is_named_sized_and_improves_levels_not_seen() {
    let mut r = Recipe::default();
    r.physics.friction = 0.8;
    let o = outcome(&r);
    assert_eq!(names(&o), ["guide_friction"]);
    assert_eq!(o.verdict["mismatch"]["where"][0]["origin"], "motion");
    let p = &o.verdict["missing"][0]["parameters"]["friction"];
    let v = p["value"].as_f64().unwrap();
    assert!((v - 0.8).abs() < 0.12, "{p}");
    assert!(o.after.unwrap().nrmse < o.before.nrmse);
}

#[test]
fn a_permanent_set_is_named_and_located_in_the_unloading() {
    let mut r = Recipe::default();
    r.physics.law.plastic_ratio = 0.15;
    r.physics.law.yield_penetration = 5e-5;
    let o = outcome(&r);
    assert_eq!(names(&o), ["plastic_indentation"]);
    assert_eq!(o.verdict["mismatch"]["where"][0]["phase"], "unloading");
    assert!(o.law.plastic_ratio > 0.1);
}

#[test]
fn a_low_pass_filter_in_the_chain_leaves_the_element_right() {
    use touchdown::model::physics::LowPass;
    use touchdown::record::Channel;
    let mut r = Recipe::default();
    r.physics.low_pass = Some(LowPass { corner: 2.0e4, form: 1, damping: 1.0, channel: Channel::Force });
    let o = outcome(&r);
    let n = names(&o);
    assert!(n == ["lowpass_lag"] || n == ["channel_skew"], "{n:?}");
    assert_eq!(o.verdict["mismatch"]["where"][0]["origin"], "chain");
}

#[test]
fn the_same_campaign_gives_the_same_verdict_on_one_thread_and_on_many() {
    let r = Recipe { seed: 3, ..Recipe::default() };
    let verdict = |threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| outcome(&r).verdict.to_string())
    };
    let (a, b) = (verdict(1), verdict(4));
    // the folder's name is a temporary one
    let fit = |v: &str| v[v.find("\"fit\"").unwrap()..v.find("\"format\"").unwrap()].to_string();
    assert_eq!(fit(&a), fit(&b));
}
