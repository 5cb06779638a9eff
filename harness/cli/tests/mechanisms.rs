//! `touchdown mechanisms`: what it prints, and that the documentation holds it.

use std::path::Path;
use std::process::{Command, Output};

fn mechanisms(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_touchdown")).arg("mechanisms").args(arguments).output().unwrap()
}

fn printed(arguments: &[&str]) -> String {
    let o = mechanisms(arguments);
    assert!(o.status.success(), "{}", String::from_utf8_lossy(&o.stderr));
    String::from_utf8(o.stdout).unwrap()
}

#[test]
fn the_documentation_holds_the_table_that_is_printed() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/src/mechanisms.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let (head, rest) = text.split_once("<!-- mechanisms -->\n").unwrap();
    let (table, _) = rest.split_once("<!-- end -->").unwrap();
    let now = printed(&["--format", "markdown"]);
    if table != now && std::env::var_os("TOUCHDOWN_WRITE").is_some() {
        std::fs::write(&path, format!("{head}<!-- mechanisms -->\n{now}<!-- end -->\n")).unwrap();
        return;
    }
    assert_eq!(table, now, "write it anew with TOUCHDOWN_WRITE=1");
}

#[test]
fn one_mechanism_is_printed_with_its_forms_and_a_name_that_is_none_is_refused_with_those_there_are() {
    let one = printed(&["attached_mass"]);
    for part in ["attached_mass (motion)", "linear spring; hardening spring", "attached_stiffness [N/m]", "Den Hartog"]
    {
        assert!(one.contains(part), "{part}: {one}");
    }
    let all: serde_json::Value = serde_json::from_str(&printed(&["--format", "json"])).unwrap();
    let names: Vec<&str> = all.as_array().unwrap().iter().map(|m| m["name"].as_str().unwrap()).collect();
    for name in ["contact_preload", "guide_friction", "clipping"] {
        assert!(names.contains(&name), "{name}");
    }
    let o = mechanisms(&["atached_mass"]);
    assert_eq!(o.status.code(), Some(2));
    let message = String::from_utf8_lossy(&o.stderr).to_string();
    assert!(message.contains("atached_mass is no mechanism") && message.contains("attached_mass,"), "{message}");
}
