//! Tables with numbers in them: a column of one quantity in one unit, every digit kept for a file of values.

use super::axis::{digits, interval, minus, quantity, shared, suited};
use super::page::{escape, safe_text, tight};

/// A cell of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Datum {
    /// Words.
    Text(String),
    /// A number in SI with its unit, `1` for a pure number, shown in the unit that suits its column.
    Number(f64, String),
    /// Both ends of an interval in SI.
    Interval(f64, f64, String),
    /// A number in SI with its unit, shown as said.
    Said(f64, String, String),
}

impl Datum {
    /// A number in SI with its unit; `1` for a pure number.
    pub fn number(value: f64, unit: &str) -> Datum {
        Datum::Number(value, unit.into())
    }

    /// As [`Datum::number`], and a dash where there is none.
    pub fn maybe(value: Option<f64>, unit: &str) -> Datum {
        value.map_or_else(|| "-".into(), |v| Datum::number(v, unit))
    }

    /// Both ends of an interval in SI with their unit.
    pub fn interval(low: f64, high: f64, unit: &str) -> Datum {
        Datum::Interval(low, high, unit.into())
    }

    /// A share, shown in per cent with so many decimals.
    pub fn percent(share: f64, decimals: usize) -> Datum {
        Datum::Said(share, "1".into(), format!("{:.decimals$} %", 100.0 * share))
    }

    /// A pure number, shown with so many decimals.
    pub fn fixed(value: f64, decimals: usize) -> Datum {
        Datum::Said(value, "1".into(), format!("{value:.decimals$}"))
    }

    /// A number in SI with its unit, shown as `text`.
    pub fn said(value: f64, unit: &str, text: &str) -> Datum {
        Datum::Said(value, unit.into(), text.into())
    }

    fn unit(&self) -> Option<&str> {
        match self {
            Datum::Text(_) => None,
            Datum::Number(_, u) | Datum::Interval(_, _, u) | Datum::Said(_, u, _) => Some(u),
        }
    }

    /// Its largest magnitude, where it is shown in a unit that suits it.
    fn largest(&self) -> Option<f64> {
        match self {
            Datum::Number(v, _) => Some(v.abs()),
            Datum::Interval(a, b, _) => Some(a.abs().max(b.abs())),
            Datum::Text(_) | Datum::Said(..) => None,
        }
    }
}

impl From<&str> for Datum {
    fn from(text: &str) -> Datum {
        Datum::Text(text.into())
    }
}

impl From<String> for Datum {
    fn from(text: String) -> Datum {
        Datum::Text(text)
    }
}

/// How a column is written: one SI unit in all its cells, and what they are shown in.
struct Column {
    unit: Option<String>,
    /// Factor and name of the unit that all its numbers are shown in; None where each has its own.
    shown: Option<(f64, String)>,
}

impl Column {
    fn of(rows: &[Vec<Datum>], k: usize) -> Column {
        let cells = || rows.iter().filter_map(|r| r.get(k));
        let mut units: Vec<&str> = cells().filter_map(Datum::unit).collect();
        units.dedup();
        let [unit] = units[..] else { return Column { unit: None, shown: None } };
        let largest: Vec<f64> = cells().filter_map(Datum::largest).collect();
        let shown = shared(unit, &largest).or(largest.first().copied()).map(|most| suited(unit, most));
        Column { unit: Some(unit.into()), shown }
    }

    fn head(&self, name: &str) -> String {
        let unit = self.shown.as_ref().map(|s| s.1.as_str()).filter(|u| !u.is_empty());
        let text = unit.map_or(name.to_string(), |u| format!("{name}, {u}"));
        let unit = self.unit.as_ref().map_or(String::new(), |u| format!(" data-u=\"{}\"", escape(u)));
        format!("<th data-n=\"{}\"{unit}>{}</th>", escape(name), safe_text(&text))
    }

