//! The diagnosis on campaigns made by the harness itself: silent when nothing is missing, the right name when something is.

use diagnose::run::{diagnose, diagnose_with, Outcome, Settings};
use plant::recipe::{write_campaign, Recipe};
use record::Campaign;
use report::diagnosis::summary;
use std::path::Path;

fn load(dir: &Path) -> Campaign {
    estimate::window::windowed(record::load(dir, &mechanisms::terms()).unwrap())
}

fn outcome(recipe: &Recipe) -> Outcome {
    let dir = tempfile::tempdir().unwrap();
    write_campaign(dir.path(), recipe).unwrap();
    diagnose(&load(dir.path())).unwrap()
}

fn names(o: &Outcome) -> Vec<&str> {
    o.verdict.missing.iter().map(|m| m.mechanism).collect()
}

#[test]
fn nothing_is_reported_where_nothing_is_missing() {
    for seed in [1, 2] {
        let o = outcome(&Recipe { seed, ..Recipe::default() });
        assert!(!o.verdict.mismatch.detected, "{:?}", o.findings.rivals.first());
        assert!(names(&o).is_empty() && o.after.is_none());
    }
}

/// Presses of a half space, three of each of three levels, whose stiffness differs by some per cent from one to the next; noise
/// from a linear congruence.
fn scattering_presses(dir: &Path) {
    let mut toml = String::from("format = \"recordings/1\"\n[campaign]\nkind = \"indentation\"\n");
    toml += "[simulation]\nterms = []\nk = 4e9\np = 1.5\n";
    let mut seed = 7u64;
    let mut noise = || {
        seed = (seed * 16807 + 11) % 2_147_483_647;
        2.0 * (seed as f64 / 2_147_483_647.0) - 1.0
    };
    for (r, off) in [-8.0, 8.0, 1.6, 5.6, -6.4, 2.4, -3.2, 7.2, -4.8].into_iter().enumerate() {
        let level = 2e-5 * (r / 3 + 1) as f64;
        let mut csv = String::from("time [s],force [N],penetration [m]\n");
        for i in 0..64 {
            let t = f64::from(i) / 63.0;
            let x = level * (1.3 * (std::f64::consts::PI * t).sin() - 0.3);
            let force = 4e9 * (1.0 + 0.01 * off) * x.max(0.0).powf(1.5);
            csv += &format!("{:e},{:e},{:e}\n", 0.1 * t, force + 3.0 * noise(), x + 3e-8 * noise());
        }
        std::fs::write(dir.join(format!("r{r}.csv")), csv).unwrap();
        toml += &format!("[[recording]]\nfile = \"r{r}.csv\"\norder = {}\nlevel = {level:e}\n", r + 1);
    }
    std::fs::write(dir.join("campaign.toml"), toml).unwrap();
}

#[test]
fn recordings_that_differ_within_a_level_are_no_missing_physics() {
    let dir = tempfile::tempdir().unwrap();
    scattering_presses(dir.path());
    let o = diagnose(&load(dir.path())).unwrap();
    let v = &o.verdict;
    assert!(v.mismatch.detected && v.missing.is_empty(), "{:?}", v.posterior);
    let said = summary(&o);
    assert!(said.contains("No physics is missing (probability 0.") && said.contains("stiffness differs by"), "{said}");
    assert!(!said.contains("that no mechanism known explains"), "{said}");
    // it shows in what is compared; the motion is imposed
    assert!(v.mismatch.places.iter().all(|p| p.channel == "force"), "{:?}", v.mismatch.places);
    let fit = &v.fit.before;
    let (both, force) = (fit.heldout_nrmse.unwrap(), fit.heldout_nrmse_of_force.unwrap());
    assert!(force > 1.5 * both && force < 2.0 * both, "{both} {force}");
}

/// The campaign of `recipe` with one channel kept.
fn only(recipe: &Recipe, channel: &str) -> Outcome {
    let dir = tempfile::tempdir().unwrap();
    write_campaign(dir.path(), recipe).unwrap();
    for i in 1..=10 {
        let path = dir.path().join(format!("r{i:02}.csv"));
        let text = std::fs::read_to_string(&path).unwrap();
        let keep = text.lines().next().unwrap().split(',').position(|h| h.starts_with(channel)).unwrap();
        let cut = |l: &str| {
            let v: Vec<&str> = l.split(',').collect();
            format!("{},{}\n", v[0], v[keep])
        };
        std::fs::write(&path, text.lines().map(cut).collect::<String>()).unwrap();
    }
    diagnose(&load(dir.path())).unwrap()
}

