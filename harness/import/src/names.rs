//! Facts from names: of files by a pattern the user gives, of files, groups and columns by numbers with a unit in them.

use crate::amount::instead;
use crate::facts::{key, known, Facts, KEYS};
use record::units;
use regex::Regex;
use std::sync::LazyLock;

/// A pattern for file names: `drop_{height:mm}_{order}.tdms`.
#[derive(Clone, Debug)]
pub struct Pattern {
    text: String,
    regex: Regex,
    /// Key and unit of each field.
    fields: Vec<(&'static str, String)>,
}

impl Pattern {
    /// Fields `{KEY}` and `{KEY:UNIT}` stand for numbers (a level may be a word), `*` and `{}` for anything. A unit that follows
    /// a field is its unit, as in `{height}mm`; without one it is SI.
    ///
    /// # Errors
    /// What is wrong with the pattern.
    pub fn parse(text: &str) -> Result<Pattern, String> {
        let mut regex = String::from("^");
        let mut fields = Vec::new();
        let mut rest = text;
        while let Some(c) = rest.chars().next() {
            if c == '*' {
                regex += ".*?";
                rest = &rest[1..];
            } else if c == '{' {
                let (field, after) = rest[1..]
                    .split_once('}')
                    .ok_or_else(|| format!("--names {text}: a {{ is not closed; write {{height:mm}} or {{order}}"))?;
                rest = after;
                let (name, unit) = field.split_once(':').unwrap_or((field, ""));
                if name.is_empty() {
                    regex += ".*?";
                    continue;
                }
                let key = key(name)
                    .ok_or_else(|| format!("--names {text}: {name:?} is not known; {}", instead(name, &known())))?;
                let quantity = KEYS.iter().find(|k| k.0 == key).map_or("", |k| k.1);
                // a unit that follows the field in the name is its unit: {height}mm
                let unit = if unit.is_empty() { unit_at(rest, quantity) } else { unit };
                if !unit.is_empty() && units::factor(quantity, unit).is_none() {
                    let cure = units::instead(quantity, unit);
                    return Err(format!("--names {text}: unit {unit:?} does not measure {key}; {cure}"));
                }
                regex += if key == "level" { "(.+?)" } else { r"(\d+(?:[.,]\d+)?)" };
                fields.push((key, unit.to_string()));
            } else {
                regex += &regex::escape(&rest[..c.len_utf8()]);
                rest = &rest[c.len_utf8()..];
            }
        }
        if fields.is_empty() {
            return Err(format!(
                "--names {text}: it holds no field; write a name like drop_{{height:mm}}_{{order}}.csv"
            ));
        }
        let regex = Regex::new(&(regex + "$")).map_err(|e| format!("--names {text}: {e}"))?;
        Ok(Pattern { text: text.to_string(), regex, fields })
    }

    /// What a file's name says.
    ///
    /// # Errors
    /// Where the name does not follow the pattern, with its end (such as `.csv`) or without.
    pub fn read(&self, file: &str) -> Result<Facts, String> {
        let stem = file.rsplit_once('.').map_or(file, |s| s.0);
        let found = self.regex.captures(file).or_else(|| self.regex.captures(stem));
        let found = found.ok_or_else(|| {
            format!("{file}: the name does not follow --names {}; correct the pattern, or the name", self.text)
        })?;
        let mut facts = Facts::default();
        for (i, (key, unit)) in self.fields.iter().enumerate() {
            let from = format!("from the name {file} by --names");
            facts.read(key, found.get(i + 1).map_or("", |m| m.as_str()), unit, &from)?;
        }
        Ok(facts)
    }
}

/// The unit of `quantity` that `text` begins with; empty where it begins with none.
fn unit_at<'a>(text: &'a str, quantity: &str) -> &'a str {
    let letters = &text[..text.find(|c: char| !c.is_ascii_alphabetic()).unwrap_or(text.len())];
    if units::factor(quantity, letters).is_some() {
        letters
    } else {
        ""
    }
}

