//! System files.

use crate::relay::{fmu, folder, run, run_toml, touchdown, FREE};

const PREFERS: &str = "stepSize=\"0.1\"";

fn joined(pairs: &[(&str, &str)]) -> String {
    pairs.iter().map(|(from, to)| format!("[[connect]]\nfrom = \"{from}\"\nto = \"{to}\"\n")).collect()
}

#[test]
fn a_difference_of_temperatures_has_no_offset_whether_the_variable_or_its_type_says_so() {
    let source = fmu(
        (FREE, PREFERS),
        &[
            "Real.0 parameter in0 start=\"20\"",
            "Real.1 parameter in1 start=\"10\"",
            "Real.2 parameter in2 start=\"10\"",
            "Real.10 output T unit=\"degC\"",
            "Real.11 output rise unit=\"degC\" relativeQuantity=\"true\"",
            "Real.12 output typed declaredType=\"Rise\"",
        ],
    );
    let sink = fmu(
        (FREE, PREFERS),
        &[
            "Real.0 input T unit=\"K\"",
            "Real.1 input rise unit=\"K\"",
            "Real.2 input typed unit=\"K\"",
            "Real.10 output got_T",
            "Real.11 output got_rise",
            "Real.12 output got_typed",
        ],
    );
    let dir = folder(&[("a.fmu", &source), ("b.fmu", &sink)]);
    let pairs = joined(&[("a.T", "b.T"), ("a.rise", "b.rise"), ("a.typed", "b.typed")]);
    let set = "[fmu.set]\nin0 = 20\nin1 = 10\nin2 = 10\n";
    let toml = format!("[[fmu]]\nname = \"b\"\nfile = \"b.fmu\"\n{pairs}[master]\nstop = 0.2\n");
    let r = run_toml(dir.path(), &[("a", "a.fmu")], &format!("{set}{toml}"));
    assert_eq!(r.code, Some(0), "{}", r.said);
    assert_eq!((r.last("b.got_T"), r.last("b.got_rise"), r.last("b.got_typed")), (293.15, 10.0, 10.0));
}

#[test]
fn a_unit_that_cannot_be_converted_is_noted_and_one_known_by_name_is_converted() {
    let source = fmu(
        (FREE, PREFERS),
        &[
            "Real.0 parameter in",
            "Real.10 output x unit=\"in\"",
            "Real.10 output odd unit=\"furlong\"",
            "Real.10 output T unit=\"K\"",
        ],
    );
    let sink = fmu(
        (FREE, PREFERS),
        &[
            "Real.0 input x unit=\"m\"",
            "Real.1 input odd unit=\"m\"",
            "Real.2 input T unit=\"m\"",
            "Real.10 output got_x",
            "Real.11 output got_odd",
        ],
    );
    let dir = folder(&[("a.fmu", &source), ("b.fmu", &sink)]);
    let rest = "[fmu.set]\nin = 1.0\n[[fmu]]\nname = \"b\"\nfile = \"b.fmu\"\n[master]\nstop = 0.2\n";
    let pairs = joined(&[("a.x", "b.x"), ("a.odd", "b.odd"), ("a.T", "b.T")]);
    let r = run_toml(dir.path(), &[("a", "a.fmu")], &format!("{rest}{pairs}"));
    assert_eq!((r.code, r.last("b.got_x"), r.last("b.got_odd")), (Some(0), 0.0254, 1.0), "{}", r.said);
    assert!(r.said.contains("a.odd -> b.odd: their units are furlong, which is not defined"), "{}", r.said);
    assert!(r.said.contains("a.T -> b.T: their units are K and m, which are of different kinds"), "{}", r.said);
    assert!(!r.said.contains("a.x -> b.x"), "{}", r.said);
    let quiet = pairs.replace("to = \"b.odd\"\n", "to = \"b.odd\"\nsuppress_unit_conversion = true\n");
    let r = run_toml(dir.path(), &[("a", "a.fmu")], &format!("{rest}{quiet}"));
    assert!(!r.said.contains("furlong"), "{}", r.said);
}

/// A source and a sink with a port of every type.
fn every_type() -> [Vec<u8>; 2] {
    let source = fmu(
        (FREE, PREFERS),
        &[
            "Integer.0 parameter n",
            "Boolean.0 parameter b",
            "String.0 parameter s",
            "Integer.1 parameter valve_is declaredType=\"Valve\"",
            "Integer.10 output count",
            "Boolean.10 output shut",
            "String.10 output label",
            "Enumeration.11 output valve declaredType=\"Valve\"",
            "Real.10 output x",
        ],
    );
    let sink = fmu(
        (FREE, PREFERS),
        &[
            "Real.0 input as_real",
            "Integer.0 input as_integer",
            "Boolean.0 input as_boolean",
            "String.0 input as_string",
            "Enumeration.1 input as_lamp declaredType=\"Lamp\"",
            "Integer.2 input flag",
            "Real.10 output got_real",
            "Integer.10 output got_integer",
            "Boolean.10 output got_boolean",
            "String.10 output got_string",
            "Integer.11 output got_lamp",
            "Integer.12 output got_flag",
        ],
    );
    [source, sink]
}

