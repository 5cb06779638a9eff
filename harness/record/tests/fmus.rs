//! campaign.toml of a campaign that FMUs simulate.

use record::{BondKind, Kind};
use std::path::Path;

const TERMS: [&str; 2] = ["hysteresis_damping", "return_spring"];

const GOOD: &str = r#"format = "recordings/1"
[campaign]
kind = "system"
[simulation]
system = "system.toml"
terms = ["return_spring"]
[[simulation.free]]
variable = "contact.stiffness"
[[simulation.free]]
variable = "bar.mass"
tolerance = 0.002
[[simulation.bond]]
name = "stop"
kind = "contact"
force = "bar.force"
penetration = "bar.penetration"
velocity = "bar.velocity"
[simulation.channels]
force = "contact.force"
[[recording]]
file = "r01.csv"
[recording.set]
"bar.spring_preload" = 12
"#;

fn folder(text: &str) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let rows: String = (0..40).map(|i| format!("{}e-5,{},0.1\n", i, i % 7)).collect();
    std::fs::write(dir.path().join("r01.csv"), format!("time [s],force [N],penetration [m]\n{rows}")).unwrap();
    std::fs::write(dir.path().join("system.toml"), "").unwrap();
    std::fs::write(dir.path().join("campaign.toml"), text).unwrap();
    dir
}

#[test]
fn a_system_is_read_with_its_bonds_free_variables_and_settings() {
    let dir = folder(GOOD);
    let c = record::load(dir.path(), &TERMS).unwrap();
    let s = c.system.as_ref().unwrap();
    assert_eq!((c.kind, s.path(), s.gravity), (Kind::System, dir.path().join("system.toml"), 0.0));
    let free: Vec<(&str, Option<f64>)> = s.free.iter().map(|f| (f.variable.text.as_str(), f.tolerance)).collect();
    assert_eq!(free, [("contact.stiffness", None), ("bar.mass", Some(0.002))]);
    let b = &s.bonds[0];
    assert_eq!(
        (b.name.text.as_str(), b.kind, b.penetration.text.as_str()),
        ("stop", BondKind::Contact, "bar.penetration")
    );
    assert_eq!(b.force.as_ref().map(|f| (f.text.as_str(), f.line)), Some(("bar.force", 15)));
    assert_eq!(c.recordings[0].set[0].value, 12.0);
    // what differs names the level; a channel without an output is left out and reported
    assert_eq!(c.levels[0].1, "bar.spring_preload = 12");
    assert!(c.recordings[0].channels[2].is_none());
    assert!(c.warnings.iter().any(|w| w.starts_with("penetration is recorded")), "{:?}", c.warnings);
    assert!(!c.warnings.iter().any(|w| w.contains("system.toml")), "{:?}", c.warnings);
}

#[test]
fn what_is_wrong_is_told_with_its_line_and_the_nearest_word() {
    for (from, to, line, said) in [
        ("system = \"system.toml\"", "sistem = \"system.toml\"", 5, "did you mean \"system\"?"),
        ("system = \"system.toml\"", "gravity = 9.81", 4, "system is missing"),
        ("tolerance = 0.002", "tolerence = 0.002", 11, "did you mean \"tolerance\"?"),
        ("tolerance = 0.002", "tolerance = -1", 11, "is out of range"),
        ("kind = \"contact\"", "kind = \"contac\"", 14, "did you mean \"contact\"?"),
        ("force = \"bar.force\"", "forse = \"bar.force\"", 15, "did you mean \"force\"?"),
        ("penetration = \"bar.penetration\"", "penetration = \"penetration\"", 16, "names no variable of an FMU"),
        ("velocity = \"bar.velocity\"\n", "", 12, "velocity is missing"),
        ("force = \"contact.force\"", "fource = \"contact.force\"", 19, "did you mean \"force\"?"),
        ("= 12\n", "= \"12\"\n", 23, "is set to what is no number"),
        ("terms = [\"return_spring\"]", "terms = [\"return_sprin\"]", 6, "did you mean \"return_spring\"?"),
        ("terms = [\"return_spring\"]", "k = 1e6", 6, "k is a parameter of an FMU here"),
        ("kind = \"system\"", "kind = \"indentation\"", 5, "this belongs to a campaign of FMUs"),
    ] {
        let text = GOOD.replacen(from, to, 1);
        assert_ne!(text, GOOD, "{from}");
        let dir = folder(&text);
        let errors = record::load(dir.path(), &TERMS).unwrap_err().0;
        let found = errors.iter().find(|e| e.to_string().contains(said));
        let found = found.unwrap_or_else(|| panic!("{to}: {errors:?}"));
        assert_eq!(found.line, line, "{found}");
        assert!(Path::new(&found.file).ends_with("campaign.toml"), "{found}");
    }
}
