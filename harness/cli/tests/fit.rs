//! `touchdown fit` from the outside: answers on clean recordings, on measured ones, interrupted, and on bad input.

use plant::recipe::{write_campaign, Recipe};
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

fn command(campaign: &Path, out: &Path) -> Command {
    let mut c = Command::new(env!("CARGO_BIN_EXE_touchdown"));
    c.arg("fit").arg(campaign).arg("--out").arg(out);
    c
}

fn answer(out: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(out.join("fit.json")).unwrap()).unwrap()
}

fn certificate(out: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(out.join("certificate.json")).unwrap()).unwrap()
}

fn said(o: &Output) -> String {
    String::from_utf8_lossy(&o.stderr).into_owned()
}

fn assert_holds(v: &Value, name: &str, truth: f64) {
    let ci = &v["ci95"][name];
    let (low, high) = (ci[0].as_f64().unwrap(), ci[1].as_f64().unwrap());
    assert!(low < truth && truth < high, "{name}: {truth} is not in {low} to {high}");
    assert!(high - low < 0.3 * truth, "{name}: {low} to {high} says nothing");
}

#[test]
fn both_methods_return_the_truth_of_clean_recordings() {
    let dir = tempfile::tempdir().unwrap();
    let campaign = dir.path().join("c");
    let recipe = Recipe { seed: 5, ..Recipe::default() };
    write_campaign(&campaign, &recipe).unwrap();
    let mut found = Vec::new();
    for method in ["lm", "simplex"] {
        let out = dir.path().join(method);
        let o = command(&campaign, &out).args(["--method", method]).output().unwrap();
        assert!(o.status.success(), "{}", said(&o));
        let v = answer(&out);
        let mut keys: Vec<&str> = v.as_object().unwrap().keys().map(String::as_str).collect();
        keys.sort_unstable();
        assert_eq!(keys, ["ci95", "converged", "iterations", "nrmse", "objective", "parameters"]);
        assert_eq!(v["converged"], true, "{}", certificate(&out));
        let law = &recipe.physics.law;
        for (name, truth) in
            [("k", law.elastic.stiffness), ("p", law.elastic.exponent), ("mu_d", law.hysteresis_damping.coefficient)]
        {
            assert_holds(&v, name, truth);
            found.push(v["parameters"][name].as_f64().unwrap());
        }
        let objective: Vec<f64> = v["objective"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        assert_eq!(objective.len() as u64, v["iterations"].as_u64().unwrap() + 1);
        assert!(objective.windows(2).all(|w| w[1] <= w[0]) && objective[objective.len() - 1] < 0.1 * objective[0]);
        let n = v["nrmse"].as_object().unwrap();
        assert_eq!(n.len(), 10);
        for c in n.values() {
            for name in ["force", "acceleration", "penetration"] {
                assert!((1e-6..0.02).contains(&c[name].as_f64().unwrap()), "{c}");
            }
        }
        let page = std::fs::read_to_string(out.join("report.html")).unwrap();
        for s in ["Initial and final curves", "Objective by iteration", "Certificate", "Level by level", "<svg"] {
            assert!(page.contains(s), "{s}");
        }
    }
    // one objective, one minimum
    for i in 0..3 {
        assert!((found[i] / found[i + 3] - 1.0).abs() < 5e-3, "{found:?}");
    }
}

#[test]
fn terms_the_campaign_lists_are_estimated_too() {
    let mut held = 0;
    for seed in 1..=3 {
        let dir = tempfile::tempdir().unwrap();
        let campaign = dir.path().join("c");
        let mut recipe = Recipe { seed, ..Recipe::default() };
        recipe.physics.guide_friction.coulomb = 0.8;
        write_campaign(&campaign, &recipe).unwrap();
        let file = campaign.join("campaign.toml");
        let text = std::fs::read_to_string(&file).unwrap();
        let listed = text.replace("terms = [\"gravity\"", "terms = [\"guide_friction\", \"gravity\"");
        std::fs::write(&file, listed).unwrap();
        let out = dir.path().join("out");
        let o = command(&campaign, &out).output().unwrap();
        assert!(o.status.success(), "{}", said(&o));
        let v = certificate(&out);
        let (name, friction) = v["terms"].as_object().unwrap().iter().next().unwrap();
        assert!(name.starts_with("guide_friction"), "{name}");
        assert!((friction["value"].as_f64().unwrap() / 0.8 - 1.0).abs() < 0.05, "{friction}");
        let ci = &friction["ci95"];
        held += usize::from(ci[0].as_f64().unwrap() < 0.8 && 0.8 < ci[1].as_f64().unwrap());
        assert_holds(&answer(&out), "k", recipe.physics.law.elastic.stiffness);
    }
    // one in twenty may miss
    assert!(held >= 2, "{held} of 3 intervals hold the friction");
}

/// A measured campaign; None, with a word, where the recordings are not beside the project.
fn measured(name: &str) -> Option<PathBuf> {
    let dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/recordings").join(name);
    if dir.is_dir() {
        return Some(dir);
    }
    assert!(std::env::var("CI").as_deref() != Ok("true"), "{} is absent, and CI needs it", dir.display());
    eprintln!("skipped: {} is absent", dir.display());
    None
}

#[test]
fn measured_recordings_show_how_far_the_power_law_alone_is() {
    for (name, channel, levels) in [("nanoindentation-levels", "force", 5), ("caught-drops", "acceleration", 3)] {
        let Some(campaign) = measured(name) else { continue };
        let dir = tempfile::tempdir().unwrap();
        let o = command(&campaign, dir.path()).output().unwrap();
        assert!(o.status.success(), "{}", said(&o));
        let v = certificate(dir.path());
        let all = v["levels"].as_array().unwrap();
        assert_eq!(all.len(), levels);
        let mut gains = 0;
        for l in all {
            assert!(l["rms_over_noise"][channel].as_f64().unwrap() > 2.0, "{name}: no gap at {l}");
            if l["alone"]["nrmse"].as_f64().unwrap() < l["nrmse"][channel].as_f64().unwrap() {
                gains += 1;
            }
        }
        assert!(gains > levels / 2, "{name}: a level alone is fitted better than all at once");
        assert!(v["variance_widened_by"].as_f64().unwrap() > 5.0);
        let page = std::fs::read_to_string(dir.path().join("report.html")).unwrap();
        for l in all {
            assert!(page.contains(&format!("<td>{}</td>", l["level"].as_str().unwrap())), "{l}");
        }
    }
}

/// Fits a campaign by `arguments` and interrupts that so long after its first line of progress; it ends as one that was interrupted.
fn interrupted(campaign: &Path, out: &Path, arguments: &[&str], after: Duration) {
    let mut child =
        command(campaign, out).args(arguments).stderr(Stdio::piped()).stdout(Stdio::null()).spawn().unwrap();
    let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
    assert!(lines.by_ref().any(|l| l.unwrap().starts_with("fit c")));
    std::thread::sleep(after);
    let kill = Command::new("kill").arg("-INT").arg(child.id().to_string()).status().unwrap();
    assert!(kill.success());
    lines.for_each(drop);
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(out.join("fit.json").exists(), out.join("report.html").exists());
}

#[test]
fn an_interrupt_writes_the_best_so_far() {
    let dir = tempfile::tempdir().unwrap();
    let (campaign, out) = (dir.path().join("c"), dir.path().join("out"));
    write_campaign(&campaign, &Recipe::default()).unwrap();
    // before the first iteration there is no best; how soon that ends goes by the machine
    let waits = [0, 100, 300, 1000, 3000].map(Duration::from_millis);
    let writes = |after: &Duration| {
        interrupted(&campaign, &out, &["--method", "simplex"], *after);
        out.join("fit.json").exists()
    };
    assert!(waits.iter().any(writes));
    let (v, c) = (answer(&out), certificate(&out));
    assert_eq!((&v["converged"], c["stopped"].as_str()), (&Value::Bool(false), Some("interrupted")));
    assert!(v["parameters"]["k"].as_f64().unwrap() > 1e5);
}

#[test]
fn time_running_out_writes_the_best_so_far() {
    let dir = tempfile::tempdir().unwrap();
    let (campaign, out) = (dir.path().join("c"), dir.path().join("out"));
    write_campaign(&campaign, &Recipe::default()).unwrap();
    let o = command(&campaign, &out).args(["--seconds", "0.001"]).output().unwrap();
    assert!(o.status.success(), "{}", said(&o));
    let (v, c) = (answer(&out), certificate(&out));
    assert_eq!((&v["converged"], c["stopped"].as_str()), (&Value::Bool(false), Some("time is up")));
}

#[test]
fn bad_input_names_file_line_and_cure_and_leaves_nothing() {
    type Spoil = fn(&Path);
    let cases: [(Spoil, &[&str]); 3] = [
        (
            |d| {
                let f = d.join("r02.csv");
                let text = std::fs::read_to_string(&f).unwrap();
                let lines: Vec<String> = text
                    .lines()
                    .enumerate()
                    .map(|(i, l)| if i == 60 { "0.0006,NaN,0,0".into() } else { l.to_string() })
                    .collect();
                std::fs::write(f, lines.join("\n")).unwrap();
            },
            &["r02.csv:61", "remove the rows"],
        ),
        (
            |d| std::fs::remove_file(d.join("campaign.toml")).unwrap(),
            &["campaign.toml", "files of instruments", "touchdown import"],
        ),
        (
            |d| {
                for f in (1..=10).map(|i| d.join(format!("r{i:02}.csv"))) {
                    let text = std::fs::read_to_string(&f).unwrap();
                    let nothing = |l: &str| format!("{},0,0,0", l.split(',').next().unwrap());
                    let rows = text.lines().enumerate().map(|(i, l)| if i == 0 { l.into() } else { nothing(l) });
                    std::fs::write(f, rows.collect::<Vec<String>>().join("\n")).unwrap();
                }
            },
            &["r01.csv: no impact", "7 more", "check the signs"],
        ),
    ];
    for (spoil, says) in cases {
        let dir = tempfile::tempdir().unwrap();
        let (campaign, out) = (dir.path().join("c"), dir.path().join("out"));
        write_campaign(&campaign, &Recipe::default()).unwrap();
        spoil(&campaign);
        let o = command(&campaign, &out).output().unwrap();
        assert_eq!(o.status.code(), Some(2), "{}", said(&o));
        assert!(says.iter().all(|s| said(&o).contains(s)), "{}", said(&o));
        assert!(!out.exists(), "something was written");
    }
    let dir = tempfile::tempdir().unwrap();
    let o = command(dir.path(), &dir.path().join("out")).args(["--seconds", "-1"]).output().unwrap();
    assert_eq!(o.status.code(), Some(2), "{}", said(&o));
}

#[test]
fn the_papers_tables_in_the_book_are_what_the_command_prints() {
    let dir = tempfile::tempdir().unwrap();
    let o = Command::new(env!("CARGO_BIN_EXE_touchdown")).args(["paper", "--out"]).arg(dir.path()).output().unwrap();
    assert!(o.status.success(), "{}", said(&o));
    let printed = String::from_utf8_lossy(&o.stdout).into_owned();
    let page_of_book =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/src/paper.md")).unwrap();
    let tables: Vec<&str> = printed.split("\n\n").filter(|t| t.starts_with('|')).collect();
    assert_eq!(tables.len(), 2, "{printed}");
    for t in tables {
        assert!(page_of_book.contains(t.trim_end()), "the book does not hold\n{t}");
    }
    let page = std::fs::read_to_string(dir.path().join("report.html")).unwrap();
    assert!(page.contains("Paper figure 7") && page.contains("Paper figure 8") && page.contains("2270 N/mm"));
}