const SET: &str = "[fmu.set]\nn = 7\nb = true\ns = \"steel\"\nvalve_is = 4\n[[fmu]]\nname = \"b\"\nfile = \"b.fmu\"\n";

#[test]
fn variables_of_every_type_are_connected_and_mapped() {
    let [source, sink] = every_type();
    // a third one that takes the String on: its length is what it was
    let third = fmu((FREE, PREFERS), &["String.0 input text", "String.10 output text_again"]);
    let dir = folder(&[("a.fmu", &source), ("b.fmu", &sink), ("c.fmu", &third)]);
    let pairs = joined(&[
        ("a.count", "b.as_real"),
        ("a.valve", "b.as_integer"),
        ("a.shut", "b.as_boolean"),
        ("a.label", "b.as_string"),
        ("a.shut", "b.flag"),
        ("b.got_string", "c.text"),
    ]);
    let mapped =
        "[[connect]]\nfrom = \"a.valve\"\nto = \"b.as_lamp\"\nmap = [[\"open\", \"on\"], [\"shut\", \"off\"]]\n";
    for method in ["gauss-seidel", "jacobi", "gauss-seidel\"\ninputs = \"extrapolated"] {
        let rest = format!("{SET}[[fmu]]\nname = \"c\"\nfile = \"c.fmu\"\n{pairs}{mapped}[master]\nmethod = \"{method}\"\nstop = 0.4\n");
        let r = run_toml(dir.path(), &[("a", "a.fmu")], &rest);
        assert_eq!(r.code, Some(0), "{}", r.said);
        let got = ["b.got_real", "b.got_integer", "b.got_boolean", "b.got_lamp", "b.got_flag"].map(|n| r.last(n));
        assert_eq!(got, [7.0, 4.0, 1.0, 8.0, 1.0], "{method}");
        assert!(r.head.iter().all(|h| !h.contains("string") && !h.contains("label")), "{:?}", r.head);
    }
}

#[test]
fn what_an_input_cannot_hold_is_refused_with_the_line() {
    let [source, sink] = every_type();
    let dir = folder(&[("a.fmu", &source), ("b.fmu", &sink)]);
    for (from, to, says) in [
        ("a.x", "b.as_integer", "a.x is a Real and b.as_integer a Integer, which cannot hold it"),
        ("a.label", "b.as_real", "a.label is a String and b.as_real a Real"),
        ("a.count", "b.as_boolean", "a.count is a Integer and b.as_boolean a Boolean"),
        ("a.count", "b.got_real", "b.got_real is no input; b has as_real"),
        ("b.flag", "b.as_real", "b.flag is no output; b has got_real"),
    ] {
        let rest = format!("{SET}{}[master]\nstop = 0.4\n", joined(&[(from, to)]));
        let r = run_toml(dir.path(), &[("a", "a.fmu")], &rest);
        assert_eq!((r.code, r.rows.len()), (Some(2), 0), "{}", r.said);
        assert!(r.said.contains(says) && r.said.contains("system.toml:1"), "{}", r.said);
    }
    // where the item's number is of no item of the input's
    let rest = format!("{SET}{}[master]\nstop = 0.4\n", joined(&[("a.valve", "b.as_lamp")]));
    let r = run_toml(dir.path(), &[("a", "a.fmu")], &rest);
    assert!(r.code == Some(0) && r.said.contains("give the connection a map"), "{}", r.said);
}

#[test]
fn a_string_that_cannot_be_recorded_is_refused_with_its_line_before_the_run() {
    let [source, sink] = every_type();
    let dir = folder(&[("a.fmu", &source), ("b.fmu", &sink)]);
    let rest = format!("{SET}[master]\nstop = 0.4\n[results]\nrecord = [\"a.label\"]\n");
    let r = run_toml(dir.path(), &[("a", "a.fmu")], &rest);
    assert_eq!((r.code, r.rows.len()), (Some(2), 0));
    assert!(r.said.contains("system.toml:15: a.label is a String, and results are numbers"), "{}", r.said);
}

const COUNTS: [&str; 4] =
    ["Integer.9 parameter manners", "Real.20 output tolerance", "Real.21 output steps", "Real.22 output length"];

