//! `touchdown import`: campaigns written as instruments write them come back as they were.

use plant::recipe::{write_campaign, Recipe};
use record::{Campaign, Channel};
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Exit code, what was printed, and what was said of errors.
fn touchdown(arguments: &[&str]) -> (Option<i32>, String, String) {
    let run = Command::new(env!("CARGO_BIN_EXE_touchdown")).args(arguments).output().unwrap();
    let text = |b: &[u8]| String::from_utf8_lossy(b).into_owned();
    (run.status.code(), text(&run.stdout), text(&run.stderr))
}

fn load(dir: &Path) -> Campaign {
    record::load(dir, &mechanisms::terms()).unwrap()
}

fn bench_drop() -> Campaign {
    load(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/bench_drop"))
}

/// The campaign of the recipe with one sample in 20 us.
fn made(dir: &Path) -> Campaign {
    let recipe = Recipe { samples: 400, interval: 2e-5, seed: 5, ..Recipe::default() };
    write_campaign(&dir.join("made"), &recipe).unwrap();
    load(&dir.join("made"))
}

/// A number as a German instrument writes it.
fn comma(v: f64) -> String {
    format!("{v:.9}").replace('.', ",")
}

/// A channel with silence around it: what it reads at its ends, over and over, `quiet` samples on either side.
fn in_silence(y: &[f64], quiet: usize) -> Vec<f64> {
    let few = 40;
    let before = (0..quiet).map(|i| y[i % few]);
    let after = (0..quiet).map(|i| y[y.len() - few + i % few]);
    before.chain(y.iter().copied()).chain(after).collect()
}

/// Channels of a recording with silence around, penetration held where it stands.
fn silent(c: &Campaign, i: usize, quiet: usize) -> [Vec<f64>; 3] {
    let of = |k: Channel| c.recordings[i].channels[k.index()].as_ref().unwrap();
    let x = of(Channel::Penetration);
    let held = |v: f64| std::iter::repeat_n(v, quiet);
    let way = held(x[0]).chain(x.iter().copied()).chain(held(x[x.len() - 1])).collect();
    [in_silence(of(Channel::Force), quiet), in_silence(of(Channel::Acceleration), quiet), way]
}

fn step(c: &Campaign, i: usize) -> f64 {
    let t = &c.recordings[i].time;
    (t[t.len() - 1] - t[0]) / (t.len() - 1) as f64
}

/// Levels and speeds as a table for `--table`; `file` names the file of each recording.
fn table(c: &Campaign, file: impl Fn(usize) -> String) -> String {
    let mut text = String::from("file,order,drop height [mm],impact_speed [m/s],impact_speed_std [m/s]\n");
    for (i, r) in c.recordings.iter().enumerate() {
        let (v, std) = r.impact_speed.unwrap();
        writeln!(text, "{},{},{},{v},{std}", file(i), r.order, 1e3 * r.drop_height.unwrap()).unwrap();
    }
    text
}

/// Whether every sample of `b` is one of `a`'s, or lies in the silence around them; `quiet` samples of it come before.
fn assert_same(a: &Campaign, b: &Campaign, quiet: impl Fn(usize) -> usize) {
    assert_eq!((a.kind, a.moving_mass, a.recordings.len()), (b.kind, b.moving_mass, b.recordings.len()));
    assert_eq!(a.simulation.terms, b.simulation.terms);
    for (i, (r, s)) in a.recordings.iter().zip(&b.recordings).enumerate() {
        assert_eq!(r.order, s.order, "{}", s.file);
        assert!((r.drop_height.unwrap() - s.drop_height.unwrap()).abs() < 1e-12);
        assert_eq!(r.impact_speed, s.impact_speed);
        let h = step(a, i);
        assert!((step(b, i) / h - 1.0).abs() < 1e-6);
        // where in the file the window begins
        let begins = (s.time[0] / h).round() as usize;
        let mut compared = 0;
        for k in Channel::ALL {
            let (y, z) = (r.channels[k.index()].as_ref().unwrap(), s.channels[k.index()].as_ref().unwrap());
            let scale = y.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            for (j, z) in z.iter().enumerate() {
                let Some(y) = (begins + j).checked_sub(quiet(i)).and_then(|n| y.get(n)) else { continue };
                assert!((y - z).abs() < 2e-7 * scale + 2e-9, "{} {} {j}: {y} {z}", s.file, k.name());
                compared += 1;
            }
            // the peak is among them
            let top = |y: &[f64]| y.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            assert!((top(y) - top(z)).abs() < 1e-6 * scale || k == Channel::Penetration, "{} {}", s.file, k.name());
        }
        assert!(compared > 3 * 200, "{compared} samples of {} are compared", s.file);
    }
}

#[test]
fn recordings_rewritten_as_an_instrument_writes_them_import_to_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let c = bench_drop();
    let quiet = 50_000;
    let mut files: Vec<PathBuf> = Vec::new();
    for i in 0..c.recordings.len() {
        let [f, a, x] = silent(&c, i, quiet);
        let mut text = String::from("Fallversuch;;;;\nZeit;Prüfkraft;Beschleunigung;Weg;Temperatur\nms;kN;g;mm;°C\n");
        for (j, f) in f.iter().enumerate() {
            // force pulls and the body is pushed on in this instrument's eyes, and the way shrinks
            let (t, f, a, x) = (1e3 * step(&c, i) * j as f64, -1e-3 * f, -a[j] / 9.80665, -1e3 * x[j]);
            writeln!(text, "{};{};{};{};21,5", comma(t), comma(f), comma(a), comma(x)).unwrap();
        }
        let r = &c.recordings[i];
        let path = dir.path().join(format!("drop_{}mm_{}.txt", 1e3 * r.drop_height.unwrap(), r.order));
        std::fs::write(&path, text).unwrap();
        files.push(path);
    }
    let name = |i: usize| files[i].file_name().unwrap().to_string_lossy().into_owned();
    let levels = dir.path().join("levels.csv");
    std::fs::write(&levels, table(&c, name)).unwrap();
    let out = dir.path().join("out");
    let mut arguments = vec!["import"];
    arguments.extend(files.iter().map(|f| f.to_str().unwrap()));
    arguments.extend([
        "--table",
        levels.to_str().unwrap(),
        "--mass",
        "326.22g",
        "--terms",
        "gravity,hysteresis_damping",
    ]);
    arguments.extend(["--out", out.to_str().unwrap()]);
    let (code, said, err) = touchdown(&arguments);
    assert_eq!(code, Some(0), "{err}");
    for s in ["force: \"Prüfkraft\", by its unit kN", "left out: \"Temperatur\"", "the sign of penetration was turned"]
    {
        assert!(said.contains(s), "{s:?} is not in {said}");
    }
    // names sort as people count, which is the order of the campaign
    assert_same(&c, &load(&out), |_| quiet);
    let (code, said, err) = touchdown(&["check", out.to_str().unwrap()]);
    assert!(code == Some(0) && said.contains("nothing contradicts"), "{said}{err}");
    let page = std::fs::read_to_string(out.join("import.html")).unwrap();
    assert!(page.matches("<figure>").count() == 60 && page.contains("Temperatur"));
    // and where it comes from
    let foot = page.split("<footer class=\"trace\"").nth(1).unwrap();
    let hash = output::Entry::of(&files[0], "").unwrap().sha256;
    assert!(foot.contains("import ") && foot.contains(&hash) && foot.contains(&name(0)), "{foot}");
}

