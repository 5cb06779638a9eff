//! The one list of units of touchdown: what a unit measures and its factor to SI, however people and instruments write it.
//!
//! A unit is read by its parts: `ft/s^2`, `m.s-2`, `mVolt` and `kg*m/s²` need no line of their own. Factors are those of
//! the SI brochure (BIPM 2019) and of NIST SP 811 (2008).

/// Standard acceleration of gravity, m/s^2 (CGPM 1901).
const GRAVITY: f64 = 9.80665;
/// International pound, kg (1959).
const POUND: f64 = 0.453_592_37;
/// Longest text that is looked at, bytes.
const LONGEST: usize = 48;

/// What a unit is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measure {
    /// Exponents of metre, kilogram, second and ampere.
    pub dimension: [i32; 4],
    /// Factor to SI.
    pub factor: f64,
}

const NONE: [i32; 4] = [0; 4];
const LENGTH: [i32; 4] = [1, 0, 0, 0];
const MASS: [i32; 4] = [0, 1, 0, 0];
const TIME: [i32; 4] = [0, 0, 1, 0];
const CURRENT: [i32; 4] = [0, 0, 0, 1];
const FORCE: [i32; 4] = [1, 1, -2, 0];
const VOLTAGE: [i32; 4] = [2, 1, -3, -1];
const CHARGE: [i32; 4] = [0, 0, 1, 1];
const PRESSURE: [i32; 4] = [-1, 1, -2, 0];
const ENERGY: [i32; 4] = [2, 1, -2, 0];
const POWER: [i32; 4] = [2, 1, -3, 0];
const PER_SECOND: [i32; 4] = [0, 0, -1, 0];

/// What is measured, and its dimension.
const QUANTITIES: [(&str, [i32; 4]); 7] = [
    ("time", TIME),
    ("force", FORCE),
    ("acceleration", [1, 0, -2, 0]),
    ("penetration", LENGTH),
    ("speed", [1, 0, -1, 0]),
    ("mass", MASS),
    ("spring rate", [0, 1, -2, 0]),
];
/// Those of them that a column of a recording may hold.
const COLUMNS: [&str; 4] = ["time", "force", "acceleration", "penetration"];
/// What sensors give before they are scaled, the unit it is counted in, and its dimension.
const OUTPUTS: [(&str, [i32; 4]); 3] = [("V", VOLTAGE), ("A", CURRENT), ("C", CHARGE)];

/// Symbols that take prefixes.
const PREFIXED: [(&str, [i32; 4], f64); 13] = [
    ("s", TIME, 1.0),
    ("m", LENGTH, 1.0),
    ("g", MASS, 1e-3),
    ("N", FORCE, 1.0),
    ("V", VOLTAGE, 1.0),
    ("A", CURRENT, 1.0),
    ("C", CHARGE, 1.0),
    ("Pa", PRESSURE, 1.0),
    ("bar", PRESSURE, 1e5),
    ("Hz", PER_SECOND, 1.0),
    ("J", ENERGY, 1.0),
    ("W", POWER, 1.0),
    ("Nm", ENERGY, 1.0),
];
const PREFIXES: [(&str, f64); 9] =
    [("p", 1e-12), ("n", 1e-9), ("u", 1e-6), ("m", 1e-3), ("c", 1e-2), ("d", 1e-1), ("k", 1e3), ("M", 1e6), ("G", 1e9)];

