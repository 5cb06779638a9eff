//! Words by which instruments name what a column holds, in the languages they speak.

use record::Channel;

/// What a column is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    Time,
    Reading(Channel),
}

impl Role {
    pub const ALL: [Role; 4] = [
        Role::Time,
        Role::Reading(Channel::Force),
        Role::Reading(Channel::Acceleration),
        Role::Reading(Channel::Penetration),
    ];

    /// As a column of a campaign's CSV is named, and as the table of units has it.
    pub fn name(self) -> &'static str {
        match self {
            Role::Time => "time",
            Role::Reading(c) => c.name(),
        }
    }

    /// SI unit.
    pub fn unit(self) -> &'static str {
        match self {
            Role::Time => "s",
            Role::Reading(c) => c.unit(),
        }
    }

    /// The role of that name; `displacement` and `position` are penetrations.
    pub fn named(name: &str) -> Option<Role> {
        match name.trim() {
            "displacement" | "position" => Some(Role::Reading(Channel::Penetration)),
            n => Role::ALL.into_iter().find(|r| r.name() == n),
        }
    }
}

/// What a name says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Says {
    Role(Role),
    /// Another quantity, in English.
    Other(&'static str),
    Nothing,
}

const FORCE: Role = Role::Reading(Channel::Force);
const ACCELERATION: Role = Role::Reading(Channel::Acceleration);
const PENETRATION: Role = Role::Reading(Channel::Penetration);

/// Words that name another quantity whatever stands beside them; a part of a word from four letters on.
const OTHERS: [(&str, &[&str]); 7] = [
    ("temperature", &["temperature", "temperatur", "temperatura", "temp", "温度"]),
    ("a trigger", &["trigger", "trig", "sync"]),
    ("a speed", &["velocity", "speed", "geschwindigkeit", "vitesse", "velocidad", "velocita", "vel"]),
    ("a height", &["height", "hoehe", "hauteur", "altura"]),
    ("a strain", &["strain", "dehnung"]),
    ("a filter's or a sum's output", &["status", "flag", "error"]),
    ("an angle", &["angle", "winkel", "gyro"]),
];

/// Words of the roles, in the order in which they are looked for: 加速度 holds 速度.
const ROLES: [(Role, &[&str]); 5] = [
    (Role::Time, &["x_value", "x value"]),
    (
        ACCELERATION,
        &[
            "accel",
            "beschleunigung",
            "beschl",
            "aceleracion",
            "accelerazione",
            "加速度",
            "acc",
            "acel",
            "a",
            "ax",
            "ay",
            "az",
        ],
    ),
    (
        FORCE,
        &[
            "force", "kraft", "fuerza", "forza", "effort", "loadcell", "load", "荷重", "載荷", "载荷", "力", "f", "fx",
            "fy", "fz", "fn",
        ],
    ),
    (
        PENETRATION,
        &[
            "displacement",
            "penetration",
            "indentation",
            "position",
            "deplacement",
            "desplazamiento",
            "spostamento",
            "verschiebung",
            "eindring",
            "deflection",
            "extension",
            "stroke",
            "depth",
            "tiefe",
            "lvdt",
            "位移",
            "変位",
            "weg",
            "disp",
            "pos",
            "abstand",
            "distance",
            "hub",
            "x",
            "z",
        ],
    ),
    (
        Role::Time,
        &[
            "time",
            "zeit",
            "temps",
            "tiempo",
            "tempo",
            "timestamp",
            "elapsed",
            "seconds",
            "sekunden",
            "时间",
            "時間",
            "時刻",
            "t",
        ],
    ),
];

/// Words of other quantities that give way to those of roles: `Druckkraft` is a force.
const WEAK: [(&str, &[&str]); 4] = [
    ("a voltage", &["voltage", "spannung", "volt"]),
    ("a pressure", &["pressure", "druck"]),
    ("a current", &["current", "strom"]),
    ("a number of the row", &["index", "sample", "samples", "row", "count", "cycle", "nr", "no", "id", "point"]),
];

/// Words that make a name that of a time where they stand first or last in it, whatever else it holds: `force.time`,
/// `time_acc`.
const CLOCKS: [&str; 7] = ["time", "zeit", "temps", "tiempo", "tempo", "timestamp", "zeitstempel"];
/// Words beside which a time is only what something goes with: `force over time`.
const AGAINST: [&str; 6] = ["over", "vs", "versus", "against", "domain", "history"];

/// What a name says without the words and numbers of its time: what the time is of.
pub fn timed(name: &str) -> Says {
    let parted = plain(&words(name));
    let rest: Vec<&str> = parted.split(|c: char| !c.is_alphanumeric()).filter(|t| !CLOCKS.contains(t)).collect();
    says(&rest.join(" "))
}

