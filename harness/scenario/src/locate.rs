//! Finds the line of a key in a TOML file, for messages.

/// Line, from 1 on, of `key` in the `index`-th table headed `[section]` or `[[section]]` ("" is the top of the
/// file, where a key may be a table); the header's line where the key is not in it, None where there is no such table.
pub fn line_of(text: &str, section: &str, index: usize, key: &str) -> Option<usize> {
    let mut here = section.is_empty();
    let mut header = None;
    let mut seen = 0;
    let parent = section.split('.').next().unwrap_or("");
    for (n, line) in text.lines().enumerate() {
        let l = line.trim();
        if l.starts_with('[') {
            let name = l.trim_start_matches('[').split(']').next().unwrap_or("").trim();
            if section.is_empty() && name == key {
                return Some(n + 1);
            }
            // [tip.contact] belongs to the last [[tip]]
            if name == parent && l.starts_with("[[") && parent != section {
                seen += 1;
                here = false;
            } else if name == section {
                if parent == section || !section.contains('.') {
                    seen += 1;
                }
                here = seen == index + 1 || (section.contains('.') && seen == 0 && index == 0);
                if here {
                    header = Some(n + 1);
                }
            } else {
                here = false;
            }
            continue;
        }
        let name = l.split('=').next().unwrap_or("").trim();
        let within =
            l.contains('{') && l.split(['{', ',']).skip(1).any(|k| k.split('=').next().unwrap_or("").trim() == key);
        if here && (name == key || within) {
            return Some(n + 1);
        }
        // contact.stiffness = 1, contact = { stiffness = 1 }
        if name == format!("{section}.{key}") || (name == section && l.contains(key)) {
            return Some(n + 1);
        }
    }
    header
}

#[cfg(test)]
mod tests {
    use super::line_of;

    #[test]
    fn keys_are_found_in_their_own_table() {
        let t = "mass = 1\n[contact]\nstiffness = 2\n[[tip]]\nname = \"a\"\n[tip.contact]\nstiffness = 3\n[[tip]]\n\
                 [tip.contact]\nstiffness = 4\n[[compare]]\nstiffness = 5\n[[compare]]\nstiffness = 6\n";
        assert_eq!(line_of(t, "", 0, "mass"), Some(1));
        assert_eq!(line_of(t, "contact", 0, "stiffness"), Some(3));
        assert_eq!(line_of(t, "tip.contact", 0, "stiffness"), Some(7));
        assert_eq!(line_of(t, "tip.contact", 1, "stiffness"), Some(10));
        assert_eq!(line_of(t, "compare", 0, "stiffness"), Some(12));
        assert_eq!(line_of(t, "compare", 1, "stiffness"), Some(14));
        assert_eq!(line_of(t, "contact", 0, "exponent"), Some(2));
        assert_eq!(line_of(t, "sensors", 0, "x"), None);
    }
}