/// Symbols that stand as they are.
const SYMBOLS: [(&str, [i32; 4], f64); 31] = [
    ("min", TIME, 60.0),
    ("h", TIME, 3600.0),
    ("hr", TIME, 3600.0),
    ("d", TIME, 86_400.0),
    ("in", LENGTH, 0.0254),
    ("ft", LENGTH, 0.3048),
    ("yd", LENGTH, 0.9144),
    ("mil", LENGTH, 2.54e-5),
    ("mils", LENGTH, 2.54e-5),
    ("thou", LENGTH, 2.54e-5),
    ("t", MASS, 1e3),
    ("lb", MASS, POUND),
    ("lbs", MASS, POUND),
    ("lbm", MASS, POUND),
    ("oz", MASS, POUND / 16.0),
    ("slug", MASS, POUND * GRAVITY / 0.3048),
    ("daN", FORCE, 10.0),
    ("gf", FORCE, 1e-3 * GRAVITY),
    ("kgf", FORCE, GRAVITY),
    ("tf", FORCE, 1e3 * GRAVITY),
    ("kp", FORCE, GRAVITY),
    ("lbf", FORCE, 4.448_221_615_260_5),
    ("ozf", FORCE, 4.448_221_615_260_5 / 16.0),
    ("klbf", FORCE, 4_448.221_615_260_5),
    ("kip", FORCE, 4_448.221_615_260_5),
    ("kips", FORCE, 4_448.221_615_260_5),
    ("pdl", FORCE, 0.138_254_954_376),
    ("dyn", FORCE, 1e-5),
    ("Gal", [1, 0, -2, 0], 1e-2),
    ("psi", PRESSURE, 6_894.757_293_168),
    ("ksi", PRESSURE, 6_894_757.293_168),
];

/// Words, in lower case, and the symbol that they are; prefixes stand before them as words and as signs (`mVolt`).
const WORDS: [(&str, &str); 69] = [
    ("s", "s"),
    ("sec", "s"),
    ("secs", "s"),
    ("second", "s"),
    ("seconds", "s"),
    ("sekunde", "s"),
    ("sekunden", "s"),
    ("sek", "s"),
    ("seconde", "s"),
    ("secondes", "s"),
    ("segundo", "s"),
    ("segundos", "s"),
    ("secondo", "s"),
    ("secondi", "s"),
    ("秒", "s"),
    ("minute", "min"),
    ("minutes", "min"),
    ("minuten", "min"),
    ("分", "min"),
    ("hour", "h"),
    ("hours", "h"),
    ("newton", "N"),
    ("newtons", "N"),
    ("newtonios", "N"),
    ("牛", "N"),
    ("牛顿", "N"),
    ("ニュートン", "N"),
    ("metre", "m"),
    ("meter", "m"),
    ("meters", "m"),
    ("metres", "m"),
    ("mètre", "m"),
    ("mètres", "m"),
    ("metro", "m"),
    ("metros", "m"),
    ("metri", "m"),
    ("米", "m"),
    ("メートル", "m"),
    ("micron", "um"),
    ("microns", "um"),
    ("inch", "in"),
    ("inches", "in"),
    ("zoll", "in"),
    ("foot", "ft"),
    ("feet", "ft"),
    ("volt", "V"),
    ("volts", "V"),
    ("voltios", "V"),
    ("vdc", "V"),
    ("vac", "V"),
    ("vrms", "V"),
    ("amp", "A"),
    ("amps", "A"),
    ("ampere", "A"),
    ("amperes", "A"),
    ("coulomb", "C"),
    ("coulombs", "C"),
    ("gram", "g"),
    ("grams", "g"),
    ("gramm", "g"),
    ("gramme", "g"),
    ("grammes", "g"),
    ("tonne", "t"),
    ("tonnes", "t"),
    ("pound", "lb"),
    ("pounds", "lb"),
    ("pascal", "Pa"),
    ("hertz", "Hz"),
    ("dyne", "dyn"),
];
const WORD_PREFIXES: [(&str, f64); 10] = [
    ("nano", 1e-9),
    ("micro", 1e-6),
    ("mikro", 1e-6),
    ("milli", 1e-3),
    ("centi", 1e-2),
    ("zenti", 1e-2),
    ("kilo", 1e3),
    ("mega", 1e6),
    ("毫", 1e-3),
    ("微", 1e-6),
];