/// The numbers with a unit that a name may hold: the key, the unit as the table of units has it, and the text that says so.
const MARKS: [(&str, &str, &str); 9] = [
    ("impact_speed", "m/s", r"m[/_ ]?s(?:-1|\^-1)?|mps"),
    ("impact_speed", "mm/s", r"mm[/_ ]?s(?:-1|\^-1)?"),
    ("impact_speed", "cm/s", r"cm[/_ ]?s(?:-1|\^-1)?"),
    ("drop_height", "mm", "mm"),
    ("drop_height", "cm", "cm"),
    ("drop_height", "m", "m"),
    ("drop_height", "in", "in(?:ch)?"),
    ("spring_preload", "N", "N"),
    ("spring_preload", "mN", "mN"),
];

/// A number with each of the [`MARKS`].
static MARKED: LazyLock<Vec<Regex>> = LazyLock::new(|| {
    let of = |mark: &str| format!(r"(^|[^\d.,])(\d+(?:[.,]\d+)?)[ _]?(?:{mark})($|[^A-Za-z0-9/^])");
    MARKS.iter().map(|(_, _, mark)| Regex::new(&of(mark)).expect("a pattern of the program")).collect()
});

/// How the origin of a value that a name was guessed to say begins.
pub(crate) const GUESSED: &str = "guessed from the name";

/// What a name says by numbers with a unit, such as `drop_200mm` or `v1.5ms-1`; nothing of a key that it says twice.
pub fn guess(name: &str) -> Facts {
    let mut facts = Facts::default();
    let mut twice: Vec<&str> = Vec::new();
    let mut rest = name.to_string();
    for ((key, unit, _), regex) in MARKS.iter().zip(&*MARKED) {
        for found in regex.captures_iter(&rest) {
            if facts.0.contains_key(*key) {
                twice.push(key);
            }
            // what is no amount after all says nothing
            drop(facts.read(key, &found[2], unit, &format!("{GUESSED} {name}")));
        }
        // metres of metres per second are no height
        rest = regex.replace_all(&rest, "$1#$3").into_owned();
    }
    facts.0.retain(|k, _| !twice.contains(k));
    facts
}

/// A number in a name, and whether a unit follows it.
struct Number {
    text: String,
    unit: bool,
}

/// The order that the names give, by the one number without a unit that differs in all of them; None where no number or
/// more than one does.
pub fn orders(names: &[String]) -> Option<Vec<f64>> {
    let digits = Regex::new(r"\d+(?:[.,]\d+)?").ok()?;
    let of = |n: &String| {
        let stem = n.rsplit_once('.').filter(|s| !s.1.starts_with(|c: char| c.is_ascii_digit()));
        let stem = stem.map_or(n.as_str(), |s| s.0);
        let number =
            |m: regex::Match| Number { text: m.as_str().into(), unit: unit_follows(m.as_str(), &stem[m.end()..]) };
        let numbers: Vec<Number> = digits.find_iter(stem).map(number).collect();
        (digits.replace_all(stem, "#").into_owned(), numbers)
    };
    let all: Vec<(String, Vec<Number>)> = names.iter().map(of).collect();
    let first = all.first()?;
    if names.len() < 2 || all.iter().any(|a| a.0 != first.0) {
        return None;
    }
    let column = |i: usize| -> Option<Vec<f64>> {
        let v: Vec<f64> = all.iter().map(|a| a.1[i].text.parse().ok()).collect::<Option<_>>()?;
        let mut sorted = v.clone();
        sorted.sort_by(f64::total_cmp);
        sorted.dedup();
        (sorted.len() == v.len() && v.iter().all(|n| n.fract() == 0.0 && *n < 1e9)).then_some(v)
    };
    // a number that a unit follows is a level, no order
    let mut found = (0..first.1.len()).filter(|i| !all.iter().all(|a| a.1[*i].unit)).filter_map(column);
    let one = found.next();
    one.filter(|_| found.next().is_none())
}

/// Whether what follows a number in a name begins with a unit.
fn unit_follows(number: &str, after: &str) -> bool {
    let end = after.char_indices().skip(1).find(|c| !c.1.is_ascii_alphabetic()).map_or(after.len(), |c| c.0);
    !guess(&format!("{number}{}", &after[..end])).0.is_empty()
}

