//! Equal steps of time that named values give: a rate or a step, and the time of the first sample.

use super::cell::{Cell, Decimal, Delimiter, Dialect};
use super::unit::{self, ticks_of_a_second};
use crate::Clock;

/// A named number.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Quantity {
    /// Lower case, letters and digits only.
    name: String,
    number: f64,
    /// Its own, or that of its name; empty where neither has one.
    unit: String,
}

/// Names of a step, of a rate and of the first time, in lower case without spaces and signs.
const STEPS: [&str; 15] = [
    "dt",
    "deltat",
    "deltax",
    "tinc",
    "xinc",
    "wfincrement",
    "hresolution",
    "sampleinterval",
    "samplinginterval",
    "sampleperiod",
    "samplingperiod",
    "timestep",
    "xspacing",
    "increment",
    "xincrement",
];
const RATES: [&str; 11] = [
    "samplerate",
    "samplingrate",
    "samplefrequency",
    "samplingfrequency",
    "abtastrate",
    "abtastfrequenz",
    "fs",
    "acquisitionrate",
    "scanrate",
    "rate",
    "samplespersecond",
];
const STARTS: [&str; 8] =
    ["t0", "start", "starttime", "firstsampletime", "wfstartoffset", "xorg", "xorigin", "hoffset"];
/// Names that give a step only together with a unit of time, in every file.
const WITH_UNIT: [&str; 2] = ["interval", "step"];
/// Names that need a unit where a file holds values of any kind, and not only those of an instrument.
const VAGUE: [&str; 6] = ["rate", "increment", "xincrement", "t0", "start", "starttime"];

impl Quantity {
    /// A number with its unit; where that is empty the name may hold one: `fs_kHz`, `Rate [Hz]`.
    pub fn new(name: &str, number: f64, unit: &str) -> Quantity {
        let (name, of_name) = name_and_unit(name);
        let unit = if unit.is_empty() { of_name } else { unit.to_string() };
        Quantity { name, number, unit }
    }

    /// The number that a text begins with and the unit behind it, such as `25.6 kHz`; None for other texts.
    pub fn of_text(name: &str, text: &str) -> Option<Quantity> {
        let text = text.split(';').next()?.trim();
        let mut end = text.find(|c: char| !(c.is_ascii_digit() || "+-.,eE".contains(c))).unwrap_or(text.len());
        end -= usize::from(end < text.len() && text[..end].ends_with(['e', 'E']));
        let mut dialect = Dialect { delimiter: Delimiter::Spaces, decimal: Decimal::Open, thousands: false };
        let Cell::Number(number) = dialect.cell(&text.as_bytes()[..end]) else { return None };
        let unit = text[end..].trim();
        Some(Quantity::new(name, number, unit::inner(unit).unwrap_or(unit)))
    }

    /// In s, of a name of a step or of a time.
    fn seconds(&self, vague: bool) -> Option<f64> {
        if self.unit.is_empty() {
            return self.is_clear(vague).then_some(self.number);
        }
        Some(self.number / ticks_of_a_second(&self.unit)?)
    }

    fn hertz(&self, vague: bool) -> Option<f64> {
        if self.unit.is_empty() {
            return self.is_clear(vague).then_some(self.number);
        }
        Some(self.number * hertz(&self.unit)?)
    }

    /// Whether the name alone says what the number is: of Hz or of s.
    fn is_clear(&self, vague: bool) -> bool {
        let name = self.name.as_str();
        !WITH_UNIT.contains(&name) && (vague || !VAGUE.contains(&name))
    }
}

/// The steps of time that the lines above a table give; None where they do not.
pub(crate) fn of_properties(properties: &[(String, String)]) -> Option<Clock> {
    let quantities: Vec<Quantity> =
        properties.iter().filter_map(|(name, text)| Quantity::of_text(name, text)).collect();
    clock(&quantities, true)
}