    fn cell(&self, d: &Datum) -> String {
        let (values, text) = match (d, &self.shown) {
            (Datum::Text(text), _) => (None, text.clone()),
            (Datum::Said(v, _, text), _) => (Some(full(*v)), signed(text)),
            (Datum::Number(v, _), Some((factor, _))) => (Some(full(*v)), minus(digits(v * factor))),
            (Datum::Number(v, u), None) => (Some(full(*v)), quantity(*v, u)),
            (Datum::Interval(a, b, _), Some((factor, _))) => {
                (Some(both(*a, *b)), minus(format!("{} to {}", digits(a * factor), digits(b * factor))))
            }
            (Datum::Interval(a, b, u), None) => (Some(both(*a, *b)), interval(*a, *b, u)),
        };
        let values = values.map_or(String::new(), |v| format!(" data-v=\"{v}\""));
        let own = d.unit().filter(|_| self.unit.is_none());
        let own = own.map_or(String::new(), |u| format!(" data-u=\"{}\"", escape(u)));
        format!("<td{values}{own}>{}</td>", tight(&safe_text(&text)))
    }
}

/// A text that begins with a negative number, with a minus for its hyphen.
fn signed(text: &str) -> String {
    match text.strip_prefix('-') {
        Some(rest) if rest.starts_with(|c: char| c.is_ascii_digit()) => format!("\u{2212}{rest}"),
        _ => text.into(),
    }
}

/// A number with all its digits; empty where it is none.
fn full(v: f64) -> String {
    if v.is_finite() {
        format!("{v:e}")
    } else {
        String::new()
    }
}

fn both(low: f64, high: f64) -> String {
    format!("{} {}", full(low), full(high))
}

/// The table as HTML.
pub(crate) fn table(head: &[&str], rows: &[Vec<Datum>]) -> String {
    let columns: Vec<Column> = (0..head.len()).map(|k| Column::of(rows, k)).collect();
    let heads: String = columns.iter().zip(head).map(|(c, name)| c.head(name)).collect();
    let row = |r: &Vec<Datum>| {
        let cells: String = columns.iter().zip(r).map(|(c, d)| c.cell(d)).collect();
        format!("<tr>{cells}</tr>\n")
    };
    let name = head.first().copied().unwrap_or("table");
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"Table by {}\"><table><thead><tr>{heads}</tr></thead><tbody>{}</tbody></table></div>\n",
        escape(name),
        rows.iter().map(row).collect::<String>()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_of_one_quantity_has_one_unit_and_keeps_its_digits() {
        let n = |v| Datum::number(v, "N");
        let h = table(&["file", "peak"], &[vec!["a".into(), n(437.12345678)], vec!["b".into(), n(2500.0)]]);
        assert!(h.contains("data-u=\"N\">peak, N</th>") && !h.contains("kN"), "{h}");
        assert!(h.contains("data-v=\"4.3712345678e2\">437.1</td>") && h.contains(">2500</td>"), "{h}");
        // what differs by more than one unit can show
        let h = table(&["peak"], &[vec![n(5.0)], vec![n(5e4)]]);
        assert!(h.contains("peak, kN") && h.contains(">50.00</td>"), "{h}");
    }

    #[test]
    fn where_units_differ_every_cell_has_its_own() {
        let rows = [vec![Datum::number(1.5e-4, "m")], vec![Datum::interval(1e3, 2e3, "N")], vec!["held <x>".into()]];
        let h = table(&["value"], &rows);
        assert!(h.contains("data-u=\"m\">150.0 \u{b5}m<") && h.contains("data-v=\"1e3 2e3\" data-u=\"N\""), "{h}");
        assert!(h.contains("<td>held &lt;x&gt;</td>"));
    }

    #[test]
    fn what_is_no_number_is_a_dash_and_a_share_is_in_per_cent() {
        let rows = [vec![Datum::percent(0.0123, 2)], vec![Datum::percent(f64::NAN, 2)], vec![Datum::maybe(None, "N")]];
        let h = table(&["misfit"], &rows);
        assert!(h.contains("data-v=\"1.23e-2\">1.23\u{a0}%") && h.contains("data-v=\"\">\u{2013}\u{a0}%"), "{h}");
        assert!(!h.contains("NaN"));
        assert!(table(&["q"], &[vec![Datum::percent(-0.021, 2)]]).contains(">\u{2212}2.10\u{a0}%"));
    }
}