/// Spellings of multiples of the standard acceleration of gravity, after [`spelled`].
const GRAVITIES: [(&str, f64); 14] = [
    ("g", 1.0),
    ("G", 1.0),
    ("g's", 1.0),
    ("G's", 1.0),
    ("gs", 1.0),
    ("gn", 1.0),
    ("g_n", 1.0),
    ("g0", 1.0),
    ("gee", 1.0),
    ("grav", 1.0),
    ("mg", 1e-3),
    ("mG", 1e-3),
    ("mgn", 1e-3),
    ("ug", 1e-6),
];

/// Units that convert to nothing that a recording holds, known so that they are not taken for names.
const OTHERS: [&str; 47] = [
    "K", "degC", "degF", "deg", "\u{b0}", "\u{b0}C", "\u{b0}F", "%", "rpm", "RPM", "U", "rev", "G", "gn", "g0", "dB",
    "strain", "\u{3b5}", "ueps", "ustrain", "kph", "mph", "Ohm", "\u{3a9}", "atm", "Torr", "counts", "digits", "EU",
    "AU", "u/min", "VA", "kOhm", "k\u{3a9}", "mol", "bit", "bits", "cts", "count", "samples", "rad", "mrad", "T", "mT",
    "S/s", "eps", "U/min",
];

/// A unit without brackets, and with the signs that differ between character sets alike: `[m·s⁻²]` becomes `m*s-2`.
fn spelled(unit: &str) -> String {
    let unit = unit.trim().trim_matches(['[', ']', '"']).trim();
    let unit = unit.strip_prefix('\'').and_then(|u| u.strip_suffix('\'')).unwrap_or(unit);
    let mut plain = String::new();
    for c in unit.chars() {
        match c {
            'µ' | 'μ' => plain.push('u'),
            '¹' => plain.push('1'),
            '²' => plain.push('2'),
            '³' => plain.push('3'),
            '⁻' | '−' | '\u{2010}' | '\u{2011}' => plain.push('-'),
            '·' | '⋅' | '×' | '∙' | '•' => plain.push('*'),
            '\u{2044}' | '\u{2215}' => plain.push('/'),
            c if c.is_whitespace() => plain.push(' '),
            c => plain.push(c),
        }
    }
    plain.trim().trim_end_matches('.').replace("**", "^")
}

/// What a unit measures and its factor to SI; None where it is not known.
pub fn parse(unit: &str) -> Option<Measure> {
    let text = spelled(unit);
    if text.is_empty() || text.len() > LONGEST {
        return None;
    }
    if text == "ms-2" || text == "ms^-2" {
        return parse("m/s^2");
    }
    let mut parser = Parser { rest: &text, depth: 0 };
    let m = parser.product()?;
    (parser.rest.is_empty() && m.factor.is_finite() && m.factor > 0.0).then_some(m)
}

/// Reads products of symbols with exponents from the left.
struct Parser<'a> {
    rest: &'a str,
    depth: usize,
}

impl Parser<'_> {
    fn product(&mut self) -> Option<Measure> {
        let mut all = self.term()?;
        loop {
            let before = self.rest;
            self.rest = self.rest.trim_start();
            let under = match self.rest.chars().next() {
                None | Some(')') => return Some(all),
                Some('/') => true,
                Some('*' | '.') => false,
                // a blank multiplies: m s^-2
                Some(_) if before.len() > self.rest.len() => {
                    let next = self.term()?;
                    all = times(all, next, 1);
                    continue;
                }
                Some(_) => return None,
            };
            self.rest = self.rest[1..].trim_start();
            let next = self.term()?;
            all = times(all, next, if under { -1 } else { 1 });
        }
    }

    fn term(&mut self) -> Option<Measure> {
        let base = if let Some(inner) = self.rest.strip_prefix('(') {
            self.depth += 1;
            if self.depth > 4 {
                return None;
            }
            self.rest = inner.trim_start();
            let all = self.product()?;
            self.rest = self.rest.strip_prefix(')')?;
            all
        } else if let Some(rest) = self.rest.strip_prefix('1').filter(|r| r.starts_with('/')) {
            self.rest = rest;
            Measure { dimension: NONE, factor: 1.0 }
        } else {
            let ends = |(i, c): (usize, char)| (i > 0 && c.is_ascii_digit() || " */.^()-+".contains(c)).then_some(i);
            let end = self.rest.char_indices().find_map(ends).unwrap_or(self.rest.len());
            let (symbol, rest) = self.rest.split_at(end);
            self.rest = rest;
            atom(symbol)?
        };
        let rest = self.rest.strip_prefix('^').unwrap_or(self.rest);
        let rest = rest.strip_prefix('(').unwrap_or(rest);
        let (sign, digits) = match rest.strip_prefix('-') {
            Some(d) => (-1, d),
            None => (1, rest.strip_prefix('+').unwrap_or(rest)),
        };
        let count = digits.chars().take_while(char::is_ascii_digit).count();
        if count == 0 {
            return (!self.rest.starts_with(['^', '-', '+'])).then_some(base);
        }
        let exponent: i32 = digits[..count].parse().ok().filter(|e| *e < 10)?;
        let closes = self.rest.starts_with("^(");
        self.rest = &digits[count..];
        if closes {
            self.rest = self.rest.strip_prefix(')')?;
        }
        Some(times(Measure { dimension: NONE, factor: 1.0 }, base, sign * exponent))
    }
}

