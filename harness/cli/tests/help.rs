//! The help of every subcommand: examples that parse.

use clap::{Command, Parser};
use touchdown::commands::{command_line, Cli};

/// Every subcommand with its words, those below another one too.
fn all(c: &Command, words: &str, out: &mut Vec<(String, Command)>) {
    for s in c.get_subcommands() {
        let words = format!("{words} {}", s.get_name());
        out.push((words.clone(), s.clone()));
        all(s, &words, out);
    }
}

/// The examples of a help: what stands in a line after `touchdown`, lines that end with a backslash joined.
fn examples(help: &str) -> Vec<Vec<String>> {
    let (_, after) = help.split_once("Examples:\n").unwrap_or_default();
    let joined = after.replace("\\\n", " ");
    let lines = joined.lines().filter(|l| l.trim_start().starts_with("touchdown "));
    // what the shell redirects is none of the command's words
    lines.map(|l| shlex::split(l).unwrap().into_iter().take_while(|w| w != ">").collect()).collect()
}

#[test]
fn every_subcommand_has_examples_that_parse() {
    let mut commands = Vec::new();
    all(&command_line(), "touchdown", &mut commands);
    assert!(commands.len() > 15, "{}", commands.len());
    for (words, mut c) in commands {
        let help = c.render_help().to_string();
        let examples = examples(&help);
        let own = examples.iter().filter(|e| format!("{} ", e.join(" ")).starts_with(&format!("{words} ")));
        assert!(own.count() >= 2, "{words} has too few examples:\n{help}");
        for e in examples {
            Cli::try_parse_from(&e).unwrap_or_else(|f| panic!("{}\n{f}", e.join(" ")));
        }
    }
}

#[test]
fn an_example_that_does_not_parse_is_found() {
    let e = examples(
        "Usage\n\nExamples:\n  touchdown fit a --out b  # a note\n  touchdown fit \\\n    'a b' --uot c > d\n",
    );
    assert_eq!(e, [vec!["touchdown", "fit", "a", "--out", "b"], vec!["touchdown", "fit", "a b", "--uot", "c"]]);
    assert!(Cli::try_parse_from(&e[0]).is_ok() && Cli::try_parse_from(&e[1]).is_err());
}

#[test]
fn the_programs_help_tells_exit_codes() {
    let help = command_line().render_long_help().to_string();
    for part in ["Exit codes:", "  0 ", "  2 ", "  3 ", "  129 ", "  141 "] {
        assert!(help.contains(part), "{part:?} is not in {help}");
    }
}