#[test]
fn one_channel_alone_raises_no_alarm_and_says_what_it_cannot_show() {
    for (channel, seed) in [("force", 5), ("acceleration", 5), ("penetration", 2), ("penetration", 5)] {
        let o = only(&Recipe { seed, ..Recipe::default() }, channel);
        assert!(!o.verdict.mismatch.detected, "{channel} {seed}: {:?}", o.verdict.posterior.first());
        // no force is too large to show: what cannot be seen in a channel would be as likely as nothing
        let unknown = o.verdict.posterior.iter().find(|c| c.mechanisms == ["unknown"]);
        assert!(unknown.is_none_or(|u| u.probability < 0.25), "{channel} {seed}: {unknown:?}");
        assert!(o.findings.caveats.iter().any(|c| c.starts_with("One channel only")), "{:?}", o.findings.caveats);
    }
}

#[test]
fn hidden_friction_is_named_sized_and_improves_levels_not_seen() {
    let mut r = Recipe::default();
    r.physics.guide_friction.coulomb = 0.8;
    let o = outcome(&r);
    assert_eq!(names(&o), ["guide_friction"]);
    assert_eq!(o.verdict.mismatch.places[0].origin, "motion");
    let p = &o.verdict.missing[0].parameters["friction"];
    assert!((p.value - 0.8).abs() < 0.12, "{p:?}");
    assert!(o.after.unwrap().nrmse < o.before.nrmse);
}

#[test]
fn long_and_dense_recordings_give_the_name_of_the_short_one_and_predictions_of_the_whole() {
    // 0.2 s after the drop; and 50 samples for one
    for (samples, interval) in [(20_000, 1e-5), (35_000, 2e-7)] {
        let mut r = Recipe { samples, interval, ..Recipe::default() };
        r.physics.guide_friction.coulomb = 0.8;
        let o = outcome(&r);
        assert_eq!(names(&o), ["guide_friction"], "{samples}");
        assert!(o.data.samples() <= 3 * 10 * 2400, "{}", o.data.samples());
        let judged = |c: &String| c.contains(&format!("of {} samples", 10 * samples));
        assert!(o.findings.caveats.iter().any(judged), "{:?}", o.findings.caveats);
        for (y, r) in o.after.unwrap().predictions.of_the_whole().iter().zip(&o.data.records) {
            let times = r.whole.as_ref().unwrap();
            let ends = (times[0], times[times.len() - 1] / (interval * (samples - 1) as f64));
            assert!(ends.0 == 0.0 && (ends.1 - 1.0).abs() < 1e-9, "{ends:?}");
            assert!(y.iter().all(|y| y.len() == times.len() && y.iter().all(|v| v.is_finite())));
        }
    }
}

#[test]
fn gravity_left_out_is_found_wherever_the_speeds_were_measured() {
    for speed_at_touch in [false, true] {
        let dir = tempfile::tempdir().unwrap();
        write_campaign(dir.path(), &Recipe { speed_at_touch, ..Recipe::default() }).unwrap();
        let head = dir.path().join("campaign.toml");
        let text = std::fs::read_to_string(&head).unwrap();
        std::fs::write(&head, text.replace("\"gravity\", ", "")).unwrap();
        let o = diagnose(&load(dir.path())).unwrap();
        assert_eq!(names(&o), ["gravity"], "at touch: {speed_at_touch}");
        let p = &o.verdict.missing[0].parameters["gravity"];
        assert!(p.ci95.is_some_and(|[low, high]| low < 9.81 && 9.81 < high), "at touch: {speed_at_touch}: {p:?}");
    }
}

#[test]
fn a_permanent_set_is_named_and_located_in_the_unloading() {
    let mut r = Recipe::default();
    r.physics.law.plastic_indentation.ratio = 0.15;
    r.physics.law.plastic_indentation.yield_penetration = 5e-5;
    let o = outcome(&r);
    assert_eq!(names(&o), ["plastic_indentation"]);
    assert_eq!(o.verdict.mismatch.places[0].phase, "unloading");
    assert!(o.law.plastic_indentation.ratio > 0.1);
    // the FMU holds it, and what it does is the answer's prediction
    let packed = o.element.as_ref().unwrap();
    let starts: Vec<&str> = packed.starts.iter().map(|s| s.0).collect();
    assert!(starts.contains(&"plastic_ratio") && starts.contains(&"yield_penetration"), "{starts:?}");
    let through = packed.through.as_ref().unwrap();
    assert!(through.difference < 1e-4, "{}", through.difference);
    assert!(through.predictions == o.after.as_ref().unwrap().predictions);
    assert!(!o.verdict.element.as_ref().unwrap().right);
}