/// `a` times `b` to the power of `n`.
fn times(a: Measure, b: Measure, n: i32) -> Measure {
    let mut dimension = a.dimension;
    dimension.iter_mut().zip(b.dimension).for_each(|(d, e)| *d += n * e);
    let factor = match n {
        1 => a.factor * b.factor,
        -1 => a.factor / b.factor,
        n if n < 0 => a.factor / b.factor.powi(-n),
        n => a.factor * b.factor.powi(n),
    };
    Measure { dimension, factor }
}

/// One symbol, with its prefix, or a word.
fn atom(text: &str) -> Option<Measure> {
    let found = |m: (&str, [i32; 4], f64), by: f64| Measure { dimension: m.1, factor: by * m.2 };
    if let Some(s) = SYMBOLS.iter().find(|s| s.0 == text) {
        return Some(found(*s, 1.0));
    }
    let prefixed = |text: &str| PREFIXED.into_iter().find(|s| s.0 == text);
    if let Some(s) = prefixed(text) {
        return Some(found(s, 1.0));
    }
    for (prefix, by) in PREFIXES {
        if let Some(s) = text.strip_prefix(prefix).and_then(prefixed) {
            // 1e-3 of a metre and 1e3 of a gram are exact
            return Some(if s.0 == "g" && prefix == "k" { found(("g", MASS, 1.0), 1.0) } else { found(s, by) });
        }
    }
    let lower = text.to_lowercase();
    let word = |text: &str| -> Option<Measure> {
        let symbol = WORDS.iter().find(|w| w.0 == text)?.1;
        atom(symbol)
    };
    let by = |m: Measure, by: f64| Measure { factor: by * m.factor, ..m };
    if lower.len() > 1 {
        if let Some(m) = word(&lower) {
            return Some(m);
        }
    }
    // mVolt, kNewton, msec: a sign before a word of three letters or more
    let signed = PREFIXES.into_iter().find_map(|(p, f)| {
        // MSEC is no megasecond
        let capital = || lower.strip_prefix("m").filter(|rest| p == "m" && rest.starts_with("sec"));
        let rest = text.strip_prefix(p).or_else(capital)?;
        word(&rest.to_lowercase()).filter(|_| rest.chars().count() >= 3).map(|m| by(m, f))
    });
    let spelt = || {
        WORD_PREFIXES.into_iter().find_map(|(p, f)| {
            let rest = lower.strip_prefix(p)?;
            word(rest).filter(|_| rest.len() > 1).map(|m| by(m, f))
        })
    };
    signed.or_else(spelt)
}

