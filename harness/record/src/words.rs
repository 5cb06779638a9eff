//! The known word nearest to one that is not known.

/// Likeness, from 0 to 1, from which a word is near: at least half of its letters stand in place.
const NEAR: f64 = 0.5;
/// Bytes of a word that may be a slip of the pen, at most: no known one is nearly as long.
const LONGEST: usize = 200;
/// Bytes of a text of somebody else's that a message repeats, at most.
const REPEATED: usize = 300;
/// Letters from which a word that is a part of another is near to it.
const PART: usize = 4;

/// Likeness of two words, 0 to 1, by the edits that turn one into the other (Damerau 1964); case and the kind of hyphen
/// do not count.
fn likeness(a: &str, b: &str) -> f64 {
    let plain = |w: &str| w.to_lowercase().replace(['-', ' '], "_");
    let (a, b) = (plain(a), plain(b));
    let alike = strsim::normalized_damerau_levenshtein(&a, &b);
    let part = a.len().min(b.len()) >= PART && (a.contains(&b) || b.contains(&a));
    if part {
        NEAR + (1.0 - NEAR) * alike
    } else {
        alike
    }
}

/// The beginning of a text that a message repeats; all of it where it is short.
pub fn beginning(text: &str) -> std::borrow::Cow<'_, str> {
    if text.len() <= REPEATED {
        return text.into();
    }
    let mut end = REPEATED;
    while !text.is_char_boundary(end) {
        end -= 1;
    }
    format!("{}... ({} bytes)", &text[..end], text.len()).into()
}

/// The one of `known` nearest to `word`, where one is near.
pub fn nearest<'a>(word: &str, known: &[&'a str]) -> Option<&'a str> {
    if word.len() > LONGEST {
        return None;
    }
    // of equally near ones the first
    let mut best: Option<(f64, &str)> = None;
    for k in known {
        let alike = likeness(word, k);
        if alike > NEAR && best.is_none_or(|b| alike > b.0) {
            best = Some((alike, k));
        }
    }
    best.map(|b| b.1)
}

/// What to write instead of `word`: the nearest of `known`, and all of them.
pub fn instead(word: &str, known: &[&str]) -> String {
    let all = known.join(", ");
    match nearest(word, known) {
        Some(k) => format!("did you mean {k:?}? Known are {all}"),
        None => format!("known are {all}"),
    }
}

/// The end of a message that has listed all of `known`: the nearest to `word`; empty where none is near.
pub fn meant(word: &str, known: &[impl AsRef<str>]) -> String {
    let known: Vec<&str> = known.iter().map(AsRef::as_ref).collect();
    nearest(word, &known).map_or(String::new(), |k| format!("; did you mean {k:?}?"))
}

/// What serde says of a key or a value that it does not know ("unknown field `a`, expected one of `b`, `c`"), with the nearest
/// of those known; any other message as it is.
pub fn with_meant(message: &str) -> String {
    let message = message.trim();
    let quoted: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    match quoted[..] {
        [word, ref known @ ..] if message.starts_with("unknown ") => format!("{message}{}", meant(word, known)),
        _ => message.to_string(),
    }
}

/// Place of `word` among `known`.
///
/// # Errors
/// Not among them: names `what` it was given for, the nearest of `known`, and all of them.
pub fn place(what: &str, word: &str, known: &[&str]) -> Result<usize, String> {
    let found = known.iter().position(|k| *k == word);
    found.ok_or_else(|| not_known(what, word, known))
}

/// Says that `word`, given for `what`, is none of `known`: the nearest, and all of them.
pub fn not_known(what: &str, word: &str, known: &[&str]) -> String {
    format!("{what} {:?} is not known; {}", beginning(word), instead(word, known))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slips_of_the_pen_find_their_word() {
        let known = ["gravity", "guide_friction", "hysteresis_damping", "viscous_damping"];
        for (slip, word) in [
            ("grvity", "gravity"),
            ("Gravity", "gravity"),
            ("gravtiy", "gravity"),
            ("friction", "guide_friction"),
            ("hysteresis-damping", "hysteresis_damping"),
            ("viscous damping", "viscous_damping"),
        ] {
            assert_eq!(nearest(slip, &known), Some(word), "{slip}");
        }
        assert_eq!(nearest("wind", &known), None);
        assert_eq!(instead("grvity", &known[..1]), "did you mean \"gravity\"? Known are gravity");
        assert_eq!(meant("grvity", &known), "; did you mean \"gravity\"?");
        assert_eq!(meant("wind", &known), "");
        assert_eq!(instead("wind", &known[..2]), "known are gravity, guide_friction");
    }

    #[test]
    fn a_word_without_an_end_is_near_to_none_and_is_not_repeated() {
        let endless = "gravity".repeat(1_000_000);
        assert_eq!(nearest(&endless, &["gravity"]), None);
        let said = not_known("term", &endless, &["gravity"]);
        assert!(said.len() < 400 && said.contains("... (7000000 bytes)\" is not known"), "{}", said.len());
        assert!(beginning(&"\u{e4}".repeat(400)).starts_with('\u{e4}'));
    }

    #[test]
    fn keys_that_serde_does_not_know_find_theirs() {
        let said = "unknown field `stopp`, expected one of `start`, `stop`";
        assert_eq!(with_meant(said), format!("{said}; did you mean \"stop\"?"));
        let said = "unknown variant `jacoby`, expected `gauss-seidel` or `jacobi`";
        assert_eq!(with_meant(said), format!("{said}; did you mean \"jacobi\"?"));
        for said in ["unknown field `wind`, expected `mass`", "missing field `mass`", "unknown field `wind`"] {
            assert_eq!(with_meant(said), said);
        }
    }
}