/// Names in the order in which people count: `r2` before `r10`.
pub fn by_count(a: &str, b: &str) -> std::cmp::Ordering {
    let (mut a, mut b) = (a, b);
    loop {
        let head = |s: &str| s.find(|c: char| !c.is_ascii_digit()).unwrap_or(s.len());
        let (i, j) = (head(a), head(b));
        if i > 0 && j > 0 {
            let (x, y) = (a[..i].trim_start_matches('0'), b[..j].trim_start_matches('0'));
            let order = x.len().cmp(&y.len()).then(x.cmp(y));
            if order.is_ne() {
                return order;
            }
            (a, b) = (&a[i..], &b[j..]);
            continue;
        }
        match (a.chars().next(), b.chars().next()) {
            (Some(x), Some(y)) if x == y => (a, b) = (&a[x.len_utf8()..], &b[y.len_utf8()..]),
            (x, y) => return x.cmp(&y),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pattern_reads_amounts_and_refuses_other_names() {
        let p = Pattern::parse("drop_{height:mm}_*_{order}.tdms").unwrap();
        let f = p.read("drop_12,5_left_07.tdms").unwrap();
        assert_eq!((f.number("drop_height"), f.number("order")), (Some(0.0125), Some(7.0)));
        assert!(p.read("drop_left.tdms").unwrap_err().contains("does not follow"));
        for (text, metres) in
            [("drop_{height}mm_{order}", 0.02), ("drop_{height}m_{order}", 20.0), ("drop_{height}mmm_{order}", 20.0)]
        {
            let unit = &text[text.find('}').unwrap() + 1..text.rfind('_').unwrap()];
            let f = Pattern::parse(text).unwrap().read(&format!("drop_20{unit}_05.tdms")).unwrap();
            assert_eq!((f.number("drop_height"), f.number("order")), (Some(metres), Some(5.0)), "{text}");
        }
        let p = Pattern::parse("{level}-{speed}").unwrap();
        let f = p.read("soft-1.5.csv").unwrap();
        assert_eq!(f.number("impact_speed"), Some(1.5));
        assert_eq!(f.lines()[0], "level = \"soft\"   # from the name soft-1.5.csv by --names");
        for (wrong, said) in
            [("{hight}", "drop_height"), ("{height:N}", "measures force"), ("a", "no field"), ("{a", "closed")]
        {
            assert!(Pattern::parse(wrong).unwrap_err().contains(said), "{wrong}");
        }
    }

    #[test]
    fn numbers_with_a_unit_are_levels() {
        let height = |n: &str| guess(n).number("drop_height");
        assert_eq!(height("drop_200mm_03.csv"), Some(0.2));
        assert_eq!(height("h=0.3m.csv"), Some(0.3));
        assert_eq!(height("h0,3 m-2"), Some(0.3));
        assert_eq!(height("3mm_and_5mm"), None);
        assert_eq!(height("run 3 main"), None);
        assert_eq!(guess("v1.5ms-1_2").number("impact_speed"), Some(1.5));
        assert_eq!(guess("v1.5ms-1_2").number("drop_height"), None);
        assert_eq!(guess("1.5m_s.csv").number("impact_speed"), Some(1.5));
        assert_eq!(height("1.5m_s.csv"), None);
        assert_eq!(guess("open_12.5N_4").number("spring_preload"), Some(12.5));
    }

    #[test]
    fn the_one_number_that_differs_in_all_names_is_the_order() {
        let of = |n: &[&str]| orders(&n.iter().map(|s| s.to_string()).collect::<Vec<_>>());
        assert_eq!(of(&["d_200mm_1.csv", "d_200mm_3.csv", "d_300mm_2.csv"]), Some(vec![1.0, 3.0, 2.0]));
        assert_eq!(of(&["d_200mm.csv", "d_300mm.csv"]), None);
        assert_eq!(of(&["d1_1.csv", "d2_2.csv"]), None);
        assert_eq!(of(&["a1.csv", "b2.csv"]), None);
        let mut names = ["r10", "r2", "r1b", "r01"];
        names.sort_by(|a, b| by_count(a, b));
        assert_eq!(names, ["r01", "r1b", "r2", "r10"]);
    }
}
