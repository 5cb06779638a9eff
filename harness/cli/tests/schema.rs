//! `touchdown schema`: the documentation holds what it prints.

use std::path::Path;
use std::process::Command;

#[test]
fn the_documentation_holds_the_schemas_that_are_printed() {
    for format in ["recordings", "scenario", "system"] {
        let out = Command::new(env!("CARGO_BIN_EXE_touchdown")).args(["schema", format]).output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/src/formats/schemas");
        let path = folder.join(format!("{format}.schema.json"));
        if std::env::var_os("TOUCHDOWN_WRITE").is_some() {
            std::fs::create_dir_all(&folder).unwrap();
            std::fs::write(&path, &out.stdout).unwrap();
        }
        let held = std::fs::read(&path).unwrap_or_default();
        assert!(held == out.stdout, "{}: write it anew with TOUCHDOWN_WRITE=1", path.display());
    }
}
