//! `touchdown run`: golden impacts, sensors, interrupters, contactors, and bad scenarios.

use host::{Direct, Element};
use scenario::{simulate, Case, Outcome, Scenario};
use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

fn command(dir: &Path, text: &str, more: &[&str]) -> Command {
    let file = dir.join("s.toml");
    std::fs::write(&file, text).unwrap();
    let mut c = Command::new(env!("CARGO_BIN_EXE_touchdown"));
    c.arg("run").arg(&file).arg("--out").arg(dir.join("out")).args(more);
    c
}

fn run(dir: &Path, text: &str, more: &[&str]) -> Output {
    command(dir, text, more).output().unwrap()
}

/// The summary of a run that has to succeed.
fn summary(text: &str, more: &[&str]) -> Value {
    let dir = tempfile::tempdir().unwrap();
    let o = run(dir.path(), text, more);
    assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
    serde_json::from_str(&std::fs::read_to_string(dir.path().join("out/summary.json")).unwrap()).unwrap()
}

fn example(name: &str) -> String {
    std::fs::read_to_string(format!("{}/../examples/{name}.toml", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

fn simulated(text: &str) -> Vec<(Case, Outcome)> {
    let s: Scenario = text.parse().unwrap();
    s.cases()
        .into_iter()
        .map(|c| {
            let o = simulate(&c, &mut Direct::new(c.law), &mut |_| true).unwrap();
            (c, o)
        })
        .collect()
}

fn number(v: &Value) -> f64 {
    v.as_f64().unwrap_or(f64::NAN)
}

fn close(got: f64, wanted: f64, tolerance: f64) {
    assert!((got / wanted - 1.0).abs() < tolerance, "{got} for {wanted}: {:.1e}", got / wanted - 1.0);
}

/// Golden impacts of the law F = k x^p + mu_d x^p v at 1 kg and 1 m/s: k, p, mu_d; deepest, e, duration, peak.
const GOLDEN: [[f64; 7]; 2] = [
    [3.51e10, 2.79, 2.70e10, 1.7588165601242512e-3, 0.65712174496578164, 5.8181339632048352e-3, 813.04615987599714],
    [1.85e8, 1.96, 8.77e7, 1.6803097731131710e-3, 0.75847045292087518, 5.4497898388347824e-3, 716.04884002798315],
];

fn golden(through: &[&str]) {
    for g in GOLDEN {
        let text = format!(
            "kind = \"drop_test\"\nmass = 1.0\nimpact_speed = 1.0\n[contact]\nstiffness = {:?}\nexponent = {:?}\nhysteresis_damping = {:?}\n",
            g[0], g[1], g[2]
        );
        let v = summary(&text, through);
        let b = &v["runs"][0]["impacts"][0];
        for (name, wanted) in [("deepest", g[3]), ("restitution", g[4]), ("duration", g[5]), ("peak_force", g[6])] {
            close(number(&b[name]), wanted, 1e-6);
            close(number(&b["exact"][name]), wanted, 1e-12);
        }
        for d in b["exact"]["differences"].as_array().unwrap() {
            assert!(number(d).abs() < 1e-6, "{b}");
        }
        let e = &v["runs"][0]["energy"];
        assert!(number(&e["residual_of_motion"]) < 1e-8 && number(&e["residual"]) < 5e-6, "{e}");
    }
}

#[test]
fn golden_impacts_hold_to_a_millionth_on_the_law() {
    golden(&["--direct"]);
}

#[test]
fn golden_impacts_hold_to_a_millionth_through_the_fmu() {
    golden(&[]);
}

const THREE: &str = "kind = \"drop_test\"\nmodel = \"three_mass\"\nimpact_speed = 1.0\n\
    [masses]\naccelerometer = 0.05\nbody = 0.85\ntip = 0.1\n\
    [contact]\nstiffness = 3.51e10\nexponent = 2.79\nhysteresis_damping = 2.70e10\n";

fn three(k: f64) -> (Case, Outcome) {
    let text = format!("{THREE}[sensors]\naccelerometer_stiffness = {k:?}\ntransducer_stiffness = {:?}\n", 10.0 * k);
    simulated(&text).remove(0)
}

#[test]
fn three_masses_tend_to_one_as_the_sensors_stiffen() {
    let g = GOLDEN[0];
    let off: Vec<f64> = [1e8, 1e9, 1e10]
        .iter()
        .map(|k| {
            let (_, o) = three(*k);
            let b = &o.bounces[0];
            assert_eq!(o.bounces.len(), 1);
            (b.peak_force / g[6] - 1.0).abs().max((b.duration / g[5] - 1.0).abs()).max((b.deepest / g[3] - 1.0).abs())
        })
        .collect();
    // what the springs take goes with the root of their compliance at worst
    assert!(off[0] < 0.03 && off[1] < 0.4 * off[0] && off[2] < 0.4 * off[1], "{off:?}");
}

#[test]
fn sensors_read_what_stands_above_them_and_ring_by_their_stiffness() {
    let (c, o) = three(1e10);
    let (force, push) = o.sensors(&c, &o.bounces[0]).unwrap();
    // the transducer misses what stops the tip: 0.9 of 1 kg stand above it
    assert!((force.over_contact_if_rigid - 0.9).abs() < 1e-12);
    assert!((force.over_contact - 0.9).abs() < 2e-3 && (push.over_contact - 1.0).abs() < 5e-3, "{force:?} {push:?}");
    // softer springs ring more: the error of both readings grows, and none of it is in the contact alone
    let error = |k: f64| {
        let (c, o) = three(k);
        let (f, a) = o.sensors(&c, &o.bounces[0]).unwrap();
        ((f.over_contact - 0.9).abs(), (a.over_contact - 1.0).abs(), a.delay)
    };
    let (soft, stiff) = (error(1e6), error(1e8));
    assert!(soft.1 > 5.0 * stiff.1 && soft.0 > stiff.0, "{soft:?} {stiff:?}");
    assert!(soft.2.abs() > 10.0 * stiff.2.abs(), "{soft:?} {stiff:?}");
}

#[test]
fn an_accelerometer_answers_as_an_oscillator_on_its_base_does() {
    // far lighter than the body, it feels the body's acceleration through its own spring alone: against the closed
    // answer of an undamped oscillator to a half sine, p = 1
    let (m, k, v): (f64, f64, f64) = (1.0, 1e6, 1.0);
    let (ma, ka): (f64, f64) = (1e-6, 25.0);
    let text = format!(
        "kind = \"drop_test\"\nmodel = \"three_mass\"\nimpact_speed = {v:?}\n[masses]\naccelerometer = {ma:?}\n\
         body = 0.999998\ntip = 1e-6\n[sensors]\naccelerometer_stiffness = {ka:?}\ntransducer_stiffness = 1e10\n\
         transducer_damping_ratio = 0.9\n[contact]\nstiffness = {k:?}\nexponent = 1.0\n"
    );
    let (c, o) = simulated(&text).remove(0);
    let (w, p): (f64, f64) = ((k / m).sqrt(), (ka / ma).sqrt());
    let mut worst: f64 = 0.0;
    let top = w * v;
    for r in o.rows.iter().filter(|r| r.force > 0.0) {
        let t = r.time;
        let wanted = -top / (1.0 - (w / p).powi(2)) * ((w * t).sin() - w / p * (p * t).sin());
        worst = worst.max((c.rig.sensors(&r.state).unwrap().1 - wanted).abs() / top);
    }
    assert!(worst < 2e-3, "{worst}");
}

#[test]
fn events_are_told_for_every_mass() {
    let (_, o) = three(1e8);
    for mass in ["tip", "body", "accelerometer"] {
        for what in ["deepest", "separation"] {
            assert!(o.events.iter().any(|e| e.mass == mass && e.what == what), "{mass} {what}");
        }
    }
    assert!(o.events.windows(2).all(|e| e[0].time <= e[1].time));
}

#[test]
fn interrupters_recover_the_speed() {
    let v = summary(&example("drop_test"), &["--direct"]);
    let p = &v["runs"][0]["photo_interrupters"];
    assert_eq!(p["times"].as_array().unwrap().len(), 3);
    assert!(number(&p["difference"]).abs() < 1e-9, "{p}");
    close(number(&p["impact_speed"]), (2.0f64 * 9.81 * 0.05).sqrt(), 1e-9);
    // drag of the guide is seen as less acceleration, and the speed still comes out
    let text = example("drop_test").replace("gravity = true", "gravity = true\nguide_friction = 2.0");
    let p = summary(&text, &["--direct"])["runs"][0]["photo_interrupters"].clone();
    close(number(&p["recovered"]["acceleration"]), 9.81 - 2.0, 1e-6);
    assert!(number(&p["difference"]).abs() < 1e-9, "{p}");
    // a coarse clock errs, by no more than a tick at 6 mm can do
    let text = example("drop_test").replace("last_to_touch", "clock = 1e-5\nlast_to_touch");
    let p = summary(&text, &["--direct"])["runs"][0]["photo_interrupters"].clone();
    let off = number(&p["difference"]).abs();
    assert!(off > 1e-7 && off < 1e-2, "{p}");
}

#[test]
fn the_papers_contactor_comes_out_and_the_printed_unit_does_not() {
    let v = summary(&example("contactor_paper"), &["--direct"]);
    let b = |i: usize, name: &str| number(&v["runs"][i]["impacts"][0][name]);
    assert!((b(0, "deepest") * 1e3 - 0.150).abs() < 0.001, "{}", b(0, "deepest"));
    assert!((b(0, "peak_force") - 342.0).abs() < 0.5 && (b(1, "peak_force") - 987.0).abs() < 0.5);
    assert!((b(1, "deepest") * 1e3 - 0.051).abs() < 0.0005);
    assert!((number(&v["comparison"][1]["free_ratio"]) - 2.92).abs() < 0.005);
    close(number(&v["comparison"][1]["peak_ratio"]), b(1, "peak_force") / b(0, "peak_force"), 1e-12);
    // 7.4 mm of a 5 mm drop under 17 N
    assert!((b(2, "deepest") * 1e3 - 7.4).abs() < 0.05 && (b(2, "peak_force") - 17.0).abs() < 0.5);
    let remarks = v["remarks"].as_array().unwrap();
    assert!(remarks.len() == 1 && remarks[0].as_str().unwrap().contains("7.4 mm"), "{remarks:?}");
    // undamped with weight: harmonic about the static depth
    let (m, k, g, h): (f64, f64, f64, f64) = (0.509, 2.27e6, 9.81, 0.005);
    let s = m * g / k;
    close(b(0, "deepest"), s + (s * s + 2.0 * h * s).sqrt(), 1e-9);
    let w = (k / m).sqrt();
    close(b(0, "duration"), 2.0 / w * (std::f64::consts::PI - ((2.0 * g * h).sqrt() / (w * s)).atan()), 1e-9);
    // the 1.49 ms are half a period, without the weight
    let free = summary(&example("contactor_paper").replace("gravity = true", "gravity = false"), &["--direct"]);
    let b = &free["runs"][0]["impacts"][0];
    assert!((number(&b["duration"]) * 1e3 - 1.49).abs() < 0.005 && number(&b["exact"]["differences"][3]).abs() < 1e-8);
    let ratio = number(&free["comparison"][1]["peak_ratio"]);
    assert!((ratio - 2.92).abs() < 0.005, "{ratio}");
}

#[test]
fn the_book_shows_the_table_the_command_prints() {
    let dir = tempfile::tempdir().unwrap();
    let o = run(dir.path(), &example("contactor_paper"), &[]);
    let printed = String::from_utf8_lossy(&o.stdout).into_owned();
    let table: Vec<&str> = printed.lines().filter(|l| l.starts_with('|')).collect();
    assert_eq!(table.len(), 5, "{printed}");
    let book = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/src/paper.md")).unwrap();
    assert!(book.contains(&table.join("\n")), "{printed}");
}

#[test]
fn a_contactor_bounces_until_it_rests() {
    let (_, o) = simulated(&example("contactor_opening")).remove(0);
    assert!(o.at_rest && o.bounces.len() > 5, "{}", o.bounces.len());
    let up: Vec<f64> = o.bounces.iter().filter_map(|b| b.rebound_height).collect();
    assert!(up.windows(2).all(|w| w[1] < w[0]) && up[0] > 1e-4, "{up:?}");
    assert!(up.iter().rev().skip(1).all(|h| *h >= 2e-5));
    let b = o.balance.relative();
    assert!(b.residual.unwrap() < 5e-6 && b.residual_of_motion < 1e-8, "{b:?}");
    assert!(b.work_against_holding != 0.0);
    // the first speed, from energy: spring's work less the holding force's
    let v0 = o.bounces[0].impact_speed;
    let spring = 12.3 * 0.004 - 0.5 * 900.0 * 0.004 * 0.004;
    let touch = o.rows.iter().find(|r| r.time == o.bounces[0].touch).unwrap();
    close(0.5 * 0.509 * v0 * v0, spring - touch.state[4], 1e-9);
}

#[test]
fn a_damped_bar_sinks_to_where_spring_and_stop_agree() {
    let text = "kind = \"contactor_opening\"\nmass = 0.5\ntravel = 0.004\nspring_preload = 12.0\nrest_height = 1e-9\n\
                [contact]\nstiffness = 1e5\nexponent = 1.0\nviscous_damping = 150.0\n";
    let (_, o) = simulated(text).remove(0);
    assert!(o.at_rest);
    let r = o.rows.last().unwrap();
    assert!((r.state[0] - 12.0 / 1e5).abs() < 1e-8, "{}", r.state[0]);
}

#[test]
fn every_height_and_tip_is_a_run_and_faster_is_harder() {
    let v = summary(&example("drop_test_sensors"), &["--direct"]);
    assert_eq!(v["runs"].as_array().unwrap().len(), 6);
    let rows = v["by_height"].as_array().unwrap();
    for tip in ["rubber", "steel"] {
        let own: Vec<&Value> = rows.iter().filter(|r| r["tip"] == tip).collect();
        assert_eq!(own.len(), 3);
        for w in own.windows(2) {
            assert!(number(&w[1]["peak_force"]) > number(&w[0]["peak_force"]));
            assert!(number(&w[1]["restitution"]) < number(&w[0]["restitution"]));
        }
    }
    assert!(v["runs"].as_array().unwrap().iter().all(|r| number(&r["energy"]["residual"]) < 1e-5), "energy");
}

#[test]
fn gravity_off_means_off_from_touch_on() {
    let text = example("drop_test").replace("gravity = true ", "gravity = false ");
    let (_, o) = simulated(&text).remove(0);
    let e = o.bounces[0].exact.unwrap();
    assert!(e.worst() < 1e-6, "{e:?}");
    assert!(o.balance.relative().residual.unwrap() < 5e-6);
}

#[test]
fn relaxation_converges_to_the_motion_that_carries_it_as_a_state() {
    // a Maxwell branch alone beside a spring, p = q = 1: linear, so a fine classical integration of the three
    // equations x' = v, m v' = -k x - f, f' = kr v - f/tau is exact enough
    let (m, k, kr, tau, v0): (f64, f64, f64, f64, f64) = (1.0, 1e6, 5e5, 1e-3, 1.0);
    let text = format!(
        "kind = \"drop_test\"\nmass = {m:?}\nimpact_speed = {v0:?}\n[contact]\nstiffness = {k:?}\nexponent = 1.0\n\
         relaxation_stiffness = {kr:?}\nrelaxation_time = {tau:?}\n"
    );
    let (_, o) = simulated(&text).remove(0);
    let rate = |y: [f64; 3]| [y[1], -(k * y[0] + y[2]).max(0.0) / m, kr * y[1] - y[2] / tau];
    let (mut y, h, mut deepest) = ([0.0, v0, 0.0], 1e-8, 0.0f64);
    while y[0] >= 0.0 && k * y[0] + y[2] >= 0.0 {
        let add = |a: [f64; 3], b: [f64; 3], s: f64| [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
        let a = rate(y);
        let b = rate(add(y, a, 0.5 * h));
        let c = rate(add(y, b, 0.5 * h));
        let d = rate(add(y, c, h));
        for i in 0..3 {
            y[i] += h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]);
        }
        deepest = deepest.max(y[0]);
    }
    let b = &o.bounces[0];
    close(b.deepest, deepest, 1e-6);
    close(b.restitution, -y[1] / v0, 1e-5);
    assert!(b.force_ends.is_some(), "it lets go before it leaves the surface");
}

/// An element that reports no energies and has a law of its own.
struct Foreign;

impl Element for Foreign {
    fn force(&mut self, x: f64, _: f64) -> anyhow::Result<f64> {
        Ok(if x > 0.0 { 1e6 * x } else { 0.0 })
    }
    fn derivatives(&mut self, x: f64, _: f64) -> anyhow::Result<(f64, f64)> {
        Ok((if x > 0.0 { 1e6 } else { 0.0 }, 0.0))
    }
    fn advance(&mut self, _: (f64, f64), _: (f64, f64), _: f64) -> anyhow::Result<()> {
        Ok(())
    }
    fn energies(&mut self) -> anyhow::Result<Option<(f64, f64)>> {
        Ok(None)
    }
}

#[test]
fn any_element_will_do() {
    let text = "kind = \"drop_test\"\nmass = 1.0\nimpact_speed = 1.0\n[contact]\nstiffness = 7e6\nexponent = 1.0\n";
    let c = text.parse::<Scenario>().unwrap().cases().remove(0);
    let o = simulate(&c, &mut Foreign, &mut |_| true).unwrap();
    close(o.bounces[0].duration, std::f64::consts::PI * 1e-3, 1e-8);
    assert!(o.balance.residual.is_none() && o.balance.relative().residual_of_motion < 1e-8);
    let t = scenario::table(&[(&c, &o)]);
    assert!(!t.head.iter().any(|h| h.starts_with("stored")), "{:?}", t.head);
}

#[test]
fn parquet_holds_the_numbers_of_the_csv() {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    let dir = tempfile::tempdir().unwrap();
    let o = run(dir.path(), &example("drop_test"), &["--direct", "--parquet"]);
    assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
    let mut csv = csv::Reader::from_path(dir.path().join("out/results.csv")).unwrap();
    let head: Vec<String> = csv.headers().unwrap().iter().map(String::from).collect();
    assert!(head.iter().all(|h| h.contains(" [") && h.ends_with(']')), "{head:?}");
    let file = std::fs::File::open(dir.path().join("out/results.parquet")).unwrap();
    let reader = SerializedFileReader::new(file).unwrap();
    let mut rows = 0;
    for (a, b) in csv.records().zip(reader.get_row_iter(None).unwrap()) {
        let (a, b) = (a.unwrap(), b.unwrap());
        for ((name, field), (i, text)) in b.get_column_iter().zip(a.iter().enumerate()) {
            assert_eq!(name, &head[i]);
            let parquet::record::Field::Double(v) = field else { panic!("{field:?}") };
            assert_eq!(v.to_bits(), text.parse::<f64>().unwrap().to_bits());
        }
        rows += 1;
    }
    assert!(rows > 100 && reader.metadata().file_metadata().num_rows() == rows, "{rows}");
}

#[test]
#[cfg(unix)]
fn an_interrupted_run_keeps_its_rows() {
    use std::io::{BufRead, BufReader};
    // a stiff sensor makes many steps of it
    let text = THREE
        .replace("impact_speed = 1.0", "drop_height = 0.5\ngravity = true\nimpacts = 1000\nrest_height = 0.0")
        + "[sensors]\naccelerometer_stiffness = 1e13\ntransducer_stiffness = 1e13\n";
    let dir = tempfile::tempdir().unwrap();
    let (piped, null) = (std::process::Stdio::piped(), std::process::Stdio::null());
    let mut child = command(dir.path(), &text, &["--direct"]).stderr(piped).stdout(null).spawn().unwrap();
    // the first line of progress says that it has begun and will last
    let mut printed = BufReader::new(child.stderr.take().unwrap());
    let mut line = String::new();
    printed.read_line(&mut line).unwrap();
    assert!(line.contains("0 of 1"), "{line}");
    Command::new("kill").arg("-INT").arg(child.id().to_string()).status().unwrap();
    std::io::copy(&mut printed, &mut std::io::sink()).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let json = std::fs::read_to_string(dir.path().join("out/summary.json")).unwrap();
    let v: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(v["interrupted"], true);
    assert_eq!(v["runs"][0]["interrupted"], true);
    let csv = std::fs::read_to_string(dir.path().join("out/results.csv")).unwrap();
    assert!(csv.lines().count() > 100 && csv.lines().count() as u64 == v["runs"][0]["steps"].as_u64().unwrap() + 1);
    assert!(std::fs::read_to_string(dir.path().join("out/report.html")).unwrap().contains("Interrupted"));
}

#[test]
fn bad_scenarios_name_file_line_and_cure() {
    let drop = "kind = \"drop_test\"\nmass = 1.0\nimpact_speed = 1.0\n";
    let law = "[contact]\nstiffness = 1e8\nexponent = 1.5\n";
    for (text, wanted) in [
        (drop.replace("mass = 1.0", "mass = -1.0") + law, vec!["s.toml:2: mass", "above 0"]),
        (drop.replace("impact_speed", "speed"), vec!["s.toml:3:", "unknown field `speed`", "impact_speed"]),
        (format!("{drop}[contact]\nstiffness = 1e8\nexponent = 9.0\n"), vec!["s.toml:6: [contact] exponent", "0.5 to 5"]),
        (format!("{drop}{law}stifness = 1\n"), vec!["s.toml:7:", "unknown field `stifness`", "`stiffness`"]),
        (format!("{drop}{law}plastic_ratio = 1.5\n"), vec!["s.toml:7: [contact] plastic_ratio", "below 1"]),
        (format!("{drop}{law}[photo_interrupters]\nlast_to_touch = 0.0\n"), vec!["s.toml:3: impact_speed", "drop height"]),
        (
            "kind = \"drop_test\"\nmass = 1.0\ndrop_height = 0.01\n".to_string()
                + law
                + "[photo_interrupters]\nspacing = 0.006\nlast_to_touch = 0.0\n",
            vec!["s.toml:8: [photo_interrupters] spacing", "drop height"],
        ),
        (format!("impacts = 3\n{drop}{law}"), vec!["s.toml: gravity", "true"]),
        (format!("model = \"three_mass\"\n{drop}{law}"), vec!["s.toml:1: model", "[masses]"]),
        (format!("{drop}{law}[[compare]]\nname = \"a\"\nstiffness = 1.0\n[[compare]]\nname = \"b\"\nstiffness = -1.0\n"), vec![
            "s.toml:12: [compare] stiffness",
            "above 0",
        ]),
        (format!("{drop}{law}[[tip]]\nname = \"a\"\ncontact = {{ stiffness = 1.0, exponent = 1.0 }}\n"), vec![
            "s.toml:4:",
            "not both",
        ]),
        (
            format!("{drop}[[tip]]\nname = \"a\"\n[tip.contact]\nstiffness = 1.0\nexponent = 0.1\n"),
            vec!["s.toml:8: [tip.contact] exponent"],
        ),
        (drop.to_string(), vec!["s.toml: contact", "stiffness"]),
        ("kind = \"drop_test\"\nmass = 1.0\n= 3\n".to_string(), vec!["s.toml:3:"]),
        (
            format!("{drop}[contact]\nfaces = {{ a = 1e-3, b = 1e-3, youngs_modulus = [0.0, 1e9], poisson_ratio = [0.3, 0.3] }}\n"),
            vec!["s.toml:5: [contact] youngs_modulus"],
        ),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let o = run(dir.path(), &text, &["--direct"]);
        let e = String::from_utf8_lossy(&o.stderr).into_owned();
        assert_eq!(o.status.code(), Some(2), "{text}\n{e}");
        assert!(wanted.iter().all(|w| e.contains(w)), "{wanted:?} in {e}");
        assert!(!dir.path().join("out").exists());
    }
}

#[test]
fn a_folder_that_cannot_be_written_is_told_before_anything_runs() {
    let dir = tempfile::tempdir().unwrap();
    let taken = dir.path().join("out");
    std::fs::write(&taken, "mine").unwrap();
    let o = run(dir.path(), &example("drop_test"), &["--direct"]);
    let e = String::from_utf8_lossy(&o.stderr).into_owned();
    assert_eq!(o.status.code(), Some(2));
    assert!(e.contains("out: a file is in the way; give another --out") && o.stdout.is_empty(), "{e}");
    assert_eq!(std::fs::read_to_string(taken).unwrap(), "mine");
}

#[test]
fn every_example_runs() {
    let dir = format!("{}/../examples", env!("CARGO_MANIFEST_DIR"));
    let mut seen = 0;
    for f in std::fs::read_dir(dir).unwrap().flatten() {
        let name = f.path().file_stem().unwrap().to_string_lossy().into_owned();
        // a system of FMUs has no kind
        let scenario = |text: &str| text.lines().any(|l| l.starts_with("kind = "));
        if f.path().extension().is_some_and(|e| e == "toml") && scenario(&example(&name)) {
            let v = summary(&example(&name), &["--direct"]);
            assert!(v["runs"].as_array().unwrap().iter().all(|r| !r["impacts"].as_array().unwrap().is_empty()));
            seen += 1;
        }
    }
    assert!(seen >= 4);
}
