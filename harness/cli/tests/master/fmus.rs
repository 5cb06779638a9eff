//! Our own FMUs under the masters: what the book says of them, and the files a user writes.

use std::path::Path;
use std::process::{Command, Output};
use touchdown::study::coupling::{rest, setups, Pair, CASES};

fn touchdown(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_touchdown")).args(arguments).output().unwrap()
}

fn setup(name: &str) -> touchdown::study::coupling::Setup {
    setups().into_iter().find(|s| s.name == name).unwrap()
}

#[test]
fn twenty_steps_a_contact_do_for_a_thousandth_without_iterating() {
    let pair = Pair::new().unwrap();
    let s = setup("Gauss-Seidel, held, lookahead 0.5, touch located");
    for n in [20.0, 27.0, 40.0] {
        let e = pair.worst(&s, &CASES, n);
        assert!(e.restitution < 1e-3 && e.energy < 2e-3, "{n}: {e:?}");
    }
    // without lookahead it takes over a hundred times as many
    let plain = pair.worst(&setup("Gauss-Seidel, held"), &CASES, 2000.0);
    assert!(plain.restitution > 1e-3, "{plain:?}");
    // and the error of a held force is as the theory of contact.md has it for a spring: exp(pi h / 4)
    let spring = [CASES[3]];
    let e = pair.worst(&setup("Gauss-Seidel, held"), &spring, 200.0).restitution;
    let h = std::f64::consts::PI / 200.0;
    assert!((e / ((std::f64::consts::FRAC_PI_4 * h).exp() - 1.0) - 1.0).abs() < 0.1, "{e}");
    let e = pair.worst(&setup("Jacobi, held"), &spring, 200.0).restitution;
    assert!((e / ((3.0 * std::f64::consts::FRAC_PI_4 * h).exp() - 1.0) - 1.0).abs() < 0.1, "{e}");
}

#[test]
fn iterated_and_adaptive_masters_reach_a_millionth() {
    let pair = Pair::new().unwrap();
    let e = pair.worst(&setup("iterated, cubic, touch located"), &CASES, 200.0);
    assert!(e.restitution < 1e-6 && e.peak < 1e-4, "{e:?}");
    let e = pair.worst(&setup("iterated, cubic, touch located, step by doubling"), &CASES, 1e-8);
    assert!(e.restitution < 1e-6 && e.steps < 300.0, "{e:?}");
    // a tighter tolerance is never much worse than a looser one
    for tolerance in [1e-3, 1e-4, 1e-5, 1e-6] {
        let e = pair.worst(&setup("iterated, cubic, touch located, step by doubling"), &CASES, tolerance);
        assert!(e.restitution < 30.0 * tolerance, "{tolerance}: {e:?}");
    }
}

fn contactor() -> String {
    std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/contactor_system.toml")).unwrap()
}

fn column(csv: &str, head: &str) -> Vec<f64> {
    let mut lines = csv.lines();
    let i = lines.next().unwrap().split(',').position(|h| h == head).unwrap();
    lines.map(|l| l.split(',').nth(i).unwrap().parse().unwrap()).collect()
}