/// Factor from `unit` to SI, where it measures `quantity`: time, force, acceleration, penetration, speed, mass or spring
/// rate. What `g`, `mg` and `lb` mean depends on it: multiples of gravity, masses, or the weight of a pound.
pub fn factor(quantity: &str, unit: &str) -> Option<f64> {
    let dimension = QUANTITIES.iter().find(|q| q.0 == quantity)?.1;
    let plain = spelled(unit);
    match quantity {
        "acceleration" => {
            if let Some(g) = GRAVITIES.iter().find(|g| g.0 == plain) {
                return Some(g.1 * GRAVITY);
            }
        }
        "force" if matches!(plain.to_lowercase().as_str(), "lb" | "lbs" | "pound" | "pounds") => {
            return Some(POUND * GRAVITY);
        }
        "force" if plain.eq_ignore_ascii_case("klb") => return Some(1e3 * POUND * GRAVITY),
        _ => {}
    }
    parse(unit).filter(|m| m.dimension == dimension).map(|m| m.factor)
}

/// What a column in `unit` measures (time, force, acceleration or penetration), and its factor to SI; None where the unit
/// is of none of them. `g` and `mg` are accelerations, `lb` is a force.
pub fn measured(unit: &str) -> Option<(&'static str, f64)> {
    let order = ["acceleration", "time", "force", "penetration"];
    let found = order.into_iter().find_map(|q| factor(q, unit).map(|f| (q, f)))?;
    COLUMNS.contains(&found.0).then_some(found)
}

/// Another quantity that `unit` measures than `quantity`; None where it measures none that touchdown knows.
pub fn other(quantity: &str, unit: &str) -> Option<&'static str> {
    QUANTITIES.iter().map(|q| q.0).filter(|q| *q != quantity).find(|q| factor(q, unit).is_some())
}

/// What an output of a sensor in `unit` is counted in, `V`, `A` or `C`, and the factor to that; None for other units.
pub fn output(unit: &str) -> Option<(&'static str, f64)> {
    let m = parse(unit)?;
    OUTPUTS.iter().find(|o| o.1 == m.dimension).map(|o| (o.0, m.factor))
}