/// Lower case, letters with accents as without.
pub(crate) fn plain(name: &str) -> String {
    let mut out = String::new();
    for c in name.chars().flat_map(char::to_lowercase) {
        match c {
            'à' | 'á' | 'â' | 'ã' => out.push('a'),
            'ä' => out.push_str("ae"),
            'è' | 'é' | 'ê' | 'ë' => out.push('e'),
            'ì' | 'í' | 'î' => out.push('i'),
            'ò' | 'ó' | 'ô' => out.push('o'),
            'ö' => out.push_str("oe"),
            'ù' | 'ú' | 'û' => out.push('u'),
            'ü' => out.push_str("ue"),
            'ß' => out.push_str("ss"),
            'ç' => out.push('c'),
            'ñ' => out.push('n'),
            c => out.push(c),
        }
    }
    out
}

/// A word of four letters is found inside another as well, a shorter one only by itself; signs of Chinese and Japanese
/// anywhere.
fn holds(name: &str, tokens: &[&str], word: &str) -> bool {
    if word.len() < 4 && word.is_ascii() {
        tokens.contains(&word) || (word == "weg" && tokens.iter().any(|t| t.ends_with("weg")))
    } else if word == "temp" || word == "load" || word == "time" || word == "trig" {
        tokens.contains(&word)
    } else {
        name.contains(word)
    }
}

/// A name whose words are parted: a capital letter after a small one begins one, and so does a number.
fn words(name: &str) -> String {
    let mut parted = String::new();
    let mut last = ' ';
    for c in name.chars() {
        if (c.is_uppercase() && last.is_lowercase()) || (c.is_ascii_digit() != last.is_ascii_digit()) {
            parted.push(' ');
        }
        parted.push(c);
        last = c;
    }
    parted
}

/// What the name of a column says of it.
pub fn says(name: &str) -> Says {
    let (whole, parted) = (plain(name), plain(&words(name)));
    let tokens: Vec<&str> = parted.split(|c: char| !c.is_alphanumeric()).filter(|t| !t.is_empty()).collect();
    let any = |words: &[&str]| words.iter().any(|w| holds(&whole, &tokens, w));
    if let Some(o) = OTHERS.iter().find(|o| any(o.1)) {
        return Says::Other(o.0);
    }
    let words = tokens.iter().filter(|t| !t.bytes().all(|b| b.is_ascii_digit()));
    let ends = [words.clone().next(), words.clone().next_back()];
    let clock = ends.into_iter().flatten().any(|t| CLOCKS.contains(t));
    if clock && !tokens.iter().any(|t| AGAINST.contains(t)) {
        return Says::Role(Role::Time);
    }
    if let Some(r) = ROLES.iter().find(|r| any(r.1)) {
        return Says::Role(r.0);
    }
    WEAK.iter().find(|o| any(o.1)).map_or(Says::Nothing, |o| Says::Other(o.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_what_they_are_in_many_languages() {
        for (name, role) in [
            ("Force", FORCE),
            ("Prüfkraft", FORCE),
            ("Druckkraft", FORCE),
            ("LoadCell_1", FORCE),
            ("Fz", FORCE),
            ("衝撃力", FORCE),
            ("Accélération", ACCELERATION),
            ("加速度", ACCELERATION),
            ("Beschl. Körper", ACCELERATION),
            ("acc_body", ACCELERATION),
            ("a2", ACCELERATION),
            ("Traversenweg", PENETRATION),
            ("Déplacement", PENETRATION),
            ("位移", PENETRATION),
            ("Laser Pos", PENETRATION),
            ("Temps", Role::Time),
            ("Zeit", Role::Time),
            ("elapsedTime", Role::Time),
            ("X_Value", Role::Time),
            ("时间", Role::Time),
            ("force.time", Role::Time),
            ("time_acc", Role::Time),
            ("Time - force", Role::Time),
            ("time 2", Role::Time),
            ("force over time", FORCE),
            ("force.signals.values", FORCE),
        ] {
            assert_eq!(says(name), Says::Role(role), "{name}");
        }
        for name in
            ["Force sensor temperature", "Trigger", "Fallgeschwindigkeit", "速度 velocity", "Sample", "Drop height"]
        {
            assert!(matches!(says(name), Says::Other(_)), "{name}: {:?}", says(name));
        }
        for name in ["ai0", "Dev1/ai3", "", "CH A1B"] {
            assert!(!matches!(says(name), Says::Role(Role::Time)), "{name}");
        }
        let timed = |n: &str| super::timed(n);
        assert_eq!((timed("time_acc"), timed("Time - force")), (Says::Role(ACCELERATION), Says::Role(FORCE)));
        assert_eq!(timed("time 2"), Says::Nothing);
        assert_eq!((says("ai0"), says("Kanal")), (Says::Nothing, Says::Nothing));
    }
}
