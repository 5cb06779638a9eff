//! `touchdown fit` over every kind of campaign and every set of channels, and what it says to bad recordings.

use mechanisms::load_history::LoadHistory;
use mechanisms::physics::Physics;
use plant::chain::readings;
use plant::recipe::{write_campaign, Recipe};
use plant::simulate::{simulate, Local, Setup};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use record::Kind;
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn fit(campaign: &Path, out: &Path, method: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_touchdown"))
        .arg("fit")
        .arg(campaign)
        .arg("--out")
        .arg(out)
        .args(["--method", method])
        .output()
        .unwrap()
}

fn answer(o: &Output, out: &Path) -> Value {
    assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
    serde_json::from_str(&std::fs::read_to_string(out.join("fit.json")).unwrap()).unwrap()
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    // Box and Muller 1958
    let u: f64 = 1.0 - rng.random::<f64>();
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * rng.random::<f64>()).cos()
}

/// The value is within `share` of the truth, and within three halves of its 95 % interval (three standard errors).
fn assert_near(v: &Value, name: &str, truth: f64, share: f64) {
    let (x, ci) = (v["parameters"][name].as_f64().unwrap(), &v["ci95"][name]);
    let (low, high) = (ci[0].as_f64().unwrap(), ci[1].as_f64().unwrap());
    assert!((x / truth - 1.0).abs() < share, "{name}: {x} against {truth}");
    let (l, h) = (x - 1.5 * (x - low), x + 1.5 * (high - x));
    assert!(l < truth && truth < h, "{name}: {truth} is not near {low} to {high}");
}

fn assert_truth(v: &Value, physics: &Physics, share: [f64; 3]) {
    let l = &physics.law;
    let truth = [("k", l.elastic.stiffness), ("p", l.elastic.exponent), ("mu_d", l.hysteresis_damping.coefficient)];
    for ((name, t), s) in truth.into_iter().zip(share) {
        assert_near(v, name, t, s);
    }
}

fn setup(kind: Kind, time: Vec<f64>, order: usize) -> Setup {
    let drop = Setup::drop_test(time, 1e-4, 0.4, 1e-3);
    Setup { kind, history: LoadHistory::alike(order as f64 - 1.0), travel: 0.004, rate: 900.0, ..drop }
}

/// Writes columns with noise of the standard deviations `sd`.
fn write_csv(path: &Path, head: &str, time: &[f64], columns: &[(&[f64], f64)], rng: &mut ChaCha8Rng) {
    let mut csv = format!("{head}\n");
    for (i, t) in time.iter().enumerate() {
        csv += &format!("{t:.7e}");
        for (y, sd) in columns {
            csv += &format!(",{:.7e}", y[i] + sd * normal(rng));
        }
        csv.push('\n');
    }
    std::fs::write(path, csv).unwrap();
}

#[test]
fn a_contactor_that_bounces_gives_back_its_law() {
    let mut physics = Physics { mass: 0.5, ..Physics::default() };
    physics.law.elastic.stiffness = 2e7;
    physics.law.elastic.exponent = 1.3;
    physics.law.hysteresis_damping.coefficient = 8e6;
    let dir = tempfile::tempdir().unwrap();
    let campaign = dir.path().join("c");
    std::fs::create_dir(&campaign).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut toml = String::from(
        "format = \"recordings/1\"\n[campaign]\nname = \"made\"\nkind = \"contactor-opening\"\n[rig]\nmoving_mass = 0.5\ntravel = 0.004\nreturn_spring_rate = 900.0\n[simulation]\nterms = [\"hysteresis_damping\"]\n",
    );
    for (i, preload) in [8.0, 12.0, 12.0, 18.0].into_iter().enumerate() {
        let time: Vec<f64> = (0..2500).map(|j| 2e-5 * f64::from(j)).collect();
        let s = Setup { preload, ..setup(Kind::ContactorOpening, time.clone(), i + 1) };
        let local = Local { start: 0.0, speed: 0.0, stiffness: 0.003 * normal(&mut rng), offset: 0.0 };
        let trace = simulate(&physics, &s, &local);
        let y = readings(&physics, &trace, &time);
        assert!(y[0].iter().any(|f| *f > 50.0), "the bar strikes");
        write_csv(
            &campaign.join(format!("r{i}.csv")),
            "time [s],force [N],penetration [m]",
            &time,
            &[(&y[0], 0.5), (&y[2], 2e-6)],
            &mut rng,
        );
        toml += &format!("[[recording]]\nfile = \"r{i}.csv\"\norder = {}\nspring_preload = {preload}\n", i + 1);
    }
    std::fs::write(campaign.join("campaign.toml"), toml).unwrap();
    let out = dir.path().join("out");
    let v = answer(&fit(&campaign, &out, "lm"), &out);
    assert_truth(&v, &physics, [0.15, 0.02, 0.2]);
    assert_eq!(v["nrmse"]["r0.csv"].as_object().unwrap().len(), 2, "force and penetration, no acceleration");
}