/// `touchdown fit` of a campaign: k and p, each with its interval.
fn fitted(campaign: &Path) -> [[f64; 3]; 2] {
    let out = campaign.with_extension("fit");
    let (code, _, err) = touchdown(&["fit", campaign.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    assert_eq!(code, Some(0), "{err}");
    let v: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(out.join("fit.json")).unwrap()).unwrap();
    ["k", "p"].map(|n| [&v["parameters"][n], &v["ci95"][n][0], &v["ci95"][n][1]].map(|x| x.as_f64().unwrap()))
}

#[test]
fn drops_one_after_another_and_side_by_side_are_parted_and_fit_the_same() {
    let dir = tempfile::tempdir().unwrap();
    let c = made(dir.path());
    let (quiet, h) = (30_000, step(&c, 0));
    let all: Vec<[Vec<f64>; 3]> = (0..c.recordings.len()).map(|i| silent(&c, i, quiet)).collect();
    let length = all[0][0].len();
    let mut one_after_another = String::from("time [s]\tload [N]\taccel [m/s²]\tstroke [µm]\n");
    let mut row = 0;
    for [f, a, x] in &all {
        for j in 0..f.len() {
            writeln!(one_after_another, "{:.5}\t{:.6}\t{:.6}\t{:.6}", h * row as f64, f[j], a[j], 1e6 * x[j]).unwrap();
            row += 1;
        }
    }
    let mut side_by_side = String::from("t (s)");
    (1..=all.len()).for_each(|i| write!(side_by_side, ",F{i} (N),a{i} (g),x{i} (mm)").unwrap());
    side_by_side.push('\n');
    for j in 0..length {
        write!(side_by_side, "{:.5}", h * j as f64).unwrap();
        for [f, a, x] in &all {
            write!(side_by_side, ",{:.6},{:.8},{:.9}", f[j], a[j] / 9.80665, 1e3 * x[j]).unwrap();
        }
        side_by_side.push('\n');
    }
    let before = |i: usize| i * length + quiet;
    for (name, text, quiet) in
        [("tape.txt", one_after_another, &before as &dyn Fn(usize) -> usize), ("columns.csv", side_by_side, &|_| quiet)]
    {
        let (file, levels, out) =
            (dir.path().join(name), dir.path().join("levels.csv"), dir.path().join(name).with_extension("out"));
        std::fs::write(&file, text).unwrap();
        std::fs::write(&levels, table(&c, |_| name.into())).unwrap();
        let (code, said, err) = touchdown(&[
            "import",
            file.to_str().unwrap(),
            "--table",
            levels.to_str().unwrap(),
            "--mass",
            "0.5",
            "--terms",
            "gravity,hysteresis_damping",
            "--out",
            out.to_str().unwrap(),
        ]);
        assert_eq!(code, Some(0), "{err}");
        assert!(said.contains("10 recordings"), "{said}");
        assert_same(&c, &load(&out), quiet);
    }
    let (truth, imported) = (fitted(&dir.path().join("made")), fitted(&dir.path().join("tape.out")));
    for (a, b) in truth.iter().zip(&imported) {
        assert!(b[1] < a[0] && a[0] < b[2], "{a:?} {b:?}");
    }
}

/// A file of a pulse in force without units or names that say anything.
fn voltages(dir: &Path, name: &str, peak: f64) -> PathBuf {
    let mut text = String::from("ai0,ai1\n");
    for i in 0..6000 {
        let pulse =
            if (3000..3060).contains(&i) { (std::f64::consts::PI * f64::from(i - 3000) / 60.0).sin() } else { 0.0 };
        writeln!(text, "{:.6},{:.6}", peak * pulse + 1e-4 * f64::from((i * 7919) % 13 - 6), 0.1).unwrap();
    }
    let path = dir.join(name);
    std::fs::write(&path, text).unwrap();
    path
}

#[test]
fn all_that_is_missing_is_told_at_once_and_nothing_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let (a, b, bad) =
        (voltages(dir.path(), "a.csv", 1.0), voltages(dir.path(), "b.csv", 2.0), voltages(dir.path(), "c.csv", 0.0));
    let out = dir.path().join("out");
    let [a, b, bad, o] = [&a, &b, &bad, &out].map(|p| p.to_str().unwrap());
    let (code, said, _) = touchdown(&["import", "--list", a]);
    assert!(code == Some(0) && said.contains("6000 samples") && said.contains("#2 \"ai1\""), "{said}");
    let (code, _, err) = touchdown(&["import", a, b, "--out", o]);
    assert!(code == Some(2) && !out.exists(), "{err}");
    assert!(err.contains("a.csv: no column is known") && err.contains("--map force=COLUMN:kN"), "{err}");
    let map = ["--map", "force=ai0:2.5mV/N", "--out", o];
    let (_, _, err) = touchdown(&[&["import", a, b], &map[..]].concat());
    assert!(err.contains("--rate SAMPLES_PER_SECOND"), "{err}");
    let known = [&["--rate", "51200"], &map[..]].concat();
    let (code, _, err) = touchdown(&[&["import", a, b, bad], &known[..]].concat());
    assert_eq!(code, Some(2));
    for s in ["c.csv: no impact stands out", "moving_mass is missing", "--mass", "b.csv is missing", "--height"] {
        assert!(err.contains(s), "{s:?} is not in {err}");
    }
    assert!(!out.exists());
    let full = [&["--mass", "0.5", "--height", "200mm"], &known[..]].concat();
    let (code, _, err) = touchdown(&[&["import", a, b, bad], &full[..]].concat());
    assert!(code == Some(2) && err.contains("--skip-bad") && !out.exists(), "{err}");
    let (code, said, err) = touchdown(&[&["import", a, b, bad, "--skip-bad"], &full[..]].concat());
    assert!(code == Some(0) && err.contains("left out: ") && said.contains("taken as V"), "{said}{err}");
    let c = load(&out);
    let force = c.recordings[1].channels[0].as_ref().unwrap();
    assert!((force.iter().cloned().fold(0.0, f64::max) - 800.0).abs() < 2.0);
    assert_eq!((c.recordings.len(), c.recordings[0].drop_height), (2, Some(0.2)));
    // what is there is not written over
    let (code, _, err) = touchdown(&[&["import", a], &full[..]].concat());
    assert!(code == Some(2) && err.contains("is there already"), "{err}");
}