/// Whether a text is a unit, of whatever quantity: one that is known here, or a product of such with others.
pub fn is_unit(text: &str) -> bool {
    if matches!(text, "-" | "1") || OTHERS.contains(&text) || parse(text).is_some() {
        return true;
    }
    let joins = |c: char| "/*\u{b7}\u{22c5}\u{d7}() .".contains(c);
    let exponent = |c: char| c.is_ascii_digit() || "^\u{b2}\u{b3}-+\u{b9}\u{207b}\u{2212}".contains(c);
    let mut atoms = 0;
    text.split(joins).filter(|part| !part.is_empty()).all(|part| {
        let symbol = part.trim_end_matches(exponent);
        // the 1 of 1/min
        let one = part == "1" && text.starts_with("1/");
        atoms += usize::from(!one);
        one || OTHERS.contains(&symbol) || atom(&symbol.replace(['µ', 'μ'], "u")).is_some()
    }) && atoms > 0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(a: f64, b: f64) -> bool {
        (a / b - 1.0).abs() < 1e-9
    }

    #[test]
    fn units_are_known_in_every_spelling() {
        for (unit, quantity, to_si) in [
            ("kN", "force", 1e3),
            ("[N]", "force", 1.0),
            ("Newtons", "force", 1.0),
            ("daN", "force", 10.0),
            ("kp", "force", 9.80665),
            ("gf", "force", 9.80665e-3),
            ("kgf", "force", 9.80665),
            ("lb", "force", 4.4482216152605),
            ("lbs", "force", 4.4482216152605),
            ("lbf", "force", 4.4482216152605),
            ("kip", "force", 4448.2216152605),
            ("kg*m/s²", "force", 1.0),
            ("牛顿", "force", 1.0),
            ("m/s²", "acceleration", 1.0),
            ("m·s⁻²", "acceleration", 1.0),
            ("m.s-2", "acceleration", 1.0),
            ("m.s^-2", "acceleration", 1.0),
            ("m s^-2", "acceleration", 1.0),
            ("ms-2", "acceleration", 1.0),
            ("m/sec2", "acceleration", 1.0),
            ("m/sec^2", "acceleration", 1.0),
            ("m/(s^2)", "acceleration", 1.0),
            ("(m/s^2)", "acceleration", 1.0),
            ("m/s**2", "acceleration", 1.0),
            ("m/s/s", "acceleration", 1.0),
            ("mm/s^2", "acceleration", 1e-3),
            ("ft/s^2", "acceleration", 0.3048),
            ("in/s^2", "acceleration", 0.0254),
            ("in/s2", "acceleration", 0.0254),
            ("g", "acceleration", 9.80665),
            ("G", "acceleration", 9.80665),
            ("mg", "acceleration", 9.80665e-3),
            ("g's", "acceleration", 9.80665),
            ("μs", "time", 1e-6),
            ("Seconds", "time", 1.0),
            ("msec", "time", 1e-3),
            ("milliseconds", "time", 1e-3),
            ("毫秒", "time", 1e-3),
            ("SEC", "time", 1.0),
            ("sec.", "time", 1.0),
            ("mm", "penetration", 1e-3),
            ("Millimeter", "penetration", 1e-3),
            ("mil", "penetration", 2.54e-5),
            ("inch", "penetration", 0.0254),
            ("ft", "penetration", 0.3048),
        ] {
            let (q, f) = measured(unit).unwrap_or(("none", 0.0));
            assert!(q == quantity && near(f, to_si), "{unit}: {q} {f}");
        }
    }

    #[test]
    fn what_a_word_means_depends_on_the_quantity() {
        assert_eq!(factor("mass", "g"), Some(1e-3));
        assert_eq!(factor("mass", "kg"), Some(1.0));
        assert!(near(factor("mass", "lb").unwrap(), POUND));
        assert!(near(factor("mass", "mg").unwrap(), 1e-6));
        assert!(near(factor("spring rate", "lbf/in").unwrap(), 175.126835246476));
        assert!(near(factor("spring rate", "N/mm").unwrap(), 1e3));
        assert!(near(factor("speed", "km/h").unwrap(), 1.0 / 3.6));
        assert_eq!((factor("force", "kg"), factor("force", "KN"), factor("penetration", "N")), (None, None, None));
        assert_eq!(other("force", "kg"), Some("mass"));
    }

    #[test]
    fn outputs_of_sensors_are_volts_amperes_and_coulombs() {
        for (unit, of, to) in [
            ("V", "V", 1.0),
            ("Volt", "V", 1.0),
            ("Volts", "V", 1.0),
            ("volts", "V", 1.0),
            ("VDC", "V", 1.0),
            ("Vdc", "V", 1.0),
            ("mVolt", "V", 1e-3),
            ("mV", "V", 1e-3),
            ("millivolts", "V", 1e-3),
            ("µV", "V", 1e-6),
            ("mA", "A", 1e-3),
            ("pC", "C", 1e-12),
        ] {
            let found = output(unit);
            assert!(found.is_some_and(|o| o.0 == of && near(o.1, to)), "{unit}: {found:?}");
        }
        assert_eq!((output("N"), output(""), output("counts")), (None, None, None));
    }

    #[test]
    fn names_and_numbers_are_no_units() {
        for other in [
            "Force",
            "time",
            "x",
            "CH1",
            "",
            "Drop 1",
            "12",
            "2/3",
            "filtered",
            "a",
            "F",
            "MS",
            "das",
            "ai0",
            "m^",
            "m^^2",
            "((((((m))))))",
            "m/",
            "s-",
            "Kraft",
            "Weg",
        ] {
            assert_eq!(parse(other), None, "{other}");
        }
        for unit in ["V", "mV", "", "°C", "m/s", "MS", "kg"] {
            assert_eq!(measured(unit), None, "{unit}");
        }
        for unit in
            ["1/min", "%", "mV/V", "°C", "µm/m", "(m/s)", "-", "kg*m", "N·m", "mV/N", "Volt", "VDC", "dB", "pC/g"]
        {
            assert!(is_unit(unit), "{unit}");
        }
    }
}
