//! The clock that attributes and small datasets give.

use super::attributes::{plain, Value};
use crate::shared::clock::{clock as of_quantities, Quantity};
use crate::Clock;

/// The clock in `values`.
pub(super) fn clock(values: &[Value]) -> Option<Clock> {
    let quantities: Vec<Quantity> = values.iter().filter_map(|v| quantity(v, values)).collect();
    of_quantities(&quantities, false)
}

/// A value as a number with the unit that it, its name, or a value beside it has.
fn quantity(value: &Value, all: &[Value]) -> Option<Quantity> {
    let Some(number) = value.number else {
        return Quantity::of_text(&value.name, value.texts.first().filter(|_| value.texts.len() == 1)?);
    };
    let unit = if value.unit.is_empty() { companion(&value.name, all) } else { value.unit.clone() };
    Some(Quantity::new(&value.name, number, &unit))
}

/// The unit in a value of its own, such as `dt_unit` beside `dt`.
fn companion(name: &str, all: &[Value]) -> String {
    let of = plain(name);
    let is = |v: &&Value| v.number.is_none() && [format!("{of}unit"), format!("{of}units")].contains(&plain(&v.name));
    all.iter().find(is).map_or(String::new(), Value::text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_of_a_value_may_stand_beside_it() {
        let [dt, unit, rate] = [
            Value::of_numbers("dt", &[0.5], String::new()),
            Value::of_texts("dt_unit", vec!["ms".into()]),
            Value::of_texts("sample_rate", vec!["51.2 kHz".into()]),
        ];
        assert_eq!(clock(&[dt, unit]), Some(Clock { start: 0.0, step: 5e-4 }));
        assert_eq!(clock(&[rate]), Some(Clock { start: 0.0, step: 1.0 / 51200.0 }));
    }
}