/// The steps of time that `quantities` hold; None where they do not. `vague` takes names such as `rate` and `start` without
/// a unit.
pub(crate) fn clock(quantities: &[Quantity], vague: bool) -> Option<Clock> {
    let of = |names: &[&str], value: fn(&Quantity, bool) -> Option<f64>| {
        quantities.iter().filter(|q| names.contains(&q.name.as_str())).find_map(|q| value(q, vague))
    };
    let steps = [STEPS.as_slice(), WITH_UNIT.as_slice()].concat();
    let rate = || of(&RATES, Quantity::hertz).filter(|r| *r > 0.0).map(f64::recip);
    let step = of(&steps, Quantity::seconds).or_else(rate).filter(|s| s.is_finite() && *s > 0.0)?;
    Some(Clock { start: of(&STARTS, Quantity::seconds).filter(|s| s.is_finite()).unwrap_or(0.0), step })
}

/// A name as it is compared, and the unit that it may hold at its end.
fn name_and_unit(name: &str) -> (String, String) {
    let plain = |name: &str| name.chars().filter(char::is_ascii_alphanumeric).collect::<String>().to_lowercase();
    let cut = name.trim_end_matches([')', ']']);
    match cut.rsplit_once(['_', '(', '[', ' ']) {
        Some((first, last)) if hertz(last).is_some() || ticks_of_a_second(last).is_some() => {
            (plain(first), last.to_string())
        }
        _ => {
            let (name, unit) = unit::of_name(name);
            (plain(&name), unit)
        }
    }
}

/// A unit of rate in Hz; `mHz` is none, since some write MHz so.
fn hertz(unit: &str) -> Option<f64> {
    if unit == "mHz" {
        return None;
    }
    match unit.to_lowercase().as_str() {
        "hz" | "hertz" | "1/s" | "s/s" | "sa/s" | "samples/s" | "s-1" | "s^-1" => Some(1.0),
        "khz" | "ks/s" | "ksa/s" => Some(1e3),
        "mhz" | "ms/s" | "msa/s" => Some(1e6),
        "ghz" | "gs/s" | "gsa/s" => Some(1e9),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step_of(name: &str, number: f64, unit: &str) -> Option<f64> {
        clock(&[Quantity::new(name, number, unit)], false).map(|c| c.step)
    }

    #[test]
    fn a_clock_is_read_only_where_its_unit_is_clear() {
        assert_eq!(step_of("Sampling Rate", 1000.0, ""), Some(1e-3));
        assert_eq!(step_of("fs", 2.0, "kHz"), Some(5e-4));
        assert_eq!(step_of("fs_kHz", 2.0, ""), Some(5e-4));
        assert_eq!(step_of("Rate [Hz]", 2.0, ""), Some(0.5));
        assert_eq!(step_of("dt", 0.5, "ms"), Some(5e-4));
        assert_eq!(step_of("interval", 10.0, "us"), Some(1e-5));
        for (name, number, unit) in
            [("interval", 0.5, ""), ("rate", 5.0, ""), ("fs", 2.0, "furlong"), ("dt", 0.0, ""), ("dt", f64::NAN, "")]
        {
            assert_eq!(step_of(name, number, unit), None, "{name} {number} {unit}");
        }
        let late = [Quantity::new("wf_increment", 1e-4, ""), Quantity::new("wf_start_offset", -0.5, "")];
        assert_eq!(clock(&late, false), Some(Clock { start: -0.5, step: 1e-4 }));
    }

    #[test]
    fn texts_above_a_table_tell_steps() {
        let step = |name: &str, text: &str| of_properties(&[(name.into(), text.into())]).map(|c| c.step);
        assert_eq!(step("sample_rate", "51.2 kHz"), Some(1.0 / 51200.0));
        assert_eq!(step("Increment", "1,5E-03"), Some(1.5e-3));
        assert_eq!(step("Rate", "1000; Hz"), Some(1e-3));
        assert_eq!((step("Rate", "fast"), step("Interval", "2")), (None, None));
    }
}