fn run(folder: &Path, text: &str) -> (Output, String) {
    let file = folder.join("system.toml");
    std::fs::write(&file, text).unwrap();
    let out = folder.join("out");
    let o = touchdown(&["run", file.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    let csv = std::fs::read_to_string(out.join("results.csv")).unwrap_or_default();
    (o, csv)
}

#[test]
fn the_contactor_runs_from_its_file_and_comes_out_alike_from_its_archive() {
    let folder = tempfile::tempdir().unwrap();
    let (o, csv) = run(folder.path(), &contactor());
    assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
    let (x, v) = (column(&csv, "bar.penetration [m]"), column(&csv, "bar.velocity [m/s]"));
    // it sits until the hold has faded to the spring, strikes, and bounces
    assert_eq!(x[0], -0.004);
    let top = x.iter().cloned().fold(f64::MIN, f64::max);
    assert!(top > 5e-5 && top < 5e-4, "{top}");
    assert!(v.iter().any(|v| *v < -0.1));
    let summary = std::fs::read_to_string(folder.path().join("out/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    assert!(summary["touches"].as_array().unwrap().len() >= 4);
    let log = std::fs::read_to_string(folder.path().join("out/log.txt")).unwrap();
    assert!(log.contains("contact begins") && !log.contains("bar:"), "{log}");
    // written out and read back, with nothing adaptive left, it is the plain Gauss-Seidel of the file
    let plain: String = contactor().split("[[touch]]").next().unwrap().to_string();
    let (o, csv) = run(folder.path(), &plain);
    assert!(o.status.success());
    let ssp = folder.path().join("contactor.ssp");
    let file = folder.path().join("system.toml");
    let o = touchdown(&["export-ssp", file.to_str().unwrap(), "--out", ssp.to_str().unwrap()]);
    assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
    let out = folder.path().join("again");
    let o = touchdown(&["run", ssp.to_str().unwrap(), "--out", out.to_str().unwrap()]);
    assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
    let again = std::fs::read_to_string(out.join("results.csv")).unwrap();
    assert_eq!(column(&again, "bar.penetration [m]"), column(&csv, "bar.penetration [m]"));
}

#[test]
fn recording_is_selective_and_parquet_holds_the_same_rows() {
    let folder = tempfile::tempdir().unwrap();
    let text = contactor() + "[results]\nrecord = [\"bar.velocity\", \"contact.contact\"]\nevery = 10\n";
    let (o, csv) = run(folder.path(), &text);
    assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
    assert_eq!(csv.lines().next().unwrap(), "time [s],bar.velocity [m/s],contact.contact");
    let rows = csv.lines().count() - 1;
    assert!(rows > 200 && rows < 230, "{rows}");
    let file = folder.path().join("system.toml");
    let out = folder.path().join("parquet");
    let o = touchdown(&["run", file.to_str().unwrap(), "--out", out.to_str().unwrap(), "--parquet"]);
    assert!(o.status.success());
    let file = std::fs::File::open(out.join("results.parquet")).unwrap();
    let reader = parquet::file::serialized_reader::SerializedFileReader::new(file).unwrap();
    use parquet::file::reader::FileReader;
    assert_eq!(reader.metadata().file_metadata().num_rows() as usize, rows);
    assert!(!out.join("results.partial.parquet").exists());
}

#[test]
fn what_is_wrong_in_a_system_file_is_named_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |from: &str, to: &str| {
        let text = contactor().replacen(from, to, 1);
        assert_ne!(text, contactor(), "{from}");
        let (o, csv) = run(folder.path(), &text);
        assert_eq!(o.status.code(), Some(2), "{to}");
        assert!(csv.is_empty());
        String::from_utf8_lossy(&o.stderr).into_owned()
    };
    let line = |part: &str| 1 + contactor().lines().position(|l| l.contains(part)).unwrap();
    for (from, to, says) in [
        ("bar.penetration\"\nto", "bar.depth\"\nto", "bar has no variable depth"),
        ("to = \"bar.force\"", "to = \"bar.velocity\"", "bar.velocity is no input; bar has force"),
        ("to = \"bar.force\"", "to = \"beam.force\"", "no FMU is named beam; give one of bar, contact"),
        ("mass = 0.509 ", "mas = 0.509 ", "bar has no variable mas; its parameters are mass, travel"),
        ("mass = 0.509 ", "mass = true ", "mass is of type Real and cannot be"),
        ("exponent = 1.0", "adhesion_form = \"leavin\"", "is not known; did you mean \"leaving\"?"),
        ("\"touchdown:contact\"", "\"nowhere.fmu\"", "nowhere.fmu"),
        ("\"gauss-seidel\"", "\"runge\"", "give gauss-seidel, jacobi, implicit or iterated"),
        ("[\"logContact\"]", "[\"logFoo\"]", "logFoo is no category of contact"),
        ("contact.lookahead_time", "contact.stiffness", "no tunable parameter in s"),
    ] {
        let said = refused(from, to);
        assert!(said.contains(says), "{said}");
    }
    let said = refused("step = 5e-5", "stepp = 5e-5");
    assert!(said.contains(&format!("system.toml:{}:", line("step = 5e-5"))) && said.contains("stepp"), "{said}");
    let said = refused("to = \"bar.force\"", "to = \"bar.velocity\"");
    assert!(said.contains(&format!("system.toml:{}:", line("to = \"bar.force\""))), "{said}");
    let said = refused("step = 5e-5", "step = -1.0");
    assert!(said.contains("[master] step"), "{said}");
    // the FMU's own word on a value out of its range
    let said = refused("mass = 0.509 ", "mass = -1.0 ");
    assert!(said.contains("mass is -1: give a finite number above 0"), "{said}");
}

#[test]
fn a_broken_archive_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("x.ssp");
    std::fs::write(&path, b"no zip").unwrap();
    let o = touchdown(&["run", path.to_str().unwrap(), "--out", folder.path().join("o").to_str().unwrap()]);
    assert_eq!(o.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&o.stderr).contains("x.ssp"), "{o:?}");
}

#[test]
fn a_body_at_rest_stays_there_with_lookahead_and_leaves_without() {
    let pair = Pair::new().unwrap();
    for name in ["Gauss-Seidel, held, lookahead 0.5", "iterated, cubic, touch located", "Jacobi, held, lookahead 1.5"] {
        let moves = rest(&pair, &setup(name)).unwrap();
        assert!(moves < 3e-3, "{name}: {moves}");
    }
    assert!(rest(&pair, &setup("Gauss-Seidel, held")).unwrap() > 0.5);
}

/// The contactor's tables once more under other names.
fn twice() -> String {
    let one = contactor();
    let (head, _) = one.split_once("[master]").unwrap();
    let second: String = head.split_once("[[fmu]]").unwrap().1.replace("bar", "rod").replace("contact", "stop");
    let second = second.replace("touchdown:stop", "touchdown:contact").replace("moving-rod", "moving-bar");
    let second = second.replace("log = [\"logContact\"]", "").replace("logStop", "logContact");
    format!("{head}[[fmu]]{second}{}", &one[head.len()..])
}

#[test]
fn two_instances_of_each_fmu_share_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let text = twice().replacen("mass = 0.509", "mass = 0.6", 1);
    let (o, csv) = run(folder.path(), &text);
    assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
    let (heavy, light) = (column(&csv, "bar.penetration [m]"), column(&csv, "rod.penetration [m]"));
    assert!(heavy.iter().zip(&light).any(|(a, b)| (a - b).abs() > 1e-5));
    // alike, they come out alike where the step is the same for both
    let text = twice().replace("[[touch]]", "[[unused]]");
    let text = text.split("[[unused]]").next().unwrap().to_string();
    let (o, csv) = run(folder.path(), &text);
    assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
    assert_eq!(column(&csv, "bar.penetration [m]"), column(&csv, "rod.penetration [m]"));
    assert_eq!(column(&csv, "contact.force [N]"), column(&csv, "stop.force [N]"));
}

#[cfg(unix)]
#[test]
fn ctrl_c_keeps_what_was_computed() {
    use std::time::{Duration, Instant};
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("long.toml");
    std::fs::write(&file, contactor().replace("stop = 0.1 ", "stop = 1e4 ")).unwrap();
    let out = folder.path().join("out");
    let mut child = Command::new(env!("CARGO_BIN_EXE_touchdown"))
        .args(["run", file.to_str().unwrap(), "--out", out.to_str().unwrap()])
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    // results grow while it runs; a generous wait, for the sake of a busy machine, that only a failure exhausts
    let part = out.join("results.partial.csv.part");
    let patience = Instant::now() + Duration::from_secs(120);
    while std::fs::metadata(&part).map_or(0, |m| m.len()) < 20_000 {
        assert!(Instant::now() < patience, "no results while it runs");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let csv = std::fs::read_to_string(out.join("results.csv")).unwrap();
    assert!(!part.exists() && csv.ends_with('\n'));
    let times = column(&csv, "time [s]");
    assert!(times.len() > 100 && *times.last().unwrap() < 1e4);
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    assert!(summary.contains("\"interrupted\": true"));
}