#[test]
fn a_run_reaches_its_stop_by_a_shorter_last_step_or_says_why_not() {
    let dir = folder(&[("free.fmu", &fmu((FREE, ""), &COUNTS)), ("stiff.fmu", &fmu(("", ""), &COUNTS))]);
    let master = |stop: f64, step: f64| format!("[master]\nstop = {stop:?}\nstep = {step:?}\n");
    let free = |stop, step| run_toml(dir.path(), &[("a", "free.fmu")], &master(stop, step));
    let stiff = |stop, step| run_toml(dir.path(), &[("a", "free.fmu"), ("b", "stiff.fmu")], &master(stop, step));
    let r = free(1.0, 0.3);
    assert_eq!((r.last("time"), r.last("a.steps")), (1.0, 4.0), "{}", r.said);
    assert!((r.last("a.length") - 0.1).abs() < 1e-12 && !r.said.contains("short of"), "{}", r.said);
    // longer than the whole run
    let r = free(1.0, 5.0);
    assert_eq!((r.last("time"), r.last("a.steps"), r.last("a.length")), (1.0, 1.0, 1.0), "{}", r.said);
    let r = stiff(1.0, 0.3);
    assert_eq!((r.code, r.last("a.steps")), (Some(0), 3.0), "{}", r.said);
    assert!(
        r.said.contains("short of 1 s, which is no multiple of the step; b takes no step of another length"),
        "{}",
        r.said
    );
    let r = stiff(1.0, 5.0);
    assert_eq!(r.code, Some(2), "{}", r.said);
    assert!(r.said.contains("a step of 5 s is longer than the whole run, and b takes no step"), "{}", r.said);
    // a step that rounds to a whole number of them is one
    let r = stiff(1.0, 1.0 / 60.0);
    assert_eq!((r.last("b.steps"), r.said.contains("short of")), (60.0, false));
    // from the command line
    let r = run(dir.path(), "system.toml", &["--step", "0.25", "--stop", "0.5"]);
    assert_eq!((r.last("b.steps"), r.last("time")), (2.0, 0.5), "{}", r.said);
    std::fs::write(dir.path().join("drop.toml"), "kind = \"drop_test\"\n").unwrap();
    let r = run(dir.path(), "drop.toml", &["--step", "0.25"]);
    assert!(r.said.contains("--step is for systems of FMUs"), "{}", r.said);
}

#[test]
fn every_fmu_is_given_its_tolerance() {
    let dir =
        folder(&[("said.fmu", &fmu((FREE, "tolerance=\"1e-5\""), &COUNTS)), ("none.fmu", &fmu((FREE, ""), &COUNTS))]);
    let fmus = [("a", "said.fmu"), ("b", "none.fmu")];
    let r = run_toml(dir.path(), &fmus, "[master]\nstop = 1.0\nstep = 0.5\n");
    assert_eq!((r.last("a.tolerance"), r.last("b.tolerance")), (1e-5, -1.0), "{}", r.said);
    let r = run_toml(dir.path(), &fmus, "tolerance = 1e-8\n[master]\nstop = 1.0\nstep = 0.5\ntolerance = 1e-3\n");
    assert_eq!((r.last("a.tolerance"), r.last("b.tolerance")), (1e-3, 1e-8), "{}", r.said);
    let r = run_toml(dir.path(), &fmus, "[master]\nstop = 1.0\nstep = 0.5\ntolerance = 0.0\n");
    assert!(r.code == Some(2) && r.said.contains("tolerance: give a number between 0 and 1"), "{}", r.said);
}

#[test]
fn an_fmu_that_asks_for_the_end_ends_the_run_with_its_results() {
    let dir = folder(&[("a.fmu", &fmu((FREE, ""), &COUNTS))]);
    let r = run_toml(dir.path(), &[("a", "a.fmu")], "[fmu.set]\nmanners = 2\n[master]\nstop = 1.0\nstep = 0.1\n");
    assert_eq!((r.code, r.rows.len(), r.last("a.steps")), (Some(0), 4, 3.0), "{}", r.said);
    assert!(r.said.contains("a asked for the end at 0.3"), "{}", r.said);
    let summary = std::fs::read_to_string(dir.path().join("out/summary.json")).unwrap();
    assert!(summary.contains("asked for the end"), "{summary}");
}

