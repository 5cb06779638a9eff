//! A missing force that has no form of the vocabulary: its shape is learned, named for what it depends on, and handed back.

use law::learned::Learned;
use mechanisms::learned_force::{Dependence, LearnedForce, LearnedForces};
use plant::recipe::{write_campaign, Recipe};
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

/// Noise between -1/2 and 1/2 from a linear congruence.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = (self.0 * 16807 + 11) % 2_147_483_647;
        self.0 as f64 / 2_147_483_647.0 - 0.5
    }
}

/// Writes a campaign of presses, each of a level and its samples of time, s, force, N, and penetration, m.
fn write_presses(dir: &Path, name: &str, presses: &[(f64, Vec<[f64; 3]>)]) {
    let mut toml = format!(
        "format = \"recordings/1\"\n[campaign]\nname = \"{name}\"\nkind = \"indentation\"\n[simulation]\nterms = []\n"
    );
    for (k, (level, samples)) in (1..).zip(presses) {
        let mut s = String::from("time [s],force [N],penetration [m]\n");
        samples.iter().for_each(|[t, f, x]| writeln!(s, "{t},{f:e},{x:e}").unwrap());
        std::fs::write(dir.join(format!("r{k}.csv")), s).unwrap();
        write!(toml, "[[recording]]\nfile = \"r{k}.csv\"\norder = {k}\nlevel = {level}\n").unwrap();
    }
    std::fs::write(dir.join("campaign.toml"), toml).unwrap();
}

/// Way to `travel` and back at one rate, in 601 samples, m.
fn way(i: i32, travel: f64) -> f64 {
    travel * (1.0 - f64::from((i - 300i32).abs()) / 300.0)
}

/// Writes a campaign of two presses of a sprung key, at one rate and without a hold: a preload, friction that varies along the
/// way, and a stop.
fn press(dir: &Path) {
    let mut noise = Noise(7);
    let of = |travel: f64| {
        let sample = |i: i32| {
            let x = way(i, travel);
            let direction = if i < 300 { 1.0 } else { -1.0 };
            let friction = direction * (0.03 + 0.02 * (1500.0 * x).sin().abs());
            let force = 0.3 * (1.0 - (-x / 3e-5).exp()) + 70.0 * x + friction + 4e3 * (x - 3.75e-3).max(0.0);
            [0.1 * f64::from(i), force.max(0.0) + 2e-3 * noise.next(), x]
        };
        (1e3 * travel, (0..=600).map(sample).collect())
    };
    write_presses(dir, "key", &[3.9e-3, 4.0e-3].map(of));
}

/// Writes a campaign of presses of a soft layer to two depths at two rates: k x^0.7 that relaxes by two time constants, and lets go
/// where it would pull.
fn soft_layer(dir: &Path) {
    let mut noise = Noise(7);
    let mut of = |level: f64, travel: f64, rate: f64| {
        let (mut branches, mut before) = ([0.0, 0.0], 0.0);
        let interval = 2.0 * travel / rate / 600.0;
        let sample = |i: i32| {
            let x = way(i, travel);
            let elastic = 10.0 * (x / 4e-3).powf(0.7);
            for (b, tau) in branches.iter_mut().zip([0.8, 12.0]) {
                *b = *b * f64::exp(-interval / tau) + (elastic - before);
            }
            before = elastic;
            let force = (elastic + 0.6 * branches[0] + 0.8 * branches[1]).max(0.0);
            [interval * f64::from(i), force + 0.02 * noise.next(), x]
        };
        (level, (0..=600).map(sample).collect())
    };
    let all = [of(1.0, 2e-3, 1e-4), of(2.0, 2e-3, 1e-3), of(3.0, 4e-3, 1e-4), of(4.0, 4e-3, 1e-3)];
    write_presses(dir, "layer", &all);
}

/// The verdict on a campaign.
fn diagnosed(campaign: &Path, out: &Path) -> serde_json::Value {
    let run = Command::new(env!("CARGO_BIN_EXE_touchdown"))
        .args(["diagnose", campaign.to_str().unwrap(), "--out", out.to_str().unwrap()])
        .output()
        .unwrap();
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let name = campaign.file_name().unwrap();
    serde_json::from_slice(&std::fs::read(out.join(name).join("verdict.json")).unwrap()).unwrap()
}

