//! The command as it was typed, for what it writes to say.

use std::sync::{Mutex, PoisonError};

/// The commit that touchdown was built from; "unknown" where it was built without git.
pub const COMMIT: &str = env!("TOUCHDOWN_COMMIT");

/// The command that runs.
static LINE: Mutex<String> = Mutex::new(String::new());

/// From here on the command of these words runs; the first stands for the program.
pub fn begin(words: impl Iterator<Item = String>) {
    let line = std::iter::once("touchdown".to_string()).chain(words.skip(1).map(|w| quoted(&w)));
    *LINE.lock().unwrap_or_else(PoisonError::into_inner) = line.collect::<Vec<_>>().join(" ");
}

/// The command that runs, as a shell takes it; empty where none does.
pub fn line() -> String {
    LINE.lock().unwrap_or_else(PoisonError::into_inner).clone()
}

/// A word as a shell takes it; a character that is not printed is `?`.
pub fn quoted(word: &str) -> String {
    let word = word.replace(char::is_control, "?");
    let plain = |c: char| c.is_alphanumeric() || "/\\._-+:,@%=".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_told_as_a_shell_takes_it() {
        begin(["/usr/bin/touchdown", "diagnose", "my drops", "--out", "it's", ""].map(String::from).into_iter());
        assert_eq!(line(), "touchdown diagnose 'my drops' --out 'it'\\''s' ''");
        assert_eq!(quoted("a\nb"), "'a?b'");
    }

    #[test]
    fn the_commit_is_one_or_is_not_known() {
        assert!(COMMIT == "unknown" || COMMIT.len() >= 40 && COMMIT.chars().all(|c| c.is_ascii_hexdigit()), "{COMMIT}");
    }
}