/// A half sine of 2 ms at 60 ms in a course of 120 ms.
fn pulse(t: f64) -> f64 {
    if (0.060..0.062).contains(&t) {
        (std::f64::consts::PI * (t - 0.060) / 0.002).sin()
    } else {
        0.0
    }
}

#[test]
fn a_german_table_brings_its_mass_and_height_along() {
    let dir = tempfile::tempdir().unwrap();
    let mut files = Vec::new();
    for (i, height) in [(1, 10.0_f64), (2, 20.0)] {
        let mut text =
            format!("Fallmasse\t0,326 kg\nFallhöhe\t{height} mm\n\nZeit [ms]\tKraft [daN]\tBeschl. [m/s²]\n");
        for k in 0..12_000 {
            let (t, noise) = (1e-5 * f64::from(k), 1e-3 * f64::from((k * 7919) % 13 - 6));
            let force = 500.0 * height.sqrt() * pulse(t) + noise;
            writeln!(text, "{}\t{}\t{}", comma(1e3 * t), comma(0.1 * force), comma(-force / 0.326)).unwrap();
        }
        let path = dir.path().join(format!("versuch {i}.tsv"));
        std::fs::write(&path, text).unwrap();
        files.push(path.to_str().unwrap().to_string());
    }
    let out = dir.path().join("out");
    let (code, said, err) = touchdown(&["import", &files[0], &files[1], "--out", out.to_str().unwrap()]);
    assert_eq!(code, Some(0), "{said}{err}");
    let c = load(&out);
    assert_eq!((c.moving_mass, c.recordings[1].drop_height), (Some(0.326), Some(0.02)));
    let (_, said, err) = touchdown(&["check", &files[0]]);
    assert!(err.contains("touchdown import '") && err.contains("versuch 1.tsv'"), "{said}{err}");
}

