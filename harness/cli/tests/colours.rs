//! Colours where a terminal shows them, none in pipes and where NO_COLOR is set.

use std::process::Command;

/// What is printed of a command that is refused, and the help, with these variables set.
fn printed(variables: &[(&str, &str)]) -> (String, String) {
    let run = |arguments: &[&str]| {
        let mut c = Command::new(env!("CARGO_BIN_EXE_touchdown"));
        for name in ["NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE"] {
            c.env_remove(name);
        }
        c.args(arguments).envs(variables.iter().copied()).output().unwrap()
    };
    let text = |b: Vec<u8>| String::from_utf8(b).unwrap();
    (text(run(&["mechanisms", "none"]).stderr), text(run(&["fit", "--help"]).stdout))
}

#[test]
fn a_pipe_gets_plain_text() {
    let (error, help) = printed(&[]);
    assert!(error.starts_with("error: none is no mechanism"), "{error}");
    assert!(!error.contains('\x1b') && !help.contains('\x1b'));
}

#[test]
fn colours_that_are_asked_for_are_given_and_no_color_forbids_them() {
    // CLICOLOR_FORCE stands for the terminal that a test has not
    let (error, help) = printed(&[("CLICOLOR_FORCE", "1")]);
    assert!(error.starts_with("\x1b[1m\x1b[31merror:\x1b[0m none"), "{error:?}");
    assert!(help.contains("\x1b[1m\x1b[32mUsage:\x1b[0m"), "{help:?}");
    let (error, help) = printed(&[("NO_COLOR", "1")]);
    assert!(!error.contains('\x1b') && !help.contains('\x1b'));
}