#[test]
fn an_indentation_gives_back_its_law_by_both_methods_on_any_number_of_threads() {
    let mut physics = Physics::default();
    physics.law.elastic.stiffness = 3e6;
    physics.law.elastic.exponent = 1.6;
    physics.law.hysteresis_damping.coefficient = 6e8;
    let dir = tempfile::tempdir().unwrap();
    let campaign = dir.path().join("c");
    std::fs::create_dir(&campaign).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let mut toml = String::from(
        "format = \"recordings/1\"\n[campaign]\nname = \"made\"\nkind = \"indentation\"\n[simulation]\nterms = [\"hysteresis_damping\"]\n",
    );
    for (i, depth) in [2e-4, 2e-4, 4e-4, 6e-4].into_iter().enumerate() {
        let n = 800;
        let time: Vec<f64> = (0..n).map(|j| 2e-3 * f64::from(j)).collect();
        // down and up again from a tenth of the depth above the surface
        let w = std::f64::consts::TAU / 1.6;
        let imposed: Vec<f64> = time.iter().map(|t| depth * (0.45 - 0.55 * (w * t).cos())).collect();
        let imposed_rate = time.iter().map(|t| depth * 0.55 * w * (w * t).sin()).collect();
        let s =
            Setup { imposed: imposed.clone(), imposed_rate, depth, ..setup(Kind::Indentation, time.clone(), i + 1) };
        let trace = simulate(&physics, &s, &Local { start: 0.0, speed: 0.0, stiffness: 0.0, offset: 0.0 });
        let y = readings(&physics, &trace, &time);
        write_csv(
            &campaign.join(format!("r{i}.csv")),
            "time [s],force [N],penetration [mm]",
            &time,
            &[(&y[0], 0.02), (&imposed.iter().map(|x| 1e3 * x).collect::<Vec<_>>(), 1e-4)],
            &mut rng,
        );
        toml += &format!("[[recording]]\nfile = \"r{i}.csv\"\norder = {}\nlevel = {depth:e}\n", i + 1);
    }
    std::fs::write(campaign.join("campaign.toml"), toml).unwrap();
    for method in ["lm", "simplex"] {
        let out = dir.path().join(method);
        let v = answer(&fit(&campaign, &out, method), &out);
        assert_eq!(v["converged"], true, "{method}");
        assert_truth(&v, &physics, [0.1, 0.01, 0.1]);
    }
    // the same to the last bit on one thread and on three
    let mut texts = Vec::new();
    for threads in ["1", "3"] {
        let out = dir.path().join(threads);
        let o = Command::new(env!("CARGO_BIN_EXE_touchdown"))
            .env("RAYON_NUM_THREADS", threads)
            .arg("fit")
            .arg(&campaign)
            .arg("--out")
            .arg(&out)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&o.stdout).into_owned();
        assert_eq!(said.lines().filter(|l| l.starts_with("level ")).count(), 3, "{said}");
        texts.push(std::fs::read_to_string(out.join("fit.json")).unwrap());
    }
    assert_eq!(texts[0], texts[1]);
}

/// Keeps only the columns named.
fn keep(file: &Path, names: &[&str]) {
    let text = std::fs::read_to_string(file).unwrap();
    let head: Vec<&str> = text.lines().next().unwrap().split(',').collect();
    let at: Vec<usize> = (0..head.len()).filter(|i| names.iter().any(|n| head[*i].starts_with(n))).collect();
    let row = |l: &str| {
        let cells: Vec<&str> = l.split(',').collect();
        at.iter().map(|i| cells[*i]).collect::<Vec<_>>().join(",")
    };
    std::fs::write(file, text.lines().map(row).collect::<Vec<_>>().join("\n") + "\n").unwrap();
}