#[test]
fn a_channel_with_a_time_of_its_own_is_not_paired_by_row() {
    let dir = tempfile::tempdir().unwrap();
    let mut text = String::from("time 1 [s],force [lbs],time 2 [s],acceleration [ft/s^2]\n");
    for k in 0..12_000 {
        let (t, noise) = (1e-5 * f64::from(k), 1e-3 * f64::from((k * 7919) % 13 - 6));
        let later = t + 2e-3;
        writeln!(text, "{t:.7},{:.6},{later:.7},{:.6}", 500.0 * pulse(t) + noise, -900.0 * pulse(later) + noise)
            .unwrap();
    }
    let (file, out) = (dir.path().join("two.csv"), dir.path().join("out"));
    std::fs::write(&file, text).unwrap();
    let known = ["--mass", "0.5", "--height", "20mm", "--out", out.to_str().unwrap()];
    let (code, said, err) = touchdown(&[&["import", file.to_str().unwrap()], &known[..]].concat());
    assert!(code == Some(0) && said.contains("has its own time"), "{said}{err}");
    let c = load(&out);
    let r = &c.recordings[0];
    let middle = |channel: usize| {
        let y = r.channels[channel].as_ref().unwrap();
        let weight: f64 = y.iter().map(|v| v.abs()).sum();
        r.time.iter().zip(y).map(|(t, v)| t * v.abs()).sum::<f64>() / weight
    };
    assert!((middle(0) - middle(1)).abs() < 2e-5, "{} {}", middle(0), middle(1));
}

