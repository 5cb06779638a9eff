//! Axes: the unit a reader thinks in, ticks at round numbers, values in as few digits as distinguish them.

use super::number::NONE;

/// How values lie along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scale {
    Linear,
    /// By powers of ten; what is not positive is not drawn.
    Logarithmic,
}

/// Largest value that is drawn: differences and sums of more leave the range of a double.
pub(crate) const LARGEST: f64 = 1e300;
/// Its decimal logarithm.
const LARGEST_POWER: f64 = 300.0;
/// Value below which ticks are written without a power of ten.
const PLAIN: f64 = 1e9;

/// An axis over a range of SI values, shown in the unit that suits it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Axis {
    /// What is drawn, without its unit.
    pub name: String,
    /// The unit shown, empty for a pure number.
    pub unit: String,
    /// Value shown over value given.
    pub factor: f64,
    pub scale: Scale,
    /// Ends, as given (of a logarithmic axis: their decimal logarithms).
    pub low: f64,
    pub high: f64,
}

/// Units that take a prefix, those written otherwise than they are given, and units that stay.
const PREFIXED: [&str; 6] = ["s", "m", "N", "J", "Hz", "Pa"];
/// Prefixes by power of ten, from the largest on.
const PREFIXES: [(f64, &str); 5] = [(1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "\u{b5}")];
/// Smallest unit, and what is shown in no larger one: nobody writes km of penetration or ks of contact.
const NANO: (f64, &str) = (1e-9, "n");

/// Name and unit of `text`, as in `force [N]`.
fn parted(text: &str) -> (String, String) {
    match text.rsplit_once('[') {
        Some((name, unit)) => (name.trim().into(), unit.trim_end_matches(']').trim().into()),
        None => (text.into(), String::new()),
    }
}

/// Factor and name of the unit in which `most`, given in `unit`, is a number from 1 to 1000.
pub(crate) fn suited(unit: &str, most: f64) -> (f64, String) {
    if unit == "1" {
        return (1.0, String::new());
    }
    if !PREFIXED.contains(&unit) || !most.is_finite() || most <= 0.0 {
        return (1.0, unit.replace("^2", "\u{b2}"));
    }
    let upscaled = !matches!(unit, "s" | "m");
    // a contact of half a millisecond is one in ms
    let from = if unit == "s" { 0.2 } else { 1.0 };
    let fits = |p: &&(f64, &str)| most >= from * p.0 && (upscaled || p.0 <= 1.0);
    let (by, prefix) = PREFIXES.iter().find(fits).copied().unwrap_or(NANO);
    (1.0 / by, format!("{prefix}{unit}"))
}

impl Axis {
    /// The axis of `text` (`name [unit]`) from `low` to `high`, in the unit that suits `most`; None: that suits its ends.
    pub fn new(text: &str, low: f64, high: f64, scale: Scale, most: Option<f64>) -> Axis {
        let suits = most;
        let (name, unit) = parted(text);
        let most = if scale == Scale::Linear { LARGEST } else { LARGEST_POWER };
        let (low, high) = (low.clamp(-most, most), high.clamp(-most, most));
        let (factor, unit) = match scale {
            Scale::Linear => suited(&unit, suits.unwrap_or(low.abs().max(high.abs()))),
            Scale::Logarithmic => (1.0, unit),
        };
        Axis { name, unit, factor, scale, low, high }
    }

    /// Name and unit as they stand beside the axis.
    pub fn title(&self) -> String {
        match (self.name.is_empty(), self.unit.is_empty()) {
            (_, true) => self.name.clone(),
            (true, false) => self.unit.clone(),
            (false, false) => format!("{}, {}", self.name, self.unit),
        }
    }

    /// Where `v` lies, 0 at the low end and 1 at the high one.
    pub fn place(&self, v: f64) -> f64 {
        let v = if self.scale == Scale::Logarithmic { v.log10() } else { v };
        (v - self.low) / (self.high - self.low)
    }

    /// Places and texts of its ticks, `most` at most.
    pub fn ticks(&self, most: usize) -> Vec<(f64, String)> {
        if self.scale == Scale::Logarithmic {
            return self.decades(most);
        }
        let (low, high) = (self.low * self.factor, self.high * self.factor);
        let step = round_step((high - low) / most.max(1) as f64);
        if !step.is_finite() || step <= 0.0 {
            return Vec::new();
        }
        let decimals = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
        let largest = low.abs().max(high.abs());
        let apart = (largest / step).log10().ceil().clamp(0.0, 15.0) as usize;
        let text = |v: f64| if largest < PLAIN { format!("{v:.decimals$}") } else { format!("{v:.apart$e}") };
        let (first, last) = ((low / step).ceil(), (high / step).floor());
        let count = (last - first).clamp(-1.0, 2.0 * most as f64) as i64;
        (0..=count)
            .map(|i| {
                let v = (first + i as f64) * step;
                (self.place(v / self.factor), minus(text(if v == 0.0 { 0.0 } else { v })))
            })
            .collect()
    }

    /// Ticks at powers of ten.
    fn decades(&self, most: usize) -> Vec<(f64, String)> {
        let (first, last) = (self.low.ceil() as i64, self.high.floor() as i64);
        let step = ((last - first).unsigned_abs() as usize / most.max(1) + 1).max(1);
        let text = |n: i64| if (0..=3).contains(&n) { format!("{}", 10f64.powi(n as i32)) } else { format!("1e{n}") };
        (first..=last).step_by(step).map(|n| (self.place(10f64.powi(n as i32)), minus(text(n)))).collect()
    }