#[test]
fn an_fmu_that_logs_with_an_environment_of_its_own_is_heard_and_kills_nothing() {
    let dir = folder(&[("a.fmu", &fmu((FREE, ""), &COUNTS))]);
    for more in [&[][..], &["--in-process"]] {
        std::fs::write(
            dir.path().join("s.toml"),
            "[[fmu]]\nname = \"a\"\nfile = \"a.fmu\"\n[fmu.set]\nmanners = 1\n[master]\nstop = 1.0\nstep = 0.1\n",
        )
        .unwrap();
        let r = run(dir.path(), "s.toml", more);
        assert_eq!(r.code, Some(2), "{}", r.said);
        assert!(r.said.contains("fmi2DoStep of a answered fmi2Error; it logged \"out of oil\""), "{}", r.said);
    }
}

#[test]
fn a_value_beyond_what_an_fmu_declares_is_noted_by_the_bounds_of_the_variable_or_its_type() {
    let variables = [
        "Real.0 parameter gap unit=\"mm\" min=\"0\" max=\"3\"",
        "Real.1 parameter rise declaredType=\"Rise\"",
        "Real.2 parameter wide declaredType=\"Rise\" max=\"1000\"",
        "Integer.0 parameter teeth min=\"3\"",
        "Real.10 output x",
    ];
    let dir = folder(&[("a.fmu", &fmu((FREE, PREFERS), &variables))]);
    let set = "[fmu.set]\ngap = 3.5\nrise = -6\nwide = 999\nteeth = 2\n[master]\nstop = 0.2\n";
    let r = run_toml(dir.path(), &[("a", "a.fmu")], set);
    assert_eq!(r.code, Some(0), "{}", r.said);
    for says in [
        "a.gap = 3.5 mm: the FMU declares at most 3 mm",
        "a.rise = -6 degC: the FMU declares at least -5 degC",
        "a.teeth = 2: the FMU declares at least 3",
    ] {
        assert!(r.said.contains(says), "{}", r.said);
    }
    assert!(!r.said.contains("wide"), "{}", r.said);
}

#[test]
fn a_bond_in_other_units_than_those_of_its_energy_is_refused() {
    let source =
        fmu((FREE, PREFERS), &["Real.0 input x unit=\"m\"", "Real.10 output v unit=\"mm\"", "Real.11 output f"]);
    let dir = folder(&[("a.fmu", &source)]);
    let r = run_toml(
        dir.path(),
        &[("a", "a.fmu")],
        "[master]\nstop = 0.2\n[[bond]]\nforce = \"a.f\"\nvelocity = \"a.v\"\n",
    );
    assert_eq!(r.code, Some(2), "{}", r.said);
    assert!(r.said.contains("system.toml:8: a.v is in mm, and a bond is in m/s"), "{}", r.said);
}

#[test]
fn an_archive_of_every_type_reads_back_as_it_was_and_holds_no_empty_lists() {
    let [source, sink] = every_type();
    let dir = folder(&[("a.fmu", &source), ("b.fmu", &sink)]);
    let mapped =
        "[[connect]]\nfrom = \"a.valve\"\nto = \"b.as_lamp\"\nmap = [[\"open\", \"on\"], [\"shut\", \"off\"]]\n";
    let pairs = joined(&[("a.count", "b.as_real"), ("a.shut", "b.as_boolean"), ("a.label", "b.as_string")]);
    let r = run_toml(
        dir.path(),
        &[("a", "a.fmu")],
        &format!("{SET}{pairs}{mapped}[master]\nstop = 0.4\ntolerance = 1e-7\n"),
    );
    assert_eq!(r.code, Some(0), "{}", r.said);
    let at = |name: &str| dir.path().join(name).to_str().unwrap().to_string();
    let (code, said) = touchdown(&["export-ssp", &at("system.toml"), "--out", &at("x.ssp")]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("a.valve -> b.as_lamp: its transformation is in the archive"), "{said}");
    let again = run(dir.path(), "x.ssp", &[]);
    assert_eq!((again.code, &again.head, &again.rows), (Some(0), &r.head, &r.rows), "{}", again.said);
    // one FMU, nothing connected, nothing set
    std::fs::write(dir.path().join("one.toml"), "[[fmu]]\nname = \"b\"\nfile = \"b.fmu\"\n[master]\nstop = 0.4\n")
        .unwrap();
    let (code, said) = touchdown(&["export-ssp", &at("one.toml"), "--out", &at("one.ssp")]);
    assert_eq!(code, Some(0), "{said}");
    let mut zip = zip::ZipArchive::new(std::fs::File::open(at("one.ssp")).unwrap()).unwrap();
    let mut ssd = String::new();
    std::io::Read::read_to_string(&mut zip.by_name("SystemStructure.ssd").unwrap(), &mut ssd).unwrap();
    assert!(!ssd.contains("Connect") && !ssd.contains("Enumerations"), "{ssd}");
}