/// One of a contact's readings without noise, with a ripple in it that is the same every time.
fn ripple(i: usize) -> f64 {
    0.3 * ((0.7 * i as f64).sin() + (2.3 * i as f64).cos())
}

#[test]
fn recordings_of_one_sensor_have_one_sign_and_a_bump_before_the_contact_is_none() {
    let dir = tempfile::tempdir().unwrap();
    let mut files = Vec::new();
    for n in 0..4 {
        // the accelerometer reads the stop's push as positive; the last recording hangs over to the other side
        let way = if n == 3 { -0.2 } else { 1.0 };
        let mut text = String::from("time [s],force [N],acceleration [m/s^2]\n");
        for i in 0..6000usize {
            let half = |from: usize, rows: usize| match i.checked_sub(from) {
                Some(k) if k < rows => (std::f64::consts::PI * k as f64 / rows as f64).sin(),
                _ => 0.0,
            };
            // a bump of 30 N that the accelerometer shows the other way round, and the contact of 700 N right behind it
            let (bump, contact) = (half(3000, 6), half(3012, 120));
            let force = 30.0 * bump + 700.0 * contact + ripple(i);
            let a = 60.0 * (if n == 1 { -bump } else { bump }) + 1400.0 * way * contact + 2.0 * ripple(i + 7);
            writeln!(text, "{:.6},{force:.6},{a:.6}", 1e-5 * i as f64).unwrap();
        }
        let file = dir.path().join(format!("test{n}.csv"));
        std::fs::write(&file, text).unwrap();
        files.push(file.to_str().unwrap().to_string());
    }
    let out = dir.path().join("camp");
    let mut arguments: Vec<&str> = vec!["import"];
    arguments.extend(files.iter().map(String::as_str));
    arguments.extend(["--mass", "0.5", "--height", "40mm", "--out", out.to_str().unwrap()]);
    let (code, printed, said) = touchdown(&arguments);
    assert_eq!(code, Some(0), "{printed}{said}");
    let all = format!("{printed}{said}");
    assert!(all.contains("the sign of acceleration was turned: it is"), "{all}");
    assert!(all.contains("r04.csv by itself shows the other one"), "{all}");
    assert!(all.contains("no contact of its own"), "{all}");
    let c = load(&out);
    for (n, r) in c.recordings.iter().enumerate() {
        let a = r.channels[Channel::Acceleration.index()].as_ref().unwrap();
        let peak = a.iter().fold(0.0_f64, |m, v| if v.abs() > m.abs() { *v } else { m });
        assert_eq!(peak < 0.0, n != 3, "{peak}");
        // the window is that of the contact, not of the bump: its noise before the contact is kept
        assert!(r.time[0] < 0.0268 && *r.time.last().unwrap() > 0.0345, "{:?}", (r.time[0], r.time.last()));
    }
}

