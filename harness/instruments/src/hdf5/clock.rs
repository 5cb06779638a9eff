//! The clock that named values give: a rate in Hz or a step in s.

use super::attributes::{plain, Value};
use crate::Clock;

/// Names of a rate; without a unit it is in Hz.
const RATES: [&str; 8] =
    ["samplerate", "samplingrate", "samplefrequency", "samplingfrequency", "fs", "acquisitionrate", "scanrate", "rate"];
/// Names of a step; without a unit it is in s.
const STEPS: [&str; 9] = [
    "dt",
    "deltat",
    "wfincrement",
    "sampleinterval",
    "samplinginterval",
    "sampleperiod",
    "samplingperiod",
    "timestep",
    "xspacing",
];
/// Names that tell a clock only together with a unit of time.
const WITH_UNIT: [&str; 4] = ["interval", "increment", "xincrement", "step"];

/// The clock in `values`; the first that gives one counts.
pub(super) fn clock(values: &[Value]) -> Option<Clock> {
    let step = values.iter().find_map(|v| step(v, values))?;
    let offset = values.iter().find(|v| plain(&v.name) == "wfstartoffset").and_then(|v| v.number);
    Some(Clock { start: offset.filter(|s| s.is_finite()).unwrap_or(0.0), step })
}

/// The step in s that `value` gives.
fn step(value: &Value, all: &[Value]) -> Option<f64> {
    let (name, named_unit) = name_and_unit(&value.name);
    let (number, told_unit) = match value.number {
        Some(number) => (number, String::new()),
        None => number_and_unit(value.texts.first().filter(|_| value.texts.len() == 1)?)?,
    };
    let unit = [told_unit, value.unit.clone(), named_unit, companion(&value.name, all)];
    let unit = unit.into_iter().find(|u| !u.is_empty());
    let step = match unit {
        Some(unit) if RATES.contains(&name.as_str()) => 1.0 / (number * hertz(&unit)?),
        Some(unit) if STEPS.contains(&name.as_str()) || WITH_UNIT.contains(&name.as_str()) => {
            number / ticks_of_a_second(&unit)?
        }
        None if RATES.contains(&name.as_str()) && name != "rate" => 1.0 / number,
        None if STEPS.contains(&name.as_str()) => number,
        _ => return None,
    };
    (step.is_finite() && step > 0.0).then_some(step)
}

/// `sample_rate_kHz` is a name with its unit at its end.
fn name_and_unit(name: &str) -> (String, String) {
    let cut = name.trim_end_matches([')', ']']);
    if let Some((first, last)) = cut.rsplit_once(['_', '(', '[', ' ']) {
        if hertz(last).is_some() || ticks_of_a_second(last).is_some() {
            return (plain(first), last.to_string());
        }
    }
    (plain(name), String::new())
}

/// `25.6 kHz` is a number with its unit.
fn number_and_unit(text: &str) -> Option<(f64, String)> {
    let split = text.rfind(|c: char| c.is_ascii_digit() || c == '.').map_or(0, |at| at + 1);
    Some((text[..split].trim().parse().ok()?, text[split..].trim().to_string()))
}

/// The unit in a value of its own, such as `dt_unit` beside `dt`.
fn companion(name: &str, all: &[Value]) -> String {
    let of = plain(name);
    let is = |v: &&Value| v.number.is_none() && [format!("{of}unit"), format!("{of}units")].contains(&plain(&v.name));
    all.iter().find(is).map_or(String::new(), Value::text)
}

fn hertz(unit: &str) -> Option<f64> {
    match unit {
        "Hz" | "hz" | "HZ" | "1/s" | "S/s" | "Sa/s" | "samples/s" | "Hertz" | "hertz" | "s-1" | "s^-1" => Some(1.0),
        "kHz" | "khz" | "KHz" | "kS/s" => Some(1e3),
        "MHz" | "MS/s" => Some(1e6),
        _ => None,
    }
}

/// How often a unit of time fits into a second; a step divided by it is exact to the last digit.
fn ticks_of_a_second(unit: &str) -> Option<f64> {
    match unit {
        "s" | "sec" | "second" | "seconds" | "Seconds" => Some(1.0),
        "ms" | "msec" | "milliseconds" => Some(1e3),
        "us" | "µs" | "μs" | "usec" | "microseconds" => Some(1e6),
        "ns" | "nanoseconds" => Some(1e9),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(name: &str, number: f64, unit: &str) -> Value {
        Value::of_numbers(name, &[number], unit.into())
    }

    fn text(name: &str, text: &str) -> Value {
        Value::of_texts(name, vec![text.into()])
    }

    fn step_of(values: &[Value]) -> Option<f64> {
        clock(values).map(|c| c.step)
    }

    #[test]
    fn a_clock_is_read_only_where_its_unit_is_clear() {
        assert_eq!(step_of(&[number("Sampling Rate", 1000.0, "")]), Some(1e-3));
        assert_eq!(step_of(&[number("fs", 2.0, "kHz")]), Some(5e-4));
        assert_eq!(step_of(&[number("fs_kHz", 2.0, "")]), Some(5e-4));
        assert_eq!(step_of(&[text("sample_rate", "51.2 kHz")]), Some(1.0 / 51200.0));
        assert_eq!(step_of(&[number("dt", 0.5, ""), text("dt_unit", "ms")]), Some(5e-4));
        assert_eq!(step_of(&[number("interval", 0.5, "")]), None);
        assert_eq!(step_of(&[text("interval", "10 us")]), Some(1e-5));
        assert_eq!(step_of(&[number("fs", 2.0, "furlong")]), None);
        assert_eq!(step_of(&[number("dt", 0.0, "")]), None);
        assert_eq!(step_of(&[number("dt", f64::NAN, "")]), None);
        let late = [number("wf_increment", 1e-4, ""), number("wf_start_offset", -0.5, "")];
        assert_eq!(clock(&late), Some(Clock { start: -0.5, step: 1e-4 }));
    }
}