#[test]
fn a_low_pass_filter_in_the_chain_leaves_the_element_right() {
    use mechanisms::lowpass_lag::{Filter, LowPass};
    use record::Channel;
    let mut r = Recipe::default();
    r.physics.low_pass = Some(LowPass::new(2.0e4, Filter::Pole, Channel::Force));
    // the same impacts, seen by sensors without the filter and with hardly any of this noise
    let dir = tempfile::tempdir().unwrap();
    let quiet = Recipe { noise: [0.1, 0.2, 2e-7], ..Recipe::default() };
    let [slow, quick] = [("slow", r), ("quick", quiet)].map(|(name, recipe)| {
        write_campaign(&dir.path().join(name), &recipe).unwrap();
        load(&dir.path().join(name))
    });
    let o = diagnose_with(&slow, &Settings { others: &[quick], ..Settings::default() }).unwrap();
    let n = names(&o);
    assert!(n == ["lowpass_lag"] || n == ["channel_skew"], "{n:?}");
    assert_eq!(o.verdict.mismatch.places[0].origin, "chain");
    assert!(o.verdict.element.as_ref().unwrap().right);
    let of = |channel: &str| o.verdict.other_sensors.iter().find(|b| b.channel == channel).unwrap();
    let (force, acceleration) = (of("force"), of("acceleration"));
    assert_eq!((force.campaign.as_str(), force.mechanism), ("quick", Some("lowpass_lag")));
    assert!((force.lag.value - 5e-5).abs() < 5e-6, "{force:?}");
    assert!(acceleration.mechanism.is_none(), "{acceleration:?}");
    assert!(summary(&o).contains("lags behind by 0.0"), "{}", summary(&o));
}

#[test]
fn a_form_that_extends_another_is_found_from_it_and_nothing_stays_unexplained() {
    // an amplifier of which a share is AC-coupled: the plain droop would leave a shelf
    let mut r = Recipe::default();
    (r.physics.charge_droop.rate, r.physics.charge_droop.share) = (40.0, 0.5);
    let o = outcome(&r);
    assert_eq!(names(&o), ["charge_droop"]);
    assert!(!o.verdict.unexplained.detected);
    let found = &o.verdict.missing[0];
    assert_eq!(found.form, "a share of it, first order");
    for (name, want) in [("droop_rate", 40.0), ("droop_share", 0.5)] {
        let value = found.parameters[name].value;
        assert!((value / want - 1.0).abs() < 0.1, "{name} {value}");
    }
}

#[test]
fn the_same_campaign_gives_the_same_verdict_on_one_thread_and_on_many() {
    let r = Recipe { seed: 3, ..Recipe::default() };
    let verdict = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let mut verdict = pool.install(|| outcome(&r).verdict);
        // a temporary folder's name
        verdict.campaign.clear();
        verdict.json().unwrap()
    };
    assert_eq!(verdict(1), verdict(4));
}

#[test]
fn the_force_it_takes_is_found_where_it_acts() {
    use diagnose::latent::{latent, Place};
    use estimate::fitted::Fitted;
    use estimate::prepare::Prepared;
    let mut r = Recipe::default();
    r.physics.ripple.force = 25.0;
    r.physics.ripple.length = 1.2e-4;
    let dir = tempfile::tempdir().unwrap();
    write_campaign(dir.path(), &r).unwrap();
    let c = load(dir.path());
    let Prepared { data, guess, structure } = Prepared::new(&c).unwrap();
    let l = latent(&Fitted::base(&data, &structure, &guess)).unwrap();
    assert_eq!(l.place, Place::Contact, "{:?}", l.scores);
    // it swings as the ripple does, well out of its band, in the hardest drop
    let hardest = l.records.last().unwrap();
    let (low, high) = hardest.force.iter().fold((0.0f64, 0.0f64), |(a, b), v| (a.min(*v), b.max(*v)));
    assert!(low < -8.0 && low > -60.0 && high > 8.0 && high < 60.0, "{low} to {high}");
    let out = hardest.force.iter().zip(&hardest.band).filter(|(f, b)| f.abs() > **b).count();
    assert!(out > 40, "{out}");
}