/// A body of 0.5 kg that is held, let go at 1 s, falls by `height` m and bounces on a soft stop twice; then it lies there, and a hand
/// takes it at 4 s. Time and what pushes on it, in m/s^2, at 2 kHz.
fn held_and_dropped(height: f64) -> Vec<(f64, f64)> {
    let contact = 0.05;
    let mut speed = (2.0 * record::GRAVITY * height).sqrt();
    let mut begins = 1.0 + speed / record::GRAVITY;
    let mut pulses = Vec::new();
    for _ in 0..3 {
        // half a sine takes the speed one and a half times, and the weight meanwhile
        let peak = (1.5 * speed / contact + record::GRAVITY) * std::f64::consts::FRAC_PI_2;
        pulses.push((begins, peak));
        speed *= 0.5;
        begins += contact + 2.0 * speed / record::GRAVITY;
    }
    let push = |t: f64| {
        let pulse = pulses.iter().find(|p| (p.0..p.0 + contact).contains(&t));
        match pulse {
            Some(p) => p.1 * (std::f64::consts::PI * (t - p.0) / contact).sin(),
            None if (1.0..begins).contains(&t) => 0.0,
            None if (4.0..4.2).contains(&t) => 16.0,
            None => record::GRAVITY,
        }
    };
    (0..10_000usize).map(|i| (5e-4 * i as f64, push(5e-4 * i as f64) + 0.1 * ripple(i))).collect()
}

#[test]
fn recordings_that_begin_at_rest_are_read_alike_by_import_and_by_check() {
    let heights = [0.1, 0.2, 0.4];
    // reading at rest in g, and whether a push reads positive
    for (rest, sign) in [(1.0, 1.0), (1.0, -1.0), (0.0, -1.0), (0.0, 1.0)] {
        let dir = tempfile::tempdir().unwrap();
        let hand = dir.path().join("hand");
        std::fs::create_dir(&hand).unwrap();
        let mut toml = String::from(
            "format = \"recordings/1\"\n[campaign]\nkind = \"drop-test\"\n[rig]\nmoving_mass = 0.5\n[simulation]\n\
             terms = [\"gravity\"]\n",
        );
        let mut files = Vec::new();
        for (n, height) in heights.iter().enumerate() {
            let text = |sign: f64| {
                let mut text = String::from("time [s],acceleration [m/s^2]\n");
                for (t, push) in held_and_dropped(*height) {
                    writeln!(text, "{t:.5},{:.6}", sign * (push + (rest - 1.0) * record::GRAVITY)).unwrap();
                }
                text
            };
            let file = dir.path().join(format!("test_{}mm.csv", 1e3 * height));
            std::fs::write(&file, text(sign)).unwrap();
            files.push(file.to_str().unwrap().to_string());
            std::fs::write(hand.join(format!("r{n}.csv")), text(-1.0)).unwrap();
            writeln!(toml, "[[recording]]\nfile = \"r{n}.csv\"\ndrop_height = {height}").unwrap();
        }
        std::fs::write(hand.join("campaign.toml"), toml).unwrap();
        let out = dir.path().join("imported");
        let mut arguments: Vec<&str> = vec!["import"];
        arguments.extend(files.iter().map(String::as_str));
        arguments.extend(["--mass", "0.5", "--terms", "gravity", "--out", out.to_str().unwrap()]);
        let (code, printed, said) = touchdown(&arguments);
        assert_eq!(code, Some(0), "{printed}{said}");
        for campaign in [&out, &hand] {
            let (code, printed, said) = touchdown(&["check", "--json", campaign.to_str().unwrap()]);
            assert_eq!(code, Some(0), "{rest} {sign}: {printed}{said}");
            let all: serde_json::Value = serde_json::from_str(&printed).unwrap();
            let recordings = all[0]["recordings"].as_array().unwrap();
            assert_eq!(recordings.len(), 3, "{printed}");
            for (r, height) in recordings.iter().zip(heights) {
                let touch = 1.0 + (2.0 * height / record::GRAVITY).sqrt();
                let (at, lasts) = (r["impact_at"].as_f64().unwrap(), r["contact"].as_f64().unwrap());
                assert!(
                    (at - touch).abs() < 5e-3 && (lasts - 0.05).abs() < 5e-3,
                    "{rest} {sign}: {at} {lasts} {touch}"
                );
            }
        }
        // it begins in the fall, and ends before the hand
        for r in &load(&out).recordings {
            let a = r.channels[Channel::Acceleration.index()].as_ref().unwrap();
            assert!(r.time[0] >= 1.0 && *r.time.last().unwrap() < 4.0 && a[0].abs() < 1.0, "{:?}", (r.time[0], a[0]));
        }
    }
}
