//! Heat tables: rows by columns, a value and its colour in every cell.

use super::number::NONE;
use super::page::escape;

/// A heat table; values count from 1 (nothing) upwards on a logarithmic colour scale.
pub struct Heat {
    title: String,
    columns: Vec<String>,
    rows: Vec<(String, Vec<Option<f64>>)>,
}

/// Value at which the colour is full.
const FULL: f64 = 20.0;
/// Shade from which ink is light: on either side of it ink and shade have a contrast of 4.5 at least.
pub(super) const DEEP: f64 = 0.795;

impl Heat {
    /// An empty table; a column's name may be two lines, parted by `\n`.
    pub fn new(title: &str, columns: &[String]) -> Heat {
        Heat { title: title.into(), columns: columns.to_vec(), rows: Vec::new() }
    }

    /// Adds a row; None where there is nothing to show.
    pub fn row(mut self, name: &str, values: &[Option<f64>]) -> Heat {
        self.rows.push((name.into(), values.to_vec()));
        self
    }

    /// The table as HTML.
    pub(crate) fn html(&self) -> String {
        let head: String = self
            .columns
            .iter()
            .map(|c| format!("<th scope=\"col\">{}</th>", escape(c).replace('\n', "<br>")))
            .collect();
        let cell = |v: &Option<f64>| match v {
            Some(v) if v.is_finite() => {
                let u = shade(*v);
                let deep = if u > DEEP { " class=\"deep\"" } else { "" };
                format!("<td{deep} data-v=\"{v:e}\" style=\"--u:{:.0}%\">{v:.1}</td>", 100.0 * u)
            }
            _ => format!("<td class=\"none\">{NONE}</td>"),
        };
        let rows: String = self
            .rows
            .iter()
            .map(|(name, values)| {
                let cells: String = values.iter().map(cell).collect();
                format!("<tr><th scope=\"row\">{}</th>{cells}</tr>\n", escape(name))
            })
            .collect();
        let title = escape(&self.title);
        format!(
            "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{title}\"><table class=\"heat\">\
             <caption>{title}</caption><thead><tr><td></td>{head}</tr></thead><tbody>{rows}</tbody></table></div>\n"
        )
    }
}

/// 0 at noise to 1 at `FULL` times noise, of a finite `v`.
fn shade(v: f64) -> f64 {
    ((v.max(1e-9) / 1.1).ln() / FULL.ln()).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_no_colour_and_what_stands_out_has_all() {
        assert_eq!((shade(1.0), shade(50.0), shade(f64::MAX)), (0.0, 1.0, 1.0));
        let h = Heat::new("a < b", &["force\nloading".into()])
            .row("0.1 m", &[Some(3.25)])
            .row("x", &[None, Some(f64::NAN)])
            .html();
        assert!(
            h.contains("a &lt; b") && h.contains(">3.2<") && h.matches("<td").count() == 4 && h.contains("force<br>")
        );
    }
}