#[test]
fn a_key_with_preload_friction_and_stop_is_named_by_what_its_force_depends_on() {
    let dir = tempfile::tempdir().unwrap();
    let campaign = dir.path().join("key");
    std::fs::create_dir(&campaign).unwrap();
    press(&campaign);
    let out = dir.path().join("answer");
    let v = diagnosed(&campaign, &out);
    let answer = out.join("key");
    let missing = v["missing"].as_array().unwrap();
    let mut names: Vec<&str> = missing.iter().map(|m| m["mechanism"].as_str().unwrap()).collect();
    names.sort_unstable();
    assert_eq!(names, ["contact_preload", "guide_friction", "secondary_stiffening"], "{}", v["learned"]);
    assert!(missing.iter().all(|m| m["form"] == "of a shape of its own"));
    // one rate and no hold part friction from nothing that depends on the rate
    let friction = missing.iter().find(|m| m["mechanism"] == "guide_friction").unwrap();
    assert_eq!(friction["also_possible"][0], "viscoelastic_relaxation");
    let largest = friction["parameters"]["largest_force"]["value"].as_f64().unwrap();
    assert!((0.02..0.08).contains(&largest), "{largest}");
    let sum: f64 = v["posterior"].as_array().unwrap().iter().map(|c| c["probability"].as_f64().unwrap()).sum();
    assert!(sum < 1.0 + 1e-9 && sum > 0.99, "{sum}");
    // what was not seen is predicted better by a law that was learned without it
    let [before, after] = ["before", "after"].map(|k| v["fit"][k]["heldout_nrmse"].as_f64().unwrap());
    assert!(after < 0.5 * before, "{before} {after}");
    assert_eq!(v["learned"]["leads"], true);
    let law = std::fs::read_to_string(answer.join("learned/law.csv")).unwrap();
    let rows: Vec<Vec<f64>> = law.lines().skip(1).map(|l| l.split(',').map(|v| v.parse().unwrap()).collect()).collect();
    // half way in, and back: preload and rate, friction to either side
    let half = &rows[rows.len() / 2];
    let (mean, lost) = (0.5 * (half[1] + half[2]), 0.5 * (half[1] - half[2]));
    assert!((mean - 0.44).abs() < 0.03 && (0.01..0.08).contains(&lost), "{half:?}");
    let page = std::fs::read_to_string(answer.join("report.html")).unwrap();
    assert!(page.contains("the force over depth") && page.contains("law learned"));
}

#[test]
fn of_a_press_whose_law_is_learned_the_fmu_holds_the_equation_that_comes_nearest() {
    let dir = tempfile::tempdir().unwrap();
    let campaign = dir.path().join("layer");
    std::fs::create_dir(&campaign).unwrap();
    soft_layer(&campaign);
    let v = diagnosed(&campaign, &dir.path().join("answer"));
    let names: Vec<&str> = v["missing"].as_array().unwrap().iter().map(|m| m["mechanism"].as_str().unwrap()).collect();
    assert_eq!(names, ["viscoelastic_relaxation"], "{}", v["posterior"]);
    assert_eq!(v["learned"]["leads"], true);
    let [before, after] = ["before", "after"].map(|k| v["fit"][k]["heldout_nrmse"].as_f64().unwrap());
    assert!(after < 0.3 * before, "{before} {after}");
    let element = &v["element"];
    assert!(
        element["text"].as_str().unwrap().contains("HysteresisContact.fmu holds viscoelastic relaxation"),
        "{element}"
    );
    assert!(element["starts"]["relaxation_time"]["value"].as_f64().unwrap() > 0.0, "{element}");
    assert!(v["next"].to_string().contains("viscoelastic relaxation by equation"), "{}", v["next"]);
}

#[test]
fn a_force_learned_in_motion_is_in_the_fmu_which_predicts_what_the_diagnosis_does() {
    let dir = tempfile::tempdir().unwrap();
    let campaign = dir.path().join("gives_way");
    std::fs::create_dir(&campaign).unwrap();
    let mut force = LearnedForce { of: Dependence::Depth, learned: Learned { range: 4e-4, ..Learned::default() } };
    (force.learned.coefficients[2], force.learned.coefficients[5]) = (20.0, -15.0);
    let mut recipe = Recipe { samples: 350, interval: 2e-5, ..Recipe::default() };
    recipe.physics.learned_forces = LearnedForces([force, LearnedForce::default()]);
    write_campaign(&campaign, &recipe).unwrap();
    let v = diagnosed(&campaign, &dir.path().join("answer"));
    assert_eq!((&v["missing"], &v["learned"]["leads"]), (&serde_json::json!([]), &true.into()), "{}", v["posterior"]);
    let element = &v["element"];
    assert!(element["text"].as_str().unwrap().contains("holds the force that was learned"), "{element}");
    assert!(element["starts"]["learned_range"]["value"].as_f64().unwrap() > 0.0);
    assert_eq!(element["predictions_run_through_it"], true);
    assert!(element["largest_difference_over_range"].as_f64().unwrap() < 1e-4, "{element}");
    let [before, after] = ["before", "after"].map(|k| v["fit"][k]["heldout_nrmse"].as_f64().unwrap());
    assert!(after < 0.7 * before, "{before} {after}");
    let page = std::fs::read_to_string(dir.path().join("answer/gives_way/report.html")).unwrap();
    assert!(page.contains("HysteresisContact.fmu holds it."));
}