    /// A value in the axis' unit, in four digits, without the unit.
    pub fn value(&self, v: f64) -> String {
        minus(digits(v * self.factor))
    }
}

/// Largest number in a unit that several share for the sake of the smallest.
const SHARED: f64 = 1e4;

/// Of several largest values in one SI unit the one whose unit suits them all: the smallest, where that makes no number of the
/// largest that is too long; else the largest. None where there is none.
pub(crate) fn shared(unit: &str, largest: &[f64]) -> Option<f64> {
    let of = || largest.iter().copied().filter(|v| v.is_finite() && *v > 0.0);
    let (least, most) = (of().reduce(f64::min)?, of().reduce(f64::max)?);
    let (factor, _) = suited(unit, least);
    Some(if most * factor < SHARED { least } else { most })
}

/// The unit of an axis given as `name [unit]`; empty where it has none.
pub(crate) fn unit_of(text: &str) -> String {
    parted(text).1
}

/// A quantity given in SI in the unit that suits it, in four digits.
pub fn quantity(v: f64, unit: &str) -> String {
    let (factor, unit) = suited(unit, v.abs());
    format!("{} {unit}", digits(v * factor)).trim_end().replace('-', "\u{2212}")
}

/// Both ends of an interval in the unit that suits the larger.
pub fn interval(low: f64, high: f64, unit: &str) -> String {
    let (factor, unit) = suited(unit, low.abs().max(high.abs()));
    let (low, high) = (digits(low * factor), digits(high * factor));
    format!("{low} to {high} {unit}").trim_end().replace('-', "\u{2212}")
}

/// The round number (1, 2 or 5 times a power of ten) that is not below `raw`.
fn round_step(raw: f64) -> f64 {
    if !raw.is_finite() || raw <= 0.0 {
        return f64::NAN;
    }
    let power = 10f64.powf(raw.log10().floor());
    [1.0, 2.0, 5.0, 10.0].iter().map(|m| m * power).find(|s| *s >= raw * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

/// `v` in four digits.
pub(crate) fn digits(v: f64) -> String {
    let a = v.abs();
    if !a.is_finite() {
        NONE.into()
    } else if a == 0.0 {
        "0".into()
    } else if (1e-3..1e5).contains(&a) {
        let decimals = (3.0 - a.log10().floor()).clamp(0.0, 6.0) as usize;
        format!("{v:.decimals$}")
    } else {
        format!("{v:.3e}")
    }
}

/// A minus sign in the place of a hyphen.
pub(crate) fn minus(text: String) -> String {
    text.replace('-', "\u{2212}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_suits_its_values() {
        for (unit, most, shown) in [
            ("s", 2.1e-3, "ms"),
            ("s", 6.5e-4, "ms"),
            ("s", 3.0, "s"),
            ("m", 2.5e-4, "\u{b5}m"),
            ("m", 4.0, "m"),
            ("m", 4e3, "m"),
            ("N", 1250.0, "kN"),
            ("N", 300.0, "N"),
            ("m", 3e-9, "nm"),
            ("m/s^2", 9000.0, "m/s\u{b2}"),
            ("1", 0.5, ""),
            ("N/m^p", 1e8, "N/m^p"),
        ] {
            assert_eq!(suited(unit, most).1, shown, "{most} {unit}");
        }
        let a = Axis::new("force [N]", -20.0, 1250.0, Scale::Linear, None);
        assert_eq!(quantity(1.529e-4, "m"), "152.9 \u{b5}m");
        assert_eq!(quantity(4.041e8, "N/m^p"), "4.041e8 N/m^p");
        assert_eq!(interval(-1e-5, 2.5e-3, "s"), "\u{2212}0.01000 to 2.500 ms");
        assert_eq!((a.title().as_str(), a.value(1234.56).as_str()), ("force, kN", "1.235"));
    }

    #[test]
    fn charts_beside_each_other_share_a_unit_that_none_of_them_is_too_long_in() {
        // a residual of 250 N below a force of 2500 N, and one of 5 N below 50 kN
        assert_eq!((shared("N", &[2500.0, 250.0]), shared("N", &[5e4, 5.0])), (Some(250.0), Some(5e4)));
        assert_eq!((shared("m", &[3e-4, f64::NAN, 0.0]), shared("m", &[])), (Some(3e-4), None));
        let a = Axis::new("force [N]", 0.0, 2500.0, Scale::Linear, shared("N", &[2500.0, 250.0]));
        assert_eq!((a.title().as_str(), a.value(2500.0).as_str()), ("force, N", "2500"));
    }

    #[test]
    fn ticks_are_round_inside_the_axis_and_not_too_many() {
        for (low, high) in [(0.0, 1.0), (-3.7e-4, 2.2e-3), (1e-9, 1.1e-9), (5.0, 1e6), (-1e5, -3.0)] {
            let a = Axis::new("time [s]", low, high, Scale::Linear, None);
            let ticks = a.ticks(5);
            assert!((2..=6).contains(&ticks.len()), "{low} to {high}: {ticks:?}");
            assert!(ticks.iter().all(|t| (-1e-9..=1.0 + 1e-9).contains(&t.0)), "{ticks:?}");
        }
        assert!(Axis::new("", 1.0, 1.0, Scale::Linear, None).ticks(5).is_empty());
        let log = Axis::new("", -3.0, 0.0, Scale::Logarithmic, None).ticks(5);
        assert_eq!(
            log.iter().map(|t| t.1.as_str()).collect::<Vec<_>>(),
            ["1e\u{2212}3", "1e\u{2212}2", "1e\u{2212}1", "1"]
        );
    }
}