#[test]
fn one_channel_is_enough_for_a_drop_test() {
    let recipe = Recipe { seed: 7, ..Recipe::default() };
    for (channel, share) in [("force", 0.3), ("acceleration", 0.3), ("penetration", 0.6)] {
        let dir = tempfile::tempdir().unwrap();
        let (campaign, out) = (dir.path().join("c"), dir.path().join("out"));
        write_campaign(&campaign, &recipe).unwrap();
        for i in 1..=10 {
            keep(&campaign.join(format!("r{i:02}.csv")), &["time", channel]);
        }
        let v = answer(&fit(&campaign, &out, "lm"), &out);
        assert_truth(&v, &recipe.physics, [share, 0.05, share]);
        let n = v["nrmse"]["r01.csv"].as_object().unwrap();
        assert!(n.len() == 1 && n[channel].as_f64().unwrap() < 0.05, "{n:?}");
    }
}

#[test]
fn bad_recordings_are_refused_with_file_line_and_cure() {
    type Spoil = fn(&mut Vec<String>);
    let cases: [(Spoil, &[&str]); 4] = [
        (|l| l.swap(50, 51), &["r02.csv:52", "time goes back here", "sort the rows"]),
        (|l| l.truncate(4), &["r02.csv", "3 samples are too few", "at least"]),
        (|l| l[90] = l[90].replace(',', ",inf"), &["r02.csv:91", "not a finite number", "remove the rows"]),
        (
            |l| l.iter_mut().for_each(|s| *s = s.split(',').next().unwrap().into()),
            &["r02.csv:1", "no channel", "record"],
        ),
    ];
    for (spoil, says) in cases {
        let dir = tempfile::tempdir().unwrap();
        let (campaign, out) = (dir.path().join("c"), dir.path().join("out"));
        write_campaign(&campaign, &Recipe::default()).unwrap();
        let file = campaign.join("r02.csv");
        let mut lines: Vec<String> = std::fs::read_to_string(&file).unwrap().lines().map(str::to_string).collect();
        spoil(&mut lines);
        std::fs::write(&file, lines.join("\n") + "\n").unwrap();
        for method in ["lm", "simplex"] {
            let o = fit(&campaign, &out, method);
            let err = String::from_utf8_lossy(&o.stderr).into_owned();
            assert_eq!(o.status.code(), Some(2), "{err}");
            assert!(says.iter().all(|s| err.contains(s)), "{says:?} are not in {err}");
            assert!(!out.exists(), "something was written");
        }
    }
}

#[test]
fn a_pause_and_a_recording_of_nothing_are_noted_and_the_rest_is_fitted() {
    let dir = tempfile::tempdir().unwrap();
    let (campaign, out) = (dir.path().join("c"), dir.path().join("out"));
    let recipe = Recipe::default();
    write_campaign(&campaign, &recipe).unwrap();
    let edit = |file: &str, change: &dyn Fn(&mut Vec<String>)| {
        let text = std::fs::read_to_string(campaign.join(file)).unwrap();
        let mut lines: Vec<String> = text.lines().map(str::to_string).collect();
        change(&mut lines);
        std::fs::write(campaign.join(file), lines.join("\n") + "\n").unwrap();
    };
    edit("r02.csv", &|l| drop(l.drain(600..650)));
    edit("r10.csv", &|l| {
        l.iter_mut().skip(1).for_each(|s| *s = format!("{},0,0,0", s.split(',').next().unwrap()));
    });
    let o = fit(&campaign, &out, "lm");
    let err = String::from_utf8_lossy(&o.stderr).into_owned();
    assert!(err.contains("r02.csv: a pause of") && err.contains("r10.csv: no impact is to be seen in it"), "{err}");
    assert_truth(&answer(&o, &out), &recipe.physics, [0.05, 0.02, 0.1]);
}

#[test]
fn a_file_where_the_answer_should_go_is_not_replaced() {
    let dir = tempfile::tempdir().unwrap();
    let (campaign, out) = (dir.path().join("c"), dir.path().join("out"));
    write_campaign(&campaign, &Recipe::default()).unwrap();
    std::fs::write(&out, "mine").unwrap();
    let o = fit(&campaign, &out, "lm");
    assert_eq!(o.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&o.stderr).contains("a file is in the way"));
    assert_eq!(std::fs::read_to_string(&out).unwrap(), "mine");
}
